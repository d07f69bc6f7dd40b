//! Reflection and refraction at smooth boundaries.

use crate::math::Vector;
use crate::simd::{Float, Mask};

/// The mirror direction: d − 2 (d·n) n.
#[inline(always)]
pub fn reflect<F: Float>(direction: Vector<F>, normal: Vector<F>) -> Vector<F> {
    direction - normal * (F::splat(2.0) * direction.dot(normal))
}

/// The reflectance of a smooth boundary between two dielectrics, and the direction of the refracted ray.
#[derive(Clone, Copy)]
pub struct SmoothBoundary<F> {
    /// The part of the light that is reflected, 0 to 1; 1 under total internal reflection.
    pub reflectance: F,
    /// The unit direction of the transmitted light; meaningless if there is none.
    pub refracted: Vector<F>,
}

/// Snell's law and Fresnel's equations for unpolarised light (PBRT 4th ed., 9.3 and 9.5). `normal` is on the side that
/// the ray comes from; `eta` is the index there divided by the index beyond.
#[inline(always)]
pub fn boundary<F: Float>(direction: Vector<F>, normal: Vector<F>, eta: F) -> SmoothBoundary<F> {
    let cos_i = (-direction.dot(normal)).clamp(0.0, 1.0);
    let sin2_t = eta * eta * (F::one() - cos_i * cos_i);
    let total = sin2_t.ge(F::one());
    let cos_t = (F::one() - sin2_t).max(F::zero()).sqrt();
    // Amplitudes for light polarised perpendicular and parallel to the plane of incidence.
    let across = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let along = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let reflectance = (across * across + along * along) * F::splat(0.5);
    let refracted = direction * eta + normal * (eta * cos_i - cos_t);
    let passes = (!total).any();
    SmoothBoundary {
        reflectance: F::select(total, F::one(), reflectance.clamp(0.0, 1.0)),
        refracted: if passes { refracted.normalize() } else { refracted },
    }
}

/// The part of unpolarised light that a smooth boundary reflects; 1 beyond the critical angle. `cos` is that of the
/// angle to the normal on the side that light comes from; `eta` as in [`boundary`].
#[inline(always)]
pub fn reflectance<F: Float>(cos: F, eta: F) -> F {
    let cos_i = cos.clamp(0.0, 1.0);
    let sin2_t = eta * eta * (F::one() - cos_i * cos_i);
    let cos_t = (F::one() - sin2_t).max(F::zero()).sqrt();
    let across = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let along = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let reflectance = (across * across + along * along) * F::splat(0.5);
    F::select(sin2_t.ge(F::one()), F::one(), reflectance.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use proptest::prelude::*;

    fn vector(x: f32, y: f32, z: f32) -> Vector<f32> {
        Vector { x, y, z }
    }

    #[test]
    fn glass_reflects_four_percent_at_normal_incidence() {
        let b = boundary(vector(0.0, -1.0, 0.0), vector(0.0, 1.0, 0.0), 1.0 / 1.5);
        assert!((b.reflectance - 0.04).abs() < 1e-6);
        assert!((b.refracted.y + 1.0).abs() < 1e-6);
    }

    #[test]
    fn boundary_reflects_no_parallel_light_at_brewsters_angle() {
        // tan θ = 1.5: of the parallel half nothing is reflected, of the perpendicular half ((n²−1)/(n²+1))².
        let cos = 1.0 / (1.0f32 + 2.25).sqrt();
        let b = boundary(vector(1.5 * cos, -cos, 0.0), vector(0.0, 1.0, 0.0), 1.0 / 1.5);
        let across = (1.25f32 / 3.25).powi(2);
        assert!((b.reflectance - across / 2.0).abs() < 1e-6);
    }

    #[test]
    fn boundary_reflects_everything_beyond_the_critical_angle() {
        // sin θ = 0.7 > 1 / 1.5.
        let d = vector(0.7, -(1.0f32 - 0.49).sqrt(), 0.0);
        assert_eq!(boundary(d, vector(0.0, 1.0, 0.0), 1.5).reflectance, 1.0);
        let below = vector(0.6, -0.8, 0.0);
        assert!(boundary(below, vector(0.0, 1.0, 0.0), 1.5).reflectance < 0.5);
    }

    #[test]
    fn reflect_keeps_the_angle() {
        let r = reflect(vector(0.6, -0.8, 0.0), vector(0.0, 1.0, 0.0));
        assert_eq!((r.x, r.y, r.z), (0.6, 0.8, 0.0));
    }

    proptest! {
        #[test]
        fn boundary_obeys_snells_law_and_is_reversible(
            x in -0.99f32..0.99, z in -0.1f32..0.1, ior in 1.01f32..2.5
        ) {
            let d = Vec3::new(x, -1.0, z).normalize();
            let n = vector(0.0, 1.0, 0.0);
            let eta = 1.0 / ior;
            let b = boundary(vector(d.x, d.y, d.z), n, eta);
            let (sin_i, sin_t) = ((d.x * d.x + d.z * d.z).sqrt(), (b.refracted.x.powi(2) + b.refracted.z.powi(2)).sqrt());
            prop_assert!((sin_t * ior - sin_i).abs() < 1e-5);
            let back = boundary(-b.refracted, -n, ior);
            prop_assert!((back.reflectance - b.reflectance).abs() < 1e-4);
            prop_assert!((back.refracted.x + d.x).abs() < 1e-4);
        }
    }
}
