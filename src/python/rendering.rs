//! What has been rendered, as arrays and files.

use std::path::PathBuf;

use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use super::of_output;
use crate::denoise::Denoised;
use crate::film::{Channel, Film, Values};
use crate::formats::{png_bytes, save_image};
use crate::math::Rgb;
use crate::world::Settings;

#[pyclass(module = "rayfront._native", frozen)]
pub struct Rendering {
    film: Film,
    settings: Settings,
    layers: Vec<Channel>,
    denoised: Option<Denoised>,
    #[pyo3(get)]
    warnings: Vec<String>,
}

impl Rendering {
    pub fn new(
        film: Film,
        settings: Settings,
        layers: Vec<Channel>,
        denoised: Option<Denoised>,
        warnings: Vec<String>,
    ) -> Self {
        Self { film, settings, layers, denoised, warnings }
    }

    /// Rows and columns.
    fn shape(&self) -> [usize; 2] {
        let region = self.film.region();
        [region.height() as usize, region.width() as usize]
    }

    fn colours<'py>(&self, py: Python<'py>, pixels: &[Rgb]) -> PyResult<Bound<'py, PyAny>> {
        let [height, width] = self.shape();
        let values: Vec<f32> = pixels.iter().flat_map(|pixel| pixel.to_array()).collect();
        Ok(values.into_pyarray(py).reshape([height, width, 3])?.into_any())
    }
}

#[pymethods]
impl Rendering {
    /// Linear radiance with the primaries of Rec. 709: (height, width, 3), top row first.
    fn numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.colours(py, &self.film.radiance())
    }

    /// The same without noise, if that was asked for and there were two samples a pixel.
    #[getter]
    fn denoised<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.denoised.as_ref().map(|denoised| self.colours(py, &denoised.radiance)).transpose()
    }

    /// What else was asked for, by name: (height, width), or (height, width, 3).
    #[getter]
    fn layers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let [height, width] = self.shape();
        let layers = PyDict::new(py);
        let mut rest = &self.layers[..];
        while let Some(first) = rest.first() {
            // `normal.X`, `normal.Y` and `normal.Z` are one.
            let name = first.name.split('.').next().unwrap_or_default();
            let count =
                rest.iter().take_while(|channel| channel.name.split('.').next() == Some(name)).count();
            let (columns, after) = rest.split_at(count);
            rest = after;
            let array = match &columns[0].values {
                Values::Whole(ids) => ids.clone().into_pyarray(py).reshape([height, width])?.into_any(),
                Values::Float(values) if count == 1 => {
                    values.clone().into_pyarray(py).reshape([height, width])?.into_any()
                }
                Values::Float(_) => {
                    let mut values = vec![0.0; height * width * count];
                    for (c, column) in columns.iter().enumerate() {
                        let Values::Float(column) = &column.values else { continue };
                        for (to, from) in values.iter_mut().skip(c).step_by(count).zip(column) {
                            *to = *from;
                        }
                    }
                    values.into_pyarray(py).reshape([height, width, count])?.into_any()
                }
            };
            layers.set_item(name, array)?;
        }
        Ok(layers)
    }

    /// Of the exact sums of all samples: equal films have equal ones.
    #[getter]
    fn film_hash(&self) -> String {
        format!("{:032x}", self.film.hash())
    }

    /// Width and height in pixels.
    #[getter]
    fn size(&self) -> [u32; 2] {
        [self.film.region().width(), self.film.region().height()]
    }

    /// Samples a pixel, on average.
    #[getter]
    fn samples(&self) -> f64 {
        self.film.samples_per_pixel()
    }

    /// Writes a `.png` (exposed and tone mapped as the scene says), an `.exr` with all layers, or an `.hdr`.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| save_image(path, &self.film, &self.settings, &self.layers)).map_err(of_output)
    }

    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| png_bytes(&self.film, &self.settings)).map_err(of_output)?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn __repr__(&self) -> String {
        let [width, height] = self.size();
        format!("<rayfront.Rendering {width}x{height}, {} samples a pixel>", self.samples())
    }
}
