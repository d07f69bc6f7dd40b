//! The rays of a stream, a row each.

use crate::bvh::Rays;
use crate::bvh::intersect::hit_sink::{HitSink, write_lanes};
use crate::bvh::intersect::ray::slab_scales;
use crate::bvh::intersect::triangle::Longest;
use crate::bvh::kernels::direction_classes::{NUMBERS, padded};
use crate::math::{Hit, NONE};
use crate::simd::{Float, Int, Mask};

/// The largest number of lanes.
pub const LANES: usize = 16;

/// A ray's row of four times four numbers: the first half for boxes, the second for leaves.
///
/// ```text
/// origin x y z, best t │ near scale x y z, t_min │ shear x y z, primitive │ u, v, instance, place
/// ```
///
/// `best t` is negative for a finished ray, `place` is the ray's index in the queue.
pub const ROW: usize = 1 << 2;
pub type Quad = [f32; 4];

/// Writes the rows of some rays to the next places of their classes, and the rows' indices to `places`; false if the
/// factors for far planes cannot be derived from those for near ones, because reciprocals nearly over- or underflow.
#[inline(always)]
pub fn load<F: Float>(
    rays: &Rays,
    at: usize,
    classes: &[u32],
    next: &mut [usize],
    rows: &mut [Quad],
    places: &mut [u32],
) -> bool {
    const LEAST: f32 = 1e-36;
    let (zero, one) = (F::zero(), F::one());
    let (mut origin, mut direction, mut reciprocal) = ([zero; 3], [one; 3], [one; 3]);
    let mut scale = [one; 3];
    let mut regular = F::Mask::first(F::WIDTH);
    // NaN if something is not finite.
    let mut zeros = zero;
    for axis in 0..3 {
        let o = padded::<F>(&rays.origin[axis][at..]);
        let d = padded::<F>(&rays.direction[axis][at..]);
        let r = one / d;
        scale[axis] = slab_scales(r).0;
        let size = r.abs();
        let infinite = size.eq(F::splat(f32::INFINITY));
        regular = regular & size.ge(F::splat(LEAST)) & (infinite | size.le(F::splat(1.0 / LEAST)));
        zeros = zeros + o * zero + d * zero;
        (origin[axis], direction[axis], reciprocal[axis]) = (o, d, r);
    }
    let longest = Longest::new(direction);
    let (d, r) = (longest.rename(direction), longest.rename(reciprocal));
    // NaN stays NaN, −0 becomes 0.
    let t_min = zero.max(padded::<F>(&rays.t_min[at..])) + zero;
    let t_max = padded::<F>(&rays.t_max[at..]);
    let alive = zeros.eq(zero) & t_min.le(t_max);
    let best = F::select(alive, t_max, F::splat(-1.0));
    let none = F::Int::splat(NONE).reinterpret();
    let place = (F::Int::load(&NUMBERS) + F::Int::splat(at as u32)).reinterpret();
    let mut quads = [[[0.0; 4]; LANES]; ROW];
    F::store_rows_mixed([origin[0], origin[1], origin[2], best], &mut quads[0]);
    F::store_rows_mixed([scale[0], scale[1], scale[2], t_min], &mut quads[1]);
    F::store_rows_mixed([d[0] * r[2], d[1] * r[2], r[2], none], &mut quads[2]);
    F::store_rows_mixed([zero, zero, none, place], &mut quads[3]);
    for lane in 0..F::WIDTH.min(rays.len() - at) {
        let next = &mut next[classes[at + lane] as usize];
        let row = &mut rows[ROW * *next..][..ROW];
        for (quad, from) in row.iter_mut().zip(&quads) {
            *quad = from[F::mixed(lane) % LANES];
        }
        places[at + lane] = *next as u32;
        *next += 1;
    }
    !(alive & !regular).any()
}

/// The best hit of a row's ray.
#[inline(always)]
pub fn best(row: &[Quad]) -> Hit {
    let [u, v, instance, _] = row[3];
    Hit { t: row[0][3], u, v, primitive: row[2][3].to_bits(), instance: instance.to_bits() }
}

/// Writes the hits of the rays whose rows are in `places` to the sink, from index `first` of the queue on, at most as
/// many as there are lanes.
#[inline(always)]
pub fn answer<F: Float, A: HitSink>(rows: &[Quad], places: &[u32], first: usize, sink: &mut A) {
    let count = places.len().min(F::WIDTH);
    let mut padded = [0; LANES];
    padded[..count].copy_from_slice(&places[..count]);
    let row = F::Int::load(&padded).shl::<2>();
    let [_, _, _, t] = F::load_rows(rows, row);
    let [_, _, _, primitive] = F::load_rows(&rows[2..], row);
    let [u, v, instance, _] = F::load_rows(&rows[3..], row);
    write_lanes(sink, first, count, [t, u, v], [primitive.to_bits(), instance.to_bits()]);
}

/// The inverse of [`best`].
#[inline(always)]
pub fn put_best(row: &mut [Quad], hit: &Hit) {
    row[0][3] = hit.t;
    row[2][3] = f32::from_bits(hit.primitive);
    row[3] = [hit.u, hit.v, f32::from_bits(hit.instance), row[3][3]];
}

/// Marks an any-hit ray as finished.
#[inline(always)]
pub fn finish(row: &mut [Quad]) {
    row[0][3] = -1.0;
    // Any-hit: the primitive's id is not needed.
    row[2][3] = f32::from_bits(0);
}
