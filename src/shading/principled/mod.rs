//! From a material's record and a hit to the parameters of its lobes there.

pub mod albedo;
pub mod bsdf;
pub mod dispersion;
pub mod draw;
pub mod film;
pub mod frame;
pub mod ggx;
pub mod glass;
pub mod parameters;
pub mod reflectance;
pub mod sheen;
#[cfg(test)]
mod tests;

use super::details::{alpha, bend, coordinates, tangent_frame, vertex_color};
use super::sampled::{Coordinates, color, scalar, texel};
use super::surface::{HitLanes, Surface};
use crate::math::{Color, NONE, Vector};
use crate::scene::principled::{Coverage, NormalParam, Principled};
use crate::scene::{CompiledScene, Geometry, Textures};
use crate::simd::Float;
use dispersion::Spectrum;
use film::Film;
use frame::Frame;
use ggx::Ggx;
use parameters::{Coat, Has, Parameters, Sheen};

/// Narrower than this the distribution is a spike that floats cannot hold.
const NARROWEST: f32 = 1e-4;

/// What materials are looked up in.
#[derive(Clone, Copy)]
pub struct Tables<'a> {
    /// By primitive id.
    pub geometry: &'a Geometry,
    /// By texture id.
    pub textures: &'a Textures,
}

/// One material at many hits.
pub struct Spot<'a, F: Float> {
    /// Where to look things up.
    pub tables: Tables<'a>,
    /// How light is answered.
    pub material: &'a Principled,
    /// What was hit.
    pub hit: &'a HitLanes<F>,
    /// The same as points.
    pub surface: &'a Surface<F>,
    /// Where textures are looked up.
    pub at: Coordinates<F>,
    /// To where the ray came from.
    pub to_viewer: Vector<F>,
    /// Lanes that count.
    pub mask: F::Mask,
}

impl<'a, F: Float> Spot<'a, F> {
    /// Where rays along `direction` that are `width` metres wide there have hit a material.
    #[inline(always)]
    pub fn new(
        scene: &'a CompiledScene,
        material: u32,
        hit: &'a HitLanes<F>,
        surface: &'a Surface<F>,
        direction: Vector<F>,
        width: F,
        mask: F::Mask,
    ) -> Self {
        Self {
            tables: Tables { geometry: &scene.geometry, textures: &scene.textures },
            material: &scene.principled[material as usize],
            hit,
            surface,
            at: coordinates(&scene.geometry, hit, surface, direction, width, mask),
            to_viewer: -direction,
            mask,
        }
    }

    /// How much of the surface is there, 0 to 1.
    #[inline(always)]
    pub fn coverage(&self) -> F {
        let (zero, one) = (F::zero(), F::one());
        let m = self.material;
        let there = if m.hides_back { F::select(self.surface.inside, zero, one) } else { one };
        if m.coverage == Coverage::Whole {
            return there;
        }
        let alpha = scalar(&m.alpha, self.tables.textures, &self.at, self.mask)
            * alpha(self.tables.geometry, self.hit, self.mask);
        let covered = match m.coverage {
            Coverage::Mask(cutoff) => F::select(alpha.ge(F::splat(cutoff)), one, zero),
            _ => alpha.clamp(0.0, 1.0),
        };
        there * covered
    }

    /// Radiance that it gives off.
    #[inline(always)]
    pub fn emission(&self) -> Color<F> {
        let m = self.material;
        let light = color(&m.emission, self.tables.textures, &self.at, self.mask);
        if m.one_sided_emission {
            return Color::select(self.surface.inside, Color::black(), light);
        }
        light
    }

    /// Base colour with that of the vertices.
    #[inline(always)]
    pub fn base_color(&self) -> Color<F> {
        color(&self.material.base_color, self.tables.textures, &self.at, self.mask)
            * vertex_color(self.surface)
    }

    /// Unit normal for shading, on the viewer's side.
    #[inline(always)]
    pub fn normal(&self) -> Vector<F> {
        self.frames().0.z
    }

    /// Which lobes there are, and their parameters.
    #[inline(always)]
    pub fn parameters(&self) -> (Has, Parameters<F>) {
        let (m, textures) = (self.material, self.tables.textures);
        let (one, zero) = (F::one(), F::zero());
        let base = self.base_color();
        let (frame, vertex_frame) = self.frames();
        let has = self.has();
        let mut p = Parameters {
            frame,
            geometric_normal: self.surface.geometric_normal,
            diffuse: base,
            back: Color::black(),
            f0: Color::black(),
            f90: Color::black(),
            metal: base,
            metallic: zero,
            ggx: Ggx { x: one, y: one },
            roughness: one,
            through: Color::black(),
            eta: one,
            spectrum: Spectrum::none(),
            coat: Coat {
                weight: zero,
                roughness: zero,
                frame: vertex_frame,
                f0: Color::splat(m.coat_f0.into()),
                f90: Color::splat(m.coat_f90.into()),
            },
            sheen: Sheen { color: Color::black(), roughness: zero },
            film: Film { weight: zero, thickness: zero, ior: one },
        };
        if has.specular || has.transmission {
            self.mirror(&mut p, base);
        }
        if has.transmission {
            let part = scalar(&m.transmission, textures, &self.at, self.mask).clamp(0.0, 1.0);
            p.through = base * (part * (one - p.metallic));
            p.diffuse = p.diffuse * (one - part);
            let inside = F::splat(m.ior);
            p.eta = F::select(self.surface.inside, inside, one / inside);
        }
        if has.back {
            let part = scalar(&m.diffuse_transmission, textures, &self.at, self.mask).clamp(0.0, 1.0);
            let tint = color(&m.diffuse_transmission_color, textures, &self.at, self.mask);
            p.back = tint * ((one - p.metallic) * part);
            p.diffuse = p.diffuse * (one - part);
        }
        if has.coat {
            p.coat.weight = scalar(&m.coat, textures, &self.at, self.mask).clamp(0.0, 1.0);
            p.coat.roughness = scalar(&m.coat_roughness, textures, &self.at, self.mask).clamp(0.0, 1.0);
        }
        if has.sheen {
            p.sheen.color = color(&m.sheen_color, textures, &self.at, self.mask);
            p.sheen.roughness = scalar(&m.sheen_roughness, textures, &self.at, self.mask);
        }
        if let Some(film) = &m.film {
            let thickness = scalar(&film.thickness, textures, &self.at, self.mask);
            p.film = Film {
                weight: scalar(&film.factor, textures, &self.at, self.mask).clamp(0.0, 1.0),
                thickness: F::splat(film.thinnest) + thickness * F::splat(film.thickest - film.thinnest),
                ior: F::splat(film.ior),
            };
        }
        (has, p)
    }

    #[inline(always)]
    fn has(&self) -> Has {
        let m = self.material;
        let transmission = !m.transmission.is_zero();
        Has {
            diffuse: !m.transmission.is_one() && !(m.metallic.is_one()),
            specular: m.is_specular() || transmission || m.film.is_some(),
            metallic: !m.metallic.is_zero(),
            constant_fresnel: m.constant_fresnel,
            transmission,
            solid: transmission && !m.thin,
            dispersion: m.dispersion > 0.0,
            back: !m.diffuse_transmission.is_zero(),
            coat: !m.coat.is_zero(),
            sheen: !m.sheen_color.is_black(),
            film: m.film.is_some(),
        }
    }

    /// The frame for the base, and that for what lies above it.
    #[inline(always)]
    fn frames(&self) -> (Frame<F>, Frame<F>) {
        let m = self.material;
        if !m.needs_tangents() {
            let up = Vector::new(F::zero(), F::zero(), F::one());
            let frame = bend(&Frame::about(self.surface.normal), self.surface, up, self.to_viewer);
            return (frame, frame);
        }
        let plain = tangent_frame(self.tables.geometry, self.hit, self.surface, self.mask);
        let base = self.bent(&plain, m.normal);
        let above = if m.coat.is_zero() { plain } else { self.bent(&plain, m.coat_normal) };
        (base, above)
    }

    #[inline(always)]
    fn bent(&self, frame: &Frame<F>, map: Option<NormalParam>) -> Frame<F> {
        let Some(map) = map else {
            let up = Vector::new(F::zero(), F::zero(), F::one());
            return bend(frame, self.surface, up, self.to_viewer);
        };
        let textures = self.tables.textures;
        let texel = texel(textures, &textures.sampled[map.texture as usize], &self.at, self.mask).color;
        let (two, one, scale) = (F::splat(2.0), F::one(), F::splat(map.scale));
        let n =
            Vector::new((texel.r * two - one) * scale, (texel.g * two - one) * scale, texel.b * two - one);
        bend(frame, self.surface, n, self.to_viewer)
    }

    /// Reflectance and roughness of the mirror lobe, and what it leaves to the diffuse one.
    #[inline(always)]
    fn mirror(&self, p: &mut Parameters<F>, base: Color<F>) {
        let (m, textures, one) = (self.material, self.tables.textures, F::one());
        let metallic = scalar(&m.metallic, textures, &self.at, self.mask).clamp(0.0, 1.0);
        let rough = scalar(&m.roughness, textures, &self.at, self.mask).clamp(0.0, 1.0);
        let strength = scalar(&m.specular, textures, &self.at, self.mask);
        let tint = color(&m.specular_color, textures, &self.at, self.mask) * F::splat(m.f0);
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

    /// Microfacets longer one way (KHR_materials_anisotropy).
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
