//! The compiled scene: immutable arrays, indexed by integer ids, that the integrators
//! read. Nothing in here knows about entities. Filled by [`crate::compile`].

pub mod camera;
pub mod emitters;
pub mod environment;
pub mod geometry;
pub mod light_tree;
pub mod lights;
pub mod materials;
pub mod principled;
pub mod textures;

pub use camera::{Camera, Projection};
pub use emitters::Emitters;
pub use environment::Environment;
pub use geometry::{Geometry, Part};
pub use light_tree::LightTree;
pub use lights::Light;
pub use materials::Materials;
pub use textures::Textures;

use crate::bvh::Bvh;
use crate::math::{Aabb, Rgb};

/// All that rendering needs to know of a world.
#[derive(Debug)]
pub struct CompiledScene {
    /// What is looked through.
    pub camera: Camera,
    /// Vertices, triangles and spheres with what shading needs of them.
    pub geometry: Geometry,
    /// The same geometry in the order of rays.
    pub bvh: Bvh,
    /// How surfaces answer light.
    pub materials: Materials,
    /// Pictures and how they are looked up.
    pub textures: Textures,
    /// In the order of their entities.
    pub lights: Vec<Light>,
    /// How surfaces answer light under the path transport, by material id.
    pub principled: Vec<principled::Principled>,
    /// Everything that lights a surface, for the path transport.
    pub emitters: Emitters,
    /// What rays see that hit nothing.
    pub environment: Environment,
    /// Whether rays may have to go on behind a surface as if it were not there.
    pub has_cutouts: bool,
    /// Radiance that every surface sends back times its diffuse colour.
    pub ambient: Rgb,
    /// Around everything that can be hit.
    pub bounds: Aabb,
    /// What compilation noticed that is no error, one line each.
    pub warnings: Vec<String>,
}

/// Bytes by what they are for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory {
    /// Vertices, indices, spheres.
    pub geometry: usize,
    /// The acceleration structure.
    pub bvh: usize,
    /// Decoded pictures.
    pub textures: usize,
}

impl CompiledScene {
    /// What it takes.
    pub fn memory(&self) -> Memory {
        Memory { geometry: self.geometry.bytes(), bvh: self.bvh.bytes(), textures: self.textures.bytes() }
    }
}
