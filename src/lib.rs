//! A renderer for the CPU, as a library: scenes in, images out, or rays in and hits out. The same scene with the same
//! settings gives the same image to the last bit, on every machine and with any number of threads.
//!
//! | to | use | feature |
//! |---|---|---|
//! | trace rays through triangles, spheres and instances | [`query`] | none |
//! | make a scene in a program | [`world`] | `render` |
//! | render it | [`compile`], then [`render`] | `render` |
//! | access its pixels | [`film`] | `render` |
//! | read scenes, models and images; save images and scenes | [`formats`] | `formats` |
//! | handle errors | [`error`] | `render` |
//!
//! ```
//! use rayfront::{compile::compile, formats, render::{Options, Session}};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let image = folder.path().join("ball.png");
//! # std::fs::write(
//! #     folder.path().join("ball.ron"),
//! #     "(settings: (size: (16, 9), samples: 1), entities: [(shape: Sphere(radius_m: 1)), \
//! #     (name: \"top\", camera: Pinhole(vertical_fov_degrees: 40), transform: (translate: (0, 0, 5)))])",
//! # )?;
//! # std::env::set_current_dir(&folder)?;
//! let world = formats::load("ball.ron")?;
//! let scene = compile(&world, Some("top"))?;                             // through the camera of that name
//! let mut session = Session::new(scene, &world.settings, Options::default());
//! session.finish(|part| eprint!("\r{:3.0} %", 100.0 * part));
//! formats::save_image("ball.png", session.film(), &world.settings)?;
//! # assert!(image.exists());
//! # Ok(())
//! # }
//! ```
//!
//! Lengths are in metres, angles in radians, powers in watts; colours are linear with the primaries of Rec. 709 (those
//! of sRGB). Cameras look along −Z, +Y is up.
//!
//! # Features
//!
//! | feature | brings | by default |
//! |---|---|---|
//! | none | [`query`] and [`math`] | |
//! | `render` | worlds and images of them | yes |
//! | `formats` | `render`, and files | yes |
//! | `study` | `formats`, and the experiments of the program | yes |
//! | `cli` | `study`, and the program `rayfront` | yes |
//! | `draco` | glTF files with KHR_draco_mesh_compression | yes |
//! | `basisu` | glTF files with KHR_texture_basisu | |
//! | `python` | `formats` and `draco`, and the Python module | |
//!
//! For ray queries only: `default-features = false`. To render and to read files:
//! `default-features = false, features = ["formats", "draco"]`.
//!
//! Nothing outside these modules is part of the public interface, even where it is `pub`: see [`internals`].

#![deny(unsafe_code)]
// This page links to modules that come with features.
#![cfg_attr(not(feature = "formats"), allow(rustdoc::broken_intra_doc_links))]
// Without `cli`, items that only the program uses are dead code.
#![cfg_attr(not(feature = "cli"), allow(dead_code, unused_imports))]

mod bvh;
#[cfg(any(feature = "study", feature = "python"))]
mod check;
#[cfg(feature = "cli")]
mod cli;
#[cfg(feature = "render")]
pub mod compile;
#[cfg(feature = "render")]
mod denoise;
#[cfg(feature = "render")]
pub mod error;
#[cfg(feature = "render")]
mod files;
#[cfg(feature = "render")]
pub mod film;
#[cfg(feature = "formats")]
pub mod formats;
#[cfg(feature = "render")]
mod integrator;
pub mod internals;
pub mod math;
#[cfg(feature = "render")]
mod memory;
#[cfg(feature = "python")]
// PyO3's macros generate the unsafe functions that Python calls.
#[allow(unsafe_code)]
mod python;
pub mod query;
#[cfg(feature = "render")]
pub mod render;
#[cfg(feature = "render")]
mod sampling;
#[cfg(feature = "render")]
mod scene;
#[cfg(feature = "render")]
mod shading;
mod simd;
#[cfg(feature = "study")]
mod study;
#[cfg(all(test, feature = "render"))]
mod tests;
#[cfg(feature = "cli")]
mod view;
#[cfg(feature = "render")]
pub mod world;

/// Compiles and runs the guide's examples as doctests.
#[cfg(all(doctest, feature = "formats"))]
#[doc = include_str!("LIBRARY.md")]
struct Guide;
