//! Mappings from the unit square to other domains.

use crate::math::elementary::sin_cos_turns;
use crate::simd::Float;

/// Maps the unit square to the unit disk, preserving areas and neighbourhoods (Shirley and Chiu 1997, in Shirley's
/// later form with one branch).
#[inline(always)]
pub fn concentric_disk<F: Float>(u: F, v: F) -> (F, F) {
    let (a, b) = (u * F::splat(2.0) - F::one(), v * F::splat(2.0) - F::one());
    let wide = a.abs().gt(b.abs());
    let radius = F::select(wide, a, b);
    let small = F::select(wide, b, a);
    // At the centre the ratio would be 0 / 0.
    let at_center = radius.eq(F::zero());
    let ratio = F::select(at_center, F::zero(), small / F::select(at_center, F::one(), radius));
    let eighth = ratio * F::splat(0.125);
    let turns = F::select(wide, eighth, F::splat(0.25) - eighth);
    let (sin, cos) = sin_cos_turns(turns);
    (radius * cos, radius * sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn concentric_disk_covers_the_disk_uniformly() {
        let n = 400;
        let mut counts = [[0u32; 8]; 8];
        for i in 0..n {
            for j in 0..n {
                let (x, y) = concentric_disk((i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32);
                let r2 = x * x + y * y;
                assert!(r2 <= 1.000_001);
                let ring = ((r2 * 8.0) as usize).min(7);
                let sector = ((libm::atan2f(y, x) / std::f32::consts::TAU + 0.5) * 8.0) as usize;
                counts[ring][sector.min(7)] += 1;
            }
        }
        let expected = (n * n) as f32 / 64.0;
        for count in counts.as_flattened() {
            assert!((*count as f32 / expected - 1.0).abs() < 0.05, "{count} {expected}");
        }
    }

    #[test]
    fn concentric_disk_maps_the_centre_to_the_centre() {
        assert_eq!(concentric_disk(0.5f32, 0.5), (0.0, 0.0));
    }
}
