//! Reads and compiles a scene's files, for the first time or after they have changed.

use std::collections::{BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use super::Failure;
use super::report::Phases;
use crate::check::{self, Finding};
use crate::compile;
use crate::formats::film_file::{RenderedView, Source};
use crate::integrator::RenderSetup;
use crate::world::{Aov, AssetCache, Settings, SourceFiles, World};

/// What moments of a scene have in common, and need not read and build again.
#[derive(Clone, Default)]
pub struct LoadSession {
    /// What its files were decoded to.
    pub kept: AssetCache,
    /// There is more than one moment.
    pub several: bool,
    /// Whether to compare shared things with what would be made without sharing.
    pub paranoid: bool,
    /// The moment before.
    pub before: Option<Arc<compile::MemoizedScene>>,
    /// The files that were read last.
    pub sources: SourceFiles,
    /// The exposure of all frames in stops, if the first one chooses it.
    pub exposure_ev: Option<f32>,
    /// Warnings that have been told: once is enough.
    pub told: BTreeSet<String>,
}

impl LoadSession {
    /// For a scene of one moment, or of several.
    pub fn new(several: bool) -> LoadSession {
        let kept = if several { AssetCache::keeping() } else { AssetCache::default() };
        LoadSession { kept, several, ..LoadSession::default() }
    }

    /// For a scene that is written while it is rendered.
    pub fn watching(paranoid: bool) -> LoadSession {
        LoadSession { paranoid, ..LoadSession::new(true) }
    }
}

/// A scene's file at one moment, compiled.
pub struct LoadedScene {
    /// The scene, and what it was made of.
    pub compiled: Arc<compile::MemoizedScene>,
    /// As it is rendered.
    pub setup: RenderSetup,
    /// What is probably not as it was meant.
    pub findings: Vec<Finding>,
    /// How to render.
    pub settings: Settings,
    /// The settings as the scene's file says them, and as the view changes them.
    pub authored: Settings,
    /// What was read.
    pub source: Source,
    /// Names of entities, if they are needed.
    pub names: HashMap<u32, String>,
    /// How long it took.
    pub phases: Phases,
}

/// Reads and compiles a scene. `change` makes the changes that were asked for elsewhere. If `tell` is there, it is told
/// each warning before anything is rendered, and also what is probably not as intended.
pub fn compiled(
    path: &Path,
    view: &RenderedView,
    reuse: &LoadSession,
    sources: &SourceFiles,
    mut tell: Option<&mut dyn FnMut(&str)>,
    change: impl FnOnce(&mut World),
) -> Result<LoadedScene, Failure> {
    let mut phases = Phases::default();
    let start = Instant::now();
    let mut world = crate::formats::load_again(path, &view.load_options(), sources)?;
    let authored = world.settings.clone();
    change(&mut world);
    phases.load = start.elapsed();
    let start = Instant::now();
    let scene = compile::compile_after(&world, view.camera.as_deref(), reuse.before.as_deref())
        .map_err(Failure::compile(path))?;
    phases.compile = start.elapsed();
    let World { settings, assets, .. } = &world;
    let names = if settings.aov.contains(&Aov::Entity) { world.names() } else { HashMap::new() };
    let source = Source::new(path, &assets.files);
    if let Some(tell) = &mut tell {
        scene.scene.warnings.iter().for_each(|warning| tell(warning));
    }
    // The world ends here: large meshes need not stay twice.
    let compiled = Arc::new(scene);
    let setup = crate::render::setup(compiled.scene.clone(), settings);
    let mut findings = Vec::new();
    if let Some(tell) = tell {
        findings = check::check(&world, &setup, false);
        findings.iter().for_each(|finding| tell(&finding.to_string()));
    }
    let settings = settings.clone();
    Ok(LoadedScene { compiled, setup, findings, settings, authored, source, names, phases })
}

/// Compares a scene that shares something with one before it with what its files say without that.
pub fn check_against_full_compile(
    path: &Path,
    view: &RenderedView,
    compiled: &compile::MemoizedScene,
    change: impl FnOnce(&mut World),
) -> Result<(), Failure> {
    let mut world = crate::formats::load_with(path, &view.load_options())?;
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
