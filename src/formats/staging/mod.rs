//! Staging: what a scene gets beyond its file: a camera and a light where they lack, other surroundings, changes of values.

mod auto_camera;
pub(super) mod bounding_points;
mod edits;
mod emission;
mod framing;
mod lens;
pub(crate) mod load;
mod studio;
mod surroundings;

#[cfg(feature = "python")]
pub(crate) use auto_camera::has_added_camera;
pub(crate) use load::load_again;
pub use load::{load, load_with};
