//! The physics of one vertex: pure functions over lanes that read the compiled columns. They trace no rays and do not
//! depend on queues.

pub mod blinn_phong;
pub mod boundary;
mod bump;
pub mod camera;
pub mod crossing;
pub mod emitter;
pub mod emitter_rays;
pub mod environment;
pub mod footprint;
pub mod fresnel;
pub mod light_tree;
pub mod normals;
pub mod packed_normal;
mod photometric;
pub mod point;
pub mod principled;
mod procedural;
pub mod solid_angle;
pub mod surface;
pub mod texture_coordinates;
pub mod texture_lookup;
pub mod unseen_lamps;
mod vertices;
pub mod whitted_params;

pub use point::ShadingPoint;
pub use surface::{HitLanes, Surface};
