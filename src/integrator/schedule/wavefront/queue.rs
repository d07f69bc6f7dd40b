//! Queues in structure-of-arrays form: a column for each number, so that lanes load and pack them directly. Columns are
//! longer than the queue's capacity by the widest lane count, past which kernels never write.

use std::num::Wrapping;

use crate::bvh::{AnyHitFilter, Crossing, HitPredicate, HitsMut, Rays};
use crate::integrator::RenderSetup;
use crate::integrator::path::Path;
use crate::integrator::path::any_hit::{PathRay, culling};
use crate::integrator::path::columns::{Columns, PADDING};
use crate::integrator::reuse::PixelSample;
use crate::integrator::transport::medium::MOST;
use crate::math::{Color, NONE, Vector};
use crate::shading::HitLanes;
use crate::simd::{Float, Int, Mask};
use crate::world::Settings;

#[inline(always)]
fn gather_vector<F: Float>([x, y, z]: [&[f32]; 3], places: F::Int, mask: F::Mask) -> Vector<F> {
    Vector::new(F::gather(x, places, mask), F::gather(y, places, mask), F::gather(z, places, mask))
}

#[inline(always)]
fn gather_color<F: Float>([r, g, b]: [&[f32]; 3], places: F::Int, mask: F::Mask) -> Color<F> {
    Color::new(F::gather(r, places, mask), F::gather(g, places, mask), F::gather(b, places, mask))
}

/// A queue of paths: origin, direction, throughput, radiance, density, width, spread, distance travelled; pixel,
/// sample, branch, depth with scatterings, bodies, facing, source; state for photons.
///
/// The source is the hit of the wave that a path comes from, whose radiance it inherits when the lights have been
/// added; [`crate::math::NONE`] for forks, which begin without radiance.
pub struct PathQueue {
    /// All columns but the last.
    pub columns: Columns<16, 7>,
    /// The state of paths for dividing light with photons; empty if there are none.
    landing: Vec<u32>,
}

/// Bytes of a path in its queue.
pub const PATH_BYTES: usize = Columns::<16, 8>::ITEM;
/// Bytes of a hit.
pub const HIT_BYTES: usize = Columns::<3, 3>::ITEM;

/// Columns of [`PathQueue`], the last one of integers.
const THROUGHPUT: usize = 6;
const RADIANCE: usize = 9;
const DENSITY: usize = 12;
const SOURCE: usize = 6;
/// Bits of a path's depth in the column that it shares with its scatterings.
const DEPTH_BITS: i32 = 17;
const DEPTH_MASK: u32 = (1 << DEPTH_BITS) - 1;

const _: () = assert!(Settings::MOST_DEPTH + MOST < 1 << DEPTH_BITS && MOST < 1 << (32 - DEPTH_BITS));

impl PathQueue {
    /// Creates a queue for `capacity` paths of a render.
    pub fn new(setup: &RenderSetup, capacity: usize) -> Self {
        let landing = if setup.photons.is_ok() { vec![0; capacity + PADDING] } else { Vec::new() };
        Self { columns: Columns::new(capacity), landing }
    }

    /// Loads the paths from `at` on.
    #[inline(always)]
    pub fn load<F: Float>(&self, at: usize) -> Path<F> {
        let q = &self.columns;
        let landing =
            if self.landing.is_empty() { F::Int::splat(0) } else { F::Int::load(&self.landing[at..]) };
        Path {
            origin: Vector::new(q.float(0, at), q.float(1, at), q.float(2, at)),
            direction: Vector::new(q.float(3, at), q.float(4, at), q.float(5, at)),
            throughput: Color::new(q.float(6, at), q.float(7, at), q.float(8, at)),
            radiance: Color::new(q.float(9, at), q.float(10, at), q.float(11, at)),
            pixel: q.integer(0, at),
            sample: q.integer(1, at),
            bounce_counts: q.integer(2, at),
            depth: q.integer::<F::Int>(3, at) & F::Int::splat(DEPTH_MASK),
            pdf: q.float(12, at),
            width: q.float(13, at),
            spread: q.float(14, at),
            bodies: q.integer(4, at),
            packed_normal: q.integer(5, at),
            scatterings: q.integer::<F::Int>(3, at).shr::<DEPTH_BITS>(),
            travelled: q.float(15, at),
            landing,
        }
    }

    /// Gathers the paths at some places.
    #[inline(always)]
    pub fn gather<F: Float>(&self, places: F::Int, mask: F::Mask) -> Path<F> {
        let (f, i) = (&self.columns.floats, &self.columns.integers);
        let landing = if self.landing.is_empty() {
            F::Int::splat(0)
        } else {
            F::Int::gather(&self.landing, places, mask)
        };
        let bounces = F::Int::gather(&i[3], places, mask);
        Path {
            origin: gather_vector::<F>([&f[0], &f[1], &f[2]], places, mask),
            direction: gather_vector::<F>([&f[3], &f[4], &f[5]], places, mask),
            throughput: gather_color::<F>([&f[6], &f[7], &f[8]], places, mask),
            radiance: gather_color::<F>([&f[9], &f[10], &f[11]], places, mask),
            pixel: F::Int::gather(&i[0], places, mask),
            sample: F::Int::gather(&i[1], places, mask),
            bounce_counts: F::Int::gather(&i[2], places, mask),
            depth: bounces & F::Int::splat(DEPTH_MASK),
            pdf: F::gather(&f[12], places, mask),
            width: F::gather(&f[13], places, mask),
            spread: F::gather(&f[14], places, mask),
            bodies: F::Int::gather(&i[4], places, mask),
            packed_normal: F::Int::gather(&i[5], places, mask),
            scatterings: bounces.shr::<DEPTH_BITS>(),
            travelled: F::gather(&f[15], places, mask),
            landing,
        }
    }

    /// Packs paths to place `at` without changing their number.
    #[inline(always)]
    pub fn store<F: Float>(&mut self, at: usize, mask: F::Mask, path: &Path<F>, source: F::Int) {
        let (o, d, t, r) = (path.origin, path.direction, path.throughput, path.radiance);
        let Path { pdf, width, spread, travelled, .. } = *path;
        let floats =
            [o.x, o.y, o.z, d.x, d.y, d.z, t.r, t.g, t.b, r.r, r.g, r.b, pdf, width, spread, travelled];
        let Path {
            pixel,
            sample,
            bounce_counts: branch,
            depth,
            bodies,
            packed_normal: facing,
            scatterings,
            ..
        } = *path;
        let bounces = depth | scatterings.shl::<DEPTH_BITS>();
        let integers = [pixel, sample, branch, bounces, bodies, facing, source];
        self.columns.pack::<F>(at, mask, floats, integers);
        if !self.landing.is_empty() {
            path.landing.compress(mask, &mut self.landing[at..]);
        }
    }

    /// Appends paths.
    #[inline(always)]
    pub fn append<F: Float>(&mut self, mask: F::Mask, path: &Path<F>, source: F::Int) {
        let at = self.columns.length;
        self.store(at, mask, path, source);
        self.columns.set_len(at + mask.count());
    }

    /// Bytes of all columns.
    pub fn bytes(&self) -> usize {
        self.columns.bytes() + size_of_val(&self.landing[..])
    }

    /// The rays of the paths, with columns of their limits.
    pub fn rays<'a>(&'a self, ends: &'a RayLimits, surfaces: &'a PathAnyHit) -> Rays<'a> {
        let n = self.columns.length;
        let column = |i: usize| &self.columns.floats[i][..n];
        Rays {
            origin: [0, 1, 2].map(column),
            direction: [3, 4, 5].map(column),
            t_min: &ends.zero[..n],
            t_max: &ends.infinity[..n],
            filter: AnyHitFilter::new(surfaces, 0).with_culling(culling(surfaces.setup, false)),
        }
    }

    /// Red, green and blue of the radiance so far.
    pub fn radiance(&self) -> [&[f32]; 3] {
        [0, 1, 2].map(|i| &self.columns.floats[RADIANCE + i][..self.columns.length])
    }

    /// Red, green and blue of the radiance so far, writable.
    pub fn radiance_mut(&mut self) -> [&mut [f32]; 3] {
        let n = self.columns.length;
        let [r, g, b] = &mut self.columns.floats[RADIANCE..RADIANCE + 3] else { unreachable!() };
        [&mut r[..n], &mut g[..n], &mut b[..n]]
    }

    /// Pixels and samples.
    pub fn pixels(&self) -> (&[u32], &[u32]) {
        (&self.columns.integers[0][..self.columns.length], &self.columns.integers[1][..self.columns.length])
    }

    /// The pixel, the sample and the radiance so far of each path.
    pub fn found(&self) -> impl Iterator<Item = (PixelSample, Color<f32>)> {
        let ((pixels, samples), [r, g, b]) = (self.pixels(), self.radiance());
        let colors = r.iter().zip(g).zip(b).map(|((r, g), b)| Color::new(*r, *g, *b));
        pixels.iter().copied().zip(samples.iter().copied()).zip(colors)
    }

    /// Keeps paths that are reused, with a throughput of 1 and without radiance, and moves all others to the end of
    /// another queue. `shares` decides by a path's source, pixel and sample, throughput and density.
    pub fn part(
        &mut self,
        others: &mut PathQueue,
        mut shares: impl FnMut(usize, PixelSample, Color<f32>, f32) -> bool,
    ) {
        let mut kept = 0;
        for i in 0..self.columns.length {
            let Columns { floats, integers, .. } = &self.columns;
            let path = (integers[0][i], integers[1][i]);
            let [r, g, b] = [0, 1, 2].map(|channel| floats[THROUGHPUT + channel][i]);
            if !shares(self.source(i), path, Color::new(r, g, b), floats[DENSITY][i]) {
                others.make_room(1);
                others.append::<f32>(true, &self.load(i), Wrapping(NONE));
                continue;
            }
            if kept < i {
                self.store::<f32>(kept, true, &self.load(i), Wrapping(NONE));
            }
            let Columns { floats, integers, .. } = &mut self.columns;
            for channel in 0..3 {
                (floats[THROUGHPUT + channel][kept], floats[RADIANCE + channel][kept]) = (1.0, 0.0);
            }
            integers[SOURCE][kept] = NONE;
            kept += 1;
        }
        self.columns.set_len(kept);
    }

    /// The hit that a path comes from.
    pub fn source(&self, at: usize) -> usize {
        self.columns.integers[SOURCE][at] as usize
    }

    /// Copies the radiance of the hits that the paths come from.
    pub fn inherit(&mut self, hits: &PathQueue) {
        for i in 0..self.columns.length {
            let source = self.columns.integers[SOURCE][i];
            if source != NONE {
                for channel in RADIANCE..RADIANCE + 3 {
                    self.columns.floats[channel][i] = hits.columns.floats[channel][source as usize];
                }
            }
        }
    }

    /// Moves paths here until the queue is full.
    pub fn fill_from(&mut self, from: &mut PathQueue) {
        if !self.landing.is_empty() {
            let (to, room) = (self.columns.length, self.columns.room());
            if to == 0 && from.landing.len() == self.landing.len() {
                std::mem::swap(&mut self.landing, &mut from.landing);
            } else {
                let end = from.columns.length;
                let start = end - end.min(room);
                self.landing[to..to + end - start].copy_from_slice(&from.landing[start..end]);
            }
        }
        self.columns.take_last(&mut from.columns);
    }

    /// Moves all paths here, however many there are.
    pub fn spill_from(&mut self, from: &mut PathQueue) {
        self.make_room(from.columns.length);
        self.fill_from(from);
    }

    /// Makes room for `count` more paths.
    fn make_room(&mut self, count: usize) {
        if self.columns.room() < count {
            let capacity = (self.columns.length + count).next_power_of_two();
            self.columns.grow(capacity);
            if !self.landing.is_empty() {
                self.landing.resize(capacity + PADDING, 0);
            }
        }
    }
}

/// The hits of a wave's rays: t, u, v; primitive, instance, material (under the path transport).
pub struct HitQueue(pub Columns<3, 3>);

impl HitQueue {
    /// All columns for the first `count` rays, writable.
    pub fn columns(&mut self, count: usize) -> HitsMut<'_> {
        let [t, u, v] = &mut self.0.floats;
        let [primitive, instance, _] = &mut self.0.integers;
        HitsMut {
            t: &mut t[..count],
            u: &mut u[..count],
            v: &mut v[..count],
            primitive: &mut primitive[..count],
            instance: &mut instance[..count],
        }
    }

    /// Loads the hits from `at` on.
    #[inline(always)]
    pub fn load<F: Float>(&self, at: usize) -> HitLanes<F> {
        HitLanes {
            t: self.0.float::<F>(0, at),
            u: self.0.float::<F>(1, at),
            v: self.0.float::<F>(2, at),
            primitive: self.0.integer(0, at),
            instance: self.0.integer(1, at),
        }
    }

    /// Gathers the hits at some places.
    #[inline(always)]
    pub fn gather<F: Float>(&self, places: F::Int, mask: F::Mask) -> HitLanes<F> {
        let q = &self.0;
        HitLanes {
            t: F::gather(&q.floats[0], places, mask),
            u: F::gather(&q.floats[1], places, mask),
            v: F::gather(&q.floats[2], places, mask),
            primitive: F::Int::gather(&q.integers[0], places, mask),
            instance: F::Int::gather(&q.integers[1], places, mask),
        }
    }

    /// Packs hits to place `at`.
    #[inline(always)]
    pub fn store<F: Float>(&mut self, at: usize, mask: F::Mask, hit: &HitLanes<F>, material: F::Int) {
        self.0.pack::<F>(at, mask, [hit.t, hit.u, hit.v], [hit.primitive, hit.instance, material]);
    }

    /// The primitives that the first `count` rays have hit.
    pub fn primitives(&self, count: usize) -> &[u32] {
        &self.0.integers[0][..count]
    }

    /// Materials of the first `count` hits.
    pub fn materials(&self, count: usize) -> &[u32] {
        &self.0.integers[2][..count]
    }
}

/// Columns of limits for rays that begin at their origin and have no end.
pub struct RayLimits {
    zero: Vec<f32>,
    infinity: Vec<f32>,
}

impl RayLimits {
    /// Creates limits for queues of a capacity.
    pub fn new(capacity: usize) -> Self {
        Self { zero: vec![0.0; capacity], infinity: vec![f32::INFINITY; capacity] }
    }

    /// The beginnings of `count` rays, all 0.
    pub fn zero(&self, count: usize) -> &[f32] {
        &self.zero[..count]
    }

    /// Bytes of both columns.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.zero[..]) + size_of_val(&self.infinity[..])
    }
}

/// The any-hit filter of the rays of paths.
pub struct PathAnyHit<'a> {
    /// The render setup.
    pub setup: &'a RenderSetup,
    /// The paths.
    pub paths: &'a PathQueue,
}

impl HitPredicate for PathAnyHit<'_> {
    fn accepts(&self, ray: usize, crossing: &Crossing) -> bool {
        PathRay { setup: self.setup, path: &|| self.paths.load(ray), shadow: None }.meets(crossing)
    }
}
