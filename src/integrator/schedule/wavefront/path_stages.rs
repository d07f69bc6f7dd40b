//! Stages of the path transport, which shade hits material by material.

use super::material_ranges::MaterialRanges;
use super::queue::{HitQueue, PathQueue};
use super::shadow_queue::ShadowQueue;
use super::stages::{lanes, numbered, put_radiance};
use crate::integrator::RenderSetup;
use crate::integrator::path::Path;
use crate::integrator::path::columns::Columns;
use crate::integrator::path::light_groups::GroupQueue;
use crate::integrator::photons::{PhotonMaps, PhotonPlan};
use crate::integrator::transport::path_tracing;
use crate::integrator::transport::photon_tracing::{self, PhotonOutcome};
use crate::integrator::transport::reusable::{COLUMNS, ReusableVertex, ReuseRoles};
use crate::integrator::transport::unseen_lamps;
use crate::math::{Color, NONE};
use crate::simd::{Float, Int, Kernel, Lanes, Mask};
use crate::world::Transport;

/// Turns hits into emission, shadow rays and the next rays.
pub struct ShadePathsStage<'a> {
    /// The render setup.
    pub setup: &'a RenderSetup,
    /// The photons of the paths' samples.
    pub photons: Option<PhotonMaps<'a>>,
    /// Paths that have hit something; the surfaces' emission is added to their radiance.
    pub paths: &'a mut PathQueue,
    /// Their hits.
    pub hits: &'a HitQueue,
    /// The order in which hits are shaded.
    pub groups: &'a MaterialRanges,
    /// 1 for each path that goes on, else 0.
    pub goes_on: &'a mut [u32],
    /// The paths that go on.
    pub next: &'a mut PathQueue,
    /// The paths that fork off.
    pub forks: &'a mut PathQueue,
    /// Rays to lights.
    pub shadow: &'a mut ShadowQueue,
    /// The roles of the hits in path reuse, if required.
    pub roles: Option<&'a mut HitRoles>,
    /// The light that paths find, by group.
    pub found: &'a mut GroupQueue,
}

impl Kernel for ShadePathsStage<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let width = L::Queue::WIDTH;
        for &(material, first, end) in &self.groups.groups {
            for at in (first as usize..end as usize).step_by(width) {
                let valid = lanes::<L::Queue>(end as usize - at);
                let places = <L::Queue as Float>::Int::load(&self.groups.order[at..]);
                // The hits of a single material lie side by side and need no gather.
                let begin = self.groups.order[at] as usize;
                let side_by_side = !(valid & !places.eq(numbered(begin))).any();
                let (path, hit) = if side_by_side {
                    (self.paths.load(begin), self.hits.load(begin))
                } else {
                    (self.paths.gather(places, valid), self.hits.gather(places, valid))
                };
                let outcome =
                    path_tracing::hit(self.setup, self.photons, &path, &hit, material, valid, self.found);
                let goes_on: <L::Queue as Float>::Int =
                    Int::select(outcome.goes_on, Int::splat(1), Int::splat(0));
                put_back::<L::Queue>(self.paths, self.goes_on, places, outcome.radiance, goes_on, valid);
                self.shadow.append(&outcome.shadow, places);
                self.next.append(outcome.goes_on, &outcome.next, places);
                if let Some(fork) = &outcome.fork {
                    self.forks.append(fork.mask, &fork.next, Int::splat(NONE));
                }
                if let Some(roles) = &mut self.roles {
                    roles.put::<L::Queue>(places, outcome.reuse.as_ref(), valid);
                }
            }
        }
    }
}

/// Adds the light of the unseen lamps before the hits of paths to their radiance.
pub struct FindLampsStage<'a> {
    /// The render setup.
    pub setup: &'a RenderSetup,
    /// The photons of the paths' samples.
    pub photons: Option<PhotonMaps<'a>>,
    /// The paths.
    pub paths: &'a mut PathQueue,
    /// Their hits.
    pub hits: &'a HitQueue,
    /// The light that paths find, by group.
    pub found: &'a mut GroupQueue,
}

impl Kernel for FindLampsStage<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (width, count) = (L::Queue::WIDTH, self.paths.columns.len());
        for at in (0..count).step_by(width) {
            let valid = lanes::<L::Queue>(count - at);
            let path = self.paths.load::<L::Queue>(at);
            let hit = self.hits.load::<L::Queue>(at);
            let missed = hit.primitive.eq(Int::splat(NONE));
            let t = Float::select(missed, Float::splat(f32::INFINITY), hit.t);
            let light = unseen_lamps::found(self.setup, self.photons, &path, t, valid, self.found);
            let radiance = path.radiance + light;
            put_radiance(self.paths, radiance, at);
        }
    }
}

/// Processes photons that have hit something: they are reflected or transmitted, or end.
pub struct PhotonStage<'a> {
    /// The common setup of photons.
    pub plan: &'a PhotonPlan,
    /// Photons that have hit something.
    pub paths: &'a PathQueue,
    /// Their hits.
    pub hits: &'a HitQueue,
    /// The order in which hits are evaluated.
    pub groups: &'a MaterialRanges,
    /// The photons that go on.
    pub next: &'a mut PathQueue,
    /// The photons that pass a surface as well.
    pub passed: &'a mut PathQueue,
    /// Rays to the camera.
    pub shadow: &'a mut ShadowQueue,
    /// The photons that end.
    pub ended: &'a mut EndQueue,
}

/// The photons that have ended: position, flux, vector to where they came from, normal, place in the image; number,
/// bounces, density, place in the wave.
pub struct EndQueue(pub Columns<14, 4>);

impl Kernel for PhotonStage<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let width = L::Queue::WIDTH;
        if self.plan.setup.transport == Transport::Whitted {
            let count = self.paths.columns.len();
            for at in (0..count).step_by(width) {
                let (path, hit) = (self.paths.load(at), self.hits.load(at));
                let outcome = photon_tracing::hit_whitted::<L::Queue>(
                    self.plan,
                    &path,
                    &hit,
                    lanes::<L::Queue>(count - at),
                );
                self.append(&path, &outcome, numbered(at));
            }
            return;
        }
        for &(material, first, end) in &self.groups.groups {
            for at in (first as usize..end as usize).step_by(width) {
                let valid = lanes::<L::Queue>(end as usize - at);
                let places = <L::Queue as Float>::Int::load(&self.groups.order[at..]);
                let (path, hit) = (self.paths.gather(places, valid), self.hits.gather(places, valid));
                let outcome = photon_tracing::hit::<L::Queue>(self.plan, &path, &hit, material, valid);
                self.append(&path, &outcome, places);
            }
        }
    }
}

impl PhotonStage<'_> {
    #[inline(always)]
    fn append<F: Float>(&mut self, path: &Path<F>, outcome: &PhotonOutcome<F>, places: F::Int) {
        let PhotonOutcome { position: p, normal: n, flux: f, place, .. } = *outcome;
        self.next.append(outcome.goes_on, &outcome.next, places);
        if let Some(passed) = &outcome.passed {
            self.passed.append(passed.mask, &passed.next, places);
        }
        self.shadow.append(&outcome.to_camera, places);
        let d = path.direction;
        let floats = [p.x, p.y, p.z, f.r, f.g, f.b, -d.x, -d.y, -d.z, n.x, n.y, n.z, place.0, place.1];
        let bounces = path.depth - path.scatterings;
        let integers = [path.pixel, bounces, path.packed_normal, places];
        self.ended.0.append::<F>(outcome.lands, floats, integers);
    }
}

/// The roles of a wave's hits in path reuse.
#[derive(Default)]
pub struct HitRoles {
    /// True for first vertices that take.
    pub takes: Vec<bool>,
    /// The light that second vertices give.
    pub reusable: Vec<Option<ReusableVertex<f32>>>,
}

impl HitRoles {
    /// Creates the roles of at most `capacity` hits.
    pub fn new(capacity: usize) -> Self {
        Self { takes: vec![false; capacity], reusable: vec![None; capacity] }
    }

    /// Stores the lanes' roles at the places of their hits.
    #[inline(always)]
    fn put<F: Float>(&mut self, places: F::Int, shared: Option<&ReuseRoles<F>>, mask: F::Mask) {
        let mut at = [0; 16];
        places.store(&mut at);
        let (mut takes, mut gives, mut rows) = (0, 0, [[[0.0; 4]; 16]; COLUMNS / 4]);
        if let Some(shared) = shared {
            (takes, gives) = (shared.takes.bits(), shared.gives.bits());
            if gives != 0 {
                for (rows, columns) in rows.iter_mut().zip(shared.reusable.columns().as_chunks().0) {
                    F::store_rows_mixed(*columns, rows);
                }
            }
        }
        for (lane, place) in at[..mask.count()].iter().enumerate() {
            let place = *place as usize;
            self.takes[place] = takes >> lane & 1 != 0;
            self.reusable[place] = None;
            if gives >> lane & 1 != 0 {
                let mut numbers = [0.0; COLUMNS];
                for (to, rows) in numbers.as_chunks_mut::<4>().0.iter_mut().zip(&rows) {
                    *to = rows[F::mixed(lane) % 16];
                }
                self.reusable[place] = Some(ReusableVertex::new(&numbers));
            }
        }
    }
}

/// Stores radiance and whether the path goes on at the places of the lanes' paths.
#[inline(always)]
fn put_back<F: Float>(
    paths: &mut PathQueue,
    flags: &mut [u32],
    places: F::Int,
    radiance: Color<F>,
    goes_on: F::Int,
    mask: F::Mask,
) {
    let (mut at, mut flag) = ([0; 16], [0; 16]);
    let (mut r, mut g, mut b) = ([0.0; 16], [0.0; 16], [0.0; 16]);
    places.store(&mut at);
    goes_on.store(&mut flag);
    radiance.r.store(&mut r);
    radiance.g.store(&mut g);
    radiance.b.store(&mut b);
    let [to_r, to_g, to_b] = paths.radiance_mut();
    for lane in 0..mask.count() {
        let place = at[lane] as usize;
        (to_r[place], to_g[place], to_b[place]) = (r[lane], g[lane], b[lane]);
        flags[place] = flag[lane];
    }
}
