//! A scene that is looked at while it is written.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};

use super::watched::Watched;
use crate::check::{self, Finding};
use crate::compile::{self, MemoizedScene};
use crate::error::{CompileError, LoadError, SaveError};
use crate::files;
use crate::film::PixelSum;
use crate::formats::{self, LoadOptions};
use crate::integrator::RenderSetup;
use crate::integrator::reuse::ReuseGroups;
use crate::math::Vec3;
use crate::memory;
use crate::render::{Options, Session};
use crate::study::explain::{GivenNames, Recipe};
use crate::world::{
    AssetCache, Camera, DepthLimits, FromModel, LookAtFault, OrbitCamera, Parent, Pose, Sampler, Settings,
    Sharing, SourceFiles, Transform, Transport, World,
};

/// No window has room for a page that shows more, and memory may not either.
const MOST_PIXELS: u64 = 1 << 26;

/// What the command line says about a scene.
pub type ChangeWorld = Box<dyn Fn(&mut World) + Send>;

/// Why a scene is not what its files say.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file does not make sense.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The scene does not make sense.
    #[error("{file}: {source}", file = .file.display())]
    Compile {
        /// Its file.
        file: PathBuf,
        /// What is wrong.
        source: CompileError,
    },
    /// It could not be written.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// A wish that cannot be fulfilled.
    #[error("{0}")]
    Refused(String),
}

/// A scene as its files say now, with what was changed by hand.
pub struct LiveScene {
    path: PathBuf,
    options: LoadOptions,
    change: ChangeWorld,
    kept: AssetCache,
    files: Arc<Mutex<Watched>>,
    world: World,
    /// The settings as its files say them, whatever was changed since.
    said: Settings,
    compiled: MemoizedScene,
    /// What is probably not as it was meant.
    findings: Vec<Finding>,
    /// Where names of entities and lights are looked up.
    names: Arc<GivenNames>,
    entities: Arc<HashMap<u32, String>>,
    /// The camera that is looked through; none for the first.
    camera: Option<String>,
    /// What the files say of it.
    authored: Authored,
    /// Which of its settings were changed.
    changed: ChangedSettings,
    /// Where a hand has put it.
    rig: Option<OrbitCamera>,
}

/// Settings that someone has overridden, whatever the files say later.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChangedSettings {
    /// How light travels.
    pub transport: Option<Transport>,
    /// Which numbers paths draw.
    pub sampler: Option<Sampler>,
    /// Bounces, of all kinds alike.
    pub max_depth: Option<u32>,
    /// Samples a pixel.
    pub samples: Option<u32>,
    /// Whether paths are shared.
    pub shares: Option<bool>,
}

impl ChangedSettings {
    fn apply(&self, world: &mut World) {
        if let Some(transport) = self.transport {
            // As a command that names the transport does.
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

    /// Both, this one last.
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

/// What files say of a camera.
#[derive(Clone, Debug, PartialEq)]
struct Authored {
    transform: Option<Transform>,
    camera: Option<Camera>,
    /// Whether it has a parent, or came with another file.
    depends: bool,
}

impl LiveScene {
    /// Reads and compiles.
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

    /// Its files, for another thread to check.
    pub fn files(&self) -> Arc<Mutex<Watched>> {
        self.files.clone()
    }

    /// Reads the scene again. If its files make no sense, what they said before stays. The camera stays where it was
    /// moved by hand, unless the files now put it somewhere else.
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
                // Whatever mends it: what was read before, or what has not been found now.
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

    /// Changes settings, from now on: whatever its files say later.
    pub fn change_settings(&mut self, change: ChangedSettings) -> Result<(), SceneError> {
        change.apply(&mut self.world);
        self.changed = change.after(self.changed);
        self.compile()?;
        self.look_for_faults();
        Ok(())
    }

    /// Settings as they are now.
    pub fn settings(&self) -> &Settings {
        &self.world.settings
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// As it is rendered.
    pub fn setup(&self) -> Arc<RenderSetup> {
        Arc::new(crate::render::setup(self.compiled.scene.clone(), &self.world.settings))
    }

    /// What the compilation noticed, and what is probably not as it was meant.
    pub fn findings(&self) -> Vec<Finding> {
        let note = |what: &String| Finding { about: None, what: what.clone(), remedy: None };
        let warnings = check::not_found(&self.compiled.scene.warnings, &self.findings);
        warnings.map(note).chain(self.findings.iter().cloned()).collect()
    }

    /// Nothing panics while it holds the lock.
    fn lock_files(&self) -> MutexGuard<'_, Watched> {
        self.files.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn look_for_faults(&mut self) {
        self.findings = check::check(&self.world, &self.setup(), false);
    }

    /// The names that people use.
    pub fn names(&self) -> (Arc<GivenNames>, Arc<HashMap<u32, String>>) {
        (self.names.clone(), self.entities.clone())
    }

    /// Names of its cameras.
    pub fn cameras(&self) -> Vec<String> {
        compile::camera_names(&self.world)
    }

    /// The name of the current camera.
    pub fn camera_name(&self) -> Option<String> {
        camera_entity(&self.world, self.camera.as_deref()).map(|entity| self.world.name_of(entity))
    }

    /// Looks through another of its cameras.
    pub fn look_through(&mut self, camera: &str) -> Result<(), SceneError> {
        self.look_again(Some(camera.to_owned()))
    }

    /// Whether the camera was moved by hand.
    pub fn is_moved(&self) -> bool {
        self.rig.is_some()
    }

    /// The camera as a hand moves it. At first it turns about what is seen in the middle of the image.
    pub fn rig(&self) -> OrbitCamera {
        if let Some(rig) = &self.rig {
            return rig.clone();
        }
        let scene = &self.compiled.scene;
        let bounds = scene.bounds;
        let to_middle = (bounds.center() - scene.camera.origin).dot(scene.camera.forward);
        let [width, height] = self.world.settings.size;
        let ahead = self.depth([width / 2, height / 2]).map(|(depth, _)| depth);
        let size = bounds.size().length().max(1e-3);
        let usual = if to_middle > 0.01 * size { to_middle } else { size };
        let axes = [scene.camera.right, scene.camera.up, scene.camera.forward].map(|axis| axis.as_dvec3());
        let camera = self.authored.camera.unwrap_or(Camera::Pinhole { vertical_fov: 1.0 });
        OrbitCamera::new(scene.camera.origin.as_dvec3(), axes, camera, f64::from(ahead.unwrap_or(usual)))
    }

    /// How far away along the camera's axis the first thing in a pixel is, and where; none if there is nothing.
    pub fn depth(&self, [x, y]: [u32; 2]) -> Option<(f32, Vec3)> {
        let region = crate::film::Region { x0: x, y0: y, x1: x + 1, y1: y + 1 };
        let options = Options { region: Some(region), ..Options::default() };
        let features = Session::of(self.setup(), 1, options).features();
        let first = features.first().filter(|features| features.coverage > 0.0)?;
        Some((first.depth_m, Vec3::from_array(first.position)))
    }

    /// Puts the camera where it was moved by hand.
    pub fn place(&mut self, rig: OrbitCamera) -> Result<(), SceneError> {
        let no_camera = || SceneError::Refused("the scene has no camera".into());
        let entity = camera_entity(&self.world, self.camera.as_deref()).ok_or_else(no_camera)?;
        let transform = rig.transform().map_err(|fault| {
            SceneError::Refused(match fault {
                LookAtFault::SamePoint => "the camera is as near as it can be".into(),
                LookAtFault::NoUp | LookAtFault::Parallel => {
                    "the camera would look straight up or down: turn it a little".into()
                }
            })
        })?;
        // In world space: its parent no longer moves it.
        let before = self.rig();
        let old = (before.transform().unwrap_or_default(), before.camera);
        let _ = self.world.entities.remove_one::<Parent>(entity);
        let _ = self.world.entities.insert(entity, (transform, rig.camera));
        let moved = self.compile();
        match moved {
            Ok(()) => self.rig = Some(rig),
            // As far as a hand may go, and no further.
            Err(_) => drop(self.world.entities.insert(entity, old)),
        }
        moved
    }

    /// Puts the camera where its file says.
    pub fn reset(&mut self) -> Result<(), SceneError> {
        self.look_again(self.camera.clone())
    }

    /// Reads the scene again and looks through a camera as its file says. If that is impossible, nothing changes.
    fn look_again(&mut self, camera: Option<String>) -> Result<(), SceneError> {
        let sources = SourceFiles::with(self.kept.clone());
        let (mut world, said) = read(&self.path, &self.options, &sources, &self.change)?;
        world.settings = self.world.settings.clone();
        self.compiled = compiled(&self.path, &world, camera.as_deref(), Some(&self.compiled))?;
        self.authored = authored(&world, camera.as_deref());
        (self.world, self.said, self.camera, self.rig) = (world, said, camera, None);
        Ok(())
    }

    /// Whether the camera can be written into the scene's file.
    pub fn can_save(&self) -> bool {
        self.path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron"))
            && self.camera_in_file().is_some()
    }

    /// Writes the camera into the scene's file, whose other text stays as it is.
    pub fn save_camera(&mut self) -> Result<String, SceneError> {
        let (path, refused) = (self.path.clone(), |reason: &str| SceneError::Refused(reason.into()));
        let number = self.camera_in_file().filter(|_| self.can_save());
        let number = number.ok_or_else(|| {
            refused(match self.authored.depends {
                true => "the camera hangs on something, or comes with a model, so what the file says of it is not where it is: copy its line instead",
                false => "the camera is not in a .ron file: copy its line instead",
            })
        })?;
        let [camera, transform] = self.camera_texts(&self.rig())?;
        let bytes = files::read(&path).map_err(LoadError::io(&path))?;
        if !self.lock_files().is_as_read(&path, &bytes) {
            return Err(refused(
                "the file has changed meanwhile, and what it says now is not shown: mend it first",
            ));
        }
        let text = String::from_utf8(bytes).map_err(|_| LoadError::invalid(&path, "this is not UTF-8"))?;
        let keys = [("camera", camera), ("transform", transform)];
        let edited = formats::ron::with_keys(&text, &path, number, &keys)?;
        // Writes to the target of a link, not over the link.
        files::replace(&path.canonicalize().unwrap_or(path.clone()), edited.as_bytes())?;
        self.rig = None;
        // The file says now what the command line said before.
        self.options.edits.forget_camera();
        self.reload()?;
        Ok(format!("saved in {}", path.display()))
    }

    /// The camera's entity as a line of a scene file.
    pub fn camera_line(&self, rig: &OrbitCamera) -> Result<String, SceneError> {
        let [camera, transform] = self.camera_texts(rig)?;
        let name = self.camera_name().unwrap_or_default();
        Ok(format!("(name: {name:?}, camera: {camera}, transform: {transform})"))
    }

    /// The recipe of a frame of it.
    pub fn recipe(&self, setup: &RenderSetup) -> Recipe {
        let mut options = self.options.clone();
        let put = self.rig.as_ref().map(|rig| self.camera_statements(rig));
        let is_moved = matches!(put, Some(None));
        if let Some(statements) = put.flatten() {
            options.edits.forget_camera();
            options.edits.set.extend(statements);
        }
        let mut settings = self.world.settings.clone();
        if setup.sharing.is_none() && ReuseGroups::of(&setup.scene.materials, &settings).is_some() {
            // The first picture comes before the groups are chosen.
            settings.sharing = Sharing::Off;
        }
        let (path, camera) = (self.path.clone(), self.camera.clone());
        Recipe { path, options, camera, authored: self.said.clone(), settings, is_moved }
    }

    /// Statements that put the camera where a hand has put it; none if what it hangs on would move it, too.
    fn camera_statements(&self, rig: &OrbitCamera) -> Option<[String; 2]> {
        let [camera, transform] = self.camera_texts(rig).ok()?;
        let name = self.camera_name().filter(|_| !self.authored.depends)?;
        let of_camera = |field: &str, text: &str| format!("Camera[name={name:?}].{field} = {text}");
        Some([of_camera("camera", &camera), of_camera("transform", &transform)])
    }

    fn camera_texts(&self, rig: &OrbitCamera) -> Result<[String; 2], SceneError> {
        let Pose { from, to, up } = rig.pose();
        let camera = formats::ron::camera(&self.world, &rig.camera, &self.path)?;
        let transform = formats::ron::look_at(from, to, up).map_err(SceneError::Refused)?;
        Ok([camera, transform])
    }

    fn compile(&mut self) -> Result<(), SceneError> {
        let before = Some(&self.compiled);
        self.compiled = compiled(&self.path, &self.world, self.camera.as_deref(), before)?;
        Ok(())
    }

    /// Which of the file's entities the camera is: the entities of a scene file come first, in its order. None if
    /// another file brought it, or if it has a parent.
    fn camera_in_file(&self) -> Option<usize> {
        let entity = camera_entity(&self.world, self.camera.as_deref())?;
        (!self.authored.depends).then_some(entity.id() as usize)
    }
}

/// The entity of the camera that is looked through.
fn camera_entity(world: &World, camera: Option<&str>) -> Option<hecs::Entity> {
    let order = world.in_order();
    let mut cameras = order.into_iter().filter(|e| world.entities.get::<&Camera>(*e).is_ok());
    match camera {
        None => cameras.next(),
        Some(name) => cameras.find(|entity| world.name_of(*entity) == name),
    }
}

fn authored(world: &World, camera: Option<&str>) -> Authored {
    let entity = camera_entity(world, camera);
    let transform = entity.and_then(|entity| world.entities.get::<&Transform>(entity).ok().map(|it| *it));
    let found = entity.and_then(|entity| world.entities.get::<&Camera>(entity).ok().map(|it| *it));
    let depends = entity.is_some_and(|entity| {
        world.entities.get::<&FromModel>(entity).is_ok() || world.entities.get::<&Parent>(entity).is_ok()
    });
    Authored { transform, camera: found, depends }
}

/// Reads a scene; returns the settings as its files say them, too.
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
    // What is rendered, what is shown, and what is on its way from one to the other.
    let pixels = 3 * u64::from(width) * u64::from(height) * size_of::<PixelSum>() as u64;
    let claim = memory::reserve(format_args!("a page with an image of {width}x{height}"), pixels);
    let wrong = |source| SceneError::Compile { file: path.to_owned(), source };
    claim.map_err(|shortage| wrong(shortage.or("use a smaller --size").into()))?;
    compile::compile_after(world, camera, before).map_err(wrong)
}
