//! Preparation before the first sample: the render setup with the bodies around its camera, the plan of photons, and
//! the measurement of path reuse.

use std::sync::Arc;

use rayon::prelude::*;

use super::{camera_medium, photons};
use crate::integrator::photons::{PhotonMaps, PhotonPlan};
use crate::integrator::reuse::probe::{MOST_RAYS, ReuseProbe};
use crate::integrator::schedule::recursive::Recursion;
use crate::integrator::setup::NoPhotons;
use crate::integrator::{RenderSetup, Stop};
use crate::scene::CompiledScene;
use crate::world::Settings;

/// Creates the render setup of a scene. Finds the bodies around the camera; nothing else is traced.
pub fn setup(scene: impl Into<Arc<CompiledScene>>, settings: &Settings) -> RenderSetup {
    let scene = scene.into();
    let around = camera_medium::find(&scene, settings.size);
    RenderSetup::new(scene, settings, around)
}

/// The data on which samples depend, in addition to the render setup.
pub struct Prepared {
    /// The measurement of path reuse, if each block chooses how many of its pixels form a group.
    pub pilot: Option<ReuseProbe>,
    /// The setup of the photons of all samples, or the reason why there are none.
    pub plan: Result<PhotonPlan, NoPhotons>,
}

impl Prepared {
    /// Traces the rays that are needed before the first sample, on all threads. `None` if stopped.
    pub fn new(setup: &RenderSetup, stop: &Stop) -> Option<Self> {
        let prepared = Self::while_going(setup, stop);
        (!stop.is_set()).then_some(prepared)
    }

    /// Returns the number of photons of a sample, or the reason why there are none.
    #[cfg(feature = "cli")]
    pub fn photons(&self) -> Result<u32, NoPhotons> {
        self.plan.as_ref().map(PhotonPlan::count).map_err(|why| *why)
    }

    /// [`Prepared::new`] that cannot be stopped.
    pub fn now(setup: &RenderSetup) -> Self {
        Self::while_going(setup, &Stop::NEVER)
    }

    fn while_going(setup: &RenderSetup, stop: &Stop) -> Self {
        let chooses = setup.sharing.is_some_and(|grouping| grouping.chooses);
        let plan = photons::plan(setup, stop);
        Self { pilot: chooses.then(|| pilot(setup, plan.as_ref().ok(), stop)), plan }
    }
}

/// Measures path reuse in some blocks of the image. Blocks that take too many rays are left out.
fn pilot(setup: &RenderSetup, plan: Option<&PhotonPlan>, stop: &Stop) -> ReuseProbe {
    let photons = plan.map(|plan| PhotonMaps { plan, first: 0, samples: &[] });
    let measuring = ReuseProbe::frame_of(setup);
    let blocks: Vec<_> = ReuseProbe::blocks(setup).collect();
    let stop = stop.or_after_rays(MOST_RAYS);
    let look = |worker: &mut Recursion, block| worker.probe(&measuring, photons, block, &stop);
    let found: Vec<_> = blocks.into_par_iter().map_init(|| Recursion::new(&measuring), look).collect();
    let (measured, rays): (Vec<_>, Vec<_>) = found.into_iter().flatten().unzip();
    ReuseProbe::new(setup, measuring, &measured, rays.iter().sum())
}
