//! The film: exact sums of samples, tone mapping for the screen, and image metrics.

pub(crate) mod allocation;
pub(crate) mod alpha;
pub(crate) mod catcher;
pub(crate) mod channel;
pub(crate) mod exposure;
pub(crate) mod features;
pub(crate) mod light_groups;
pub(crate) mod metrics;
pub(crate) mod moments;
pub(crate) mod ranges;
pub(crate) mod sums;
pub(crate) mod texels;
pub(crate) mod tonemap;

pub(crate) use allocation::Allocation;
pub(crate) use catcher::Caught;
pub use channel::{FilmChannel, Values};
pub(crate) use features::{Features, FirstHit, Gathering};
pub(crate) use light_groups::{GroupKinds, GroupSum, MOST_LIGHT_GROUPS};
pub(crate) use moments::Moments;
pub(crate) use ranges::SampleRanges;
pub use sums::{Film, Region};
pub(crate) use sums::{FilmScale, PixelSum};
