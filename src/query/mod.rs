//! Ray queries by themselves, for programs that shade in their own way or not at all.

mod batch;

pub use batch::{HitBatch, RayBatch};
