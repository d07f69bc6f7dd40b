//! Projection of photons into the image.

use crate::film::Film;
use crate::integrator::RenderSetup;
use crate::integrator::observe::{self, Observer};
use crate::math::{Color, NONE, Rgb, Vector};
use crate::shading::camera::ImagePoint;
use crate::simd::Float;

/// Projects a point into the image through a point of the lens.
#[inline(always)]
pub fn view<F: Float>(setup: &RenderSetup, point: Vector<F>, lens: (F, F)) -> ImagePoint<F> {
    setup.image().project(setup.scene.aperture.as_ref(), point, lens)
}

/// A photon that one or more pixels see.
#[derive(Clone, Copy)]
pub struct Splat {
    /// Columns from the left of the image, in pixels.
    pub column: f32,
    /// Rows from the top of the image.
    pub row: f32,
    /// The light that it adds to a pixel under a box filter.
    pub light: Color<f32>,
    /// Its light group, or [`NONE`].
    pub group: u32,
}

/// The lanes whose place in the image may count for a pixel, given the filter's radius.
#[inline(always)]
pub fn is_in_image<F: Float>(setup: &RenderSetup, view: &ImagePoint<F>) -> F::Mask {
    let reach = setup.filter.radius();
    let [width, height] = setup.size;
    let (right, bottom) = (F::splat(width as f32 + reach), F::splat(height as f32 + reach));
    let low = F::splat(-reach);
    view.seen & view.column.gt(low) & view.row.gt(low) & view.column.lt(right) & view.row.lt(bottom)
}

/// Width and height in pixels of the blocks that index splats.
const BLOCK: u32 = 16;

/// Splats by blocks of the image.
pub struct Splats {
    /// The number of blocks in a row.
    columns: u32,
    /// The first splat of each block, and the end.
    starts: Vec<u32>,
    splats: Vec<Splat>,
}

impl Splats {
    /// Sorts splats into blocks. Their order is arbitrary: the film's sums are exact.
    pub fn new<'a>(setup: &RenderSetup, splats: impl Iterator<Item = &'a Splat> + Clone) -> Self {
        let [columns, rows] = setup.size.map(|side| side.div_ceil(BLOCK));
        let block = |splat: &Splat| {
            let place = [(splat.column, columns), (splat.row, rows)];
            let [x, y] = place.map(|(at, most)| (at.max(0.0) as u32 / BLOCK).min(most - 1));
            (y * columns + x) as usize
        };
        // What lies at one end of a panorama that goes around counts for the filter at the other end, too.
        let (around, reach) = (setup.image().circumference(), setup.filter.radius());
        let with_copy = move |splat: &Splat| {
            let away = match around {
                Some(width) if splat.column < reach => Some(width),
                Some(width) if splat.column > width - reach => Some(-width),
                _ => None,
            };
            let copy = away.map(|away| Splat { column: splat.column + away, ..*splat });
            std::iter::once(*splat).chain(copy)
        };
        let splats = splats.flat_map(with_copy);
        let mut starts = vec![0u32; (columns * rows) as usize + 1];
        for splat in splats.clone() {
            starts[block(&splat) + 1] += 1;
        }
        for at in 1..starts.len() {
            starts[at] += starts[at - 1];
        }
        let mut next = starts.clone();
        let nothing = Splat { column: 0.0, row: 0.0, light: Color::black(), group: NONE };
        let mut sorted = vec![nothing; starts.last().copied().unwrap_or(0) as usize];
        for splat in splats {
            let at = &mut next[block(&splat)];
            sorted[*at as usize] = splat;
            *at += 1;
        }
        Self { columns, starts, splats: sorted }
    }

    /// The size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.starts[..]) + size_of_val(&self.splats[..])
    }

    /// Adds the splats to a sample of a film's pixels, weighted by the pixel filter.
    pub fn draw(&self, setup: &RenderSetup, film: &mut Film, sample: u32, observer: &mut dyn Observer) {
        let region = film.region();
        let reach = (setup.filter.radius() + 0.5).ceil() as u32;
        let rows = (self.starts.len() as u32 - 1) / self.columns.max(1);
        let blocks = |from: u32, to: u32, most: u32| {
            (from.saturating_sub(reach) / BLOCK)..((to + reach).div_ceil(BLOCK)).min(most)
        };
        for row in blocks(region.y0, region.y1, rows) {
            for column in blocks(region.x0, region.x1, self.columns) {
                let block = (row * self.columns + column) as usize;
                let [start, end] = [self.starts[block], self.starts[block + 1]].map(|at| at as usize);
                for splat in &self.splats[start..end] {
                    splat.draw(setup, film, sample, observer);
                }
            }
        }
    }
}

impl Splat {
    fn draw(&self, setup: &RenderSetup, film: &mut Film, sample: u32, observer: &mut dyn Observer) {
        let (region, filter) = (film.region(), &setup.filter);
        let reach = filter.radius();
        // Pixel x has its centre at x + 0.5.
        let pixels = |at: f32, low: u32, high: u32| {
            let first = (at - reach - 0.5).ceil().max(low as f32) as u32;
            let end = ((at + reach - 0.5).floor() + 1.0).max(0.0) as u32;
            first..end.min(high)
        };
        for y in pixels(self.row, region.y0, region.y1) {
            let down = filter.density(self.row - (y as f32 + 0.5));
            for x in pixels(self.column, region.x0, region.x1) {
                let part = down * filter.density(self.column - (x as f32 + 0.5));
                if part > 0.0 {
                    let light = self.light * part;
                    if observer.is_active() {
                        observer.report(&observe::drawn((x, y), sample, light));
                    }
                    let Color { r, g, b } = light;
                    film.add(x, y, sample, Rgb::new(r, g, b));
                    if self.group != NONE {
                        film.add_to_group(x, y, sample, self.group, Rgb::new(r, g, b));
                    }
                }
            }
        }
    }
}
