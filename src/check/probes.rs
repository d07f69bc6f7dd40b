//! What a few hundred rays find out about a scene.

use std::sync::Arc;

use super::Finding;
use crate::bvh::{self, AnyHitFilter, Crossing, FaceCulling, HitPredicate, Stack};
use crate::film::Features;
use crate::integrator::any_hit::crossed;
use crate::integrator::{RenderSetup, Stop};
use crate::math::{Hit, NONE, Ray, Rgb, Vec3, Vector};
use crate::render::{Options, Session};
use crate::scene::CompiledScene;
use crate::simd::Isa;

/// Longer side, in pixels, of the small image that is examined.
const LONGER_SIDE: u32 = 24;
/// Samples of each of its pixels.
const SAMPLES: u32 = 4;
/// The most rays for one of these samples of all pixels, some tenths of a second. The number is the same everywhere,
/// and so are the findings.
const MOST_RAYS: u64 = 2_000_000;

/// A small image, and what its pixels show.
pub struct Probes {
    /// What is seen first, pixel by pixel.
    pub features: Vec<Features>,
    /// The light, row by row; none if it takes too long.
    pub light: Option<Vec<Rgb>>,
}

impl Probes {
    /// As the frame's camera sees it.
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

    /// The finding if a sample of so few pixels takes too many rays.
    pub fn slowness(&self) -> Option<Finding> {
        let most = MOST_RAYS / self.features.len().max(1) as u64;
        self.light.is_none().then(|| {
            let what = format!(
                "each sample takes more than {most} rays, so that images take very long: paths split too often or end too late, or lights have too many samples"
            );
            Finding::new(None, what, "a lower --depth, a higher min_throughput, fewer samples of lights; --max-time ends it anyway")
        })
    }

    /// Places that are seen.
    pub fn seen(&self) -> impl Iterator<Item = (&Features, Vec3)> {
        let seen = self.features.iter().filter(|features| features.coverage > 0.5);
        seen.map(|features| (features, Vec3::from_array(features.position)))
    }

    /// The part of the image that shows anything.
    pub fn coverage(&self) -> f32 {
        let all: f32 = self.features.iter().map(|features| features.coverage).sum();
        all / self.features.len().max(1) as f32
    }

    /// The fraction of the visible places that are nearly black compared with the brightest; 0 if that is not known.
    pub fn dark(&self) -> f32 {
        let Some(light) = &self.light else { return 0.0 };
        let most = light.iter().map(|pixel| pixel.luminance()).fold(0.0, f32::max);
        // Edges also contain the background.
        let pairs = self.features.iter().zip(light).filter(|(features, _)| features.coverage == 1.0);
        let (mut dark, mut all) = (0.0, 0.0f32);
        for (_, light) in pairs {
            all += 1.0;
            dark += f32::from(light.luminance() <= 1e-4 * most);
        }
        dark / all.max(1.0)
    }
}

/// What a ray meets first.
#[derive(Clone, Copy)]
pub struct Met {
    /// The number of its entity.
    pub entity: u32,
    /// Its material.
    pub material: u32,
    /// How far away it is.
    pub distance: f32,
    /// Whether a triangle's back was met.
    pub back: bool,
}

/// Surfaces that have a side where they are met, however much of them is there.
struct Sided<'a> {
    scene: &'a CompiledScene,
    /// Without those that rays to lights go straight through.
    to_lights: bool,
}

impl HitPredicate for Sided<'_> {
    fn accepts(&self, _: usize, crossing: &Crossing) -> bool {
        crossed(self.scene, crossing, FaceCulling::AsBuilt)
            .is_some_and(|material| !(self.to_lights && material.straight))
    }
}

/// Boundaries of bodies, but for those of one entity.
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

/// Rays through a scene, one by one.
pub struct ProbeTracer<'a> {
    scene: &'a CompiledScene,
    /// Whether they lead to lights.
    to_lights: bool,
    stack: Stack,
    isa: Isa,
}

impl<'a> ProbeTracer<'a> {
    pub fn new(scene: &'a CompiledScene) -> Self {
        Self { scene, to_lights: false, stack: Stack::new(&scene.bvh), isa: Isa::detect() }
    }

    /// Rays that lead to lights, and so straight through some surfaces.
    pub fn to_lights(scene: &'a CompiledScene) -> Self {
        Self { to_lights: true, ..Self::new(scene) }
    }

    /// The first thing on the way, within a distance.
    pub fn first(&mut self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<Met> {
        let scene = self.scene;
        let vector = |v: Vec3| Vector { x: v.x, y: v.y, z: v.z };
        let t_min = 1e-5 * scene.bounds.size().length();
        let ray = Ray { origin: vector(origin), direction: vector(direction), t_min, t_max };
        let sided = Sided { scene, to_lights: self.to_lights };
        let filter = AnyHitFilter::new(&sided, 0);
        let hit = bvh::closest_ray(self.isa, &scene.bvh, &ray, filter, &mut self.stack);
        (!hit.is_miss()).then(|| Met {
            entity: scene.geometry.entity_of(hit.primitive, hit.instance),
            material: scene.geometry.material_of(hit.primitive, hit.instance),
            distance: hit.t,
            back: self.is_back(&hit, direction),
        })
    }

    /// The number of another entity that is a body and has its boundary at a point of an entity's surface, parallel to
    /// it and no farther away than `near`.
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

    /// A triangle's normal on its front side, of any length; none for spheres.
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
                // Normals go by the inverse's columns.
                let column = |i: usize| Vec3::new(rows[12 + i], rows[16 + i], rows[20 + i]);
                Vec3::new(column(0).dot(normal), column(1).dot(normal), column(2).dot(normal))
            }
            _ => normal,
        };
        Some(normal * sign)
    }
}

/// Directions that are spread over the sphere (a spiral by the golden angle).
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
    fn directions_go_everywhere_alike() {
        let mean = directions(64).sum::<Vec3>() / 64.0;
        assert!(mean.length() < 0.02, "{mean}");
        assert!(directions(64).all(|direction| (direction.length() - 1.0).abs() < 1e-5));
    }
}
