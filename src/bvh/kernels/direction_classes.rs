//! Sorts queues by the direction classes of their rays.

use crate::bvh::Rays;
use crate::bvh::intersect::hit_sink::{HitSink, write_lanes};
use crate::bvh::intersect::triangle::Longest;
use crate::math::NONE;
use crate::simd::{Float, Int};

/// The number of direction classes: forwards or backwards along each axis, and the axis along which the direction is
/// longest.
pub(in crate::bvh) const CLASSES: usize = 3 * OCTANTS;
/// The number of octants: forwards or backwards along each axis.
pub(in crate::bvh) const OCTANTS: usize = 8;

/// Buffers for sorting a queue.
#[derive(Default)]
pub(in crate::bvh) struct DirectionClasses {
    /// The class of each ray of the queue.
    classes: Vec<u32>,
    /// The position of each ray of the queue in the sorted order.
    places: Vec<u32>,
    /// The rays' indices in the queue in sorted order, if they were requested.
    numbers: Vec<u32>,
    /// Two rows a ray in sorted order: origin and `t_min`, direction and `t_max`.
    rows: Vec<[f32; 4]>,
    /// The rays' hits in sorted order: t, u, v and primitive.
    hits: Vec<[f32; 4]>,
}

impl DirectionClasses {
    /// The class of each ray of the queue, once it has been classified.
    #[inline(always)]
    pub fn classes(&self) -> &[u32] {
        &self.classes
    }

    /// Loads the rays from a sorted position on, a lane each: origins, directions, `t_min` and `t_max`. Lanes behind
    /// the last ray are undefined.
    #[inline(always)]
    pub fn rays<F: Float>(&self, at: usize) -> ([F; 3], [F; 3], F, F) {
        let rows = &self.rows[2 * at..];
        let number = F::Int::load(&NUMBERS).shl::<1>();
        let [ox, oy, oz, t_min] = F::load_rows(rows, number);
        let [dx, dy, dz, t_max] = F::load_rows(&rows[1..], number);
        ([ox, oy, oz], [dx, dy, dz], t_min, t_max)
    }

    /// Stores the hits of the rays from a sorted position on. It also overwrites positions behind the last of them,
    /// which must therefore be stored later.
    #[inline(always)]
    pub fn keep<F: Float>(&mut self, at: usize, [t, u, v]: [F; 3], primitive: F::Int) {
        F::store_rows([t, u, v, primitive.reinterpret()], &mut self.hits[at..]);
    }

    /// Writes all hits of a queue to the sink, once they have been stored. None may be in an instance.
    #[inline(always)]
    pub fn answer<F: Float, A: HitSink>(&self, count: usize, sink: &mut A) {
        for at in (0..count).step_by(F::WIDTH) {
            let [t, u, v, primitive] = F::load_rows(&self.hits, F::Int::load(&self.places[at..]));
            let numbers = [primitive.to_bits(), F::Int::splat(NONE)];
            write_lanes(sink, at, F::WIDTH.min(count - at), [t, u, v], numbers);
        }
    }

    /// The index in the queue of the ray at a sorted position, if indices were requested.
    pub fn number(&self, place: usize) -> usize {
        self.numbers[place] as usize
    }

    /// Sorts a queue; returns the end of each class. (A counting sort: rays of one class keep their order.)
    #[inline(always)]
    pub fn sort<F: Float>(&mut self, rays: &Rays, numbered: bool) -> [usize; CLASSES] {
        let count = rays.len();
        if numbered && self.numbers.len() < count {
            self.numbers.resize(count, 0);
        }
        let ends = self.classify::<F>(rays);
        if self.places.len() < count + F::WIDTH {
            self.places.resize(count + F::WIDTH, 0);
            self.hits.resize(count + F::WIDTH, [0.0; 4]);
            self.rows.resize(2 * (count + F::WIDTH), [0.0; 4]);
        }
        let mut next = starts(&ends);
        for at in (0..count).step_by(F::WIDTH) {
            let (mut origin, mut direction) = ([F::zero(); 3], [F::zero(); 3]);
            for axis in 0..3 {
                origin[axis] = padded::<F>(&rays.origin[axis][at..]);
                direction[axis] = padded::<F>(&rays.direction[axis][at..]);
            }
            let (t_min, t_max) = (padded::<F>(&rays.t_min[at..]), padded::<F>(&rays.t_max[at..]));
            let (mut first, mut second) = ([[0.0; 4]; 16], [[0.0; 4]; 16]);
            F::store_rows_mixed([origin[0], origin[1], origin[2], t_min], &mut first);
            F::store_rows_mixed([direction[0], direction[1], direction[2], t_max], &mut second);
            for lane in 0..F::WIDTH.min(count - at) {
                let place = &mut next[self.classes[at + lane] as usize % CLASSES];
                self.places[at + lane] = *place as u32;
                if numbered {
                    self.numbers[*place] = (at + lane) as u32;
                }
                let rows = &mut self.rows[2 * *place..][..2];
                let from = F::mixed(lane) & 15;
                (rows[0], rows[1]) = (first[from], second[from]);
                *place += 1;
            }
        }
        self.places[count..count + F::WIDTH].fill(0);
        ends
    }

    /// Computes the class of each ray; returns the end of each class in a queue sorted by class.
    #[inline(always)]
    pub fn classify<F: Float>(&mut self, rays: &Rays) -> [usize; CLASSES] {
        let count = rays.len();
        if self.classes.len() < count + F::WIDTH {
            self.classes.resize(count + F::WIDTH, 0);
        }
        for at in (0..count).step_by(F::WIDTH) {
            let x = padded::<F>(&rays.direction[0][at..]);
            let y = padded::<F>(&rays.direction[1][at..]);
            let z = padded::<F>(&rays.direction[2][at..]);
            class_of(&[x, y, z]).store(&mut self.classes[at..]);
        }
        let mut ends = [0; CLASSES];
        for class in &self.classes[..count] {
            ends[*class as usize % CLASSES] += 1;
        }
        let mut end = 0;
        for count in &mut ends {
            end += *count;
            *count = end;
        }
        ends
    }
}

/// The class of each direction: 8 times the longest axis, plus a bit for each axis along which it goes backwards.
#[inline(always)]
pub(in crate::bvh) fn class_of<F: Float>([x, y, z]: &[F; 3]) -> F::Int {
    let mut class = Longest::new([*x, *y, *z]).axis() * F::Int::splat(OCTANTS as u32);
    class = class + x.to_bits().shr::<31>();
    class = class + y.to_bits().shr::<31>().shl::<1>();
    class + z.to_bits().shr::<31>().shl::<2>()
}

/// The start of each class in a queue sorted by class.
#[inline(always)]
pub(in crate::bvh) fn starts(ends: &[usize; CLASSES]) -> [usize; CLASSES] {
    let mut starts = [0; CLASSES];
    starts[1..].copy_from_slice(&ends[..CLASSES - 1]);
    starts
}

/// The numbers of lanes.
pub(in crate::bvh) const NUMBERS: [u32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// Loads the front of a column, which may end within a register.
#[inline(always)]
pub(in crate::bvh) fn padded<F: Float>(column: &[f32]) -> F {
    if column.len() >= F::WIDTH {
        return F::load(column);
    }
    let mut values = [0.0; 16];
    values[..column.len()].copy_from_slice(column);
    F::load(&values)
}
