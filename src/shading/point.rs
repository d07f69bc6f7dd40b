//! One material at many hits: what its record says there, the same for both transports.

use super::details::{LEAST_COSINE, alpha, bend, coordinates, normal_in, tangent_frame, vertex_color};
use super::footprint::Footprint;
use super::principled::basis::Basis;
use super::sampled::{Coordinates, color, scalar, texel};
use super::surface::{HitLanes, Surface};
use crate::math::{Color, Vector};
use crate::scene::material::{ColorParam, Coverage, Material, NormalParam};
use crate::scene::{CompiledScene, Geometry, Textures};
use crate::simd::Float;

/// What materials are looked up in.
#[derive(Clone, Copy)]
pub struct Tables<'a> {
    /// By primitive id.
    pub geometry: &'a Geometry,
    /// By texture id.
    pub textures: &'a Textures,
}

/// One material at many hits.
pub struct ShadingPoint<'a, F: Float> {
    /// Where to look things up.
    pub tables: Tables<'a>,
    /// How light is answered.
    pub material: &'a Material,
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

impl<'a, F: Float> ShadingPoint<'a, F> {
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
            material: &scene.materials[material as usize],
            hit,
            surface,
            at: if scene.materials[material as usize].textured {
                coordinates(&scene.geometry, hit, surface, direction, width, mask)
            } else {
                Coordinates { uv: [surface.uv; 2], footprint: [Footprint::point(); 2] }
            },
            to_viewer: -direction,
            mask,
        }
    }

    /// One of the material's colours.
    #[inline(always)]
    pub(super) fn color(&self, param: &ColorParam) -> Color<F> {
        color(param, self.tables.textures, &self.at, self.mask)
    }

    /// Radiance that it gives off.
    #[inline(always)]
    pub fn emission(&self) -> Color<F> {
        let m = self.material;
        let light = self.color(&m.emission);
        if m.one_sided_emission {
            return Color::select(self.surface.inside, Color::black(), light);
        }
        light
    }

    /// Base colour with that of the vertices.
    #[inline(always)]
    pub fn base_color(&self) -> Color<F> {
        self.color(&self.material.base_color) * vertex_color(self.surface)
    }

    /// Unit normal for shading, on the viewer's side.
    #[inline(always)]
    pub fn normal(&self) -> Vector<F> {
        self.frames().0.z
    }

    /// The frame for the base, and that for what lies above it.
    #[inline(always)]
    pub(super) fn frames(&self) -> (Basis<F>, Basis<F>) {
        let m = self.material;
        if !m.needs_tangents() {
            let up = Vector::new(F::zero(), F::zero(), F::one());
            let frame = bend(&Basis::about(self.surface.normal), self.surface, up, self.to_viewer);
            return (frame, frame);
        }
        let plain = tangent_frame(self.tables.geometry, self.hit, self.surface, self.mask);
        let base = self.bent(&plain, m.normal);
        let above = if m.coat.is_zero() { plain } else { self.bent(&plain, m.coat_normal) };
        (base, above)
    }

    /// Where the base's normal looks away from the viewer, and so has been turned.
    #[inline(always)]
    pub fn is_turned(&self) -> F::Mask {
        let m = self.material;
        let frame = if m.needs_tangents() {
            tangent_frame(self.tables.geometry, self.hit, self.surface, self.mask)
        } else {
            Basis::about(self.surface.normal)
        };
        normal_in(&frame, self.mapped(m.normal)).dot(self.to_viewer).lt(F::splat(LEAST_COSINE))
    }

    #[inline(always)]
    fn bent(&self, frame: &Basis<F>, map: Option<NormalParam>) -> Basis<F> {
        bend(frame, self.surface, self.mapped(map), self.to_viewer)
    }

    /// The normal in tangent space.
    #[inline(always)]
    fn mapped(&self, map: Option<NormalParam>) -> Vector<F> {
        let Some(map) = map else {
            return Vector::new(F::zero(), F::zero(), F::one());
        };
        let textures = self.tables.textures;
        let texel = texel(textures, &textures.sampled[map.texture as usize], &self.at, self.mask).color;
        let (two, one, scale) = (F::splat(2.0), F::one(), F::splat(map.scale));
        Vector::new((texel.r * two - one) * scale, (texel.g * two - one) * scale, texel.b * two - one)
    }
}

/// How much of a material is there, 0 to 1, at points of what has been hit: all that there is to say of
/// it, since sides are told apart before anybody asks ([`Material::presence`]).
#[inline(always)]
pub fn coverage<F: Float>(
    material: &Material,
    tables: Tables,
    hit: &HitLanes<F>,
    at: &Coordinates<F>,
    mask: F::Mask,
) -> F {
    if material.coverage == Coverage::Whole {
        return F::one();
    }
    let alpha = scalar(&material.alpha, tables.textures, at, mask) * alpha(tables.geometry, hit, mask);
    match material.coverage {
        Coverage::Mask(cutoff) => F::select(alpha.ge(F::splat(cutoff)), F::one(), F::zero()),
        _ => alpha.clamp(0.0, 1.0),
    }
}
