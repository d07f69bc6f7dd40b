//! rayfront: a CPU renderer with one light transport and two schedules.
pub mod error;
pub mod formats;
pub mod math;
pub mod world;
