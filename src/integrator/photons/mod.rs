//! Caustics by photons (Jensen 1996; Hachisuka and others 2008; Knaus and Zwicker, "Progressive photon mapping: a
//! probabilistic approach", 2011). Sample k of all pixels has photons of its own, a pure function of k, scene and
//! settings. A photon leaves a lamp towards what makes caustics, is reflected or let through there, and ends at the
//! first surface that does anything else. Where the camera sees that place directly, the photon is drawn into sample k
//! of that pixel: exact, without a radius. At every other such vertex of a path the photons of k are gathered within a
//! radius that shrinks with k:
//!
//! ```text
//! r²(k) = r²(1) Γ(k + α) / (Γ(1 + α) Γ(k + 1)),  α = 2/3
//! L     = Σ f |cos θ| Φ K / (|cos θ'| π r²),     K = 2 (1 − d²/r²)
//! ```
//!
//! (θ' is measured from the surface itself, θ from its shading normal.) Paths find the same light where a lamp is large.
//! The two share it by the balance heuristic, with a = n π r² photons of a sample per steradian, where n is a
//! constant of each lamp, and the density p of a path's direction at the vertex:
//!
//! ```text
//! photons: a / (a + p / |cos θ'|)
//! ```

pub mod draw;
pub mod emission;
pub mod gather;
pub mod map;
pub mod targets;
pub mod trace;

use std::ops::Range;

use super::Frame;
use super::observe::Observer;
use crate::film::Film;
use crate::math::Color;
use crate::sampling::progressive::shrink;
use crate::world::Transport;
use draw::{Splat, Splats};
use emission::Emission;
use map::{Map, Photon, Radii};

/// What photons of all samples have in common.
pub struct Plan {
    /// The frame that they are traced by: other random numbers, no roulette.
    pub frame: Frame,
    /// Where they begin.
    pub emission: Emission,
    /// The radius of the first sample in widths of a pixel.
    pub pixels: f32,
    /// The usual radius of the first sample, in metres: cells are made for it.
    pub radius: f32,
    /// Whether paths look for the same light: see [`Transport`].
    pub is_found_by_paths: bool,
}

impl Plan {
    /// For a frame.
    pub fn new(frame: &Frame, emission: Emission, radius: f32) -> Self {
        Self {
            frame: frame_of(frame),
            emission,
            pixels: frame.photons.map_or(0.0, |(_, radius)| radius),
            radius,
            is_found_by_paths: frame.transport == Transport::Path,
        }
    }

    /// Photons of each sample.
    pub fn count(&self) -> u32 {
        self.emission.count()
    }

    /// Of photons of a sample, in the order of their numbers.
    pub fn of_sample(&self, sample: u32, landed: &[Landed]) -> OfSample {
        let photons = landed.iter().flat_map(|some| some.photons.iter().map(|(_, photon)| photon));
        let splats = Splats::new(
            &self.frame,
            landed.iter().flat_map(|some| some.splats.iter().map(|(_, splat)| splat)),
        );
        OfSample { map: Map::new(photons, self.radii(sample)), splats }
    }

    /// What becomes of radii at a sample.
    pub fn radii(&self, sample: u32) -> Radii {
        let shrink = shrink(sample);
        Radii { shrink, most: 2.0 * self.radius * shrink }
    }
}

/// The frame by which photons of a frame are traced.
pub fn frame_of(frame: &Frame) -> Frame {
    let seed = frame.seed ^ 0x7068_6f74_6f6e;
    // Where they end, a vertex of the camera's path is one more bounce.
    let max_depth = frame.max_depth.min(Photon::MOST_BOUNCES).saturating_sub(1);
    Frame {
        seed,
        max_depth,
        min_throughput: 0.0,
        sharing: None,
        clamp: None,
        roulette_depth: None,
        ..frame.clone()
    }
}

/// The photons of some samples.
#[derive(Clone, Copy)]
pub struct Photons<'a> {
    /// What they have in common.
    pub plan: &'a Plan,
    /// The first of the samples.
    pub first: u32,
    /// Of each sample; nothing for a pilot, whose paths leave to photons what these would bring, and gather none.
    pub samples: &'a [OfSample],
}

/// The photons of a sample.
pub struct OfSample {
    /// Those that paths gather.
    pub map: Map,
    /// Those that the camera sees.
    pub splats: Splats,
}

impl<'a> Photons<'a> {
    /// For a pilot's paths.
    pub fn of_pilot(self) -> Photons<'a> {
        Photons { samples: &[], ..self }
    }

    /// The map of a sample.
    pub fn of(&self, sample: u32) -> &Map {
        &self.samples[(sample - self.first) as usize].map
    }

    /// Draws what the camera sees of some samples' photons into a film.
    pub fn draw(&self, frame: &Frame, film: &mut Film, samples: Range<u32>, observer: &mut dyn Observer) {
        for sample in samples {
            self.samples[(sample - self.first) as usize].splats.draw(frame, film, sample, observer);
        }
    }
}

/// What has become of some photons.
#[derive(Default)]
pub struct Landed {
    /// Where they have ended, with their numbers.
    pub photons: Vec<(u32, Photon)>,
    /// Those that the camera sees.
    pub splats: Vec<(u32, Splat)>,
}

impl Landed {
    /// Puts photons into the order of their numbers, in whichever one they have ended.
    pub fn sort(&mut self) {
        self.photons.sort_unstable_by_key(|(number, _)| *number);
        // The film does not need their order; those who look on do.
        self.splats.sort_unstable_by_key(|(number, _)| *number);
    }

    /// Adds a photon that has ended; `light` is what the camera sees of it at its place in the image.
    pub fn add(&mut self, number: u32, photon: Photon, (column, row): (f32, f32), light: Color<f32>) {
        self.photons.push((number, photon));
        if light.max_component() > 0.0 {
            self.splats.push((number, Splat { column, row, light }));
        }
    }
}
