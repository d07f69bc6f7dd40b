//! The compiled scene: immutable arrays, indexed by integer ids, that the integrators read and [`crate::compile`]
//! fills. It holds no entities.

pub mod bodies;
pub mod camera;
pub mod emitter_rows;
pub mod emitters;
pub mod environment;
pub mod geometry;
pub mod light_tree;
pub mod lights;
pub mod material;
pub mod procedures;
pub mod textures;

use std::collections::HashMap;
use std::fmt::{Debug, Write};
use std::sync::Arc;

use xxhash_rust::xxh3::Xxh3;

use crate::bvh::{AnyHitFilter, Bvh, Stack, closest_ray};
use crate::error::Diagnostic;
use crate::math::{Aabb, DVec3, NONE, Ray, Rgb, Vec3, Vector};
use crate::simd::Isa;
pub use bodies::Bodies;
pub use camera::{Aperture, CompiledCamera, HalfSize, Lens, Perspective, Projection, StereoPair};
use emitter_rows::{AnyRow, PlanarRow, PointRow, SphereRow};
pub use emitters::Emitters;
use emitters::kind;
pub use environment::Environment;
pub use geometry::{Geometry, Part};
pub use light_tree::LightTree;
pub use lights::WhittedLight;
pub use material::MaterialRecord;
pub use textures::Textures;

/// A compiled world: built by [`crate::compile::compile`], rendered by [`crate::render::Session::new`]. Large parts are
/// behind pointers, so clones are cheap.
#[derive(Clone, Debug)]
pub struct CompiledScene {
    /// The point of world space that all positions of the scene are relative to: (0, 0, 0) unless shapes are far from
    /// there.
    #[doc(hidden)]
    pub origin: DVec3,
    /// The camera.
    #[doc(hidden)]
    pub camera: CompiledCamera,
    /// The shape of the lens's opening, if it is not round.
    pub(crate) aperture: Option<Aperture>,
    /// Vertices, triangles and spheres with their shading data.
    #[doc(hidden)]
    pub geometry: Arc<Geometry>,
    /// The acceleration structure over the same geometry.
    #[doc(hidden)]
    pub bvh: Arc<Bvh>,
    /// Materials by material id.
    pub(crate) materials: Vec<MaterialRecord>,
    /// The bodies that materials enclose.
    pub(crate) bodies: Bodies,
    /// Human-readable names of the materials.
    pub(crate) material_names: Vec<String>,
    /// The materials of the last records, which are variants for sheets: these have no front.
    pub(crate) sheets: Vec<u32>,
    /// Images and the parameters of texture lookups.
    #[doc(hidden)]
    pub textures: Arc<Textures>,
    /// All emitters.
    #[doc(hidden)]
    pub emitters: Arc<Emitters>,
    /// The emitters that are light entities, in the order of the entities, with the sampling parameters of Whitted's
    /// transport.
    pub(crate) lights: Vec<WhittedLight>,
    /// The background of rays that hit nothing.
    pub(crate) environment: Arc<Environment>,
    /// The names of the light groups.
    pub(crate) light_groups: Vec<String>,
    /// The light group of the environment, or [`NONE`].
    pub(crate) around_group: u32,
    /// Ambient radiance: every surface reflects it times its diffuse colour.
    pub(crate) ambient: Rgb,
    /// The bounding box of all geometry.
    pub(crate) bounds: Aabb,
    /// Warnings of the loader and the compiler, one line each.
    pub warnings: Vec<Diagnostic>,
}

/// A hash of a value's debug text, which is different for any two floats. The text is streamed, never stored as a
/// whole.
fn digest(value: &dyn Debug) -> u128 {
    struct Digest(Xxh3);

    impl Write for Digest {
        fn write_str(&mut self, text: &str) -> std::fmt::Result {
            self.0.update(text.as_bytes());
            Ok(())
        }
    }

    let mut digest = Digest(Xxh3::new());
    // Writing to a hash cannot fail.
    let _ = write!(digest, "{value:?}");
    digest.0.digest128()
}

/// Memory use by purpose, in bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct SceneMemory {
    /// Vertices, indices and spheres.
    pub geometry: usize,
    /// The acceleration structure.
    pub bvh: usize,
    /// Decoded images.
    pub textures: usize,
    /// Emitters and environment.
    pub lights: usize,
}

impl SceneMemory {
    /// The sum of all parts.
    pub fn total(&self) -> usize {
        self.geometry + self.bvh + self.textures + self.lights
    }
}

impl CompiledScene {
    /// Returns a position of the scene in world space.
    pub(crate) fn in_world(&self, position: Vec3) -> DVec3 {
        self.origin + position.as_dvec3()
    }

    /// The id of the material that a record belongs to.
    pub(crate) fn material_id(&self, record: u32) -> u32 {
        let own = self.materials.len() - self.sheets.len();
        (record as usize).checked_sub(own).map_or(record, |place| self.sheets[place])
    }

    /// Estimates the radiance of the brightest visible thing and that of typical illumination of surfaces. Both are
    /// proportional to the total light in the scene.
    pub(crate) fn levels(&self) -> (f32, f32) {
        let far = self.bounds.size().length().max(1e-6);
        let (mut brightest, mut usual) = self.environment.levels();
        let mut lamps = Vec::new();
        let mut note = |bright: f32, lit: f32| {
            (brightest, usual) = (brightest.max(bright), usual.max(lit));
        };
        note(self.ambient.max_component(), self.ambient.max_component());
        let mut textures = HashMap::new();
        let mut brightness = |texture: u32| {
            if texture == NONE {
                return (1.0, 1.0);
            }
            *textures
                .entry(texture)
                .or_insert_with(|| self.textures.brightness(&self.textures.sampled[texture as usize]))
        };
        // Visible light sources that may not be emitters: ellipsoids, unlit materials, copies beyond the limit.
        for material in &self.materials {
            let color = if material.unlit { &material.base_color } else { &material.emission };
            if material.unlit || material.emits() {
                let factor = color.factor.into_iter().fold(0.0, f32::max);
                let (most, mean) = brightness(color.texture);
                note(factor * most, if material.unlit { factor * mean } else { 0.0 });
            }
        }
        for emitter in 0..self.emitters.len() as u32 {
            let (kind, row) = self.emitters.row(emitter);
            let mut light = AnyRow::of(row).light.max_component();
            if let Some(material) = self.materials.get(self.emitters.material[emitter as usize] as usize) {
                light *= brightness(material.emission.texture).1;
            }
            let seen = |area: f32| light * (area / (far * far)).min(1.0);
            match kind {
                kind::TRIANGLE | kind::QUAD => {
                    let PlanarRow { e1, e2, .. } = PlanarRow::of(row);
                    note(light, seen(e1.cross(e2).length()));
                }
                kind::SPHERE => {
                    let SphereRow { radius, .. } = SphereRow::of(row);
                    note(light, seen(std::f32::consts::PI * radius * radius));
                }
                // A light without extent is judged by the light that it casts.
                kind::POINT | kind::SPOT | kind::PHOTOMETRIC if PointRow::of(row).falls > 0.0 => {
                    lamps.push((light, PointRow::of(row).position));
                    note(light / (far * far), light / (far * far))
                }
                _ => note(light, light),
            }
        }
        // A scene may be far larger than the region that its lights illuminate; but a surface that touches a light does
        // not make it bright.
        let mut stack = Stack::new(&self.bvh);
        for (light, place) in lamps {
            if brightest < 1.0 {
                let near = self.nearest_to(place, &mut stack).clamp(1e-5 * far, far);
                brightest = brightest.max((light / (near * near)).min(1.0));
            }
        }
        (brightest, usual)
    }

    /// Estimates the distance from a point to the nearest surface with rays along axes and diagonals; infinity if none
    /// hits.
    fn nearest_to(&self, place: Vec3, stack: &mut Stack) -> f32 {
        let vector = |v: Vec3| Vector { x: v.x, y: v.y, z: v.z };
        let mut nearest = f32::INFINITY;
        let signs = [-1.0, 0.0, 1.0];
        for x in signs {
            for y in signs {
                for z in signs {
                    let direction = Vec3::new(x, y, z).normalize_or_zero();
                    let ray = Ray {
                        origin: vector(place),
                        direction: vector(direction),
                        t_min: 0.0,
                        t_max: nearest,
                    };
                    if direction != Vec3::ZERO {
                        let found =
                            closest_ray(Isa::PORTABLE, &self.bvh, &ray, AnyHitFilter::ACCEPT_ALL, stack);
                        nearest = if found.is_miss() { nearest } else { found.t };
                    }
                }
            }
        }
        nearest
    }

    /// The name of the first part that differs from another scene in any bit. Slow.
    #[doc(hidden)]
    pub fn difference(&self, other: &CompiledScene) -> Option<&'static str> {
        fn parts(of: &CompiledScene) -> [(&'static str, &dyn Debug); 23] {
            [
                ("the origin", &of.origin),
                ("the camera", &of.camera),
                ("its aperture", &of.aperture),
                ("geometry", &of.geometry),
                // Build statistics are not compared.
                ("the tree's nodes", &of.bvh.nodes),
                ("its triangles", &of.bvh.triangles),
                ("its spheres", &of.bvh.spheres),
                ("its instances", &of.bvh.instances),
                ("its root", &of.bvh.root),
                ("what of it is there", &of.bvh.conditional),
                ("materials", &of.materials),
                ("their bodies", &of.bodies),
                ("their names", &of.material_names),
                ("those of sheets", &of.sheets),
                ("textures", &of.textures),
                ("emitters", &of.emitters),
                ("lights", &of.lights),
                ("the environment", &of.environment),
                ("light groups", &of.light_groups),
                ("that of the environment", &of.around_group),
                ("ambient", &of.ambient),
                ("bounds", &of.bounds),
                ("warnings", &of.warnings),
            ]
        }
        let pairs = parts(self).into_iter().zip(parts(other));
        pairs
            .into_iter()
            .find(|((_, own), (_, other))| digest(*own) != digest(*other))
            .map(|((name, _), _)| name)
    }

    /// The memory use.
    pub(crate) fn memory(&self) -> SceneMemory {
        SceneMemory {
            geometry: self.geometry.bytes(),
            bvh: self.bvh.bytes(),
            textures: self.textures.bytes(),
            lights: self.emitters.bytes() + self.environment.bytes(),
        }
    }
}
