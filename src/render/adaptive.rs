//! Adaptive sampling by blocks of pixels: with as many rays in total as uniform sampling would take, spent where they
//! reduce the error most.
//!
//! Rounds double the samples of the blocks that continue: after 16 samples of all blocks, to 32, 64 and so on. The
//! choice depends only on the film's integers at the end of a round and on the number of rays of the first samples, so
//! it is the same for all ways to render. The arithmetic here is restricted to operations that IEEE 754 rounds in the
//! same way everywhere.
//!
//! Stopping by the same samples that are averaged is biased (Kirk and Arvo 1991, "Unbiased sampling techniques for
//! image synthesis"): a block with little noise by chance stops early. Over blocks of 256 pixels, and from 16 samples
//! on, little of that bias is left: the means of 16 images of two scenes were 0.8 % below and 0.4 % above those of
//! uniform samples, with a deviation of 0.7 %. [`Adaptive::Unbiased`] chooses once, by a pilot whose samples are
//! discarded: a sixteenth of the samples decides about the others, which can then be rendered in any order and place.
//!
//! [`Adaptive::Unbiased`]: crate::world::Adaptive::Unbiased

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};
use std::ops::Range;

use crate::film::{Allocation, Film, PixelSum, Region};
use crate::integrator::setup::reuse_groups::SMALLEST_BLOCK as BLOCK;

/// The number of samples that all pixels get: with fewer, blocks would be chosen by chance.
pub const PILOT: u32 = Allocation::LEAST;
/// The number of a pilot's first sample, beyond all samples that count.
pub const FIRST_OF_PILOT: u32 = 1 << 28;
/// A block gets at most this many times the average number of samples.
const MOST: u32 = 16;
/// The lower limit of a block's brightness, as a fraction of the image's mean.
const DARK: f64 = 0.5;
/// The upper limit of a pixel's squared noise, as a multiple of its block's squared brightness: light that one sample
/// in thousands finds is not found by twice as many.
const OUTLIER: f64 = 4.0;

/// A round: samples that some blocks get.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Round {
    /// The samples.
    pub samples: Range<u32>,
    /// True for each block of the region that gets them, row by row.
    pub blocks: Vec<bool>,
}

/// The noise and the cost of a block.
struct BlockNoise {
    /// The variance of a sample, relative to the square of the brightness, summed over the block's pixels.
    variance: f64,
    pixels: f64,
    /// Samples per pixel.
    samples: u32,
    /// The cost of one sample of all its pixels.
    price: f64,
}

/// Returns the blocks of a region: squares of the whole image, clipped to the region.
pub fn blocks(region: Region) -> Vec<Region> {
    super::tiles(region, BLOCK)
}

/// Returns the next round; `None` when all blocks have their samples. `rays` is the number of rays of the first
/// [`PILOT`] samples of each block, and `budget` is the total cost, in samples of every pixel.
pub fn next_round(film: &Film, rays: &[u64], budget: u32) -> Option<Round> {
    let mut known = measured(film, &blocks(film.region()));
    // Without ray counts, cost is proportional to area.
    known.iter_mut().zip(rays).for_each(|(block, rays)| block.price = (*rays).max(1) as f64);
    let reached = known.iter().map(|block| block.samples).max()?;
    let next = reached.checked_mul(2)?;
    let blocks: Vec<bool> = allocated(&known, budget, reached).iter().map(|wanted| *wanted >= next).collect();
    blocks.contains(&true).then_some(Round { samples: reached..next, blocks })
}

/// Returns the number of samples per pixel of a discarded pilot.
pub fn pilot_samples(budget: u32) -> u32 {
    // More than 64 would be many for a pilot.
    (budget / 16).clamp(PILOT, 4 * PILOT)
}

/// Returns the number of samples of each block, chosen by a pilot whose samples are discarded but count against the
/// budget; `rays` is the pilot's number of rays in each block.
pub fn allocation(film: &Film, rays: &[u64], budget: u32) -> Option<Allocation> {
    let mut known = measured(film, &blocks(film.region()));
    known.iter_mut().zip(rays).for_each(|(block, rays)| block.price = (*rays).max(1) as f64);
    known.iter_mut().for_each(|block| block.samples = PILOT);
    Allocation::new(allocated(&known, budget.saturating_sub(pilot_samples(budget)), PILOT))
}

/// Restricts the allocation of a region to a part of it.
pub fn allocation_of_part(allocation: &Allocation, region: Region, part: Region) -> Option<Allocation> {
    // Blocks are squares of the whole image, whatever part of them a region cuts off.
    let place = |block: &Region| [block.x0 / BLOCK, block.y0 / BLOCK];
    let own: HashMap<[u32; 2], u32> =
        blocks(region).iter().map(place).zip(allocation.samples().iter().copied()).collect();
    let samples: Option<Vec<u32>> =
        blocks(part).iter().map(|block| own.get(&place(block)).copied()).collect();
    Allocation::new(samples?)
}

fn samples(pixel: &PixelSum) -> u32 {
    pixel.count[0] + pixel.count[1]
}

/// Estimates the noise of a film's blocks.
fn measured(film: &Film, places: &[Region]) -> Vec<BlockNoise> {
    let quantum = film.unit().quantum();
    let mean = |p: &PixelSum, parity: usize, c: usize| {
        p.sum[parity][c] as f64 * quantum / f64::from(p.count[parity].max(1))
    };
    let brightness = |p: &PixelSum| (0..3).map(|c| mean(p, 0, c) + mean(p, 1, c)).sum::<f64>() / 6.0;
    let each: Vec<PixelSum> = (0..film.pixels().len()).map(|index| film.shown(index)).collect();
    let of_all = each.iter().map(brightness).sum::<f64>() / each.len().max(1) as f64;
    let floor = DARK * of_all;
    let mut known: Vec<BlockNoise> = Vec::with_capacity(places.len());
    for place in places {
        let rows = (place.y0..place.y1).map(|y| film.region().index(place.x0, y));
        let pixels = rows.flat_map(|start| &each[start..start + place.width() as usize]);
        let area = place.area() as f64;
        let bright = (pixels.clone().map(brightness).sum::<f64>() / area).max(floor);
        let most = OUTLIER * bright * bright;
        let noise = |p: &PixelSum| {
            // The mean of two halves has a quarter of the variance of their difference.
            let square = |c: usize| {
                let difference = mean(p, 0, c) - mean(p, 1, c);
                0.25 * difference * difference
            };
            (0..3).map(square).sum::<f64>().min(most)
        };
        let samples = pixels.clone().map(samples).max().unwrap_or(0);
        let sum: f64 = pixels.map(noise).sum();
        let variance = if sum > 0.0 { sum / (bright * bright) * f64::from(samples) } else { 0.0 };
        known.push(BlockNoise { variance, pixels: area, samples, price: area });
    }
    beside_noise(&mut known, film.region());
    known
}

/// Replaces each block's noise by half its own and half the mean around it: 16 samples are a poor estimate for one
/// block, and a block beside a noisy one may hold a part of the same noise, found by too few samples to show.
fn beside_noise(known: &mut [BlockNoise], region: Region) {
    let columns = (region.x1.div_ceil(BLOCK) - region.x0 / BLOCK) as usize;
    let each: Vec<f64> = known.iter().map(|block| block.variance / block.pixels).collect();
    for (place, block) in known.iter_mut().enumerate() {
        let (column, row) = (place % columns, place / columns);
        let (mut sum, mut count) = (0.0, 0.0);
        for y in row.saturating_sub(1)..=row + 1 {
            for x in column.saturating_sub(1)..=(column + 1).min(columns - 1) {
                if let Some(variance) = each.get(y * columns + x) {
                    sum += variance;
                    count += 1.0;
                }
            }
        }
        block.variance = 0.5 * (block.variance + sum / count * block.pixels);
    }
}

/// The next doubling of a block's samples, and its benefit per cost.
struct Doubling {
    worth: f64,
    block: usize,
}

impl PartialEq for Doubling {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Doubling {}

impl PartialOrd for Doubling {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Doubling {
    fn cmp(&self, other: &Self) -> Ordering {
        self.worth.total_cmp(&other.worth).then(other.block.cmp(&self.block))
    }
}

/// Allocates samples to blocks: the doublings that reduce the error most for their cost, as long as the budget lasts.
/// Blocks that have stopped before keep their samples.
fn allocated(known: &[BlockNoise], budget: u32, reached: u32) -> Vec<u32> {
    let mut wanted: Vec<u32> = known.iter().map(|block| block.samples).collect();
    let left = |block: &BlockNoise| (f64::from(budget) - f64::from(block.samples)) * block.price;
    let mut left: f64 = known.iter().map(left).sum();
    // From n to 2 n samples per pixel the variance s / n is halved, for n more samples per pixel.
    let worth = |block: usize, n: u32| {
        let (n, block) = (f64::from(n.max(1)), &known[block]);
        block.variance / (2.0 * n * n * block.price)
    };
    let going_on = (0..known.len()).filter(|block| known[*block].samples == reached);
    let mut doublings: BinaryHeap<Doubling> =
        going_on.map(|block| Doubling { worth: worth(block, reached), block }).collect();
    while let Some(Doubling { worth: value, block }) = doublings.pop() {
        let n = wanted[block];
        let price = f64::from(n) * known[block].price;
        if value <= 0.0 || price > left {
            break;
        }
        left -= price;
        wanted[block] = 2 * n;
        if n < budget.saturating_mul(MOST) / 4 {
            doublings.push(Doubling { worth: worth(block, 2 * n), block });
        }
    }
    wanted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::FilmScale;
    use crate::math::Rgb;

    /// 16 samples of 4 × 3 blocks; `noise` returns how far a block's even and odd samples deviate from 1.
    fn film(noise: impl Fn(u32, u32) -> f32) -> Film {
        let region = Region { x0: 8, y0: 0, x1: 64, y1: 40 };
        let mut film = Film::new(region, FilmScale::default());
        for (x, y) in (region.y0..region.y1).flat_map(|y| (region.x0..region.x1).map(move |x| (x, y))) {
            let apart = noise(x / BLOCK, y / BLOCK);
            for sample in 0..PILOT {
                film.count(x, y, sample);
                film.add(x, y, sample, Rgb::splat(1.0 + if sample & 1 == 0 { apart } else { -apart }));
            }
        }
        film
    }

    #[test]
    fn equal_blocks_get_equal_samples() {
        let even = film(|_, _| 0.1);
        let round = next_round(&even, &[], 64).expect("more");
        assert_eq!((round.samples, round.blocks), (16..32, vec![true; 12]));
        assert_eq!(next_round(&even, &[], 16), None, "there is nothing left");
        assert_eq!(next_round(&film(|_, _| 0.0), &[], 64), None, "there is no noise");
    }

    #[test]
    fn noisy_block_and_its_neighbours_get_more_samples() {
        let corner = film(|x, y| if (x, y) == (0, 0) { 0.02 } else { 0.001 });
        let round = next_round(&corner, &[], 32).expect("more");
        let chosen: Vec<usize> = (0..12).filter(|block| round.blocks[*block]).collect();
        assert_eq!(chosen, [0, 1, 4, 5]);
    }

    #[test]
    fn cheap_blocks_get_samples_first() {
        let even = film(|_, _| 0.1);
        let mut rays = [1000; 12];
        (rays[3], rays[7]) = (10, 10);
        let round = next_round(&even, &rays, 17).expect("more");
        let chosen: Vec<usize> = (0..12).filter(|block| round.blocks[*block]).collect();
        assert_eq!(chosen, [3, 7]);
    }

    #[test]
    fn allocation_stays_within_budget() {
        let uneven = film(|x, y| 0.01 * (1 + x * 7 % 4 + y * 5 % 3) as f32);
        for budget in [17, 32, 50, 64, 1000] {
            let known = measured(&uneven, &blocks(uneven.region()));
            let wanted = allocated(&known, budget, PILOT);
            let spent: f64 = wanted.iter().zip(&known).map(|(n, block)| f64::from(*n) * block.price).sum();
            let all: f64 = known.iter().map(|block| block.price).sum();
            assert!(spent <= f64::from(budget) * all && spent > 0.5 * f64::from(budget) * all, "{budget}");
        }
    }
}
