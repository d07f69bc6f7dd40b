//! The order in which a wave's hits are shaded.

use crate::integrator::Sorting;
use crate::integrator::path::columns::PADDING;

/// The order in which hits are shaded.
#[derive(Default)]
pub struct MaterialRanges {
    sorting: Sorting,
    pub(super) order: Vec<u32>,
    /// Material, first place and the place after the last one, for each material that occurs.
    pub(super) groups: Vec<(u32, u32, u32)>,
    counts: Vec<u32>,
}

impl MaterialRanges {
    /// Creates the order of at most `capacity` hits of `materials` materials.
    pub fn new(capacity: usize, materials: usize, sorting: Sorting) -> Self {
        Self {
            sorting,
            order: vec![0; capacity + PADDING],
            groups: Vec::with_capacity(materials.min(capacity)),
            counts: vec![0; materials],
        }
    }

    /// Sorts the hits of a wave.
    pub fn sort(&mut self, materials: &[u32]) {
        self.groups.clear();
        match self.sorting {
            Sorting::ByMaterial => self.sort_by_material(materials),
            Sorting::Unsorted => self.divide(materials),
        }
    }

    /// Leaves every 16 hits in place and divides them by material.
    fn divide(&mut self, materials: &[u32]) {
        let mut next = 0;
        for (chunk, of_chunk) in materials.chunks(PADDING).enumerate() {
            let mut todo = (1u32 << of_chunk.len()) - 1;
            while todo != 0 {
                let (first, material) = (next, of_chunk[todo.trailing_zeros() as usize]);
                for (lane, other) in of_chunk.iter().enumerate() {
                    if *other == material {
                        self.order[next] = (chunk * PADDING + lane) as u32;
                        next += 1;
                        todo &= !(1 << lane);
                    }
                }
                self.groups.push((material, first as u32, next as u32));
            }
        }
    }

    /// Counting sort: places of equal materials keep their order.
    fn sort_by_material(&mut self, materials: &[u32]) {
        self.counts.fill(0);
        for material in materials {
            self.counts[*material as usize] += 1;
        }
        let mut first = 0;
        for (material, count) in self.counts.iter_mut().enumerate() {
            if *count > 0 {
                self.groups.push((material as u32, first, first + *count));
                first += std::mem::replace(count, first);
            }
        }
        for (place, material) in materials.iter().enumerate() {
            let next = &mut self.counts[*material as usize];
            self.order[*next as usize] = place as u32;
            *next += 1;
        }
    }

    /// The groups of at most `width` hits that are shaded together, by their places in the wave, with their material.
    pub fn lane_groups(&self, width: usize) -> impl Iterator<Item = (u32, &[u32])> {
        self.groups.iter().flat_map(move |&(material, first, end)| {
            self.order[first as usize..end as usize].chunks(width).map(move |places| (material, places))
        })
    }
}
