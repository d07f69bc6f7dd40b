//! Rendering: passes of samples, cut into tiles that workers render and merge into the film.
//!
//! ```
//! use rayfront::render::{Options, Session};
//! use rayfront::world::{Camera, Light, Falloff, Shape, World, Transform};
//! use rayfront::math::{DVec3, Quat, Rgb, Vec3};
//!
//! let mut world = World::default();
//! world.settings.size = [32, 32];
//! world.settings.samples = 4;
//! let at = |x, y, z| Transform::Trs {
//!     translation: DVec3::new(x, y, z), rotation: Quat::IDENTITY, scale: Vec3::ONE,
//! };
//! world.entities.spawn((Camera::Pinhole { vertical_fov: 0.8 }, at(0.0, 0.0, 5.0)));
//! world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, Transform::IDENTITY));
//! let lamp = Light::Point { power_w: Rgb::splat(500.0), falloff: Falloff::InverseSquare, radius_m: 0.0 };
//! world.entities.spawn((lamp, at(2.0, 3.0, 4.0)));
//!
//! let scene = rayfront::compile::compile(&world, None)?;
//! let mut session = Session::new(scene, &world.settings, Options::default());
//! while !session.is_done() {
//!     session.advance(1);
//! }
//! let pixels = session.film().radiance();
//! assert!(pixels[16 * 32 + 16].r > 0.0, "the ball is lit");
//! assert_eq!(pixels[0].r, 0.0, "around it is nothing");
//! # Ok::<(), rayfront::error::CompileError>(())
//! ```

pub(crate) mod adaptive;
mod aov;
pub(crate) mod camera_medium;
mod costs;
#[cfg(any(feature = "cli", feature = "python"))]
mod memory_estimate;
mod observed;
mod options;
mod passes;
pub(crate) mod photons;
pub(crate) mod prepare;
pub(crate) mod render_state;
pub(crate) mod session;
mod threads;

pub use crate::denoise::Denoised;
pub use crate::integrator::{Schedule, Sorting};
pub use crate::simd::Isa;
pub(crate) use aov::{film_channels, light_channels, names_of_ids};
#[doc(hidden)]
pub use costs::PixelCost;
#[cfg(any(feature = "cli", feature = "python"))]
pub(crate) use memory_estimate::MemoryEstimate;
pub(crate) use observed::Span;
pub use options::{DEFAULT_WAVE, Options};
pub(crate) use prepare::setup;
pub(crate) use render_state::{RenderPass, RenderState};
pub use session::Session;
pub(crate) use session::{Look, OnProgress, Progress, tiles};
pub use threads::{ThreadError, on_threads};
pub(crate) use threads::{check_environment, thread_pool};
