//! The results of rendering, as arrays and files.

use std::collections::BTreeMap;
use std::path::PathBuf;

use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use super::{of_output, wrong};
use crate::denoise::Denoised;
use crate::film::exposure::exposure_ev;
use crate::film::{Film, FilmChannel, Values};
use crate::formats::{ImageOptions, PngBits, png_bytes, rgba8, save_image_with};
use crate::math::Rgb;
use crate::scene::{CompiledCamera, Projection};
use crate::world::Settings;

/// Names by layer and number.
pub type LayerNames = BTreeMap<String, BTreeMap<u32, String>>;

#[pyclass(name = "Rendering", module = "rayfront._native", frozen)]
pub struct PyRendering {
    film: Film,
    settings: Settings,
    layers: Vec<FilmChannel>,
    /// The names of the numbers in layers.
    names: LayerNames,
    camera: CompiledCamera,
    denoised: Option<Denoised>,
    /// Notes that every scene of its kind gets.
    #[pyo3(get)]
    notes: Vec<String>,
    /// Findings about probable mistakes.
    #[pyo3(get)]
    warnings: Vec<String>,
}

impl PyRendering {
    pub fn new(
        film: Film,
        settings: Settings,
        layers: Vec<FilmChannel>,
        names: LayerNames,
        camera: CompiledCamera,
        denoised: Option<Denoised>,
        [notes, warnings]: [Vec<String>; 2],
    ) -> Self {
        Self { film, settings, layers, names, camera, denoised, notes, warnings }
    }

    fn options(&self, bits: u8, denoised: bool) -> PyResult<ImageOptions<'_>> {
        let bits = match bits {
            8 => PngBits::Eight,
            16 => PngBits::Sixteen,
            other => return Err(wrong(format!("bits must be 8 or 16, not {other}"))),
        };
        if denoised && self.denoised.is_none() {
            return Err(wrong(
                "nothing was denoised: render with denoise=True and two samples a pixel or more",
            ));
        }
        Ok(ImageOptions { layers: &self.layers, bits, denoised: self.denoised.as_ref().filter(|_| denoised) })
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
impl PyRendering {
    /// Linear radiance with the primaries of Rec. 709: (height, width, 3), top row first.
    fn numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.colours(py, &self.film.radiance())
    }

    /// The denoised radiance, as `numpy` returns it; none unless it was requested and there were two samples a pixel.
    #[getter]
    fn denoised<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.denoised.as_ref().map(|denoised| self.colours(py, &denoised.radiance)).transpose()
    }

    /// The opacity of each pixel, from 0 to 1: (height, width). None unless the scene's settings are `transparent`.
    #[getter]
    fn alpha<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(alpha) = self.film.alpha() else { return Ok(None) };
        Ok(Some(alpha.into_pyarray(py).reshape(self.shape())?.into_any()))
    }

    /// The requested layers by name: (height, width), or (height, width, 3).
    #[getter]
    fn layers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let [height, width] = self.shape();
        let layers = PyDict::new(py);
        let mut rest = &self.layers[..];
        while let Some(first) = rest.first() {
            // `normal.X`, `normal.Y` and `normal.Z` are one layer.
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

    /// The names of the numbers in the layers `entity` and `material`, as far as they are in the image.
    #[getter]
    fn names(&self) -> LayerNames {
        self.names.clone()
    }

    /// The transform from camera space, in which the camera looks along −Z and up is +Y, to world space: (4, 4).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let CompiledCamera { right, up, forward, origin, .. } = self.camera;
        let columns = [right.normalize(), up.normalize(), -forward.normalize(), origin];
        let rows = (0..3).flat_map(|row| columns.map(|column| column[row])).chain([0.0, 0.0, 0.0, 1.0]);
        Ok(rows.collect::<Vec<f32>>().into_pyarray(py).reshape([4, 4])?.into_any())
    }

    /// Focal lengths and the principal point in pixels, from the image's upper left corner: (3, 3). None for a
    /// camera that is no pinhole or lens, and for stereo pairs.
    #[getter]
    fn intrinsics<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let CompiledCamera { projection, stereo: None, .. } = self.camera else { return Ok(None) };
        let (Projection::Pinhole(view) | Projection::ThinLens { view, .. }) = projection else {
            return Ok(None);
        };
        let [width, height] = self.settings.size.map(|side| side as f32);
        let [fx, fy] = view.scale(width / height).map(|half| 0.5 * height / half);
        let (region, [right, up]) = (self.film.region(), view.shift);
        let (x, y) = (width * (0.5 - right) - region.x0 as f32, height * (0.5 + up) - region.y0 as f32);
        let matrix = vec![fx, 0.0, x, 0.0, fy, y, 0.0, 0.0, 1.0];
        Ok(Some(matrix.into_pyarray(py).reshape([3, 3])?.into_any()))
    }

    /// A hash of the exact sums of all samples: equal films have equal hashes.
    #[getter]
    fn film_hash(&self) -> String {
        format!("{:032x}", self.film.hash())
    }

    /// Width and height in pixels.
    #[getter]
    fn size(&self) -> [u32; 2] {
        [self.film.region().width(), self.film.region().height()]
    }

    /// Samples per pixel, on average.
    #[getter]
    fn samples(&self) -> f64 {
        self.film.samples_per_pixel()
    }

    /// The exposure of images in stops, given or automatic.
    #[getter]
    fn exposure(&self) -> f32 {
        exposure_ev(&self.settings, &self.film)
    }

    /// The remaining noise, relative to the image's brightness; none after one sample.
    #[getter]
    fn noise(&self) -> Option<f64> {
        self.film.relative_noise()
    }

    /// Pixels for a screen, exposed and tone mapped by the scene's settings: (height, width, 3), sRGB.
    #[pyo3(signature = (denoised = false))]
    fn srgb<'py>(&self, py: Python<'py>, denoised: bool) -> PyResult<Bound<'py, PyAny>> {
        let options = self.options(8, denoised)?;
        let pixels = py.detach(|| rgba8(&self.film, &self.settings, &options)).map_err(of_output)?;
        let [height, width] = self.shape();
        let values: Vec<u8> = pixels.into_iter().flat_map(|[r, g, b, _]| [r, g, b]).collect();
        Ok(values.into_pyarray(py).reshape([height, width, 3])?.into_any())
    }

    /// Writes a `.png` (exposed and tone mapped by the scene's settings), an `.exr` with all layers, or an `.hdr`.
    #[pyo3(signature = (path, bits = 8, denoised = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, bits: u8, denoised: bool) -> PyResult<()> {
        let options = self.options(bits, denoised)?;
        py.detach(|| save_image_with(path, &self.film, &self.settings, &options)).map_err(of_output)
    }

    /// The array that `numpy` returns, for functions that take arrays.
    #[pyo3(signature = (dtype = None, copy = None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if copy == Some(false) {
            return Err(wrong("an array of a rendering is a copy"));
        }
        let array = self.numpy(py)?;
        dtype.map_or(Ok(array.clone()), |dtype| array.call_method1("astype", (dtype,)))
    }

    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py
            .detach(|| png_bytes(&self.film, &self.settings, &ImageOptions::default()))
            .map_err(of_output)?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn __repr__(&self) -> String {
        let [width, height] = self.size();
        format!("<rayfront.Rendering {width}x{height}, {} samples a pixel>", self.samples())
    }
}
