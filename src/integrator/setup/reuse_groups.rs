//! The grouping of pixels for path reuse.

use crate::sampling::hash::combine;
use crate::sampling::{SampleKey, sobol};
use crate::scene::MaterialRecord;
use crate::simd::{Float, Int};
use crate::world::{Settings, Sharing, Transport};

/// Width and height in pixels of the blocks that contain the groups, independent of the tiles.
pub const BLOCK: u32 = 16;
/// Pixels of a block.
pub const PIXELS: usize = (BLOCK * BLOCK) as usize;

/// The grouping of pixels for path reuse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReuseGroups {
    /// Binary logarithm of a group's pixels.
    pub log2: u32,
    /// True if blocks choose how many of their pixels reuse paths.
    pub chooses: bool,
}

impl ReuseGroups {
    /// The default number of pixels of a group. Half as many take a fifth less time and leave 1.5 times the error.
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
        (shares && log2 > 0).then_some(Self { log2, chooses })
    }

    /// A point for the direction that a path takes from its first vertex: all pixels of a block draw from one sequence,
    /// in Morton order, so that the directions of a group are spread evenly.
    #[inline(always)]
    pub fn joint<I: Int>(&self, seed: u64, pixel: I, sample: I, dimension: I) -> (I::Float, I::Float)
    where
        I::Float: Float<Int = I, Mask = I::Mask>,
    {
        let within = within_run(sample);
        let block = pixel & I::splat(!((BLOCK - 1) | (BLOCK - 1) << 16));
        let (x, y) = (pixel & I::splat(BLOCK - 1), pixel.shr::<16>() & I::splat(BLOCK - 1));
        let place = spread_bits(x) ^ spread_bits(y).shl::<1>();
        // Samples with the same groups continue one sequence; the next ones begin another.
        let index = place * (within + I::splat(1)) + (sample & within);
        let key = SampleKey::new(seed ^ JOINT, block, sample, combine(I::splat(1), run_of(sample)));
        sobol::two(index, key.pixel_hash(dimension))
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

/// Spreads four bits, with a gap after each.
#[inline(always)]
fn spread_bits<I: Int>(x: I) -> I {
    let x = (x ^ x.shl::<2>()) & I::splat(0x33);
    (x ^ x.shl::<1>()) & I::splat(0x55)
}

/// Separates the random numbers that pixels have in common from their own.
const JOINT: u64 = 0x6a6f_696e_7421;
