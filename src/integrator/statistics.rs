//! What rendering did and how long it took.

use std::time::Duration;

/// Rays by what they were traced for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// Mirror images.
    pub reflect: u64,
    /// Into or out of transparent things.
    pub refract: u64,
    /// Wherever surfaces scatter light to, under the path transport.
    pub scatter: u64,
    /// To lights.
    pub shadow: u64,
    /// To second vertices of other paths that are shared.
    pub connect: u64,
    /// Those of photons.
    pub photon: u64,
}

impl RayCounts {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.camera + self.reflect + self.refract + self.scatter + self.shadow + self.connect + self.photon
    }
}

/// The stages of the wavefront in the order of its loop. The recursive schedule is not
/// timed by stage: looking at the clock for every ray would take longer than the ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Stage {
    /// New samples into free places of the wave.
    Generate,
    /// Nearest hits.
    Intersect,
    /// Misses leave, hits are compacted.
    Retire,
    /// Hits to vertices, reflected and refracted rays.
    Shade,
    /// Vertices to shadow rays.
    Light,
    /// Shadow rays through the scene, and what arrives to its path.
    Shadow,
    /// Rays between first and second vertices that share paths, and what arrives along them.
    Connect,
    /// Photons on their way, but for their hits and for rays from them to the camera.
    Photons,
    /// Finished paths to the film, the next wave into place.
    Advance,
}

impl Stage {
    /// All, in order.
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

    /// In lower case.
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
    /// Time of each [`Stage`], summed over workers.
    pub stages: [Duration; Stage::ALL.len()],
    /// Paths that left the wave for the pending stack because forks outgrew it.
    pub spilled: u64,
}

impl RayStatistics {
    /// Adds another worker's.
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
