//! Shading normals: perturbed by normal maps, and corrected if they face away from the viewer or reflect below the
//! surface.

use super::principled::shading_frame::ShadingFrame;
use super::surface::normalize_or;
use crate::math::Vector;
use crate::simd::Float;

/// Normals are turned until their cosine to the viewer is at least this.
const LEAST_COSINE: f32 = 0.01;

/// Transforms a tangent-space normal to world space.
#[inline(always)]
pub fn normal_in<F: Float>(frame: &ShadingFrame<F>, n: Vector<F>) -> Vector<F> {
    normalize_or(frame.x * n.x + frame.y * n.y + frame.z * n.z, frame.z)
}

/// The least cosine of the reflected view direction to the geometric normal: small, and less than the viewer's.
#[inline(always)]
fn least_rise<F: Float>(viewer: F) -> F {
    (viewer * F::splat(0.9)).min(F::splat(LEAST_COSINE))
}

/// Set if a shading normal is turned before it is used for a mirror: it faces away from the viewer, or reflects the
/// view direction below the surface.
#[inline(always)]
pub fn is_turned<F: Float>(normal: Vector<F>, geometric_normal: Vector<F>, to_viewer: Vector<F>) -> F::Mask {
    let cos = normal.dot(to_viewer);
    cos.lt(F::splat(LEAST_COSINE)) | mirrors_what_is_below(normal, geometric_normal, to_viewer)
}

/// Set if the reflected view direction is below the surface, or hardly above it.
#[inline(always)]
pub fn mirrors_what_is_below<F: Float>(
    normal: Vector<F>,
    geometric_normal: Vector<F>,
    to_viewer: Vector<F>,
) -> F::Mask {
    let viewer = geometric_normal.dot(to_viewer);
    let image = F::splat(2.0) * normal.dot(to_viewer) * normal.dot(geometric_normal) - viewer;
    image.lt(least_rise(viewer))
}

/// A normal that reflects the view direction above the surface: turned towards the geometric normal, in the plane of
/// both, as far as needed. Otherwise the mirror would be black there.
///
/// The mirror image of a viewer (x, z) at a normal at an angle φ to z has the height x sin 2φ + z cos 2φ. This is
/// solved for the largest φ that reaches the least height.
#[inline(always)]
fn raised<F: Float>(normal: Vector<F>, geometric_normal: Vector<F>, to_viewer: Vector<F>) -> Vector<F> {
    let (zero, one, half) = (F::zero(), F::one(), F::splat(0.5));
    let aside = normal - geometric_normal * normal.dot(geometric_normal);
    let side = normalize_or(aside, ShadingFrame::about(geometric_normal).x);
    let (x, z) = (to_viewer.dot(side), to_viewer.dot(geometric_normal));
    let length = (x * x + z * z).max(F::splat(1e-20));
    let rise = least_rise(z);
    let rest = (length - rise * rise).max(zero).sqrt();
    let twice = (z * rise - x * rest) / length;
    let sin = ((one - twice) * half).max(zero).sqrt();
    let cos = ((one + twice) * half).max(zero).sqrt();
    side * sin + geometric_normal * cos
}

/// The shading normal of a surface with a mirror of weight `part`, 0 to 1: that part of the normal is turned in lanes
/// where it reflects `below` the surface.
#[inline(always)]
pub fn for_mirrors<F: Float>(
    normal: Vector<F>,
    geometric_normal: Vector<F>,
    to_viewer: Vector<F>,
    part: F,
    below: F::Mask,
) -> Vector<F> {
    let turned = raised(normal, geometric_normal, to_viewer) * part + normal * (F::one() - part);
    Vector::select(below, normalize_or(turned, geometric_normal), normal)
}

/// A frame about a shading normal, which is turned towards the viewer if it faces away.
#[inline(always)]
pub fn bend<F: Float>(
    frame: &ShadingFrame<F>,
    geometric_normal: Vector<F>,
    normal: Vector<F>,
    to_viewer: Vector<F>,
) -> ShadingFrame<F> {
    let least = F::splat(LEAST_COSINE);
    let cos = normal.dot(to_viewer);
    let away = cos.lt(least);
    let bent =
        Vector::select(away, normalize_or(normal + to_viewer * (least - cos), geometric_normal), normal);
    let x = normalize_or(frame.x - bent * bent.dot(frame.x), ShadingFrame::about(bent).x);
    // A left-handed frame stays left-handed.
    let sign = F::select(frame.x.cross(frame.y).dot(frame.z).lt(F::zero()), -F::one(), F::one());
    ShadingFrame { x, y: bent.cross(x) * sign, z: bent }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    fn vector(x: f32, y: f32, z: f32) -> Vector<f32> {
        Vector::new(x, y, z)
    }

    fn up() -> Vector<f32> {
        vector(0.0, 0.0, 1.0)
    }

    fn upright() -> ShadingFrame<f32> {
        ShadingFrame { x: vector(1.0, 0.0, 0.0), y: vector(0.0, 1.0, 0.0), z: up() }
    }

    #[track_caller]
    fn near(found: Vector<f32>, expected: [f32; 3]) {
        let found = [found.x, found.y, found.z];
        let close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(close, "{found:?} instead of {expected:?}");
    }

    /// Perturbs a frame by a normal map's texel.
    fn through(frame: &ShadingFrame<f32>, n: Vector<f32>, viewer: Vector<f32>) -> ShadingFrame<f32> {
        bend(frame, up(), normal_in(frame, n), viewer)
    }

    #[test]
    fn normal_maps_tilt_the_normal_along_the_frame() {
        let upside_down = ShadingFrame { x: vector(1.0, 0.0, 0.0), y: vector(0.0, -1.0, 0.0), z: up() };
        let viewer = vector(0.0, 0.0, 1.0);
        near(through(&upside_down, vector(0.0, 0.0, 1.0), viewer).z, [0.0, 0.0, 1.0]);
        // The length of the normal is ignored. Green tilts to the top of the image, which is at −Y here.
        near(through(&upside_down, vector(1.2, 0.0, 1.6), viewer).z, [0.6, 0.0, 0.8]);
        let bent = through(&upside_down, vector(0.0, 0.6, 0.8), viewer);
        near(bent.z, [0.0, -0.6, 0.8]);
        near(bent.x, [1.0, 0.0, 0.0]);
        // As left-handed as the image.
        near(bent.x.cross(bent.y), [0.0, 0.6, -0.8]);
        let bent = through(&upside_down, vector(0.6, 0.0, 0.8), viewer);
        near(bent.x, [0.8, 0.0, -0.6]);
        // A zero normal.
        near(through(&upside_down, Vector::zero(), viewer).z, [0.0, 0.0, 1.0]);
    }

    #[test]
    fn bend_turns_normals_that_face_away_towards_the_viewer() {
        let frame = upright();
        // The viewer is far to the left, and the normal is bent to the right.
        let viewer = Vector::splat(Vec3::new(-0.8, 0.0, 0.6));
        let bent = through(&frame, vector(0.8, 0.0, 0.6), viewer).z;
        // In the plane of both, turned until its dot product with the viewer is 0.01 before normalization.
        let cos = bent.dot(viewer);
        assert!((cos - 0.01 / (1.0f32 - 0.28 * 0.28 + 1e-4).sqrt()).abs() < 1e-5, "{cos}");
        assert!(bent.y == 0.0 && bent.x > 0.0 && (bent.dot(bent) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn mirror_normals_never_reflect_below_the_surface() {
        let frame = upright();
        let up = up();
        let mut turned = 0;
        for viewer in
            [(0.0, 0.0, 1.0), (-0.8, 0.0, 0.6), (0.6, 0.64, 0.48), (-0.9, 0.43, 0.07), (0.99, 0.1, 0.005)]
        {
            let viewer = vector(viewer.0, viewer.1, viewer.2).normalize();
            for n in [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (-0.6, 0.48, 0.64), (0.8, -0.6, 0.0), (0.1, 0.9, 0.2)]
            {
                let n = vector(n.0, n.1, n.2).normalize();
                let plain = bend(&frame, up, n, viewer).z;
                let below = mirrors_what_is_below(n, up, viewer);
                let raised = for_mirrors(n, up, viewer, 1.0, below);
                let bent = bend(&frame, up, raised, viewer).z;
                assert!((bent.length() - 1.0).abs() < 1e-5);
                let image = bent * (2.0 * bent.dot(viewer)) - viewer;
                let rise = least_rise(viewer.z);
                assert!(image.z > rise - 1e-3 * (1.0 + rise), "{:?} {:?}", (n.x, n.y, n.z), image.z);
                if is_turned(n, up, viewer) {
                    turned += 1;
                    // No farther than needed, and in the plane of both normals.
                    assert!((image.z - rise).abs() < 2e-3 || viewer.z < 0.02, "{} {rise}", image.z);
                    assert!(n.dot(viewer) < 0.01 || n.cross(up).dot(bent).abs() < 1e-5);
                } else {
                    near(bent, [plain.x, plain.y, plain.z]);
                }
            }
        }
        assert!(turned > 8, "{turned}");
        // A surface without mirror keeps its normal.
        let n = vector(0.8, -0.6, 0.0);
        near(for_mirrors(n, up, up, 0.0, true), [0.8, -0.6, 0.0]);
    }
}
