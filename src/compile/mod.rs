//! World to scene: one system a file, each a function from components to columns.
//! The order of everything is that of the entities in the world.

mod camera;
mod classic;
pub(crate) mod compiled;
mod emitters;
mod environment;
mod geometry;
mod glow;
mod ignored;
pub(crate) mod light_tree;
mod lights;
mod made;
mod materials;
mod sky;
mod textures;

pub use crate::scene::CompiledScene;
pub use camera::camera_names;
pub use compiled::compile;
pub(crate) use compiled::{Compiled, compile_after};
pub(crate) use lights::light_names;
