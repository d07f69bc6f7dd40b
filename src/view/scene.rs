//! A scene that is displayed while its files are edited.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};

use super::watched::Watched;
use crate::check;
use crate::compile::{self, MemoizedScene};
use crate::error::{CompileError, Diagnostic, LoadError, SaveError, Subject};
use crate::files;
use crate::film::PixelSum;
use crate::formats::{self, LoadOptions};
use crate::integrator::RenderSetup;
use crate::math::DAffine3;
use crate::memory;
use crate::study::explain::{GivenNames, Recipe};
use crate::world::names::is_same_name;
use crate::world::{
    AssetCache, Camera, DepthLimits, FromModel, OrbitCamera, Parent, Pose, Sampler, Settings, Sharing,
    SourceFiles, Transform, Transport, World, transforms,
};

/// The largest image that a page shows: no window has room for more, and memory may not either.
const MOST_PIXELS: u64 = 1 << 26;

/// The changes that the command line makes to a scene.
pub type ChangeWorld = Box<dyn Fn(&mut World) + Send>;

/// A failure to load, compile, save or change a scene.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file is invalid.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The scene is invalid.
    #[error("{file}: {source}", file = .file.display())]
    Compile {
        /// Its file.
        file: PathBuf,
        /// The error.
        source: CompileError,
    },
    /// The scene could not be written.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// A request that cannot be fulfilled.
    #[error("{0}")]
    Refused(String),
}

/// A scene as its files describe it now, with the changes made by hand.
pub struct LiveScene {
    pub(super) path: PathBuf,
    pub(super) options: LoadOptions,
    /// The number of statements in `options` that the command line gives; the page adds others.
    pub(super) given: usize,
    change: ChangeWorld,
    kept: AssetCache,
    files: Arc<Mutex<Watched>>,
    pub(super) world: World,
    /// The settings as read from its files, without any later changes.
    said: Settings,
    pub(super) compiled: MemoizedScene,
    /// Probable mistakes in the scene.
    findings: Vec<Diagnostic>,
    /// The names of entities and lights.
    names: Arc<GivenNames>,
    entities: Arc<HashMap<u32, String>>,
    /// The name of the current camera; none for the first.
    pub(super) camera: Option<String>,
    /// The camera as its files describe it.
    pub(super) authored: Authored,
    /// The settings that were changed.
    changed: ChangedSettings,
    /// The camera as moved by hand; none if it was not moved.
    pub(super) rig: Option<OrbitCamera>,
}

/// Settings that the user has overridden; they take precedence over the files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChangedSettings {
    /// The light transport algorithm.
    pub transport: Option<Transport>,
    /// The sampler.
    pub sampler: Option<Sampler>,
    /// The largest number of bounces, of all kinds alike.
    pub max_depth: Option<u32>,
    /// Samples per pixel.
    pub samples: Option<u32>,
    /// True if paths are reused.
    pub shares: Option<bool>,
}

impl ChangedSettings {
    fn apply(&self, world: &mut World) {
        if let Some(transport) = self.transport {
            // Also sets the depth, like a command that names the transport.
            world.settings.max_depth = world.depth_under(transport);
            world.settings.transport = transport;
        }
        let settings = &mut world.settings;
        settings.sampler = self.sampler.unwrap_or(settings.sampler);
        if let Some(depth) = self.max_depth {
            (settings.max_depth, settings.depth_limits) = (depth, DepthLimits::default());
        }
        settings.samples = self.samples.unwrap_or(settings.samples);
        if let Some(shares) = self.shares {
            settings.sharing = if shares { Sharing::Auto } else { Sharing::Off };
        }
    }

    /// Merges both; the values of `self` take precedence.
    fn after(self, earlier: ChangedSettings) -> ChangedSettings {
        ChangedSettings {
            transport: self.transport.or(earlier.transport),
            sampler: self.sampler.or(earlier.sampler),
            max_depth: self.max_depth.or(earlier.max_depth),
            samples: self.samples.or(earlier.samples),
            shares: self.shares.or(earlier.shares),
        }
    }
}

/// A camera as its files describe it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Authored {
    pub(super) transform: Option<Transform>,
    pub(super) camera: Option<Camera>,
    /// True if it has a parent, or came with another file.
    pub(super) depends: bool,
    /// True if a parent places it.
    pub(super) is_carried: bool,
}

impl LiveScene {
    /// Reads and compiles a scene.
    pub fn load(
        path: &Path,
        options: LoadOptions,
        camera: Option<String>,
        change: ChangeWorld,
    ) -> Result<LiveScene, SceneError> {
        let kept = AssetCache::keeping();
        let sources = SourceFiles::with(kept.clone());
        let (world, said) = read(path, &options, &sources, &change)?;
        let compiled = compiled(path, &world, camera.as_deref(), None)?;
        let authored = authored(&world, camera.as_deref());
        let mut live = LiveScene {
            findings: Vec::new(),
            changed: ChangedSettings::default(),
            path: path.to_owned(),
            authored,
            given: options.edits.set.len(),
            options,
            change,
            kept,
            files: Arc::new(Mutex::new(Watched::new(&sources))),
            names: Arc::new(GivenNames::new(&world)),
            entities: Arc::new(world.names()),
            world,
            said,
            compiled,
            camera,
            rig: None,
        };
        live.look_for_faults();
        Ok(live)
    }

    /// The files that the scene was read from.
    pub fn sources(&self) -> &SourceFiles {
        &self.world.assets.files
    }

    /// The files of the scene, for another thread to check.
    pub fn files(&self) -> Arc<Mutex<Watched>> {
        self.files.clone()
    }

    /// Reads the scene again. If its files are invalid, the scene stays as it was. A camera moved by hand stays where
    /// it is, unless the files now describe another camera.
    pub fn reload(&mut self) -> Result<(), SceneError> {
        let sources = SourceFiles::with(self.kept.clone());
        let read = read(&self.path, &self.options, &sources, &self.change).and_then(|(mut world, said)| {
            self.changed.apply(&mut world);
            let compiled = compiled(&self.path, &world, self.camera.as_deref(), Some(&self.compiled))?;
            Ok((world, said, compiled))
        });
        let watched = Watched::new(&sources);
        let (world, said, compiled) = match read {
            Ok(read) => read,
            Err(error) => {
                // Watch the files read before as well as those not found now: a change to either may fix the error.
                let mut files = self.lock_files();
                let before = std::mem::replace(&mut *files, watched);
                files.extend(before);
                return Err(error);
            }
        };
        *self.lock_files() = watched;
        (self.world, self.said, self.compiled) = (world, said, compiled);
        self.names = Arc::new(GivenNames::new(&self.world));
        self.entities = Arc::new(self.world.names());
        let authored = authored(&self.world, self.camera.as_deref());
        let stays = authored == self.authored;
        self.authored = authored;
        if let Some(rig) = self.rig.take().filter(|_| stays) {
            self.place(rig)?;
        }
        self.kept.forget_unused();
        self.look_for_faults();
        Ok(())
    }

    /// Changes settings permanently: they take precedence over later versions of the files.
    pub fn change_settings(&mut self, change: ChangedSettings) -> Result<(), SceneError> {
        change.apply(&mut self.world);
        self.changed = change.after(self.changed);
        self.compile()?;
        self.look_for_faults();
        Ok(())
    }

    /// The current settings.
    pub fn settings(&self) -> &Settings {
        &self.world.settings
    }

    /// The path of the scene's file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The render setup.
    pub fn setup(&self) -> Arc<RenderSetup> {
        Arc::new(crate::render::setup(self.compiled.scene.clone(), &self.world.settings))
    }

    /// Warnings of the compilation, and probable mistakes.
    pub fn findings(&self) -> impl Iterator<Item = &Diagnostic> {
        check::not_found(&self.compiled.scene.warnings, &self.findings).chain(&self.findings)
    }

    /// Nothing panics while it holds the lock.
    pub(super) fn lock_files(&self) -> MutexGuard<'_, Watched> {
        self.files.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn look_for_faults(&mut self) {
        self.findings = check::check(&self.world, &self.setup(), false);
    }

    /// The time at which the scene is read, and that of the last change, in seconds; none if nothing moves.
    pub fn time(&self) -> Option<(f32, Option<f32>)> {
        self.world.is_animated.then(|| (self.options.time_s.unwrap_or(0.0), self.world.animation_end_s))
    }

    /// The names of entities and lights.
    pub fn names(&self) -> (Arc<GivenNames>, Arc<HashMap<u32, String>>) {
        (self.names.clone(), self.entities.clone())
    }

    /// The names of the scene's cameras.
    pub fn cameras(&self) -> Vec<String> {
        compile::camera_names(&self.world)
    }

    /// The name of the current camera.
    pub fn camera_name(&self) -> Option<String> {
        camera_entity(&self.world, self.camera.as_deref()).map(|entity| self.world.name_of(entity))
    }

    /// Switches to another camera of the scene.
    pub fn look_through(&mut self, camera: &str) -> Result<(), SceneError> {
        self.look_again(Some(camera.to_owned()))
    }

    /// True if the camera was moved by hand.
    pub fn is_moved(&self) -> bool {
        self.rig.is_some()
    }

    /// Moves the camera back to where its file puts it.
    pub fn reset(&mut self) -> Result<(), SceneError> {
        self.look_again(self.camera.clone())
    }

    /// Reads the scene again and switches to a camera as its file describes it. On failure, nothing changes.
    fn look_again(&mut self, camera: Option<String>) -> Result<(), SceneError> {
        let sources = SourceFiles::with(self.kept.clone());
        let (mut world, said) = read(&self.path, &self.options, &sources, &self.change)?;
        world.settings = self.world.settings.clone();
        self.compiled = compiled(&self.path, &world, camera.as_deref(), Some(&self.compiled))?;
        self.authored = authored(&world, camera.as_deref());
        (self.world, self.said, self.camera, self.rig) = (world, said, camera, None);
        Ok(())
    }

    /// True if the camera can be written into the scene's file.
    pub fn can_save(&self) -> bool {
        self.path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron"))
            && self.camera_in_file().is_some()
    }

    /// Writes the camera into the scene's file; the rest of its text stays as it is.
    pub fn save_camera(&mut self) -> Result<String, SceneError> {
        let refused = |reason: &str| SceneError::Refused(reason.into());
        let written = self.camera_in_file().filter(|_| self.can_save());
        let (path, position) = written.ok_or_else(|| {
            refused(match self.authored.depends {
                true => "the camera hangs on something, or comes with a model, so what the file says of it is not where it is: copy its line instead",
                false => "the camera is not in a .ron file: copy its line instead",
            })
        })?;
        let [camera, transform] = self.camera_texts(&self.rig(), &path)?;
        let bytes = files::read(&path).map_err(LoadError::io(&path))?;
        if !self.lock_files().is_as_read(&path, &bytes) {
            return Err(refused(
                "the file has changed meanwhile, and what it says now is not shown: mend it first",
            ));
        }
        let text = String::from_utf8(bytes).map_err(|_| LoadError::invalid(&path, "this is not UTF-8"))?;
        let mut keys = vec![("camera", camera), ("transform", transform)];
        // The file need not know of the focus that the command line chooses.
        let focus = self.options.edits.focus.as_ref().and_then(|_| self.focus_name());
        keys.extend(focus.map(|name| ("focus_on", format!("{name:?}"))));
        let edited = formats::ron::with_keys(&text, &path, position, &keys)?;
        // Writes to the target of a symbolic link instead of replacing the link.
        files::replace(&path.canonicalize().unwrap_or(path.clone()), edited.as_bytes())?;
        self.rig = None;
        // The file now contains what the command line set before.
        self.options.edits.forget_camera();
        self.forget_camera_statements();
        self.reload()?;
        Ok(format!("saved in {}", path.display()))
    }

    /// The recipe that reproduces the current image.
    pub fn recipe(&self) -> Recipe {
        let mut options = self.options.clone();
        let put = self.rig.is_some().then(|| self.camera_statements(&self.rig()));
        let is_moved = matches!(put, Some(None));
        if let Some(statements) = put.flatten() {
            self.forget_camera_options(&mut options.edits);
            options.edits.set.extend(statements);
        }
        let settings = self.world.settings.clone();
        let (path, camera) = (self.path.clone(), self.camera.clone());
        Recipe { path, options, camera, authored: self.said.clone(), settings, is_moved }
    }

    /// Statements that set the camera as it was moved by hand; none if its parent would move it as well.
    pub(super) fn camera_statements(&self, rig: &OrbitCamera) -> Option<[String; 2]> {
        let [camera, transform] = self.camera_texts(rig, &self.path).ok()?;
        let name = self.camera_name().filter(|_| !self.authored.is_carried)?;
        let of_camera = |field: &str, text: &str| format!("Camera[name={name:?}].{field} = {text}");
        Some([of_camera("camera", &camera), of_camera("transform", &transform)])
    }

    pub(super) fn camera_texts(&self, rig: &OrbitCamera, file: &Path) -> Result<[String; 2], SceneError> {
        let Pose { from, to, up } = rig.pose();
        let camera = formats::ron::camera(&self.world, &rig.camera, file)?;
        let transform = formats::ron::look_at(from, to, up).map_err(SceneError::Refused)?;
        Ok([camera, transform])
    }

    pub(super) fn compile(&mut self) -> Result<(), SceneError> {
        let before = Some(&self.compiled);
        self.compiled = compiled(&self.path, &self.world, self.camera.as_deref(), before)?;
        Ok(())
    }

    /// The file that the camera is written in, with line and column: the scene's own, or one that it includes. None if
    /// no scene file contains the camera, or if it has a parent.
    fn camera_in_file(&self) -> Option<(PathBuf, [u32; 2])> {
        let entity = camera_entity(&self.world, self.camera.as_deref()).filter(|_| !self.authored.depends)?;
        let Subject { file, position, .. } = self.world.subject(entity);
        file.filter(|file| !file.as_os_str().is_empty()).zip(position)
    }
}

/// The entity of the current camera.
pub(super) fn camera_entity(world: &World, camera: Option<&str>) -> Option<hecs::Entity> {
    let order = world.in_order();
    let mut cameras = order.into_iter().filter(|e| world.entities.get::<&Camera>(*e).is_ok());
    match camera {
        None => cameras.next(),
        Some(name) => cameras.find(|entity| is_same_name(&world.name_of(*entity), name)),
    }
}

fn authored(world: &World, camera: Option<&str>) -> Authored {
    let entity = camera_entity(world, camera);
    let transform = entity.and_then(|entity| world.entities.get::<&Transform>(entity).ok().map(|it| *it));
    let found = entity.and_then(|entity| world.entities.get::<&Camera>(entity).ok().map(|it| *it));
    let depends = entity.is_some_and(|entity| {
        world.entities.get::<&FromModel>(entity).is_ok() || world.entities.get::<&Parent>(entity).is_ok()
    });
    let parent = entity.and_then(|entity| world.entities.get::<&Parent>(entity).ok().map(|parent| parent.0));
    let carries = |parent| {
        let placed = transforms::to_world(world, &world.in_order()).ok();
        placed.and_then(|placed| placed.get(&parent).copied()) != Some(DAffine3::IDENTITY)
    };
    Authored { transform, camera: found, depends, is_carried: parent.is_some_and(carries) }
}

/// Reads a scene; also returns the settings as its files give them.
fn read(
    path: &Path,
    options: &LoadOptions,
    sources: &SourceFiles,
    change: &ChangeWorld,
) -> Result<(World, Settings), SceneError> {
    let mut world = formats::load_again(path, options, sources)?;
    let said = world.settings.clone();
    change(&mut world);
    let [width, height] = world.settings.size;
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        let most = "a page shows at most 67 million pixels";
        return Err(SceneError::Refused(format!("{width}x{height}: {most}: use a smaller --size")));
    }
    Ok((world, said))
}

fn compiled(
    path: &Path,
    world: &World,
    camera: Option<&str>,
    before: Option<&MemoizedScene>,
) -> Result<MemoizedScene, SceneError> {
    let [width, height] = world.settings.size;
    // Three copies: the image being rendered, the one displayed, and one in transit between them.
    let pixels = 3 * u64::from(width) * u64::from(height) * size_of::<PixelSum>() as u64;
    let claim = memory::reserve(format_args!("a page with an image of {width}x{height}"), pixels);
    let wrong = |source| SceneError::Compile { file: path.to_owned(), source };
    claim.map_err(|shortage| wrong(shortage.or("use a smaller --size").into()))?;
    compile::compile_after(world, camera, before).map_err(wrong)
}
