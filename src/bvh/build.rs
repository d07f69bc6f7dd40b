//! Bounds to binary tree: binned surface area heuristic (Wald 2007), in parallel,
//! the same tree whatever the number of threads.

use glam::Vec4;
use rayon::prelude::*;

use super::layout::{BLOCK, Kind};
use crate::math::{Aabb, Vec3};

/// The most bins that an axis is cut into.
const BINS: usize = 16;
/// Subtrees with fewer references are built by one thread.
const PARALLEL: usize = 8192;
/// Ranges with more references are binned and measured by several threads.
const PARALLEL_SCAN: usize = 1 << 17;
/// From this depth on ranges are halved by count, so that no input makes a deep tree.
const MAX_SAH_DEPTH: u32 = 48;

/// A primitive as the builder sees it: its box with its id and kind in the spare fourth components.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct Reference {
    min: [f32; 3],
    /// Where the owner finds it.
    pub id: u32,
    max: [f32; 3],
    kind: u32,
}

impl Reference {
    /// A primitive with its padded box.
    pub fn new(bounds: Aabb, kind: Kind, id: u32) -> Self {
        Self { min: bounds.min.to_array(), id, max: bounds.max.to_array(), kind: kind as u32 }
    }

    /// What it is.
    pub fn kind(&self) -> Kind {
        match self.kind {
            1 => Kind::Triangles,
            2 => Kind::Spheres,
            _ => Kind::Instance,
        }
    }

    /// Its box.
    pub fn bounds(&self) -> Aabb {
        Aabb { min: Vec3::from_array(self.min), max: Vec3::from_array(self.max) }
    }

    #[inline(always)]
    fn corners(&self) -> (Vec4, Vec4) {
        let [x, y, z] = self.min;
        let [a, b, c] = self.max;
        (Vec4::new(x, y, z, 0.0), Vec4::new(a, b, c, 0.0))
    }
}

/// A node of the binary tree, depth first: the first child follows its parent.
#[derive(Clone, Copy, Debug)]
pub struct BinaryNode {
    /// Around all below.
    pub bounds: Aabb,
    /// Of a leaf: its first reference. Else: how far behind this node the second child is.
    pub offset: u32,
    /// References of a leaf; 0 for an inner node.
    pub count: u32,
}

/// Builds a tree over the references and puts them in its leaves' order. There must be at least one.
pub fn build(references: &mut [Reference]) -> Vec<BinaryNode> {
    let mut nodes = Vec::with_capacity(references.len() / 2 + 1);
    build_range(references, 0, 0, &mut nodes);
    nodes
}

fn build_range(references: &mut [Reference], first: usize, depth: u32, nodes: &mut Vec<BinaryNode>) {
    let extent = Extent::of(references);
    let bounds = extent.bounds();
    if is_leaf(references) {
        nodes.push(BinaryNode { bounds, offset: first as u32, count: references.len() as u32 });
        return;
    }
    let middle = split(references, &extent, depth);
    let node = nodes.len();
    nodes.push(BinaryNode { bounds, offset: 0, count: 0 });
    let parallel = references.len() > PARALLEL;
    let (left, right) = references.split_at_mut(middle);
    if parallel {
        let mut others = Vec::with_capacity(right.len() / 2 + 1);
        rayon::join(
            || build_range(left, first, depth + 1, nodes),
            || build_range(right, first + middle, depth + 1, &mut others),
        );
        nodes[node].offset = (nodes.len() - node) as u32;
        nodes.append(&mut others);
    } else {
        build_range(left, first, depth + 1, nodes);
        nodes[node].offset = (nodes.len() - node) as u32;
        build_range(right, first + middle, depth + 1, nodes);
    }
}

/// One block holds it: up to 8 of a kind, or a single instance.
fn is_leaf(references: &[Reference]) -> bool {
    let kind = references[0].kind;
    let most = if kind == Kind::Instance as u32 { 1 } else { BLOCK };
    references.len() <= most && references.iter().all(|r| r.kind == kind)
}

/// The boxes of a range and of its centroids (doubled: min + max saves a multiplication).
#[derive(Clone, Copy)]
struct Extent {
    min: Vec4,
    max: Vec4,
    center_min: Vec4,
    center_max: Vec4,
}

impl Extent {
    const EMPTY: Extent = Extent {
        min: Vec4::INFINITY,
        max: Vec4::NEG_INFINITY,
        center_min: Vec4::INFINITY,
        center_max: Vec4::NEG_INFINITY,
    };

    fn of(references: &[Reference]) -> Extent {
        if references.len() > PARALLEL_SCAN {
            references.par_chunks(PARALLEL_SCAN / 8).map(Extent::scan).reduce(|| Extent::EMPTY, Extent::union)
        } else {
            Extent::scan(references)
        }
    }

    fn scan(references: &[Reference]) -> Extent {
        references.iter().fold(Extent::EMPTY, |e, r| {
            let (min, max) = r.corners();
            let center = min + max;
            e.union(Extent { min, max, center_min: center, center_max: center })
        })
    }

    #[inline(always)]
    fn union(self, other: Extent) -> Extent {
        Extent {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            center_min: self.center_min.min(other.center_min),
            center_max: self.center_max.max(other.center_max),
        }
    }

    fn bounds(&self) -> Aabb {
        Aabb { min: self.min.truncate(), max: self.max.truncate() }
    }
}

/// Partitions the range and returns where its second half begins; both halves hold something.
fn split(references: &mut [Reference], extent: &Extent, depth: u32) -> usize {
    let half = references.len() / 2;
    if depth >= MAX_SAH_DEPTH {
        return half;
    }
    let binning = Binning::new(extent, references.len());
    let middle = match best_plane(&fill_bins(references, &binning), binning.bins) {
        Some((axis, plane)) => partition(references, |r| binning.bin(r)[axis] < plane),
        None => 0,
    };
    if middle != 0 && middle != references.len() {
        return middle;
    }
    // All centroids in one bin. Where kinds are mixed, tell them apart; else any halves do.
    let kind = references[0].kind;
    let middle = partition(references, |r| r.kind == kind);
    if middle != references.len() { middle } else { half }
}

/// From a centroid to its bin on each axis.
struct Binning {
    /// How many there are on each axis.
    bins: usize,
    origin: Vec4,
    scale: Vec4,
}

impl Binning {
    fn new(extent: &Extent, references: usize) -> Self {
        // Sweeping 16 bins for a dozen references would take longer than binning them.
        let bins = (4 + references / 12).min(BINS);
        let size = extent.center_max - extent.center_min;
        // A flat axis has one bin. The factor keeps the largest centroid within the last bin.
        let scale = |s: f32| if s > 1e-30 && s.is_finite() { bins as f32 * 0.999_99 / s } else { 0.0 };
        Self { bins, origin: extent.center_min, scale: Vec4::from_array(size.to_array().map(scale)) }
    }

    #[inline(always)]
    fn bin(&self, reference: &Reference) -> [usize; 3] {
        let (min, max) = reference.corners();
        let place = (min + max - self.origin) * self.scale;
        [place.x, place.y, place.z].map(|p| (p as usize).min(self.bins - 1))
    }
}

/// What fell into a bin.
#[derive(Clone, Copy)]
struct Bin {
    min: Vec4,
    max: Vec4,
    count: u32,
}

impl Bin {
    const EMPTY: Bin = Bin { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY, count: 0 };

    #[inline(always)]
    fn union(self, other: Bin) -> Bin {
        Bin { min: self.min.min(other.min), max: self.max.max(other.max), count: self.count + other.count }
    }

    /// Expected cost: the area times the blocks to test.
    fn cost(&self) -> f32 {
        if self.count == 0 {
            return 0.0;
        }
        let d = self.max - self.min;
        (d.x * d.y + d.y * d.z + d.z * d.x) * self.count.div_ceil(BLOCK as u32) as f32
    }
}

type Bins = [[Bin; BINS]; 3];

fn fill_bins(references: &[Reference], binning: &Binning) -> Bins {
    let scan = |range: &[Reference]| {
        let mut bins = [[Bin::EMPTY; BINS]; 3];
        for reference in range {
            let (min, max) = reference.corners();
            for (axis, bin) in binning.bin(reference).into_iter().enumerate() {
                let bin = &mut bins[axis][bin];
                *bin = bin.union(Bin { min, max, count: 1 });
            }
        }
        bins
    };
    if references.len() <= PARALLEL_SCAN {
        return scan(references);
    }
    let merge = |mut a: Bins, b: Bins| {
        for (a, b) in a.as_flattened_mut().iter_mut().zip(b.as_flattened()) {
            *a = a.union(*b);
        }
        a
    };
    references.par_chunks(PARALLEL_SCAN / 8).map(scan).reduce(|| [[Bin::EMPTY; BINS]; 3], merge)
}

/// The axis and first bin of the right side with the least cost; none if all is in one bin.
fn best_plane(bins: &Bins, count: usize) -> Option<(usize, usize)> {
    let mut best = None;
    let mut best_cost = f32::INFINITY;
    for (axis, bins) in bins.iter().enumerate() {
        let mut right = [0.0; BINS];
        let mut sum = Bin::EMPTY;
        for plane in (1..count).rev() {
            sum = sum.union(bins[plane]);
            right[plane] = sum.cost();
        }
        let total = sum.count + bins[0].count;
        let mut left = Bin::EMPTY;
        for plane in 1..count {
            left = left.union(bins[plane - 1]);
            if left.count == 0 || left.count == total {
                continue;
            }
            let cost = left.cost() + right[plane];
            if cost < best_cost {
                (best, best_cost) = (Some((axis, plane)), cost);
            }
        }
    }
    best
}

/// Those that `left` picks to the front; returns how many there are.
fn partition(references: &mut [Reference], left: impl Fn(&Reference) -> bool) -> usize {
    let (mut low, mut high) = (0, references.len());
    loop {
        while low < high && left(&references[low]) {
            low += 1;
        }
        while low < high && !left(&references[high - 1]) {
            high -= 1;
        }
        if low == high {
            return low;
        }
        references.swap(low, high - 1);
    }
}
