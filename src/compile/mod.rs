//! From a [`World`](crate::world::World) to a scene that can be rendered: one system in each file, each a function
//! from components to columns. Everything is in the order of the entities in the world.

mod camera;
mod classic;
pub(crate) mod compiled;
mod contacts;
mod emitters;
mod environment;
mod geometry;
mod glow;
mod idle;
mod ignored;
pub(crate) mod light_tree;
mod lights;
mod made;
mod materials;
mod misplaced;
mod open_surfaces;
mod photometric;
mod sky;
mod sound;
mod textures;

pub use crate::scene::CompiledScene;
pub use camera::camera_names;
pub use compiled::compile;
pub(crate) use compiled::{Compiled, NO_LIGHT, compile_after, shines};
pub(crate) use lights::light_names;
pub(crate) use open_surfaces::thin_sheets;
#[cfg(feature = "python")]
pub(crate) use sound::{check_mesh, check_settings};
