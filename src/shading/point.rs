//! One material at many hits: what its record says there, the same for both transports.

use super::footprint::Footprint;
use super::normals::{bend, for_mirrors, is_turned, mirrors_what_is_below, normal_in};
use super::principled::shading_frame::ShadingFrame;
use super::surface::{HitLanes, Surface};
use super::texture_coordinates::{alpha, coordinates, tangent_frame, vertex_color};
use super::texture_lookup::{Coordinates, color, scalar, texel};
use crate::math::{Color, Vector};
use crate::scene::material::{ColorParam, Coverage, Material, NormalParam};
use crate::scene::{CompiledScene, Geometry, Textures};
use crate::simd::{Float, Mask};

/// What materials are looked up in.
#[derive(Clone, Copy)]
pub struct Tables<'a> {
    /// By primitive id.
    pub geometry: &'a Geometry,
    /// By texture id.
    pub textures: &'a Textures,
}

/// What a normal is asked for.
#[derive(Clone, Copy, PartialEq)]
enum NormalLayer {
    Base,
    Coat,
}

/// One material at many hits.
pub struct ShadingPoint<'a, F: Float> {
    /// Where to look things up.
    pub tables: Tables<'a>,
    /// How it reflects light.
    pub material: &'a Material,
    /// What was hit.
    pub hit: &'a HitLanes<F>,
    /// The same as points.
    pub surface: &'a Surface<F>,
    /// Where textures are looked up.
    pub at: Coordinates<F>,
    /// The direction that the ray came from.
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

    /// The radiance that it emits.
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
    pub(super) fn frames(&self) -> (ShadingFrame<F>, ShadingFrame<F>) {
        let m = self.material;
        if !m.needs_tangents() {
            let plain = ShadingFrame::about(self.surface.normal);
            let base = self.bent(&plain, None, NormalLayer::Base);
            let above = if m.coat.is_zero() { base } else { self.bent(&plain, None, NormalLayer::Coat) };
            return (base, above);
        }
        let plain = tangent_frame(self.tables.geometry, self.hit, self.surface, self.mask);
        let base = self.bent(&plain, m.normal, NormalLayer::Base);
        let above =
            if m.coat.is_zero() { plain } else { self.bent(&plain, m.coat_normal, NormalLayer::Coat) };
        (base, above)
    }

    /// Where the base's normal is turned, or would be if it were that of a mirror.
    #[inline(always)]
    pub fn is_turned(&self) -> F::Mask {
        let m = self.material;
        let frame = if m.needs_tangents() {
            tangent_frame(self.tables.geometry, self.hit, self.surface, self.mask)
        } else {
            ShadingFrame::about(self.surface.normal)
        };
        let normal = self.seen_in(&frame, m.normal, NormalLayer::Base);
        is_turned(normal, self.surface.geometric_normal, self.to_viewer)
    }

    /// A layer's normal, with the effect of maps.
    #[inline(always)]
    fn seen_in(&self, frame: &ShadingFrame<F>, map: Option<NormalParam>, layer: NormalLayer) -> Vector<F> {
        let normal = normal_in(frame, self.mapped(map));
        match &self.material.bump {
            Some(bump) if layer == NormalLayer::Base => self.risen(normal, bump),
            _ => normal,
        }
    }

    #[inline(always)]
    fn bent(&self, frame: &ShadingFrame<F>, map: Option<NormalParam>, layer: NormalLayer) -> ShadingFrame<F> {
        let geometric = self.surface.geometric_normal;
        let mut normal = self.seen_in(frame, map, layer);
        if self.material.has_mirror() || layer == NormalLayer::Coat {
            let below = self.mask & mirrors_what_is_below(normal, geometric, self.to_viewer);
            if below.any() {
                normal = for_mirrors(normal, geometric, self.to_viewer, self.mirror_part(layer), below);
            }
        }
        bend(frame, geometric, normal, self.to_viewer)
    }

    /// How much of a layer is metal, or lets light through: where it has a mirror's image or nothing. Below the
    /// weak mirrors of all else there is diffuse light, which keeps the relief that normal maps give it.
    #[inline(always)]
    fn mirror_part(&self, layer: NormalLayer) -> F {
        if layer == NormalLayer::Coat {
            return F::one();
        }
        let (m, textures) = (self.material, self.tables.textures);
        let metallic = scalar(&m.metallic, textures, &self.at, self.mask).clamp(0.0, 1.0);
        let clear = scalar(&m.transmission, textures, &self.at, self.mask).clamp(0.0, 1.0);
        metallic + clear * (F::one() - metallic)
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

/// The coverage of a material, 0 to 1, at the points of hits. Nothing else matters here, because sides are told apart
/// before this is asked ([`Material::sidedness`]).
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
