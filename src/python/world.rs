//! Worlds: from files, or from what Python says.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::rendering::Rendering;
use super::{of_file, of_scene, wrong};
use crate::compile::{camera_names, compile};
use crate::error::LoadError;
use crate::formats::{AssetFiles, Edits, Files, LoadOptions, Surroundings, gltf, load_with, ron};
use crate::math::{Vec2, Vec3};
use crate::render::{Options, Schedule, Session, on_threads};
use crate::world::{Aov, Assets, Image, Mesh};

/// How often somebody who waits for a rendering is told how far it is, and may interrupt it.
const LOOK: Duration = Duration::from_millis(50);

#[pyclass(module = "rayfront._native", frozen)]
pub struct World(crate::world::World);

/// Files on disk, and meshes that Python has as arrays.
struct Given {
    files: Files,
    meshes: HashMap<String, Arc<Mesh>>,
}

impl AssetFiles for Given {
    fn mesh(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<String>,
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
        warnings: &mut Vec<String>,
    ) -> Result<gltf::Model, LoadError> {
        self.files.model(path, assets, warnings)
    }

    fn image(&mut self, path: &Path) -> Result<Arc<Image>, LoadError> {
        self.files.image(path)
    }

    fn read(&mut self, path: &Path) -> Result<Vec<u8>, LoadError> {
        self.files.read(path)
    }
}

/// Name, vertices, faces, normals and texture coordinates of a mesh.
type Arrays<'py> = (
    String,
    PyReadonlyArray2<'py, f32>,
    PyReadonlyArray2<'py, u32>,
    Option<PyReadonlyArray2<'py, f32>>,
    Option<PyReadonlyArray2<'py, f32>>,
);

fn mesh((name, vertices, faces, normals, uvs): &Arrays) -> PyResult<Mesh> {
    let rows = |what: &str, array: &PyReadonlyArray2<f32>, width: usize| {
        if array.shape()[1] != width {
            return Err(wrong(format!("{what} have the shape (N, {width}), not {:?}", array.shape())));
        }
        Ok(array.as_slice()?.to_vec())
    };
    let points = |values: Vec<f32>| values.chunks_exact(3).map(Vec3::from_slice).collect::<Vec<_>>();
    if faces.shape()[1] != 3 {
        return Err(wrong(format!("faces have the shape (F, 3), not {:?}", faces.shape())));
    }
    let positions = points(rows("vertices", vertices, 3)?);
    let triangles: Vec<[u32; 3]> = faces.as_slice()?.as_chunks::<3>().0.to_vec();
    let count = positions.len();
    if let Some((face, _)) =
        triangles.iter().enumerate().find(|(_, t)| t.iter().any(|i| *i as usize >= count))
    {
        return Err(wrong(format!("face {face} names a vertex that is not there: there are {count}")));
    }
    if !positions.iter().all(|position| position.is_finite()) {
        return Err(wrong("vertices must be finite"));
    }
    let normals = normals.as_ref().map(|normals| rows("normals", normals, 3)).transpose()?.map(points);
    let uvs = uvs.as_ref().map(|uvs| rows("uvs", uvs, 2)).transpose()?;
    let uvs = uvs.map(|uvs| uvs.chunks_exact(2).map(Vec2::from_slice).collect::<Vec<_>>());
    let (normals, uvs) = (normals.unwrap_or_default(), uvs.unwrap_or_default());
    for (what, given) in [("normals", normals.len()), ("uvs", uvs.len())] {
        if given != 0 && given != count {
            return Err(wrong(format!("{given} {what} for {count} vertices")));
        }
    }
    Ok(Mesh { name: name.clone(), positions, triangles, normals, uvs, ..Mesh::default() })
}

#[pymethods]
impl World {
    /// Of a scene's text; `folder` is what its files are relative to.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str, folder: PathBuf, arrays: Vec<Arrays>) -> PyResult<World> {
        let mut meshes = HashMap::new();
        for given in &arrays {
            meshes.insert(given.0.clone(), Arc::new(mesh(given)?));
        }
        py.detach(|| {
            let mut given = Given { files: Files::default(), meshes };
            let path = folder.join("World");
            given.files.sources.confine(&path);
            let mut world = ron::parse(text, &path, &mut given)?;
            world.choose_transport();
            Ok(World(world))
        })
        .map_err(of_file)
    }

    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "each has a name in Python")]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        time: Option<f32>,
        variant: Option<String>,
        scene: Option<String>,
        env: Option<&str>,
        set: Vec<String>,
        hide: Vec<String>,
        only: Vec<String>,
    ) -> PyResult<World> {
        let surroundings = env.map(Surroundings::named).transpose().map_err(wrong)?;
        let edits = Edits { set, only, hide, ..Edits::default() };
        let options =
            LoadOptions { time_s: time, variant, scene, surroundings, edits, ..LoadOptions::default() };
        py.detach(|| load_with(&path, &options)).map(World).map_err(of_file)
    }

    #[getter]
    fn cameras(&self) -> Vec<String> {
        camera_names(&self.0)
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.clone()
    }

    #[getter]
    fn size(&self) -> [u32; 2] {
        self.0.settings.size
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
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Rendering> {
        let aovs = layers.iter().map(|name| layer(name)).collect::<PyResult<Vec<Aov>>>()?;
        let schedule = match schedule {
            "wavefront" => Schedule::Wavefront,
            "recursive" => Schedule::Recursive,
            other => {
                return Err(wrong(format!("unknown schedule {other:?}: use \"wavefront\" or \"recursive\"")));
            }
        };
        let mut settings = self.0.settings.clone();
        settings.size = size.unwrap_or(settings.size);
        settings.samples = spp.unwrap_or(settings.samples);
        settings.seed = seed.unwrap_or(settings.seed);
        for (what, value, most) in [
            ("width", settings.size[0], 1 << 16),
            ("height", settings.size[1], 1 << 16),
            ("spp", settings.samples, 1 << 22),
        ] {
            if !(1..=most).contains(&value) {
                return Err(wrong(format!("{what} must be 1 to {most}, not {value}")));
            }
        }
        let scene = py.detach(|| compile(&self.0, camera)).map_err(of_scene)?;
        // Those of the world are among them.
        let warnings = scene.warnings.clone();
        let options = Options { schedule, variance: aovs.contains(&Aov::Variance), ..Options::default() };
        let (stop, done) = (AtomicBool::new(false), AtomicU32::new(0));
        let work = || {
            on_threads(threads, || {
                let mut session = Session::new(scene, &settings, options);
                session.finish_until(&stop, |part| {
                    done.fetch_max(part.to_bits(), Ordering::Relaxed);
                });
                let denoised =
                    if denoise && !stop.load(Ordering::Relaxed) { session.denoised() } else { None };
                let layers = session.channels(&aovs);
                Rendering::new(session.film().clone(), settings.clone(), layers, denoised, warnings)
            })
        };
        // It renders elsewhere, so that this thread can ask for signals and say how far it is.
        std::thread::scope(|scope| {
            let worker = scope.spawn(work);
            let mut outcome: PyResult<()> = Ok(());
            while !worker.is_finished() {
                py.detach(|| wait(&worker));
                outcome = outcome.and_then(|()| {
                    py.check_signals()?;
                    if let Some(progress) = &progress {
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
}

/// Until it is done, or for a while.
fn wait<T>(worker: &std::thread::ScopedJoinHandle<'_, T>) {
    let begun = std::time::Instant::now();
    let mut nap = Duration::from_micros(200);
    while !worker.is_finished() && begun.elapsed() < LOOK {
        std::thread::sleep(nap);
        nap = (2 * nap).min(Duration::from_millis(5));
    }
}

fn layer(name: &str) -> PyResult<Aov> {
    let names = Aov::ALL.map(|aov| (format!("{aov:?}").to_lowercase(), aov));
    let found = names.iter().find(|(known, _)| known == name).map(|(_, aov)| *aov);
    let known = || names.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
    found.ok_or_else(|| wrong(format!("unknown layer {name:?}; there are: {}", known())))
}
