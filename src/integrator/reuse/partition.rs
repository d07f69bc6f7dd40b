//! The groups of pixels of a block that reuse paths: neighbours, in different groups from run to run of samples, so
//! that no group shows in the average.

use std::num::Wrapping;

use crate::integrator::setup::reuse_groups::{BLOCK, PIXELS};
use crate::sampling::hash::{combine, mix};

/// A partition of a block's pixels into groups of equal size.
pub struct Partition {
    members: [u8; PIXELS],
    size: usize,
}

impl Partition {
    /// Divides the block at (column, row), in blocks, into groups of 2^`log2` pixels. They change with `turn`.
    pub fn new(log2: u32, seed: u64, [column, row]: [u32; 2], turn: u32) -> Self {
        let words = [seed as u32, (seed >> 32) as u32, column, row, turn];
        let bits = words.into_iter().fold(Wrapping(0x5a17), |hash, word| combine(hash, Wrapping(word)));
        let bits = mix(bits).0;
        let size = 1usize << log2;
        // As square as possible, horizontal or upright.
        let (along, across) = (log2.div_ceil(2), log2 / 2);
        let upright = bits & 1 != 0;
        // Two neighbouring groups may take alternate pixels of the area that both cover.
        let chequered = bits & 2 != 0 && across < 4;
        let (x0, y0) = (bits >> 8 & 15, bits >> 16 & 15);
        let mut members = [0; PIXELS];
        let mut filled = [0usize; PIXELS];
        for place in 0..PIXELS as u32 {
            // Wraps around the block's edges, so that all groups have the same size wherever they begin.
            let (x, y) = ((place % BLOCK + x0) % BLOCK, (place / BLOCK + y0) % BLOCK);
            let (u, v) = if upright { (y, x) } else { (x, y) };
            let group = (v >> across) * (BLOCK >> along) + (u >> along);
            let odd = (u + v) & 1 != 0;
            let group = if chequered && odd { group ^ BLOCK >> along } else { group } as usize;
            members[group * size + filled[group]] = place as u8;
            filled[group] += 1;
        }
        Self { members, size }
    }

    /// The groups: places of their pixels in the block.
    pub fn groups(&self) -> impl Iterator<Item = &[u8]> {
        self.members.chunks_exact(self.size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_in_one_group() {
        for log2 in 1..=6 {
            for sample in 0..64 {
                let partition = Partition::new(log2, 7, [3, 5], sample);
                let mut all: Vec<u8> = partition.groups().flatten().copied().collect();
                assert!(partition.groups().all(|group| group.len() == 1 << log2));
                all.sort_unstable();
                assert!(all.iter().enumerate().all(|(i, place)| i == usize::from(*place)), "{log2} {sample}");
            }
        }
    }

    #[test]
    fn groups_change_with_the_sample() {
        let first = |sample| Partition::new(5, 0, [0, 0], sample).members;
        let different = (1..32).filter(|sample| first(*sample) != first(0)).count();
        assert!(different > 28, "{different} of 31");
    }
}
