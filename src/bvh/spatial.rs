//! The high quality build: it cuts not only between primitives but also through them (Stich, Friedrich and Dietrich,
//! "Spatial splits in bounding volume hierarchies", 2009). Large triangles are then in several leaves, each of which
//! holds the box of a part.
//!
//! Every range of references has room behind it for copies, a share of the budget that is set at the beginning. So
//! memory is bounded, and the tree depends on nothing but the input.

use rayon::prelude::*;

use super::binary::{Nodes, Room, Summary, Tree, is_block};
use super::binning::{BINS, Binning, Bins, partition};
use super::build::{MAX_SAH_DEPTH, PARALLEL, TreePosition, halve, split_middle};
use super::clip::Clipper;
use super::layout::{BLOCK, ChildKind};
use super::primitives::Primitives;
use super::reference::{Extent, Reference};

/// How many copies may be made, as a part of the references.
pub const BUDGET: f32 = 0.3;
/// Cuts through primitives are looked for where the sides of the best cut between them
/// overlap by more than this part of the root's area.
const OVERLAP: f32 = 1e-4;
/// The most slabs that an axis is cut into.
const SLABS: usize = 16;

/// How many copies of `count` references there may be.
pub fn budget(count: usize) -> usize {
    (count as f64 * f64::from(BUDGET)) as usize
}

/// Builds a tree over at least one primitive.
pub(super) fn build(primitives: &Primitives) -> Tree {
    let count = primitives.count();
    let room = count + budget(count);
    let mut references = Vec::with_capacity(room);
    references.par_extend((0..count).into_par_iter().map(|place| primitives.reference(place)));
    references.resize(room, references[0]);
    let root = Extent::around(&references[..count]);
    let builder = SpatialBuilder { primitives, least_overlap: root.half_area() * OVERLAP };
    let mixed = primitives.are_mixed();
    let place = TreePosition { depth: 0, room: Room::new(room, mixed) };
    let mut nodes = Nodes::room(place.room.nodes);
    let mut tree = Nodes::new(&mut nodes);
    builder.build(ReferenceRange { references: &mut references, count, first: 0 }, place, &mut tree);
    let used = tree.count();
    let order = references.iter().map(Reference::id).collect();
    drop(references);
    nodes.truncate(used);
    nodes.shrink_to_fit();
    Tree { nodes, order }
}

/// References, and behind them room for more.
struct ReferenceRange<'a> {
    references: &'a mut [Reference],
    /// How many are in use.
    count: usize,
    /// The place of the first among all.
    first: usize,
}

impl<'a> ReferenceRange<'a> {
    fn used(&mut self) -> &mut [Reference] {
        &mut self.references[..self.count]
    }

    /// Two ranges, which share the room.
    fn split_at(self, middle: usize) -> (ReferenceRange<'a>, ReferenceRange<'a>) {
        let (count, room) = (self.count, self.references.len() - self.count);
        // Large triangles are what is worth cutting.
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

/// A plane across an axis, through primitives.
#[derive(Clone, Copy)]
struct SplitPlane {
    axis: usize,
    place: f32,
    /// Half areas times blocks, both sides together.
    cost: f32,
    /// Expected boxes and numbers of references of the sides.
    sides: [SplitSide; 2],
}

#[derive(Clone, Copy)]
struct SplitSide {
    bounds: Extent,
    count: usize,
}

impl SplitSide {
    const EMPTY: SplitSide = SplitSide { bounds: Extent::EMPTY, count: 0 };

    fn union(self, other: SplitSide) -> SplitSide {
        SplitSide { bounds: self.bounds.union(other.bounds), count: self.count + other.count }
    }

    fn cost(&self) -> f32 {
        self.bounds.half_area() * self.count.div_ceil(BLOCK) as f32
    }
}

struct SpatialBuilder<'a> {
    primitives: &'a Primitives<'a>,
    least_overlap: f32,
}

impl SpatialBuilder<'_> {
    fn build(&self, mut range: ReferenceRange, place: TreePosition, nodes: &mut Nodes) -> Summary {
        if is_block(range.used()) {
            let first = range.first;
            return nodes.block(range.used(), first, split_middle);
        }
        let middle = self.split(&mut range, place);
        let parallel = range.count > PARALLEL;
        let (left, right) = range.split_at(middle);
        let [left_place, right_place] = place.below(left.references.len(), right.references.len());
        if parallel {
            return nodes.node_in_parallel(
                left_place.room.nodes,
                |nodes| self.build(left, left_place, nodes),
                |nodes| self.build(right, right_place, nodes),
            );
        }
        let node = nodes.begin();
        let left = self.build(left, left_place, nodes);
        let second = nodes.count();
        let right = self.build(right, right_place, nodes);
        nodes.complete(node, second, &left, &right)
    }

    /// Partitions the range, which may grow, and returns where its second half begins.
    fn split(&self, range: &mut ReferenceRange, place: TreePosition) -> usize {
        let fewest = place.room.fewest(range.references.len());
        let references = range.used();
        if place.depth >= MAX_SAH_DEPTH {
            return halve(references);
        }
        let binning = Binning::new(&Extent::around_centers(references), BINS);
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
        if overlap > self.least_overlap
            && range.references.len() > range.count
            && let Some(plane) = self.best_plane(range.used(), fewest).filter(|plane| plane.cost < least)
            && let Some(middle) = self.cut_through(range, &plane, fewest)
        {
            return middle;
        }
        let references = range.used();
        let middle = cut.map_or(0, |cut| partition(references, cut.axis, binning.threshold(&cut)));
        let allowed = fewest..=references.len() - fewest;
        if allowed.contains(&middle) { middle } else { halve(references) }
    }

    fn clipper(&self, reference: &Reference) -> Clipper {
        Clipper::new(self.primitives.geometry.corners(reference.id()))
    }

    fn best_plane(&self, references: &[Reference], fewest: usize) -> Option<SplitPlane> {
        let bounds = Extent::around(references);
        let planes = (0..3).filter_map(|axis| self.best_plane_across(axis, &bounds, references, fewest));
        planes.reduce(|a, b| if b.cost < a.cost { b } else { a })
    }

    fn best_plane_across(
        &self,
        axis: usize,
        bounds: &Extent,
        references: &[Reference],
        fewest: usize,
    ) -> Option<SplitPlane> {
        let (low, size) = (bounds.min[axis], bounds.max[axis] - bounds.min[axis]);
        if !(size > 1e-30 && size < f32::INFINITY) {
            return None;
        }
        let slabs = (4 + references.len() / 8).min(SLABS);
        let plane = |slab: usize| low + size * (slab as f32 / slabs as f32);
        let scale = slabs as f32 / size;
        let slab_of = |c: f32| (((c - low) * scale) as usize).min(slabs - 1);
        // Where references begin and where they end.
        let (mut begin, mut end) = ([0; SLABS], [0; SLABS]);
        let mut boxes = [Extent::EMPTY; SLABS];
        for reference in references {
            let part = reference.extent();
            let (mut first, mut last) = (slab_of(part.min[axis]), slab_of(part.max[axis]));
            if reference.kind() != ChildKind::Triangles {
                first = slab_of(reference.center()[axis] * 0.5);
                last = first;
            }
            begin[first] += 1;
            end[last] += 1;
            if first == last {
                boxes[first] = boxes[first].union(part);
                continue;
            }
            let clipper = self.clipper(reference);
            for (slab, around) in boxes.iter_mut().enumerate().take(last + 1).skip(first) {
                let within = clipper.between(axis, plane(slab), plane(slab + 1)).intersection(part);
                *around = around.union(within);
            }
        }
        let mut right = [SplitSide::EMPTY; SLABS];
        let mut sum = SplitSide::EMPTY;
        for slab in (1..slabs).rev() {
            sum = sum.union(SplitSide { bounds: boxes[slab], count: end[slab] });
            right[slab] = sum;
        }
        let mut best: Option<SplitPlane> = None;
        let mut left = SplitSide::EMPTY;
        for slab in 1..slabs {
            left = left.union(SplitSide { bounds: boxes[slab - 1], count: begin[slab - 1] });
            let sides = [left, right[slab]];
            let progress = |side: &SplitSide| side.count >= fewest && side.count < references.len();
            let cost = left.cost() + right[slab].cost();
            if sides.iter().all(progress) && best.is_none_or(|best| cost < best.cost) {
                best = Some(SplitPlane { axis, place: plane(slab), cost, sides });
            }
        }
        best
    }

    /// Partitions by a plane; what it cuts goes to both sides, or to one if that is cheaper. `None`, with nothing
    /// changed, if there is no room or no progress.
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
        let is_empty = |part: &Extent| part.min.cmpgt(part.max).bitmask() & 7 != 0;
        match (is_empty(&left), is_empty(&right)) {
            (_, true) => return Destination::Left,
            (true, _) => return Destination::Right,
            _ => {}
        }
        // Uncut, a reference makes one side's box larger and saves the other a test.
        let [l, r] = &plane.sides;
        let cost = |bounds: Extent, count: usize| bounds.half_area() * count as f32;
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

/// Where a reference goes.
enum Destination {
    Left,
    Right,
    /// With the boxes of its parts.
    Both(Extent, Extent),
}

impl Destination {
    fn is_left(&self) -> bool {
        !matches!(self, Destination::Right)
    }

    fn is_right(&self) -> bool {
        !matches!(self, Destination::Left)
    }
}
