//! Sampling parameters of lights for Whitted's transport.

use crate::sampling::pattern::Grid;
use crate::world::Pattern;

/// A light entity: its emitter, and the shadow rays that every hit sends to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhittedLight {
    /// Index of the emitter.
    pub emitter: u32,
    /// Shadow rays per hit.
    pub samples: u32,
    /// The grid of their strata, if the light has an area.
    pub grid: Option<Grid>,
    /// The pattern of the samples.
    pub pattern: Pattern,
}
