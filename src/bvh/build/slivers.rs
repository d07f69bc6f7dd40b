//! Splits slivers before a tree is built: long, thin triangles at an angle to the axes, whose boxes are nearly empty.
//! Their parts have smaller boxes, and are references to the same triangle (Ernst and Greiner, "Early split clipping for
//! bounding volume hierarchies", 2007).
//!
//! Splits that bring little take memory and time. So some parts of the scene are built both ways, and the expected costs
//! decide. All numbers depend on the geometry alone.

use rayon::prelude::*;

use super::buckets::Buckets;
use super::builder::expected_cost;
use super::clip::Clipper;
use super::primitives::{PrimitiveArrays, Primitives};
use super::reference::{Reference, SimdAabb};
use crate::bvh::layout::ChildKind;

/// A sliver's box has at least this many times the area that the boxes of its parts approach. (A box around half of a
/// square across an axis: 2; around triangles of equal sides: up to 2.6.)
const EMPTY: f32 = 8.0;
/// A split must save this part of the mean area of the slivers' boxes.
const LEAST: f32 = 0.25;
/// The most parts of a triangle, as a power of two.
const MOST: u32 = 8;
/// The most references, as a multiple of the number of primitives.
const MOST_OF_ALL: usize = 3;
/// The number of triangles that are looked at first, and of slivers that tell how much they are split.
const SAMPLE: usize = 1 << 14;
const SOME: usize = 1 << 10;
/// The parts of the scene that are built both ways: how many, and the most references of each.
const TRIALS: usize = 4;
const TRIAL: usize = 1 << 13;
/// With splits, the expected cost must be less than this part of that without.
const GAIN: f32 = 0.8;
/// The number of triangles that a thread splits at a time.
const CHUNK: usize = 1 << 13;

/// Returns references to all primitives, with parts of slivers in their place; nothing if splits are not worthwhile.
pub(in crate::bvh) fn split(primitives: &Primitives) -> Vec<Reference> {
    let Some(splitter) = Splitter::new(primitives).filter(|splitter| splitter.is_worthwhile(primitives))
    else {
        return Vec::new();
    };
    let count = primitives.count();
    let chunks = (0..count.div_ceil(CHUNK)).into_par_iter();
    let chunks: Vec<Vec<Reference>> = chunks
        .map(|chunk| {
            let places = chunk * CHUNK..count.min((chunk + 1) * CHUNK);
            splitter.parts(places.map(|place| primitives.reference(place)))
        })
        .collect();
    let parts: usize = chunks.iter().map(Vec::len).sum();
    // The sample may have missed vast slivers, of hundreds of parts each.
    if parts > MOST_OF_ALL * count {
        return Vec::new();
    }
    let mut references = Vec::with_capacity(parts);
    chunks.into_iter().for_each(|chunk| references.extend(chunk));
    references
}

/// True if the triangle is long, thin and at an angle to the axes.
#[inline]
fn is_sliver([a, b, c]: [[f32; 3]; 3], box_area: f32) -> bool {
    let between = |from: [f32; 3], to: [f32; 3]| glam::Vec3::from_array(to) - glam::Vec3::from_array(from);
    // Half the surface of boxes around ever smaller parts is the area of its shadows along the axes (Karras and Aila,
    // "Fast parallel construction of high-quality bounding volume hierarchies", 2013).
    let shadows = 0.5 * between(a, b).cross(between(a, c)).abs().element_sum();
    shadows > 0.0 && box_area >= EMPTY * shadows
}

struct Splitter<'a> {
    geometry: &'a PrimitiveArrays<'a>,
    /// The least area that a split saves.
    least: f32,
}

impl<'a> Splitter<'a> {
    /// `None` if there are hardly any slivers. Otherwise at most about one part more for each.
    fn new(primitives: &Primitives<'a>) -> Option<Self> {
        let (geometry, count) = (primitives.geometry, primitives.triangles.len());
        // Odd, because triangles often come in pairs.
        let stride = (count / SAMPLE).max(1) | 1;
        let (mut slivers, mut all, mut area_of_all, mut area) = (Vec::new(), 0, 0.0, 0.0);
        for place in (0..count).step_by(stride) {
            let reference = primitives.reference(place);
            let box_area = reference.extent().half_area();
            all += 1;
            area_of_all += f64::from(box_area);
            if is_sliver(geometry.corners(reference.id()), box_area) {
                area += f64::from(box_area);
                slivers.push(reference);
            }
        }
        // A few vast triangles, such as a ground, must not hide them.
        if slivers.is_empty() || (4 * slivers.len() < all && 2.0 * area < area_of_all) {
            return None;
        }
        let mut splitter = Self { geometry, least: (area / slivers.len() as f64) as f32 * LEAST };
        // Areas of the tiniest and of the largest triangles are no floats.
        if splitter.least <= 0.0 || !splitter.least.is_finite() {
            return None;
        }
        let some = slivers.iter().step_by(slivers.len().div_ceil(SOME));
        while splitter.parts(some.clone().copied()).len() > 2 * some.len() {
            splitter.least *= 1.5;
        }
        Some(splitter)
    }

    /// Builds neighbouring primitives with and without splits, and compares expected costs.
    fn is_worthwhile(&self, primitives: &Primitives) -> bool {
        let buckets = Buckets::new(primitives);
        let sizes = buckets.sizes();
        let filled: Vec<usize> = (0..sizes.len()).filter(|bucket| sizes[*bucket] > 0).collect();
        let apart = filled.len().div_ceil(TRIALS);
        let trials: Vec<usize> = filled.into_iter().step_by(apart).collect();
        let costs = trials.into_par_iter().with_max_len(1).map(|bucket| {
            let places = buckets.members(bucket).take(TRIAL);
            let whole: Vec<_> = places.map(|place| primitives.reference(place as usize)).collect();
            let parts = self.parts(whole.iter().copied());
            let mixed = primitives.are_mixed();
            [expected_cost(parts, mixed), expected_cost(whole, mixed)]
        });
        // One after another, for the same sum on all threads.
        let costs: Vec<[f32; 2]> = costs.collect();
        let sum = |way: usize| costs.iter().map(|cost| cost[way]).sum::<f32>();
        sum(0) < GAIN * sum(1)
    }

    /// The references, with parts of slivers in their place.
    fn parts(&self, references: impl Iterator<Item = Reference>) -> Vec<Reference> {
        let mut parts = Vec::with_capacity(references.size_hint().0);
        for reference in references {
            let corners = match reference.kind() {
                ChildKind::Triangles => Some(self.geometry.corners(reference.id())),
                _ => None,
            };
            let box_area = reference.extent().half_area();
            match corners.filter(|corners| is_sliver(*corners, box_area)) {
                Some(corners) => self.cut(&Clipper::new(corners), reference, MOST, &mut parts),
                None => parts.push(reference),
            }
        }
        parts
    }

    /// Cuts a part in the middle of its longest side, and both halves again, as long as it is worthwhile.
    fn cut(&self, clipper: &Clipper, part: Reference, depth: u32, parts: &mut Vec<Reference>) {
        let whole = part.extent();
        let axis = whole.longest_axis();
        let middle = 0.5 * (whole.min[axis] + whole.max[axis]);
        let low = clipper.between(axis, f32::NEG_INFINITY, middle).intersection(whole);
        let high = clipper.between(axis, middle, f32::INFINITY).intersection(whole);
        let is_empty = |half: &SimdAabb| half.min.cmpgt(half.max).bitmask() & 7 != 0;
        let saved = whole.half_area() - low.half_area() - high.half_area();
        if depth > 0 && saved >= self.least && !is_empty(&low) && !is_empty(&high) {
            self.cut(clipper, part.clipped(&low), depth - 1, parts);
            self.cut(clipper, part.clipped(&high), depth - 1, parts);
        } else {
            parts.push(part);
        }
    }
}
