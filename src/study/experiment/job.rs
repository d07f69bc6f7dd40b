//! A job: renders or traces a scene with some settings and measures it.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::results::ResultRow;
use super::shapes;
use crate::bvh::baseline::binary_traversal::BinaryBvh;
use crate::bvh::baseline::brute;
use crate::bvh::kernels::traverse::closest_one;
use crate::bvh::{self, AnyHitFilter, Bvh, Coherence, HitsMut, Rays, Stack};
use crate::error::LoadError;
use crate::film::{PixelSum, metrics};
use crate::formats::study::{
    Axis, Measurement, SettingsOverride, StudyScene, StudySchedule, StudySorting, Tracing,
};
use crate::formats::{Files, LoadOptions};
use crate::integrator::Stop;
use crate::math::{DVec3, Rgb, Vec3};
use crate::memory;
use crate::query::HitBatch;
use crate::render::{DEFAULT_WAVE, Options, Session, on_threads};
use crate::scene::CompiledScene;
use crate::simd::{Isa, Kernel, Lanes, dispatch};
use crate::world::{Camera, Caustics, Falloff, Light, Shape, Sharing, Transform, World};

/// An image in linear radiance.
#[derive(Clone, Debug)]
pub struct StudyImage {
    /// Pixels per row.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// The pixels, row by row.
    pub pixels: Vec<Rgb>,
}

/// The measurements of a job, and its image if it rendered one.
pub struct Done {
    /// The measured values.
    pub row: ResultRow,
    /// The rendered image.
    pub image: Option<StudyImage>,
}

/// Sets the field that an axis varies. Triangles are not a setting: the scene is built with their number.
pub(super) fn at(change: &SettingsOverride, axis: &Axis, x: u32) -> SettingsOverride {
    let mut change = change.clone();
    match axis {
        Axis::Samples(_) | Axis::LensSamples(_) => change.samples = Some(x),
        Axis::LightSamples(_) => change.light_samples = Some(x),
        Axis::Wave(_) => change.wave = Some(x),
        Axis::Depth(_) => change.max_depth = Some(x),
        Axis::Threads(_) => change.threads = Some(x),
        Axis::Lanes(_) => change.lanes = Some(x),
        Axis::Photons(_) => change.photons = Some(x as f32),
        Axis::PhotonRadius(_) => change.photon_radius = Some(x as f32),
        Axis::Triangles(_) => {}
    }
    change
}

/// Returns the instruction set of a number of lanes, by default the widest.
fn isa(lanes: Option<u32>) -> Isa {
    lanes.and_then(|lanes| Isa::with_lanes(lanes as usize)).unwrap_or(Isa::detect())
}

/// True if the processor has the lanes that a job asks for.
pub(super) fn has_lanes(change: &SettingsOverride) -> bool {
    let mut lanes = change.lanes.into_iter().chain(change.shading_lanes);
    lanes.all(|lanes| Isa::with_lanes(lanes as usize).is_some())
}

/// The path of a scene's file, which is relative to the study's folder.
pub(super) fn path(folder: &Path, file: &Path) -> PathBuf {
    folder.join(file)
}

/// Builds the world of a job: the scene with changed settings.
fn world(
    scene: &StudyScene,
    folder: &Path,
    triangles: u32,
    change: &SettingsOverride,
    seed: u32,
) -> Result<World, String> {
    let (edits, text) = (change.edits(), |error: LoadError| error.to_string());
    let mut world = match scene {
        StudyScene::File(file) => {
            let size = change.size.map(|(width, height)| [width, height]);
            let options = LoadOptions { edits, size, ..LoadOptions::default() };
            crate::formats::load_with(path(folder, file), &options).map_err(text)?
        }
        StudyScene::Ball | StudyScene::Cloud => {
            let mesh =
                if *scene == StudyScene::Ball { shapes::ball(triangles) } else { shapes::cloud(triangles) };
            let mut world = made_up(mesh);
            edits.apply(&mut world, &mut Files::default()).map_err(text)?;
            world
        }
    };
    let settings = &mut world.settings;
    settings.size = change.size.map_or(settings.size, |(width, height)| [width, height]);
    settings.samples = change.samples.unwrap_or(settings.samples);
    settings.max_depth = change.max_depth.unwrap_or(settings.max_depth);
    settings.pixel_pattern = change.pixel_pattern.map_or(settings.pixel_pattern, Into::into);
    settings.transport = change.transport.map_or(settings.transport, Into::into);
    settings.sharing = match change.sharing {
        None => settings.sharing,
        Some(1) => Sharing::Off,
        Some(pixels) => Sharing::Groups(pixels),
    };
    if change.photons.is_some() || change.photon_radius.is_some() {
        let (photons, radius) = settings.caustics.numbers().unwrap_or((Caustics::PHOTONS, Caustics::RADIUS));
        settings.caustics = Caustics::Photons {
            photons: change.photons.unwrap_or(photons),
            radius: change.photon_radius.unwrap_or(radius),
        };
    }
    settings.sampler = change.sampler.map_or(settings.sampler, Into::into);
    settings.seed = settings.seed.wrapping_add(u64::from(seed));
    world.change_lights(|light| {
        if let Light::Area { samples, pattern, .. } = light {
            *samples = change.light_samples.unwrap_or(*samples);
            *pattern = change.light_pattern.map_or(*pattern, Into::into);
        }
    });
    world.change_cameras(|camera| {
        if let Camera::ThinLens { pattern, .. } = camera {
            *pattern = change.lens_pattern.map_or(*pattern, Into::into);
        }
    });
    Ok(world)
}

/// A mesh, a light, and a camera that faces the mesh.
fn made_up(mesh: crate::world::Mesh) -> World {
    let mut world = World::default();
    let mesh = world.assets.add_mesh(mesh);
    world.entities.spawn((Shape::Mesh(mesh), Transform::IDENTITY));
    let at = |x, y, z| Transform::Trs {
        translation: DVec3::new(x, y, z),
        rotation: crate::math::Quat::IDENTITY,
        scale: Vec3::ONE,
    };
    world.entities.spawn((Camera::Pinhole { vertical_fov: 0.7 }, at(0.0, 0.0, 4.0)));
    let lamp = Light::Point { power_w: Rgb::splat(400.0), falloff: Falloff::InverseSquare, radius_m: 0.0 };
    world.entities.spawn((lamp, at(2.0, 3.0, 4.0)));
    world
}

/// A clock of the process's CPU time; none if the system does not report it.
pub type CpuSeconds = fn() -> Option<f64>;

/// The distance between the seeds of a job's two images; larger than the number of repetitions.
const SECOND: u32 = 500_009;

/// Runs a job; being stopped is an error. `change` includes the value of x; `reference` is the image to compare with;
/// `in_pairs` renders a second image to separate bias from variance.
pub(super) fn run(
    scene: &StudyScene,
    folder: &Path,
    [triangles, seed]: [u32; 2],
    change: &SettingsOverride,
    (reference, in_pairs): (Option<&StudyImage>, bool),
    (cpu, stop): (CpuSeconds, &Stop),
) -> Result<Done, String> {
    let world = world(scene, folder, triangles, change, seed)?;
    let compiled = crate::compile::compile(&world, None).map_err(|error| error.to_string())?;
    let mut row = ResultRow::default();
    row.set(Measurement::BuildSeconds, compiled.bvh.statistics.time.as_secs_f64());
    row.set(Measurement::TreeBytes, compiled.bvh.bytes() as f64);
    if let Some(count) = change.rays {
        let (isa, by) = (isa(change.lanes), change.by.unwrap_or(Tracing::Queue));
        trace(isa, &compiled, by, [count, seed], cpu, &mut row);
        return Ok(Done { row, image: None });
    }
    let image = render(compiled, &world, change, (cpu, stop), &mut row)?;
    if let Some(reference) = reference {
        if (image.width, image.height) != (reference.width, reference.height) {
            return Err("the reference has another size: set size in `with` of the experiment".into());
        }
        let _claim = metrics::claim([image.width, image.height]).map_err(|shortage| shortage.to_string())?;
        let errors = metrics::compare(image.width as usize, &image.pixels, &reference.pixels, 1.0).metrics;
        row.set(Measurement::Mse, errors.mse);
        row.set(Measurement::RelativeMse, errors.relative_mse);
        row.set(Measurement::Flip, errors.flip);
    }
    if in_pairs {
        // The second image's time is not measured.
        let change = SettingsOverride { threads: Some(0), ..change.clone() };
        let seed = seed.wrapping_add(SECOND);
        let second = run(scene, folder, [triangles, seed], &change, (None, false), (cpu, stop))?;
        if let Some(second) = second.image {
            add_pair(&image, &second, reference, &mut row);
        }
    }
    Ok(Done { row, image: Some(image) })
}

/// Separates bias from variance: the error that two independent images have in common is bias, their difference is
/// variance. Both estimates are unbiased, so the estimate of a small squared bias may be negative.
fn add_pair(first: &StudyImage, second: &StudyImage, reference: Option<&StudyImage>, row: &mut ResultRow) {
    let components = |image: &StudyImage| {
        image.pixels.iter().flat_map(|p| [p.r, p.g, p.b].map(f64::from)).collect::<Vec<_>>()
    };
    let [first, second] = [components(first), components(second)];
    let mean = |sum: f64| sum / first.len().max(1) as f64;
    let squares = first.iter().zip(&second).map(|(a, b)| (a - b) * (a - b));
    row.set(Measurement::Variance, mean(0.5 * squares.sum::<f64>()));
    if let Some(reference) = reference.map(components) {
        let products = first.iter().zip(&second).zip(&reference).map(|((a, b), r)| (a - r) * (b - r));
        row.set(Measurement::SquaredBias, mean(products.sum()));
    }
}

fn render(
    compiled: CompiledScene,
    world: &World,
    change: &SettingsOverride,
    (cpu, stop): (CpuSeconds, &Stop),
    row: &mut ResultRow,
) -> Result<StudyImage, String> {
    let schedule = match change.schedule {
        Some(StudySchedule::Recursive) => crate::integrator::Schedule::Recursive,
        Some(StudySchedule::Wavefront) | None => crate::integrator::Schedule::Wavefront,
    };
    let wave = change.wave.map_or(DEFAULT_WAVE, |wave| wave as usize);
    // Small tiles, since otherwise small images would leave most threads idle.
    let sorting = match change.sorting {
        Some(StudySorting::Unsorted) => crate::integrator::Sorting::Unsorted,
        Some(StudySorting::ByMaterial) | None => crate::integrator::Sorting::ByMaterial,
    };
    let queries = isa(change.lanes);
    let shading = change.shading_lanes.map_or(queries, |lanes| isa(Some(lanes)));
    let options = Options {
        schedule,
        wave,
        sorting,
        isa: if schedule == crate::integrator::Schedule::Wavefront { shading } else { queries },
        traversal: Some(queries),
        tile: 32,
        ..Options::default()
    };
    let [width, height] = world.settings.size;
    // The sums of the film, and the final image.
    let bytes = u64::from(width) * u64::from(height) * (size_of::<PixelSum>() + size_of::<Rgb>()) as u64;
    memory::reserve(format_args!("an image of {width}x{height}"), bytes)
        .map_err(|shortage| shortage.to_string())?;
    let mut session = Session::new(compiled, &world.settings, options);
    let threads = change.threads.unwrap_or(1) as usize;
    let clean = change.denoise == Some(true);
    let (wall, spent, denoised) = on_threads(threads, || {
        let (start, before) = (Instant::now(), cpu());
        session.advance_until(u32::MAX, stop, &|_| ());
        let denoised = if clean { session.denoised() } else { None };
        (start.elapsed().as_secs_f64(), before.zip(cpu()).map(|(before, after)| after - before), denoised)
    })
    .map_err(|error| error.to_string())?;
    if stop.is_set() && !session.is_done() {
        return Err("it was stopped".into());
    }
    if clean && denoised.is_none() {
        return Err("denoise takes two samples of each pixel and more".into());
    }
    let rays = session.statistics().rays.total() as f64;
    row.set(Measurement::RenderSeconds, wall);
    row.set(Measurement::Mrays, rays / wall.max(1e-9) / 1e6);
    if let Some(spent) = spent {
        row.set(Measurement::CpuSeconds, spent);
        row.set(Measurement::NanosecondsPerRay, spent * 1e9 / rays.max(1.0));
    }
    row.film = Some(session.film().hash());
    let [width, height] = world.settings.size;
    let pixels = denoised.map_or_else(|| session.film().radiance(), |denoised| denoised.radiance);
    Ok(StudyImage { width, height, pixels })
}

/// The most triangle tests of a brute-force job: about a second.
const MOST_TESTS: u64 = 300_000_000;

/// Traces one ray after another with the recursive schedule's kernel.
struct Singly<'a> {
    bvh: &'a Bvh,
    rays: Rays<'a>,
    hits: HitsMut<'a>,
    stack: &'a mut Stack,
}

impl Kernel for Singly<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        for i in 0..self.rays.len() {
            self.hits.t[i] = closest_one::<L>(
                self.bvh,
                &self.rays.ray(i),
                AnyHitFilter::ACCEPT_ALL,
                &mut self.stack.single,
            )
            .t;
        }
    }
}

/// Traces scattered rays on this thread and measures it.
fn trace(
    isa: Isa,
    compiled: &CompiledScene,
    by: Tracing,
    [count, seed]: [u32; 2],
    cpu: CpuSeconds,
    row: &mut ResultRow,
) {
    let bvh = &compiled.bvh;
    let triangles = compiled.geometry.triangles.len().max(1) as u64;
    let count = match by {
        Tracing::BruteForce => u64::from(count).min(MOST_TESTS / triangles).max(1) as u32,
        Tracing::Queue | Tracing::Single | Tracing::Binary => count,
    };
    let batch = shapes::rays(count, seed);
    let mut hits = HitBatch::new(batch.len());
    let mut stack = Stack::new(bvh);
    let narrow = (by == Tracing::Binary).then(|| {
        let geometry = &compiled.geometry;
        let world = bvh::PrimitiveArrays {
            positions: &geometry.positions,
            triangles: &geometry.triangles[..geometry.world_triangles as usize],
            spheres: &[],
        };
        BinaryBvh::new(&world)
    });
    if let Some(narrow) = &narrow {
        row.set(Measurement::TreeBytes, narrow.bytes() as f64);
    }
    let (start, before) = (Instant::now(), cpu());
    match by {
        Tracing::Queue => {
            bvh::closest(isa, bvh, batch.rays(), Coherence::Scattered, &mut stack, hits.hits_mut());
        }
        Tracing::Single => {
            let (rays, hits, stack) = (batch.rays(), hits.hits_mut(), &mut stack);
            dispatch(isa, Singly { bvh, rays, hits, stack });
        }
        Tracing::Binary => {
            if let Some(narrow) = &narrow {
                narrow.closest(isa, batch.rays(), hits.hits_mut());
            }
        }
        Tracing::BruteForce => {
            for i in 0..batch.len() {
                let hit = brute::closest(isa, bvh, &batch.rays().ray(i));
                hits.hits_mut().t[i] = hit.t;
            }
        }
    }
    let wall = start.elapsed().as_secs_f64();
    let spent = before.zip(cpu()).map_or(wall, |(before, after)| after - before);
    row.set(Measurement::RenderSeconds, wall);
    row.set(Measurement::CpuSeconds, spent);
    row.set(Measurement::NanosecondsPerRay, spent * 1e9 / f64::from(count));
    row.set(Measurement::Mrays, f64::from(count) / wall.max(1e-9) / 1e6);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pair_bias_and_variance_add_up_to_the_mean_squared_error() {
        let image =
            |values: [f32; 2]| StudyImage { width: 2, height: 1, pixels: values.map(Rgb::splat).to_vec() };
        let (first, second, reference) = (image([1.5, 3.0]), image([2.5, 1.0]), image([1.0, 1.0]));
        let mut row = ResultRow::default();
        add_pair(&first, &second, Some(&reference), &mut row);
        assert_eq!(row.get(Measurement::SquaredBias), Some((0.5 * 1.5 + 2.0 * 0.0) / 2.0));
        assert_eq!(row.get(Measurement::Variance), Some((1.0 + 4.0) / 4.0));
        let squares = (0.25 + 4.0 + 2.25 + 0.0) / 4.0;
        assert_eq!(
            row.get(Measurement::SquaredBias).zip(row.get(Measurement::Variance)).map(|(b, v)| b + v),
            Some(squares)
        );
    }
}
