//! The footprint of a ray's cone on a surface, and the part of a texture within it.

use super::principled::shading_frame::ShadingFrame;
use super::surface::normalize_or;
use crate::math::Vector;
use crate::math::elementary::log2;
use crate::simd::Float;

/// The largest number of lookups along the longer axis; a longer footprint is widened instead.
const MOST_TAPS: f32 = 16.0;
/// The least cosine of the angle of incidence; at flatter angles footprints stop growing.
const FLATTEST: f32 = 0.01;
/// The largest cone angle with an elliptical footprint. Wider cones belong to blurred light; a second axis for them
/// would take a sixth of the time of some scenes.
const WIDEST: f32 = 1.0 / 16.0;

/// An ellipse in texture coordinates.
#[derive(Clone, Copy)]
pub struct Footprint<F: Float> {
    /// Two conjugate diameters, in units of the coordinates.
    pub axes: [(F, F); 2],
}

impl<F: Float> Footprint<F> {
    /// The footprint of a point.
    #[inline(always)]
    pub fn point() -> Self {
        Self { axes: [(F::zero(), F::zero()); 2] }
    }

    /// The footprint of diameters on a surface along which texture coordinates change by `u` and `v` per metre.
    #[inline(always)]
    pub fn new(diameters: &[Vector<F>; 2], u: Vector<F>, v: Vector<F>) -> Self {
        let [a, b] = diameters;
        Self { axes: [(a.dot(u), a.dot(v)), (b.dot(u), b.dot(v))] }
    }

    /// `yes` where `mask` is set, `no` elsewhere.
    #[inline(always)]
    pub fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        let ([a, b], [c, d]) = (yes.axes, no.axes);
        Self {
            axes: [
                (F::select(mask, a.0, c.0), F::select(mask, a.1, c.1)),
                (F::select(mask, b.0, d.0), F::select(mask, b.1, d.1)),
            ],
        }
    }
}

/// The intersection of a surface with a cone that is `width` wide after `t` metres: the diameter across its direction,
/// and the one along it, longer by the inverse of the cosine. Wide cones cover a circle of that area.
#[inline(always)]
pub fn on_surface<F: Float>(normal: Vector<F>, direction: Vector<F>, width: F, t: F) -> [Vector<F>; 2] {
    let cos = normal.dot(direction);
    let along = normalize_or(direction - normal * cos, ShadingFrame::about(normal).x);
    let slant = cos.abs().max(F::splat(FLATTEST));
    let wide = width.gt(t * F::splat(WIDEST));
    let root = slant.sqrt();
    let (across, slant) = (F::select(wide, width / root, width), F::select(wide, root, slant));
    [normal.cross(along) * across, along * (width / slant)]
}

/// Tests if an ellipse with these conjugate diameters in texels may be longer than one texel.
#[inline(always)]
pub fn may_exceed_a_texel<F: Float>([a, b]: [(F, F); 2]) -> F::Mask {
    (a.0 * a.0 + b.0 * b.0 + a.1 * a.1 + b.1 * b.1).gt(F::one())
}

/// Isotropic lookups in a row that together cover a footprint (Barkans, "High Quality Rendering Using the Talisman
/// Architecture", 1997; McCormack and others, "Feline", SIGGRAPH 1999).
pub struct Taps<F: Float> {
    /// log₂ of the width of each lookup, in texels of the finest level; 0 for the finest level.
    pub level: F,
    /// The number of lookups, a whole number from 1.
    pub count: F,
    /// The offset from the centre to the first lookup, in texels.
    pub first: (F, F),
    /// The offset from a lookup to the next.
    pub step: (F, F),
}

impl<F: Float> Taps<F> {
    /// The lookups for an ellipse with these conjugate diameters in texels. The first one starts and the last one ends
    /// at an end of the ellipse, so that the result is continuous when the number of lookups changes.
    #[inline(always)]
    pub fn new([a, b]: [(F, F); 2]) -> Self {
        let (one, half) = (F::one(), F::splat(0.5));
        // The axes are the eigenvectors of a aᵀ + b bᵀ.
        let xx = a.0 * a.0 + b.0 * b.0;
        let xy = a.0 * a.1 + b.0 * b.1;
        let yy = a.1 * a.1 + b.1 * b.1;
        let (mean, apart) = ((xx + yy) * half, (xx - yy) * half);
        let greater = mean + (apart * apart + xy * xy).sqrt();
        let long = greater.max(F::splat(1e-20)).sqrt();
        let short = (a.0 * b.1 - a.1 * b.0).abs() / long;
        // Texels are interpolated, so a lookup is at least one texel wide.
        let width = short.max(long * F::splat(1.0 / MOST_TAPS)).max(one);
        let count = F::zero() - (F::zero() - long / width).floor();
        let count = count.clamp(1.0, MOST_TAPS);
        let upright = xx.lt(yy);
        let x = F::select(upright, xy, greater - yy);
        let y = F::select(upright, greater - xx, xy);
        let length = (x * x + y * y).sqrt().max(F::splat(1e-20));
        let reach = (long - width).max(F::zero()) / length;
        let (x, y) = (x * reach, y * reach);
        let between = one / (count - one).max(one);
        Self {
            level: log2(width),
            count,
            first: (F::zero() - x * half, F::zero() - y * half),
            step: (x * between, y * between),
        }
    }

    /// The lanes that have lookup number `index`, counted from 0.
    #[inline(always)]
    pub fn continues(&self, index: F, mask: F::Mask) -> F::Mask {
        mask & index.lt(self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn near(found: f32, expected: f32) {
        assert!((found - expected).abs() < 1e-5 * expected.abs().max(1.0), "{found} instead of {expected}");
    }

    #[test]
    fn on_surface_cuts_a_cone_at_a_slant() {
        let normal = Vector::new(0.0, 0.0, 1.0);
        for sin in [0.0f32, 0.5, 0.8, 0.99] {
            let cos = (1.0 - sin * sin).sqrt();
            let [across, along] = on_surface(normal, Vector::new(sin, 0.0, -cos), 0.25, 10.0);
            near(across.length(), 0.25);
            near(along.length(), 0.25 / cos);
            near(across.dot(along), 0.0);
            if sin > 0.0 {
                near(along.x, 0.25 / cos);
            }
        }
        let [_, flat] = on_surface(normal, Vector::new(1.0, 0.0, 0.0), 1.0, 100.0);
        near(flat.length(), 100.0);
        for side in on_surface(normal, Vector::new(0.8, 0.0, -0.6), 0.25, 1.0) {
            near(side.length(), 0.25 / 0.6f32.sqrt());
        }
    }

    /// An ellipse of diameters `long` and `short`, with the long one at `angle`.
    fn ellipse(long: f32, short: f32, angle: f32) -> [(f32, f32); 2] {
        let (sin, cos) = angle.sin_cos();
        [(long * cos, long * sin), (-short * sin, short * cos)]
    }

    #[test]
    fn taps_span_the_ellipse_without_gaps() {
        for (long, short) in [(8.0, 2.0), (30.0, 2.5), (5.0, 0.3), (40.0, 1.0), (1000.0, 2.0), (3.0, 3.0)] {
            for angle in [0.0, 0.4, 1.5, 2.0, 3.0] {
                let taps = Taps::new(ellipse(long, short, angle));
                let width = taps.level.exp2();
                near(width, short.max(long / 16.0).max(1.0));
                assert!((1.0..=16.0).contains(&taps.count) && taps.count.fract() == 0.0, "{}", taps.count);
                let (x, y) = (taps.first.0 * -2.0, taps.first.1 * -2.0);
                near(x.hypot(y), long - width);
                near((x * angle.sin() - y * angle.cos()).abs() / long, 0.0);
                near(taps.step.0 * (taps.count - 1.0), x);
                near(taps.step.1 * (taps.count - 1.0), y);
                assert!(taps.step.0.hypot(taps.step.1) <= 1.001 * width, "a gap");
            }
        }
    }

    #[test]
    fn taps_depend_on_the_ellipse_and_not_on_its_diameters() {
        let [a, b] = ellipse(12.0, 3.0, 0.7);
        for turn in [0.0f32, 0.3, 1.0, 2.0] {
            let (sin, cos) = turn.sin_cos();
            let c = (a.0 * cos + b.0 * sin, a.1 * cos + b.1 * sin);
            let d = (b.0 * cos - a.0 * sin, b.1 * cos - a.1 * sin);
            let taps = Taps::new([c, d]);
            near(taps.level, 3f32.log2());
            near((taps.first.0 * 0.7f32.sin() - taps.first.1 * 0.7f32.cos()).abs(), 0.0);
        }
    }

    #[test]
    fn footprint_within_a_texel_takes_one_tap() {
        for axes in [[(0.0, 0.0); 2], ellipse(0.9, 0.1, 1.0), ellipse(1.0, 1.0, 0.0)] {
            assert!(!may_exceed_a_texel(axes) || axes[0].0 == 1.0);
            let taps: Taps<f32> = Taps::new(axes);
            assert_eq!((taps.level, taps.count), (0.0, 1.0));
            assert_eq!((taps.first.0.abs(), taps.first.1.abs()), (0.0, 0.0));
        }
        for bad in [f32::NAN, f32::INFINITY, 1e30] {
            let taps: Taps<f32> = Taps::new([(bad, 0.0), (1.0, bad)]);
            assert!((1.0..=16.0).contains(&taps.count), "{}", taps.count);
        }
    }
}
