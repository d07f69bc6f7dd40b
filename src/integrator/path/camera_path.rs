//! The beginning of paths at the camera, under both transports.

use super::{Path, pixel_place};
use crate::integrator::RenderSetup;
use crate::math::{Color, NONE, Vec3, Vector};
use crate::sampling::draw::draw_2d;
use crate::sampling::pattern::point;
use crate::sampling::{Dimension, SampleKey};
use crate::scene::Projection;
use crate::scene::bodies::NOWHERE;
use crate::shading::camera;
use crate::simd::{Float, Int, Mask};
use crate::world::Transport;

/// Generates the camera's path for a sample of a pixel.
#[inline(always)]
pub fn generate<F: Float>(setup: &RenderSetup, pixel: F::Int, sample: F::Int) -> Path<F> {
    let key = SampleKey::new(setup.seed, pixel, sample, F::Int::splat(0));
    let dimension = Dimension::Pixel.at(F::Int::splat(0));
    let (u, v) = match setup.transport {
        Transport::Whitted => point::<F>(setup.pattern, setup.samples, key, dimension),
        Transport::Path => draw_2d(setup.sampler, setup.samples, key, dimension),
    };
    let (column, row) = pixel_place::<F>(pixel);
    let half = F::splat(0.5);
    let across = column + half + setup.filter.sample(u);
    let down = row + half + setup.filter.sample(v);
    let lens = match (setup.scene.camera.projection, setup.transport) {
        (Projection::ThinLens { pattern, .. }, Transport::Whitted) => {
            point::<F>(pattern, setup.samples, key, Dimension::Lens.at(F::Int::splat(0)))
        }
        (Projection::ThinLens { .. }, Transport::Path) => {
            draw_2d(setup.sampler, setup.samples, key, Dimension::Lens.at(F::Int::splat(0)))
        }
        _ => (half, half),
    };
    let lens = match setup.scene.camera.projection {
        Projection::ThinLens { .. } => camera::on_lens(setup.scene.aperture.as_ref(), lens),
        _ => lens,
    };
    let image = setup.image();
    let (ray, seen) = image.ray((across, down), (column, row), lens);
    let (at_lens, per_metre) = image.pixel_width();
    let footprint = footprint::<F>(sample);
    let (mut origin, mut direction) = (ray.origin, ray.direction);
    let mut throughput = Color::grey(F::splat(setup.around_square));
    let mut bodies = F::Int::splat(setup.around);
    if (!seen).any() {
        // A point of the image that sees nothing: its path carries no light away from everything.
        let bounds = &setup.scene.bounds;
        let beyond = Vector::splat(bounds.max + bounds.size() + Vec3::ONE);
        origin = Vector::select(seen, origin, beyond);
        direction = Vector::select(seen, direction, Vector::splat(Vec3::ONE).normalize());
        throughput = Color::select(seen, throughput, Color::black());
        bodies = F::Int::select(seen, bodies, F::Int::splat(NOWHERE));
    }
    Path {
        origin,
        direction,
        throughput,
        radiance: Color::black(),
        pixel,
        sample,
        bounce_counts: F::Int::splat(0),
        depth: F::Int::splat(0),
        pdf: F::zero(),
        width: F::splat(at_lens) * footprint,
        spread: F::splat(per_metre) * footprint,
        bodies,
        packed_normal: F::Int::splat(NONE),
        scatterings: F::Int::splat(0),
        travelled: F::zero(),
        landing: F::Int::splat(0),
    }
}

/// The fraction of a pixel's width that a sample stands for in texture look-ups: the more samples, the smaller (PBRT
/// 4th ed., 10.1). It depends on the sample's own number, not on the final number of samples, so that a film can be
/// continued.
#[inline(always)]
pub(in crate::integrator) fn footprint<F: Float>(sample: F::Int) -> F {
    let so_far = sample.to_float() + F::one();
    (F::one() / so_far.sqrt()).max(F::splat(0.125))
}
