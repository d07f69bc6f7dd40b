//! Counters and timings of rendering.

use std::time::Duration;

/// Ray counts by purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Camera rays.
    pub camera: u64,
    /// Reflected rays.
    pub reflect: u64,
    /// Refracted rays, into or out of transparent objects.
    pub refract: u64,
    /// Scattered rays, under the path transport.
    pub scatter: u64,
    /// Shadow rays.
    pub shadow: u64,
    /// Rays to second vertices of other paths, for path reuse.
    pub connect: u64,
    /// Rays of photons.
    pub photon: u64,
}

impl RayCounts {
    /// The sum of all counts.
    pub fn total(&self) -> u64 {
        self.camera + self.reflect + self.refract + self.scatter + self.shadow + self.connect + self.photon
    }
}

/// The stages of the wavefront in the order of its loop. The recursive schedule is not timed by stage: reading the
/// clock for every ray would take longer than the ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Stage {
    /// Generates new samples in free places of the wave.
    Generate,
    /// Finds closest hits.
    Intersect,
    /// Removes misses and compacts hits.
    Retire,
    /// Turns hits into vertices, reflected and refracted rays.
    Shade,
    /// Turns vertices into shadow rays.
    Light,
    /// Traces shadow rays and adds their contributions to paths.
    Shadow,
    /// Traces rays between first and second vertices for path reuse, and adds their contributions.
    Connect,
    /// Moves photons, except for their hits and their rays to the camera.
    Photons,
    /// Moves finished paths to the film, and the next wave into place.
    Advance,
}

impl Stage {
    /// All stages, in order.
    pub const ALL: [Stage; 9] = [
        Stage::Generate,
        Stage::Intersect,
        Stage::Retire,
        Stage::Shade,
        Stage::Light,
        Stage::Shadow,
        Stage::Connect,
        Stage::Photons,
        Stage::Advance,
    ];

    /// The name in lower case.
    pub fn name(self) -> &'static str {
        ["generate", "intersect", "retire", "shade", "light", "shadow", "connect", "photons", "advance"]
            [self as usize]
    }
}

/// Counters of one worker or of all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayStatistics {
    /// Rays traced.
    pub rays: RayCounts,
    /// The time of each [`Stage`], summed over workers.
    pub stages: [Duration; Stage::ALL.len()],
    /// Paths that left the wave for the pending stack because forks outgrew it.
    pub spilled: u64,
}

impl RayStatistics {
    /// Adds the counters of another worker.
    pub fn add(&mut self, other: &RayStatistics) {
        self.rays.camera += other.rays.camera;
        self.rays.reflect += other.rays.reflect;
        self.rays.refract += other.rays.refract;
        self.rays.scatter += other.rays.scatter;
        self.rays.shadow += other.rays.shadow;
        self.rays.connect += other.rays.connect;
        self.rays.photon += other.rays.photon;
        self.spilled += other.spilled;
        for (sum, more) in self.stages.iter_mut().zip(other.stages) {
            *sum += more;
        }
    }
}
