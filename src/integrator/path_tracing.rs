//! The path transport: light that is scattered any number of times. At every vertex one light is
//! sampled and one direction drawn from the surface's lobes; what both can find is shared out by
//! the power heuristic (`mis.rs`). With [`super::whitted`] the only place that reads or writes
//! throughput and radiance, but for what [`super::medium`] and [`super::straight`] take away on the way.
//!
//! A path's radiance is summed in the order of its vertices: at a vertex first what the surface
//! gives off, then what its light sends.

use super::Frame;
use super::bounces::{self, SCATTERED};
use super::ends::{is_last, roulette};
use super::medium;
use super::mis::{chance_of, choose, emission_share, heuristic};
use super::path::Path;
use super::photons::Photons;
use super::photons::gather::{Gathered, elsewhere};
use super::shadow::ShadowRay;
use super::sharing::lend::{self, Shared};
use super::within::LitWithin;
use crate::math::{Color, NONE, Ray, Vector};
use crate::sampling::draw::{draw_1d, draw_2d};
use crate::sampling::{Dimension, Key};
use crate::scene::{CompiledScene, Material};
use crate::shading::boundary::{Between, Boundary};
use crate::shading::emitter::{EmitterSample, SHADOW_END};
use crate::shading::facing::facing;
use crate::shading::principled::bsdf::Bsdf;
use crate::shading::principled::dispersion::Dispersive;
use crate::shading::principled::draw::BsdfSample;
use crate::shading::principled::parameters::{Has, Outside};
use crate::shading::surface::leave;
use crate::shading::{HitLanes, ShadingPoint, Surface, emitter, environment};
use crate::simd::{Float, Int, Mask, Outlined};
use crate::world::Sampler;

/// The result of a hit.
pub struct VertexOutcome<F: Float> {
    /// The path's radiance with what the surface gives off.
    pub radiance: Color<F>,
    /// To one point of one light.
    pub shadow: ShadowRay<F>,
    /// Where the path goes on, without its radiance.
    pub next: Path<F>,
    /// Whether it does.
    pub goes_on: F::Mask,
    /// What the hit means to shared paths, if there are any.
    pub shared: Option<Shared<F>>,
}

/// Its radiance when the path has hit nothing; it ends there.
#[inline(always)]
pub fn miss<F: Float>(frame: &Frame, photons: Option<Photons>, path: &Path<F>, mask: F::Mask) -> Color<F> {
    let scene = &frame.scene;
    let mut light = environment::radiance(&scene.environment, path.direction, mask);
    let found = mask & path.pdf.gt(F::zero());
    if found.any() && scene.environment.panorama.is_some() {
        // The environment is the last of them.
        let around = F::Int::splat((scene.emitters.len() as u32).wrapping_sub(1));
        let other = environment::pdf(&scene.environment, path.direction, found)
            * chance_of(frame, path, around, found);
        light = light * F::select(found, heuristic(path.pdf, other), F::one());
    }
    if let Some(photons) = photons
        && scene.environment.panorama.is_some()
    {
        let density = photons.plan.emission.sky_density(scene, path.direction, mask);
        light = light * photons.left_to_path(path, density, F::Mask::from_bits(0), mask);
    }
    path.radiance + limited(frame, path, path.throughput * light)
}

/// Clamps light as the settings say; what the camera sees directly, or straight through surfaces, never is.
#[inline(always)]
pub(super) fn limited<F: Float>(frame: &Frame, path: &Path<F>, light: Color<F>) -> Color<F> {
    let Some(most) = frame.clamp else { return light };
    let largest = light.max_component();
    let bright = largest.gt(F::splat(most)) & !path.branch.eq(F::Int::splat(0));
    light * F::select(bright, F::splat(most) / largest.max(F::splat(1e-30)), F::one())
}

/// Looks up hits of one material.
#[inline(always)]
pub fn hit<F: Float>(
    frame: &Frame,
    photons: Option<Photons>,
    path: &Path<F>,
    hit: &HitLanes<F>,
    material: u32,
    mask: F::Mask,
) -> VertexOutcome<F> {
    let scene = &frame.scene;
    let record = &scene.materials[material as usize];
    let surface = Surface::new(&scene.geometry, &path.ray(), hit, mask);
    let width = path.width + path.spread * hit.t;
    let point = shading_point(frame, path, hit, material, &surface, width, mask);
    let key = path.only_key(frame.seed);
    let flight = medium::flight(frame, path, hit.t, mask);
    let path = &Path { throughput: flight.throughput, ..*path };
    let mut out = VertexOutcome {
        radiance: path.radiance,
        shadow: ShadowRay::none(),
        next: *path,
        goes_on: F::Mask::from_bits(0),
        shared: None,
    };
    let arrives = mask & !flight.scattered;
    if flight.scattered.any() {
        (out.next, out.goes_on) = medium::scattered(frame, path, &flight, key);
        out.next.landing = elsewhere::<F>(path.landing);
        out.shadow = F::outlined(LitWithin { frame, path, flight: &flight, key }).shadow;
        if !arrives.any() {
            return out;
        }
    }
    let radiance = given_off(frame, photons, path, hit, &point, arrives);
    out.radiance = Color::select(arrives, radiance, path.radiance);
    let boundary = boundary(scene, path, &surface, record, arrives);
    let gone = arrives & boundary.gone;
    let elsewhere = flight.scattered | gone;
    if gone.any() {
        let (next, again) = unhindered(path, &surface, &boundary, record, hit.t, width);
        out.next = Path::select(gone, &next, &out.next);
        out.goes_on = out.goes_on | (gone & again);
    }
    // The last ray only looks for emitters, because the light sampled before relies on its share.
    let arrives = arrives & !gone;
    let here = arrives & !is_last(frame, path);
    // What goes straight through is no bounce.
    let draws = if record.straight { arrives } else { here };
    if record.unlit || !draws.any() {
        return out;
    }
    let vertex = ScatteringVertex {
        frame,
        photons,
        path,
        boundary,
        surface: &surface,
        point: &point,
        key,
        here,
        draws,
        t: hit.t,
        width,
    };
    // Most surfaces are matte, and code that knows it is shorter: the same operations without those on nothing.
    let scattered = if point.has().is_matte() {
        F::outlined(Scatter::<F, true>(&vertex))
    } else {
        F::outlined(Scatter::<F, false>(&vertex))
    };
    if elsewhere.any() {
        // These lanes already have their direction.
        out.shadow = ShadowRay::select(draws, &scattered.shadow, &out.shadow);
        out.next = Path::select(draws, &scattered.next, &out.next);
    } else {
        (out.shadow, out.next) = (scattered.shadow, scattered.next);
    }
    out.goes_on = out.goes_on | scattered.goes_on;
    out.shared = scattered.shared;
    if photons.is_some() {
        let mut light = path.throughput * scattered.gathered.light;
        if let Some(shared) = &mut out.shared {
            // What is lent is added where it is shared.
            let lent = path.throughput * scattered.gathered.diffuse;
            shared.lent.gathered = Color::select(shared.lends, lent, Color::black());
            light = light - shared.lent.gathered;
        }
        out.radiance = Color::select(here, out.radiance + limited(frame, path, light), out.radiance);
    }
    out
}

/// What lies on both sides of a surface of that material.
#[inline(always)]
pub(super) fn boundary<F: Float>(
    scene: &CompiledScene,
    path: &Path<F>,
    surface: &Surface<F>,
    record: &Material,
    mask: F::Mask,
) -> Boundary<F> {
    Boundary::new(&scene.bodies, path.bodies, &Between::of(record), surface.inside, mask)
}

/// Paths that go on where there is no boundary, and whether they do. Where rays to lights pass the surface, too, what
/// the path finds next is weighted against the light sample of the vertex before; all other rays end at it.
#[inline(always)]
pub(super) fn unhindered<F: Float>(
    path: &Path<F>,
    surface: &Surface<F>,
    boundary: &Boundary<F>,
    record: &Material,
    t: F,
    width: F,
) -> (Path<F>, F::Mask) {
    let one = F::Int::splat(1);
    let next = Path {
        origin: leave(surface.position, surface.geometric_normal, surface.offset, path.direction),
        radiance: Color::black(),
        depth: path.depth + one,
        scatterings: path.scatterings + one,
        pdf: if record.straight { path.pdf } else { F::zero() },
        travelled: path.travelled + t,
        // Photons that end behind it are not seen directly: no ray to the camera passes it.
        branch: if record.straight { path.branch } else { path.branch | F::Int::splat(SCATTERED) },
        width,
        bodies: boundary.beyond(F::Mask::from_bits(u32::MAX)),
        ..*path
    };
    (next, path.scatterings.lt(F::Int::splat(medium::MOST)) & path.throughput.max_component().gt(F::zero()))
}

/// Where a path meets a material, and its ray is `width` metres wide. What light goes straight through is looked up
/// without a width: rays to lights, which have none, must find the same.
#[inline(always)]
pub(super) fn shading_point<'a, F: Float>(
    frame: &'a Frame,
    path: &Path<F>,
    hit: &'a HitLanes<F>,
    material: u32,
    surface: &'a Surface<F>,
    width: F,
    mask: F::Mask,
) -> ShadingPoint<'a, F> {
    let scene = &frame.scene;
    let width = if scene.materials[material as usize].straight { F::zero() } else { width };
    ShadingPoint::new(scene, material, hit, surface, path.direction, width, mask)
}

/// Where a surface scatters light.
pub(super) struct ScatteringVertex<'a, F: Float> {
    pub frame: &'a Frame,
    /// The photons that end there, if there are any.
    pub photons: Option<Photons<'a>>,
    pub path: &'a Path<F>,
    pub boundary: Boundary<F>,
    pub surface: &'a Surface<F>,
    pub point: &'a ShadingPoint<'a, F>,
    pub key: Key<F::Int>,
    /// Where it does so.
    pub here: F::Mask,
    /// Where the path may at least go straight on.
    pub draws: F::Mask,
    pub t: F,
    pub width: F,
}

/// What a surface scatters.
struct Scattered<F: Float> {
    shadow: ShadowRay<F>,
    next: Path<F>,
    goes_on: F::Mask,
    /// The light of photons that leaves it to the viewer.
    gathered: Gathered<F>,
    shared: Option<Shared<F>>,
}

/// [`ScatteringVertex::scatter`] as a function of its own, for surfaces that are all [`Has::MATTE`], or not.
struct Scatter<'v, 'a, F: Float, const MATTE: bool>(&'v ScatteringVertex<'a, F>);

impl<F: Float, const MATTE: bool> Outlined for Scatter<'_, '_, F, MATTE> {
    type Output = Scattered<F>;
    #[inline(always)]
    fn run(self) -> Scattered<F> {
        let Self(vertex) = self;
        vertex.scatter(if MATTE { Has::MATTE } else { vertex.point.has() })
    }
}

impl<F: Float> ScatteringVertex<'_, F> {
    /// Samples one light and draws one direction at a surface with such lobes.
    #[inline(always)]
    fn scatter(&self, has: Has) -> Scattered<F> {
        let Self { frame, path, surface, point, key, here, draws, .. } = *self;
        let boundary = &self.boundary;
        let bsdf = bsdf(has, frame, path, point, &boundary.outside, key, draws);
        let mut light = to_light(frame, path, surface, boundary, &bsdf, key, here);
        let drawn = drawn(frame, path, &bsdf, key, draws);
        let (mut next, goes_on) = self.onward(&drawn);
        next.facing = faces(frame, surface, &bsdf);
        let mut gathered = Gathered::nothing();
        if let Some(photons) = self.photons {
            gathered = self.with_photons(photons, &bsdf, &drawn, &mut light.0, &mut next);
        }
        let mut shared = None;
        if frame.sharing.is_some() {
            let light = (light.0.ray.direction, light.1);
            let vertex = lend::Vertex { point, bsdf: &bsdf, light, drawn: &drawn };
            shared = Some(lend::shared(path, &vertex, here));
        }
        Scattered { shadow: light.0, next, goes_on, gathered, shared }
    }

    /// Where a path goes on in a drawn direction.
    #[inline(always)]
    pub fn onward(&self, drawn: &BsdfSample<F>) -> (Path<F>, F::Mask) {
        let Self { frame, path, surface, key, width, .. } = *self;
        let (mut next, mut goes_on) = reflected(frame, path, surface, &self.boundary, drawn, key, width);
        if self.point.material.straight {
            self.go_straight_on(drawn, &mut next, &mut goes_on);
        }
        (next, goes_on)
    }

    /// Lets paths that go straight through continue as if they had passed a filter and no vertex. So what they find is
    /// weighted against the light sample of the vertex before, whose ray went through the surface, too.
    #[inline(always)]
    fn go_straight_on(&self, drawn: &BsdfSample<F>, next: &mut Path<F>, goes_on: &mut F::Mask) {
        let Self { path, here, .. } = *self;
        let passes = goes_straight(drawn) & self.boundary.is_straight(self.point.material);
        let again = path.scatterings.lt(F::Int::splat(medium::MOST));
        *goes_on = *goes_on & ((passes & again) | (here & !passes));
        next.direction = Vector::select(passes, path.direction, next.direction);
        next.branch = F::Int::select(passes, path.branch, next.branch);
        next.pdf = F::select(passes, path.pdf, next.pdf);
        next.facing = F::Int::select(passes, path.facing, next.facing);
        next.travelled = F::select(passes, path.travelled + self.t, next.travelled);
        let one = F::Int::splat(1);
        next.scatterings = F::Int::select(passes, path.scatterings + one, path.scatterings);
    }
}

/// The lanes whose direction leads straight through a surface that bends no light.
#[inline(always)]
pub(super) fn goes_straight<F: Float>(drawn: &BsdfSample<F>) -> F::Mask {
    drawn.through & !drawn.wide & drawn.pdf.le(F::zero())
}

/// What the surface, which has such lobes, does to light, of the wavelength that the path follows if it follows one.
#[inline(always)]
pub(super) fn bsdf<F: Float>(
    has: Has,
    frame: &Frame,
    path: &Path<F>,
    point: &ShadingPoint<F>,
    outside: &Outside<F>,
    key: Key<F::Int>,
    mask: F::Mask,
) -> Bsdf<F> {
    let mut parameters = point.parameters(has, outside);
    let Material { ior, dispersion, .. } = *point.material;
    let disperses = !outside.is_air && (mask & outside.dispersion.gt(F::zero())).any();
    let has = Has { dispersion: has.dispersion | (has.solid && disperses), ..has };
    if has.dispersion {
        // One number for the whole path: it always chooses the same colour, and wavelength.
        let dimension = Dimension::Wavelength.at(F::Int::splat(0));
        let u = draw_2d(frame.sampler, frame.samples, key, dimension);
        let boundary = Dispersive { ior, dispersion, outside, inside: point.surface.inside };
        parameters.split(&boundary, path.throughput, u);
    }
    Bsdf::new(has, parameters, frame.lobes, point.to_viewer, mask)
}

/// The path's radiance, including what the surface emits.
#[inline(always)]
fn given_off<F: Float>(
    frame: &Frame,
    photons: Option<Photons>,
    path: &Path<F>,
    hit: &HitLanes<F>,
    point: &ShadingPoint<F>,
    mask: F::Mask,
) -> Color<F> {
    if point.material.unlit {
        // It shows its colour even to a camera within a body.
        return path.radiance + path.throughput * (point.base_color() * F::splat(1.0 / frame.around_square));
    }
    if !point.material.emits() {
        return path.radiance;
    }
    let mut light = point.emission() * emission_share(frame, path, hit, mask);
    if let Some(photons) = photons {
        light = light * photons.left_of_hit(path, hit, mask);
    }
    let found = medium::emitted(frame, path.bodies, path.throughput * light, mask);
    path.radiance + limited(frame, path, found)
}

/// Where a surface faces, for choosing lights.
#[inline(always)]
fn faces<F: Float>(frame: &Frame, surface: &Surface<F>, bsdf: &Bsdf<F>) -> F::Int {
    if frame.scene.emitters.len() < 2 {
        return F::Int::splat(NONE);
    }
    facing(surface.geometric_normal, bsdf.lets_through())
}

/// A point of a light.
pub(super) struct LightPoint<F: Float> {
    /// The light.
    pub emitter: F::Int,
    /// Probability times density.
    density: F,
    /// The weight of finding it this way.
    pub share: F,
    /// Value · |cos| towards it.
    value: Color<F>,
    sample: EmitterSample<F>,
}

/// Chooses a light and a point of it.
#[inline(always)]
pub(super) fn sampled_light<F: Float>(
    frame: &Frame,
    path: &Path<F>,
    surface: &Surface<F>,
    bsdf: &Bsdf<F>,
    key: Key<F::Int>,
    mask: F::Mask,
) -> LightPoint<F> {
    let scene = &frame.scene;
    // Seen from where drawn directions begin, too: on a light itself the difference matters.
    let position = surface.position + surface.geometric_normal * surface.offset;
    let facing = faces(frame, surface, bsdf);
    let (emitter, chance, u) = choose(frame, position, facing, (path.depth, key), mask);
    let sample = emitter::sample(scene, emitter, position, u, mask);
    let (value, own) = bsdf.evaluate(sample.direction, mask);
    let density = sample.pdf * chance;
    let share = F::select(sample.shared, heuristic(density, own), F::one());
    LightPoint { emitter, density, share, value, sample }
}

/// The shadow ray to a point of a light, and value · |cos| towards it.
#[inline(always)]
fn to_light<F: Float>(
    frame: &Frame,
    path: &Path<F>,
    surface: &Surface<F>,
    boundary: &Boundary<F>,
    bsdf: &Bsdf<F>,
    key: Key<F::Int>,
    here: F::Mask,
) -> (ShadowRay<F>, Color<F>) {
    let scene = &frame.scene;
    let mask = here & bsdf.scatters();
    if scene.emitters.is_empty() || !mask.any() {
        return (ShadowRay::none(), Color::black());
    }
    let zero = F::zero();
    let LightPoint { emitter, density, share, value, sample } =
        sampled_light(frame, path, surface, bsdf, key, mask);
    let light = value * sample.radiance * (share / density.max(F::splat(1e-30)));
    let through = sample.direction.dot(surface.geometric_normal).lt(zero);
    let bodies = boundary.beyond(through);
    // Nothing that is infinitely far away is in a body, however open that is.
    let somewhere = mask & sample.distance.lt(F::splat(f32::INFINITY));
    let contribution = medium::emitted(frame, bodies, path.throughput * light, somewhere);
    let origin = leave(surface.position, surface.geometric_normal, surface.offset, sample.direction);
    let shadow = ShadowRay {
        ray: Ray {
            origin,
            direction: sample.direction,
            t_min: zero,
            t_max: sample.distance * F::splat(SHADOW_END),
        },
        contribution,
        emitter,
        bodies,
        mask: mask & density.gt(zero) & contribution.max_component().gt(zero),
    };
    (shadow, value)
}

/// A direction from a lobe.
#[inline(always)]
pub(super) fn drawn<F: Float>(
    frame: &Frame,
    path: &Path<F>,
    bsdf: &Bsdf<F>,
    key: Key<F::Int>,
    mask: F::Mask,
) -> BsdfSample<F> {
    let which = if bsdf.lets_microfacets_through() {
        draw_1d(frame.sampler, frame.samples, key, Dimension::Through.at(path.depth))
    } else {
        F::zero()
    };
    let mut u = draw_2d(frame.sampler, frame.samples, key, Dimension::Scatter.at(path.depth));
    if let Some(grouping) = &frame.sharing
        && frame.sampler == Sampler::Sobol
    {
        let first = mask & path.depth.eq(F::Int::splat(0));
        if first.any() {
            let joint =
                grouping.joint(frame.seed, path.pixel, path.sample, Dimension::Scatter.at(path.depth));
            u = (F::select(first, joint.0, u.0), F::select(first, joint.1, u.1));
        }
    }
    bsdf.sample(which, u, mask)
}

/// The path that leaves a surface, if it goes on.
#[inline(always)]
fn reflected<F: Float>(
    frame: &Frame,
    path: &Path<F>,
    surface: &Surface<F>,
    boundary: &Boundary<F>,
    drawn: &BsdfSample<F>,
    key: Key<F::Int>,
    width: F,
) -> (Path<F>, F::Mask) {
    let zero = F::zero();
    let BsdfSample { direction, weight, pdf, valid, through, wide } = *drawn;
    let throughput = path.throughput * weight;
    let goes_on = valid & throughput.max_component().gt(zero);
    // Paths through glass and between mirrors are few and bright: ending one of them shows.
    let (throughput, survives) = roulette(frame, path, throughput, key, wide);
    let goes_on = goes_on & survives;
    let mut branch = bounces::counted::<F>(path.branch, wide, through);
    if let Some(limits) = &frame.limits {
        branch = bounces::limited::<F>(limits, branch);
    }
    // A wide lobe blurs what is seen in it over about this angle.
    let spread = path.spread + F::select(wide, F::splat(0.2), zero);
    let next = Path {
        origin: leave(surface.position, surface.geometric_normal, surface.offset, direction),
        direction,
        throughput,
        radiance: Color::black(),
        branch,
        depth: path.depth + F::Int::splat(1),
        pdf,
        width,
        spread,
        bodies: boundary.beyond(through),
        travelled: zero,
        ..*path
    };
    (next, goes_on)
}
