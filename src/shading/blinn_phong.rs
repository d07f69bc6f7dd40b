//! The Blinn-Phong model of diffuse and specular reflection.

use crate::math::elementary::pow;
use crate::math::{Color, Vector};
use crate::simd::{Float, Mask};

/// Parameters of the model at a point.
#[derive(Clone, Copy)]
pub struct BlinnPhongParams<F: Float> {
    /// The diffuse colour kd.
    pub diffuse: Color<F>,
    /// The specular colour ks.
    pub specular: Color<F>,
    /// Exponent of the specular lobe.
    pub shininess: F,
    /// Set if the lobe is about the mirror direction (Phong), not the half vector (Blinn).
    pub phong: F::Mask,
}

impl<F: Float> BlinnPhongParams<F> {
    /// The radiance for a unit of irradiance (measured perpendicular to the light's direction): `diffuse · max(n·l, 0)
    /// + specular · lobe`. `to_viewer` and `to_light` are unit vectors.
    #[inline(always)]
    pub fn evaluate(&self, normal: Vector<F>, to_viewer: Vector<F>, to_light: Vector<F>) -> Color<F> {
        let zero = F::zero();
        let cos = normal.dot(to_light).max(zero);
        let diffuse = self.diffuse * cos;
        let emits = self.specular.max_component().gt(zero);
        if !emits.any() {
            return diffuse;
        }
        let half = to_light + to_viewer;
        let half_length = half.dot(half).max(F::splat(1e-30)).sqrt();
        let blinn = normal.dot(half) / half_length;
        // r·l, where r is the mirror image of the viewer's direction.
        let phong = F::splat(2.0) * normal.dot(to_viewer) * normal.dot(to_light) - to_viewer.dot(to_light);
        let cosine = F::select(self.phong, phong, blinn).clamp(0.0, 1.0);
        let lobe = F::select(emits, pow(cosine, self.shininess), zero);
        diffuse + self.specular * lobe
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;

    fn model(phong: bool) -> BlinnPhongParams<f32> {
        BlinnPhongParams {
            diffuse: Color::splat(Rgb::new(0.5, 0.25, 0.0)),
            specular: Color::splat(Rgb::splat(0.3)),
            shininess: 10.0,
            phong,
        }
    }

    fn vector(x: f32, y: f32, z: f32) -> Vector<f32> {
        Vector { x, y, z }
    }

    #[test]
    fn both_terms_are_at_their_maximum_at_normal_incidence() {
        let up = vector(0.0, 0.0, 1.0);
        let c = model(false).evaluate(up, up, up);
        assert!((c.r - 0.8).abs() < 1e-6 && (c.g - 0.55).abs() < 1e-6 && (c.b - 0.3).abs() < 1e-6);
    }

    #[test]
    fn lobes_follow_blinn_and_phong() {
        // Viewer straight above, light at 60°: cos = ½, half vector at 30°, mirror direction at 60° from the light.
        let (n, v) = (vector(0.0, 0.0, 1.0), vector(0.0, 0.0, 1.0));
        let l = vector(0.75f32.sqrt(), 0.0, 0.5);
        let blinn = model(false).evaluate(n, v, l);
        assert!((blinn.r - (0.25 + 0.3 * 0.75f32.powi(5))).abs() < 1e-5, "cos¹⁰ 30° = 0.75⁵");
        let phong = model(true).evaluate(n, v, l);
        assert!((phong.r - (0.25 + 0.3 * 0.5f32.powi(10))).abs() < 1e-5, "cos¹⁰ 60° = 2⁻¹⁰");
    }
}
