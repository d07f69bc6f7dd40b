//! `rayfront profile SCENE`: measures where the time goes in both schedules, or captures a queue of the wavefront.

mod capture;
mod costs;
mod report;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use indicatif::ProgressBar;
use serde_json::{Value, json};

use self::capture::CaptureOptions;
use crate::cli::args::{ImageSize, SCHEDULES, StudyOptions, name_of, parse_level, parse_size};
use crate::cli::{failure::Failure, output, process_times, progress::styled};
use crate::integrator::{RenderSetup, Schedule, Stage, Stop};
use crate::render::{Session, Span, on_threads};
use crate::simd::Isa;
use crate::study::profile::report::ProfileReport;
use crate::study::profile::{self, ProfilePlan, counters, flow, page};

/// `rayfront profile`.
#[derive(Args, Debug)]
pub struct ProfileArguments {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj, .stl)
    pub scene: PathBuf,
    /// Size of the image in pixels; it is rendered some forty times
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "320x180")]
    pub size: ImageSize,
    /// Samples per pixel
    #[arg(short = 's', long, visible_alias = "samples-per-pixel", value_name = "N", default_value_t = 4,
          value_parser = clap::value_parser!(u32).range(1..=4_194_304))]
    pub spp: u32,
    /// Measured runs of each way to render
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub runs: u32,
    /// Paths in a wave of the wavefront schedule
    #[arg(long, value_name = "N", default_value_t = crate::render::DEFAULT_WAVE as u32,
          value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub wave: u32,
    /// Threads; 0 means one for each core
    #[arg(short, long, value_name = "N", default_value_t = 1)]
    pub threads: usize,
    /// Instruction set [default: the widest available]
    #[arg(long, value_name = "LEVEL", value_parser = parse_level)]
    pub simd: Option<Isa>,
    /// File for a timeline of the threads, for chrome://tracing or ui.perfetto.dev
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// File for a page with diagrams and plots (.html)
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// The options of a capture.
    #[command(flatten)]
    pub capture: CaptureOptions,
    /// The other options.
    #[command(flatten)]
    pub options: StudyOptions,
}

impl ProfileArguments {
    /// Returns the output files.
    pub fn outputs(&self) -> Vec<&Path> {
        let outputs = [&self.trace, &self.html, &self.capture.capture];
        outputs.into_iter().flatten().map(PathBuf::as_path).collect()
    }
}

pub fn run(arguments: &ProfileArguments) -> Result<ExitCode, Failure> {
    let ProfileArguments { scene, size, spp, options, .. } = arguments;
    let (world, setup) = super::setup(scene, options, *size, *spp)?;
    let plan = ProfilePlan {
        samples: *spp,
        runs: arguments.runs,
        threads: arguments.threads,
        wave: arguments.wave as usize,
        isa: arguments.simd.unwrap_or(Isa::detect()),
        cpu_seconds: process_times::process_cpu_seconds,
    };
    for (option, file) in [
        ("--trace", &arguments.trace),
        ("--html", &arguments.html),
        ("--capture", &arguments.capture.capture),
    ] {
        file.iter().try_for_each(|file| super::check_is_not_read(file, &world.assets.files, option))?;
    }
    if let Some(file) = &arguments.capture.capture {
        output::print(&capture::run(file, arguments, &setup, &plan)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let bar = ProgressBar::new(u64::from(arguments.runs) + 4);
    let bar = styled(bar, "measuring {bar:32} {pos} of {len}  {eta} left");
    let times = profile::time(&setup, &plan, &mut |round| bar.set_position(u64::from(round) + 1))?;
    let photons = crate::render::photons::plan(&setup, &Stop::NEVER).map(|plan| plan.count());
    let stages = profile::stage_times(&setup, &plan)?;
    bar.inc(1);
    let flows = flow::count(&setup, &plan);
    bar.inc(1);
    let counted = counters::count(&setup, &plan)?;
    bar.finish_and_clear();
    if let Some(path) = &arguments.trace {
        write_trace(path, &setup, &plan)?;
    }
    let report = ProfileReport {
        scene,
        size: *size,
        plan: &plan,
        setup: &setup,
        times: &times,
        stages: &stages,
        photons,
        flows: &flows,
        names: &world.names(),
        counted: &counted,
    };
    if let Some(path) = &arguments.html {
        let page = page::html(&report, &page::ceilings(&report)?).map_err(Failure::output)?;
        crate::files::replace(path, page.as_bytes())?;
    }
    let text = if options.json { format!("{}\n", report.json()) } else { report.text() };
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Renders with both schedules once more, and writes a trace for Chrome's and Perfetto's viewers.
fn write_trace(path: &Path, setup: &Arc<RenderSetup>, plan: &ProfilePlan) -> Result<(), Failure> {
    let mut events = Vec::new();
    for (process, schedule) in [Schedule::Wavefront, Schedule::Recursive].into_iter().enumerate() {
        let mut session = Session::of(setup.clone(), plan.samples, plan.options(schedule));
        session.prepare(&Stop::NEVER);
        let spans = on_threads(plan.threads, || session.spans())?;
        let name = name_of(SCHEDULES, &schedule);
        events.push(json!({"name": "process_name", "ph": "M", "pid": process, "args": {"name": name}}));
        events.extend(
            spans.iter().flat_map(|span| [Some(event(process, span)), counter(process, span)]).flatten(),
        );
    }
    let trace = json!({"traceEvents": events, "displayTimeUnit": "ms"});
    Ok(crate::files::replace(path, trace.to_string().as_bytes())?)
}

fn event(process: usize, span: &Span) -> Value {
    let microseconds = |time: std::time::Duration| time.as_secs_f64() * 1e6;
    json!({
        "name": span.stage.map_or("tile", |stage| stage.name()),
        "ph": "X",
        "pid": process,
        "tid": span.thread,
        "ts": microseconds(span.start),
        "dur": microseconds(span.end.saturating_sub(span.start)),
        "args": {"x": span.tile.x0, "y": span.tile.y0},
    })
}

/// The items of a queue at the end of a stage, for each thread; none of stages that only pass on what others have counted.
fn counter(process: usize, span: &Span) -> Option<Value> {
    let queue = match span.stage? {
        Stage::Intersect => "rays",
        Stage::Shade => "hits",
        Stage::Shadow => "rays to lights",
        _ => return None,
    };
    Some(json!({
        "name": format!("{queue}, thread {}", span.thread),
        "ph": "C",
        "pid": process,
        "ts": span.end.as_secs_f64() * 1e6,
        "args": {"items": span.items},
    }))
}
