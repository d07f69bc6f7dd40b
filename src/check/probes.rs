//! Facts about a scene from a few hundred rays.

use std::sync::Arc;

use super::finding;
use crate::bvh::{self, AnyHitFilter, Crossing, FaceCulling, HitPredicate, Stack};
use crate::error::Diagnostic;
use crate::film::Features;
use crate::integrator::{RenderSetup, Stop};
use crate::math::{Hit, NONE, Ray, Rgb, Vec3, Vector};
use crate::render::{Options, Session};
use crate::scene::CompiledScene;
use crate::shading::crossing::crossed;
use crate::simd::Isa;

/// The longer side of the small probe image, in pixels.
const LONGER_SIDE: u32 = 24;
/// The samples of each of its pixels.
const SAMPLES: u32 = 4;
/// The most rays for one sample of all pixels, a few tenths of a second. A fixed number gives the same findings on all
/// machines.
const MOST_RAYS: u64 = 2_000_000;

/// A small image and the features of its pixels.
pub struct Probes {
    /// The first visible surfaces, by pixel.
    pub features: Vec<Features>,
    /// The radiance, row by row; none if it takes too long.
    pub light: Option<Vec<Rgb>>,
}

impl Probes {
    /// Renders the small image with the setup's camera.
    pub fn new(setup: &RenderSetup) -> Probes {
        let small = Arc::new(setup.small(LONGER_SIDE));
        let mut session = Session::of(small, SAMPLES, Options::default());
        let stop = Stop::after_rays(MOST_RAYS);
        session.advance_until(1, &stop, &|_| ());
        if session.samples_done().0 > 0 && session.statistics().rays.total() < MOST_RAYS / 8 {
            session.advance_until(SAMPLES - 1, &stop, &|_| ());
        }
        let light = (session.samples_done().0 > 0).then(|| session.film().radiance());
        Probes { features: session.features(), light }
    }

    /// Returns a finding if even a sample of the small image takes too many rays.
    pub fn slowness(&self) -> Option<Diagnostic> {
        let most = MOST_RAYS / self.features.len().max(1) as u64;
        self.light.is_none().then(|| {
            let what = format!(
                "each sample takes more than {most} rays, so that images take very long: paths split too often or end too late, or lights have too many samples"
            );
            finding("slow", None, what, "a lower `--depth`, a higher min_throughput, fewer samples of lights; `--max-time` ends it anyway")
        })
    }

    /// Returns the visible places.
    pub fn seen(&self) -> impl Iterator<Item = (&Features, Vec3)> {
        let seen = self.features.iter().filter(|features| features.coverage > 0.5);
        seen.map(|features| (features, Vec3::from_array(features.position)))
    }

    /// Returns the fraction of the image that shows any surface.
    pub fn coverage(&self) -> f32 {
        let all: f32 = self.features.iter().map(|features| features.coverage).sum();
        all / self.features.len().max(1) as f32
    }

    /// Returns the fraction of the visible places that are nearly black compared with the brightest; 0 if unknown.
    pub fn dark(&self) -> f32 {
        let Some(light) = &self.light else { return 0.0 };
        let most = light.iter().map(|pixel| pixel.luminance()).fold(0.0, f32::max);
        // Edge pixels also contain the background.
        let pairs = self.features.iter().zip(light).filter(|(features, _)| features.coverage == 1.0);
        let (mut dark, mut all) = (0.0, 0.0f32);
        for (_, light) in pairs {
            all += 1.0;
            dark += f32::from(light.luminance() <= 1e-4 * most);
        }
        dark / all.max(1.0)
    }
}

/// The first hit of a ray.
#[derive(Clone, Copy)]
pub struct Met {
    /// The number of the entity.
    pub entity: u32,
    /// The index of the material.
    pub material: u32,
    /// The distance along the ray.
    pub distance: f32,
    /// True if the ray hit the back of a triangle.
    pub back: bool,
}

/// Accepts surfaces that have a side facing the ray, whatever their coverage.
struct Sided<'a> {
    scene: &'a CompiledScene,
    /// True to skip surfaces that rays to lights pass straight through.
    to_lights: bool,
    culling: FaceCulling,
}

impl HitPredicate for Sided<'_> {
    fn accepts(&self, _: usize, crossing: &Crossing) -> bool {
        crossed(self.scene, crossing, self.culling)
            .is_some_and(|material| !(self.to_lights && material.passes_shadow_rays))
    }
}

/// Accepts boundaries of bodies, except those of one entity.
struct OtherBodies<'a> {
    scene: &'a CompiledScene,
    but: u32,
}

impl HitPredicate for OtherBodies<'_> {
    fn accepts(&self, _: usize, crossing: &Crossing) -> bool {
        let Hit { primitive, instance, .. } = crossing.hit;
        let geometry = &self.scene.geometry;
        let encloses = self.scene.materials[geometry.material_of(primitive, instance) as usize].encloses;
        encloses && geometry.entity_of(primitive, instance) != self.but
    }
}

/// Traces single rays through a scene.
pub struct ProbeTracer<'a> {
    scene: &'a CompiledScene,
    /// True if the rays lead to lights.
    to_lights: bool,
    culling: FaceCulling,
    stack: Stack,
    isa: Isa,
}

impl<'a> ProbeTracer<'a> {
    pub fn new(scene: &'a CompiledScene) -> Self {
        let culling = FaceCulling::AsBuilt;
        Self { scene, to_lights: false, culling, stack: Stack::new(&scene.bvh), isa: Isa::detect() }
    }

    /// Creates a tracer for rays to lights, which pass straight through some surfaces.
    pub fn to_lights(scene: &'a CompiledScene) -> Self {
        Self { to_lights: true, ..Self::new(scene) }
    }

    /// Creates a tracer for rays from lights, with the surfaces that rays back to the light hit.
    pub fn from_lights(scene: &'a CompiledScene) -> Self {
        Self { culling: FaceCulling::Opposite, ..Self::to_lights(scene) }
    }

    /// Creates a tracer for rays from lights, with one-sided surfaces hit from both sides.
    pub fn of_all_sides(scene: &'a CompiledScene) -> Self {
        Self { culling: FaceCulling::Off, ..Self::to_lights(scene) }
    }

    /// Returns the first hit within a distance.
    pub fn first(&mut self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<Met> {
        let scene = self.scene;
        let vector = |v: Vec3| Vector { x: v.x, y: v.y, z: v.z };
        let t_min = 1e-5 * scene.bounds.size().length();
        let ray = Ray { origin: vector(origin), direction: vector(direction), t_min, t_max };
        let sided = Sided { scene, to_lights: self.to_lights, culling: self.culling };
        let filter = AnyHitFilter::new(&sided, 0).with_culling(self.culling);
        let hit = bvh::closest_ray(self.isa, &scene.bvh, &ray, filter, &mut self.stack);
        (!hit.is_miss()).then(|| Met {
            entity: scene.geometry.entity_of(hit.primitive, hit.instance),
            material: scene.geometry.material_of(hit.primitive, hit.instance),
            distance: hit.t,
            back: self.is_back(&hit, direction),
        })
    }

    /// Returns the number of another entity whose body has a boundary at a point of an entity's surface, parallel to it
    /// and at most `near` away.
    pub fn body_at(&mut self, at: Vec3, normal: Vec3, near: f32, of: u32) -> Option<u32> {
        let scene = self.scene;
        let vector = |v: Vec3| Vector { x: v.x, y: v.y, z: v.z };
        let (origin, direction) = (vector(at - normal * near), vector(normal));
        let ray = Ray { origin, direction, t_min: 0.0, t_max: 2.0 * near };
        let others = OtherBodies { scene, but: of };
        let hit =
            bvh::closest_ray(self.isa, &scene.bvh, &ray, AnyHitFilter::new(&others, 0), &mut self.stack);
        let is_parallel =
            |hit: &Hit| self.normal(hit).is_none_or(|n| n.normalize_or_zero().dot(normal).abs() > 0.999);
        (!hit.is_miss() && is_parallel(&hit)).then(|| scene.geometry.entity_of(hit.primitive, hit.instance))
    }

    fn is_back(&self, hit: &Hit, direction: Vec3) -> bool {
        self.normal(hit).is_some_and(|normal| normal.dot(direction) > 0.0)
    }

    /// Returns a triangle's unnormalized normal on its front side; none for spheres.
    fn normal(&self, hit: &Hit) -> Option<Vec3> {
        let geometry = &self.scene.geometry;
        if hit.primitive & bvh::SPHERE != 0 {
            return None;
        }
        let corner = |vertex: u32| Vec3::from_array(geometry.positions[vertex as usize]);
        let [a, b, c] = geometry.triangles[hit.primitive as usize].map(corner);
        let normal = (b - a).cross(c - a);
        let part = geometry.part_of(hit.primitive) as usize;
        let sign = geometry.parts.sign[part];
        let normal = match geometry.instances.get(hit.instance as usize) {
            Some(rows) if hit.instance != NONE => {
                // Normals transform by the transpose of the inverse.
                let column = |i: usize| Vec3::new(rows[12 + i], rows[16 + i], rows[20 + i]);
                Vec3::new(column(0).dot(normal), column(1).dot(normal), column(2).dot(normal))
            }
            _ => normal,
        };
        Some(normal * sign)
    }
}

/// Directions spread evenly over the sphere: a spiral by the golden angle.
pub fn directions(count: u32) -> impl Iterator<Item = Vec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |i| {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (radius, angle) = ((1.0 - y * y).max(0.0).sqrt(), golden * f64::from(i));
        Vec3::new((libm::cos(angle) * radius) as f32, y as f32, (libm::sin(angle) * radius) as f32)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_cover_the_sphere_evenly() {
        let mean = directions(64).sum::<Vec3>() / 64.0;
        assert!(mean.length() < 0.02, "{mean}");
        assert!(directions(64).all(|direction| (direction.length() - 1.0).abs() < 1e-5));
    }
}
