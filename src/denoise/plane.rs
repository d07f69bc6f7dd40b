//! Image planes: one number for each pixel, with a border that repeats the image's edge.

use rayon::prelude::*;

use crate::simd::Float;

/// The width of the border: the largest reach of any filter beyond a pixel.
pub const BORDER: usize = super::outliers::REACH;
const _: () = assert!(BORDER >= super::RADIUS + super::PATCH);
/// Additional columns: rows are whole tiles long, and lanes may read beyond them.
const SPARE: usize = super::filter::TILE[0] + 16;

/// A difference of features that leaves no weight.
const OUTSIDE: f32 = 1e3;

/// One number for each pixel, with a border that repeats the image's edge.
#[derive(Clone, Debug, Default)]
pub struct ImagePlane {
    values: Vec<f32>,
    /// Columns and rows without the border.
    pub size: [usize; 2],
    stride: usize,
}

impl ImagePlane {
    /// Creates a plane from a function of each pixel's index, row by row.
    pub fn new(size: [usize; 2], value: impl Fn(usize) -> f32 + Sync) -> Self {
        let [width, height] = size;
        let stride = width + 2 * BORDER + SPARE;
        let mut values = vec![0.0; stride * (height + 2 * BORDER)];
        if width * height == 0 {
            return Self { values, size, stride };
        }
        values[BORDER * stride..][..height * stride].par_chunks_mut(stride).enumerate().for_each(
            |(y, row)| {
                for (x, out) in row[BORDER..][..width].iter_mut().enumerate() {
                    *out = value(y * width + x);
                }
                let (first, last) = (row[BORDER], row[BORDER + width - 1]);
                row[..BORDER].fill(first);
                row[BORDER + width..].fill(last);
            },
        );
        for y in (0..BORDER).chain(BORDER + height..height + 2 * BORDER) {
            let from = y.clamp(BORDER, BORDER + height - 1) * stride;
            values.copy_within(from..from + stride, y * stride);
        }
        Self { values, size, stride }
    }

    /// Creates a plane from a function of each pixel's column and row.
    pub fn of(size: [usize; 2], value: impl Fn(usize, usize) -> f32 + Sync) -> Self {
        Self::new(size, |at| value(at % size[0], at / size[0]))
    }

    /// Creates a plane that is 0 within the image, and so large in the border that no pixel is similar to it.
    pub fn frame(size: [usize; 2]) -> Self {
        let mut plane = Self::new(size, |_| 0.0);
        let [width, height] = size;
        for (number, value) in plane.values.iter_mut().enumerate() {
            let (x, y) = (number % plane.stride, number / plane.stride);
            if !((BORDER..BORDER + width).contains(&x) && (BORDER..BORDER + height).contains(&y)) {
                *value = OUTSIDE;
            }
        }
        plane
    }

    /// The value `before` pixels to the left of a pixel and above it; `before` is at most [`BORDER`].
    pub fn around(&self, before: usize, x: usize, y: usize) -> f32 {
        self.values[(y + BORDER - before) * self.stride + x + BORDER - before]
    }

    /// The value of a pixel.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.values[(y + BORDER) * self.stride + x + BORDER]
    }

    /// The values from a place on, which may lie in the border: `x` and `y` are counted from the border's corner.
    #[inline(always)]
    pub fn from(&self, x: usize, y: usize) -> &[f32] {
        &self.values[y * self.stride + x..]
    }

    /// Loads lanes at two places, counted as in [`ImagePlane::from`], each moved `right` columns to the right.
    #[inline(always)]
    pub fn pair<F: Float>(&self, own: [usize; 2], other: [usize; 2], right: usize) -> (F, F) {
        (F::load(self.from(own[0] + right, own[1])), F::load(self.from(other[0] + right, other[1])))
    }

    /// Averages over squares of pixels, `radius` to each side.
    pub fn smoothed(&self, radius: usize) -> ImagePlane {
        let [width, height] = self.size;
        let across = 2 * radius + 1;
        let mut rows = vec![0.0; width * (height + 2 * radius)];
        rows.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
            let source = self.from(BORDER - radius, y + BORDER - radius);
            for (x, mean) in row.iter_mut().enumerate() {
                *mean = source[x..x + across].iter().sum::<f32>() / across as f32;
            }
        });
        ImagePlane::new(self.size, |at| {
            let column = (0..across).map(|row| rows[at + row * width]);
            column.sum::<f32>() / across as f32
        })
    }
}

/// Estimates the variance of one half of the samples from the difference of both, averaged over squares of `radius`
/// pixels to each side.
pub fn variance(even: &ImagePlane, odd: &ImagePlane, radius: usize) -> ImagePlane {
    let width = even.size[0].max(1);
    let square = |at: usize| {
        let difference = even.at(at % width, at / width) - odd.at(at % width, at / width);
        0.5 * difference * difference
    };
    ImagePlane::new(even.size, square).smoothed(radius)
}
