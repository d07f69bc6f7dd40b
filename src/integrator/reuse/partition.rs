//! The groups of pixels of a block that reuse paths: different ones from run to run of samples, so that no group shows in
//! the average.

use std::num::Wrapping;

use crate::integrator::path::pack_pixel;
use crate::integrator::setup::reuse_groups::ReuseGroups;

/// A partition of a block's pixels into groups of equal size.
pub struct Partition {
    /// The number of the pixel at each place; pixels are numbered row by row.
    members: Vec<u16>,
    size: usize,
}

impl Partition {
    /// Divides the block at (column, row), in blocks, into groups of 2^`log2` pixels. They change with `run`.
    pub fn new(grouping: &ReuseGroups, log2: u32, seed: u64, [column, row]: [u32; 2], run: u32) -> Self {
        let edge = grouping.edge();
        let mut members = vec![0; grouping.pixels()];
        for number in 0..edge * edge {
            let (x, y) = (column * edge + number % edge, row * edge + number / edge);
            let place = grouping.place(seed, Wrapping(pack_pixel(x, y)), Wrapping(run));
            members[place.0 as usize] = number as u16;
        }
        Self { members, size: 1 << log2 }
    }

    /// The groups: numbers of their pixels in the block.
    pub fn groups(&self) -> impl Iterator<Item = &[u16]> {
        self.members.chunks_exact(self.size)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn every_pixel_is_in_one_group() {
        for (grouping, log2) in
            ReuseGroups::of_each_cell().into_iter().flat_map(|g| (1..=6).map(move |n| (g, n)))
        {
            for run in [0, 8, 16, 32, 64, 640] {
                let partition = Partition::new(&grouping, log2, 7, [3, 5], run);
                let mut all: Vec<u16> = partition.groups().flatten().copied().collect();
                assert!(partition.groups().all(|group| group.len() == 1 << log2));
                all.sort_unstable();
                assert!(all.iter().enumerate().all(|(i, number)| i == usize::from(*number)), "{log2} {run}");
            }
        }
    }

    #[test]
    fn groups_change_with_the_run() {
        for grouping in ReuseGroups::of_each_cell() {
            let first = |run| Partition::new(&grouping, 5, 0, [0, 0], run).members;
            let different = (1..32).filter(|run| first(*run) != first(0)).count();
            assert!(different > 28, "{different} of 31");
        }
    }

    #[test]
    fn members_of_a_group_lie_in_different_cells_that_lie_together() {
        for grouping in ReuseGroups::of_each_cell() {
            let edge = grouping.edge();
            let cell = |number: &u16| {
                let number = u32::from(*number);
                [number % edge * 8 / edge, number / edge * 8 / edge]
            };
            for log2 in 1..=6 {
                for group in Partition::new(&grouping, log2, 3, [1, 2], 8).groups() {
                    let cells: HashSet<_> = group.iter().map(cell).collect();
                    assert_eq!(cells.len(), 1 << log2, "one pixel of each cell");
                    // Columns and rows wrap around.
                    let sides: [HashSet<u32>; 2] =
                        [0, 1].map(|axis| cells.iter().map(|cell| cell[axis]).collect());
                    assert_eq!(sides[0].len() * sides[1].len(), 1 << log2, "a rectangle of cells");
                    assert!(sides.iter().all(|side| side.len() * side.len() <= 2 << log2), "no long one");
                }
            }
        }
    }
}
