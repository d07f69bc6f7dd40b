//! How Whitted's transport samples lights.

use crate::sampling::pattern::Grid;
use crate::world::Pattern;

/// A light entity: its emitter, and the shadow rays that every hit sends there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhittedLight {
    /// Index of its emitter.
    pub emitter: u32,
    /// Shadow rays for a hit.
    pub samples: u32,
    /// The grid of their strata, if the light has an area.
    pub grid: Option<Grid>,
    /// How they are spread.
    pub pattern: Pattern,
}
