//! Reads and compiles a scene's files, for the first time or after they have changed.

use std::collections::{BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::check;
use crate::cli::failure::Failure;
use crate::compile;
use crate::error::Diagnostic;
use crate::formats::film_file::{RenderedView, Source};
use crate::integrator::RenderSetup;
use crate::world::{Aov, AssetCache, Settings, SourceFiles, World};

/// The data that moments of a scene share, so that it need not be read and built again.
#[derive(Clone, Default)]
pub struct LoadSession {
    /// The decoded files.
    pub kept: AssetCache,
    /// True if there is more than one moment.
    pub several: bool,
    /// True if reused data is compared with data computed without reuse.
    pub paranoid: bool,
    /// The scene at the previous moment.
    pub before: Option<Arc<compile::MemoizedScene>>,
    /// The files that were read last.
    pub sources: SourceFiles,
    /// The exposure of all frames in stops, if the first one chooses it.
    pub exposure_ev: Option<f32>,
    /// The warnings that have been printed, each only once.
    pub told: BTreeSet<String>,
}

impl LoadSession {
    /// Creates a session for a scene of one moment, or of several.
    pub fn new(several: bool) -> LoadSession {
        let kept = if several { AssetCache::keeping() } else { AssetCache::default() };
        LoadSession { kept, several, ..LoadSession::default() }
    }

    /// Creates a session for a scene that is edited while it is rendered.
    pub fn watching(paranoid: bool) -> LoadSession {
        LoadSession { paranoid, ..LoadSession::new(true) }
    }
}

/// The wall-clock time of each phase.
#[derive(Default)]
pub struct Phases {
    /// Reading files.
    pub load: Duration,
    /// Compiling the world into a scene.
    pub compile: Duration,
    /// Rendering.
    pub render: Duration,
    /// The CPU time of all threads while rendering in seconds, if the system provides it.
    pub render_cpu: Option<f64>,
    /// Denoising.
    pub denoise: Duration,
    /// Writing files.
    pub save: Duration,
}

/// A scene at one moment, compiled.
pub struct LoadedScene {
    /// The compiled scene, with the data for compiling it again after a change.
    pub compiled: Arc<compile::MemoizedScene>,
    /// The render setup.
    pub setup: RenderSetup,
    /// The probable mistakes in the scene.
    pub findings: Vec<Diagnostic>,
    /// The settings of the render.
    pub settings: Settings,
    /// The settings in the scene's file, as changed by the view.
    pub authored: Settings,
    /// The files that were read.
    pub source: Source,
    /// The names of entities, if they are needed.
    pub names: HashMap<u32, String>,
    /// The time taken.
    pub phases: Phases,
}

/// Reads and compiles a scene. `change` applies options to the world. `tell`, if given, gets each warning before
/// anything is rendered, and each finding about the scene.
pub fn compiled(
    path: &Path,
    view: &RenderedView,
    before: Option<&compile::MemoizedScene>,
    sources: &SourceFiles,
    mut tell: Option<&mut dyn FnMut(&Diagnostic)>,
    change: impl FnOnce(&mut World),
) -> Result<LoadedScene, Failure> {
    let mut phases = Phases::default();
    let start = Instant::now();
    let mut world = crate::formats::load_again(path, &view.options, sources)?;
    let authored = world.settings.clone();
    change(&mut world);
    phases.load = start.elapsed();
    let start = Instant::now();
    let scene =
        compile::compile_after(&world, view.camera.as_deref(), before).map_err(Failure::compile(path))?;
    phases.compile = start.elapsed();
    let World { settings, assets, .. } = &world;
    let names = if settings.aov.contains(&Aov::Entity) { world.names() } else { HashMap::new() };
    let source = Source::new(path, &assets.files);
    if let Some(tell) = &mut tell {
        scene.scene.warnings.iter().for_each(&mut *tell);
    }
    // The world is dropped at the end of this function: large meshes need not stay twice.
    let compiled = Arc::new(scene);
    let setup = crate::render::setup(compiled.scene.clone(), settings);
    let mut findings = Vec::new();
    if let Some(tell) = tell {
        findings = check::check(&world, &setup, false);
        findings.iter().for_each(tell);
    }
    let settings = settings.clone();
    Ok(LoadedScene { compiled, setup, findings, settings, authored, source, names, phases })
}

/// Checks that a scene compiled with reuse of an earlier one equals the same files compiled without.
pub fn check_against_full_compile(
    path: &Path,
    view: &RenderedView,
    compiled: &compile::MemoizedScene,
    change: impl FnOnce(&mut World),
) -> Result<(), Failure> {
    let mut world = crate::formats::load_with(path, &view.options)?;
    change(&mut world);
    let alone = compile::compile(&world, view.camera.as_deref()).map_err(Failure::compile(path))?;
    match compiled.scene.difference(&alone) {
        Some(part) => Err(Failure::difference(format!(
            "{}: compiled after an edit it is another scene than by itself: {part} differs: this is a bug of rayfront",
            path.display()
        ))),
        None => Ok(()),
    }
}
