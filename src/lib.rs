//! rayfront: a CPU renderer with two light transports and two schedules of each.

#![deny(unsafe_code)]

pub mod bvh;
pub mod check;
pub mod cli;
pub mod compile;
pub mod denoise;
pub mod error;
pub mod files;
pub mod film;
pub mod formats;
pub mod integrator;
pub mod math;
pub mod memory;
pub mod query;
pub mod render;
pub mod sampling;
pub mod scene;
pub mod shading;
pub mod simd;
pub mod study;
pub mod view;
pub mod world;

/// Compiles and runs the example of the README with the other examples.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
