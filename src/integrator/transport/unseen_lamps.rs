//! Unseen lamps ([`crate::scene::emitters::UnseenLamps`]) under the path transport: the light that paths find in them on
//! their way to the next surface.
//!
//! Light samples and these weigh each other as at the surfaces of visible lamps. Rays of the camera pass the lamps, and so
//! do directions without a density behind a blurred bounce, which would find small lamps as fireflies: photons bring that
//! light.

use super::medium;
use super::path_tracing::limited;
use crate::integrator::RenderSetup;
use crate::integrator::observe::decision::LampDecision;
use crate::integrator::path::Path;
use crate::integrator::path::bounces::{self, BLURRED, FREE_EVENT, FROM_CATCHER, LobeKind};
use crate::integrator::path::light_groups::{GroupQueue, group_for, group_of};
use crate::integrator::path::mis::mis_weight;
use crate::integrator::photons::PhotonMaps;
use crate::math::{Color, NONE};
use crate::shading::emitter::SHADOW_END;
use crate::shading::unseen_lamps::{LampHit, LampRays, LampWalk, meet, meet_distant};
use crate::simd::{Float, Int, Mask};
use crate::world::Transport;

/// An unseen lamp that paths have met.
struct FoundLamp<F: Float> {
    /// The lanes whose path finds its light.
    mask: F::Mask,
    /// The MIS weight, times the part that photons leave to the path.
    weight: F,
    /// The radiance that reaches the film.
    light: Color<F>,
}

/// True if paths may meet unseen lamps.
pub fn exist(setup: &RenderSetup) -> bool {
    !setup.scene.emitters.unseen.is_empty() && setup.transport == Transport::Path
}

/// The light of unseen lamps that paths find up to the hit of their ray at distance `t`, infinite if there is none. It
/// is also added to `found`, by its group.
#[inline(always)]
pub fn found<F: Float>(
    setup: &RenderSetup,
    photons: Option<PhotonMaps>,
    path: &Path<F>,
    t: F,
    mask: F::Mask,
    found: &mut GroupQueue,
) -> Color<F> {
    let mut sum = Color::black();
    let mask = mask & finders::<F>(path);
    if !mask.any() {
        return sum;
    }
    let lamps = &setup.scene.emitters.unseen;
    let end = path.travelled + t;
    let rays = LampRays { origin: path.seen_from(), direction: path.direction, end };
    let mut walk = LampWalk::new(lamps, rays, mask & finds_placed::<F>(path));
    while let Some((lamp, near)) = walk.next_lamp() {
        let hit = meet(&setup.scene.emitters, lamp, &rays);
        let lit = of_placed(setup, photons, path, lamp, &hit, end, near);
        sum = add(setup, path, lamp, &lit, sum, found);
    }
    let distant = mask & finds_distant::<F>(path) & t.eq(F::splat(f32::INFINITY));
    for lamp in lamps.distant.iter().filter(|_| distant.any()) {
        let hit = meet_distant(&setup.scene.emitters, *lamp, path.direction);
        let lit = weighted(setup, photons, path, *lamp, &hit, path.throughput, distant & hit.mask);
        sum = add(setup, path, *lamp, &lit, sum, found);
    }
    sum
}

/// All that [`found`] finds, for observers.
pub fn each_found(
    setup: &RenderSetup,
    photons: Option<PhotonMaps>,
    path: &Path<f32>,
    t: f32,
) -> Vec<LampDecision> {
    let mut all = Vec::new();
    if !finders::<f32>(path) {
        return all;
    }
    let lamps = &setup.scene.emitters.unseen;
    let end = path.travelled + t;
    let rays = LampRays { origin: path.seen_from(), direction: path.direction, end };
    let mut walk = LampWalk::new(lamps, rays, finds_placed::<f32>(path));
    while let Some((emitter, near)) = walk.next_lamp() {
        let hit = meet(&setup.scene.emitters, emitter, &rays);
        let FoundLamp { mask, weight, light } = of_placed(setup, photons, path, emitter, &hit, end, near);
        all.extend(mask.then_some(LampDecision { emitter, distance: hit.distance, weight, light }));
    }
    let reaches_sky = finds_distant::<f32>(path) && t == f32::INFINITY;
    for &emitter in lamps.distant.iter().filter(|_| reaches_sky) {
        let hit = meet_distant(&setup.scene.emitters, emitter, path.direction);
        let FoundLamp { mask, weight, light } =
            weighted(setup, photons, path, emitter, &hit, path.throughput, hit.mask);
        all.extend(mask.then_some(LampDecision { emitter, distance: hit.distance, weight, light }));
    }
    all
}

/// The lanes whose ray may find unseen lamps: all but the camera's, and those of shadow catchers, where light samples
/// alone find lamps.
#[inline(always)]
fn finders<F: Float>(path: &Path<F>) -> F::Mask {
    bounces::has_bounced::<F>(path.bounce_counts) & !bounces::is_set::<F>(path.bounce_counts, FROM_CATCHER)
}

/// The lanes that find discs in the sky. A direction without a density behind one that was blurred would find small lamps as
/// fireflies.
#[inline(always)]
fn finds_distant<F: Float>(path: &Path<F>) -> F::Mask {
    path.pdf.gt(F::zero()) | !bounces::is_set::<F>(path.bounce_counts, BLURRED)
}

/// The lanes that find lamps at a finite place: those, and paths that come out of a body that scatters and has no other
/// light.
#[inline(always)]
fn finds_placed<F: Float>(path: &Path<F>) -> F::Mask {
    let scattered = bounces::is_set::<F>(path.bounce_counts, FREE_EVENT);
    let through = bounces::has_counted::<F>(path.bounce_counts, LobeKind::Transmission);
    let is_matte = bounces::has_counted::<F>(path.bounce_counts, LobeKind::Diffuse);
    finds_distant::<F>(path) | (scattered & through & !is_matte)
}

/// The light of a lamp at a finite place, which ends like a shadow ray to it.
#[inline(always)]
fn of_placed<F: Float>(
    setup: &RenderSetup,
    photons: Option<PhotonMaps>,
    path: &Path<F>,
    lamp: u32,
    hit: &LampHit<F>,
    end: F,
    mask: F::Mask,
) -> FoundLamp<F> {
    let until = hit.distance * F::splat(SHADOW_END);
    let mask = mask & hit.mask & until.lt(end) & until.ge(path.travelled);
    let way = hit.distance - path.travelled;
    let throughput = medium::attenuated(setup, path.throughput, path.bodies, way, mask);
    let throughput = medium::emitted(setup, path.bodies, throughput, mask);
    weighted(setup, photons, path, lamp, hit, throughput, mask)
}

/// The weighted light of a lamp.
#[inline(always)]
fn weighted<F: Float>(
    setup: &RenderSetup,
    photons: Option<PhotonMaps>,
    path: &Path<F>,
    lamp: u32,
    hit: &LampHit<F>,
    throughput: Color<F>,
    mask: F::Mask,
) -> FoundLamp<F> {
    let mut weight = mis_weight(setup, path, F::Int::splat(lamp), hit.distance, mask);
    if let Some(photons) = photons {
        weight = weight * photons.left_of_emitter(path, F::Int::splat(lamp), mask);
    }
    let light = limited(setup, path, throughput * hit.radiance * weight);
    FoundLamp { mask, weight, light: Color::select(mask, light, Color::black()) }
}

/// Adds light to a sum and to its group.
#[inline(always)]
fn add<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    lamp: u32,
    lit: &FoundLamp<F>,
    sum: Color<F>,
    found: &mut GroupQueue,
) -> Color<F> {
    let group = group_of(setup, lamp);
    if group != NONE || setup.groups_by_path() {
        found.add(path, group_for(setup, path, F::Int::splat(group)), lit.light, false, lit.mask);
    }
    sum + lit.light
}
