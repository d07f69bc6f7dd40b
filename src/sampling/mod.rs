//! Random numbers: each is a pure function of (seed, pixel, sample, branch, dimension), so any schedule draws the same
//! numbers.

pub mod dimension;
pub mod draw;
pub mod filter;
pub mod pattern;
pub mod progressive;
pub mod sobol;
pub mod table;
pub mod warp;

pub(crate) use crate::math::hash::{self, SampleKey};
pub use crate::math::stream::Stream;
pub use dimension::Dimension;
pub use table::Distribution2d;
