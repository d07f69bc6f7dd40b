//! Decides whether a render has photons, and traces those of the next samples.

use rayon::prelude::*;

use std::sync::Arc;

use super::{Options, Session, camera_medium};
use crate::bvh::{AnyHitFilter, Stack, closest_ray};
use crate::integrator::path::any_hit::PathRay;
use crate::integrator::path::camera_path;
use crate::integrator::path::light_groups::GroupQueue;
use crate::integrator::path::{Path, pack_pixel};
use crate::integrator::photons::emission::PhotonEmission;
use crate::integrator::photons::gather::first_radius;
use crate::integrator::photons::map::{Photon, PhotonMap, Radii};
#[cfg(any(feature = "cli", feature = "python"))]
use crate::integrator::photons::splat::Splat;
use crate::integrator::photons::splat::{is_in_image, view};
use crate::integrator::photons::targets::targets;
use crate::integrator::photons::{LandedPhotons, PhotonPlan, SamplePhotons};
use crate::integrator::schedule::recursive::Recursion;
use crate::integrator::setup::NoPhotons;
use crate::integrator::transport::{path_tracing, whitted};
use crate::integrator::{RayStatistics, RenderSetup, Stop, Worker};
use crate::math::elementary::{exp2, log2};
use crate::math::{Color, Vec3, Vector};
use crate::shading::surface::material_of;
use crate::shading::{HitLanes, Surface};
use crate::simd::Isa;
use crate::world::Transport;
use std::num::Wrapping;
use std::ops::Range;

/// The number of photons in a chunk: about as many as a wave has paths.
const CHUNK: u32 = 1 << 13;
/// The number of trial photons, some of which must end on a surface.
const PILOT: u32 = 1 << 12;
/// The sample number of trial photons: beyond all others.
const PILOT_SAMPLE: u32 = u32::MAX;
/// The number of trial camera rays along the longer side of the image.
const LONGER_SIDE: u32 = 48;
/// The largest number of rays of a tile of the small image.
const MOST_RAYS: u64 = 1 << 21;
/// The largest number of mirrors and panes that a trial camera ray is followed through.
const MOST_BENDS: usize = 32;
/// The largest number of photons in memory, over all samples, unless one sample has more.
const IN_MEMORY: u64 = 1 << 18;

/// The largest number of photons of a sample unless the scene sets one: those of large images would fill the memory.
const MOST_CHOSEN: f32 = 1048576.0;

/// Sets up the photons of a render, or returns the reason why there are none. The result is meaningless if stopped.
pub fn plan(setup: &RenderSetup, stop: &Stop) -> Result<PhotonPlan, NoPhotons> {
    let stop = &for_photons(stop);
    let (per_pixel, pixels_wide) = setup.photons?;
    let scene = &setup.scene;
    let targets = targets(scene, setup.transport);
    let radius = usual_radius(setup).ok_or(NoPhotons::NotSeen)? * pixels_wide;
    let bodies_at = |places: &[Vec3]| {
        let around = |stack: &mut Stack, place: &Vec3| camera_medium::around(scene, *place, stack);
        places.par_iter().map_init(|| Stack::new(&scene.bvh), around).collect()
    };
    let plan_of = |per_pixel: f32| {
        let count = count(setup, per_pixel);
        let emission = PhotonEmission::new(scene, setup.transport, targets.clone(), count, &bodies_at);
        emission.map(|emission| PhotonPlan::new(setup, emission, radius)).ok_or(NoPhotons::NoLamp)
    };
    let plan = plan_of(per_pixel)?;
    if !setup.chooses_photons {
        return Ok(plan);
    }
    let mut worker = Worker::Recursive(Box::new(Recursion::new(&plan.setup)));
    let numbers = 0..PILOT;
    let statistics = &mut RayStatistics::default();
    let landed = worker.trace_photons(&plan, Isa::detect(), PILOT_SAMPLE, numbers, statistics, stop);
    if landed.photons.is_empty() || stop.is_set() {
        return Err(NoPhotons::NoneLands);
    }
    let trial = Trial { count: plan.count(), seen: seen(setup, &landed), others: others(setup, stop) };
    let plan = plan_of(per_pixel * trial.fitting(setup, radius))?;
    if trial.are_enough(setup, plan.count()) { Ok(plan) } else { Err(NoPhotons::Dots) }
}

/// Trial photons, and a small image.
struct Trial<'a> {
    /// The number of photons of a sample that the trial photons represent.
    count: u32,
    /// The photons whose ends project into the image, ignoring occlusion, and their light in it.
    seen: Vec<(&'a Photon, f64)>,
    /// The luminance of the small image's pixels, without photons.
    others: Vec<f32>,
}

/// The smallest and the largest factor on the number of photons.
const CHOSEN: [f32; 2] = [0.5, 4.0];
/// The number of photons of a sample that is aimed at within the usual radius around a photon: where photons bring
/// little of the image's light, and where they bring all of it.
const CROWD: [f32; 2] = [10.0, 100.0];

/// The number of samples after which the light of photons in a pixel may deviate by at most [`DEVIATION`] times the
/// brightness of the image. Photons must lie so close together that they form smooth caustics, not single bright dots.
/// Those of the sun on a lake do not: an image is better without their light.
const SAMPLES: f64 = 16.0;
const DEVIATION: f64 = 4.0;
/// A typical fraction of the light on a surface that is reflected to the camera: half of it, diffusely.
const SENT: f32 = 0.5 * std::f32::consts::FRAC_1_PI;

impl Trial<'_> {
    /// The number of photons that each trial photon represents, divided by the number of pixels.
    fn scale(&self, setup: &RenderSetup) -> f64 {
        let pixels = f64::from(setup.size[0]) * f64::from(setup.size[1]);
        f64::from(self.count) / f64::from(PILOT) / pixels
    }

    /// The mean light of photons in a pixel.
    fn light(&self, setup: &RenderSetup) -> f64 {
        self.seen.iter().map(|(_, light)| light).sum::<f64>() * self.scale(setup)
    }

    /// The mean of other light, with each pixel clamped to `most`.
    fn other_light(&self, most: f64) -> f64 {
        let sum: f64 = self.others.iter().map(|light| f64::from(*light).min(most)).sum();
        sum / self.others.len().max(1) as f64
    }

    /// Returns a factor on the number of photons: a power of two. Small caustics hold more photons than the noise of
    /// the rest is worth; caustics that cover the image hold few, and there may be no other noise.
    fn fitting(&self, setup: &RenderSetup, radius: f32) -> f32 {
        // This radius holds as many trial photons as the usual one holds of all photons.
        let radius = radius * (self.count as f32 / PILOT as f32).sqrt();
        let photons = self.seen.iter().map(|(photon, _)| *photon);
        let map = PhotonMap::new(photons.clone(), &[], Radii { shrink: 1.0, most: radius });
        let around = |photon: &Photon| {
            let [x, y, z] = photon.position;
            let around = map.around(Vector::new(x, y, z), photon.normal(), radius, u32::MAX);
            around.map_or(0, |around| around.count().saturating_sub(1))
        };
        let mut crowds: Vec<usize> = photons.map(around).collect();
        let middle = crowds.len() / 2;
        if crowds.is_empty() {
            return 1.0;
        }
        let median = (*crowds.select_nth_unstable(middle).1).max(1);
        let light = self.light(setup);
        // Directly visible lights bring no noise.
        let part = light / (light + self.other_light(4.0 * light)).max(f64::MIN_POSITIVE);
        let [few, many] = CROWD;
        let power = log2(few) + log2(many / few) * (part * part * part * part) as f32;
        exp2((power - log2(median as f32)).round()).clamp(CHOSEN[0], CHOSEN[1])
    }

    fn are_enough(&self, setup: &RenderSetup, count: u32) -> bool {
        let squares: f64 = self.seen.iter().map(|(_, light)| light * light).sum();
        // The more photons, the less light each of them carries.
        let more = f64::from(count) / f64::from(self.count);
        let deviation = (squares * self.scale(setup) / more / SAMPLES).sqrt();
        let mean = self.other_light(f64::INFINITY) + self.light(setup);
        mean <= 0.0 || deviation <= DEVIATION * mean
    }
}

/// Renders a small image without photons and returns the luminance of its pixels.
fn others(setup: &RenderSetup, stop: &Stop) -> Vec<f32> {
    let small = RenderSetup { photons: Err(NoPhotons::Off), ..setup.small(LONGER_SIDE) };
    let mut session = Session::of(Arc::new(small), 1, Options::default());
    session.advance_until(1, &stop.or_after_rays(MOST_RAYS), &|_| ());
    session.film().radiance().iter().map(|pixel| pixel.luminance()).collect()
}

/// Finds the photons whose ends project into the image, ignoring occlusion: they may be visible in mirrors, or through
/// glass.
fn seen<'a>(setup: &RenderSetup, landed: &'a LandedPhotons) -> Vec<(&'a Photon, f64)> {
    let mut seen = Vec::new();
    for (_, photon) in &landed.photons {
        let [x, y, z] = photon.position;
        let view = view(setup, Vector::new(x, y, z), (0.5, 0.5));
        if is_in_image(setup, &view) {
            let facing = view.to_camera.dot(photon.normal()).abs();
            let [r, g, b] = photon.flux;
            let light = Color::new(r, g, b).luminance() * SENT * view.importance * facing;
            seen.push((photon, f64::from(light)));
        }
    }
    seen
}

/// Estimates the mean radius at the first surfaces where photons may end, by a few camera rays; `None` if these hit no
/// such surface.
fn usual_radius(setup: &RenderSetup) -> Option<f32> {
    let scene = &setup.scene;
    let mut stack = Stack::new(&scene.bvh);
    let [width, height] = setup.size;
    let by = width.max(height).div_ceil(LONGER_SIDE).max(1);
    let (mut sum, mut count) = (0.0f64, 0.0f64);
    for (x, y) in
        (0..height).step_by(by as usize).flat_map(|y| (0..width).step_by(by as usize).map(move |x| (x, y)))
    {
        let mut path = camera_path::generate::<f32>(setup, Wrapping(pack_pixel(x, y)), Wrapping(0));
        for _ in 0..MOST_BENDS {
            let traced = PathRay { setup, path: &|| path, shadow: None };
            let hit = closest_ray(
                Isa::detect(),
                &scene.bvh,
                &path.ray(),
                AnyHitFilter::new(&traced, 0),
                &mut stack,
            );
            if hit.is_miss() {
                break;
            }
            let lane = HitLanes::one(&hit);
            let material = material_of(&scene.geometry, &lane, true).0;
            if scene.materials[material as usize].ends_photons_under(setup.transport) {
                let surface = Surface::new(&scene.geometry, &path.ray(), &lane, true);
                // The footprint of the first sample is a whole pixel.
                sum += f64::from(first_radius(&path, path.width + path.spread * hit.t, &surface));
                count += 1.0;
                break;
            }
            let Some(next) = next(setup, &path, &lane, material) else { break };
            path = next;
        }
    }
    (count > 0.0).then(|| (sum / count) as f32)
}

/// Continues a path beyond a surface that makes caustics.
fn next(setup: &RenderSetup, path: &Path<f32>, hit: &HitLanes<f32>, material: u32) -> Option<Path<f32>> {
    if setup.transport == Transport::Path {
        let outcome = path_tracing::hit(setup, None, path, hit, material, true, &mut GroupQueue::default());
        let through = outcome.fork.and_then(|fork| fork.mask.then_some(fork.next));
        return through.or(outcome.goes_on.then_some(outcome.next));
    }
    let (vertex, scatter, _) = whitted::hit(setup, None, path, hit, true, &mut GroupQueue::default());
    match (scatter.refracts, scatter.reflects) {
        (true, _) => Some(scatter.refracted(path, &vertex)),
        (_, true) => Some(scatter.reflected(path, &vertex)),
        _ => None,
    }
}

/// The largest number of samples that are rendered together, so that their photons take little memory.
pub fn samples_at_once(plan: &PhotonPlan) -> u32 {
    at_once(plan.count())
}

fn at_once(count: u32) -> u32 {
    (IN_MEMORY / u64::from(count).max(1)).clamp(1, 16) as u32
}

/// The peak memory of a render's photons in bytes. Both parts exist while photons are sorted.
#[cfg(any(feature = "cli", feature = "python"))]
#[derive(Clone, Copy, Debug, Default)]
pub struct PhotonBytes {
    /// Photons in the order in which they end.
    pub ended: u64,
    /// Photons in maps, and splats in the order of the image.
    pub sorted: u64,
}

#[cfg(any(feature = "cli", feature = "python"))]
impl PhotonBytes {
    /// Estimates the memory of a render, if each photon ends once; behind one-sided surfaces some end again.
    pub fn most(setup: &RenderSetup) -> Self {
        let Ok(count) = count_of(setup) else { return Self::default() };
        let bytes = |each: usize| u64::from(count) * u64::from(at_once(count)) * each as u64;
        let ended = bytes(size_of::<(u32, Photon)>() + size_of::<(u32, Splat)>());
        // Up to twice as many buckets as photons, and the position in each of them while it is filled.
        let buckets = 4 * size_of::<u32>();
        Self { ended, sorted: bytes(size_of::<Photon>() + size_of::<Splat>() + buckets) }
    }

    /// The sum of both parts.
    pub fn total(self) -> u64 {
        self.ended + self.sorted
    }
}

/// The number of photons of a sample, if the render may have any; the largest possible number if it is chosen.
#[cfg(any(feature = "cli", feature = "python"))]
pub fn count_of(setup: &RenderSetup) -> Result<u32, NoPhotons> {
    let factor = if setup.chooses_photons { CHOSEN[1] } else { 1.0 };
    setup.photons.map(|(per_pixel, _)| count(setup, per_pixel * factor))
}

/// The number of photons of a sample.
fn count(setup: &RenderSetup, per_pixel: f32) -> u32 {
    let pixels = setup.size.map(|side| side as f32);
    let most = if setup.chooses_photons { MOST_CHOSEN } else { 1e9 };
    (per_pixel * pixels[0] * pixels[1]).clamp(1.0, most) as u32
}

/// Removes the limit on rays, which applies to tiles, not to photons.
fn for_photons<'a>(stop: &Stop<'a>) -> Stop<'a> {
    stop.or_after_rays(u64::MAX)
}

/// Calls a function with a worker and with the statistics to fill.
pub type WithWorker<'a> = dyn Fn(&mut dyn FnMut(&mut Worker, &mut RayStatistics)) + Sync + 'a;

/// Traces the photons of some samples on all threads; `None` if stopped. `with` provides a worker.
pub fn trace(
    plan: &PhotonPlan,
    samples: Range<u32>,
    stop: &Stop,
    with: &WithWorker,
) -> Option<Vec<SamplePhotons>> {
    let stop = &for_photons(stop);
    let landed = trace_chunks(plan, samples.clone(), stop, with, |landed| landed);
    if stop.is_set() {
        return None;
    }
    let of_samples: Vec<&[LandedPhotons]> = landed.chunks(chunks(plan) as usize).collect();
    Some(samples.into_par_iter().zip(of_samples).map(|(sample, some)| plan.of_sample(sample, some)).collect())
}

/// The number of chunks into which the photons of a sample are cut.
fn chunks(plan: &PhotonPlan) -> u32 {
    plan.count().div_ceil(CHUNK).max(1)
}

/// Traces the photons of some samples, calls `then` with each chunk and returns the results in order; meaningless if
/// stopped.
pub fn trace_chunks<T: Send>(
    plan: &PhotonPlan,
    samples: Range<u32>,
    stop: &Stop,
    with: &WithWorker,
    then: impl Fn(LandedPhotons) -> T + Sync,
) -> Vec<T> {
    let chunks = chunks(plan);
    let todo: Vec<(u32, u32)> =
        samples.flat_map(|sample| (0..chunks).map(move |chunk| (sample, chunk))).collect();
    let trace = |(sample, chunk): (u32, u32)| {
        let numbers = chunk * CHUNK..((chunk + 1) * CHUNK).min(plan.count());
        let mut landed = LandedPhotons::default();
        with(&mut |worker, statistics| {
            landed = worker.trace_photons(plan, Isa::detect(), sample, numbers.clone(), statistics, stop);
        });
        then(landed)
    };
    todo.into_par_iter().map(trace).collect()
}
