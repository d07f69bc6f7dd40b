//! The work of a thread: what is rendered, and in which order rays are traced.

use crate::integrator::RenderSetup;
use crate::integrator::photons::PhotonMaps;
use crate::integrator::reuse::probe::ReuseProbe;
use crate::simd::Isa;

/// The input of a worker: a render setup, and what was computed before its samples.
#[derive(Clone, Copy)]
pub struct Work<'a> {
    /// The render setup.
    pub setup: &'a RenderSetup,
    /// The reuse probe, if blocks of pixels choose how many of them reuse paths.
    pub pilot: Option<&'a ReuseProbe>,
    /// The photons of the samples to render, if there are any.
    pub photons: Option<PhotonMaps<'a>>,
    /// The instruction set.
    pub isa: Isa,
}

impl<'a> Work<'a> {
    /// Returns the work with another render setup and without a reuse probe.
    pub(super) fn with_frame<'b>(self, setup: &'b RenderSetup) -> Work<'b>
    where
        'a: 'b,
    {
        Work { setup, pilot: None, ..self }
    }
}

/// The order in which rays are traced. The image does not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Schedule {
    /// Breadth first: waves of many paths go through one stage after another.
    #[default]
    Wavefront,
    /// Depth first: one path after another is followed to its end.
    Recursive,
}

/// The order in which the wavefront schedule shades a wave's hits under the path transport. The image does not depend
/// on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sorting {
    /// Material by material: all lanes are used.
    #[default]
    ByMaterial,
    /// In queue order: the hits in a register are shaded once for each material among them.
    Unsorted,
}
