//! Projection of points into the image: the inverse of `shading::camera::ray`.

use crate::film::Film;
use crate::integrator::RenderSetup;
use crate::integrator::observe::{self, Observer};
use crate::math::{Color, Rgb, Vector};
use crate::scene::Projection;
use crate::shading::camera;
use crate::simd::Float;

/// A point as the camera sees it unless something lies between.
pub struct ImagePoint<F: Float> {
    /// Unit vector from the point to the camera.
    pub to_camera: Vector<F>,
    /// The distance to the lens.
    pub distance: F,
    /// Columns from the left of the image, in pixels.
    pub column: F,
    /// Rows from the top of the image.
    pub row: F,
    /// The value of a pixel for a unit of light that leaves the point towards the camera, per unit of |cos| there: m⁻².
    pub importance: F,
    /// Lanes whose point lies in front of the camera.
    pub seen: F::Mask,
}

/// Projects a point into the image through a point of the lens (camera importance: PBRT 3rd ed., 16.1.1).
#[inline(always)]
pub fn view<F: Float>(setup: &RenderSetup, point: Vector<F>, lens: (F, F)) -> ImagePoint<F> {
    let camera = &setup.scene.camera;
    let [width, height] = setup.size.map(|side| side as f32);
    let (origin, forward) = (Vector::splat(camera.origin), Vector::splat(camera.forward));
    let (right, up) = (Vector::splat(camera.right), Vector::splat(camera.up));
    let (one, least) = (F::one(), F::splat(1e-20));
    let way = point - origin;
    let (x, y, to_camera, distance, importance, ahead);
    match camera.projection {
        Projection::Orthographic { half_height } => {
            let pixel = 2.0 * half_height / height;
            (x, y) = (way.dot(right), way.dot(up));
            (to_camera, distance, ahead) = (-forward, way.dot(forward), way.dot(forward));
            importance = F::splat(1.0 / (pixel * pixel));
            let scale = F::splat(1.0 / half_height);
            return placed(x * scale, y * scale, to_camera, distance, importance, ahead, [width, height]);
        }
        Projection::Pinhole { tan_half_fov } => {
            ahead = way.dot(forward);
            let scale = one / (ahead * F::splat(tan_half_fov)).max(least);
            (x, y) = (way.dot(right) * scale, way.dot(up) * scale);
            distance = way.dot(way).sqrt().max(least);
            to_camera = way * (-one / distance);
            importance = per_square_metre(tan_half_fov, height, ahead, distance);
        }
        Projection::ThinLens { tan_half_fov, lens_radius, focus_distance, .. } => {
            let lens = camera::on_lens(setup.scene.aperture.as_ref(), lens);
            let radius = F::splat(lens_radius);
            let offset = right * (lens.0 * radius) + up * (lens.1 * radius);
            let way = way - offset;
            ahead = way.dot(forward);
            let focus = offset + way * (F::splat(focus_distance) / ahead.max(least));
            let scale = F::splat(1.0 / (tan_half_fov * focus_distance));
            (x, y) = (focus.dot(right) * scale, focus.dot(up) * scale);
            distance = way.dot(way).sqrt().max(least);
            to_camera = way * (-one / distance);
            importance = per_square_metre(tan_half_fov, height, ahead, distance);
        }
    }
    placed(x, y, to_camera, distance, importance, ahead, [width, height])
}

/// 1 / (d² A cos³ θ), with the area A of a pixel a metre in front of the camera.
#[inline(always)]
fn per_square_metre<F: Float>(tan_half_fov: f32, height: f32, ahead: F, distance: F) -> F {
    let pixel = 2.0 * tan_half_fov / height;
    let cosine = (ahead / distance).max(F::splat(1e-6));
    F::one() / (distance * distance * cosine * cosine * cosine * F::splat(pixel * pixel))
}

#[inline(always)]
fn placed<F: Float>(
    x: F,
    y: F,
    to_camera: Vector<F>,
    distance: F,
    importance: F,
    ahead: F,
    [width, height]: [f32; 2],
) -> ImagePoint<F> {
    let half = F::splat(0.5 * height);
    ImagePoint {
        to_camera,
        distance,
        column: (x + F::splat(width / height)) * half,
        row: (F::one() - y) * half,
        importance,
        seen: ahead.gt(F::splat(1e-6)),
    }
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
        let mut starts = vec![0u32; (columns * rows) as usize + 1];
        for splat in splats.clone() {
            starts[block(splat) + 1] += 1;
        }
        for at in 1..starts.len() {
            starts[at] += starts[at - 1];
        }
        let mut next = starts.clone();
        let nothing = Splat { column: 0.0, row: 0.0, light: Color::black() };
        let mut sorted = vec![nothing; starts.last().copied().unwrap_or(0) as usize];
        for splat in splats {
            let at = &mut next[block(splat)];
            sorted[*at as usize] = *splat;
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
                }
            }
        }
    }
}
