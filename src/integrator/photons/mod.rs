//! Caustics by photons (Jensen 1996; Hachisuka and others 2008; Knaus and Zwicker, "Progressive photon mapping: a
//! probabilistic approach", 2011). Sample k of all pixels has photons of its own, a pure function of k, scene and
//! settings. A photon leaves a light towards objects that make caustics, is reflected or transmitted there, and ends at
//! the first surface that does anything else. If the camera sees that point directly, the photon is drawn into sample k
//! of that pixel: exact, without a radius. At every other such vertex of a path the photons of k are gathered within a
//! radius that shrinks with k:
//!
//! ```text
//! r²(k) = r²(1) Γ(k + α) / (Γ(1 + α) Γ(k + 1)),  α = 2/3
//! L     = Σ f |cos θ| Φ K / (|cos θ'| π r²),     K = 2 (1 − d²/r²)
//! ```
//!
//! (θ' is measured from the surface itself, θ from its shading normal.) Paths find the same light if its emitter is
//! large. The balance heuristic weights the two, with a = n π r² photons of a sample per steradian (n times a pixel's
//! footprint where they are drawn), where n is a constant of each emitter, and the density p of a path's direction at
//! the vertex:
//!
//! ```text
//! photons: a / (a + p / |cos θ'|)
//! ```

mod aim;
pub mod emission;
pub mod gather;
pub mod map;
pub mod splat;
pub mod targets;

use std::ops::Range;

use crate::film::Film;
use crate::integrator::RenderSetup;
use crate::integrator::observe::Observer;
use crate::integrator::path::light_groups::group_of;
use crate::math::NONE;
use crate::sampling::progressive::shrink;
use crate::world::Transport;
use emission::PhotonEmission;
use map::{Photon, PhotonMap, Radii};
use splat::{Splat, Splats};

/// The setup of photons, common to all samples.
pub struct PhotonPlan {
    /// The setup by which they are traced: other random numbers, no roulette.
    pub setup: RenderSetup,
    /// The distribution from which they are drawn.
    pub emission: PhotonEmission,
    /// The radius of the first sample in pixel widths.
    pub pixels: f32,
    /// The usual radius of the first sample, in metres, by which cells are sized.
    pub radius: f32,
    /// True if paths may find the same light: see [`Transport`].
    pub is_found_by_paths: bool,
}

impl PhotonPlan {
    /// Creates the plan of a render.
    pub fn new(setup: &RenderSetup, emission: PhotonEmission, radius: f32) -> Self {
        Self {
            setup: frame_of(setup),
            emission,
            pixels: setup.photons.map_or(0.0, |(_, radius)| radius),
            radius,
            is_found_by_paths: setup.transport == Transport::Path,
        }
    }

    /// The number of photons of each sample.
    pub fn count(&self) -> u32 {
        self.emission.count()
    }

    /// Builds the maps of a sample's photons, given in the order of their numbers.
    pub fn of_sample(&self, sample: u32, landed: &[LandedPhotons]) -> SamplePhotons {
        let photons = landed.iter().flat_map(|some| some.photons.iter());
        let splats = Splats::new(
            &self.setup,
            landed.iter().flat_map(|some| some.splats.iter().map(|(_, splat)| splat)),
        );
        let groups: Vec<u32> = match self.setup.lamp_groups() {
            0 => Vec::new(),
            _ => photons.clone().map(|(number, _)| self.group_of(sample, *number)).collect(),
        };
        let map = PhotonMap::new(photons.map(|(_, photon)| photon), &groups, self.radii(sample));
        SamplePhotons { map, splats }
    }

    /// The light group of a sample's photon, or [`NONE`].
    pub fn group_of(&self, sample: u32, number: u32) -> u32 {
        if self.setup.lamp_groups() == 0 {
            return NONE;
        }
        let number = u64::from(sample) * u64::from(self.count()) + u64::from(number);
        group_of(&self.setup, self.emission.emitter_of(self.setup.seed, number))
    }

    /// The radii at a sample.
    pub fn radii(&self, sample: u32) -> Radii {
        let shrink = shrink(sample);
        Radii { shrink, most: 2.0 * self.radius * shrink }
    }
}

/// Derives the setup by which the photons of a render are traced.
pub fn frame_of(setup: &RenderSetup) -> RenderSetup {
    let seed = setup.seed ^ 0x7068_6f74_6f6e;
    // The vertex of the camera's path where they end is one more bounce.
    let max_depth = setup.max_depth.min(Photon::MOST_BOUNCES).saturating_sub(1);
    RenderSetup {
        seed,
        max_depth,
        min_throughput: 0.0,
        sharing: None,
        clamp: None,
        roulette_depth: None,
        splitting: 1.0,
        follows_light: true,
        // Photons have met nothing matte.
        filter_glossy: 0.0,
        ..setup.clone()
    }
}

/// The photons of some samples.
#[derive(Clone, Copy)]
pub struct PhotonMaps<'a> {
    /// Their common plan.
    pub plan: &'a PhotonPlan,
    /// The first of the samples.
    pub first: u32,
    /// The photons of each sample; empty for a reuse probe, whose paths leave light to photons but gather none.
    pub samples: &'a [SamplePhotons],
}

/// The photons of a sample.
pub struct SamplePhotons {
    /// The photons that paths gather.
    pub map: PhotonMap,
    /// The photons that the camera sees.
    pub splats: Splats,
}

impl<'a> PhotonMaps<'a> {
    /// The photons of a reuse probe's paths.
    pub fn of_pilot(self) -> PhotonMaps<'a> {
        PhotonMaps { samples: &[], ..self }
    }

    /// The photon map of a sample.
    pub fn of(&self, sample: u32) -> &PhotonMap {
        &self.samples[(sample - self.first) as usize].map
    }

    /// Draws the photons of some samples that the camera sees directly into a film.
    pub fn draw(
        &self,
        setup: &RenderSetup,
        film: &mut Film,
        samples: Range<u32>,
        observer: &mut dyn Observer,
    ) {
        for sample in samples {
            self.samples[(sample - self.first) as usize].splats.draw(setup, film, sample, observer);
        }
    }
}

/// Photons that have ended.
#[derive(Default)]
pub struct LandedPhotons {
    /// The photons, with their numbers.
    pub photons: Vec<(u32, Photon)>,
    /// The photons that the camera sees, with their numbers.
    pub splats: Vec<(u32, Splat)>,
}

impl LandedPhotons {
    /// Sorts photons by number. One may end several times: then by its bounces, or by its place in the image.
    pub fn sort(&mut self) {
        self.photons.sort_by_key(|(number, photon)| (*number, photon.order()));
        // The film does not need the order; observers do.
        self.splats.sort_by_key(|(number, splat)| (*number, splat.column.to_bits(), splat.row.to_bits()));
    }

    /// Adds a photon that ends here, and what it adds to the image.
    pub fn add(&mut self, number: u32, photon: Photon, splat: Splat) {
        self.photons.push((number, photon));
        if splat.light.max_component() > 0.0 {
            self.splats.push((number, splat));
        }
    }
}
