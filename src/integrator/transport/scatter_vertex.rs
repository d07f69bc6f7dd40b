//! Vertices where surfaces scatter light under the path transport, and their part in dividing it with photons.

use crate::integrator::path::shadow::ShadowRay;
use crate::integrator::path::{Path, camera_path};
use crate::integrator::photons::PhotonMaps;
use crate::integrator::photons::gather::{
    DRAWN, GatheredLight, PhotonsWanted, behind, first_radius, leaving,
};
use crate::integrator::setup::RenderSetup;
use crate::math::hash::SampleKey;
use crate::shading::boundary::Boundary;
use crate::shading::point::ShadingPoint;
use crate::shading::principled::bsdf::Bsdf;
use crate::shading::principled::sample::BsdfSample;
use crate::shading::surface::Surface;
use crate::simd::{Float, Int, Mask};

/// Paths that fork off at a vertex of others, and have found nothing yet.
pub struct Fork<F: Float> {
    /// The forked paths.
    pub next: Path<F>,
    /// Lanes that have one.
    pub mask: F::Mask,
}

/// A vertex where a surface scatters light.
pub(in crate::integrator) struct ScatterVertex<'a, F: Float> {
    pub setup: &'a RenderSetup,
    /// The photons that end there, if there are any.
    pub photons: Option<PhotonMaps<'a>>,
    pub path: &'a Path<F>,
    pub boundary: Boundary<F>,
    pub surface: &'a Surface<F>,
    pub point: &'a ShadingPoint<'a, F>,
    pub key: SampleKey<F::Int>,
    /// The lanes whose surface scatters.
    pub here: F::Mask,
    /// The lanes whose path may at least go straight on.
    pub draws: F::Mask,
    /// The lanes that a shadow catcher catches here.
    pub caught: F::Mask,
    pub t: F,
    pub width: F,
}

impl<F: Float> ScatterVertex<'_, F> {
    /// Divides light between the path and photons: returns the light of photons that end here, and leaves to the light
    /// sample, and to what the path finds later, what photons do not bring.
    #[inline(always)]
    pub(in crate::integrator) fn with_photons(
        &self,
        photons: PhotonMaps,
        bsdf: &Bsdf<F>,
        drawn: &BsdfSample<F>,
        light: &mut ShadowRay<F>,
        next: &mut Path<F>,
    ) -> GatheredLight<F> {
        let Self { setup, path, surface, .. } = *self;
        let bends = next.scatterings.eq(path.scatterings);
        if self.point.material.makes_caustics() {
            let emission = &photons.plan.emission;
            let density = emission.density(&setup.scene, light.emitter, light.ray.direction, light.mask);
            let left = photons.left_to_path(path, density, true, light.mask);
            light.contribution = light.contribution * left;
            next.landing = F::Int::select(bends, behind::<F>(path.landing), path.landing);
            return GatheredLight::nothing();
        }
        let radius = self.first_radius(photons);
        let is_drawn = path.bounce_counts.eq(F::Int::splat(0));
        let word = leaving(surface, radius, drawn.direction, drawn.pdf);
        let word = F::Int::select(is_drawn, word | F::Int::splat(DRAWN), word);
        next.landing = F::Int::select(bends, word, path.landing);
        self.gathered(bsdf, None)
    }

    /// The radius within which the first sample gathers photons.
    #[inline(always)]
    fn first_radius(&self, photons: PhotonMaps) -> F {
        let Self { path, surface, width, .. } = *self;
        let width = width * F::splat(photons.plan.pixels) / camera_path::footprint::<F>(path.sample);
        first_radius(path, width, surface)
    }

    /// The light of photons that leaves the vertex towards the viewer: of one light group, or of all lights.
    #[inline(always)]
    pub(in crate::integrator) fn gathered(&self, bsdf: &Bsdf<F>, group: Option<u32>) -> GatheredLight<F> {
        let Self { setup, path, surface, here, .. } = *self;
        // Photons that the camera sees directly are splatted instead.
        let mask = here & bsdf.scatters() & !path.bounce_counts.eq(F::Int::splat(0));
        let Some(photons) = self.photons.filter(|_| mask.any() && !self.point.material.makes_caustics())
        else {
            return GatheredLight::nothing();
        };
        let what = PhotonsWanted { max_depth: setup.max_depth, diffuse: setup.sharing.is_some(), group };
        photons.gather(what, path, surface, bsdf, self.first_radius(photons), mask)
    }
}
