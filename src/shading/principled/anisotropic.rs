//! The albedo of a rough mirror with anisotropic microfacets after a single bounce: like [`super::albedo`] for
//! isotropic ones, with two more parameters.

#[cfg(test)]
pub(super) mod integral;

use super::albedo::{Albedo, between, entry};
use super::ggx::Ggx;
use crate::math::Vector;
use crate::simd::{Float, Int};

/// Nodes of √α, where α is the smaller width.
const ROUGHNESSES: usize = 12;
/// Nodes of the strength: the square root of the position of the larger width between the smaller one and 1.
const STRENGTHS: usize = 12;
/// Nodes of |cos| of the angle between a direction and the axis of the larger width, projected onto the surface.
const AZIMUTHS: usize = 6;
/// Nodes of the cosine to the normal: at squares, closer together at grazing angles.
const COSINES: usize = 16;
const MEANS: usize = 2 * ROUGHNESSES * STRENGTHS;
const ENTRIES: usize = MEANS * AZIMUTHS * COSINES;
/// The count of all numbers of the table.
pub(super) const LENGTH: usize = ENTRIES + MEANS;

/// Both parts of the albedo at each roughness, strength, azimuth and cosine, and their means over the hemisphere.
/// Compared with the integral at 600 points between nodes, the root mean square error is 0.0016, the maximum 0.013.
pub struct AnisotropicTable<'a> {
    entries: &'a [f32],
    means: &'a [f32],
}

impl<'a> AnisotropicTable<'a> {
    /// Divides numbers into columns.
    pub(super) const fn new(numbers: &'a [f32; LENGTH]) -> Self {
        let (entries, means) = numbers.split_at(ENTRIES);
        Self { entries, means }
    }
}

/// Positions among roughnesses and strengths of a pair of widths, x the larger one: lower nodes, and the weights of the
/// upper ones.
#[inline(always)]
pub(super) fn place<F: Float>(
    ggx: &Ggx<F>,
    roughnesses: usize,
    strengths: usize,
) -> ((F::Int, F), (F::Int, F)) {
    let rest = (F::one() - ggx.y).max(F::splat(1e-6));
    let strength = ((ggx.x - ggx.y) / rest).clamp(0.0, 1.0).sqrt();
    (
        between(ggx.y.sqrt() * F::splat((roughnesses - 1) as f32), roughnesses),
        between(strength * F::splat((strengths - 1) as f32), strengths),
    )
}

/// |cos| of the angle between a direction and the axis of the larger width, projected onto the surface.
#[inline(always)]
pub(super) fn azimuth<F: Float>(w: Vector<F>) -> F {
    let square = w.x * w.x + w.y * w.y;
    let upright = square.lt(F::splat(1e-12));
    w.x.abs() / F::select(upright, F::one(), square).sqrt()
}

/// The albedo for a direction in the frame; the signs of its components are ignored.
#[inline(always)]
pub fn directional<F: Float>(
    table: &AnisotropicTable,
    w: Vector<F>,
    ggx: &Ggx<F>,
    mask: F::Mask,
) -> Albedo<F> {
    let ((r, wr), (s, ws)) = place(ggx, ROUGHNESSES, STRENGTHS);
    let (a, wa) = between(azimuth(w) * F::splat((AZIMUTHS - 1) as f32), AZIMUTHS);
    let (c, wc) = between(w.z.abs().sqrt() * F::splat((COSINES - 1) as f32), COSINES);
    let first = (r * F::Int::splat(STRENGTHS as u32) + s) * F::Int::splat(AZIMUTHS as u32) + a;
    // Each entry is a pair of numbers.
    let first = (first * F::Int::splat(COSINES as u32) + c) * F::Int::splat(2);
    let (stronger, rougher) = (2 * COSINES * AZIMUTHS, 2 * COSINES * AZIMUTHS * STRENGTHS);
    let (weights, table) = ((wa, wc), table.entries);
    let low = plane(table, first, weights, mask);
    let high = plane(table, first + F::Int::splat(stronger as u32), weights, mask);
    let smooth = low.mix(high, ws);
    let first = first + F::Int::splat(rougher as u32);
    let low = plane(table, first, weights, mask);
    let high = plane(table, first + F::Int::splat(stronger as u32), weights, mask);
    smooth.mix(low.mix(high, ws), wr)
}

/// Interpolates between two azimuths and two cosines.
#[inline(always)]
fn plane<F: Float>(table: &[f32], first: F::Int, (wa, wc): (F, F), mask: F::Mask) -> Albedo<F> {
    let next = F::Int::splat(2);
    let turned = first + F::Int::splat(2 * COSINES as u32);
    let low = entry(table, first, mask).mix(entry(table, first + next, mask), wc);
    let high = entry(table, turned, mask).mix(entry(table, turned + next, mask), wc);
    low.mix(high, wa)
}

/// The mean albedo over the hemisphere, with weight cos/π.
#[inline(always)]
pub fn average<F: Float>(table: &AnisotropicTable, ggx: &Ggx<F>, mask: F::Mask) -> Albedo<F> {
    let ((r, wr), (s, ws)) = place(ggx, ROUGHNESSES, STRENGTHS);
    let (first, next) = ((r * F::Int::splat(STRENGTHS as u32) + s) * F::Int::splat(2), F::Int::splat(2));
    let means = table.means;
    let low = entry(means, first, mask).mix(entry(means, first + next, mask), ws);
    let first = first + F::Int::splat(2 * STRENGTHS as u32);
    let high = entry(means, first, mask).mix(entry(means, first + next, mask), ws);
    low.mix(high, wr)
}

#[cfg(test)]
mod tests {
    use super::super::albedo;
    use super::super::albedo::integral::{Points, integrate};
    use super::super::tables::{ANISOTROPIC, MIRROR};
    use super::integral::direction;
    use super::*;
    use crate::simd::Isa;

    #[test]
    fn between_its_nodes_the_table_is_the_integral() {
        let points = Points::new(4096);
        let (mut worst, mut square) = (0.0f32, 0.0);
        for i in 0..200 {
            // Roberts' sequence.
            let [r, s, a, c] =
                [0.856_675, 0.733_892, 0.628_707, 0.538_597].map(|step| (i as f32 * step).fract());
            let (r, a) = (0.05 + 0.9 * r, (a * std::f32::consts::FRAC_PI_2).cos());
            let ggx = Ggx { x: r * r + (1.0 - r * r) * s * s, y: r * r };
            let w = direction(c.max(0.01), a);
            let (found, exact) =
                (directional(&ANISOTROPIC, w, &ggx, true), integrate(Isa::detect(), w, ggx, &points).0);
            let off = (found.whole() - exact.whole()).abs();
            (worst, square) = (worst.max(off), square + off * off);
        }
        assert!(worst < 0.015 && (square / 200.0).sqrt() < 0.0025, "{worst} {}", (square / 200.0).sqrt());
    }

    #[test]
    fn equal_widths_match_the_isotropic_table() {
        for r in [0.1f32, 0.3, 0.5, 0.8, 1.0] {
            let ggx = Ggx { x: r * r, y: r * r };
            let (mean, round) = (average(&ANISOTROPIC, &ggx, true), albedo::average(&MIRROR, r, true));
            assert!((mean.whole() - round.whole()).abs() < 0.004, "{r}: {} {}", mean.whole(), round.whole());
            for c in [0.1, 0.4, 0.9] {
                let found = directional(&ANISOTROPIC, direction(c, 0.3), &ggx, true).whole();
                let round = albedo::directional(&MIRROR, c, r, true).whole();
                assert!((found - round).abs() < 0.006, "{r} {c}: {found} {round}");
            }
        }
    }
}
