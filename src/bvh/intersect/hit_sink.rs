//! Hit sinks: the destinations of a query's results, which all kernels write to.

use crate::bvh::HitsMut;
use crate::math::{Hit, NONE};
use crate::simd::{Float, Int};

/// Receives the results of a query.
pub(in crate::bvh) trait HitSink {
    /// True if any hit will do.
    const ANY: bool;
    /// Writes the result for a ray. A miss has no primitive.
    fn write(&mut self, index: usize, hit: &Hit);
    /// Writes the results for consecutive rays.
    fn write_all(&mut self, first: usize, hits: &Hits);
}

/// Columns of hits, all of one length.
pub(in crate::bvh) struct Hits<'a> {
    pub t: &'a [f32],
    pub u: &'a [f32],
    pub v: &'a [f32],
    pub primitive: &'a [u32],
    pub instance: &'a [u32],
}

/// Writes the results for `count` consecutive rays, a lane each: t, u, v; primitive and instance.
#[inline(always)]
pub(in crate::bvh) fn write_lanes<F: Float, A: HitSink>(
    sink: &mut A,
    first: usize,
    count: usize,
    along: [F; 3],
    ids: [F::Int; 2],
) {
    let (mut floats, mut integers) = ([[0.0; 16]; 3], [[0; 16]; 2]);
    for (column, values) in floats.iter_mut().zip(along) {
        values.store(column);
    }
    for (column, values) in integers.iter_mut().zip(ids) {
        values.store(column);
    }
    let ([t, u, v], [primitive, instance]) = (&floats, &integers);
    let hits = Hits {
        t: &t[..count],
        u: &u[..count],
        v: &v[..count],
        primitive: &primitive[..count],
        instance: &instance[..count],
    };
    sink.write_all(first, &hits);
}

/// A sink for a part of a queue.
pub(in crate::bvh) struct Offset<'a, A> {
    pub sink: &'a mut A,
    /// The index of the part's first ray.
    pub by: usize,
}

impl<A: HitSink> HitSink for Offset<'_, A> {
    const ANY: bool = A::ANY;
    #[inline(always)]
    fn write(&mut self, index: usize, hit: &Hit) {
        self.sink.write(self.by + index, hit);
    }
    #[inline(always)]
    fn write_all(&mut self, first: usize, hits: &Hits) {
        self.sink.write_all(self.by + first, hits);
    }
}

impl HitSink for HitsMut<'_> {
    const ANY: bool = false;
    #[inline(always)]
    fn write(&mut self, index: usize, hit: &Hit) {
        let missed = hit.is_miss();
        self.t[index] = if missed { f32::INFINITY } else { hit.t };
        self.u[index] = hit.u;
        self.v[index] = hit.v;
        self.primitive[index] = hit.primitive;
        self.instance[index] = hit.instance;
    }
    #[inline(always)]
    fn write_all(&mut self, first: usize, hits: &Hits) {
        let range = first..first + hits.t.len();
        for ((to, t), primitive) in self.t[range.clone()].iter_mut().zip(hits.t).zip(hits.primitive) {
            *to = if *primitive == NONE { f32::INFINITY } else { *t };
        }
        self.u[range.clone()].copy_from_slice(hits.u);
        self.v[range.clone()].copy_from_slice(hits.v);
        self.primitive[range.clone()].copy_from_slice(hits.primitive);
        self.instance[range].copy_from_slice(hits.instance);
    }
}

/// Any-hit sink: 1 for each ray that is blocked, 0 for the others.
pub(in crate::bvh) struct Occluded<'a>(pub &'a mut [u32]);

impl HitSink for Occluded<'_> {
    const ANY: bool = true;
    #[inline(always)]
    fn write(&mut self, index: usize, hit: &Hit) {
        self.0[index] = u32::from(!hit.is_miss());
    }
    #[inline(always)]
    fn write_all(&mut self, first: usize, hits: &Hits) {
        for (to, primitive) in self.0[first..first + hits.primitive.len()].iter_mut().zip(hits.primitive) {
            *to = u32::from(*primitive != NONE);
        }
    }
}
