//! One material at many hits: its parameters there, for both transports.

use super::normals::{bend, for_mirrors, is_turned, mirrors_what_is_below, normal_in};
use super::principled::shading_frame::ShadingFrame;
use super::surface::{HitLanes, Surface};
use super::texture_coordinates::{coordinates, tangent_frame};
use super::texture_lookup::{Coordinates, color, scalar, texel};
use super::vertices::alpha;
use crate::math::{Color, Vector};
use crate::scene::material::{ColorParam, Coverage, MaterialRecord, NormalParam};
use crate::scene::{CompiledScene, Geometry, Textures};
use crate::simd::{Float, Mask};

/// The tables from which material parameters are looked up.
#[derive(Clone, Copy)]
pub struct Tables<'a> {
    /// Geometry, by primitive id.
    pub geometry: &'a Geometry,
    /// Textures, by texture id.
    pub textures: &'a Textures,
}

/// The layer that a normal is for.
#[derive(Clone, Copy, PartialEq)]
enum NormalLayer {
    Base,
    Coat,
}

/// One material at many hits.
pub struct ShadingPoint<'a, F: Float> {
    /// The tables for lookups.
    pub tables: Tables<'a>,
    /// The material.
    pub material: &'a MaterialRecord,
    /// The hits.
    pub hit: &'a HitLanes<F>,
    /// The surfaces at the hits.
    pub surface: &'a Surface<F>,
    /// Coordinates and footprints for texture lookups.
    pub at: Coordinates<F>,
    /// The unit vector to the ray's origin.
    pub to_viewer: Vector<F>,
    /// The active lanes.
    pub mask: F::Mask,
}

impl<'a, F: Float> ShadingPoint<'a, F> {
    /// The points at which rays along `direction`, `width` metres wide there, hit a material.
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
                Coordinates::point([surface.uv; 2])
            },
            to_viewer: -direction,
            mask,
        }
    }

    /// Looks up a colour parameter of the material.
    #[inline(always)]
    pub(super) fn color(&self, param: &ColorParam) -> Color<F> {
        color(param, self.tables.textures, &self.at, self.mask)
    }

    /// The emitted radiance.
    #[inline(always)]
    pub fn emission(&self) -> Color<F> {
        let m = self.material;
        let light = self.color(&m.emission);
        if m.one_sided_emission {
            return Color::select(self.surface.inside, Color::black(), light);
        }
        light
    }

    /// Base colour times vertex colour.
    #[inline(always)]
    pub fn base_color(&self) -> Color<F> {
        self.tinted(&self.material.base_color)
    }

    /// Looks up a colour parameter on which vertex colours are a factor.
    #[inline(always)]
    pub(super) fn tinted(&self, param: &ColorParam) -> Color<F> {
        let color = self.color(param);
        if !self.material.vertices_are_factors {
            return color;
        }
        let Vector { x, y, z } = self.surface.color;
        color * Color::new(x, y, z)
    }

    /// Unit shading normal of the base layer, on the viewer's side.
    #[inline(always)]
    pub fn normal(&self) -> Vector<F> {
        self.frames().0.z
    }

    /// The shading frames of the base and of the layers above it.
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

    /// Set if the base's normal is turned, or would be if the base were a mirror.
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

    /// A layer's normal after normal and bump maps.
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

    /// The fraction of a layer that is metal or transmits light, where nothing but a mirror image is visible. Other
    /// surfaces have diffuse light below a weak mirror, which keeps the relief of normal maps.
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

    /// The normal of a normal map, in tangent space.
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

/// The coverage of a material at hits, 0 to 1. The side is ignored, because sides are checked before
/// ([`MaterialRecord::sidedness`]).
#[inline(always)]
pub fn coverage<F: Float>(
    material: &MaterialRecord,
    tables: Tables,
    hit: &HitLanes<F>,
    at: &Coordinates<F>,
    mask: F::Mask,
) -> F {
    if material.coverage == Coverage::Whole {
        return F::one();
    }
    let mut there = scalar(&material.alpha, tables.textures, at, mask);
    if material.vertices_are_factors {
        there = there * alpha(tables.geometry, hit, mask);
    }
    match material.coverage {
        Coverage::Mask(cutoff) => F::select(there.ge(F::splat(cutoff)), F::one(), F::zero()),
        _ => there.clamp(0.0, 1.0),
    }
}
