//! Queues in the order of the ways that rays go.

use super::Rays;
use super::triangle::Longest;
use crate::simd::{Float, Int};

/// Ways that a ray can go: along each axis forwards or backwards, and along which of them farthest.
pub(super) const WAYS: usize = 3 * OCTANTS;
/// Forwards or backwards along each axis.
pub(super) const OCTANTS: usize = 8;

/// Room for a queue's order.
#[derive(Default)]
pub(super) struct Ways {
    /// The way that each ray of the queue goes.
    ways: Vec<u32>,
    /// The rays' places in the queue, one way's after another's.
    order: Vec<u32>,
}

impl Ways {
    /// The rays' places in the queue, one way's after another's, and behind them as many zeros as a
    /// register has lanes.
    #[inline(always)]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Orders a queue; returns the end of each way. (A counting sort: rays of one way keep their order.)
    #[inline(always)]
    pub fn sort<F: Float>(&mut self, rays: &Rays) -> [usize; WAYS] {
        let count = rays.len();
        if self.order.len() < count + F::WIDTH {
            self.ways.resize(count + F::WIDTH, 0);
            self.order.resize(count + F::WIDTH, 0);
        }
        for at in (0..count).step_by(F::WIDTH) {
            let direction = [0, 1, 2].map(|axis| &rays.direction[axis][at..]);
            let [x, y, z] = direction.map(padded::<F>);
            let mut way = Longest::new([x, y, z]).axis() * F::Int::splat(OCTANTS as u32);
            way = way + x.to_bits().shr::<31>();
            way = way + y.to_bits().shr::<31>().shl::<1>();
            way = way + z.to_bits().shr::<31>().shl::<2>();
            way.store(&mut self.ways[at..]);
        }
        let mut ends = [0; WAYS];
        for way in &self.ways[..count] {
            ends[*way as usize % WAYS] += 1;
        }
        let mut first = 0;
        for end in &mut ends {
            first += std::mem::replace(end, first);
        }
        for (ray, way) in self.ways[..count].iter().enumerate() {
            let place = &mut ends[*way as usize % WAYS];
            self.order[*place] = ray as u32;
            *place += 1;
        }
        self.order[count..count + F::WIDTH].fill(0);
        ends
    }
}

/// The front of a column, whose end may be near.
#[inline(always)]
fn padded<F: Float>(column: &[f32]) -> F {
    if column.len() >= F::WIDTH {
        return F::load(column);
    }
    let mut values = [0.0; 16];
    values[..column.len()].copy_from_slice(column);
    F::load(&values)
}
