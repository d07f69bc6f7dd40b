//! Light transport: what happens to light at one vertex ([`whitted`], [`path_tracing`]), written
//! once over lanes, and two schedules that move rays through it: [`recursive`], depth first and
//! pixel by pixel, and [`wavefront`], breadth first and queue by queue.

pub mod begin;
pub mod bounces;
pub mod decision;
pub mod direct;
mod ends;
pub mod frame;
pub mod medium;
mod mis;
pub mod observe;
pub mod onward;
pub mod path;
pub mod path_tracing;
pub mod photons;
pub mod presence;
pub mod recursive;
pub mod shadow;
pub mod sharing;
pub mod statistics;
pub mod stop;
pub mod straight;
pub mod wavefront;
pub mod whitted;
mod within;
pub mod worker;

pub use frame::Frame;
pub use statistics::{RayCounts, Stage, Statistics};
pub use stop::Stop;
pub use worker::{Schedule, Sorting, Work, Worker};
