//! `rayfront SCENE`: load, compile, render, save.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::aov;
use super::args::Render;
use super::interrupt::Interrupt;
use super::report::{Phases, RenderReport};
use super::{Failure, usage};
use crate::denoise::{self, Denoised};
use crate::film::exposure::automatic_ev;
use crate::film::tonemap::DisplayTransform;
use crate::film::{Features, PixelSum, Region};
use crate::formats::picture::{Output, PngBits, save, supported};
use crate::math::Rgb;
use crate::render::{Options, Session};
use crate::world::{Aov, Settings};

pub(super) fn run(arguments: &Render) -> Result<ExitCode, Failure> {
    let Some(scene) = &arguments.scene else { return Err(Failure("no scene was given".into())) };
    let outputs = outputs(arguments, scene);
    outputs.iter().try_for_each(|path| supported(path))?;
    let threads = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build()?;
    // Everything, loading too, runs on the threads that were asked for.
    threads.install(|| render(arguments, scene, &outputs))
}

/// Where the images go: what was asked for, or the scene's name with .png.
fn outputs(arguments: &Render, scene: &Path) -> Vec<PathBuf> {
    if !arguments.output.is_empty() {
        return arguments.output.clone();
    }
    let name = scene.with_extension("png");
    vec![PathBuf::from(name.file_name().unwrap_or("image.png".as_ref()))]
}

fn render(arguments: &Render, path: &Path, images: &[PathBuf]) -> Result<ExitCode, Failure> {
    let mut phases = Phases::default();
    let start = Instant::now();
    let mut world = crate::formats::load_with(path, &(&arguments.model).into())?;
    arguments.apply(&mut world.settings);
    phases.load = start.elapsed();

    let start = Instant::now();
    let scene = crate::compile::compile(&world, arguments.camera.as_deref())
        .map_err(|error| Failure(format!("{}: {error}", path.display())))?;
    phases.compile = start.elapsed();
    if !arguments.quiet {
        scene.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    }
    let settings = world.settings.clone();
    let outputs = &aov::with_file(images, &settings.aov)[..];
    outputs.iter().try_for_each(|path| supported(path))?;
    let names = if settings.aov.contains(&Aov::Entity) { world.names() } else { HashMap::new() };
    // Compiled: large meshes need not stay twice.
    drop(world);

    let options = options(arguments, &settings)?;
    let mut session = Session::new(scene, &settings, options);
    let start = Instant::now();
    let cpu = usage::cpu_seconds();
    let code = passes(&mut session, arguments.quiet);
    phases.render = start.elapsed();
    phases.render_cpu = usage::cpu_seconds().zip(cpu).map(|(after, before)| after - before);

    let start = Instant::now();
    let denoised = if arguments.denoise { session.denoised() } else { None };
    phases.denoise = start.elapsed();
    if arguments.denoise && denoised.is_none() {
        eprintln!("warning: nothing is denoised: that takes two samples of each pixel (--spp 2 or more)");
    }
    let start = Instant::now();
    let exposure_ev = write(&session, &settings, arguments, outputs, &names)?;
    let clean = denoised.as_ref().map(|denoised| {
        let paths = write_denoised(&session, &settings, arguments, denoised, images, exposure_ev)?;
        Ok::<_, Failure>((denoised, paths))
    });
    let clean = clean.transpose()?;
    phases.save = start.elapsed();
    let (session, settings, options) = (&session, &settings, &options);
    let denoised = clean.as_ref().map(|(denoised, paths)| (*denoised, &paths[..]));
    let report =
        RenderReport { scene: path, outputs, session, settings, options, exposure_ev, denoised, phases };
    if arguments.json {
        println!("{}", report.json());
    } else if !arguments.quiet {
        print!("{}", report.text());
    }
    Ok(code)
}

fn options(arguments: &Render, settings: &Settings) -> Result<Options, Failure> {
    let [width, height] = settings.size;
    if let Some(Region { x1, y1, .. }) = arguments.crop
        && (x1 > width || y1 > height)
    {
        return Err(Failure(format!("--crop ends at {x1},{y1}, beyond the image of {width}x{height}")));
    }
    let region = arguments.crop.unwrap_or(Region::whole(settings.size));
    // Sums, and the picture that is made of them.
    let mut pixel = size_of::<PixelSum>() + size_of::<Rgb>();
    if !settings.aov.is_empty() {
        pixel += size_of::<Features>() + size_of::<[u128; 3]>() + 2 * 4 * aov::MOST_CHANNELS;
    }
    if arguments.denoise {
        pixel += denoise::BYTES + 2 * size_of::<Features>();
    }
    let needed = region.area() as u64 * pixel as u64;
    if let Some(available) = usage::available_memory()
        && needed > available
    {
        let (needed, available) = (needed as f64 / 1e9, available as f64 / 1e9);
        return Err(Failure(format!(
            "an image of {width}x{height} takes {needed:.1} GB and {available:.1} GB are free: use --crop or a smaller --size"
        )));
    }
    let defaults = Options::default();
    Ok(Options {
        schedule: arguments.schedule.into(),
        wave: arguments.wave as usize,
        level: arguments.simd.unwrap_or(defaults.level),
        region: arguments.crop,
        variance: settings.aov.contains(&Aov::Variance),
        ..defaults
    })
}

/// Renders pass after pass until done or interrupted; says with which code the program ends.
///
/// The first passes are short, so that soon every pixel holds something worth saving.
fn passes(session: &mut Session, quiet: bool) -> ExitCode {
    let interrupt = Interrupt::watch();
    let stop = interrupt.flag();
    let bar = if quiet { ProgressBar::hidden() } else { progress_bar(session) };
    for pass in [1, 3, 12].into_iter().chain(std::iter::repeat(16)) {
        if session.is_done() || stop.load(Ordering::Relaxed) {
            break;
        }
        session.advance_until(pass, stop, &|samples| bar.inc(samples));
    }
    bar.finish_and_clear();
    interrupt.exit_code()
}

fn progress_bar(session: &Session) -> ProgressBar {
    let samples = session.film().region().area() as u64 * session.samples_done().1 as u64;
    let bar = ProgressBar::new(samples);
    let template =
        "rendering {bar:32} {percent:>3} %  {human_pos} of {human_len} samples  {per_sec}  {eta} left";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("█▉▊▋▌▍▎▏ "));
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// Saves the images; returns the stops by which they are exposed.
fn write(
    session: &Session,
    settings: &Settings,
    arguments: &Render,
    outputs: &[PathBuf],
    names: &HashMap<u32, String>,
) -> Result<f32, Failure> {
    let radiance = session.film().radiance();
    let own_ev = if settings.auto_exposure { automatic_ev(&radiance) } else { 0.0 };
    let exposure_ev = own_ev + settings.exposure_ev;
    let channels = session.channels(&settings.aov);
    let metadata = metadata(session, settings, exposure_ev);
    let manifest = aov::manifest(&channels, names, session.scene()).map(|ids| ("manifest".to_string(), ids));
    let with_manifest: Vec<_> = metadata.iter().cloned().chain(manifest).collect();
    let output = picture(session, settings, arguments, &radiance, exposure_ev, &metadata);
    let whole = Output { metadata: &with_manifest, channels: &channels, ..output };
    outputs.iter().try_for_each(|path| save(path, if aov::holds(path) { &whole } else { &output }))?;
    Ok(exposure_ev)
}

/// Pixels of a session as files hold them.
fn picture<'a>(
    session: &Session,
    settings: &Settings,
    arguments: &Render,
    radiance: &'a [Rgb],
    exposure_ev: f32,
    metadata: &'a [(String, String)],
) -> Output<'a> {
    let region = session.film().region();
    Output {
        width: region.width(),
        height: region.height(),
        radiance,
        display: DisplayTransform::new(settings.tonemap, exposure_ev, radiance),
        bits: if arguments.bits == 16 { PngBits::Sixteen } else { PngBits::Eight },
        metadata,
        channels: &[],
    }
}

/// Saves what is left without noise beside the images, as bright as these; returns where.
fn write_denoised(
    session: &Session,
    settings: &Settings,
    arguments: &Render,
    denoised: &Denoised,
    images: &[PathBuf],
    exposure_ev: f32,
) -> Result<Vec<PathBuf>, Failure> {
    let mut metadata = metadata(session, settings, exposure_ev);
    metadata.push(("denoised_hash".to_string(), format!("{:032x}", denoised.hash())));
    let output = picture(session, settings, arguments, &denoised.radiance, exposure_ev, &metadata);
    let beside = |path: &PathBuf| {
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        path.with_extension(format!("denoised.{extension}"))
    };
    let paths: Vec<PathBuf> = images.iter().map(beside).collect();
    paths.iter().try_for_each(|path| save(path, &output))?;
    Ok(paths)
}

/// What an image says about itself: enough to render it again.
fn metadata(session: &Session, settings: &Settings, exposure_ev: f32) -> Vec<(String, String)> {
    let entry = |key: &str, value: String| (key.to_string(), value);
    let (done, asked) = session.samples_done();
    let [width, height] = settings.size;
    let limits = settings.depth_limits.given().map(|(name, limit)| entry(name, limit.to_string()));
    let mut entries = vec![
        entry("Software", format!("rayfront {}", env!("CARGO_PKG_VERSION"))),
        entry("samples", if done == asked { done.to_string() } else { format!("{done} of {asked}") }),
        entry("seed", settings.seed.to_string()),
        entry("size", format!("{width}x{height}")),
        entry("max_depth", settings.max_depth.to_string()),
        entry("min_throughput", settings.min_throughput.to_string()),
        entry("transport", format!("{:?}", settings.transport)),
        entry("filter", format!("{:?}", settings.filter)),
        entry("pixel_pattern", format!("{:?}", settings.pixel_pattern)),
        entry("tonemap", format!("{:?}", settings.tonemap)),
        entry("exposure_ev", exposure_ev.to_string()),
        entry("film_hash", format!("{:032x}", session.film().hash())),
    ];
    entries.extend(limits);
    entries
}
