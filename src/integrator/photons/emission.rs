//! Emission of photons: from lights, towards objects that make caustics.
//!
//! An emitter is chosen by the light that it sends to all targets, a target by the size in which it is seen, a ray
//! uniformly among those that are aimed at it. A ray may be aimed at several targets; what it carries is divided by the
//! density of all ways to draw it (balance heuristic, Veach 1997), so overlaps count once.

use std::num::Wrapping;

use super::aim::{Angles, Chances, cone};
use super::targets::Ball;
use crate::math::{Color, Vec3, Vector};
use crate::sampling::hash::{combine, mix};
use crate::sampling::sobol;
use crate::sampling::warp::concentric_disk;
use crate::scene::CompiledScene;
use crate::scene::bodies::NOWHERE;
use crate::scene::emitter_rows::{AnyRow, ConeRow, EmitterRow, PlanarRow, PointRow, SphereRow};
use crate::scene::emitters::{flag, kind};
use crate::shading::emitter_rays::{area, intensity, point_of, radiance_of, radiance_of_sphere};
use crate::shading::environment;
use crate::shading::principled::shading_frame::ShadingFrame;
use crate::simd::{Float, Int, Mask};
use crate::world::Transport;

const PI: f32 = std::f32::consts::PI;

/// The distribution from which photons are drawn.
pub struct PhotonEmission {
    targets: Vec<Ball>,
    /// The cumulative probabilities of choosing the emitters.
    cumulative: Vec<f64>,
    /// The probability of choosing each emitter.
    chances: Vec<f32>,
    /// The number of a sample's photons per unit of each emitter's phase space, m⁻² sr⁻¹, rounded to a power of two;
    /// infinite for emitters that paths cannot find, 0 for those that send no photons.
    densities: Vec<f32>,
    /// The bodies that each emitter lies in ([`crate::scene::Bodies`]).
    bodies: Vec<u32>,
    /// The total area of the targets' discs, m².
    discs: f32,
    /// The number of photons of a sample.
    count: u32,
}

/// A photon that has left its light.
pub struct EmittedPhoton {
    /// The position on the light.
    pub origin: Vector<f32>,
    /// Unit vector along its ray.
    pub direction: Vector<f32>,
    /// Its flux in watts; over the square of the distance travelled if the light does not fall off with distance.
    pub flux: Color<f32>,
    /// False if the irradiance is equal at all distances.
    pub falls: bool,
    /// The bodies in which it begins.
    pub bodies: u32,
    /// See [`PhotonEmission::densities`].
    pub density: f32,
}

/// A ray as it leaves a light, with its radiance over the density of rays, and the density to store if it is not the
/// emitter's.
struct EmittedRay {
    origin: Vector<f32>,
    direction: Vector<f32>,
    light: Color<f32>,
    density: Option<f32>,
}

impl PhotonEmission {
    /// Builds the distribution for a scene's emitters; none if they send no light to the targets. `bodies_at` returns
    /// the bodies around some points.
    pub fn new(
        scene: &CompiledScene,
        transport: Transport,
        targets: Vec<Ball>,
        count: u32,
        bodies_at: &dyn Fn(&[Vec3]) -> Vec<u32>,
    ) -> Option<Self> {
        let discs = targets.iter().map(Ball::disc).sum();
        let emitters = scene.emitters.len();
        let mut emission = Self {
            targets,
            cumulative: Vec::with_capacity(emitters),
            chances: vec![0.0; emitters],
            densities: vec![0.0; emitters],
            bodies: vec![NOWHERE; emitters],
            discs,
            count,
        };
        // Under the Whitted transport only lights that are entities illuminate anything.
        let is_light = |emitter: u32| {
            let sends = scene.emitters.flags[emitter as usize] & flag::WITHOUT_PHOTONS == 0;
            sends
                && (transport == Transport::Path || scene.lights.iter().any(|light| light.emitter == emitter))
        };
        let volume = |emitter: u32| {
            if is_light(emitter) { emission.light_and_volume(scene, emitter) } else { (0.0, 0.0) }
        };
        let volumes: Vec<(f32, f32)> = (0..emitters as u32).map(volume).collect();
        let total: f64 = volumes.iter().map(|(light, _)| f64::from(*light)).sum();
        if total.is_nan() || total <= 0.0 || total.is_infinite() {
            return None;
        }
        let mut sum = 0.0;
        for (emitter, (light, volume)) in volumes.into_iter().enumerate() {
            let chance = f64::from(light) / total;
            sum += chance;
            emission.cumulative.push(sum);
            emission.chances[emitter] = chance as f32;
            if chance > 0.0 {
                let is_found = scene.emitters.flags[emitter] & flag::VISIBLE != 0;
                let density = count as f32 * chance as f32 / volume.max(f32::MIN_POSITIVE);
                emission.densities[emitter] = if is_found { power_of_two(density) } else { f32::INFINITY };
            }
        }
        let is_placed = |emitter: &usize| {
            let what = scene.emitters.kinds[*emitter];
            emission.chances[*emitter] > 0.0 && !matches!(what, kind::DIRECTIONAL | kind::ENVIRONMENT)
        };
        let placed: Vec<usize> = (0..emitters).filter(is_placed).collect();
        let middle_of = |emitter: &usize| {
            let (what, row) = scene.emitters.row(*emitter as u32);
            middle(what, row)
        };
        let middles: Vec<Vec3> = placed.iter().map(middle_of).collect();
        for (emitter, bodies) in placed.into_iter().zip(bodies_at(&middles)) {
            emission.bodies[emitter] = bodies;
        }
        Some(emission)
    }

    /// Estimates the light that an emitter sends to the targets, and the volume of the phase space of its rays.
    fn light_and_volume(&self, scene: &CompiledScene, emitter: u32) -> (f32, f32) {
        let (what, row) = scene.emitters.row(emitter);
        let light = AnyRow::of(row).light.luminance();
        let place = middle(what, row);
        let angles: f32 = self.angles(scene, emitter, place).0.iter().sum();
        match what {
            kind::TRIANGLE | kind::QUAD => {
                let volume = area(scene, emitter) * angles;
                (light * volume, volume)
            }
            // Light that it sends inwards is left to paths, which find it in every direction.
            kind::SPHERE => {
                let SphereRow { radius, .. } = SphereRow::of(row);
                let volume = PI * radius * radius * angles;
                let holds_target = self.targets.iter().any(|ball| is_within(ball, place, radius));
                if holds_target { (0.0, 0.0) } else { (light * volume, volume) }
            }
            kind::DIRECTIONAL => (light * self.discs, f32::MIN_POSITIVE),
            kind::ENVIRONMENT => {
                let panorama = scene.environment.panorama.as_ref();
                let light = panorama.map_or(0.0, |panorama| {
                    panorama.irradiance * Color::<f32>::splat(panorama.factor).luminance()
                });
                (2.0 * light * self.discs, 4.0 * PI * self.discs)
            }
            _ => {
                // Light that does not fall off with distance arrives as it would a metre away.
                let nearest =
                    self.targets.iter().map(|ball| (ball.center - place).length()).fold(f32::MAX, f32::min);
                let farther = if PointRow::of(row).falls > 0.0 { 1.0 } else { nearest * nearest };
                (light * angles * farther, f32::MIN_POSITIVE)
            }
        }
    }

    /// The solid angles of the targets from a point on an emitter.
    fn angles(&self, scene: &CompiledScene, emitter: u32, place: Vec3) -> Angles {
        let (what, row) = scene.emitters.row(emitter);
        let has_cone = what == kind::SPOT || scene.emitters.flags[emitter as usize] & flag::CONE != 0;
        let mut angles = Angles::default();
        for (ball, angle) in self.targets.iter().zip(&mut angles.0) {
            let way = ball.center - place;
            let distance = way.length();
            let own = if what == kind::SPHERE { SphereRow::of(row).radius } else { 0.0 };
            let radius = ball.radius + own;
            *angle = 2.0 * PI * cone(distance, radius);
            let reached = match what {
                kind::TRIANGLE | kind::QUAD => {
                    let flags = scene.emitters.flags[emitter as usize];
                    let PlanarRow { e1, e2, .. } = PlanarRow::of(row);
                    let normal = e1.cross(e2).normalize_or_zero();
                    let reversed = flags & flag::REVERSED != 0;
                    let height = if reversed { -normal } else { normal }.dot(way);
                    flags & flag::TWO_SIDED != 0 || height > -ball.radius
                }
                kind::SPOT | kind::SPHERE if has_cone && distance > radius => {
                    // Reached if the cosine of the difference of both angles is at least that of the spot's cone.
                    let ConeRow { axis, cos_outer, .. } = ConeRow::of(row);
                    let sine = radius / distance;
                    let cosine = (1.0 - sine * sine).max(0.0).sqrt();
                    let off = (axis.dot(way) / distance).clamp(-1.0, 1.0);
                    let off_sine = (1.0 - off * off).max(0.0).sqrt();
                    off >= cosine || off * cosine + off_sine * sine >= cos_outer
                }
                _ => true,
            };
            if !reached {
                *angle = 0.0;
            }
        }
        angles
    }

    /// The densities of all emitters; see the field.
    pub fn densities(&self) -> &[f32] {
        &self.densities
    }

    /// The number of a sample's photons that emitters send per unit of their phase space, for light that arrives from a
    /// direction.
    #[inline(always)]
    pub fn density<F: Float>(
        &self,
        scene: &CompiledScene,
        emitter: F::Int,
        direction: Vector<F>,
        mask: F::Mask,
    ) -> F {
        let density = F::gather(&self.densities, emitter, mask);
        let last = F::Int::splat((scene.emitters.len() as u32).wrapping_sub(1));
        let sky = mask & emitter.eq(last);
        if scene.environment.panorama.is_none() || !sky.any() {
            return density;
        }
        F::select(sky, self.sky_density(scene, direction, sky), density)
    }

    /// The density of the infinitely distant emitter, which is the last one, in each direction.
    #[inline(always)]
    pub fn sky_density<F: Float>(&self, scene: &CompiledScene, direction: Vector<F>, mask: F::Mask) -> F {
        let chance = self.chances.last().copied().unwrap_or(0.0);
        let scale = self.count as f32 * chance / self.discs.max(f32::MIN_POSITIVE);
        let density = environment::pdf(&scene.environment, direction, mask) * F::splat(scale);
        power_of_two_lanes(density)
    }

    /// The number of photons of a sample.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The emitter that a number in [0, 1) chooses.
    fn choose(&self, u: f32) -> u32 {
        let chosen = self.cumulative.partition_point(|sum| *sum <= f64::from(u));
        chosen.min(self.cumulative.len() - 1) as u32
    }

    /// The emitter of photon `number`, counted over all samples.
    pub fn emitter_of(&self, seed: u64, number: u64) -> u32 {
        self.choose(PhotonNumbers::new(seed, number).two(0).0)
    }

    /// Draws photon `number`, counted over all samples; none if it would carry no light.
    pub fn emit(&self, scene: &CompiledScene, seed: u64, number: u64) -> Option<EmittedPhoton> {
        let draw = PhotonNumbers::new(seed, number);
        let (which, target) = draw.two(0);
        let emitter = self.choose(which);
        let (place, toward) = (draw.two(1), draw.two(2));
        let (what, row) = scene.emitters.row(emitter);
        let ray = match what {
            kind::TRIANGLE | kind::QUAD => self.ray_of_plane(scene, emitter, target, place, toward),
            kind::SPHERE => self.ray_of_sphere(scene, emitter, target, place, toward),
            kind::DIRECTIONAL | kind::ENVIRONMENT => self.ray_of_sky(scene, emitter, target, place, toward),
            _ => self.ray_of_point(scene, emitter, target, toward),
        }?;
        let chance = self.chances[emitter as usize];
        let is_point = matches!(what, kind::POINT | kind::SPOT | kind::PHOTOMETRIC);
        let flux = ray.light * (1.0 / (self.count as f32 * chance));
        let is_something = flux.max_component() > 0.0 && flux.max_component() < f32::INFINITY;
        is_something.then(|| EmittedPhoton {
            origin: ray.origin,
            direction: ray.direction,
            flux,
            falls: !is_point || PointRow::of(row).falls > 0.0,
            bodies: self.bodies[emitter as usize],
            density: ray.density.unwrap_or(self.densities[emitter as usize]),
        })
    }

    fn ray_of_plane(
        &self,
        scene: &CompiledScene,
        emitter: u32,
        target: f32,
        place: (f32, f32),
        toward: (f32, f32),
    ) -> Option<EmittedRay> {
        let point = point_of(scene, emitter, place);
        let origin = Vec3::from(point.position);
        let angles = self.angles(scene, emitter, origin);
        let (direction, density) = self.aim(&angles, origin, 0.0, target, toward)?;
        let light = radiance_of(scene, emitter, &point, direction);
        let cosine = point.normal.dot(direction).abs();
        let light = light * (cosine * area(scene, emitter) / density);
        // The offset keeps the ray from hitting its own light.
        let off = if point.normal.dot(direction) < 0.0 { -point.normal } else { point.normal };
        let scale = origin.abs().max_element() + area(scene, emitter).sqrt();
        Some(EmittedRay { origin: point.position + off * (scale * 4e-6), direction, light, density: None })
    }

    fn ray_of_sphere(
        &self,
        scene: &CompiledScene,
        emitter: u32,
        target: f32,
        place: (f32, f32),
        toward: (f32, f32),
    ) -> Option<EmittedRay> {
        let SphereRow { center, radius, .. } = SphereRow::of(scene.emitters.row(emitter).1);
        let angles = self.angles(scene, emitter, center);
        let (direction, density) = self.aim(&angles, center, radius, target, toward)?;
        // A disc across the direction, lifted to the sphere: all rays leave it outwards, with equal light.
        let (x, y) = concentric_disk(place.0, place.1);
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        let normal = ShadingFrame::about(direction).world(Vector::new(x, y, z));
        let light = radiance_of_sphere(scene, emitter, normal, direction) * (PI * radius * radius / density);
        let reach = radius + (center.abs().max_element() + radius) * 4e-6;
        Some(EmittedRay { origin: Vector::splat(center) + normal * reach, direction, light, density: None })
    }

    fn ray_of_point(
        &self,
        scene: &CompiledScene,
        emitter: u32,
        target: f32,
        toward: (f32, f32),
    ) -> Option<EmittedRay> {
        let origin = PointRow::of(scene.emitters.row(emitter).1).position;
        let angles = self.angles(scene, emitter, origin);
        let (direction, density) = self.aim(&angles, origin, 0.0, target, toward)?;
        let light = intensity(scene, emitter, direction) * (1.0 / density);
        Some(EmittedRay { origin: Vector::splat(origin), direction, light, density: None })
    }

    /// Draws a ray from infinitely far away, on a disc across a target.
    fn ray_of_sky(
        &self,
        scene: &CompiledScene,
        emitter: u32,
        target: f32,
        place: (f32, f32),
        toward: (f32, f32),
    ) -> Option<EmittedRay> {
        let is_sky = scene.emitters.kinds[emitter as usize] == kind::ENVIRONMENT;
        let (to_light, light, density) = if is_sky {
            let (to_light, pdf) = environment::sample(&scene.environment, toward, true);
            let light = environment::radiance(&scene.environment, to_light, true);
            let density = self.sky_density(scene, to_light, true);
            (to_light, light * (1.0 / pdf.max(1e-30)), Some(density))
        } else {
            let sample = crate::shading::emitter::sample_light::<f32>(scene, emitter, Vector::zero(), toward);
            (sample.direction, sample.radiance * (1.0 / sample.pdf), None)
        };
        let direction = -to_light;
        let mut discs = Angles::default();
        self.targets.iter().zip(&mut discs.0).for_each(|(ball, disc)| *disc = ball.disc());
        let chances = Chances::new(discs.of(self.targets.len()));
        let ball = self.targets[chances.choose(target)?];
        let (x, y) = concentric_disk(place.0, place.1);
        let basis = ShadingFrame::about(direction);
        let across = (basis.x * x + basis.y * y) * ball.radius;
        let through = ball.center + Vec3::from(across);
        let meets = |other: &&Ball| {
            let way = other.center - through;
            let along = Vec3::from(direction) * way.dot(Vec3::from(direction));
            **other == ball || (way - along).length_squared() < other.radius * other.radius
        };
        let met = self.targets.iter().enumerate().filter(|(_, ball)| meets(ball));
        let density_of_rays: f32 = met.map(|(number, _)| chances.density(number)).sum();
        // It begins where it enters the scene: other objects may block it.
        let origin = Vector::splat(through) + to_light * way_out(scene, through, Vec3::from(to_light));
        Some(EmittedRay { origin, direction, light: light * (1.0 / density_of_rays), density })
    }

    /// Draws a direction towards one of the targets; returns it and its density per steradian. `radius` is that of the
    /// emitter if rays begin anywhere on a disc across them.
    fn aim(
        &self,
        angles: &Angles,
        origin: Vec3,
        radius: f32,
        target: f32,
        u: (f32, f32),
    ) -> Option<(Vector<f32>, f32)> {
        let chances = Chances::new(angles.of(self.targets.len()));
        let chosen = chances.choose(target)?;
        let ball = self.targets[chosen];
        let way = ball.center - origin;
        let part = cone(way.length(), ball.radius + radius);
        let axis = way.normalize_or(Vec3::Y);
        // Maps the disc onto the cap, preserving area: z = 1 − (1 − cos θ) r².
        let (x, y) = concentric_disk(u.0, u.1);
        let lift = part * (x * x + y * y);
        let scale = (part * (2.0 - lift)).max(0.0).sqrt();
        let local = Vector::new(x * scale, y * scale, 1.0 - lift);
        let direction = ShadingFrame::about(Vector::splat(axis)).world(local).normalize();
        let among = |(number, (ball, angle)): (usize, (&Ball, &f32))| {
            let way = ball.center - origin;
            let (along, reach) = (way.dot(Vec3::from(direction)), ball.radius + radius);
            let inside = way.length_squared() <= reach * reach;
            let near = (way - Vec3::from(direction) * along).length_squared() < reach * reach;
            *angle > 0.0 && (number == chosen || inside || (along > 0.0 && near))
        };
        let aimed = self.targets.iter().zip(angles.of(self.targets.len())).enumerate();
        let density = aimed.filter(|each| among(*each)).map(|(number, _)| chances.density(number)).sum();
        Some((direction, density))
    }
}

/// The distance from a point to the scene's bounds along a direction.
fn way_out(scene: &CompiledScene, place: Vec3, direction: Vec3) -> f32 {
    let (low, high) = (scene.bounds.min - place, scene.bounds.max - place);
    let out = [0, 1, 2].map(|axis| {
        let wall = if direction[axis] > 0.0 { high[axis] } else { low[axis] };
        let way = wall / direction[axis];
        if way.is_nan() { f32::INFINITY } else { way.max(0.0) }
    });
    let nearest = out.into_iter().fold(f32::INFINITY, f32::min);
    let size = scene.bounds.size().length();
    nearest.min(size) * 1.001 + place.abs().max_element() * 1e-5
}

/// True if a ball lies wholly within a sphere.
fn is_within(ball: &Ball, center: Vec3, radius: f32) -> bool {
    (ball.center - center).length() + ball.radius <= radius
}

/// The centre of an emitter that has a position.
fn middle(what: u32, row: &EmitterRow) -> Vec3 {
    let part = match what {
        kind::TRIANGLE => 1.0 / 3.0,
        kind::QUAD => 0.5,
        kind::SPHERE => return SphereRow::of(row).center,
        _ => return PointRow::of(row).position,
    };
    let PlanarRow { corner, e1, e2, .. } = PlanarRow::of(row);
    corner + (e1 + e2) * part
}

/// Rounds down to a power of two.
fn power_of_two(x: f32) -> f32 {
    power_of_two_lanes(x)
}

/// Clears all bits but those of the exponent.
#[inline(always)]
fn power_of_two_lanes<F: Float>(x: F) -> F {
    (x.to_bits() & F::Int::splat(0x7f80_0000)).reinterpret()
}

/// The random numbers of one photon: points of sequences that continue through all photons of all samples.
struct PhotonNumbers {
    seed: u32,
    index: u32,
}

impl PhotonNumbers {
    fn new(seed: u64, number: u64) -> Self {
        // Other sequences begin after four thousand million photons.
        let words = [seed as u32, (seed >> 32) as u32, (number >> 32) as u32];
        let seed = words.into_iter().fold(Wrapping(0x7068), |hash, word| combine(hash, Wrapping(word)));
        Self { seed: seed.0, index: number as u32 }
    }

    fn two(&self, which: u32) -> (f32, f32) {
        sobol::two(
            Wrapping(self.index),
            mix(Wrapping(self.seed.wrapping_add(which.wrapping_mul(0x9e37_79b9)))),
        )
    }
}
