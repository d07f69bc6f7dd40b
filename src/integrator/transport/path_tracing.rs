//! The path transport: light that is scattered any number of times. At every vertex one light is sampled and one
//! direction drawn from the surface's lobes; light that both can find is weighted by the power heuristic (`path/mis.rs`).
//! Besides [`super::whitted`], only this module and its parts, such as [`super::onward`], read or write throughput and
//! radiance, except for the attenuation in [`super::medium`] and [`super::transparent_shadow`].
//!
//! A path's radiance is summed in the order of its vertices: at each vertex first the lamps without a surface
//! on the way to it ([`super::unseen_lamps`]), then the surface's emission, then the light sample.

use super::catcher;
use super::direct::{faces, to_light};
use super::medium;
use super::medium_light::MediumLightSample;
use super::onward::{sampled, unhindered};
use super::reusable::{self, ReuseRoles};
use super::scatter_vertex::{Fork, ScatterVertex};
use crate::film::Caught;
use crate::integrator::RenderSetup;
use crate::integrator::path::Path;
use crate::integrator::path::bounces::{self, LobeKind};
use crate::integrator::path::light_groups::{GroupQueue, find_around, group_for};
use crate::integrator::path::mis::{emission_mis_weight, power_heuristic, selection_probability};
use crate::integrator::path::shadow::ShadowRay;
use crate::integrator::path::termination::is_last;
use crate::integrator::photons::PhotonMaps;
use crate::integrator::photons::gather::{GatheredLight, elsewhere};
use crate::math::{Color, NONE};
use crate::sampling::draw::draw_2d;
use crate::sampling::{Dimension, SampleKey};
use crate::scene::{CompiledScene, MaterialRecord};
use crate::shading::boundary::{BodyPair, Boundary};
use crate::shading::principled::bsdf::Bsdf;
use crate::shading::principled::dispersion::Dispersive;
use crate::shading::principled::parameters::{LobeFlags, Outside};
use crate::shading::{HitLanes, ShadingPoint, Surface, environment};
use crate::simd::{Float, Int, Mask, Outlined};

/// The outcome of a hit.
pub struct VertexOutcome<F: Float> {
    /// The path's radiance, including the surface's emission.
    pub radiance: Color<F>,
    /// The shadow ray to one point of one light.
    pub shadow: ShadowRay<F>,
    /// The continued path, without its radiance.
    pub next: Path<F>,
    /// The lanes whose path goes on.
    pub goes_on: F::Mask,
    /// Paths that fork off at the hit.
    pub fork: Option<Fork<F>>,
    /// The roles of the hit in path reuse, if paths are reused.
    pub reuse: Option<ReuseRoles<F>>,
}

/// Returns the light that paths find which have hit nothing. It is also added to `found`, by its group.
#[inline(always)]
pub fn miss<F: Float>(
    setup: &RenderSetup,
    photons: Option<PhotonMaps>,
    path: &Path<F>,
    mask: F::Mask,
    found: &mut GroupQueue,
) -> Color<F> {
    let (light, is_backdrop) = surroundings(setup, photons, path, mask);
    let light = limited(setup, path, path.throughput * light);
    catcher::count_unblocked(setup, path, mask, found);
    let seen = mask & bounces::only_transmitted::<F>(path.bounce_counts);
    find_around(setup, path, light, [mask & !is_backdrop, seen], found)
}

/// The light that paths find where there is nothing, without their throughput; and the lanes where it is the backdrop.
#[inline(always)]
pub(super) fn surroundings<F: Float>(
    setup: &RenderSetup,
    photons: Option<PhotonMaps>,
    path: &Path<F>,
    mask: F::Mask,
) -> (Color<F>, F::Mask) {
    let scene = &setup.scene;
    let mut light = environment::radiance(&scene.environment, path.direction, mask);
    let drawn = mask & path.pdf.gt(F::zero());
    if drawn.any() && scene.environment.panorama.is_some() {
        // The environment is the last emitter.
        let around = F::Int::splat((scene.emitters.len() as u32).wrapping_sub(1));
        let other = environment::pdf(&scene.environment, path.direction, drawn)
            * selection_probability(setup, path, around, drawn);
        light = light * F::select(drawn, power_heuristic(path.pdf, other), F::one());
    }
    if let Some(photons) = photons
        && scene.environment.panorama.is_some()
    {
        let density = photons.plan.emission.sky_density(scene, path.direction, mask);
        light = light * photons.left_to_path(path, density, false, mask);
    }
    let Some(backdrop) = environment::backdrop(&scene.environment, path.direction) else {
        return (light, F::Mask::from_bits(0));
    };
    let is_seen = path.bounce_counts.eq(F::Int::splat(0));
    (Color::select(is_seen, backdrop, light), is_seen)
}

/// Clamps light by the settings; never what the camera sees directly or straight through surfaces.
#[inline(always)]
pub(in crate::integrator) fn limited<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    light: Color<F>,
) -> Color<F> {
    if setup.clamp.is_none() { light } else { light * limit(setup, path, light) }
}

/// The part of light that the settings leave.
#[inline(always)]
fn limit<F: Float>(setup: &RenderSetup, path: &Path<F>, light: Color<F>) -> F {
    let Some(most) = setup.clamp else { return F::one() };
    let largest = light.max_component();
    let bright = largest.gt(F::splat(most)) & !path.bounce_counts.eq(F::Int::splat(0));
    F::select(bright, F::splat(most) / largest.max(F::splat(1e-30)), F::one())
}

/// Evaluates hits on one material. The light that paths find there is also added to `found`, by its light group.
#[inline(always)]
pub fn hit<F: Float>(
    setup: &RenderSetup,
    photons: Option<PhotonMaps>,
    path: &Path<F>,
    hit: &HitLanes<F>,
    material: u32,
    mask: F::Mask,
    found: &mut GroupQueue,
) -> VertexOutcome<F> {
    let scene = &setup.scene;
    let record = &scene.materials[material as usize];
    let surface = Surface::new(&scene.geometry, &path.ray(), hit, mask);
    let width = path.width + path.spread * hit.t;
    let point = shading_point(setup, path, hit, material, &surface, width, mask);
    let key = path.path_key(setup.seed);
    let flight = medium::free_flight(setup, path, hit.t, mask);
    catcher::count_unblocked(setup, path, mask, found);
    let path = &Path { throughput: flight.throughput, ..*path };
    let mut out = VertexOutcome {
        radiance: path.radiance,
        shadow: ShadowRay::none(),
        next: *path,
        goes_on: F::Mask::from_bits(0),
        fork: None,
        reuse: None,
    };
    let arrives = mask & !flight.scattered;
    if flight.scattered.any() {
        (out.next, out.goes_on) = medium::scattered(setup, path, &flight, key);
        out.next.landing = elsewhere::<F>(path.landing);
        out.shadow = F::outlined(MediumLightSample { setup, path, flight: &flight, key }).shadow;
        if !arrives.any() {
            return out;
        }
    }
    let light = found_emission(setup, photons, path, (hit, &point), arrives, found);
    out.radiance = Color::select(arrives, path.radiance + light, path.radiance);
    let boundary = boundary(scene, path, &surface, record, arrives);
    let gone = arrives & boundary.gone;
    let elsewhere = flight.scattered | gone;
    if gone.any() {
        let (next, again) = unhindered(path, &surface, &boundary, record, hit.t, width);
        out.next = Path::select(gone, &next, &out.next);
        out.goes_on = out.goes_on | (gone & again);
    }
    // The last ray only finds emitters, because the previous light sample is weighted against it.
    let arrives = arrives & !gone;
    let here = arrives & !is_last(setup, path);
    let caught = catcher::caught(setup, path, record, arrives);
    catcher::count_behind(setup, path, caught, found);
    // Going straight through is no bounce.
    let draws = if record.passes_shadow_rays { arrives } else { here };
    if record.unlit || !draws.any() {
        return out;
    }
    let vertex = ScatterVertex {
        setup,
        photons,
        path,
        boundary,
        surface: &surface,
        point: &point,
        key,
        here,
        draws,
        caught: caught & here,
        t: hit.t,
        width,
    };
    // Most surfaces are matte. Code that is specialized for them is shorter: it omits operations without effect.
    let scattered = if point.has().is_matte() {
        F::outlined(Scatter::<F, true>(&vertex, found))
    } else {
        F::outlined(Scatter::<F, false>(&vertex, found))
    };
    if elsewhere.any() {
        // All other lanes already have their direction.
        out.shadow = ShadowRay::select(draws, &scattered.shadow, &out.shadow);
        out.next = Path::select(draws, &scattered.next, &out.next);
    } else {
        (out.shadow, out.next) = (scattered.shadow, scattered.next);
    }
    out.goes_on = out.goes_on | scattered.goes_on;
    (out.fork, out.reuse) = (scattered.fork, scattered.shared);
    if photons.is_some() {
        let light = own_light(path, &scattered.gathered, &mut out.reuse);
        out.radiance = Color::select(here, out.radiance + limited(setup, path, light), out.radiance);
    }
    out
}

/// Gathers the light of photons once more, group by group.
struct GatherGroups<'v, 'a, F: Float> {
    vertex: &'v ScatterVertex<'a, F>,
    bsdf: &'v Bsdf<F>,
    /// The light of all groups together.
    all: &'v GatheredLight<F>,
    roles: &'v Option<ReuseRoles<F>>,
    found: &'v mut GroupQueue,
}

impl<F: Float> Outlined for GatherGroups<'_, '_, F> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { vertex, bsdf, all, roles, found } = self;
        let ScatterVertex { setup, path, here, .. } = *vertex;
        let here = here & all.light.max_component().gt(F::zero());
        if !here.any() {
            return;
        }
        let nobody = F::Mask::from_bits(0);
        let gives = if let Some(roles) = roles { roles.gives } else { nobody };
        let [kept, _] = divided(path, all, gives);
        let limit = limit(setup, path, kept);
        for group in 0..setup.lamp_groups() as u32 {
            let [kept, given] = divided(path, &vertex.gathered(bsdf, Some(group)), gives);
            let group = F::Int::splat(group);
            found.add(path, group, kept * limit, false, here);
            found.add(path, group, given, true, here);
        }
    }
}

/// The light of photons that a path keeps, and that which its vertex gives.
#[inline(always)]
fn divided<F: Float>(path: &Path<F>, gathered: &GatheredLight<F>, gives: F::Mask) -> [Color<F>; 2] {
    let given = Color::select(gives, path.throughput * gathered.diffuse, Color::black());
    [path.throughput * gathered.light - given, given]
}

/// Returns the light that a path gathers and keeps; the light that its vertex gives is added by path reuse.
#[inline(always)]
fn own_light<F: Float>(
    path: &Path<F>,
    gathered: &GatheredLight<F>,
    shared: &mut Option<ReuseRoles<F>>,
) -> Color<F> {
    let Some(shared) = shared else { return path.throughput * gathered.light };
    let [kept, given] = divided(path, gathered, shared.gives);
    shared.reusable.gathered = given;
    kept
}

/// The boundary at a surface of that material: the bodies on both sides.
#[inline(always)]
pub(in crate::integrator) fn boundary<F: Float>(
    scene: &CompiledScene,
    path: &Path<F>,
    surface: &Surface<F>,
    record: &MaterialRecord,
    mask: F::Mask,
) -> Boundary<F> {
    Boundary::new(&scene.bodies, path.bodies, &BodyPair::of(record), surface.inside, mask)
}

/// The shading point where a path with a ray `width` metres wide meets a material. Surfaces that light goes straight
/// through are looked up without a width: shadow rays, which have none, must find the same.
#[inline(always)]
pub(in crate::integrator) fn shading_point<'a, F: Float>(
    setup: &'a RenderSetup,
    path: &Path<F>,
    hit: &'a HitLanes<F>,
    material: u32,
    surface: &'a Surface<F>,
    width: F,
    mask: F::Mask,
) -> ShadingPoint<'a, F> {
    let scene = &setup.scene;
    let width = if scene.materials[material as usize].passes_shadow_rays { F::zero() } else { width };
    ShadingPoint::new(scene, material, hit, surface, path.direction, width, mask)
}

/// The light that a surface scatters.
struct Scattered<F: Float> {
    shadow: ShadowRay<F>,
    next: Path<F>,
    goes_on: F::Mask,
    fork: Option<Fork<F>>,
    /// The light of photons that leaves the vertex towards the viewer.
    gathered: GatheredLight<F>,
    shared: Option<ReuseRoles<F>>,
}

/// [`ScatterVertex::scatter`] as a function of its own, for surfaces that are all [`LobeFlags::MATTE`], or not.
struct Scatter<'v, 'a, F: Float, const MATTE: bool>(&'v ScatterVertex<'a, F>, &'v mut GroupQueue);

impl<F: Float, const MATTE: bool> Outlined for Scatter<'_, '_, F, MATTE> {
    type Output = Scattered<F>;
    #[inline(always)]
    fn run(self) -> Scattered<F> {
        let Self(vertex, found) = self;
        vertex.scatter(if MATTE { LobeFlags::MATTE } else { vertex.point.has() }, found)
    }
}

impl<F: Float> ScatterVertex<'_, F> {
    /// Samples one light and draws one direction at a surface with the given lobes.
    #[inline(always)]
    fn scatter(&self, has: LobeFlags, found: &mut GroupQueue) -> Scattered<F> {
        let Self { setup, path, surface, point, key, here, draws, caught, .. } = *self;
        let boundary = &self.boundary;
        let bsdf = bsdf(has, setup, path, point, &boundary.outside, key, draws);
        let mut light = to_light(setup, path, surface, boundary, &bsdf, key, [here, caught]);
        if caught.any() {
            let unblocked = F::Int::splat(setup.groups().caught(Caught::Unblocked));
            let all = limited(setup, path, light.0.contribution);
            found.add(path, unblocked, all, false, caught & light.0.mask);
        }
        let drawn = sampled(setup, path, &bsdf, key, draws);
        let (mut next, goes_on) = self.continued(&drawn);
        next.packed_normal = faces(setup, surface, &bsdf);
        let mut fork = if has.transmission { self.forked(&bsdf) } else { None };
        let mut gathered = GatheredLight::nothing();
        if let Some(photons) = self.photons {
            gathered = self.with_photons(photons, &bsdf, &drawn, &mut light.0, &mut next);
            if let Some(fork) = &mut fork {
                // A fork that goes straight through keeps this path's state; the reflection never goes straight.
                let bends = fork.next.scatterings.eq(path.scatterings);
                fork.next.landing = F::Int::select(bends, next.landing, path.landing);
            }
        }
        let mut shared = None;
        if setup.sharing.is_some() {
            let light = (light.0.ray.direction, light.1);
            let vertex = reusable::EvaluatedVertex { point, bsdf: &bsdf, light, drawn: &drawn };
            shared = Some(reusable::roles(path, &vertex, here));
        }
        if self.photons.is_some() && setup.lamp_groups() > 0 {
            F::outlined(GatherGroups { vertex: self, bsdf: &bsdf, all: &gathered, roles: &shared, found });
        }
        Scattered { shadow: light.0, next, goes_on, fork, gathered, shared }
    }
}

/// The BSDF of a surface with the given lobes, at the wavelength that the path follows, if it follows one.
#[inline(always)]
pub(in crate::integrator) fn bsdf<F: Float>(
    has: LobeFlags,
    setup: &RenderSetup,
    path: &Path<F>,
    point: &ShadingPoint<F>,
    outside: &Outside<F>,
    key: SampleKey<F::Int>,
    mask: F::Mask,
) -> Bsdf<F> {
    let mut parameters = point.parameters(has, outside);
    // Shadow rays go straight through some surfaces: so must paths.
    if setup.filter_glossy > 0.0 && !point.material.passes_shadow_rays {
        let later = mask & bounces::has_counted::<F>(path.bounce_counts, LobeKind::Diffuse);
        parameters.roughen(F::splat(setup.filter_glossy), has, later);
    }
    let MaterialRecord { ior, dispersion, .. } = *point.material;
    let disperses = !outside.is_air && (mask & outside.dispersion.gt(F::zero())).any();
    let has = LobeFlags { dispersion: has.dispersion | (has.solid && disperses), ..has };
    if has.dispersion {
        // One number for the whole path: it always chooses the same colour and wavelength.
        let dimension = Dimension::Wavelength.at(F::Int::splat(0));
        let u = draw_2d(setup.sampler, setup.samples, key, dimension);
        let boundary = Dispersive { ior, dispersion, outside, inside: point.surface.inside };
        parameters.split(&boundary, path.throughput, u);
    }
    Bsdf::new(has, parameters, point.to_viewer, mask)
}

/// The light that paths find by the surface's emission. It is also added to `found`, by its group.
#[inline(always)]
fn found_emission<F: Float>(
    setup: &RenderSetup,
    photons: Option<PhotonMaps>,
    path: &Path<F>,
    (hit, point): (&HitLanes<F>, &ShadingPoint<F>),
    arrives: F::Mask,
    found: &mut GroupQueue,
) -> Color<F> {
    let light = emitted(setup, photons, path, hit, point, arrives);
    let group = point.material.group;
    if group != NONE || setup.groups_by_path() {
        found.add(path, group_for(setup, path, F::Int::splat(group)), light, false, arrives);
    }
    light
}

/// The light that paths find by the surface's emission.
#[inline(always)]
fn emitted<F: Float>(
    setup: &RenderSetup,
    photons: Option<PhotonMaps>,
    path: &Path<F>,
    hit: &HitLanes<F>,
    point: &ShadingPoint<F>,
    mask: F::Mask,
) -> Color<F> {
    if point.material.unlit {
        // Its colour is visible even to a camera within a body.
        return path.throughput * (point.base_color() * F::splat(1.0 / setup.around_square));
    }
    if !point.material.emits() {
        return Color::black();
    }
    let mut light = point.emission() * emission_mis_weight(setup, path, hit, mask);
    if let Some(photons) = photons {
        light = light * photons.left_of_hit(path, hit, mask);
    }
    let found = medium::emitted(setup, path.bodies, path.throughput * light, mask);
    limited(setup, path, found)
}
