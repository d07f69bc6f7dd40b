//! Light transport: the functions that evaluate light at one vertex ([`transport`]), written once over lanes, and two
//! schedules ([`schedule`]) that move rays through them.
//!
//! Each module imports only from those before it.

pub mod observe;
pub mod path;
pub mod photons;
pub mod reuse;
pub mod schedule;
pub mod setup;
pub mod transport;

pub use observe::statistics::{RayCounts, RayStatistics, Stage};
pub use observe::stop::Stop;
pub use schedule::work::{Schedule, Sorting, Work};
pub use schedule::worker::Worker;
pub use setup::RenderSetup;
