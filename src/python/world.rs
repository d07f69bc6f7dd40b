//! Worlds from files or from Python.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::rendering::{LayerNames, PyRendering};
use super::{as_arguments, of_file, of_scene, wrong};
use crate::check;
use crate::compile::{camera_names, check_mesh, check_settings, compile};
use crate::error::{Diagnostic, LoadError, Remedy, Severity, Subject};
use crate::film::{FilmChannel, Region};
use crate::formats::ron::query::{Query, list};
use crate::formats::staging::load;
use crate::formats::{
    AssetFiles, Edits, EnvironmentPreset, Files, Floor, LightUnits, LoadOptions, UpAxis, gltf,
    has_added_camera, load_again, ron,
};
use crate::integrator::{RenderSetup, Stop};
use crate::math::{Rgb, Vec2, Vec3};
use crate::render::{
    MemoryEstimate, Options, Schedule, Session, ThreadError, light_channels, names_of_ids, on_threads,
};
use crate::world::{Aov, AssetCache, Assets, DecodedImage, Mesh, Settings, SourceFiles, Tonemap, Transport};

/// The interval at which a rendering reports its progress and checks for interrupts.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

#[pyclass(name = "World", module = "rayfront._native", frozen)]
pub struct PyWorld {
    world: crate::world::World,
    source: PySource,
}

/// The source of a world. It is read again for an image of another shape if a camera was added for the former shape.
enum PySource {
    Text { text: String, folder: PathBuf, meshes: HashMap<String, Arc<Mesh>> },
    File { path: PathBuf, options: Box<LoadOptions>, kept: AssetCache },
}

impl PySource {
    fn read(&self, size: Option<[u32; 2]>) -> Result<crate::world::World, LoadError> {
        match self {
            PySource::Text { text, folder, meshes } => {
                let mut given = PyInputs { files: Files::default(), meshes: meshes.clone() };
                let path = folder.join("World");
                given.files.sources.confine(&path);
                let mut world = ron::parse(text, &path, &mut given)?;
                world.settings.size = size.unwrap_or(world.settings.size);
                load::complete(&mut world)?;
                Ok(world)
            }
            PySource::File { path, options, kept } => {
                let options = LoadOptions { size: size.or(options.size), ..(**options).clone() };
                load_again(path, &options, &SourceFiles::with(kept.clone()))
            }
        }
    }

    fn world(self) -> PyResult<PyWorld> {
        let world = self.read(None).map_err(of_file)?;
        Ok(PyWorld { world, source: self })
    }
}

/// The subject of a finding, the finding itself, and its remedy.
type PyParts = (Option<String>, String, Option<String>);

/// Files on disk, and meshes that Python gives as arrays.
struct PyInputs {
    files: Files,
    meshes: HashMap<String, Arc<Mesh>>,
}

impl AssetFiles for PyInputs {
    fn mesh(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Arc<Mesh>, LoadError> {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        match name.and_then(|name| self.meshes.get(&name).cloned()) {
            Some(mesh) => Ok(mesh),
            None => self.files.mesh(path, assets, warnings),
        }
    }

    fn model(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<gltf::GltfModel, LoadError> {
        self.files.model(path, assets, warnings)
    }

    fn image(&mut self, path: &Path) -> Result<DecodedImage, LoadError> {
        self.files.image(path)
    }

    fn read(&mut self, path: &Path) -> Result<Vec<u8>, LoadError> {
        self.files.read(path)
    }
}

/// Name, vertices, faces, normals, texture coordinates and linear colours of a mesh.
type Arrays<'py> = (
    String,
    PyReadonlyArray2<'py, f32>,
    PyReadonlyArray2<'py, u32>,
    Option<PyReadonlyArray2<'py, f32>>,
    Option<PyReadonlyArray2<'py, f32>>,
    Option<PyReadonlyArray2<'py, f32>>,
);

fn mesh((name, vertices, faces, normals, uvs, colors): &Arrays) -> PyResult<Mesh> {
    let rows = |what: &str, array: &PyReadonlyArray2<f32>, width: usize| {
        if array.shape()[1] != width {
            return Err(wrong(format!("{what} must have the shape (N, {width}), not {:?}", array.shape())));
        }
        Ok(array.as_slice()?.to_vec())
    };
    let points = |values: Vec<f32>| values.chunks_exact(3).map(Vec3::from_slice).collect::<Vec<_>>();
    if faces.shape()[1] != 3 {
        return Err(wrong(format!("faces must have the shape (F, 3), not {:?}", faces.shape())));
    }
    let positions = points(rows("vertices", vertices, 3)?);
    let triangles: Vec<[u32; 3]> = faces.as_slice()?.as_chunks::<3>().0.to_vec();
    let normals = normals.as_ref().map(|normals| rows("normals", normals, 3)).transpose()?.map(points);
    let uvs = uvs.as_ref().map(|uvs| rows("uvs", uvs, 2)).transpose()?;
    let uvs = uvs.map(|uvs| uvs.chunks_exact(2).map(Vec2::from_slice).collect::<Vec<_>>());
    let (normals, uvs) = (normals.unwrap_or_default(), uvs.unwrap_or_default());
    let colors = colors.as_ref().map(|colors| rows("colors", colors, 3)).transpose()?.unwrap_or_default();
    let colors = colors.as_chunks::<3>().0.iter().copied().map(Rgb::from).collect();
    let mesh = Mesh { name: name.clone(), positions, triangles, normals, uvs, colors, ..Mesh::default() };
    check_mesh(&mesh, 1).map_err(|reason| wrong(format!("{name}: {reason}")))?;
    Ok(mesh)
}

#[pymethods]
impl PyWorld {
    /// Parses a scene; the paths in its text are relative to `folder`.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str, folder: PathBuf, arrays: Vec<Arrays>) -> PyResult<PyWorld> {
        let mut meshes = HashMap::new();
        for given in &arrays {
            meshes.insert(given.0.clone(), Arc::new(mesh(given)?));
        }
        let source = PySource::Text { text: text.to_owned(), folder, meshes };
        py.detach(|| source.world())
    }

    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "each has a name in Python")]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        time: Option<f32>,
        variant: Option<String>,
        scene: Option<String>,
        animation: Option<String>,
        env: Option<&str>,
        set: Vec<String>,
        hide: Vec<String>,
        only: Vec<String>,
        look_at: Option<[[f64; 3]; 2]>,
        orbit: Option<[f64; 2]>,
        zoom: Option<f64>,
        ground: Option<&str>,
        light_units: &str,
        solid_glass: bool,
        double_sided: bool,
        size: Option<[u32; 2]>,
        up: &str,
        env_turn: Option<f64>,
        env_strength: Option<f32>,
        background: Option<String>,
        var: BTreeMap<String, String>,
    ) -> PyResult<PyWorld> {
        let surroundings = env.map(EnvironmentPreset::named).transpose().map_err(wrong)?;
        let light_units = match light_units {
            "auto" => LightUnits::Auto,
            "candela" => LightUnits::Candela,
            "watt" => LightUnits::Watt,
            other => {
                return Err(wrong(format!(
                    "unknown light_units {other:?}: use \"auto\", \"candela\" or \"watt\""
                )));
            }
        };
        let ground = match ground {
            None => None,
            Some("grey") => Some(Floor::Grey),
            Some("shadow") => Some(Floor::Shadow),
            Some(other) => return Err(wrong(format!("unknown ground {other:?}: use True or \"shadow\""))),
        };
        let up = match up {
            "y" => UpAxis::Y,
            "z" => UpAxis::Z,
            other => return Err(wrong(format!("unknown up {other:?}: use \"y\" or \"z\""))),
        };
        let look_at = look_at.map(|places| places.map(|[x, y, z]| format!("{x}, {y}, {z}")));
        let edits = Edits { set, only, hide, look_at, orbit, zoom, ground, background, ..Edits::default() };
        let edits = Edits { env_turn_degrees: env_turn, env_strength, ..edits };
        let common =
            LoadOptions { time_s: time, variant, scene, surroundings, edits, size, ..LoadOptions::default() };
        let options = LoadOptions { var, animation, light_units, solid_glass, double_sided, up, ..common };
        let source = PySource::File { path, options: Box::new(options), kept: AssetCache::keeping() };
        py.detach(|| source.world())
    }

    /// Findings about probable mistakes: the subject of each, the finding, and its remedy.
    fn check(&self, py: Python<'_>, size: Option<[u32; 2]>, camera: Option<&str>) -> PyResult<Vec<PyParts>> {
        let settings = self.settings(size, None, None, None, None, [None; 2])?;
        let again = self.for_shape(py, settings.size)?;
        let world = again.as_ref().unwrap_or(&self.world);
        let found = py.detach(|| {
            let setup = crate::render::setup(compile(world, camera)?, &settings);
            Ok(check::check(world, &setup, true))
        });
        let parts = |Diagnostic { subject, text, remedy, .. }| {
            (
                subject.map(|subject: Subject| subject.name),
                text,
                remedy.map(|it: Remedy| it.with_commands(as_arguments)),
            )
        };
        Ok(found.map_err(of_scene)?.into_iter().map(parts).collect())
    }

    #[getter]
    fn cameras(&self) -> Vec<String> {
        camera_names(&self.world)
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.world.warnings.iter().map(|it| it.with_commands(as_arguments)).collect()
    }

    /// Names, keys and values of the parts that a query selects; without a query, of all entities and materials.
    fn parts(
        &self,
        py: Python<'_>,
        text: Option<&str>,
    ) -> PyResult<Vec<(String, HashMap<&'static str, String>)>> {
        let query = text.map(|text| Query::parse(text, &self.world)).transpose().map_err(wrong)?;
        let path = match &self.source {
            PySource::Text { folder, .. } => folder.join("World"),
            PySource::File { path, .. } => path.clone(),
        };
        let found = py.detach(|| list(&self.world, query.as_ref(), &path));
        Ok(found.into_iter().map(|(name, keys)| (name, keys.into_iter().collect())).collect())
    }

    #[getter]
    fn size(&self) -> [u32; 2] {
        self.world.settings.size
    }

    #[allow(clippy::too_many_arguments, reason = "each has a name in Python")]
    fn render(
        &self,
        py: Python<'_>,
        size: Option<[u32; 2]>,
        spp: Option<u32>,
        seed: Option<u64>,
        camera: Option<&str>,
        layers: Vec<String>,
        schedule: &str,
        threads: usize,
        denoise: bool,
        crop: Option<[u32; 4]>,
        noise: Option<f64>,
        depth: Option<u32>,
        exposure: Option<PyExposure>,
        tonemap: Option<&str>,
        transport: Option<&str>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<PyRendering> {
        let aovs = layers.iter().map(|name| layer(name)).collect::<PyResult<Vec<Aov>>>()?;
        let schedule = schedule_of(schedule)?;
        let settings = self.settings(size, spp, seed, depth, exposure, [tonemap, transport])?;
        let region = crop.map(|crop| region(crop, settings.size)).transpose()?;
        if noise.is_some_and(|noise| noise.is_nan() || noise <= 0.0) {
            return Err(wrong("noise must be above 0: 0.01 is a hundredth of the image's brightness"));
        }
        let again = self.for_shape(py, settings.size)?;
        let world = again.as_ref().unwrap_or(&self.world);
        let rendered_region = region.unwrap_or(Region::whole(settings.size));
        let needs = MemoryEstimate { denoises: denoise, schedule, ..MemoryEstimate::usual(rendered_region) };
        let needed = Settings { aov: aovs.clone(), ..settings.clone() };
        let prepare = || {
            let setup = Arc::new(crate::render::setup(compile(world, camera)?, &settings));
            needs.check(&setup, &needed)?;
            let findings = check::check(world, &setup, false);
            Ok((setup, findings))
        };
        let prepared = py.detach(|| on_threads(threads, prepare)).map_err(wrong)?;
        let (setup, findings) = prepared.map_err(of_scene)?;
        // They include the world's warnings.
        let all = check::not_found(&setup.scene.warnings, &findings).chain(&findings).cloned();
        let (notes, mut warnings): (Vec<_>, Vec<_>) = all.partition(|it| it.severity == Severity::Note);
        let variance = aovs.contains(&Aov::Variance);
        let names = if aovs.contains(&Aov::Entity) { world.names() } else { HashMap::new() };
        let options = Options { schedule, variance, region, ..Options::default() };
        let (stop, done) = (AtomicBool::new(false), AtomicU32::new(0));
        let work = || {
            on_threads(threads, || {
                let mut session = Session::of(setup.clone(), settings.samples, options);
                let note = |part: f32| {
                    done.fetch_max(part.to_bits(), Ordering::Relaxed);
                };
                session.finish_while(&Stop::at(&stop), note, |session| {
                    let reached =
                        session.film().relative_noise().zip(noise).is_some_and(|(is, most)| is <= most);
                    !reached
                });
                let film = session.film();
                let shown = check::FinishedImage::new(&settings, film);
                let told = !findings.is_empty();
                warnings.extend(check::of_image(&setup, &shown, told));
                let reached = session.film().relative_noise();
                if let Some((is, most)) = reached.zip(noise).filter(|(is, most)| is > most) {
                    let text = format!("the noise is {is:.4}, not {most}, after all samples");
                    warnings.push(Diagnostic::warning("noise", text).fixed_by("a higher spp lowers it"));
                }
                let denoised =
                    if denoise && !stop.load(Ordering::Relaxed) { session.denoised() } else { None };
                let mut layers = session.channels(&aovs);
                layers.extend(light_channels(session.film(), setup.light_group_names()));
                let (names, camera) = (names_in(&layers, &names, &setup), setup.scene.camera);
                let told = [notes, warnings]
                    .map(|all| all.iter().map(|it| it.with_commands(as_arguments)).collect());
                PyRendering::new(session.into_film(), settings.clone(), layers, names, camera, denoised, told)
            })
        };
        rendered(py, work, &stop, &done, progress.as_ref())
    }
}

impl PyWorld {
    /// The world for an image of another shape; none if its camera does not depend on the shape.
    fn for_shape(&self, py: Python<'_>, [width, height]: [u32; 2]) -> PyResult<Option<crate::world::World>> {
        let [was_wide, was_high] = self.world.settings.size;
        let is_same = u64::from(width) * u64::from(was_high) == u64::from(was_wide) * u64::from(height);
        if is_same || !has_added_camera(&self.world) {
            return Ok(None);
        }
        py.detach(|| self.source.read(Some([width, height]))).map(Some).map_err(of_file)
    }

    /// The scene's settings, overridden by the arguments of this rendering.
    fn settings(
        &self,
        size: Option<[u32; 2]>,
        spp: Option<u32>,
        seed: Option<u64>,
        depth: Option<u32>,
        exposure: Option<PyExposure>,
        [tonemap, transport]: [Option<&str>; 2],
    ) -> PyResult<Settings> {
        let mut settings = self.world.settings.clone();
        settings.size = size.unwrap_or(settings.size);
        settings.samples = spp.unwrap_or(settings.samples);
        settings.seed = seed.unwrap_or(settings.seed);
        settings.tonemap = tonemap.map_or(Ok(settings.tonemap), tone_curve)?;
        settings.transport = match transport.map(str::to_lowercase).as_deref() {
            None => settings.transport,
            Some("auto") => self.world.fitting_transport(),
            Some("path") => Transport::Path,
            Some("whitted") => Transport::Whitted,
            Some(other) => {
                return Err(wrong(format!(
                    "unknown transport {other:?}: use \"path\", \"whitted\" or \"auto\""
                )));
            }
        };
        settings.max_depth = depth.unwrap_or(self.world.depth_under(settings.transport));
        match exposure {
            Some(PyExposure::Stops(stops)) => (settings.auto_exposure, settings.exposure_ev) = (false, stops),
            Some(PyExposure::Named(name)) if name == "auto" => {
                (settings.auto_exposure, settings.exposure_ev) = (true, 0.0);
            }
            Some(PyExposure::Named(name)) => {
                return Err(wrong(format!("exposure must be -64 to 64 stops, or \"auto\", not {name:?}")));
            }
            None => {}
        }
        check_settings(&settings).map_err(of_scene)?;
        Ok(settings)
    }
}

/// Renders on another thread, so that this one can check for signals and report progress.
fn rendered(
    py: Python<'_>,
    work: impl FnOnce() -> Result<PyRendering, ThreadError> + Send,
    stop: &AtomicBool,
    done: &AtomicU32,
    progress: Option<&Py<PyAny>>,
) -> PyResult<PyRendering> {
    std::thread::scope(|scope| {
        let worker = scope.spawn(work);
        let mut outcome: PyResult<()> = Ok(());
        while !worker.is_finished() {
            py.detach(|| wait(&worker));
            outcome = outcome.and_then(|()| {
                py.check_signals()?;
                if let Some(progress) = progress {
                    progress.call1(py, (f32::from_bits(done.load(Ordering::Relaxed)),))?;
                }
                Ok(())
            });
            if outcome.is_err() {
                stop.store(true, Ordering::Relaxed);
            }
        }
        let rendering = worker.join().map_err(|_| wrong("rendering ended by a defect in rayfront"));
        outcome?;
        rendering?.map_err(wrong)
    })
}

/// A schedule by its name.
fn schedule_of(name: &str) -> PyResult<Schedule> {
    match name {
        "wavefront" => Ok(Schedule::Wavefront),
        "recursive" => Ok(Schedule::Recursive),
        other => Err(wrong(format!("unknown schedule {other:?}: use \"wavefront\" or \"recursive\""))),
    }
}

/// The names of the ids in layers.
fn names_in(layers: &[FilmChannel], entities: &HashMap<u32, String>, setup: &RenderSetup) -> LayerNames {
    let ids = layers.iter().filter_map(|layer| {
        let (name, _) = layer.name.split_once('.')?;
        Some((name.to_owned(), names_of_ids(layer, entities, &setup.scene)?))
    });
    ids.collect()
}

/// An exposure in Python: a number of stops, or a name.
#[derive(FromPyObject)]
enum PyExposure {
    Stops(f32),
    Named(String),
}

/// A tone curve by its name on the command line.
fn tone_curve(name: &str) -> PyResult<Tonemap> {
    let plain = |name: &str| name.replace(['-', '_'], "").to_lowercase();
    let known = [
        ("clamp", Tonemap::Clamp),
        ("scale-by-maximum", Tonemap::ScaleByMaximum),
        ("reinhard", Tonemap::Reinhard),
        ("aces", Tonemap::Aces),
        ("agx", Tonemap::Agx),
        ("pbr-neutral", Tonemap::PbrNeutral),
    ];
    let names = || known.map(|(name, _)| name).join(", ");
    let found = known.iter().find(|(known, _)| plain(known) == plain(name));
    found
        .map(|(_, curve)| *curve)
        .ok_or_else(|| wrong(format!("unknown tonemap {name:?}; there are: {}", names())))
}

/// Checks and returns a region of an image.
fn region([x0, y0, x1, y1]: [u32; 4], [width, height]: [u32; 2]) -> PyResult<Region> {
    if x0 < x1 && y0 < y1 && x1 <= width && y1 <= height {
        return Ok(Region { x0, y0, x1, y1 });
    }
    Err(wrong(format!(
        "crop must be (x0, y0, x1, y1) with x0 < x1 <= {width} and y0 < y1 <= {height}, not {:?}",
        (x0, y0, x1, y1)
    )))
}

/// Waits until the worker is done, but no longer than [`LOOK`].
fn wait<T>(worker: &std::thread::ScopedJoinHandle<'_, T>) {
    let begun = std::time::Instant::now();
    let mut nap = Duration::from_micros(200);
    while !worker.is_finished() && begun.elapsed() < POLL_INTERVAL {
        std::thread::sleep(nap);
        nap = (2 * nap).min(Duration::from_millis(5));
    }
}

fn layer(name: &str) -> PyResult<Aov> {
    let found = Aov::ALL.into_iter().find(|aov| aov.name() == name);
    let known = || Aov::ALL.map(Aov::name).join(", ");
    found.ok_or_else(|| wrong(format!("unknown layer {name:?}; there are: {}", known())))
}
