//! The compiled scene: immutable arrays, indexed by integer ids, that the integrators
//! read. Nothing in here knows about entities. Filled by [`crate::compile`].

pub mod camera;
pub mod emitters;
pub mod environment;
pub mod geometry;
pub mod light_tree;
pub mod lights;
pub mod material;
pub mod textures;

pub use camera::{Aperture, Camera, Projection};
pub use emitters::Emitters;
pub use environment::Environment;
pub use geometry::{Geometry, Part};
pub use light_tree::LightTree;
pub use lights::LightSamples;
pub use material::Material;
pub use textures::Textures;

use std::sync::Arc;

use crate::bvh::Bvh;
use crate::math::{Aabb, Rgb, Vec3};
use emitters::kind;

/// All that rendering needs to know of a world.
#[derive(Debug)]
pub struct CompiledScene {
    /// What is looked through.
    pub camera: Camera,
    /// The opening of its lens, if that is not round.
    pub aperture: Option<Aperture>,
    /// Vertices, triangles and spheres with what shading needs of them.
    pub geometry: Geometry,
    /// The same geometry in the order of rays.
    pub bvh: Arc<Bvh>,
    /// How surfaces answer light, by material id.
    pub materials: Vec<Material>,
    /// What people call them.
    pub material_names: Vec<String>,
    /// Pictures and how they are looked up.
    pub textures: Textures,
    /// Everything that lights a surface.
    pub emitters: Emitters,
    /// Those that are light entities, in their order, and how Whitted's transport samples them.
    pub lights: Vec<LightSamples>,
    /// What rays see that hit nothing.
    pub environment: Environment,
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
    /// About the radiance of the brightest thing that can be seen, and what surfaces are lit by: both in
    /// proportion to all light that there is.
    pub fn levels(&self) -> (f32, f32) {
        let far = self.bounds.size().length().max(1e-6);
        let (mut brightest, mut usual) = self.environment.levels();
        let mut note = |bright: f32, lit: f32| {
            (brightest, usual) = (brightest.max(bright), usual.max(lit));
        };
        note(self.ambient.max_component(), self.ambient.max_component());
        for emitter in 0..self.emitters.len() as u32 {
            let (kind, row) = self.emitters.row(emitter);
            let light = Rgb::new(row[10], row[11], row[12]).max_component();
            let vector = |at: usize| Vec3::from_slice(&row[at..]);
            let seen = |area: f32| light * (area / (far * far)).min(1.0);
            match kind {
                kind::TRIANGLE | kind::QUAD => note(light, seen(vector(3).cross(vector(6)).length())),
                kind::SPHERE => note(light, seen(std::f32::consts::PI * row[9] * row[9])),
                // What has no extent is seen by the light that it throws.
                kind::POINT | kind::SPOT | kind::PHOTOMETRIC if row[9] > 0.0 => {
                    note(light / (far * far), light / (far * far))
                }
                _ => note(light, light),
            }
        }
        (brightest, usual)
    }

    /// What it takes.
    pub fn memory(&self) -> Memory {
        Memory { geometry: self.geometry.bytes(), bvh: self.bvh.bytes(), textures: self.textures.bytes() }
    }
}
