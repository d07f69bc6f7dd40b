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

/// An unseen lamp that paths may have found.
struct FoundLamp<F: Float> {
    emitter: u32,
    /// The distance from where the paths' directions were drawn.
    distance: F,
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
    let mut search = LampSearch::new(setup, photons, path, t, mask);
    while let Some(lamp) = search.next_lamp() {
        sum = sum + lamp.light;
        let group = group_of(setup, lamp.emitter);
        if group != NONE || setup.groups_by_path() {
            found.add(path, group_for(setup, path, F::Int::splat(group)), lamp.light, false, lamp.mask);
        }
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
    let mut search = LampSearch::new(setup, photons, path, t, finders::<f32>(path));
    while let Some(FoundLamp { emitter, distance, mask, weight, light }) = search.next_lamp() {
        all.extend(mask.then_some(LampDecision { emitter, distance, weight, light }));
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

/// The search for unseen lamps along paths: first those at a finite place, then those in the sky.
struct LampSearch<'a, F: Float> {
    setup: &'a RenderSetup,
    photons: Option<PhotonMaps<'a>>,
    path: &'a Path<F>,
    rays: LampRays<F>,
    walk: LampWalk<'a, F>,
    /// The lanes that reach the sky, and the number of lamps there that are done.
    distant: (F::Mask, usize),
}

impl<'a, F: Float> LampSearch<'a, F> {
    #[inline(always)]
    fn new(
        setup: &'a RenderSetup,
        photons: Option<PhotonMaps<'a>>,
        path: &'a Path<F>,
        t: F,
        mask: F::Mask,
    ) -> Self {
        let lamps = &setup.scene.emitters.unseen;
        let rays = LampRays { origin: path.seen_from(), direction: path.direction, end: path.travelled + t };
        let walk = LampWalk::new(lamps, rays, mask & finds_placed::<F>(path));
        let escapes = mask & finds_distant::<F>(path) & t.eq(F::splat(f32::INFINITY));
        Self { setup, photons, path, rays, walk, distant: (escapes, 0) }
    }

    /// The next lamp that may be found.
    #[inline(always)]
    fn next_lamp(&mut self) -> Option<FoundLamp<F>> {
        let Self { setup, path, rays, .. } = *self;
        let emitters = &setup.scene.emitters;
        if let Some((lamp, near)) = self.walk.next_lamp() {
            let hit = meet(emitters, lamp, &rays);
            // It ends like a shadow ray to the lamp.
            let until = hit.distance * F::splat(SHADOW_END);
            let mask = near & hit.mask & until.lt(rays.end) & until.ge(path.travelled);
            let way = hit.distance - path.travelled;
            let throughput = medium::attenuated(setup, path.throughput, path.bodies, way, mask);
            let throughput = medium::emitted(setup, path.bodies, throughput, mask);
            return Some(self.found(lamp, &hit, throughput, mask));
        }
        let (escapes, done) = self.distant;
        let lamp = *emitters.unseen.distant.get(done).filter(|_| escapes.any())?;
        self.distant.1 += 1;
        let hit = meet_distant(emitters, lamp, path.direction);
        Some(self.found(lamp, &hit, path.throughput, escapes & hit.mask))
    }

    /// The light of a lamp, with its weight.
    #[inline(always)]
    fn found(&self, emitter: u32, hit: &LampHit<F>, throughput: Color<F>, mask: F::Mask) -> FoundLamp<F> {
        let Self { setup, photons, path, .. } = *self;
        let lanes = F::Int::splat(emitter);
        let mut weight = mis_weight(setup, path, lanes, hit.distance, mask);
        if let Some(photons) = photons {
            weight = weight * photons.left_of_emitter(path, lanes, mask);
        }
        let light = limited(setup, path, throughput * hit.radiance * weight);
        let light = Color::select(mask, light, Color::black());
        FoundLamp { emitter, distance: hit.distance, mask, weight, light }
    }
}
