//! Compiles a [`World`](crate::world::World) into a scene that can be rendered: one system in each file, each a
//! function from components to columns, in the order of the entities in the world.

mod camera;
mod catmull_clark;
mod classic;
pub(crate) mod compiled;
mod contacts;
mod copies;
mod emitter_bounds;
mod emitters;
mod environment;
mod geometry;
mod ineffective_values;
mod light_groups;
pub(crate) mod light_tree;
mod lights;
mod materials;
mod memo;
mod misplaced;
mod modifiers;
mod open_surfaces;
mod origin;
mod parallelogram;
mod photometric;
mod shape_meshes;
mod sky;
mod textured_emission;
mod textures;
mod unsupported_by_transport;
mod validate;

pub use crate::scene::CompiledScene;
pub use camera::camera_names;
pub use compiled::compile;
pub(crate) use compiled::{MemoizedScene, compile_after, emits, no_light};
pub(crate) use lights::light_names;
pub(crate) use open_surfaces::thin_sheets;
#[cfg(feature = "python")]
pub(crate) use validate::{check_mesh, check_settings};
