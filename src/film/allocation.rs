//! The number of samples of each block of pixels, decided before rendering.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// The number of samples of each block of a region, row by row: [`Allocation::LEAST`] times a power of two. A block
/// gets the samples with the lowest numbers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Allocation(Vec<u32>);

impl Allocation {
    /// The smallest number of samples of a block.
    pub const LEAST: u32 = 16;
    /// The largest number of samples of a block.
    const MOST: u32 = 1 << 28;

    /// Creates an allocation; `None` if a number is invalid.
    pub fn new(samples: Vec<u32>) -> Option<Allocation> {
        let allocation = Allocation(samples);
        allocation.is_sound().then_some(allocation)
    }

    /// True if all numbers are valid. Those that are read from a file may not be.
    pub fn is_sound(&self) -> bool {
        let can_be = |n: &u32| n.is_power_of_two() && (Self::LEAST..=Self::MOST).contains(n);
        !self.0.is_empty() && self.0.iter().all(can_be)
    }

    /// The number of samples of each block.
    pub fn samples(&self) -> &[u32] {
        &self.0
    }

    /// The largest number of samples of any block.
    pub fn most(&self) -> u32 {
        self.0.iter().copied().max().unwrap_or(0)
    }

    /// Returns the first part of `samples` whose samples all go to the same blocks.
    pub fn first_round(&self, samples: Range<u32>) -> Range<u32> {
        let end = samples.start.max(Self::LEAST - 1).saturating_add(1).next_power_of_two();
        samples.start..samples.end.min(end)
    }

    /// True for each block that gets a sample.
    pub fn blocks(&self, sample: u32) -> Vec<bool> {
        self.0.iter().map(|n| sample < *n).collect()
    }

    /// Returns part `index` of `count`; the parts have equal numbers of samples, summed over all blocks, as far as
    /// whole samples allow.
    pub fn shard(&self, index: u32, count: u32) -> Range<u32> {
        let all: u128 = self.0.iter().map(|n| u128::from(*n)).sum();
        let cut = |part: u32| {
            let wanted = all * u128::from(part) / u128::from(count.max(1));
            let (mut start, mut before) = (0, 0);
            while start < self.most() {
                let round = self.first_round(start..self.most());
                let width = self.0.iter().filter(|n| start < **n).count() as u128;
                if before + width * round.len() as u128 >= wanted {
                    return start + (wanted - before).div_ceil(width.max(1)) as u32;
                }
                before += width * round.len() as u128;
                start = round.end;
            }
            self.most()
        };
        cut(index)..cut(index + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn shards_have_equal_numbers_of_samples(exponents in prop::collection::vec(0u32..7, 1..40), count in 1u32..20) {
            let allocation = Allocation::new(exponents.iter().map(|e| 16 << e).collect()).unwrap();
            let work = |range: Range<u32>| -> u64 {
                range.map(|s| allocation.blocks(s).iter().filter(|gets| **gets).count() as u64).sum()
            };
            let all = work(0..allocation.most());
            prop_assert_eq!(all, allocation.samples().iter().map(|n| u64::from(*n)).sum::<u64>());
            let mut end = 0;
            for index in 0..count {
                let part = allocation.shard(index, count);
                prop_assert_eq!(part.start, end);
                end = part.end;
                // Two cuts, each rounded to whole samples of all blocks.
                prop_assert!(work(part).abs_diff(all / u64::from(count)) <= exponents.len() as u64 + 1);
            }
            prop_assert_eq!(end, allocation.most());
        }

        #[test]
        fn samples_of_a_round_go_to_the_same_blocks(exponents in prop::collection::vec(0u32..5, 1..9), start in 0u32..300) {
            let allocation = Allocation::new(exponents.iter().map(|e| 16 << e).collect()).unwrap();
            let start = start.min(allocation.most() - 1);
            let round = allocation.first_round(start..allocation.most());
            prop_assert!(round.start == start && !round.is_empty());
            let blocks = allocation.blocks(start);
            prop_assert!(round.clone().all(|sample| allocation.blocks(sample) == blocks));
        }
    }

    #[test]
    fn invalid_allocations_are_rejected() {
        for wrong in [vec![], vec![8], vec![16, 48], vec![1 << 30]] {
            assert_eq!(Allocation::new(wrong), None);
        }
    }
}
