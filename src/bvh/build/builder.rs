//! Builds a binary tree over primitives in parallel; the tree does not depend on the number of threads.
//!
//! Large sets are distributed to buckets first ([`super::buckets`]); each bucket, and a small set as a whole, is cut in
//! two by the surface area heuristic ([`super::binning`]) until every part fits a block. The costs of collapsing are
//! computed on the way back up.

use super::halve::{MAX_SAH_DEPTH, PARALLEL, TreePosition, halve, split_middle};
use rayon::prelude::*;

use super::binary::{BinaryNode, NodeBudget, Nodes, Summary, Tree, is_block};
use super::binning::{BINS, Binning, Bins, partition};
use super::buckets::Buckets;
use super::primitives::Primitives;
use super::reference::{Reference, SimdAabb};

/// Cuts of larger ranges are chosen from a sample of about this many references.
const SAMPLE: usize = 512;
/// Bytes for what does not grow with the input: stacks, tasks, the thread pool's queues.
const SMALL: usize = 1 << 15;

/// A bound on the bytes that a build allocates besides the finished arrays, known before it starts: 79 for each of 10^6
/// references. `mixed`: over more than one kind of primitive, or over instances. Split slivers ([`super::slivers`]) have
/// several references, which take another 32 bytes each.
///
/// With n references and N = [`NodeBudget`]`(n)` binary nodes (48 bytes each), the peak is one of these: either the lists
/// by buckets (4 n, and their ends), the order (4 n), the buckets' references (32 n, if all were built together) and
/// nodes; or the order, the buckets' nodes and the joined nodes; or afterwards the order, the nodes, and at most 16 bytes
/// a node of lists, which is less.
pub fn peak_bytes(count: usize, mixed: bool) -> usize {
    let (node, reference) = (size_of::<BinaryNode>(), size_of::<Reference>());
    // Each bucket may round up.
    let nodes = (NodeBudget::new(count.max(1), mixed).nodes + 4 * super::buckets::MOST) * node;
    let sort = super::buckets::peak_bytes(count);
    sort + 4 * count + nodes + nodes.max(count * reference) + SMALL
}

/// A bucket's subtree.
struct BucketTree {
    nodes: Vec<BinaryNode>,
    used: usize,
    summary: Summary,
}

/// Builds a tree over at least one primitive.
pub fn build(primitives: &Primitives) -> Tree {
    let buckets = Buckets::new(primitives);
    let mut order = vec![0; primitives.count()];
    let mut tasks = Vec::new();
    let (mut rest, mut first) = (&mut order[..], 0);
    for (bucket, size) in buckets.sizes().into_iter().enumerate() {
        let (slice, others) = rest.split_at_mut(size);
        tasks.push((bucket, first, slice));
        (rest, first) = (others, first + size);
    }
    let mixed = primitives.are_mixed();
    let parts = tasks.into_par_iter().with_max_len(1);
    let mut parts: Vec<Option<BucketTree>> = parts
        .map(|(bucket, first, order)| {
            let mut references = Vec::with_capacity(order.len());
            references.extend(buckets.members(bucket).map(|i| primitives.reference(i as usize)));
            BucketTree::new(&mut references, first, order, mixed)
        })
        .collect();
    drop(buckets);
    if let [Some(only)] = &mut parts[..] {
        only.nodes.truncate(only.used);
        only.nodes.shrink_to_fit();
        return Tree { nodes: std::mem::take(&mut only.nodes), order };
    }
    // Joining the non-empty parts takes one node fewer than there are parts.
    let count: usize = parts.iter().flatten().map(|part| part.used + 1).sum();
    let mut nodes = Nodes::room(count);
    let mut joined = Nodes::new(&mut nodes);
    join_parts(&mut parts, &mut joined);
    let used = joined.count();
    nodes.truncate(used);
    Tree { nodes, order }
}

impl BucketTree {
    fn new(references: &mut [Reference], first: usize, order: &mut [u32], mixed: bool) -> Option<BucketTree> {
        if references.is_empty() {
            return None;
        }
        let room = NodeBudget::new(references.len(), mixed);
        let mut nodes = Nodes::room(room.nodes);
        let mut tree = Nodes::new(&mut nodes);
        let mut builder = SubtreeBuilder::default();
        let summary = builder.build(references, first, TreePosition { depth: 0, room }, &mut tree);
        let used = tree.count();
        for (id, reference) in order.iter_mut().zip(references) {
            *id = reference.id();
        }
        Some(BucketTree { nodes, used, summary })
    }
}

/// The expected cost of a tree over references, times the area of its box.
pub(super) fn expected_cost(mut references: Vec<Reference>, mixed: bool) -> f32 {
    let mut order = vec![0; references.len()];
    BucketTree::new(&mut references, 0, &mut order, mixed).map_or(0.0, |tree| tree.summary.cost())
}

/// Joins the buckets' trees along the cuts between the buckets.
fn join_parts(parts: &mut [Option<BucketTree>], nodes: &mut Nodes) -> Option<Summary> {
    if let [part] = parts {
        let part = part.take()?;
        nodes.append(&part.nodes[..part.used]);
        return Some(part.summary);
    }
    let (left, right) = parts.split_at_mut(parts.len() / 2);
    let is_some = |parts: &[Option<BucketTree>]| parts.iter().any(Option::is_some);
    if !is_some(left) || !is_some(right) {
        return join_parts(left, nodes).or(join_parts(right, nodes));
    }
    let node = nodes.begin();
    let left = join_parts(left, nodes)?;
    let second = nodes.count();
    let right = join_parts(right, nodes)?;
    Some(nodes.complete(node, second, &left, &right))
}

/// The state of one thread that builds a subtree.
#[derive(Default)]
struct SubtreeBuilder {
    bins: Bins,
}

impl SubtreeBuilder {
    fn build(
        &mut self,
        references: &mut [Reference],
        first: usize,
        place: TreePosition,
        nodes: &mut Nodes,
    ) -> Summary {
        if is_block(references) {
            return nodes.block(references, first, split_middle);
        }
        let middle = self.split(references, place);
        let [left_place, right_place] = place.below(middle, references.len() - middle);
        let parallel = references.len() > PARALLEL;
        let (left, right) = references.split_at_mut(middle);
        let second = first + middle;
        if parallel {
            let mut other = SubtreeBuilder::default();
            return nodes.node_in_parallel(
                left_place.room.nodes,
                |nodes| self.build(left, first, left_place, nodes),
                |nodes| other.build(right, second, right_place, nodes),
            );
        }
        let node = nodes.begin();
        let left = self.build(left, first, left_place, nodes);
        let child = nodes.count();
        let right = self.build(right, second, right_place, nodes);
        nodes.complete(node, child, &left, &right)
    }

    /// Partitions the range and returns the start of its second half; both have at least the required number of
    /// references.
    fn split(&mut self, references: &mut [Reference], place: TreePosition) -> usize {
        let fewest = place.room.fewest(references.len());
        let allowed = fewest..=references.len() - fewest;
        if place.depth >= MAX_SAH_DEPTH {
            return halve(references);
        }
        let strides = [(references.len() / SAMPLE).max(1), 1];
        for stride in strides {
            let middle = self.split_sampled(references, stride, fewest);
            if allowed.contains(&middle) {
                return middle;
            }
        }
        halve(references)
    }

    /// [`Self::split`] by a sample of one reference in `stride`; 0 if there is no good cut.
    #[inline(always)]
    fn split_sampled(&mut self, references: &mut [Reference], stride: usize, fewest: usize) -> usize {
        // Sweeping 16 bins for a dozen references would take longer than binning them.
        let bins = (4 + references.len() / 12).min(BINS);
        let binning;
        if stride > 1 {
            let sample = || references.iter().step_by(stride);
            binning = Binning::new(&sample().fold(SimdAabb::EMPTY, |all, r| all.with(r.center())), bins);
            self.bins.fill(sample(), &binning);
        } else {
            binning = Binning::new(&SimdAabb::around_centers(references), bins);
            self.bins.fill(references.iter(), &binning);
        }
        match self.bins.best(stride as u32, if stride > 1 { 1 } else { fewest }) {
            Some(cut) => partition(references, cut.axis, binning.threshold(&cut)),
            None => 0,
        }
    }
}
