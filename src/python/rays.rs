//! Ray queries over arrays.

use std::sync::Mutex;

use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rayon::prelude::*;

use super::wrong;
use crate::bvh::Stack;
use crate::math::{DAffine3, DMat3, DVec3, Vec3};
use crate::query::{self, Coherence, HitBatch, LengthMismatch, RayBatch, ShapeId, Tracer};
use crate::render::on_threads;

/// The number of rays that a thread takes at a time: they and their hits stay in the cache.
const PART: usize = 16_384;

#[pyclass(module = "rayfront._native")]
pub struct Builder(Option<query::SceneBuilder>);

impl Builder {
    fn inner(&mut self) -> PyResult<&mut query::SceneBuilder> {
        self.0.as_mut().ok_or_else(|| wrong("the scene has been built: make another builder"))
    }
}

#[pymethods]
impl Builder {
    #[new]
    fn new() -> Builder {
        Builder(Some(query::SceneBuilder::new()))
    }

    fn add_mesh(&mut self, vertices: PyReadonlyArray2<f32>, faces: PyReadonlyArray2<u32>) -> PyResult<u32> {
        let vertices = rows::<f32, 3>("vertices", &vertices)?;
        let faces = rows::<u32, 3>("faces", &faces)?;
        self.inner()?.add_mesh(vertices, faces).map(|shape| shape.0).map_err(wrong)
    }

    fn add_spheres(&mut self, spheres: PyReadonlyArray2<f32>) -> PyResult<u32> {
        let spheres = rows::<f32, 4>("spheres", &spheres)?;
        self.inner()?.add_spheres(spheres).map(|shape| shape.0).map_err(wrong)
    }

    /// Places a shape by the first three rows of a matrix, row by row.
    fn place(&mut self, shape: u32, matrix: [f64; 12]) -> PyResult<u32> {
        let row = |i: usize| DVec3::new(matrix[4 * i], matrix[4 * i + 1], matrix[4 * i + 2]);
        let to_world = DAffine3 {
            matrix3: DMat3::from_cols(row(0), row(1), row(2)).transpose(),
            translation: DVec3::new(matrix[3], matrix[7], matrix[11]),
        };
        self.inner()?.place(ShapeId(shape), &to_world).map(|instance| instance.0).map_err(wrong)
    }

    fn build(&mut self, py: Python<'_>) -> PyResult<PyScene> {
        self.inner()?;
        let Some(builder) = self.0.take() else { return Err(wrong("the scene has been built")) };
        let scene = py.detach(|| builder.build()).map_err(wrong)?;
        Ok(PyScene { scene, spare: Mutex::default() })
    }
}

#[pyclass(name = "Scene", module = "rayfront._native", frozen)]
pub struct PyScene {
    scene: query::Scene,
    /// Buffers that no thread uses now: making them takes longer than tracing a few rays.
    spare: Mutex<Vec<Buffers>>,
}

/// The buffers of a thread: those of its tracer, and the rays in columns.
type Buffers = (Stack, RayBatch);

impl PyScene {
    /// Calls a function with a part of the rays and the results of that part to fill, on this thread if there is one
    /// part only.
    fn trace<A: Send>(
        &self,
        py: Python<'_>,
        rays: &PyRays,
        threads: usize,
        answers: &mut [A],
        work: impl Fn(&mut Tracer, &RayBatch, &mut [A]) -> Result<(), LengthMismatch> + Sync,
    ) -> PyResult<()> {
        let part = |(number, answers): (usize, &mut [A])| {
            let spare = self.spare.lock().map_or(None, |mut spare| spare.pop());
            let (mut tracer, mut batch) = match spare {
                Some((stack, batch)) => (self.scene.tracer_with(stack), batch),
                None => (self.scene.tracer(), RayBatch::default()),
            };
            rays.fill(&mut batch, number * PART, answers.len());
            let result = work(&mut tracer, &batch, answers);
            if let Ok(mut spare) = self.spare.lock() {
                spare.push((tracer.into_stack(), batch));
            }
            result.map_err(wrong)
        };
        py.detach(|| match answers.len() {
            ..=PART => part((0, answers)),
            _ => on_threads(threads, || answers.par_chunks_mut(PART).enumerate().try_for_each(part))
                .map_err(wrong)?,
        })
    }
}

/// Rays in Python's layout: a row each.
struct PyRays<'a> {
    origins: &'a [[f32; 3]],
    directions: &'a [[f32; 3]],
    t_min: &'a [f32],
    t_max: &'a [f32],
    coherence: Coherence,
}

impl PyRays<'_> {
    /// Replaces the rays of `batch` by `count` of these, from number `start` on.
    fn fill(&self, batch: &mut RayBatch, start: usize, count: usize) {
        batch.clear();
        for i in start..start + count {
            let [origin, direction] = [self.origins[i], self.directions[i]].map(Vec3::from);
            batch.push(origin, direction, self.t_min[i], self.t_max[i]);
        }
    }
}

#[pymethods]
impl PyScene {
    /// t, u, v, instance, shape and primitive of each ray's closest hit.
    #[allow(clippy::too_many_arguments, reason = "each has a name in Python")]
    fn closest<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f32>,
        directions: PyReadonlyArray2<'py, f32>,
        t_min: PyReadonlyArray1<'py, f32>,
        t_max: PyReadonlyArray1<'py, f32>,
        coherence: &str,
        threads: usize,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let given = given(&origins, &directions, &t_min, &t_max, coherence)?;
        let count = given.origins.len();
        let mut found = vec![([0.0_f32; 3], [-1_i32; 3]); count];
        self.trace(py, &given, threads, &mut found, |tracer, rays, found| {
            let mut hits = HitBatch::new(rays.len());
            tracer.closest(rays.rays(), given.coherence, hits.hits_mut())?;
            for (found, hit) in found.iter_mut().zip(hits.iter()) {
                found.0 = [hit.t, hit.u, hit.v];
                if let Some(place) = self.scene.locate(&hit) {
                    found.1 = [place.instance.0, place.shape.0, place.primitive].map(|id| id as i32);
                }
            }
            Ok(())
        })?;
        let floats = [0, 1, 2].map(|c| found.iter().map(|(floats, _)| floats[c]).collect::<Vec<_>>());
        let ids = [0, 1, 2].map(|c| found.iter().map(|(_, ids)| ids[c]).collect::<Vec<_>>());
        let [t, u, v] = floats.map(|column| column.into_pyarray(py));
        let [instance, shape, primitive] = ids.map(|column| column.into_pyarray(py));
        (t, u, v, instance, shape, primitive).into_pyobject(py)
    }

    /// True for each ray that hits anything.
    #[allow(clippy::too_many_arguments, reason = "each has a name in Python")]
    fn any<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f32>,
        directions: PyReadonlyArray2<'py, f32>,
        t_min: PyReadonlyArray1<'py, f32>,
        t_max: PyReadonlyArray1<'py, f32>,
        coherence: &str,
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let given = given(&origins, &directions, &t_min, &t_max, coherence)?;
        let mut blocked = vec![0_u32; given.origins.len()];
        self.trace(py, &given, threads, &mut blocked, |tracer, rays, blocked| {
            tracer.any(rays.rays(), given.coherence, blocked)
        })?;
        let blocked: Vec<bool> = blocked.into_iter().map(|blocked| blocked != 0).collect();
        Ok(blocked.into_pyarray(py).into_any())
    }

    /// The least and the largest corner of the box around the scene; none if it is empty.
    #[getter]
    fn bounds(&self) -> Option<([f32; 3], [f32; 3])> {
        self.scene.bounds().map(|bounds| (bounds.min.to_array(), bounds.max.to_array()))
    }

    #[getter]
    fn memory_bytes(&self) -> usize {
        self.scene.memory_bytes()
    }
}

fn given<'a>(
    origins: &'a PyReadonlyArray2<f32>,
    directions: &'a PyReadonlyArray2<f32>,
    t_min: &'a PyReadonlyArray1<f32>,
    t_max: &'a PyReadonlyArray1<f32>,
    coherence: &str,
) -> PyResult<PyRays<'a>> {
    let coherence = match coherence {
        "unknown" => Coherence::Unknown,
        "coherent" => Coherence::Coherent,
        "scattered" => Coherence::Scattered,
        other => {
            let names = "\"unknown\", \"coherent\" or \"scattered\"";
            return Err(wrong(format!("unknown coherence {other:?}: use {names}")));
        }
    };
    let given = PyRays {
        origins: rows("origins", origins)?,
        directions: rows("directions", directions)?,
        t_min: t_min.as_slice()?,
        t_max: t_max.as_slice()?,
        coherence,
    };
    let count = given.origins.len();
    for (what, length) in
        [("directions", given.directions.len()), ("t_min", given.t_min.len()), ("t_max", given.t_max.len())]
    {
        if length != count {
            return Err(wrong(format!("{length} {what} for {count} origins")));
        }
    }
    Ok(given)
}

/// The rows of an array with `N` columns.
fn rows<'a, T: numpy::Element, const N: usize>(
    what: &str,
    array: &'a PyReadonlyArray2<T>,
) -> PyResult<&'a [[T; N]]> {
    if array.shape()[1] != N {
        return Err(wrong(format!("{what} must have the shape (N, {N}), not {:?}", array.shape())));
    }
    Ok(array.as_slice()?.as_chunks::<N>().0)
}
