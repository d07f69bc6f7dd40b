//! The layers of work: the nodes that a pixel's rays visit, the surfaces that they are tested against, the lengths of its
//! paths, and their times.

use std::sync::{Arc, OnceLock};

use super::picture::{ColorBar, Layer, PageImage, heat, session_of};
use super::viewer::Snapshot;
use crate::film::Region;
use crate::integrator::RenderSetup;
use crate::render::{Options, PixelCost};

/// The number of samples that are rendered again for a finished image.
const SAMPLES: u32 = 4;
/// The largest number of pixels of a coarse map.
const COARSE_PIXELS: u64 = 40_000;

/// The work and the times of an image's pixels, computed on first use: a coarse map of each while the image is rendered,
/// and a whole one once it is finished.
#[derive(Debug, Default)]
pub struct CostMaps {
    work: [OnceLock<CostMap>; 2],
    times: [OnceLock<CostMap>; 2],
}

/// The mean work or time of some samples, by pixel.
#[derive(Debug)]
pub struct CostMap {
    /// Width and height.
    pub size: [u32; 2],
    /// Nodes and tests of camera rays, other rays of paths and shadow rays, and the rays of a path; or microseconds.
    costs: Vec<f32>,
    /// The number of costs of a pixel.
    columns: usize,
}

impl CostMap {
    /// The map of a snapshot with a layer. A whole one renders samples of all pixels again.
    pub fn of(shown: &Snapshot, layer: Layer) -> &CostMap {
        let CostMaps { work, times } = &shown.aside.costs;
        let (is_time, is_whole) = (layer == Layer::Time, is_finished(shown));
        let (size, samples) = match is_whole {
            true => (shown.size, SAMPLES.min(shown.wanted)),
            false => (coarse_size(shown.setup.size), 1),
        };
        let map = &(if is_time { times } else { work })[usize::from(is_whole)];
        map.get_or_init(|| CostMap::new(shown, is_time, size, samples))
    }

    fn new(shown: &Snapshot, is_time: bool, size: [u32; 2], samples: u32) -> CostMap {
        let setup = match size == shown.setup.size {
            true => shown.setup.clone(),
            false => Arc::new(RenderSetup { size, sharing: None, ..(*shown.setup).clone() }),
        };
        let options = Options { region: Some(Region::whole(size)), ..shown.options };
        let mean = |PixelCost { nodes: [a, b, c], tests: [d, e, f], path_rays }: &PixelCost| {
            [*a, *b, *c, *d, *e, *f, *path_rays].map(|sum| (sum as f64 / f64::from(samples)) as f32)
        };
        let session = session_of(&setup, options, samples);
        match is_time {
            true => CostMap { size, costs: session.microseconds(), columns: 1 },
            false => CostMap { size, costs: session.costs().iter().flat_map(mean).collect(), columns: 7 },
        }
    }

    /// The numbers of a pixel in a layer: by kinds of rays, or one. None outside the map.
    pub fn values(&self, layer: Layer, [x, y]: [u32; 2]) -> Option<&[f32]> {
        self.pixels().nth(y as usize * self.size[0] as usize + x as usize).map(|costs| part(costs, layer))
    }

    /// The costs of pixels, row by row.
    fn pixels(&self) -> impl Iterator<Item = &[f32]> {
        self.costs.chunks_exact(self.columns)
    }

    /// The picture of a layer: the sum of each pixel's numbers as a fraction of the largest sum. Of times, the greatest
    /// hundredth is all of one colour: other programs interrupt some.
    pub fn picture(&self, layer: Layer) -> PageImage {
        let sums: Vec<f32> = self.pixels().map(|costs| part(costs, layer).iter().sum()).collect();
        let mut sorted = sums.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        let left_out = if layer == Layer::Time { sums.len() / 100 } else { 0 };
        let most = sorted.into_iter().nth_back(left_out).unwrap_or(0.0).max(f32::MIN_POSITIVE);
        let unit = match layer {
            Layer::Nodes => "nodes",
            Layer::Tests => "tests",
            Layer::Time => "microseconds",
            _ => "rays",
        };
        let pixel = |sum: &f32| {
            let [r, g, b] = heat((sum / most).min(1.0).into());
            [r, g, b, 255]
        };
        PageImage {
            size: self.size,
            pixels: sums.iter().flat_map(pixel).collect(),
            exposure_ev: 0.0,
            bar: Some(ColorBar::new(unit, [0.0, most], |part| heat(part.into()))),
            is_denoised: false,
        }
    }
}

fn part(costs: &[f32], layer: Layer) -> &[f32] {
    match layer {
        Layer::Time => costs,
        Layer::Nodes => &costs[..3],
        Layer::Tests => &costs[3..6],
        _ => &costs[6..],
    }
}

/// True if all samples of the whole image are rendered.
fn is_finished(shown: &Snapshot) -> bool {
    let gathered = &shown.gathered;
    let is_whole = shown.small.is_none() && shown.size == shown.setup.size;
    is_whole && gathered.pass.is_none() && gathered.samples.count() >= shown.wanted
}

/// The size of an image divided by the smallest whole number that makes it coarse.
fn coarse_size(size: [u32; 2]) -> [u32; 2] {
    let divided = |by: u32| size.map(|side| side.div_ceil(by));
    let is_coarse = |by: &u32| divided(*by).map(u64::from).iter().product::<u64>() <= COARSE_PIXELS;
    divided((2..).find(is_coarse).unwrap_or(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_maps_have_few_pixels() {
        assert_eq!(coarse_size([96, 54]), [48, 27]);
        assert_eq!(coarse_size([1920, 1080]), [240, 135]);
        assert_eq!(coarse_size([1, 1]), [1, 1]);
    }
}
