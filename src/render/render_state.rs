//! What a rendering has gathered, between its passes and within one.

use std::ops::Range;

use crate::film::{Allocation, Film, FilmScale, Moments, Region, SampleRanges};

/// Samples of a film and which ones they are: all that is needed to go on with a rendering.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderState {
    /// The sums.
    pub film: Film,
    /// Squares of the samples, where variance is wanted.
    pub moments: Option<Moments>,
    /// Samples that every pixel has.
    pub samples: SampleRanges,
    /// Those of a pass that is under way.
    pub pass: Option<RenderPass>,
    /// How many rays the first samples of each block took, if blocks get as many samples as they are worth: see
    /// `render::adaptive`.
    pub rays: Option<Vec<u64>>,
    /// How many samples blocks get, if that was decided beforehand. `samples` are then those that all pixels have
    /// which are to get them.
    pub allocation: Option<Allocation>,
}

/// Samples that some tiles have already and others have not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RenderPass {
    /// The samples that tiles have.
    pub samples: Range<u32>,
    /// Where its samples end: those behind come next, for the same blocks.
    pub until: u32,
    /// Width and height of tiles in pixels.
    pub tile: u32,
    /// Which tiles have them, by their numbers.
    pub done: Vec<bool>,
    /// Which blocks get them, where not all do: see `render::adaptive`.
    pub blocks: Option<Vec<bool>>,
}

impl RenderPass {
    /// A pass of which no tile is done.
    pub fn new(samples: Range<u32>, tile: u32, region: Region) -> RenderPass {
        let done = vec![false; super::tiles(region, tile).len()];
        RenderPass { until: samples.end, samples, tile, done, blocks: None }
    }

    /// Its first samples, at most so many; the others come next.
    pub(super) fn begin(self, most: u32) -> RenderPass {
        let end = self.samples.start.saturating_add(most).min(self.samples.end);
        RenderPass { samples: self.samples.start..end, ..self }
    }

    /// Its next samples, if there are any.
    pub(super) fn next(&self, most: u32) -> Option<RenderPass> {
        let rest = RenderPass {
            samples: self.samples.end..self.until,
            done: vec![false; self.done.len()],
            ..self.clone()
        };
        (!rest.samples.is_empty()).then(|| rest.begin(most))
    }

    /// The parts of a tile that are rendered: all of it, or those of its blocks that get samples, with their numbers.
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
    /// No samples.
    pub fn nothing(region: Region, unit: FilmScale, variance: bool) -> RenderState {
        RenderState {
            film: Film::new(region, unit),
            moments: variance.then(|| Moments::new(region)),
            samples: SampleRanges::default(),
            pass: None,
            rays: None,
            allocation: None,
        }
    }

    /// Adds what was gathered elsewhere for the same pixels, of other samples.
    pub fn merge(&mut self, other: &RenderState) {
        self.film.merge(&other.film);
        if let (Some(moments), Some(more)) = (&mut self.moments, &other.moments) {
            moments.merge(more);
        }
        self.samples.extend(&other.samples);
    }
}
