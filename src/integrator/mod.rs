//! Light transport: the functions that evaluate light at one vertex ([`whitted`], [`path_tracing`]), written once over
//! lanes, and two schedules that move rays through them: [`recursive`], depth first and pixel by pixel, and
//! [`wavefront`], breadth first and queue by queue.

pub mod any_hit;
pub mod bounces;
pub mod camera_path;
pub mod direct;
pub mod medium;
mod medium_light;
mod mis;
pub mod observe;
pub mod onward;
pub mod path;
pub mod path_event;
pub mod path_tracing;
pub mod photons;
pub mod recursive;
pub mod reuse;
pub mod setup;
pub mod shadow;
pub mod statistics;
pub mod stop;
mod termination;
pub mod transparent_shadow;
pub mod wavefront;
pub mod whitted;
pub mod worker;

pub use setup::RenderSetup;
pub use statistics::{RayCounts, RayStatistics, Stage};
pub use stop::Stop;
pub use worker::{Schedule, Sorting, Work, Worker};
