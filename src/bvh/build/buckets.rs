//! The top of a large tree: distributes primitives to buckets in one pass, by the cuts of a tree over a sample of them
//! (as sample sort chooses its splitters).
//!
//! Near the root a cut hardly depends on single primitives, but a builder that bins and partitions all of them at every
//! level spends half of its time there, in main memory and with little parallelism. Here each chunk goes through all
//! levels in one pass, in parallel with the others; the contents of a bucket fit a cache. The sample and the chunks do
//! not depend on the number of threads.

use rayon::prelude::*;

use super::binning::{BINS, Binning, Bins, partition};
use super::primitives::Primitives;
use super::reference::{Reference, SimdAabb};

/// The most levels of cuts; two to the power of the levels is the number of buckets.
const MOST_LEVELS: u32 = 8;
/// The largest number of buckets.
pub const MOST: usize = 1 << MOST_LEVELS;
/// The desired number of references in a bucket.
const BUCKET: usize = 4096;
/// The number of references in a chunk.
const CHUNK: usize = 1 << 14;
/// The number of references that are classified together.
const AT_ONCE: usize = 16;
/// The largest sample that cuts are chosen from.
const SAMPLE: usize = 1 << 17;
/// One primitive in this many is in the sample, unless that is too large.
const SAMPLED: usize = 8;
/// The smallest sample that a cut is chosen from.
const FEWEST: usize = 16;
/// Larger samples are cut by several threads.
const PARALLEL: usize = 2048;

/// A plane: references with their doubled centre below it go left.
#[derive(Clone, Copy)]
struct Divider {
    threshold: f32,
    axis: u32,
}

impl Divider {
    /// Sends everything left.
    const NONE: Divider = Divider { threshold: f32::INFINITY, axis: 0 };

    #[inline(always)]
    fn is_right(&self, center: &[f32; 4]) -> bool {
        center[self.axis as usize % 4] >= self.threshold
    }
}

/// The cuts, in the order of the buckets that they separate: bucket, cut, bucket, …
struct Dividers {
    levels: u32,
    dividers: Vec<Divider>,
}

impl Dividers {
    fn new(primitives: &Primitives) -> Self {
        let count = primitives.count();
        let levels = (count / BUCKET).max(1).ilog2().min(MOST_LEVELS);
        let mut dividers = vec![Divider::NONE; (1 << levels) - 1];
        let stride = SAMPLED.max(count / SAMPLE);
        if levels > 0 {
            let mut sample: Vec<Reference> =
                (0..count).step_by(stride).map(|i| primitives.reference(i)).collect();
            divide(&mut sample, stride as u32, &mut dividers);
        }
        Self { levels, dividers }
    }

    /// The buckets of references with these doubled centres. They advance together, level by level: each step down
    /// depends on the one before it, but not on its neighbours'.
    #[inline(always)]
    fn buckets(&self, centers: &[[f32; 4]; AT_ONCE]) -> [u8; AT_ONCE] {
        let mut buckets = [0; AT_ONCE];
        for isa in (0..self.levels).rev() {
            let half = 1 << isa;
            for (bucket, center) in buckets.iter_mut().zip(centers) {
                *bucket += (self.dividers[*bucket + half - 1].is_right(center) as usize) << isa;
            }
        }
        buckets.map(|bucket| bucket as u8)
    }
}

/// Chooses the cut in the middle of `dividers`, and the others from the two sides of the sample.
fn divide(sample: &mut [Reference], weight: u32, dividers: &mut [Divider]) {
    if dividers.is_empty() || sample.len() < FEWEST {
        return;
    }
    let binning = Binning::new(&SimdAabb::around_centers(sample), BINS);
    let mut bins = Bins::default();
    bins.fill(sample.iter(), &binning);
    let Some(cut) = bins.best(weight, 1) else { return };
    let threshold = binning.threshold(&cut);
    let divider = Divider { threshold, axis: cut.axis as u32 };
    let middle = partition(sample, cut.axis, threshold);
    let parallel = sample.len() > PARALLEL;
    let (left, right) = sample.split_at_mut(middle);
    let half = dividers.len() / 2;
    dividers[half] = divider;
    let (below, above) = dividers.split_at_mut(half);
    let mut left = || divide(left, weight, below);
    let mut right = || divide(right, weight, &mut above[1..]);
    if parallel {
        rayon::join(left, right);
    } else {
        left();
        right();
    }
}

/// The assignment of primitives to buckets.
pub struct Buckets {
    /// The binary logarithm of the number of buckets.
    pub levels: u32,
    /// Indices of primitives, sorted by buckets within each chunk.
    sorted: Vec<u32>,
    /// For each chunk, the end of each bucket's part within the chunk.
    ends: Vec<Vec<u32>>,
}

impl Buckets {
    /// Sorts primitives by cuts that are chosen from a sample.
    pub fn new(primitives: &Primitives) -> Self {
        let dividers = Dividers::new(primitives);
        let levels = dividers.levels;
        let mut sorted = vec![0; primitives.count()];
        let chunks = sorted.par_chunks_mut(CHUNK).enumerate();
        let ends = chunks.map(|(i, chunk)| sort_chunk(i * CHUNK, chunk, &dividers, primitives)).collect();
        Self { levels, sorted, ends }
    }

    /// The number of primitives in each bucket.
    pub fn sizes(&self) -> Vec<usize> {
        let mut sizes = vec![0; 1 << self.levels];
        for ends in &self.ends {
            let starts = std::iter::once(&0).chain(ends);
            for ((size, end), start) in sizes.iter_mut().zip(ends).zip(starts) {
                *size += (end - start) as usize;
            }
        }
        sizes
    }

    /// The indices of a bucket's primitives, ascending.
    pub fn members(&self, bucket: usize) -> impl Iterator<Item = u32> {
        self.sorted.chunks(CHUNK).zip(&self.ends).flat_map(move |(chunk, ends)| {
            let start = if bucket == 0 { 0 } else { ends[bucket - 1] as usize };
            chunk[start..ends[bucket] as usize].iter().copied()
        })
    }
}

/// The peak memory in bytes of sorting `count` primitives, of which the result keeps a part.
pub fn peak_bytes(count: usize) -> usize {
    let sample = count.div_ceil(SAMPLED.max(count / SAMPLE)) * size_of::<Reference>();
    let ends = count.div_ceil(CHUNK) * (MOST * 4 + size_of::<Vec<u32>>());
    // The lists of sizes, cuts and tasks for each bucket are small.
    count * 4 + ends + sample + MOST * 512
}

/// Writes the indices from `first` on to `chunk`, sorted by buckets, and returns the end of each bucket.
fn sort_chunk(first: usize, chunk: &mut [u32], dividers: &Dividers, primitives: &Primitives) -> Vec<u32> {
    const { assert!(MOST_LEVELS <= u8::BITS && CHUNK.is_multiple_of(AT_ONCE)) };
    let mut keys = [0u8; CHUNK];
    let mut next = [0u32; MOST];
    for start in (0..chunk.len()).step_by(AT_ONCE) {
        let count = AT_ONCE.min(chunk.len() - start);
        let mut centers = [[0.0; 4]; AT_ONCE];
        for (i, center) in centers[..count].iter_mut().enumerate() {
            *center = primitives.reference(first + start + i).center().to_array();
        }
        let buckets = dividers.buckets(&centers);
        keys[start..start + AT_ONCE].copy_from_slice(&buckets);
        buckets[..count].iter().for_each(|bucket| next[*bucket as usize] += 1);
    }
    let mut sum = 0;
    for next in &mut next {
        sum += std::mem::replace(next, sum);
    }
    for (i, key) in keys[..chunk.len()].iter().enumerate() {
        let place = &mut next[*key as usize];
        chunk[*place as usize] = (first + i) as u32;
        *place += 1;
    }
    next[..1 << dividers.levels].to_vec()
}
