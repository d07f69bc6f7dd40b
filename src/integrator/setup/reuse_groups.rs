//! The grouping of pixels for path reuse.

use crate::sampling::hash::{combine, mix};
use crate::sampling::{SampleKey, sobol};
use crate::scene::MaterialRecord;
use crate::simd::{Float, Int};
use crate::world::{Adaptive, Settings, Sharing, Transport};

/// Width and height in pixels of the smallest blocks that contain groups. Blocks of adaptive sampling are as large.
pub const SMALLEST_BLOCK: u32 = CELLS << 1;
/// Columns and rows of cells in a block.
const CELLS: u32 = 8;

/// The grouping of pixels for path reuse. The image is divided into square blocks, independent of the tiles, and these
/// into 8 × 8 square cells. A group has one pixel of each of some cells. So neighbours lie in different groups and have
/// different errors, which cancel each other in the mean of a small area, as they do without path reuse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReuseGroups {
    /// Binary logarithm of the width and height of a cell in pixels.
    cell: u32,
    /// Binary logarithm of a group's pixels.
    pub log2: u32,
    /// True if blocks choose how many of their pixels reuse paths.
    pub chooses: bool,
}

impl ReuseGroups {
    /// The default number of pixels of a group. Half as many take a fifth less time and leave 1.4 times the error.
    const USUAL: u32 = 64;

    /// The grouping for a scene, if its paths are reused.
    pub fn of(materials: &[MaterialRecord], settings: &Settings) -> Option<Self> {
        let pixels = match settings.sharing {
            Sharing::Off => return None,
            Sharing::Auto => Self::USUAL,
            Sharing::Groups(pixels) => pixels,
        };
        // An unsupported size becomes the next smaller one.
        let log2 = pixels.clamp(1, Sharing::SIZES[Sharing::SIZES.len() - 1]).ilog2();
        let is_possible = settings.transport == Transport::Path && !settings.is_for_single_paths();
        let shares = is_possible && any_takes(materials);
        let chooses = settings.sharing == Sharing::Auto;
        (shares && log2 > 0).then_some(Self { cell: cell(settings), log2, chooses })
    }

    /// Groupings of 64 pixels in blocks of all sizes, for tests.
    #[cfg(test)]
    pub fn of_each_cell() -> [Self; 3] {
        [1, 2, 3].map(|cell| Self { cell, log2: 6, chooses: false })
    }

    /// Width and height of a block in pixels.
    #[inline(always)]
    pub fn edge(&self) -> u32 {
        CELLS << self.cell
    }

    /// The number of pixels of a block.
    #[inline(always)]
    pub fn pixels(&self) -> usize {
        (self.edge() * self.edge()) as usize
    }

    /// A point for the direction that a path takes from its first vertex: all pixels of a block draw from one sequence,
    /// in the order of their places, so that the directions of a group are spread evenly.
    #[inline(always)]
    pub fn joint<I: Int>(&self, seed: u64, pixel: I, sample: I, dimension: I) -> (I::Float, I::Float)
    where
        I::Float: Float<Int = I, Mask = I::Mask>,
    {
        let (within, run) = (within_run(sample), run_of(sample));
        // Samples with the same groups continue one sequence; the next ones begin another.
        let index = self.place(seed, pixel, run) * (within + I::splat(1)) + (sample & within);
        let key = SampleKey::new(
            seed ^ JOINT,
            first_of_square(pixel, self.edge()),
            sample,
            combine(I::splat(1), run),
        );
        sobol::two(index, key.pixel_hash(dimension))
    }

    /// The place of a pixel in the order of its block's pixels, of which groups of 2^n pixels are sections of 2^n
    /// places. It changes from run to run of samples, so that no group shows in the average.
    #[inline(always)]
    pub fn place<I: Int>(&self, seed: u64, pixel: I, run: I) -> I {
        let turn = combine(I::splat(seed as u32 ^ (seed >> 32) as u32 ^ PLACES), run);
        let of_block = mix(combine(turn, first_of_square(pixel, self.edge())));
        let of_cell = mix(combine(turn, first_of_square(pixel, 1 << self.cell)));
        let (mut column, mut row) = (pixel, pixel.shr::<16>());
        // A hash decides which pixel of a cell comes first.
        let fine = I::splat((1 << self.cell) - 1);
        let within = spread_bits((column ^ of_cell) & fine)
            ^ spread_bits((row ^ of_cell.shr::<8>()) & fine).shl::<1>();
        for _ in 0..self.cell {
            (column, row) = (column.shr::<1>(), row.shr::<1>());
        }
        // Cells that lie together follow each other; groups that are smaller than a block lie elsewhere in each run.
        let column = (column + of_block) & I::splat(CELLS - 1);
        let row = (row + of_block.shr::<8>()) & I::splat(CELLS - 1);
        let upright = (of_block.shr::<16>() & I::splat(1)).eq(I::splat(0));
        let cells = spread_bits(I::select(upright, column, row))
            ^ spread_bits(I::select(upright, row, column)).shl::<1>();
        within.shl::<{ 2 * CELLS.ilog2() as i32 }>() ^ cells
    }
}

/// The first pixel of the square that a pixel lies in; `edge` is a power of two.
#[inline(always)]
fn first_of_square<I: Int>(pixel: I, edge: u32) -> I {
    pixel & I::splat(!((edge - 1) | (edge - 1) << 16))
}

/// Binary logarithm of the width and height of a cell: blotches of shared errors, which are as large as blocks, should
/// be a sixteenth of the picture.
fn cell(settings: &Settings) -> u32 {
    // Adaptive sampling gives the pixels of a block, and so those of a group, the same number of samples.
    if settings.adaptive != Adaptive::Off {
        return 1;
    }
    let [width, height] = settings.size;
    match width.min(height) {
        0..=362 => 1,
        363..=724 => 2,
        _ => 3,
    }
}

/// True if first vertices of any of these materials can take.
fn any_takes(materials: &[MaterialRecord]) -> bool {
    materials.iter().any(|record| takes(record) && !record.unlit)
}

/// True if first vertices of a material can take: it transmits no light, and is not wholly metallic.
pub fn takes(record: &MaterialRecord) -> bool {
    record.transmission.is_zero() && record.diffuse_transmission.is_zero() && !record.metallic.is_one()
}

/// The first of the samples that have the same groups as this one: 0, 8, 16, 32 and all multiples of 64. The more
/// directions are used together, the more evenly they are spread: at 16 samples, keeping all in the same groups leaves
/// 0.87, and keeping 8 leaves 0.92 of the error of 4. But groups that never change become visible. Runs that depend on
/// the total number of samples would leave 2 to 6 % less error at 64, but then a film could not be continued.
#[inline(always)]
pub fn run_of<I: Int>(sample: I) -> I {
    sample ^ (sample & within_run(sample))
}

/// The bits that distinguish the samples of a run.
#[inline(always)]
fn within_run<I: Int>(sample: I) -> I {
    let from_highest = sample | sample.shr::<1>();
    let from_highest = from_highest | from_highest.shr::<2>();
    let from_highest = from_highest | from_highest.shr::<4>();
    // From 64 on, each 64 samples are a run.
    let above = I::splat(!63);
    let within = (from_highest.shr::<1>() | I::splat(7)) & I::splat(63);
    I::select((sample & above).eq(I::splat(0)), within, I::splat(63))
}

/// Separates the random numbers of places from others.
const PLACES: u32 = 0x706c_6163;

/// Spreads four bits, with a gap after each.
#[inline(always)]
fn spread_bits<I: Int>(x: I) -> I {
    let x = (x ^ x.shl::<2>()) & I::splat(0x33);
    (x ^ x.shl::<1>()) & I::splat(0x55)
}

/// Separates the random numbers that pixels have in common from their own.
const JOINT: u64 = 0x6a6f_696e_7421;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_about_a_sixteenth_of_the_picture() {
        let settings = |size| Settings { size, adaptive: Adaptive::Off, ..Settings::default() };
        for size in [[256, 256], [640, 360], [500, 500], [1920, 1080], [300, 2000]] {
            let edge = CELLS << cell(&settings(size));
            let part = size[0].min(size[1]) as f32 / edge as f32;
            assert!((11.0..23.0).contains(&part), "{size:?}: {edge}");
        }
        let adaptive = Settings { adaptive: Adaptive::On, ..settings([4000, 4000]) };
        assert_eq!(CELLS << cell(&adaptive), SMALLEST_BLOCK);
    }
}
