//! A probe that measures, block by block before rendering, where path reuse pays: two samples of a few pixels, which
//! are discarded, so that rendered samples do not depend on them.
//!
//! Path reuse reduces the part of the variance that comes from second vertices, at the price of the rays that connect
//! them. Edges, direct light and mirror images keep their variance.

use super::path_slots::{PathSlots, SecondVertex};
use crate::film::{Film, Region};
use crate::integrator::RenderSetup;
use crate::math::Color;
use crate::sampling::hash::mix;
use crate::sampling::pattern::Grid;

/// The number of samples of each probed pixel.
pub const SAMPLES: u32 = 2;

/// Binary logarithms of group sizes, and the factors by which they divide the variance of reused light in means of 8 × 8
/// pixels, measured in a closed room. For single pixels they are larger, 3.1, 9.3, 15 and 22; but then path reuse would be
/// chosen where it does not pay in a picture that is scaled down, nor with many samples, which reduce the variance of smooth
/// light faster than that of edges and shadows.
const GAINS: [(u32, f32); 5] = [(0, 1.0), (2, 1.8), (4, 4.3), (5, 6.3), (6, 8.8)];
/// The cost of connecting a first vertex to a second one, in units of one of a path's own rays with all its shading.
/// Measured: 0.20 in a hall, 0.17 among shapes under a sky, 0.20 among polished ones. But with 0.19, more paths are shared among
/// the shapes, in vain: two samples overrate smooth light there.
const CONNECTION: f32 = 0.25;
/// [`CONNECTION`] in a tree of a few leaves. Measured: 0.09 in two rooms.
const CONNECTION_PAST_FEW_LEAVES: f32 = 0.09;
/// The cost of path reuse for any group size, in units of a path: 0.3 in a hall, 0.6 in the other scenes.
const OVERHEAD: f32 = 0.5;
/// The fraction of a block's estimate that comes from the block itself, whose few pixels are noisy; the rest comes from
/// the mean of the image.
const OWN: f32 = 0.25;
/// The number of blocks of an image that determine what time is worth.
const BLOCKS: usize = 32;
/// The largest number of rays for each of them, some eight thousand for each sample: in a white room, paths may be as
/// long as the depth allows.
pub const MOST_RAYS: u64 = 1 << 18;

/// The reuse probe of a render whose blocks choose how many of their pixels reuse paths.
#[derive(Clone)]
pub struct ReuseProbe {
    /// The setup for measuring: the render's with other random numbers.
    pub setup: RenderSetup,
    /// The setup without path reuse.
    pub plain: RenderSetup,
    price: Price,
}

/// The worth of time, measured in the whole image.
#[derive(Clone, Copy, Debug)]
struct Price {
    /// The relative variance that the time of one path should save.
    variance: f32,
    /// Added to a block's squared radiance, so that dark blocks count for little.
    floor: f32,
    /// The mean of all blocks.
    usual: Variances,
    /// The cost of a ray from a first vertex to a second one, in units of a whole path.
    connection: f32,
}

/// Relative variance of two kinds of light.
#[derive(Clone, Copy, Debug, Default)]
struct Variances {
    /// The variance of light that a path keeps.
    kept: f32,
    /// The variance of light that it gives.
    shared: f32,
}

impl ReuseProbe {
    /// The setup for measuring a render.
    pub fn frame_of(setup: &RenderSetup) -> RenderSetup {
        RenderSetup { seed: setup.seed ^ 0x7069_6c6f_7421, samples: Grid::new(SAMPLES), ..setup.clone() }
    }

    /// The blocks of an image that are measured for the means.
    pub fn blocks(setup: &RenderSetup) -> impl ExactSizeIterator<Item = Region> {
        let edge = setup.sharing.map_or(1, |grouping| grouping.edge());
        let blocks = Region::whole(setup.size.map(|pixels| pixels.div_ceil(edge)));
        let (count, [width, height]) = (blocks.area().min(BLOCKS), setup.size);
        (0..count).map(move |i| {
            let at = (i * blocks.area() / count) as u32;
            let [x0, y0] = [at % blocks.width(), at / blocks.width()].map(|place| place * edge);
            Region { x0, y0, x1: (x0 + edge).min(width), y1: (y0 + edge).min(height) }
        })
    }

    /// Creates the probe of a render from measurements of some blocks under `measuring` ([`ReuseProbe::frame_of`]),
    /// which took `rays` rays.
    pub fn new(setup: &RenderSetup, measuring: RenderSetup, measured: &[MeasuredBlock], rays: u64) -> Self {
        let connection =
            if setup.scene.bvh.has_few_leaves() { CONNECTION_PAST_FEW_LEAVES } else { CONNECTION };
        Self { setup: measuring, plain: plain(setup), price: Price::of(measured, rays, connection) }
    }

    /// The group size chosen for a block, as a binary logarithm.
    pub(super) fn choice(&self, block: &MeasuredBlock) -> u8 {
        block.choice(&self.price).0 as u8
    }
}

/// A setup without path reuse.
pub fn plain(setup: &RenderSetup) -> RenderSetup {
    RenderSetup { sharing: None, ..setup.clone() }
}

/// Time is divided best where the image's error times its cost is least: there the last bit of time reduces the error
/// by the same fraction everywhere.
impl Price {
    /// Computes the price from some blocks of an image, for which `rays` rays have been traced. A connecting ray costs
    /// as much as `connection` of these.
    fn of(blocks: &[MeasuredBlock], rays: u64, connection: f32) -> Self {
        let share = 1.0 / blocks.len().max(1) as f32;
        let mean = blocks.iter().map(|block| block.square().sqrt()).sum::<f32>() * share;
        let paths: f32 = blocks.iter().map(MeasuredBlock::paths).sum();
        let connection = connection * paths / (rays as f32).max(1.0);
        let floor = (0.1 * mean) * (0.1 * mean);
        let mut price = Self { variance: 0.0, floor, usual: Variances::default(), connection };
        for block in blocks {
            let Variances { kept, shared } = block.variances(price.floor);
            price.usual.kept += kept * share;
            price.usual.shared += shared * share;
        }
        // Iterates, because the price depends on the choices that it leads to.
        for _ in 0..4 {
            let (mut variance, mut cost) = (0.0, 0.0);
            for block in blocks {
                let (_, left, time) = block.choice(&price);
                variance += left;
                cost += time;
            }
            price.variance = variance / cost;
        }
        price
    }
}

/// True if a pixel of a block of this width and height is probed: one of 4 × 4, in large blocks of 8 × 8.
pub(super) fn is_probed(edge: u32, x: u32, y: u32) -> bool {
    let every = (edge / 8).max(4);
    let square = (x / every) ^ (y / every) << 16;
    let place = mix(std::num::Wrapping(square)).0 % (every * every);
    (x % every, y % every) == (place % every, place / every)
}

/// The light that a sample has found.
#[derive(Clone, Copy)]
struct FoundLight {
    kept: Color<f32>,
    /// The light that its second vertex gives.
    shared: Color<f32>,
    /// True if its first vertex takes light.
    takes: bool,
}

impl FoundLight {
    fn all(&self) -> Color<f32> {
        self.kept + self.shared
    }
}

/// The measurements of a block: two samples of some of its pixels.
#[derive(Clone, Default)]
pub struct MeasuredBlock {
    /// By sample and pixel.
    found: [Vec<FoundLight>; SAMPLES as usize],
    receivers: usize,
    lenders: usize,
}

impl MeasuredBlock {
    /// Returns the binary logarithm of the group size, the relative variance that is left then, and the cost in units
    /// of a path.
    fn choice(&self, price: &Price) -> (u32, f32, f32) {
        let own = self.variances(price.floor);
        let kept = own.kept * OWN + price.usual.kept * (1.0 - OWN);
        let shared = own.shared * OWN + price.usual.shared * (1.0 - OWN);
        let paths = self.paths();
        let pairs = self.receivers as f32 * self.lenders as f32 / (paths * paths);
        let mut best = (0, kept + shared, 1.0);
        if self.receivers == 0 {
            return best;
        }
        for (log2, gain) in &GAINS[1..] {
            let cost = 1.0 + OVERHEAD + price.connection * (1u32 << log2) as f32 * pairs;
            let variance = kept + shared / gain;
            if variance + price.variance * cost < best.1 + price.variance * best.2 {
                best = (*log2, variance, cost);
            }
        }
        best
    }

    fn paths(&self) -> f32 {
        self.found.iter().map(Vec::len).sum::<usize>().max(1) as f32
    }

    fn variances(&self, floor: f32) -> Variances {
        let [first, second] = &self.found;
        let (mut kept, mut shared) = (0.0, 0.0);
        let block = self.square() + floor;
        for (a, b) in first.iter().zip(second) {
            // The edge of a lamp, or of the sky, is noise relative to the mean of the two, not to the darker block.
            let own = if a.takes == b.takes { 0.0 } else { square((a.all() + b.all()) * 0.5) + floor };
            let scale = block.max(own).max(f32::MIN_POSITIVE).recip();
            kept += square(a.kept - b.kept) * scale;
            shared += square(a.shared - b.shared) * scale;
        }
        let share = self.paths().recip();
        Variances { kept: kept * share, shared: shared * share }
    }

    /// The squared mean radiance, summed over the channels.
    fn square(&self) -> f32 {
        let sum = self.found.iter().flatten().fold(Color::black(), |sum, found| sum + found.all());
        square(sum * self.paths().recip())
    }
}

/// The sum of a colour's squares.
fn square(Color { r, g, b }: Color<f32>) -> f32 {
    r * r + g * g + b * b
}

/// Columns and rows of blocks, row by row.
fn places(blocks: &Region) -> impl Iterator<Item = [u32; 2]> {
    let Region { x0, y0, x1, y1 } = *blocks;
    (y0..y1).flat_map(move |y| (x0..x1).map(move |x| [x, y]))
}

impl PathSlots {
    /// Records what the paths of the current units have found. The film holds what belongs to first vertices.
    pub fn measure(&mut self, film: &Film) {
        let quantum = film.unit().quantum();
        let region = film.region();
        for (unit, slots) in self.units.clone().zip(self.slots.chunks_exact(self.pixels())) {
            let (block, sample) = (unit / self.samples.len(), unit % self.samples.len());
            let measured = &mut self.measured[block];
            for slot in slots.iter().filter(|slot| slot.begun) {
                let (x, y) = crate::integrator::path::unpack_pixel(slot.pixel);
                let seen =
                    film.pixels()[region.index(x, y)].sum[sample].map(|sum| (sum as f64 * quantum) as f32);
                let (own, shared) = (slot.weight * slot.own, slot.weight * slot.shared);
                let kept = Color::new(seen[0], seen[1], seen[2]) + own;
                let found = FoundLight { kept, shared, takes: slot.takes };
                measured.found[sample].push(found);
                measured.receivers += usize::from(slot.takes);
                let offers = matches!(slot.offer, SecondVertex::Far(_) | SecondVertex::Near(_));
                measured.lenders += usize::from(offers && slot.shared.max_component() > 0.0);
            }
        }
    }

    /// Chooses group sizes by what has been measured.
    pub fn choose(&mut self, pilot: &ReuseProbe) {
        self.sizes = self.measured.iter().map(|block| pilot.choice(block)).collect();
        let places = places(&self.blocks);
        self.chosen.extend(places.zip(self.sizes.iter().copied()));
    }

    /// Restores the earlier choices of the region's blocks; returns false unless all have chosen before.
    pub fn recall(&mut self) -> bool {
        let chosen: Option<Vec<u8>> =
            places(&self.blocks).map(|place| self.chosen.get(&place).copied()).collect();
        let known = chosen.is_some();
        self.sizes = chosen.unwrap_or_default();
        known
    }

    /// Takes the measurements of the first block.
    pub fn measured(&mut self) -> MeasuredBlock {
        std::mem::take(&mut self.measured[0])
    }

    /// True if a pixel's block does not reuse paths.
    pub fn is_plain(&self, x: u32, y: u32) -> bool {
        self.sizes[self.blocks.index(x / self.edge, y / self.edge)] == 0
    }

    /// Begins the probe's samples of the region's blocks.
    pub fn start_pilot(&mut self) {
        self.pilot = true;
        self.samples = 0..SAMPLES;
        self.units = 0..0;
        self.sizes = vec![1; self.blocks.area()];
        self.measured = vec![MeasuredBlock::default(); self.blocks.area()];
    }

    /// The pixels of all blocks of the region.
    pub fn whole_blocks(&self, size: [u32; 2]) -> Region {
        let Region { x0, y0, x1, y1 } = self.blocks;
        let edge = self.edge;
        let (x1, y1) = ((x1 * edge).min(size[0]), (y1 * edge).min(size[1]));
        Region { x0: x0 * edge, y0: y0 * edge, x1, y1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of radiance 1 whose two samples deviate from the mean by `kept` and `lent`.
    fn block(kept: f32, shared: f32, paths: usize) -> MeasuredBlock {
        let pair = |sign: f32| {
            let [kept, shared] = [kept, shared].map(|deviation| Color::grey(0.5 + sign * deviation));
            vec![FoundLight { kept, shared, takes: true }; paths]
        };
        MeasuredBlock { found: [pair(1.0), pair(-1.0)], receivers: 2 * paths, lenders: 2 * paths }
    }

    #[test]
    fn reuse_is_chosen_only_where_it_pays() {
        let choice = |kept, shared| {
            let block = block(kept, shared, 16);
            let price = Price::of(std::slice::from_ref(&block), 200, CONNECTION);
            block.choice(&price).0
        };
        assert_eq!(choice(0.3, 0.0), 0, "there is nothing to gain");
        assert_eq!(choice(0.3, 0.1), 0, "there is little to gain");
        assert_eq!(choice(0.01, 0.4), 6, "there is nothing else");
        // A block that is dark compared to the others is not worth the time.
        let block = block(0.01, 0.2, 16);
        let price = Price::of(std::slice::from_ref(&block), 200, CONNECTION);
        assert_eq!(block.choice(&Price { variance: 100.0, ..price }).0, 0);
        assert_eq!(MeasuredBlock::default().choice(&price).0, 0, "nothing was looked at");
    }

    /// One sample of 128 on a lamp beside its edge outweighed all other blocks.
    #[test]
    fn edges_of_lamps_leave_the_choice_elsewhere_alone() {
        let usual = block(0.01, 0.4, 64);
        let mut at_the_lamp = usual.clone();
        at_the_lamp.found[0][5] =
            FoundLight { kept: Color::grey(50.0), shared: Color::black(), takes: false };
        let mut blocks = vec![usual.clone(); 31];
        blocks.push(at_the_lamp);
        let price = Price::of(&blocks, 31 * 800, CONNECTION);
        assert_eq!(usual.choice(&price).0, 6);
    }

    #[test]
    fn one_pixel_of_each_square_is_probed() {
        for (edge, every) in [(16, 4), (32, 4), (64, 8)] {
            for (x0, y0) in [(0, 0), (8, 16), (400, 48)] {
                let inside = (0..every * every).filter(|i| is_probed(edge, x0 + i % every, y0 + i / every));
                assert_eq!(inside.count(), 1, "{x0} {y0}");
            }
        }
    }
}
