//! The Whitted transport with distributed shadow and lens rays, at one vertex. Both schedules call these functions and
//! nothing else; only they and those of [`super::path_tracing`] read or write throughput and radiance.
//!
//! A path's radiance is summed in the order of its vertices: at each vertex first the surface's emission, then the
//! lights in order and each light's samples in order. A fork begins without radiance and needs no join: the film's sums
//! are exact.

use super::medium::MOST;
use crate::integrator::RenderSetup;
use crate::integrator::path::light_groups::{GroupQueue, find_around, group_for, group_of_sample};
use crate::integrator::path::shadow::ShadowRay;
use crate::integrator::path::{Path, camera_path};
use crate::integrator::photons::PhotonMaps;
use crate::integrator::photons::gather::{PhotonsWanted, Receiver, first_radius};
use crate::math::{Color, NONE, Ray, Vector};
use crate::sampling::Dimension;
use crate::sampling::hash::combine;
use crate::sampling::pattern::point_of_many;
use crate::scene::CompiledScene;
use crate::scene::bodies::NOWHERE;
use crate::shading::blinn_phong::BlinnPhongParams;
use crate::shading::boundary::Boundary;
use crate::shading::surface::offset_origin;
use crate::shading::whitted_params::Shaded;
use crate::shading::{HitLanes, Surface, emitter, environment, fresnel};
use crate::simd::{Float, Int, Mask};

/// Returns the light that paths find which have hit nothing. It is also added to `found`, by its group.
#[inline(always)]
pub fn miss<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    mask: F::Mask,
    found: &mut GroupQueue,
) -> Color<F> {
    let mut around = mask;
    let environment = &setup.scene.environment;
    let mut light = environment::radiance(environment, path.direction, F::Mask::first(F::WIDTH));
    if let Some(backdrop) = environment::backdrop(environment, path.direction) {
        let is_seen = path.pdf.eq(F::zero());
        light = Color::select(is_seen, backdrop, light);
        around = around & !is_seen;
    }
    let seen = mask & path.pdf.lt(F::splat(MIRRORED));
    find_around(setup, path, path.throughput * light, [around, seen], found)
}

/// The value of [`Path::pdf`] of paths that were reflected.
const MIRRORED: f32 = 1.0;
/// That of paths that were bent, but never reflected. Those that have only gone straight on have 0.
const BENT: f32 = 0.5;

/// The least cosine between directions that count as one.
const STRAIGHT: f32 = 1.0 - 1e-5;

/// The data of a hit that the lights need.
#[derive(Clone, Copy)]
pub struct WhittedVertex<F: Float> {
    /// The position in world space.
    pub position: Vector<F>,
    /// See `Surface::offset`.
    pub offset: F,
    /// The normal of the surface itself, on the viewer's side.
    pub geometric_normal: Vector<F>,
    /// The shading normal, on the viewer's side.
    pub normal: Vector<F>,
    /// The reflection model.
    pub model: BlinnPhongParams<F>,
}

/// The continuations of a path from a hit. If a lane is in both masks, the path goes on with the reflection, and the
/// refraction forks off.
pub struct WhittedScatter<F: Float> {
    /// The direction of reflection.
    pub reflect: Vector<F>,
    /// Throughput along it.
    pub reflect_throughput: Color<F>,
    /// The lanes that reflect.
    pub reflects: F::Mask,
    /// The direction of refraction.
    pub refract: Vector<F>,
    /// Throughput along it.
    pub refract_throughput: Color<F>,
    /// The lanes that refract.
    pub refracts: F::Mask,
    /// The bodies that the refracted path is in.
    pub behind: F::Int,
    /// The lanes without a boundary, for which this is no bounce.
    pub gone: F::Mask,
    /// The width of the path's ray at the hit, in metres.
    pub width: F,
}

/// Evaluates a hit: returns what the lights need, the path's continuations, and its radiance including the surface's
/// emission. The light that paths find there is also added to `found`, by its light group.
#[inline(always)]
pub fn hit<F: Float>(
    setup: &RenderSetup,
    photons: Option<PhotonMaps>,
    path: &Path<F>,
    hit: &HitLanes<F>,
    mask: F::Mask,
    found: &mut GroupQueue,
) -> (WhittedVertex<F>, WhittedScatter<F>, Color<F>) {
    let scene = &setup.scene;
    let surface = Surface::new(&scene.geometry, &path.ray(), hit, mask);
    let width = path.width + path.spread * hit.t;
    let mut shaded = Shaded::new(scene, hit, &surface, path.direction, width, mask);
    let boundary = Boundary::<F>::new(&scene.bodies, path.bodies, &shaded.between, surface.inside, mask);
    if boundary.gone.any() {
        shaded = shaded.without(boundary.gone);
    }
    let own = shaded.emission + shaded.model.diffuse * Color::splat(scene.ambient);
    let mut radiance = path.radiance + path.throughput * own;
    if setup.light_groups() > 0 {
        let group = group_for(setup, path, groups_of(scene, surface.material, mask));
        found.add(path, group, path.throughput * shaded.emission, false, mask);
    }
    // Photons that the camera sees directly are splatted instead.
    let indirect = mask & !path.depth.eq(F::Int::splat(0));
    if let Some(photons) = photons
        && indirect.any()
    {
        let (normal, own) = (shaded.normal, surface.geometric_normal);
        let answer = WhittedReceiver { model: &shaded.model, normal, own, to_viewer: -path.direction };
        let width = width * F::splat(photons.plan.pixels) / camera_path::footprint::<F>(path.sample);
        let first = first_radius(path, width, &surface);
        let mut wanted = PhotonsWanted { max_depth: setup.max_depth, diffuse: false, group: None };
        let light = photons.gather(wanted, path, &surface, &answer, first, indirect).light;
        radiance = Color::select(indirect, radiance + path.throughput * light, radiance);
        for group in 0..setup.lamp_groups() as u32 {
            wanted.group = Some(group);
            let light = photons.gather(wanted, path, &surface, &answer, first, indirect).light;
            found.add(path, F::Int::splat(group), path.throughput * light, false, indirect);
        }
    }
    let scatter = scatter(setup, &Path { width, ..*path }, &surface, &shaded, &boundary, mask);
    let vertex = WhittedVertex {
        position: surface.position,
        offset: surface.offset,
        geometric_normal: surface.geometric_normal,
        normal: shaded.normal,
        model: shaded.model,
    };
    (vertex, scatter, radiance)
}

/// The light groups of materials.
#[inline(always)]
fn groups_of<I: Int>(scene: &CompiledScene, material: I, mask: I::Mask) -> I {
    let mut materials = [0; 16];
    material.store(&mut materials);
    let mut groups = [NONE; 16];
    let mut bits = mask.bits();
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        groups[lane] = scene.materials[materials[lane] as usize].group;
    }
    I::load(&groups)
}

/// The Blinn-Phong model as a receiver of photons.
struct WhittedReceiver<'a, F: Float> {
    model: &'a BlinnPhongParams<F>,
    normal: Vector<F>,
    /// The normal of the surface itself, on the viewer's side.
    own: Vector<F>,
    to_viewer: Vector<F>,
}

impl<F: Float> Receiver<F> for WhittedReceiver<'_, F> {
    #[inline(always)]
    fn receive(&self, from: Vector<F>, _: F::Mask) -> (Color<F>, F) {
        let value = self.model.evaluate(self.normal, self.to_viewer, from);
        // Diffuse surfaces transmit no light.
        (Color::select(from.dot(self.own).gt(F::zero()), value, Color::black()), F::zero())
    }

    #[inline(always)]
    fn diffuse_part(&self, _: Vector<F>, _: Color<F>, _: F::Mask) -> Color<F> {
        Color::black()
    }
}

/// Computes reflection and refraction with their weights.
#[inline(always)]
pub(in crate::integrator) fn scatter<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    surface: &Surface<F>,
    shaded: &Shaded<F>,
    boundary: &Boundary<F>,
    mask: F::Mask,
) -> WhittedScatter<F> {
    // Passing where there is no boundary is no bounce.
    let last = !path.depth.lt(F::Int::splat(setup.max_depth) + path.scatterings);
    let again = path.scatterings.lt(F::Int::splat(MOST));
    let goes_on = mask & ((boundary.gone & again) | (!boundary.gone & !last));
    let normal = shaded.normal;
    let direction = path.direction;
    let mut reflect_weight = shaded.kr;
    let mut refract_weight = Color::black();
    let mut refract = direction;
    if shaded.any_refracts(goes_on) {
        let clear = shaded.ior.gt(F::zero());
        let ior = F::select(clear, shaded.ior, F::one());
        let outside = boundary.outside.index;
        let outside = F::select(shaded.between.number.eq(F::Int::splat(0)), F::one(), outside);
        let eta = F::select(surface.inside, ior / outside, outside / ior);
        let bent = fresnel::boundary(direction, normal, eta);
        let reflectance = F::select(clear, bent.reflectance, F::one());
        reflect_weight = shaded.kr * reflectance;
        refract_weight = Color::select(clear, shaded.kt * (F::one() - reflectance), Color::black());
        refract = bent.refracted;
    }
    if boundary.gone.any() {
        refract_weight = Color::select(boundary.gone, Color::grey(F::one()), refract_weight);
        refract = Vector::select(boundary.gone, direction, refract);
    }
    // With an interpolated normal both can end up on the wrong side of the surface: then the surface's own normal
    // reflects, and the refraction goes straight on.
    let mirrored = fresnel::reflect(direction, normal);
    let through = mirrored.dot(surface.geometric_normal).le(F::zero());
    let reflect = Vector::select(through, fresnel::reflect(direction, surface.geometric_normal), mirrored);
    let stays = refract.dot(surface.geometric_normal).ge(F::zero());
    let refract = Vector::select(stays, direction, refract);

    let least = F::splat(setup.min_throughput);
    let reflect_throughput = path.throughput * reflect_weight;
    let refract_throughput = path.throughput * refract_weight;
    WhittedScatter {
        // Keeps unit length to the last bits over any number of bounces.
        reflect: reflect.normalize(),
        reflect_throughput,
        reflects: goes_on & reflect_throughput.max_component().gt(least),
        refract,
        refract_throughput,
        refracts: goes_on & refract_throughput.max_component().gt(least),
        behind: boundary.beyond(F::Mask::from_bits(u32::MAX)),
        gone: boundary.gone,
        width: path.width,
    }
}

impl<F: Float> WhittedScatter<F> {
    /// The lanes whose refraction is a path of its own and begins without radiance; in all others the path itself goes
    /// on.
    #[inline(always)]
    pub fn forks(&self) -> F::Mask {
        self.reflects & self.refracts
    }

    /// The reflected path, without its radiance.
    #[inline(always)]
    pub fn reflected(&self, path: &Path<F>, vertex: &WhittedVertex<F>) -> Path<F> {
        let nobody = F::Mask::from_bits(0);
        let path = &Path { width: self.width, ..*path };
        follow(path, vertex, self.reflect, self.reflect_throughput, MIRRORED, nobody)
    }

    /// The refracted path, without its radiance.
    #[inline(always)]
    pub fn refracted(&self, path: &Path<F>, vertex: &WhittedVertex<F>) -> Path<F> {
        let one = F::Int::splat(1);
        let scatterings = F::Int::select(self.gone, path.scatterings + one, path.scatterings);
        let path = &Path { width: self.width, bodies: self.behind, scatterings, ..*path };
        follow(path, vertex, self.refract, self.refract_throughput, BENT, self.forks())
    }
}

/// The path from a vertex along a direction; forked paths draw other random numbers. `turned` is the least [`Path::pdf`]
/// of paths that have not gone straight on.
#[inline(always)]
fn follow<F: Float>(
    path: &Path<F>,
    vertex: &WhittedVertex<F>,
    direction: Vector<F>,
    throughput: Color<F>,
    turned: f32,
    forked: F::Mask,
) -> Path<F> {
    let depth = path.depth + F::Int::splat(1);
    let is_straight = direction.dot(path.direction).gt(F::splat(STRAIGHT));
    Path {
        origin: offset_origin(vertex.position, vertex.geometric_normal, vertex.offset, direction),
        direction,
        pdf: F::select(is_straight, path.pdf, path.pdf.max(F::splat(turned))),
        throughput,
        radiance: Color::black(),
        bounce_counts: F::Int::select(forked, combine(path.bounce_counts, depth), path.bounce_counts),
        depth,
        ..*path
    }
}

/// The shadow ray from a vertex to sample `which` of a light.
#[inline(always)]
pub fn light_ray<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    vertex: &WhittedVertex<F>,
    light: usize,
    which: u32,
    mask: F::Mask,
) -> ShadowRay<F> {
    let policy = &setup.scene.lights[light];
    let u = match policy.grid {
        Some(grid) => {
            let key = path.key(setup.seed).fork((light as u32).wrapping_mul(0x9e37) ^ 0x51ed);
            let dimension = Dimension::Light.at(path.depth);
            let (across, up) = point_of_many::<F>(policy.pattern, grid, which, setup.samples, key, dimension);
            (up, across)
        }
        // Point and directional lights need no random point.
        None => (F::zero(), F::zero()),
    };
    let sample = emitter::sample_light(&setup.scene, policy.emitter, vertex.position, u);
    let irradiance = sample.radiance * (F::one() / (sample.pdf * F::splat(policy.samples as f32)));
    let zero = F::zero();
    let to_light = sample.direction;
    let lit = vertex.normal.dot(to_light).gt(zero) & vertex.geometric_normal.dot(to_light).gt(zero);
    let answer = vertex.model.evaluate(vertex.normal, -path.direction, to_light);
    let contribution = path.throughput * (answer * irradiance);
    let origin = offset_origin(vertex.position, vertex.geometric_normal, vertex.offset, to_light);
    ShadowRay {
        ray: Ray {
            origin,
            direction: to_light,
            t_min: zero,
            t_max: sample.distance * F::splat(emitter::SHADOW_END),
        },
        contribution,
        emitter: F::Int::splat(policy.emitter),
        path_group: group_of_sample(setup, path, F::Mask::from_bits(0)),
        bodies: F::Int::splat(NOWHERE),
        mask: mask & lit & contribution.max_component().gt(zero),
    }
}
