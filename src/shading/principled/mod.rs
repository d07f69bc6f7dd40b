//! Lobes of physically based surfaces: their parameters at a shading point.

pub mod albedo;
pub mod anisotropic;
pub mod anisotropic_glass;
mod body;
pub mod bsdf;
mod coat;
pub mod dispersion;
pub mod ggx;
pub mod glass;
pub mod measure;
pub mod parameters;
pub mod reflectance;
pub mod sample;
pub mod shading_frame;
pub mod sheen;
#[cfg(test)]
mod sweep;
pub mod tables;
#[cfg(test)]
mod tests;
pub mod thin_film;

use std::f32::consts::LOG2_E;

use super::ShadingPoint;
use super::texture_lookup::{color, scalar, texel};
use crate::math::elementary::exp2;
use crate::math::{Color, NONE};
use crate::simd::Float;
use dispersion::Spectrum;
use ggx::Ggx;
use parameters::{Coat, LobeFlags, Outside, Parameters, SheenParams};
use shading_frame::ShadingFrame;
use thin_film::ThinFilm;

/// The least α: a narrower distribution is a spike that floats cannot represent.
const NARROWEST: f32 = 1e-4;
/// Index of refraction of the clear coat (KHR_materials_clearcoat).
const COAT_IOR: f32 = 1.5;

impl<F: Float> ShadingPoint<'_, F> {
    /// Looks up the parameters of the lobes that the material has.
    #[inline(always)]
    pub fn parameters(&self, has: LobeFlags, outside: &Outside<F>) -> Parameters<F> {
        self.parameters_in(has, outside, self.frames())
    }

    /// Looks up the parameters in given shading frames of the base and of the layers above it.
    #[inline(always)]
    pub fn parameters_in(
        &self,
        has: LobeFlags,
        outside: &Outside<F>,
        (frame, vertex_frame): (ShadingFrame<F>, ShadingFrame<F>),
    ) -> Parameters<F> {
        let (m, textures) = (self.material, self.tables.textures);
        let (one, zero) = (F::one(), F::zero());
        let base = self.base_color();
        let mut p = Parameters {
            frame,
            geometric_normal: self.surface.geometric_normal,
            diffuse: base,
            diffuse_transmission: Color::black(),
            f0: Color::black(),
            f90: Color::black(),
            metal: base,
            edge: Color::black(),
            metallic: zero,
            ggx: Ggx { x: one, y: one },
            roughness: one,
            transmission: Color::black(),
            eta: one,
            inside: self.surface.inside,
            spectrum: Spectrum::none(),
            coat: Coat {
                weight: zero,
                roughness: zero,
                frame: vertex_frame,
                f0: self.coat_f0(outside),
                f90: Color::splat(m.coat_f90.into()),
            },
            sheen: SheenParams { color: Color::black(), roughness: zero },
            film: ThinFilm { weight: zero, thickness: zero, ior: one },
        };
        if has.specular || has.transmission {
            self.mirror(&mut p, base, outside);
        }
        if has.edge {
            p.edge = reflectance::edge(base, Color::splat(m.edge_tint.into()));
        }
        // The fraction of light that neither falls on metal nor is transmitted by microfacets.
        let mut scattered = one - p.metallic;
        if has.transmission {
            let part = scalar(&m.transmission, textures, &self.at, self.mask).clamp(0.0, 1.0);
            scattered = scattered * (one - part);
            p.transmission = base * (part * (one - p.metallic));
            p.diffuse = p.diffuse * (one - part);
            p.eta = outside.eta(m, self.surface.inside);
        }
        if has.diffuse_transmission {
            let part = scalar(&m.diffuse_transmission, textures, &self.at, self.mask).clamp(0.0, 1.0);
            let tint = color(&m.diffuse_transmission_color, textures, &self.at, self.mask);
            p.diffuse_transmission = tint * (scattered * part);
            p.diffuse = p.diffuse * (one - part);
        }
        if m.sheet_depth != [0.0; 3] {
            self.weaken_by_sheet(&mut p);
        }
        if has.coat {
            p.coat.weight = scalar(&m.coat, textures, &self.at, self.mask).clamp(0.0, 1.0);
            p.coat.roughness = scalar(&m.coat_roughness, textures, &self.at, self.mask).clamp(0.0, 1.0);
        }
        if has.sheen {
            p.sheen.color = color(&m.sheen_color, textures, &self.at, self.mask);
            p.sheen.roughness = scalar(&m.sheen_roughness, textures, &self.at, self.mask);
        }
        if has.film
            && let Some(film) = &m.film
        {
            let thickness = scalar(&film.thickness, textures, &self.at, self.mask);
            p.film = ThinFilm {
                weight: scalar(&film.factor, textures, &self.at, self.mask).clamp(0.0, 1.0),
                thickness: F::splat(film.thinnest) + thickness * F::splat(film.thickest - film.thinnest),
                ior: F::splat(film.ior),
            };
        }
        p
    }

    /// The lobes of the material.
    #[inline(always)]
    pub fn has(&self) -> LobeFlags {
        let m = self.material;
        let transmission = !m.transmission.is_zero();
        LobeFlags {
            diffuse: !m.transmission.is_one() && !(m.metallic.is_one()),
            specular: m.has_mirror(),
            anisotropic: m.is_anisotropic(),
            metallic: !m.metallic.is_zero(),
            edge: !m.metallic.is_zero() && m.edge_tint != [1.0; 3],
            constant_fresnel: m.constant_fresnel,
            transmission,
            solid: m.refracts(),
            dispersion: m.dispersion > 0.0,
            diffuse_transmission: !m.diffuse_transmission.is_zero(),
            coat: !m.coat.is_zero(),
            sheen: !m.sheen_color.is_black(),
            film: m.film.is_some(),
        }
    }

    /// Applies the absorption of a thin sheet along the refracted path through it (Beer and Lambert).
    #[inline(always)]
    fn weaken_by_sheet(&self, p: &mut Parameters<F>) {
        let one = F::one();
        let cos = p.frame.z.dot(self.to_viewer);
        // The direction within the sheet, by Snell's law.
        let ratio = F::splat(1.0 / self.material.ior.max(1.0));
        let sin_square = (one - cos * cos).max(F::zero()) * ratio * ratio;
        let way = one / (one - sin_square).max(F::splat(0.01)).sqrt();
        let [r, g, b] = self.material.sheet_depth;
        let left = Color::new(
            exp2(way * F::splat(-r * LOG2_E)),
            exp2(way * F::splat(-g * LOG2_E)),
            exp2(way * F::splat(-b * LOG2_E)),
        );
        p.transmission = p.transmission * left;
        p.diffuse_transmission = p.diffuse_transmission * left;
    }

    /// Looks up reflectance and roughness of the mirror lobe, and attenuates the diffuse one by the metal.
    #[inline(always)]
    fn mirror(&self, p: &mut Parameters<F>, base: Color<F>, outside: &Outside<F>) {
        let (m, textures, one) = (self.material, self.tables.textures, F::one());
        let metallic = scalar(&m.metallic, textures, &self.at, self.mask).clamp(0.0, 1.0);
        let rough = scalar(&m.roughness, textures, &self.at, self.mask).clamp(0.0, 1.0);
        let strength = scalar(&m.specular, textures, &self.at, self.mask);
        let tint = color(&m.specular_color, textures, &self.at, self.mask) * self.f0(outside);
        let straight = tint.clamp(0.0, 1.0) * strength;
        p.metallic = metallic;
        p.f0 = straight;
        p.f90 = Color::grey(strength);
        p.diffuse = base * (one - metallic);
        let alpha = rough * rough;
        p.ggx = Ggx { x: alpha, y: alpha };
        p.roughness = rough;
        if m.anisotropy > 0.0 {
            self.stretch(p, alpha);
        }
        let limit = F::splat(NARROWEST);
        p.ggx = Ggx { x: p.ggx.x.max(limit), y: p.ggx.y.max(limit) };
    }

    /// The dielectric's reflectance at normal incidence, without strength and colour.
    #[inline(always)]
    fn f0(&self, outside: &Outside<F>) -> F {
        let m = self.material;
        if m.constant_fresnel { F::splat(m.f0) } else { outside.reflectance(m.ior, m.f0) }
    }

    /// The clear coat's reflectance at normal incidence.
    #[inline(always)]
    fn coat_f0(&self, outside: &Outside<F>) -> Color<F> {
        let m = self.material;
        if m.constant_fresnel || outside.is_air {
            return Color::splat(m.coat_f0.into());
        }
        Color::grey(outside.reflectance(COAT_IOR, m.coat_f0[0]))
    }

    /// Stretches the microfacets along one direction (KHR_materials_anisotropy).
    #[inline(always)]
    fn stretch(&self, p: &mut Parameters<F>, alpha: F) {
        let (m, textures, one) = (self.material, self.tables.textures, F::one());
        let mut strength = F::splat(m.anisotropy);
        let [cos, sin] = m.anisotropy_direction.map(F::splat);
        let (mut x, mut y) = (cos, sin);
        if m.anisotropy_texture != NONE {
            let sampled = &textures.sampled[m.anisotropy_texture as usize];
            let texel = texel(textures, sampled, &self.at, self.mask).color;
            let two = F::splat(2.0);
            let (a, b) = (texel.r * two - one, texel.g * two - one);
            let square = a * a + b * b;
            let long = square.gt(F::splat(1e-6));
            let scale = one / F::select(long, square, one).sqrt();
            let (a, b) = (F::select(long, a * scale, one), F::select(long, b * scale, F::zero()));
            (x, y) = (cos * a - sin * b, sin * a + cos * b);
            strength = strength * texel.b;
        }
        let frame = p.frame;
        p.frame.x = frame.x * x + frame.y * y;
        p.frame.y = frame.z.cross(p.frame.x);
        let longer = alpha + (one - alpha) * (strength * strength);
        p.ggx = Ggx { x: longer, y: alpha };
        p.roughness = (longer * alpha.max(F::splat(NARROWEST))).sqrt().sqrt();
    }
}
