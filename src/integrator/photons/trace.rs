//! What happens to a photon at a surface: the same functions as for the camera's paths, with a factor for shading
//! normals. Paths count light within bodies as if it had been outside, where radiance is less by the square of the
//! index; the light of photons is counted in the same way, so that it is less by that within.

use std::num::Wrapping;

use super::Plan;
use super::draw::{View, is_in_image, view};
use super::emission::Emitted;
use super::gather::{first_radius, own_part};
use super::map::Radii;
use crate::integrator::Frame;
use crate::integrator::medium;
use crate::integrator::path::Path;
use crate::integrator::path_tracing::{ScatteringVertex, boundary, bsdf, drawn, shading_point, unhindered};
use crate::integrator::shadow::ShadowRay;
use crate::integrator::whitted::{WhittedVertex, scatter};
use crate::math::{Color, NONE, Ray, Vector};
use crate::sampling::Dimension;
use crate::sampling::draw::{draw_1d, draw_2d};
use crate::scene::material::is_real;
use crate::shading::boundary::Boundary;
use crate::shading::classic::Shaded;
use crate::shading::emitter::SHADOW_END;
use crate::shading::surface::leave;
use crate::shading::{HitLanes, ShadingPoint, Surface, camera};
use crate::simd::{Float, Int, Mask};

/// What becomes of photons that have hit a material.
pub struct PhotonOutcome<F: Float> {
    /// Those that go on.
    pub next: Path<F>,
    /// Where they do.
    pub goes_on: F::Mask,
    /// Where they end, to be gathered.
    pub lands: F::Mask,
    /// Where that is.
    pub position: Vector<F>,
    /// The normal there, on their side.
    pub normal: Vector<F>,
    /// What they carry then.
    pub flux: Color<F>,
    /// To the camera, if it may see that.
    pub to_camera: ShadowRay<F>,
    /// Column and row where it sees that.
    pub place: (F, F),
}

/// The path of a photon that has left its lamp, as [`Path`] keeps it. Of the fields that only the camera's paths need,
/// `facing` holds the bits of the photon's density, and `width` is not 0 until a photon meets the first thing whose
/// lamp does not fall with distance.
#[inline(always)]
pub fn density<F: Float>(path: &Path<F>) -> F {
    path.facing.reinterpret()
}

/// A photon as a path.
pub fn path(frame: &Frame, sample: u32, number: u32, photon: &Emitted) -> Path<f32> {
    Path {
        origin: photon.origin,
        direction: photon.direction,
        throughput: medium::emitted(frame, Wrapping(photon.bodies), photon.flux, true),
        radiance: Color::black(),
        pixel: Wrapping(number),
        sample: Wrapping(sample),
        branch: Wrapping(0),
        depth: Wrapping(0),
        pdf: 0.0,
        facing: Wrapping(photon.density.to_bits()),
        width: if photon.falls { 0.0 } else { 1.0 },
        spread: 0.0,
        bodies: Wrapping(photon.bodies),
        scatterings: Wrapping(0),
        travelled: 0.0,
        landing: Wrapping(0),
    }
}

/// Looks at photons of one sample that have hit a material.
#[inline(always)]
pub fn hit<F: Float>(
    plan: &Plan,
    radii: Radii,
    path: &Path<F>,
    hit: &HitLanes<F>,
    material: u32,
    mask: F::Mask,
) -> PhotonOutcome<F> {
    let frame = &plan.frame;
    let record = &frame.scene.materials[material as usize];
    let none = F::Mask::from_bits(0);
    let surface = Surface::new(&frame.scene.geometry, &path.ray(), hit, mask);
    let flux = medium::passed(frame, path.throughput, path.bodies, hit.t, mask);
    let flux = first_flux(path, flux, hit.t);
    let path = &Path { throughput: flux, width: F::zero(), ..*path };
    let mut out = PhotonOutcome {
        next: *path,
        goes_on: none,
        lands: none,
        position: surface.position,
        normal: surface.geometric_normal,
        flux,
        to_camera: ShadowRay::none(),
        place: (F::zero(), F::zero()),
    };
    let boundary = boundary(&frame.scene, path, &surface, record, mask);
    let gone = mask & boundary.gone;
    if gone.any() {
        let (next, again) = unhindered(path, &surface, &boundary, record, hit.t, F::zero());
        (out.next, out.goes_on) = (next, gone & again);
    }
    let mask = mask & !gone;
    if record.unlit || !mask.any() {
        return out;
    }
    if !record.makes_caustics() {
        out.lands = mask & !path.branch.eq(F::Int::splat(0)) & flux.max_component().gt(F::zero());
        if out.lands.any() {
            land(plan, radii, path, (hit, material), &surface, &boundary, &mut out);
        }
        return out;
    }
    let key = path.only_key(frame.seed);
    let point = shading_point(frame, path, hit, material, &surface, F::zero(), mask);
    let here = mask & !crate::integrator::ends::is_last(frame, path);
    let draws = if record.straight { mask } else { here };
    let vertex = ScatteringVertex {
        frame,
        photons: None,
        path,
        boundary,
        surface: &surface,
        point: &point,
        key,
        here,
        draws,
        t: hit.t,
        width: F::zero(),
    };
    let bsdf = bsdf(point.has(), frame, path, &point, &vertex.boundary.outside, key, draws);
    let drawn = drawn(frame, path, &bsdf, key, draws);
    let (mut next, goes_on) = vertex.onward(&drawn);
    let factor = shading_factor(path.direction, drawn.direction, bsdf.normal(), surface.geometric_normal);
    let bends = next.scatterings.eq(path.scatterings);
    let factor = F::select(bends, factor, F::one());
    // Light behind a boundary that bends it is counted as paths count it: see `medium::emitted`.
    let index = vertex.boundary.outside.index;
    let ratio = F::splat(if record.refracts() && is_real(record.ior) { record.ior } else { 1.0 }) / index;
    let square = if record.refracts() { ratio * ratio } else { F::one() };
    let scale = F::select(surface.inside, square, F::one() / square);
    let factor = factor * F::select(drawn.through & !drawn.wide & bends, scale, F::one());
    next.throughput = next.throughput * factor;
    next.facing = path.facing;
    out.next = Path::select(gone, &out.next, &next);
    out.goes_on = out.goes_on | (mask & goes_on);
    out
}

/// A photon's light where it meets the first thing. Lamps that do not fall with distance light that as others would that
/// are a metre away.
#[inline(always)]
fn first_flux<F: Float>(path: &Path<F>, flux: Color<F>, t: F) -> Color<F> {
    let way = path.travelled + t;
    Color::select(path.width.gt(F::zero()), flux * (way * way), flux)
}

/// By how much light differs from importance where normals are interpolated (Veach 1997, 5.3).
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

/// Photons that end: where the camera sees that, and what it sees.
#[inline(always)]
fn land<F: Float>(
    plan: &Plan,
    radii: Radii,
    path: &Path<F>,
    (hit, material): (&HitLanes<F>, u32),
    surface: &Surface<F>,
    boundary: &Boundary<F>,
    out: &mut PhotonOutcome<F>,
) {
    let (frame, scene) = (&plan.frame, &plan.frame.scene);
    let Some(eye) = Eye::new(frame, path, hit, surface, out) else { return };
    let point =
        ShadingPoint::new(scene, material, &eye.hit, &eye.surface, eye.direction, eye.width, eye.mask);
    let seen = Path { direction: eye.direction, landing: F::Int::splat(0), ..*path };
    let key = path.only_key(frame.seed);
    let bsdf = bsdf(point.has(), frame, &seen, &point, &boundary.outside, key, eye.mask);
    let (value, pdf) = bsdf.evaluate(-path.direction, eye.mask);
    let radius = radii.of(first_radius(&seen, eye.width * F::splat(plan.pixels), &eye.surface));
    let own = own_part(density(path), radius, pdf, eye.cosine);
    let through = eye.direction.dot(surface.geometric_normal).gt(F::zero());
    out.to_camera = eye.ray(frame, path.throughput * value * own, boundary.beyond(through));
}

/// The place where a photon has ended, as the camera sees it.
pub(super) struct Eye<F: Float> {
    view: View<F>,
    /// From the camera.
    pub direction: Vector<F>,
    /// As if a ray of the camera had hit it.
    pub hit: HitLanes<F>,
    /// The surface on the camera's side.
    pub surface: Surface<F>,
    /// The width of a pixel, in metres.
    pub width: F,
    /// |cos| between the surface itself and where the photon came from.
    pub cosine: F,
    /// Lanes in which it may be seen.
    pub mask: F::Mask,
}

impl<F: Float> Eye<F> {
    /// For photons that have ended, whose place in the image is written to `out`. None if none is in the image.
    #[inline(always)]
    pub fn new(
        frame: &Frame,
        path: &Path<F>,
        hit: &HitLanes<F>,
        surface: &Surface<F>,
        out: &mut PhotonOutcome<F>,
    ) -> Option<Self> {
        let scene = &frame.scene;
        let key = path.only_key(frame.seed);
        let lens = draw_2d(frame.sampler, frame.samples, key, Dimension::Lens.at(F::Int::splat(0)));
        let view = view(frame, surface.position, lens);
        out.place = (view.column, view.row);
        let mask = out.lands & is_in_image(frame, &view);
        if !mask.any() {
            return None;
        }
        let direction = -view.to_camera;
        let origin = surface.position - direction * view.distance;
        let ray = Ray { origin, direction, t_min: F::zero(), t_max: F::splat(f32::INFINITY) };
        let hit = HitLanes { t: view.distance, ..*hit };
        let surface = Surface::new(&scene.geometry, &ray, &hit, mask);
        let (at_lens, per_metre) = camera::pixel_width(&scene.camera, frame.size[1] as f32);
        let width = F::splat(at_lens) + F::splat(per_metre) * view.distance;
        let cosine = path.direction.dot(surface.geometric_normal).abs().max(F::splat(1e-3));
        Some(Self { view, direction, hit, surface, width, cosine, mask })
    }

    /// The ray to the camera. `light` is value · |cos| times the photon's flux, `bodies` what it begins in.
    #[inline(always)]
    pub fn ray(&self, frame: &Frame, light: Color<F>, bodies: F::Int) -> ShadowRay<F> {
        let Self { view, surface, cosine, .. } = self;
        let facing = view.to_camera.dot(surface.geometric_normal).abs();
        let light = light * (view.importance * facing / *cosine * F::splat(frame.around_square));
        let normal = surface.geometric_normal;
        ShadowRay {
            ray: Ray {
                origin: leave(surface.position, normal, surface.offset, view.to_camera),
                direction: view.to_camera,
                t_min: F::zero(),
                t_max: view.distance * F::splat(SHADOW_END),
            },
            contribution: light,
            emitter: F::Int::splat(NONE),
            bodies,
            mask: self.mask & light.max_component().gt(F::zero()),
        }
    }
}

/// Looks up photons under Whitted's transport: they end at whatever is diffuse, and go on where the surface reflects
/// light or lets it through, both in proportion to the weights that the camera's paths have there.
#[inline(always)]
pub fn hit_whitted<F: Float>(
    plan: &Plan,
    path: &Path<F>,
    hit: &HitLanes<F>,
    mask: F::Mask,
) -> PhotonOutcome<F> {
    let (frame, none) = (&plan.frame, F::Mask::from_bits(0));
    let scene = &frame.scene;
    let surface = Surface::new(&scene.geometry, &path.ray(), hit, mask);
    let mut shaded = Shaded::new(scene, hit, &surface, path.direction, F::zero(), mask);
    let boundary = Boundary::<F>::new(&scene.bodies, path.bodies, &shaded.between, surface.inside, mask);
    if boundary.gone.any() {
        shaded = shaded.without(boundary.gone);
    }
    let flux = first_flux(path, path.throughput, hit.t);
    let path = &Path { throughput: flux, width: F::zero(), ..*path };
    let ends = shaded.model.diffuse.max_component().gt(F::zero()) & !path.branch.eq(F::Int::splat(0));
    let mut out = PhotonOutcome {
        next: *path,
        goes_on: none,
        lands: mask & ends & flux.max_component().gt(F::zero()),
        position: surface.position,
        normal: surface.geometric_normal,
        flux,
        to_camera: ShadowRay::none(),
        place: (F::zero(), F::zero()),
    };
    if out.lands.any()
        && let Some(eye) = Eye::new(frame, path, hit, &surface, &mut out)
    {
        let seen = Shaded::new(scene, &eye.hit, &eye.surface, eye.direction, eye.width, eye.mask);
        let value = seen.model.evaluate(seen.normal, -eye.direction, -path.direction);
        // Light does not go through what is diffuse.
        let same_side = eye.surface.geometric_normal.dot(path.direction).lt(F::zero());
        let light = Color::select(same_side, flux * value, Color::black());
        out.to_camera = eye.ray(frame, light, path.bodies);
    }
    let scatter = scatter(frame, path, &surface, &shaded, &boundary, mask);
    let scale = F::one() / flux.luminance().max(F::splat(1e-30));
    let reflected = scatter.reflect_throughput.luminance() * scale;
    let refracted = scatter.refract_throughput.luminance() * scale;
    let key = path.only_key(frame.seed);
    let number: F = draw_1d(frame.sampler, frame.samples, key, Dimension::Through.at(path.depth));
    let total = (reflected + refracted).max(F::one());
    let (first, both) = (reflected / total, (reflected + refracted) / total);
    let reflects = scatter.reflects & number.lt(first);
    let refracts = scatter.refracts & !reflects & number.lt(both);
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
    let ratio = shaded.ior / boundary.outside.index;
    let square = ratio * ratio;
    let bent = F::select(surface.inside, square, F::one() / square.max(F::splat(1e-6)));
    let bent = F::select(refracts & !boundary.gone & square.gt(F::zero()), bent, F::one());
    let factor =
        shading_factor(path.direction, next.direction, shaded.normal, surface.geometric_normal) * bent;
    let factor = F::select(boundary.gone, F::one(), factor);
    out.goes_on = reflects | refracts;
    out.next = Path {
        throughput: next.throughput * (factor / chance),
        branch: F::Int::select(boundary.gone, path.branch, F::Int::splat(1)),
        ..next
    };
    out
}
