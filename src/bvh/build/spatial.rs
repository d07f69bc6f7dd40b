//! The high-quality build with spatial splits: it cuts not only between primitives but also through them (Stich,
//! Friedrich and Dietrich, "Spatial splits in bounding volume hierarchies", 2009). Large triangles are then in several
//! leaves, each of which holds the box of a part.
//!
//! Where spatial splits bring nothing, they are not tried further down, and large ranges are sampled
//! ([`super::split_candidates`]).
//!
//! Every range of references has room behind it for copies, a part of the budget that is set at the beginning. So
//! memory is bounded, and the tree depends only on the input.

use rayon::prelude::*;

use super::binary::{NodeBudget, Nodes, Summary, Tree, is_block};
use super::binning::{BINS, Binning, Bins, partition};
use super::clip::Clipper;
use super::halve::{MAX_SAH_DEPTH, PARALLEL, TreePosition, halve, split_middle};
use super::primitives::Primitives;
use super::reference::{Reference, SimdAabb};
use super::split_candidates::{SplitCandidates, SplitPlane};
use crate::bvh::layout::ChildKind;

/// The budget of copies, as a fraction of the references.
pub const BUDGET: f32 = 0.3;
/// Spatial splits are tried if the sides of the best cut between primitives overlap by more than this fraction of the
/// root's area.
const OVERLAP: f32 = 1e-4;
/// They are no longer tried below this many nodes in a row where none was better.
const MISSES: u32 = 3;

/// The budget of copies for `count` references.
pub fn budget(count: usize) -> usize {
    (count as f64 * f64::from(BUDGET)) as usize
}

/// Builds a tree over at least one primitive.
pub(in crate::bvh) fn build(primitives: &Primitives) -> Tree {
    let count = primitives.count();
    let room = count + budget(count);
    let mut references = Vec::with_capacity(room);
    references.par_extend((0..count).into_par_iter().map(|place| primitives.reference(place)));
    references.resize(room, references[0]);
    let root = SimdAabb::around(&references[..count]);
    let builder = SpatialBuilder { primitives, least_overlap: root.half_area() * OVERLAP };
    let mixed = primitives.are_mixed();
    let place = TreePosition { depth: 0, room: NodeBudget::new(room, mixed) };
    let mut nodes = Nodes::room(place.room.nodes);
    let mut tree = Nodes::new(&mut nodes);
    builder.build(ReferenceRange { references: &mut references, count, first: 0 }, place, 0, &mut tree);
    let used = tree.count();
    let order = references.iter().map(Reference::id).collect();
    drop(references);
    nodes.truncate(used);
    nodes.shrink_to_fit();
    Tree { nodes, order }
}

/// References, with room for more behind them.
struct ReferenceRange<'a> {
    references: &'a mut [Reference],
    /// The number in use.
    count: usize,
    /// The index of the first one among all references.
    first: usize,
}

impl<'a> ReferenceRange<'a> {
    fn used(&mut self) -> &mut [Reference] {
        &mut self.references[..self.count]
    }

    /// Splits into two ranges, which divide the room by area.
    fn split_at(self, middle: usize) -> (ReferenceRange<'a>, ReferenceRange<'a>) {
        let (count, room) = (self.count, self.references.len() - self.count);
        // Large triangles are worth splitting.
        let size = |references: &[Reference]| -> f64 {
            references.iter().map(|r| f64::from(r.extent().half_area())).sum()
        };
        let (left, right) = (size(&self.references[..middle]), size(&self.references[middle..count]));
        let part = left / (left + right);
        let part = if part.is_finite() { part } else { 0.5 };
        let share = ((room as f64 * part) as usize).min(room);
        self.references.copy_within(middle..count, middle + share);
        let (left, right) = self.references.split_at_mut(middle + share);
        let second = self.first + middle + share;
        (
            ReferenceRange { references: left, count: middle, first: self.first },
            ReferenceRange { references: right, count: count - middle, first: second },
        )
    }
}

struct SpatialBuilder<'a> {
    primitives: &'a Primitives<'a>,
    least_overlap: f32,
}

impl SpatialBuilder<'_> {
    fn build(
        &self,
        mut range: ReferenceRange,
        place: TreePosition,
        mut misses: u32,
        nodes: &mut Nodes,
    ) -> Summary {
        if is_block(range.used()) {
            let first = range.first;
            return nodes.block(range.used(), first, split_middle);
        }
        let middle = self.split(&mut range, place, &mut misses);
        let parallel = range.count > PARALLEL;
        let (left, right) = range.split_at(middle);
        let [left_place, right_place] = place.below(left.references.len(), right.references.len());
        if parallel {
            return nodes.node_in_parallel(
                left_place.room.nodes,
                |nodes| self.build(left, left_place, misses, nodes),
                |nodes| self.build(right, right_place, misses, nodes),
            );
        }
        let node = nodes.begin();
        let left = self.build(left, left_place, misses, nodes);
        let second = nodes.count();
        let right = self.build(right, right_place, misses, nodes);
        nodes.complete(node, second, &left, &right)
    }

    /// Partitions the range, which may grow, and returns the start of its second half. `misses` is the number of nodes
    /// in a row where no spatial split was better.
    fn split(&self, range: &mut ReferenceRange, place: TreePosition, misses: &mut u32) -> usize {
        let fewest = place.room.fewest(range.references.len());
        let references = range.used();
        if place.depth >= MAX_SAH_DEPTH {
            return halve(references);
        }
        let binning = Binning::new(&SimdAabb::around_centers(references), BINS);
        let mut bins = Bins::default();
        bins.fill(references.iter(), &binning);
        let cut = bins.best(1, fewest);
        let (least, overlap) = match &cut {
            Some(cut) => {
                let [left, right] = bins.sides(cut);
                let both = left.intersection(right);
                let is_empty = both.min.cmpgt(both.max).bitmask() & 7 != 0;
                (cut.cost, if is_empty { 0.0 } else { both.half_area() })
            }
            None => (f32::INFINITY, f32::INFINITY),
        };
        if overlap > self.least_overlap && range.references.len() > range.count && *misses < MISSES {
            let references = range.used();
            let slabs =
                SplitCandidates::new(references, &SimdAabb::around(references), self.primitives.geometry);
            let plane = slabs.best(references.len(), fewest).filter(|plane| plane.cost < least);
            if let Some(middle) = plane.and_then(|plane| self.cut_through(range, &plane, fewest)) {
                *misses = 0;
                return middle;
            }
            *misses += 1;
        }
        let references = range.used();
        let middle = cut.map_or(0, |cut| partition(references, cut.axis, binning.threshold(&cut)));
        let allowed = fewest..=references.len() - fewest;
        if allowed.contains(&middle) { middle } else { halve(references) }
    }

    fn clipper(&self, reference: &Reference) -> Clipper {
        Clipper::new(self.primitives.geometry.corners(reference.id()))
    }

    /// Partitions by a plane; references that it cuts go to both sides, or to one if that is cheaper. `None`, with
    /// nothing changed, if there is no room or no progress.
    fn cut_through(&self, range: &mut ReferenceRange, plane: &SplitPlane, fewest: usize) -> Option<usize> {
        let count = range.count;
        let room = range.references.len() - count;
        let sides = range.references[..count].iter().map(|reference| self.parts(reference, plane));
        let (mut left, mut right, mut copies) = (0, 0, 0);
        for parts in sides {
            left += parts.is_left() as usize;
            right += parts.is_right() as usize;
            copies += matches!(parts, Destination::Both(..)) as usize;
        }
        let enough = left.min(right) >= fewest;
        if copies > room || left == count || right == count || !enough {
            return None;
        }
        let (mut middle, mut end) = (0, count);
        for i in 0..count {
            let parts = self.parts(&range.references[i], plane);
            if let Destination::Both(left, right) = &parts {
                range.references[end] = range.references[i].clipped(right);
                end += 1;
                range.references[i] = range.references[i].clipped(left);
            }
            range.references.swap(i, middle);
            middle += parts.is_left() as usize;
        }
        range.count = end;
        Some(middle)
    }

    fn parts(&self, reference: &Reference, plane: &SplitPlane) -> Destination {
        let (whole, axis) = (reference.extent(), plane.axis);
        if whole.max[axis] <= plane.place {
            return Destination::Left;
        }
        if whole.min[axis] >= plane.place {
            return Destination::Right;
        }
        if reference.kind() != ChildKind::Triangles {
            let is_left = reference.center()[axis] * 0.5 < plane.place;
            return if is_left { Destination::Left } else { Destination::Right };
        }
        let clipper = self.clipper(reference);
        let left = clipper.between(axis, f32::NEG_INFINITY, plane.place).intersection(whole);
        let right = clipper.between(axis, plane.place, f32::INFINITY).intersection(whole);
        let is_empty = |part: &SimdAabb| part.min.cmpgt(part.max).bitmask() & 7 != 0;
        match (is_empty(&left), is_empty(&right)) {
            (_, true) => return Destination::Left,
            (true, _) => return Destination::Right,
            _ => {}
        }
        // Uncut, a reference enlarges one side's box and saves the other a test.
        let [l, r] = &plane.sides;
        let cost = |bounds: SimdAabb, count: usize| bounds.half_area() * count as f32;
        let both = cost(l.bounds, l.count) + cost(r.bounds, r.count);
        let only_left = cost(l.bounds.union(whole), l.count) + cost(r.bounds, r.count - 1);
        let only_right = cost(l.bounds, l.count - 1) + cost(r.bounds.union(whole), r.count);
        if both <= only_left && both <= only_right {
            Destination::Both(left, right)
        } else if only_left <= only_right {
            Destination::Left
        } else {
            Destination::Right
        }
    }
}

/// The side to which a reference goes.
enum Destination {
    Left,
    Right,
    /// Both sides, with the boxes of its parts.
    Both(SimdAabb, SimdAabb),
}

impl Destination {
    fn is_left(&self) -> bool {
        !matches!(self, Destination::Right)
    }

    fn is_right(&self) -> bool {
        !matches!(self, Destination::Left)
    }
}
