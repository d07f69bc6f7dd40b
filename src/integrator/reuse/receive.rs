//! Sums of the light that first vertices take from second vertices.

use super::path_slots::{PathSlots, Received};
use crate::math::Color;
use crate::simd::{Float, Kernel, Lanes};

/// The padding of arrays, at least the width of any lane type.
pub(super) const PADDING: usize = 16;
/// The largest number of members of a group.
const LARGEST: usize = 64;

/// A slot whose second vertex gives.
#[derive(Clone, Copy)]
pub(super) struct Lender {
    pub slot: u32,
    /// Its place among the members of its group.
    pub place: u32,
    /// A factor of the light that it gives.
    pub factor: f32,
}

/// A gathered group: its range of members, its range of lenders (members whose second vertices give), and its first
/// pair.
pub(super) struct GatheredGroup {
    pub members: std::ops::Range<usize>,
    pub lenders: std::ops::Range<usize>,
    pub pairs: usize,
}

impl GatheredGroup {
    /// The distance between the pairs of one lender and those of the next.
    pub fn row(&self) -> usize {
        self.members.len() + PADDING
    }
}

/// For each lender and each member of its group: the density with which the member draws the second vertex, and what it
/// would take of a radiance of 1, both as seen from the member.
#[derive(Default)]
pub(super) struct Pairs {
    pub density: Vec<f32>,
    pub value: [Vec<f32>; 3],
}

/// Sums up what the members of a group take from its lenders.
pub(super) struct Receive<'a> {
    pub group: &'a GatheredGroup,
    pub members: &'a [u32],
    pub lenders: &'a [Lender],
    pub pairs: &'a Pairs,
    pub slots: &'a PathSlots,
    pub received: &'a mut [Received],
    pub by_group: &'a mut [Vec<Color<f32>>],
}

impl Kernel for Receive<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let members = &self.members[self.group.members.clone()];
        let lenders = &self.lenders[self.group.lenders.clone()];
        let mut densities = [0.0; LARGEST];
        self.group.add_densities(self.pairs, &mut densities[..lenders.len()]);
        let [r, g, b] = self.sums::<L>(None, &densities);
        for (place, at) in members.iter().enumerate() {
            self.received[*at as usize].radiance = Color::new(r[place], g[place], b[place]);
        }
        for group in 0..self.by_group.len() {
            if self.has_light(group) {
                let [r, g, b] = self.sums::<L>(Some(group), &densities);
                for (place, at) in members.iter().enumerate() {
                    self.by_group[group][*at as usize] = Color::new(r[place], g[place], b[place]);
                }
            }
        }
    }
}

/// Red, green and blue of each member.
type ReceivedSums = [[f32; LARGEST + PADDING]; 3];

impl Receive<'_> {
    /// True if some lender has light of a light group.
    fn has_light(&self, group: usize) -> bool {
        let lenders = &self.lenders[self.group.lenders.clone()];
        lenders
            .iter()
            .any(|lender| self.slots.shared(lender.slot as usize, Some(group)).max_component() > 0.0)
    }

    /// The light that members take of a light group, or of all lights, given the sum of all densities for each lender.
    #[inline(always)]
    fn sums<L: Lanes>(&self, of: Option<usize>, densities: &[f32; LARGEST]) -> ReceivedSums {
        let Self { group, pairs, slots, .. } = *self;
        let members = &self.members[group.members.clone()];
        let lenders = &self.lenders[group.lenders.clone()];
        let mut sums = [[0.0; LARGEST + PADDING]; 3];
        for (row, lender) in lenders.iter().enumerate() {
            let start = group.pairs + row * group.row();
            let density = &pairs.density[start..][..group.row()];
            let slot = &slots.slots[lender.slot as usize];
            let (own, shared) = (lender.place as usize, slots.shared(lender.slot as usize, of));
            if of.is_some() && shared.max_component() <= 0.0 {
                continue;
            }
            let shared = shared * lender.factor;
            if density[own] <= 0.0 {
                // Because of rounding, the path might not find its own vertex again: it keeps its light.
                let kept = slot.weight * shared;
                for (sum, more) in sums.iter_mut().zip([kept.r, kept.g, kept.b]) {
                    sum[own] += more;
                }
                continue;
            }
            let part = shared * (1.0 / densities[row]);
            let part = [part.r, part.g, part.b].map(<L::Queue as Float>::splat);
            for at in (0..members.len()).step_by(L::Queue::WIDTH) {
                let found = L::Queue::load(&density[at..]).gt(Float::zero());
                for channel in 0..3 {
                    let value = L::Queue::load(&pairs.value[channel][start + at..]) * part[channel];
                    let sum = &mut sums[channel][at..];
                    (L::Queue::load(sum) + Float::select(found, value, Float::zero())).store(sum);
                }
            }
        }
        sums
    }
}

impl GatheredGroup {
    /// The sum of all members' densities for each lender. Four run in parallel: each is a chain of additions in a fixed
    /// order, bound by latency.
    #[inline(always)]
    fn add_densities(&self, pairs: &Pairs, sums: &mut [f32]) {
        let (row, count) = (self.row(), self.members.len());
        let density = &pairs.density[self.pairs..][..row * sums.len()];
        for (some, sums) in density.chunks(4 * row).zip(sums.chunks_mut(4)) {
            let last = sums.len() - 1;
            let rows = [0, 1, 2, 3].map(|i: usize| &some[i.min(last) * row..][..count]);
            let mut all = [0.0; 4];
            for place in 0..count {
                for (sum, row) in all.iter_mut().zip(rows) {
                    *sum += row[place];
                }
            }
            sums.copy_from_slice(&all[..=last]);
        }
    }
}

/// Counts the second vertices from which the members of a group take any light.
pub(super) fn count_senders(
    group: &GatheredGroup,
    members: &[u32],
    pairs: &Pairs,
    received: &mut [Received],
) {
    for (place, at) in members[group.members.clone()].iter().enumerate() {
        let sends = |row: &usize| pairs.density[group.pairs + row * group.row() + place] > 0.0;
        received[*at as usize].vertices = (0..group.lenders.len()).filter(sends).count() as u32;
    }
}
