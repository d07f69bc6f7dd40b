//! The relative speeds of kernels on a tree, measured on the rays at hand.
//!
//! The number of boxes per ray, the lanes in use and the like are poor predictors: their cost varies with the processor
//! and with the tree's place in memory. So now and then a queue is split between two kernels and their times are
//! compared. What is found belongs to the tree: all threads share it, without locks, and a tree that is built anew
//! after an edit begins with it. The hits do not depend on any of this.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// The least weight of a new measurement in the estimate.
const NEW: f32 = 0.2;
/// The most queues between two comparisons, and the factor by which their number grows and shrinks.
const LONGEST: u32 = 64;
const GROWTH: u32 = 4;
/// A measurement in which the kernel that seems to be slower is faster by this factor casts doubt.
const DOUBT: f32 = 1.25;
/// The most that one comparison tells, as a ratio of times: a thread may have been interrupted.
const MOST: f32 = 4.0;

/// The speed of one kernel compared with that of another. Threads that record at the same time may lose measurements,
/// which only postpones what they tell.
#[derive(Debug)]
pub(in crate::bvh) struct SpeedRatio {
    /// The kernels' mean times per ray, as bits of floats. The means of times, not of their ratios, tell which kernel
    /// takes less for all rays: one may be faster for most queues, which take little time.
    times: [AtomicU32; 2],
    /// The number of comparisons, of which the first few weigh more.
    count: AtomicU32,
    /// The number of queues between comparisons, and those left before the next.
    interval: AtomicU32,
    left: AtomicU32,
}

/// Unknown speeds. The first queue is not for comparisons: it brings the tree into the caches.
impl Default for SpeedRatio {
    fn default() -> Self {
        let count = AtomicU32::default();
        Self { times: Default::default(), count, interval: AtomicU32::new(1), left: AtomicU32::new(1) }
    }
}

impl SpeedRatio {
    /// The faster kernel, 0 or 1: `otherwise` before the first comparison.
    pub fn faster(&self, otherwise: usize) -> usize {
        let [first, second] = self.times();
        if first == second { otherwise } else { usize::from(first > second) }
    }

    fn times(&self) -> [f32; 2] {
        let [first, second] = &self.times;
        [f32::from_bits(first.load(Relaxed)), f32::from_bits(second.load(Relaxed))]
    }

    /// Counts a queue; true if it is to be split between both kernels. Of several threads, one gets true.
    pub fn is_due(&self) -> bool {
        let count_down = |left: u32| Some(left.checked_sub(1).unwrap_or(self.interval.load(Relaxed)));
        self.left.fetch_update(Relaxed, Relaxed, count_down) == Ok(0)
    }

    /// A number from 0 to 1, another one for each comparison: multiples of the golden ratio.
    pub fn shift(&self) -> f32 {
        (self.count.load(Relaxed) as f32 * 0.618_034).fract()
    }

    /// Records the kernels' times per ray, in any unit.
    pub fn record(&self, [first, second]: [f32; 2]) {
        let now = [first.min(MOST * second), second.min(MOST * first)];
        let slower = 1 - self.faster(usize::from(first > second));
        let count = self.count.load(Relaxed);
        let weight = NEW.max(1.0 / (count as f32 + 1.0));
        for ((time, before), now) in self.times.iter().zip(self.times()).zip(now) {
            time.store((before + weight * (now - before)).to_bits(), Relaxed);
        }
        self.count.store(count.saturating_add(1), Relaxed);
        let interval = self.interval.load(Relaxed);
        let interval = match DOUBT * now[slower] < now[1 - slower] {
            true => (interval / GROWTH).max(1),
            false => (interval * GROWTH).min(LONGEST),
        };
        self.interval.store(interval, Relaxed);
        self.left.store(interval, Relaxed);
    }
}

/// For a new tree: begins with these speeds, and verifies them soon.
impl Clone for SpeedRatio {
    fn clone(&self) -> Self {
        let copy = |value: &AtomicU32| AtomicU32::new(value.load(Relaxed));
        let [first, second] = &self.times;
        Self { times: [copy(first), copy(second)], count: copy(&self.count), ..Self::default() }
    }
}

/// The relative speeds of all pairs of kernels: by pair, for nearest-hit and for any-hit queries.
pub(in crate::bvh) type KernelSpeeds = [[SpeedRatio; 2]; 3];

#[cfg(test)]
mod tests {
    use super::*;

    /// Traces this many queues with kernels that take these times per ray; returns the number of queues that are split,
    /// and the number of whole ones that the second kernel traces.
    fn run(speeds: &SpeedRatio, queues: u32, took: [f32; 2]) -> [u32; 2] {
        let mut runs = [0; 2];
        for queue in 0..queues {
            if speeds.is_due() {
                runs[0] += 1;
                // The cost of queues rises and falls, and measurements are off by some per cent.
                let cost = 1.5 + (queue as f32 * 0.1).sin();
                let off = [1.0 + 0.05 * (queue as f32).sin(), 1.0];
                speeds.record([0, 1].map(|way| took[way] * cost * off[way]));
            } else {
                runs[1] += u32::from(speeds.faster(0) == 1);
            }
        }
        runs
    }

    #[test]
    fn faster_kernel_is_known_after_two_queues_and_may_change() {
        let speeds = SpeedRatio::default();
        assert_eq!([speeds.faster(0), speeds.faster(1)], [0, 1]);
        assert_eq!(run(&speeds, 2, [200.0, 100.0]), [1, 0]);
        assert_eq!(speeds.faster(0), 1);
        let [split, second] = run(&speeds, 400, [200.0, 100.0]);
        assert!((4..16).contains(&split) && second == 400 - split, "{split} {second}");
        let [split, second] = run(&speeds, 400, [100.0, 200.0]);
        assert!(split < 40 && second < 200, "{split} {second}");
    }

    #[test]
    fn kernels_of_equal_speed_are_seldom_compared() {
        let [split, _] = run(&SpeedRatio::default(), 1000, [100.0, 102.0]);
        assert!(split < 24, "{split}");
    }

    #[test]
    fn one_of_many_threads_compares() {
        let speeds = SpeedRatio::default();
        let due = |_| (0..1000).filter(|_| speeds.is_due()).count();
        let all: usize = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..4).map(|i| scope.spawn(move || due(i))).collect();
            threads.into_iter().map(|thread| thread.join().expect("a thread")).sum()
        });
        // Every second queue, as long as nothing is recorded.
        assert_eq!(all, 2000);
    }

    #[test]
    fn tree_after_an_edit_begins_with_what_is_known() {
        let speeds = SpeedRatio::default();
        run(&speeds, 1000, [200.0, 100.0]);
        let after = speeds.clone();
        assert_eq!(after.faster(0), 1);
        assert_eq!(run(&after, 2, [200.0, 100.0])[0], 1);
    }
}
