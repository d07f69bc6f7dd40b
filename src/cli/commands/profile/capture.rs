//! `rayfront profile SCENE --capture FILE`: writes the rays of one queue, and prints the command that traces them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use serde_json::json;

use super::ProfileArguments;
use crate::cli::args::{NamedValues, name_of, one_of};
use crate::cli::command_line::{CommandLine, not_an_option};
use crate::cli::failure::Failure;
use crate::cli::output;
use crate::files::atomic_write::writable;
use crate::formats::rays::{HitSummary, RAY_BYTES, save_rays};
use crate::integrator::{RenderSetup, Stage};
use crate::math::DVec3;
use crate::render::on_threads;
use crate::study::profile::ProfilePlan;
use crate::study::profile::capture::StageCapture;

/// The stages of which queues can be captured.
const TRACING: NamedValues<Stage> = &[
    ("intersect", "Nearest hits of camera rays and of paths", Stage::Intersect),
    ("shadow", "Rays to lights, which end at any hit", Stage::Shadow),
];

/// The options of a capture.
#[derive(Args, Debug)]
pub struct CaptureOptions {
    /// File for the rays of one queue; measures nothing, and prints the command that traces them again
    #[arg(long, value_name = "FILE", conflicts_with_all = ["html", "trace", "runs"])]
    pub capture: Option<PathBuf>,
    /// Stage of the captured queue
    #[arg(long, default_value = "intersect", requires = "capture", value_parser = one_of(TRACING))]
    pub stage: Stage,
    /// Capture the queue with the most rays after this many bounces [default: the one with the most rays]
    #[arg(long, value_name = "N", requires = "capture")]
    pub bounce: Option<u32>,
}

/// Captures a queue in a file; returns the report.
pub(super) fn run(
    file: &Path,
    arguments: &ProfileArguments,
    setup: &Arc<RenderSetup>,
    plan: &ProfilePlan,
) -> Result<String, Failure> {
    writable(file)?;
    let CaptureOptions { stage, bounce, .. } = arguments.capture;
    let bounces = bounce.map(|bounce| bounce as usize);
    let capture = on_threads(1, || StageCapture::new(setup, plan, stage, bounces))?;
    let queue = &capture.fullest;
    if queue.rays.is_empty() {
        return Err(Failure::command_line(nothing(&capture, arguments)));
    }
    save_rays(file, &queue.rays)?;
    let replayed = capture.replay(setup, plan);
    let differing = queue.hits.iter().zip(&replayed).filter(|(ours, theirs)| ours != theirs).count();
    let [ours, replayed] = [&queue.hits, &replayed].map(|hits| HitSummary::of(hits.iter().copied()));
    let (rays, command) = (queue.rays.len(), replay_command(file, arguments, setup));
    let stage = name_of(TRACING, &stage);
    if arguments.options.json {
        let object = json!({
            "scene": output::path_json(&arguments.scene), "rays_file": output::path_json(file), "stage": stage,
            "queue": queue.number, "queues": capture.queues, "rays": rays,
            "rays_by_bounce": queue.rays_by_bounce, "hits": ours.hits, "hits_hash": ours.digits(),
            "replayed_hits": replayed.hits, "replayed_hits_hash": replayed.digits(),
            "differing": differing, "command": command,
        });
        return Ok(format!("{object}\n"));
    }
    let after: Vec<String> = queue.rays_by_bounce.iter().map(u32::to_string).collect();
    let mut lines = vec![
        format!("queue      {} of {} of stage {stage}", queue.number, capture.queues),
        format!("rays       {rays}, after 0, 1 … bounces: {}", after.join(", ")),
        format!("hits       {}, hash {}", ours.hits, ours.digits()),
        format!("file       {}, {:.2} MB", file.display(), (rays * RAY_BYTES) as f64 / 1e6),
        format!("replay     {command}"),
    ];
    if differing > 0 {
        lines.push(format!(
            "note       {differing} rays end elsewhere when replayed ({} hits, hash {}): surfaces are hit also where \
             they are cut out, see-through or hidden, and from both sides",
            replayed.hits,
            replayed.digits()
        ));
    }
    Ok(lines.join("\n") + "\n")
}

/// The message about a queue that does not exist.
fn nothing(capture: &StageCapture, arguments: &ProfileArguments) -> String {
    let scene = arguments.scene.display();
    let CaptureOptions { stage, bounce, .. } = &arguments.capture;
    let stage = name_of(TRACING, stage);
    let known: Vec<String> = capture.all_bounces.iter().map(usize::to_string).collect();
    match bounce {
        Some(bounce) if !known.is_empty() => format!(
            "--bounce {bounce}: in {scene}, stage {stage} traces no ray after so many bounces, but after {}",
            known.join(", ")
        ),
        _ => format!("--stage {stage}: {scene} has no such rays: choose another stage"),
    }
}

/// Returns the command that traces the rays again, through the same tree.
fn replay_command(file: &Path, arguments: &ProfileArguments, setup: &RenderSetup) -> String {
    let ProfileArguments { scene, size, options, simd, capture, .. } = arguments;
    let [scene, rays] = [scene, file].map(not_an_option);
    let mut line = CommandLine::of(["rayfront", "trace", &scene, "--rays", &rays]);
    line.switch("any", capture.stage == Stage::Shadow);
    line.switch("relative", setup.scene.origin != DVec3::ZERO);
    line.push(["--threads", "1", "--repeat", "100"]);
    line.option("simd", simd.map(|isa| isa.name()));
    line.loading(&options.model.of_size(Some(*size)));
    line.option("camera", options.camera.as_ref());
    // Sides of surfaces depend on the transport.
    let transport = options.light.transport.map(|_| format!("settings.transport = {:?}", setup.transport));
    line.option("set", transport);
    line.switch("allow-outside", crate::files::outside_is_allowed());
    line.to_string()
}
