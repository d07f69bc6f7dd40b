//! rayfront: a CPU renderer with one light transport and two schedules.
pub mod error;
pub mod film;
pub mod formats;
pub mod math;
pub mod world;
