//! Primitives to binary tree, in parallel, the same tree whatever the number of threads.
//!
//! Large sets go to buckets first ([`super::buckets`]); each bucket, and a small set as a
//! whole, is cut in two by the surface area heuristic ([`super::binning`]) until every
//! part fits a block. The costs of collapsing are computed on the way back up.

use rayon::prelude::*;

use super::binning::{BINS, Binning, Bins, partition, partition_by};
use super::buckets::Buckets;
use super::collapse::{Costs, Opening};
use super::layout::{BLOCK, Child, Kind};
use super::reference::{Extent, Reference};
use crate::math::Aabb;
use crate::world::BuildQuality;

/// Subtrees with fewer references are built by one thread.
const PARALLEL: usize = 8192;
/// Cuts of larger ranges are chosen by about so many of their references.
const SAMPLE: usize = 512;
/// The fast build cuts larger ranges in the middle.
const MIDDLE: usize = 128;
/// From this depth on ranges are halved by count, so that no input makes a deep tree.
const MAX_SAH_DEPTH: u32 = 48;

/// A node of the binary tree, depth first: the first child follows its parent.
#[derive(Clone, Copy, Debug)]
pub struct BinaryNode {
    /// Around all below.
    pub bounds: Aabb,
    /// Of a leaf: its first place in the order. Else: how far behind this node the second child is.
    pub offset: u32,
    /// References of a leaf; 0 for an inner node.
    pub count: u8,
    /// What a leaf holds.
    pub kind: Kind,
    /// What it becomes, once that is known.
    pub child: Child,
    /// Which nodes below it become children of a wide node.
    pub opening: Opening,
}

impl BinaryNode {
    /// Whether it holds primitives.
    #[inline(always)]
    pub fn is_leaf(&self) -> bool {
        self.count > 0
    }
}

/// A binary tree and what its leaves hold.
pub struct Tree {
    /// The nodes, the root first.
    pub nodes: Vec<BinaryNode>,
    /// Ids of primitives, by leaves.
    pub order: Vec<u32>,
}

/// A subtree as its parent sees it.
#[derive(Clone, Copy)]
struct Summary {
    bounds: Extent,
    costs: Costs,
}

/// A bucket's subtree.
struct Part {
    nodes: Vec<BinaryNode>,
    summary: Summary,
}

/// Builds a tree over `count` primitives, at least one, of which `reference` gives each.
pub fn build(count: usize, quality: BuildQuality, reference: &(impl Fn(usize) -> Reference + Sync)) -> Tree {
    let buckets = Buckets::new(count, if quality == BuildQuality::Fast { 32 } else { 8 }, reference);
    let mut order = vec![0; count];
    let mut tasks = Vec::new();
    let (mut rest, mut first) = (&mut order[..], 0);
    for (bucket, size) in buckets.sizes().into_iter().enumerate() {
        let (slice, others) = rest.split_at_mut(size);
        tasks.push((bucket, first, slice));
        (rest, first) = (others, first + size);
    }
    let parts = tasks.into_par_iter().with_max_len(1);
    let mut parts: Vec<Option<Part>> = parts
        .map(|(bucket, first, order)| {
            let mut references = Vec::with_capacity(order.len());
            references.extend(buckets.members(bucket).map(|i| reference(i as usize)));
            build_part(&mut references, first, order, quality)
        })
        .collect();
    drop(buckets);
    let nodes = match &mut parts[..] {
        [Some(only)] => std::mem::take(&mut only.nodes),
        parts => {
            let count: usize = parts.iter().flatten().map(|part| part.nodes.len() + 1).sum();
            let mut nodes = Vec::with_capacity(count);
            join_parts(parts, &mut nodes);
            nodes
        }
    };
    Tree { nodes, order }
}

fn build_part(
    references: &mut [Reference],
    first: usize,
    order: &mut [u32],
    quality: BuildQuality,
) -> Option<Part> {
    if references.is_empty() {
        return None;
    }
    let mut builder = Builder::new(references.len(), quality);
    let summary = builder.build(references, first, 0);
    for (id, reference) in order.iter_mut().zip(references) {
        *id = reference.id();
    }
    Some(Part { nodes: builder.nodes, summary })
}

/// Joins the buckets' trees as the buckets were cut.
fn join_parts(parts: &mut [Option<Part>], nodes: &mut Vec<BinaryNode>) -> Option<Summary> {
    if let [part] = parts {
        let part = part.take()?;
        nodes.extend_from_slice(&part.nodes);
        return Some(part.summary);
    }
    let (left, right) = parts.split_at_mut(parts.len() / 2);
    let is_some = |parts: &[Option<Part>]| parts.iter().any(Option::is_some);
    if !is_some(left) || !is_some(right) {
        return join_parts(left, nodes).or(join_parts(right, nodes));
    }
    let node = begin_node(nodes);
    let left = join_parts(left, nodes)?;
    let second = nodes.len();
    let right = join_parts(right, nodes)?;
    Some(end_node(nodes, node, second, &left, &right))
}

/// A subtree under construction, with what one thread needs for it.
struct Builder {
    quality: BuildQuality,
    nodes: Vec<BinaryNode>,
    bins: Bins,
}

impl Builder {
    fn new(references: usize, quality: BuildQuality) -> Self {
        Self { quality, nodes: Vec::with_capacity(references / 2 + 1), bins: Bins::new() }
    }

    fn build(&mut self, references: &mut [Reference], first: usize, depth: u32) -> Summary {
        if is_leaf(references) {
            return self.leaf(references, first);
        }
        let middle = self.split(references, depth);
        let node = begin_node(&mut self.nodes);
        let parallel = references.len() > PARALLEL;
        let (left, right) = references.split_at_mut(middle);
        if parallel {
            let mut other = Builder::new(right.len(), self.quality);
            let (left, right) = rayon::join(
                || self.build(left, first, depth + 1),
                || other.build(right, first + middle, depth + 1),
            );
            let second = self.nodes.len();
            self.nodes.append(&mut other.nodes);
            end_node(&mut self.nodes, node, second, &left, &right)
        } else {
            let left = self.build(left, first, depth + 1);
            let second = self.nodes.len();
            let right = self.build(right, first + middle, depth + 1);
            end_node(&mut self.nodes, node, second, &left, &right)
        }
    }

    fn leaf(&mut self, references: &[Reference], first: usize) -> Summary {
        let bounds = Extent::around(references);
        self.nodes.push(BinaryNode {
            bounds: bounds.bounds(),
            offset: first as u32,
            count: references.len() as u8,
            kind: references[0].kind(),
            child: Child(0),
            opening: Opening::default(),
        });
        Summary { bounds, costs: Costs::leaf(bounds.half_area()) }
    }

    /// Partitions the range and returns where its second half begins; both halves hold something.
    fn split(&mut self, references: &mut [Reference], depth: u32) -> usize {
        let half = references.len() / 2;
        if depth >= MAX_SAH_DEPTH {
            return half;
        }
        if self.quality == BuildQuality::Fast && references.len() > MIDDLE {
            let middle = split_middle(references);
            if middle != 0 && middle != references.len() {
                return middle;
            }
        }
        let strides = [(references.len() / SAMPLE).max(1), 1];
        for stride in strides {
            let middle = self.split_sampled(references, stride);
            if middle != 0 && middle != references.len() {
                return middle;
            }
        }
        split_kinds(references)
    }

    /// As [`Self::split`], by every so many references; 0 if those are all in one bin.
    #[inline(always)]
    fn split_sampled(&mut self, references: &mut [Reference], stride: usize) -> usize {
        // Sweeping 16 bins for a dozen references would take longer than binning them.
        let bins = (4 + references.len() / 12).min(BINS);
        let binning;
        if stride > 1 {
            let sample = || references.iter().step_by(stride);
            binning = Binning::new(&sample().fold(Extent::EMPTY, |all, r| all.with(r.center())), bins);
            self.bins.fill(sample(), &binning);
        } else {
            binning = Binning::new(&Extent::around_centers(references), bins);
            self.bins.fill(references.iter(), &binning);
        }
        match self.bins.best(stride as u32) {
            Some(cut) => partition(references, cut.axis, binning.threshold(&cut)),
            None => 0,
        }
    }
}

/// One block holds it: up to 8 of a kind, or a single instance.
#[inline(always)]
fn is_leaf(references: &[Reference]) -> bool {
    let kind = references[0].kind();
    let most = if kind == Kind::Instance { 1 } else { BLOCK };
    references.len() <= most && references.iter().all(|r| r.kind() == kind)
}

fn begin_node(nodes: &mut Vec<BinaryNode>) -> usize {
    nodes.push(BinaryNode {
        bounds: Aabb::EMPTY,
        offset: 0,
        count: 0,
        kind: Kind::Node,
        child: Child(0),
        opening: Opening::default(),
    });
    nodes.len() - 1
}

#[inline(always)]
fn end_node(
    nodes: &mut [BinaryNode],
    node: usize,
    second: usize,
    left: &Summary,
    right: &Summary,
) -> Summary {
    let bounds = left.bounds.union(right.bounds);
    let (costs, opening) = Costs::node(bounds.half_area(), &left.costs, &right.costs);
    let place = &mut nodes[node];
    place.bounds = bounds.bounds();
    place.offset = (second - node) as u32;
    place.opening = opening;
    Summary { bounds, costs }
}

/// All centroids are in one place. Where kinds are mixed, tells them apart; else any halves do.
fn split_kinds(references: &mut [Reference]) -> usize {
    let kind = references[0].kind();
    let middle = partition_by(references, |r| r.kind() == kind);
    if middle != references.len() { middle } else { middle / 2 }
}

/// Cuts the box of the centroids in the middle of its longest side.
fn split_middle(references: &mut [Reference]) -> usize {
    let centers = Extent::around_centers(references);
    let size = centers.max - centers.min;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + (size.z > size.y) as usize };
    partition(references, axis, (centers.min[axis] + centers.max[axis]) * 0.5)
}
