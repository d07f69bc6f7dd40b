//! Photons: whether a frame has any, and those of the samples that are rendered next.

use rayon::prelude::*;

use std::sync::Arc;

use super::{Options, Session, camera_medium};
use crate::bvh::{Asker, Stack, closest_ray};
use crate::integrator::path::{Path, pack_pixel};
use crate::integrator::photons::draw::{is_in_image, view};
use crate::integrator::photons::gather::first_radius;
use crate::integrator::photons::targets::targets;
use crate::integrator::photons::{Landed, OfSample, Plan, emission::Emission};
#[cfg(any(feature = "cli", feature = "python"))]
use crate::integrator::photons::{draw::Splat, map::Photon};
use crate::integrator::presence::Traced;
use crate::integrator::recursive::Recursion;
use crate::integrator::{Frame, Statistics, Stop, Worker, begin, path_tracing, whitted};
use crate::math::{Color, Vec3, Vector};
use crate::shading::surface::material_of;
use crate::shading::{HitLanes, Surface};
use crate::simd::Level;
use crate::world::Transport;
use std::num::Wrapping;
use std::ops::Range;

/// Photons that are traced one after another: about as many as a wave has paths.
const CHUNK: u32 = 1 << 13;
/// Photons that are traced to see whether any of them ends where it is of use.
const PILOT: u32 = 1 << 12;
/// Their sample: behind all others.
const PILOT_SAMPLE: u32 = u32::MAX;
/// Camera rays along the longer side of the image that measure pixels.
const LONGER_SIDE: u32 = 48;
/// The most rays of a tile of the small image whose brightness is measured.
const MOST_RAYS: u64 = 1 << 21;
/// The most mirrors and panes before something else.
const MOST_BENDS: usize = 32;
/// About how many photons of all samples may be in memory at once, unless one sample has more: 60 bytes each.
const IN_MEMORY: u64 = 1 << 18;

/// What the photons of a frame have in common; none if there are none, or if they would be of no use.
pub fn plan(frame: &Frame, stop: &Stop) -> Option<Plan> {
    let (per_pixel, pixels_wide) = frame.photons?;
    let scene = &frame.scene;
    let targets = targets(scene, frame.transport);
    let count = count(frame, per_pixel);
    let radius = usual_radius(frame)? * pixels_wide;
    let mut stack = Stack::new(&scene.bvh);
    let mut bodies_at = |place: Vec3| camera_medium::around(scene, place, &mut stack);
    let emission = Emission::new(scene, frame.transport, targets, count, &mut bodies_at)?;
    let plan = Plan::new(frame, emission, radius);
    let mut worker = Worker::Recursive(Box::new(Recursion::new(&plan.frame)));
    let numbers = 0..PILOT;
    let statistics = &mut Statistics::default();
    let landed = worker.trace_photons(&plan, Level::detect(), PILOT_SAMPLE, numbers, statistics, stop);
    let any = !landed.photons.is_empty() && !stop.is_set();
    (any && (!frame.chooses_photons || are_enough(frame, &plan, &landed, stop))).then_some(plan)
}

/// Whether photons lie so close together that they make a picture, and no single bright dots. Those of the sun on a lake
/// would not: an image is better without their light. What photons bring to a pixel, in this many samples, should not
/// deviate by more than so many times the brightness of the image.
const SAMPLES: f64 = 16.0;
const DEVIATION: f64 = 4.0;
/// About the light that a surface sends to the camera of what falls on it: half of it, evenly.
const SENT: f32 = 0.5 * std::f32::consts::FRAC_1_PI;

fn are_enough(frame: &Frame, plan: &Plan, landed: &Landed, stop: &Stop) -> bool {
    let mut squares = 0.0;
    for (_, photon) in &landed.photons {
        let [x, y, z] = photon.position;
        // As if nothing were between: it may be seen in mirrors, or through glass.
        let view = view(frame, Vector::new(x, y, z), (0.5, 0.5));
        if is_in_image(frame, &view) {
            let facing = view.to_camera.dot(photon.normal()).abs();
            let [r, g, b] = photon.flux;
            let light = f64::from(Color::new(r, g, b).luminance() * SENT * view.importance * facing);
            squares += light * light;
        }
    }
    let pixels = f64::from(frame.size[0]) * f64::from(frame.size[1]);
    let of_a_sample = squares * f64::from(plan.count()) / f64::from(PILOT) / pixels;
    let deviation = (of_a_sample / SAMPLES).sqrt();
    // Without photons: their light is what is in question.
    let small = Frame { photons: None, ..frame.small(LONGER_SIDE) };
    let mut session = Session::of(Arc::new(small), 1, Options::default());
    session.advance_until(1, &stop.or_after_rays(MOST_RAYS), &|_| ());
    let light = session.film().radiance();
    let mean =
        light.iter().map(|pixel| f64::from(pixel.luminance())).sum::<f64>() / light.len().max(1) as f64;
    mean <= 0.0 || deviation <= DEVIATION * mean
}

/// The mean of the radii at the first surfaces where photons may end, as a few of the camera's rays find them; none if
/// they find none.
fn usual_radius(frame: &Frame) -> Option<f32> {
    let scene = &frame.scene;
    let mut stack = Stack::new(&scene.bvh);
    let [width, height] = frame.size;
    let by = width.max(height).div_ceil(LONGER_SIDE).max(1);
    let (mut sum, mut count) = (0.0f64, 0.0f64);
    for (x, y) in
        (0..height).step_by(by as usize).flat_map(|y| (0..width).step_by(by as usize).map(move |x| (x, y)))
    {
        let mut path = begin::begin::<f32>(frame, Wrapping(pack_pixel(x, y)), Wrapping(0));
        for _ in 0..MOST_BENDS {
            let traced = Traced { frame, path: &|| path, shadow: None };
            let hit =
                closest_ray(Level::detect(), &scene.bvh, &path.ray(), Asker::new(&traced, 0), &mut stack);
            if hit.is_miss() {
                break;
            }
            let lane = HitLanes::one(&hit);
            let material = material_of(&scene.geometry, &lane, true).0;
            if scene.materials[material as usize].ends_photons_under(frame.transport) {
                let surface = Surface::new(&scene.geometry, &path.ray(), &lane, true);
                // The first sample stands for a whole pixel.
                sum += f64::from(first_radius(&path, path.width + path.spread * hit.t, &surface));
                count += 1.0;
                break;
            }
            let Some(next) = next(frame, &path, &lane, material) else { break };
            path = next;
        }
    }
    (count > 0.0).then(|| (sum / count) as f32)
}

/// Where a path goes on that has met something that makes caustics.
fn next(frame: &Frame, path: &Path<f32>, hit: &HitLanes<f32>, material: u32) -> Option<Path<f32>> {
    if frame.transport == Transport::Path {
        let outcome = path_tracing::hit(frame, None, path, hit, material, true);
        return outcome.goes_on.then_some(outcome.next);
    }
    let (vertex, scatter, _) = whitted::hit(frame, None, path, hit, true);
    match (scatter.refracts, scatter.reflects) {
        (true, _) => Some(scatter.refracted(path, &vertex)),
        (_, true) => Some(scatter.reflected(path, &vertex)),
        _ => None,
    }
}

/// How many samples are rendered at once at most, so that their photons take little memory.
pub fn samples_at_once(plan: &Plan) -> u32 {
    at_once(plan.count())
}

fn at_once(count: u32) -> u32 {
    (IN_MEMORY / u64::from(count).max(1)).clamp(1, 16) as u32
}

/// The most memory that photons of a frame take.
#[cfg(any(feature = "cli", feature = "python"))]
pub fn most_bytes(frame: &Frame) -> u64 {
    let Some((per_pixel, _)) = frame.photons else { return 0 };
    let count = count(frame, per_pixel);
    // While they are sorted they are there twice.
    let each = 2 * (size_of::<Photon>() + size_of::<Splat>()) + 3 * size_of::<u32>();
    u64::from(count) * u64::from(at_once(count)) * each as u64
}

/// Photons of a sample.
fn count(frame: &Frame, per_pixel: f32) -> u32 {
    let pixels = frame.size.map(|side| side as f32);
    (per_pixel * pixels[0] * pixels[1]).clamp(1.0, 1e9) as u32
}

/// Calls a function with a worker and what that has done.
pub type Lend<'a> = dyn Fn(&mut dyn FnMut(&mut Worker, &mut Statistics)) + Sync + 'a;

/// The photons of some samples, traced on all threads; none if it was stopped. `with` lends a worker.
pub fn trace(plan: &Plan, samples: Range<u32>, stop: &Stop, with: &Lend) -> Option<Vec<OfSample>> {
    let chunks = plan.count().div_ceil(CHUNK);
    let todo: Vec<(u32, u32)> =
        samples.clone().flat_map(|sample| (0..chunks).map(move |chunk| (sample, chunk))).collect();
    let trace = |(sample, chunk): (u32, u32)| {
        let numbers = chunk * CHUNK..((chunk + 1) * CHUNK).min(plan.count());
        let mut landed = Landed::default();
        with(&mut |worker, statistics| {
            landed = worker.trace_photons(plan, Level::detect(), sample, numbers.clone(), statistics, stop);
        });
        landed
    };
    let landed: Vec<Landed> = todo.into_par_iter().map(trace).collect();
    if stop.is_set() {
        return None;
    }
    let of_samples: Vec<&[Landed]> = landed.chunks(chunks.max(1) as usize).collect();
    Some(samples.into_par_iter().zip(of_samples).map(|(sample, some)| plan.of_sample(sample, some)).collect())
}
