//! The radiance of rays that hit nothing.

use crate::math::elementary::{acos_turns, atan2_turns, sin_cos_turns};
use crate::math::{Color, Vector};
use crate::scene::environment::{Environment, Panorama};
use crate::simd::{Float, Int};
use crate::world::Background;

/// The radiance from a unit direction.
#[inline(always)]
pub fn radiance<F: Float>(environment: &Environment, direction: Vector<F>, mask: F::Mask) -> Color<F> {
    if let Some(panorama) = &environment.panorama {
        return panorama_radiance(panorama, direction, mask);
    }
    background_radiance(&environment.background, direction)
}

/// The radiance that camera rays see in a unit direction in place of light, if a backdrop is set.
#[inline(always)]
pub fn backdrop<F: Float>(environment: &Environment, direction: Vector<F>) -> Option<Color<F>> {
    let backdrop = environment.backdrop.as_ref()?;
    Some(background_radiance(backdrop, direction))
}

#[inline(always)]
fn background_radiance<F: Float>(background: &Background, direction: Vector<F>) -> Color<F> {
    match background {
        Background::Constant(color) => Color::splat(*color),
        Background::Gradient { bottom, top } => {
            let height = direction.y * F::splat(0.5) + F::splat(0.5);
            Color::splat(*bottom) * (F::one() - height) + Color::splat(*top) * height
        }
    }
}

/// The position of a direction in the panorama's unit square.
#[inline(always)]
fn place<F: Float>(panorama: &Panorama, direction: Vector<F>) -> (F, F) {
    let [x, y, z] = panorama.to_local;
    let x = Vector::splat(x).dot(direction);
    let y = Vector::splat(y).dot(direction);
    let z = Vector::splat(z).dot(direction);
    let u = F::splat(0.5) + atan2_turns(x, -z);
    (u, acos_turns(y.clamp(-1.0, 1.0)) * F::splat(2.0))
}

#[inline(always)]
fn panorama_radiance<F: Float>(panorama: &Panorama, direction: Vector<F>, mask: F::Mask) -> Color<F> {
    let (width, height) = (F::splat(panorama.width as f32), F::splat(panorama.height as f32));
    let (u, v) = place(panorama, direction);
    let half = F::splat(0.5);
    let (x, y) = (u * width - half, v * height - half);
    let (column, row) = (x.floor(), y.floor());
    let (wx, wy) = (x - column, y - row);
    let one = F::one();
    let last = height - one;
    let left = around(column, width);
    let right = around(column + one, width);
    let top = row.max(F::zero()).min(last);
    let bottom = (row + one).max(F::zero()).min(last);
    let across = F::Int::splat(panorama.width);
    let upper = top.to_int() * across;
    let lower = bottom.to_int() * across;
    let texels = &panorama.texels;
    let upper = Color::gather(texels, upper + left.to_int(), mask)
        .mix(Color::gather(texels, upper + right.to_int(), mask), wx);
    let lower = Color::gather(texels, lower + left.to_int(), mask)
        .mix(Color::gather(texels, lower + right.to_int(), mask), wx);
    upper.mix(lower, wy) * Color::splat(panorama.factor)
}

/// Wraps a column into the panorama.
#[inline(always)]
fn around<F: Float>(column: F, width: F) -> F {
    let folded = column - (column / width).floor() * width;
    folded.max(F::zero()).min(width - F::one())
}

/// Samples a direction by importance; returns it and its density per steradian.
#[inline(always)]
pub fn sample<F: Float>(environment: &Environment, u: (F, F), mask: F::Mask) -> (Vector<F>, F) {
    if let Some(panorama) = &environment.panorama {
        let ((s, t), density) = panorama.table.sample(u, mask);
        // v is the polar angle in half turns, u the azimuth in turns.
        let (sin_polar, cos_polar) = sin_cos_turns(t * F::splat(0.5));
        let (sin, cos) = sin_cos_turns(s - F::splat(0.5));
        let local = [sin_polar * sin, cos_polar, -(sin_polar * cos)];
        let [x, y, z] = panorama.to_local.map(Vector::splat);
        let direction = x * local[0] + y * local[1] + z * local[2];
        return (direction, per_steradian(density, sin_polar));
    }
    let y = F::one() - F::splat(2.0) * u.0;
    let radius = (F::one() - y * y).max(F::zero()).sqrt();
    let (sin, cos) = sin_cos_turns(u.1);
    (Vector::new(radius * cos, y, radius * sin), F::splat(0.25 / std::f32::consts::PI))
}

/// Converts a density over the panorama's unit square: divides it by 2π² sin θ (PBRT 4th ed., 12.5.2).
#[inline(always)]
fn per_steradian<F: Float>(density: F, sin_polar: F) -> F {
    let whole = std::f32::consts::PI * std::f32::consts::PI * 2.0;
    density / (sin_polar.max(F::splat(1e-6)) * F::splat(whole))
}

/// The density per steradian with which [`sample`] draws a direction.
#[inline(always)]
pub fn pdf<F: Float>(environment: &Environment, direction: Vector<F>, mask: F::Mask) -> F {
    if let Some(panorama) = &environment.panorama {
        let place = place(panorama, direction);
        let (sin_polar, _) = sin_cos_turns(place.1 * F::splat(0.5));
        return per_steradian(panorama.table.pdf(place, mask), sin_polar);
    }
    F::splat(0.25 / std::f32::consts::PI)
}
