//! Surfaces for Whitted's transport: the parameters of the classic model after texture lookups.

use super::blinn_phong::BlinnPhongParams;
use super::boundary::BodyPair;
use super::emitter::lane;
use super::point::ShadingPoint;
use super::surface::{HitLanes, Surface};
use crate::math::{Color, Vector};
use crate::scene::CompiledScene;
use crate::simd::{Float, Int, Mask};

/// The surface parameters at hits; lanes may have different materials.
#[derive(Clone, Copy)]
pub struct Shaded<F: Float> {
    /// Local reflection model.
    pub model: BlinnPhongParams<F>,
    /// Weight of the mirror reflection.
    pub kr: Color<F>,
    /// Weight of the refraction.
    pub kt: Color<F>,
    /// Index of refraction; 0 if light does not enter.
    pub ior: F,
    /// The bodies on both sides of the surface.
    pub between: BodyPair<F>,
    /// Radiance emitted to the viewer.
    pub emission: Color<F>,
    /// Unit shading normal with normal and bump maps, on the viewer's side.
    pub normal: Vector<F>,
}

impl<F: Float> Shaded<F> {
    /// Looks up surfaces hit by rays along `direction` that are `width` metres wide there: one material at a time,
    /// because neighbouring rays mostly hit the same one.
    #[inline(always)]
    pub fn new(
        scene: &CompiledScene,
        hit: &HitLanes<F>,
        surface: &Surface<F>,
        direction: Vector<F>,
        width: F,
        mask: F::Mask,
    ) -> Self {
        let (zero, black) = (F::zero(), Color::black());
        let nothing = F::Mask::from_bits(0);
        let model = BlinnPhongParams { diffuse: black, specular: black, shininess: zero, phong: nothing };
        let (normal, mut todo) = (surface.normal, mask);
        let mut shaded = Self {
            model,
            kr: black,
            kt: black,
            ior: zero,
            between: BodyPair::nothing(),
            emission: black,
            normal,
        };
        while todo.any() {
            let material = lane(surface.material, todo);
            let same = todo & surface.material.eq(F::Int::splat(material));
            let point = ShadingPoint::new(scene, material, hit, surface, direction, width, same);
            shaded = Self::select(same, Self::of(&point), shaded);
            todo = todo & !same;
        }
        shaded
    }

    /// Looks up surfaces of one material.
    #[inline(always)]
    fn of(point: &ShadingPoint<F>) -> Self {
        let (material, classic) = (point.material, &point.material.classic);
        let emission = if material.unlit { point.base_color() } else { point.emission() };
        Self {
            model: BlinnPhongParams {
                diffuse: point.tinted(&classic.diffuse),
                specular: point.color(&classic.specular),
                shininess: F::splat(classic.shininess),
                phong: F::Mask::from_bits(if classic.phong { u32::MAX } else { 0 }),
            },
            kr: point.color(&classic.kr),
            kt: Color::splat(classic.kt.into()),
            ior: F::splat(classic.ior),
            between: BodyPair::of(material),
            emission,
            // Without maps normals stay unchanged, even if they face away from the viewer.
            normal: if material.normal.is_some() || material.bump.is_some() {
                point.normal()
            } else {
                point.surface.normal
            },
        }
    }

    #[inline(always)]
    fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        let (yes_phong, no_phong) = (yes.model.phong & mask, no.model.phong & !mask);
        Self {
            model: BlinnPhongParams {
                diffuse: Color::select(mask, yes.model.diffuse, no.model.diffuse),
                specular: Color::select(mask, yes.model.specular, no.model.specular),
                shininess: F::select(mask, yes.model.shininess, no.model.shininess),
                phong: yes_phong | no_phong,
            },
            kr: Color::select(mask, yes.kr, no.kr),
            kt: Color::select(mask, yes.kt, no.kt),
            ior: F::select(mask, yes.ior, no.ior),
            between: BodyPair::select(mask, yes.between, no.between),
            emission: Color::select(mask, yes.emission, no.emission),
            normal: Vector::select(mask, yes.normal, no.normal),
        }
    }

    /// Clears the parameters in some lanes.
    #[inline(always)]
    pub fn without(self, mask: F::Mask) -> Self {
        let (zero, black) = (F::zero(), Color::black());
        let nothing = F::Mask::from_bits(0);
        let model = BlinnPhongParams { diffuse: black, specular: black, shininess: zero, phong: nothing };
        Self::select(mask, Self { model, kr: black, kt: black, ior: zero, emission: black, ..self }, self)
    }

    /// True if a surface in any lane of the mask refracts light.
    #[inline(always)]
    pub fn any_refracts(&self, mask: F::Mask) -> bool {
        (mask & self.ior.gt(F::zero())).any()
    }
}
