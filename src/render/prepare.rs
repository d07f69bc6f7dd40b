//! What is computed before samples are: a frame with the bodies around its camera, and what is found out about sharing.

use std::sync::Arc;

use rayon::prelude::*;

use super::{camera_medium, photons};
use crate::integrator::photons::{NoPhotons, PhotonMaps, PhotonPlan};
use crate::integrator::recursive::Recursion;
use crate::integrator::reuse::probe::{MOST_RAYS, ReuseProbe};
use crate::integrator::{RenderSetup, Stop};
use crate::scene::CompiledScene;
use crate::world::Settings;

/// A scene with the settings to render it by. It is found out where its camera is; nothing else is traced.
pub fn setup(scene: impl Into<Arc<CompiledScene>>, settings: &Settings) -> RenderSetup {
    let scene = scene.into();
    let around = camera_medium::find(&scene, settings.size);
    RenderSetup::new(scene, settings, around)
}

/// What a frame's samples are a function of, in addition to its scene and settings.
pub struct Prepared {
    /// What was found out about sharing, if blocks of pixels choose how many of them share.
    pub pilot: Option<ReuseProbe>,
    /// The setup of the photons of all samples, or the reason why there are none.
    pub plan: Result<PhotonPlan, NoPhotons>,
}

impl Prepared {
    /// Traces what has to be known before the first sample, on all threads. None if it was stopped.
    pub fn new(setup: &RenderSetup, stop: &Stop) -> Option<Self> {
        let prepared = Self::while_going(setup, stop);
        (!stop.is_set()).then_some(prepared)
    }

    /// Photons of a sample, or why there are none.
    #[cfg(feature = "cli")]
    pub fn photons(&self) -> Result<u32, NoPhotons> {
        self.plan.as_ref().map(PhotonPlan::count).map_err(|why| *why)
    }

    /// The same without an end before it is done.
    pub fn now(setup: &RenderSetup) -> Self {
        Self::while_going(setup, &Stop::NEVER)
    }

    fn while_going(setup: &RenderSetup, stop: &Stop) -> Self {
        let chooses = setup.sharing.is_some_and(|grouping| grouping.chooses);
        let plan = photons::plan(setup, stop);
        Self { pilot: chooses.then(|| pilot(setup, plan.as_ref().ok(), stop)), plan }
    }
}

/// Looks at some blocks of a frame's image. What takes too many rays is left out.
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
