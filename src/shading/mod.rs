//! Physics at one vertex: pure functions over lanes, from compiled columns to numbers.
//! Nothing in here traces a ray or knows of queues.

pub mod blinn_phong;
pub mod camera;
pub mod details;
pub mod emitter;
pub mod environment;
pub mod fresnel;
pub mod light;
pub mod light_tree;
pub mod material;
pub mod principled;
pub mod sampled;
pub mod surface;
pub mod texture;

pub use light::{LightSample, sample_light};
pub use material::Shaded;
pub use surface::{HitLanes, Surface};
