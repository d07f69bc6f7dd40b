//! Scattering of photons at surfaces by the functions of the camera's paths, with a factor for shading normals. Light
//! that ends in a body is scaled as for paths (`medium::emitted`).

use crate::integrator::path::termination::is_last;
use std::num::Wrapping;

use super::medium;
use super::onward::{past, sampled, unhindered};
use super::path_tracing::{boundary, bsdf, shading_point};
use super::scatter_vertex::{Fork, ScatterVertex};
use super::whitted::{WhittedVertex, scatter};
use crate::integrator::RenderSetup;
use crate::integrator::path::Path;
use crate::integrator::path::mis::own_part;
use crate::integrator::path::shadow::ShadowRay;
use crate::integrator::photons::PhotonPlan;
use crate::integrator::photons::emission::EmittedPhoton;
use crate::integrator::photons::gather::{first_radius, footprint_area};
use crate::integrator::photons::splat::{is_in_image, view};
use crate::math::{Color, NONE, Ray, Vector};
use crate::sampling::Dimension;
use crate::sampling::draw::{draw_1d, draw_2d};
use crate::scene::CompiledScene;
use crate::shading::boundary::Boundary;
use crate::shading::camera::ImagePoint;
use crate::shading::emitter::SHADOW_END;
use crate::shading::principled::sample::BsdfSample;
use crate::shading::surface::offset_origin;
use crate::shading::whitted_params::Shaded;
use crate::shading::{HitLanes, ShadingPoint, Surface};
use crate::simd::{Float, Int, Mask};

/// The outcome of photons that have hit a material: they go on, or end, or both.
pub struct PhotonOutcome<F: Float> {
    /// The photons that go on.
    pub next: Path<F>,
    /// The lanes whose photons go on.
    pub goes_on: F::Mask,
    /// Photons that pass the surface as well, and go on behind it.
    pub passed: Option<Fork<F>>,
    /// The lanes whose photons end here, to be gathered.
    pub lands: F::Mask,
    /// The positions of the hits.
    pub position: Vector<F>,
    /// The normals there, on the side where the photons arrived.
    pub normal: Vector<F>,
    /// The flux of the photons.
    pub flux: Color<F>,
    /// Rays to the camera, for photons that it may see.
    pub to_camera: ShadowRay<F>,
    /// Columns and rows of the image where the camera sees them.
    pub place: (F, F),
}

/// The density of a photon, which [`path()`] stores in `facing`.
#[inline(always)]
pub fn density<F: Float>(path: &Path<F>) -> F {
    path.packed_normal.reinterpret()
}

/// Stores a new photon as a path. Of the fields that only the camera's paths need, `facing` holds the bits of the
/// photon's density, `width` the distance travelled, and `spread` is not 0 if its light does not fall off with
/// distance.
pub fn path(sample: u32, number: u32, photon: &EmittedPhoton) -> Path<f32> {
    Path {
        origin: photon.origin,
        direction: photon.direction,
        throughput: photon.flux,
        radiance: Color::black(),
        pixel: Wrapping(number),
        sample: Wrapping(sample),
        bounce_counts: Wrapping(0),
        depth: Wrapping(0),
        pdf: 0.0,
        packed_normal: Wrapping(photon.density.to_bits()),
        width: 0.0,
        spread: if photon.falls { 0.0 } else { 1.0 },
        bodies: Wrapping(photon.bodies),
        scatterings: Wrapping(0),
        travelled: 0.0,
        landing: Wrapping(0),
    }
}

/// Scatters or ends photons of one sample that have hit a material.
#[inline(always)]
pub fn hit<F: Float>(
    plan: &PhotonPlan,
    path: &Path<F>,
    hit: &HitLanes<F>,
    material: u32,
    mask: F::Mask,
) -> PhotonOutcome<F> {
    let setup = &plan.setup;
    let record = &setup.scene.materials[material as usize];
    let none = F::Mask::from_bits(0);
    let surface = Surface::new(&setup.scene.geometry, &path.ray(), hit, mask);
    let flux = medium::attenuated(setup, path.throughput, path.bodies, hit.t, mask);
    let way = path.width + hit.t;
    let path = &Path { throughput: flux, ..*path };
    let mut out = PhotonOutcome {
        next: *path,
        goes_on: none,
        passed: None,
        lands: none,
        position: surface.position,
        normal: surface.geometric_normal,
        flux,
        to_camera: ShadowRay::none(),
        place: (F::zero(), F::zero()),
    };
    let boundary = boundary(&setup.scene, path, &surface, record, mask);
    let gone = mask & boundary.gone;
    if gone.any() {
        let (next, again) = unhindered(path, &surface, &boundary, record, hit.t, way);
        (out.next, out.goes_on) = (next, gone & again);
    }
    let mask = mask & !gone;
    if record.hides_back {
        out.passed = Some(passed(path, &surface, way, mask));
    }
    if record.unlit || !mask.any() {
        return out;
    }
    if !record.makes_caustics() {
        out.lands = mask & !path.bounce_counts.eq(F::Int::splat(0)) & flux.max_component().gt(F::zero());
        if record.hides_back && !record.lets_through() {
            // No camera path sees that side.
            out.lands = out.lands & !surface.inside;
        }
        if out.lands.any() {
            out.flux = landed(setup, path, flux, way, out.lands);
            let path = &Path { throughput: out.flux, ..*path };
            land(plan, path, (hit, material), &surface, &boundary, &mut out);
        }
        return out;
    }
    let key = path.path_key(setup.seed);
    let point = shading_point(setup, path, hit, material, &surface, F::zero(), mask);
    let here = mask & !is_last(setup, path);
    let draws = if record.passes_shadow_rays { mask } else { here };
    let vertex = ScatterVertex {
        setup,
        photons: None,
        path,
        boundary,
        surface: &surface,
        point: &point,
        key,
        here,
        draws,
        caught: F::Mask::from_bits(0),
        t: hit.t,
        width: way,
    };
    let bsdf = bsdf(point.has(), setup, path, &point, &vertex.boundary.outside, key, draws);
    let mut drawn = sampled(setup, path, &bsdf, key, draws);
    if record.hides_back {
        drawn.valid = drawn.valid & leaves_front(&drawn, &surface);
    }
    let (mut next, goes_on) = vertex.continued(&drawn);
    let factor = shading_factor(path.direction, drawn.direction, bsdf.normal(), surface.geometric_normal);
    let bends = next.scatterings.eq(path.scatterings);
    next.throughput = next.throughput * F::select(bends, factor, F::one());
    next.spread = path.spread;
    next.packed_normal = path.packed_normal;
    out.next = Path::select(gone, &out.next, &next);
    out.goes_on = out.goes_on | (mask & goes_on);
    out
}

/// Continues photons that arrive at the front of a one-sided surface: a camera path in the opposite direction does not
/// meet it.
#[inline(always)]
fn passed<F: Float>(path: &Path<F>, surface: &Surface<F>, way: F, mask: F::Mask) -> Fork<F> {
    let (next, goes_on) = past(path, surface, way);
    Fork { next, mask: mask & !surface.inside & goes_on }
}

/// The lanes whose surface is one-sided.
#[inline(always)]
fn one_sided<F: Float>(scene: &CompiledScene, surface: &Surface<F>, mask: F::Mask) -> F::Mask {
    let mut ids = [0; 16];
    surface.material.store(&mut ids);
    let has_none = |lane: &usize| scene.materials[ids[*lane] as usize].hides_back;
    let lanes = (0..F::WIDTH).filter(|lane| mask.bits() >> lane & 1 != 0).filter(has_none);
    mask & F::Mask::from_bits(lanes.fold(0, |bits, lane| bits | 1 << lane))
}

/// The lanes whose photon leaves a one-sided surface at its front, where a camera path would arrive.
#[inline(always)]
fn leaves_front<F: Float>(drawn: &BsdfSample<F>, surface: &Surface<F>) -> F::Mask {
    (surface.inside & drawn.transmitted) | !(surface.inside | drawn.transmitted)
}

/// Returns the flux of photons that end within their bodies after a distance of `way` metres. Lights that do not fall
/// off with distance illuminate every point as others illuminate one a metre away.
#[inline(always)]
fn landed<F: Float>(setup: &RenderSetup, path: &Path<F>, flux: Color<F>, way: F, mask: F::Mask) -> Color<F> {
    let flux = Color::select(path.spread.gt(F::zero()), flux * (way * way), flux);
    medium::emitted(setup, path.bodies, flux, mask)
}

/// The factor between light and importance for interpolated normals (Veach 1997, 5.3).
#[inline(always)]
fn shading_factor<F: Float>(
    before: Vector<F>,
    after: Vector<F>,
    normal: Vector<F>,
    geometric: Vector<F>,
) -> F {
    let own = (before.dot(normal) * after.dot(geometric)).abs();
    let other = (before.dot(geometric) * after.dot(normal)).abs();
    (own / other.max(F::splat(1e-4))).min(F::splat(4.0))
}

/// Finds the places in the image of photons that end, and their rays to the camera.
#[inline(always)]
fn land<F: Float>(
    plan: &PhotonPlan,
    path: &Path<F>,
    (hit, material): (&HitLanes<F>, u32),
    surface: &Surface<F>,
    boundary: &Boundary<F>,
    out: &mut PhotonOutcome<F>,
) {
    let (setup, scene) = (&plan.setup, &plan.setup.scene);
    let Some(mut eye) = Eye::new(setup, path, hit, surface, out) else { return };
    if scene.materials[material as usize].hides_back {
        eye.mask = eye.mask & !eye.surface.inside;
    }
    let point =
        ShadingPoint::new(scene, material, &eye.hit, &eye.surface, eye.direction, eye.width, eye.mask);
    let seen = Path { direction: eye.direction, landing: F::Int::splat(0), ..*path };
    let key = path.path_key(setup.seed);
    let bsdf = bsdf(point.has(), setup, &seen, &point, &boundary.outside, key, eye.mask);
    let (value, pdf) = bsdf.evaluate(-path.direction, eye.mask);
    let first = first_radius(&seen, eye.width * F::splat(plan.pixels), &eye.surface);
    let own = own_part(density(path), footprint_area(plan, first), pdf, eye.cosine);
    let through = eye.direction.dot(surface.geometric_normal).gt(F::zero());
    out.to_camera = eye.ray(setup, path.throughput * value * own, boundary.beyond(through));
}

/// The point where a photon ends, as the camera sees it.
pub(in crate::integrator) struct Eye<F: Float> {
    view: ImagePoint<F>,
    /// The direction from the camera to it.
    pub direction: Vector<F>,
    /// The hit that a ray in this direction would find.
    pub hit: HitLanes<F>,
    /// The surface on the camera's side.
    pub surface: Surface<F>,
    /// The width of a pixel there, in metres.
    pub width: F,
    /// |cos| between the geometric normal and the direction of arrival.
    pub cosine: F,
    /// The lanes whose point the camera may see.
    pub mask: F::Mask,
}

impl<F: Float> Eye<F> {
    /// Projects points into the image and writes columns and rows to `out`; none if no point lies in the image.
    #[inline(always)]
    pub fn new(
        setup: &RenderSetup,
        path: &Path<F>,
        hit: &HitLanes<F>,
        surface: &Surface<F>,
        out: &mut PhotonOutcome<F>,
    ) -> Option<Self> {
        let scene = &setup.scene;
        let key = path.path_key(setup.seed);
        let lens = draw_2d(setup.sampler, setup.samples, key, Dimension::Lens.at(F::Int::splat(0)));
        let view = view(setup, surface.position, lens);
        out.place = (view.column, view.row);
        let mask = out.lands & is_in_image(setup, &view);
        if !mask.any() {
            return None;
        }
        let direction = -view.to_camera;
        let origin = surface.position - direction * view.distance;
        let ray = Ray { origin, direction, t_min: F::zero(), t_max: F::splat(f32::INFINITY) };
        let hit = HitLanes { t: view.distance, ..*hit };
        let surface = Surface::new(&scene.geometry, &ray, &hit, mask);
        let (at_lens, per_metre) = setup.image().pixel_width();
        let width = F::splat(at_lens) + F::splat(per_metre) * view.distance;
        let cosine = path.direction.dot(surface.geometric_normal).abs().max(F::splat(1e-3));
        Some(Self { view, direction, hit, surface, width, cosine, mask })
    }

    /// Returns the ray to the camera. `light` is value · |cos| times the photon's flux; the ray begins within `bodies`.
    #[inline(always)]
    pub fn ray(&self, setup: &RenderSetup, light: Color<F>, bodies: F::Int) -> ShadowRay<F> {
        let Self { view, surface, cosine, .. } = self;
        let facing = view.to_camera.dot(surface.geometric_normal).abs();
        let light = light * (view.importance * facing / *cosine * F::splat(setup.around_square));
        let normal = surface.geometric_normal;
        ShadowRay {
            ray: Ray {
                origin: offset_origin(surface.position, normal, surface.offset, view.to_camera),
                direction: view.to_camera,
                t_min: F::zero(),
                t_max: view.distance * F::splat(SHADOW_END),
            },
            contribution: light,
            emitter: F::Int::splat(NONE),
            path_group: F::Int::splat(NONE),
            bodies,
            mask: self.mask & light.max_component().gt(F::zero()),
        }
    }
}

/// Scatters photons under the Whitted transport: they end at diffuse surfaces and go on where the surface reflects or
/// transmits, in proportion to the weights of the camera's paths.
#[inline(always)]
pub fn hit_whitted<F: Float>(
    plan: &PhotonPlan,
    path: &Path<F>,
    hit: &HitLanes<F>,
    mask: F::Mask,
) -> PhotonOutcome<F> {
    let (setup, none) = (&plan.setup, F::Mask::from_bits(0));
    let scene = &setup.scene;
    let surface = Surface::new(&scene.geometry, &path.ray(), hit, mask);
    let mut shaded = Shaded::new(scene, hit, &surface, path.direction, F::zero(), mask);
    let boundary = Boundary::<F>::new(&scene.bodies, path.bodies, &shaded.between, surface.inside, mask);
    if boundary.gone.any() {
        shaded = shaded.without(boundary.gone);
    }
    let (flux, way) = (path.throughput, path.width + hit.t);
    let path = &Path { width: way, ..*path };
    let ends = shaded.model.diffuse.max_component().gt(F::zero()) & !path.bounce_counts.eq(F::Int::splat(0));
    let one_sided = one_sided(scene, &surface, mask & !boundary.gone);
    let passed = one_sided.any().then(|| passed(path, &surface, way, one_sided));
    let mut out = PhotonOutcome {
        next: *path,
        goes_on: none,
        passed,
        lands: mask & ends & !(one_sided & surface.inside) & flux.max_component().gt(F::zero()),
        position: surface.position,
        normal: surface.geometric_normal,
        flux,
        to_camera: ShadowRay::none(),
        place: (F::zero(), F::zero()),
    };
    if out.lands.any() {
        let square = F::splat(setup.index_square_around());
        out.flux = landed(setup, path, flux * square, way, out.lands);
    }
    if out.lands.any()
        && let Some(mut eye) = Eye::new(setup, path, hit, &surface, &mut out)
    {
        eye.mask = eye.mask & !(one_sided & eye.surface.inside);
        let seen = Shaded::new(scene, &eye.hit, &eye.surface, eye.direction, eye.width, eye.mask);
        let value = seen.model.evaluate(seen.normal, -eye.direction, -path.direction);
        // Diffuse surfaces transmit no light.
        let same_side = eye.surface.geometric_normal.dot(path.direction).lt(F::zero());
        let light = Color::select(same_side, out.flux * value, Color::black());
        out.to_camera = eye.ray(setup, light, path.bodies);
    }
    let scatter = scatter(setup, path, &surface, &shaded, &boundary, mask);
    let scale = F::one() / flux.luminance().max(F::splat(1e-30));
    let reflected = scatter.reflect_throughput.luminance() * scale;
    let refracted = scatter.refract_throughput.luminance() * scale;
    let key = path.path_key(setup.seed);
    let number: F = draw_1d(setup.sampler, setup.samples, key, Dimension::Through.at(path.depth));
    let total = (reflected + refracted).max(F::one());
    let (first, both) = (reflected / total, (reflected + refracted) / total);
    let reflects = scatter.reflects & number.lt(first);
    let refracts = scatter.refracts & !reflects & number.lt(both);
    // Photons leave one-sided surfaces at their front, where a camera path would arrive.
    let reflects = reflects & !(one_sided & surface.inside);
    let refracts = refracts & (!one_sided | surface.inside);
    let vertex = WhittedVertex {
        position: surface.position,
        offset: surface.offset,
        geometric_normal: surface.geometric_normal,
        normal: shaded.normal,
        model: shaded.model,
    };
    let (mirrored, bent) = (scatter.reflected(path, &vertex), scatter.refracted(path, &vertex));
    let next = Path::select(reflects, &mirrored, &bent);
    let chance = F::select(reflects, first, both - first).max(F::splat(1e-6));
    let factor = shading_factor(path.direction, next.direction, shaded.normal, surface.geometric_normal);
    let factor = F::select(boundary.gone, F::one(), factor);
    out.goes_on = reflects | refracts;
    out.next = Path {
        throughput: next.throughput * (factor / chance),
        bounce_counts: F::Int::select(boundary.gone, path.bounce_counts, F::Int::splat(1)),
        ..next
    };
    out
}
