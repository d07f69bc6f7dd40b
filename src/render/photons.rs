//! Photons: whether a frame has any, and those of the samples that are rendered next.

use rayon::prelude::*;

use super::camera_medium;
use crate::bvh::{Asker, Stack, closest_ray};
use crate::integrator::path::{Path, pack_pixel};
use crate::integrator::photons::gather::first_radius;
use crate::integrator::photons::targets::targets;
use crate::integrator::photons::{Landed, OfSample, Plan, emission::Emission};
#[cfg(any(feature = "cli", feature = "python"))]
use crate::integrator::photons::{draw::Splat, map::Photon};
use crate::integrator::presence::Traced;
use crate::integrator::recursive::Recursion;
use crate::integrator::{Frame, Statistics, Stop, Worker, begin, path_tracing, whitted};
use crate::math::Vec3;
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
    (!landed.photons.is_empty()).then_some(plan)
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

#[cfg(all(test, feature = "formats"))]
mod tests {
    use super::*;
    use crate::formats::ron;
    use crate::integrator::Schedule;
    use crate::render::{Options, frame};

    /// The light that has ended, in watts, of `samples` samples on average, with the plan.
    fn landed(settings: &str, entities: &str, samples: u32) -> (f64, Plan) {
        struct None;
        impl crate::formats::AssetFiles for None {
            fn mesh(
                &mut self,
                path: &std::path::Path,
                _: &mut crate::world::Assets,
                _: &mut Vec<String>,
            ) -> Result<std::sync::Arc<crate::world::Mesh>, crate::error::LoadError> {
                Err(crate::error::LoadError::Invalid { file: path.into(), reason: "no mesh".into() })
            }
            fn model(
                &mut self,
                path: &std::path::Path,
                _: &mut crate::world::Assets,
                _: &mut Vec<String>,
            ) -> Result<crate::formats::gltf::Model, crate::error::LoadError> {
                Err(crate::error::LoadError::Invalid { file: path.into(), reason: "no model".into() })
            }
            fn image(
                &mut self,
                path: &std::path::Path,
            ) -> Result<std::sync::Arc<crate::world::Image>, crate::error::LoadError> {
                Err(crate::error::LoadError::Invalid { file: path.into(), reason: "no image".into() })
            }
        }
        let text = format!(
            "(settings: (size: (64, 64), transport: Path, {settings}),
              entities: [(camera: Pinhole, transform: LookAt(from: (0, 2, 6), to: (0, 0, 0))), {entities}])"
        );
        let world = ron::parse(&text, std::path::Path::new("a.ron"), &mut None).expect("a world");
        let scene = crate::compile::compile(&world, Option::None).expect("a scene");
        let frame = frame(scene, &world.settings);
        let plan = plan(&frame, &Stop::NEVER).expect("photons");
        let options = Options::default();
        let mut sum = 0.0;
        for schedule in [Schedule::Wavefront, Schedule::Recursive] {
            let mut worker = Worker::new(&frame, schedule, options.wave, options.sorting);
            for sample in 0..samples {
                let statistics = &mut Statistics::default();
                let all = 0..plan.count();
                let landed =
                    worker.trace_photons(&plan, options.level, sample, all, statistics, &Stop::NEVER);
                sum += landed.photons.iter().map(|(_, photon)| f64::from(photon.flux[1])).sum::<f64>();
            }
        }
        (sum / f64::from(2 * samples), plan)
    }

    /// A room around a ball: photons that come from the ball end there.
    const ROOM: &str = "(shape: Sphere(radius_m: 20), material: (diffuse: 0.5)),";

    fn ball(radius: f64, material: &str) -> String {
        format!("(shape: Sphere(radius_m: {radius}), material: {material}),")
    }

    /// Of a point's light, what falls on a ball ends somewhere, but for what the ball absorbs.
    #[test]
    fn no_light_is_lost_between_a_lamp_and_the_walls() {
        let lamp = "(light: Point(power_w: 1000), transform: (translate: (0, 3, 0))),";
        // 4 π of 1000 W; the ball takes up 2 π (1 − √(1 − 1/9)).
        let falls = 1000.0 * 0.5 * (1.0 - (1.0f64 - 1.0 / 9.0).sqrt());
        for (material, part) in [
            ("(ior: 1.5)", 1.0),
            ("(ior: 2.4)", 1.0),
            ("(kr: 0.75, diffuse: 0)", 0.75),
            ("Principled(metallic: 0, transmission: 1, roughness: 0, ior: 1.3, volume: ())", 1.0),
        ] {
            let entities = format!("{ROOM}{}{lamp}", ball(1.0, material));
            let (light, plan) = landed("max_depth: 200", &entities, 16);
            assert_eq!(plan.count(), 64 * 64);
            assert!((light / (falls * part) - 1.0).abs() < 2e-3, "{material}: {light} of {falls} W");
        }
    }

    /// The same of lamps with a surface, and from far away.
    #[test]
    fn lamps_of_all_kinds_send_what_falls_on_a_ball() {
        // A small surface far away: its intensity straight ahead is its power over π.
        let solid_angle =
            |distance: f64| 2.0 * std::f64::consts::PI * (1.0 - (1.0 - 1.0 / (distance * distance)).sqrt());
        for (lamp, falls) in [
            (
                "(light: Area(power_w: 1000, size_m: 0.01), transform: LookAt(from: (0, 10, 0.01), to: (0, 0, 0))),",
                1000.0 / std::f64::consts::PI * solid_angle(10.0),
            ),
            (
                "(shape: Sphere(radius_m: 0.05), material: (diffuse: 0, emission: 1000), transform: (translate: (0, 10, 0))),",
                1000.0 * std::f64::consts::PI * 0.05 * 0.05 * solid_angle(10.0),
            ),
            (
                "(light: Directional(irradiance: 10, angle_degrees: 2), transform: LookAt(from: (0, 10, 0.01), to: (0, 0, 0))),",
                10.0 * std::f64::consts::PI,
            ),
            (
                "(light: Spot(power_w: 1000, inner_degrees: 30, outer_degrees: 40), transform: LookAt(from: (0, 10, 0.01), to: (0, 0, 0))),",
                1000.0 / (4.0 * std::f64::consts::PI) * solid_angle(10.0),
            ),
        ] {
            // A directional light begins outside of the room.
            let room = if lamp.contains("Directional") {
                "(shape: Plane(corners: ((-99, -3, 99), (99, -3, 99), (99, -3, -99), (-99, -3, -99))), material: (diffuse: 0.5)),"
            } else {
                ROOM
            };
            let (light, _) =
                landed("max_depth: 200", &format!("{room}{}{lamp}", ball(1.0, "(ior: 1.000001)")), 16);
            assert!((light / falls - 1.0).abs() < 4e-3, "{lamp}: {light} of {falls} W");
        }
    }

    /// Balls that overlap and balls that are apart: light that is aimed at several counts once.
    #[test]
    fn light_that_is_aimed_at_several_things_counts_once() {
        let lamp = "(light: Point(power_w: 1000), transform: (translate: (0, 5, 0))),";
        let at = |x: f64| {
            format!(
                "(shape: Sphere(radius_m: 1), material: (ior: 1.000001), transform: (translate: ({x}, 0, 0))),"
            )
        };
        let alone = landed("max_depth: 50", &format!("{ROOM}{}{lamp}", at(0.0)), 8).0;
        let apart = landed("max_depth: 50", &format!("{ROOM}{}{}{}{lamp}", at(-4.0), at(0.0), at(4.0)), 16);
        let side = landed("max_depth: 50", &format!("{ROOM}{}{lamp}", at(4.0)), 8).0;
        assert!((apart.0 / (alone + 2.0 * side) - 1.0).abs() < 6e-3, "{} {alone} {side}", apart.0);
    }
}
