//! The state of a render, between its passes and within one.

use std::ops::Range;

use crate::film::{Allocation, Film, Moments, Region, SampleRanges};

/// A film and the numbers of its samples: everything that is needed to continue a render.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderState {
    /// The sums of samples.
    pub film: Film,
    /// The sums of squared samples, if variance is estimated.
    pub moments: Option<Moments>,
    /// The samples that every pixel has.
    pub samples: SampleRanges,
    /// The pass under way.
    pub pass: Option<RenderPass>,
    /// The number of rays of each block's first samples, under adaptive sampling: see `render::adaptive`.
    pub rays: Option<Vec<u64>>,
    /// The number of samples of each block, if decided beforehand. `samples` then holds those that all pixels have that
    /// are to get them.
    pub allocation: Option<Allocation>,
}

/// A pass: samples that some tiles have and others do not have yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RenderPass {
    /// The samples that finished tiles have.
    pub samples: Range<u32>,
    /// The end of the pass's samples: those after `samples` come next, for the same blocks.
    pub until: u32,
    /// The width and height of tiles in pixels.
    pub tile: u32,
    /// True for each finished tile, by its number.
    pub done: Vec<bool>,
    /// True for each block that gets the samples; `None` if all do. See `render::adaptive`.
    pub blocks: Option<Vec<bool>>,
}

impl RenderPass {
    /// Creates a pass of which no tile is finished.
    pub fn new(samples: Range<u32>, tile: u32, region: Region) -> RenderPass {
        let done = vec![false; super::tiles(region, tile).len()];
        RenderPass { until: samples.end, samples, tile, done, blocks: None }
    }

    /// Limits the pass to its first `most` samples; the others come next.
    pub(super) fn begin(self, most: u32) -> RenderPass {
        let end = self.samples.start.saturating_add(most).min(self.samples.end);
        RenderPass { samples: self.samples.start..end, ..self }
    }

    /// Returns the pass over the next samples, at most `most`; `None` if none are left.
    pub(super) fn next(&self, most: u32) -> Option<RenderPass> {
        let rest = RenderPass {
            samples: self.samples.end..self.until,
            done: vec![false; self.done.len()],
            ..self.clone()
        };
        (!rest.samples.is_empty()).then(|| rest.begin(most))
    }

    /// Returns the parts of a tile that are rendered: all of it, or its blocks that get samples, with their numbers.
    pub(super) fn parts(&self, region: Region, tile: Region, by_block: bool) -> Vec<(Option<usize>, Region)> {
        if !by_block {
            return vec![(None, tile)];
        }
        let inside =
            |block: &Region| (tile.x0..tile.x1).contains(&block.x0) && (tile.y0..tile.y1).contains(&block.y0);
        let is_chosen = |number: usize| self.blocks.as_ref().is_none_or(|chosen| chosen[number]);
        let blocks = super::adaptive::blocks(region).into_iter().enumerate();
        blocks
            .filter(|(number, block)| is_chosen(*number) && inside(block))
            .map(|(number, block)| (Some(number), block))
            .collect()
    }
}

impl RenderState {
    /// Creates a state without samples around an empty film.
    pub fn nothing(film: Film, variance: bool) -> RenderState {
        RenderState {
            moments: variance.then(|| Moments::new(film.region())),
            film,
            samples: SampleRanges::default(),
            pass: None,
            rays: None,
            allocation: None,
        }
    }

    /// Adds the state of other samples of the same pixels.
    pub fn merge(&mut self, other: &RenderState) {
        self.film.merge(&other.film);
        if let (Some(moments), Some(more)) = (&mut self.moments, &other.moments) {
            moments.merge(more);
        }
        self.samples.extend(&other.samples);
    }
}
