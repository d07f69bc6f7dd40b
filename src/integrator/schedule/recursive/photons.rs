//! Photon tracing under the recursive schedule, one photon after another.

use std::ops::Range;

use smallvec::{SmallVec, smallvec};

use super::{Recursion, Tile};
use crate::integrator::RayStatistics;
use crate::integrator::observe::Observer;
use crate::integrator::path::Path;
use crate::integrator::path::shadow::connect;
use crate::integrator::photons::map::Photon;
use crate::integrator::photons::splat::Splat;
use crate::integrator::photons::{LandedPhotons, PhotonPlan};
use crate::integrator::transport::photon_tracing;
use crate::integrator::transport::transparent_shadow::arriving;
use crate::math::Color;
use crate::shading::HitLanes;
use crate::shading::surface::material_of;
use crate::simd::Isa;
use crate::world::Transport;

impl Recursion {
    /// Traces some of a sample's photons, one after another.
    pub fn trace_photons(
        &mut self,
        plan: &PhotonPlan,
        isa: Isa,
        (sample, numbers): (u32, Range<u32>),
        landed: &mut LandedPhotons,
        statistics: &mut RayStatistics,
        observer: &mut dyn Observer,
    ) {
        let setup = &plan.setup;
        let mut tile = Tile::new([setup; 2], None, isa, statistics, &mut self.buffers, observer);
        let first = u64::from(sample) * u64::from(plan.count());
        for number in numbers {
            if tile.stopped {
                return;
            }
            if let Some(photon) = plan.emission.emit(&setup.scene, setup.seed, first + u64::from(number)) {
                tile.follow_photon(plan, photon_tracing::path(sample, number, &photon), landed);
            }
        }
    }
}

impl Tile<'_> {
    /// Follows a photon to its ends.
    fn follow_photon(&mut self, plan: &PhotonPlan, first: Path<f32>, landed: &mut LandedPhotons) {
        let mut waiting: SmallVec<[Path<f32>; 8]> = smallvec![first];
        while let Some(path) = waiting.pop() {
            self.statistics.rays.photon += 1;
            let hit = self.meet(&path);
            if hit.is_miss() {
                continue;
            }
            let lane = HitLanes::one(&hit);
            let outcome = match self.setup.transport {
                Transport::Whitted => photon_tracing::hit_whitted(plan, &path, &lane, true),
                Transport::Path => {
                    let material = material_of(&self.setup.scene.geometry, &lane, true).0;
                    photon_tracing::hit(plan, &path, &lane, material, true)
                }
            };
            if outcome.lands {
                let mut light = Color::black();
                if outcome.to_camera.mask {
                    self.statistics.rays.shadow += 1;
                    let Self { setup, isa, .. } = *self;
                    let stack = &mut self.buffers.stack;
                    let found = arriving(setup, isa, &path, &outcome.to_camera, stack);
                    light = found.map_or(light, |found| connect(light, found));
                }
                let Color { r, g, b } = outcome.flux;
                let bounces = path.depth.0 - path.scatterings.0;
                let (from, density) = (-path.direction, photon_tracing::density(&path));
                let photon = Photon::new(outcome.position, [r, g, b], from, outcome.normal, bounces, density);
                let (number, (column, row)) = (path.pixel.0, outcome.place);
                let group = plan.group_of(path.sample.0, number);
                landed.add(number, photon, Splat { column, row, light, group });
            }
            waiting.extend(outcome.passed.filter(|passed| passed.mask).map(|passed| passed.next));
            waiting.extend(outcome.goes_on.then_some(outcome.next));
        }
    }
}
