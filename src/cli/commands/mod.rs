//! The commands, each with its arguments.

pub mod ab;
pub mod check;
pub mod compare;
pub mod diff;
pub mod explain;
pub mod furnace;
pub mod info;
pub mod ls;
pub mod manual;
pub mod merge;
pub mod mix;
pub mod plan;
pub mod profile;
pub mod render;
pub mod reproduce;
pub mod resume;
pub mod study;
pub mod trace;
pub mod verify;
pub mod view;

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::args::{ImageSize, OutputOptions, RunOptions, StudyOptions};
use super::failure::Failure;
use super::job::{LiveViews, Outputs, RunRequest, StopLimits};
use crate::error::{SaveError, in_one_line};
use crate::files::are_same;
use crate::film::Region;
use crate::film::tonemap::DisplayTransform;
use crate::formats::LoadOptions;
use crate::formats::picture::{Output, save};
use crate::integrator::RenderSetup;
use crate::math::Rgb;
use crate::render::MemoryEstimate;
use crate::world::{SourceFiles, World};

/// Reads and compiles a scene; `change` applies options to the world.
fn load(
    scene: &Path,
    options: &LoadOptions,
    camera: Option<&str>,
    change: impl FnOnce(&mut World),
) -> Result<(World, RenderSetup), Failure> {
    let mut world = crate::formats::load_with(scene, options)?;
    change(&mut world);
    let compiled = crate::compile::compile(&world, camera).map_err(Failure::compile(scene))?;
    let setup = crate::render::setup(compiled, &world.settings);
    Ok((world, setup))
}

/// Loads a scene with the given size and number of samples, ready to be rendered in several ways.
fn setup(
    scene: &Path,
    options: &StudyOptions,
    size: ImageSize,
    samples: u32,
) -> Result<(World, Arc<RenderSetup>), Failure> {
    let StudyOptions { camera, light, model, .. } = options;
    let (world, setup) = load(scene, &model.of_size(Some(size)), camera.as_deref(), |world| {
        world.settings.samples = samples;
        light.apply(world);
    })?;
    MemoryEstimate::usual(Region::whole(size)).check(&setup, &world.settings)?;
    Ok((world, Arc::new(setup)))
}

/// Checks that a file to be written is none that the scene was read from.
fn check_is_not_read(output: &Path, files: &SourceFiles, option: &str) -> Result<(), Failure> {
    match files.all().keys().any(|read| are_same(read, output)) {
        true => {
            let output = in_one_line(&output.to_string_lossy());
            Err(Failure::command_line(format!("{output} is read for this scene: name another {option}")))
        }
        false => Ok(()),
    }
}

/// Saves an image without metadata.
fn save_plain(
    path: &Path,
    size: [u32; 2],
    radiance: &[Rgb],
    display: DisplayTransform,
) -> Result<(), SaveError> {
    save(path, &Output::plain(size, radiance, display))
}

/// Creates the live views of a scene.
fn views(options: &RunOptions, scene: &Path) -> Result<LiveViews, Failure> {
    let look = &options.look;
    LiveViews::new(scene, look.tev.as_deref(), look.preview, look.progress)
}

/// Returns the request to run a job with these options.
fn request<'a>(
    options: &RunOptions,
    output: &OutputOptions,
    outputs: Outputs,
    views: &'a LiveViews,
) -> RunRequest<'a> {
    let RunOptions { stop, work, .. } = options;
    RunRequest {
        outputs,
        denoises: output.denoise,
        bits: output.bits,
        stop: StopLimits { until: stop.until, max_time: stop.max_time },
        checkpoint: stop.checkpoint.unwrap_or(Some(Duration::from_secs(60))),
        work: work.options(),
        quiet: work.quiet,
        json: work.json,
        views,
        watched: None,
    }
}
