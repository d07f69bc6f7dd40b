//! Finds out which of two kernels is faster, by timing them on the rays at hand.
//!
//! The number of boxes per ray, the lanes in use and the like are poor predictors: their cost varies with the processor
//! and with the tree's place in memory. So now and then the slower kernel traces a queue, and its time is compared with
//! the other kernel's for the queues before and after, which are much alike. The hits do not depend on any of this.

/// The weight of a new measurement in an estimate.
const NEW: f32 = 0.4;
/// The number of queues between two comparisons: at first, and at most, if one kernel is ahead each time.
const TURNS: [u32; 2] = [4, 64];
/// A kernel whose speed-up exceeds this, as a logarithm, is ahead, or far ahead.
const AHEAD: f32 = 0.15;
const FAR_AHEAD: f32 = 0.6;
/// The most that one comparison counts, as a logarithm: a thread may have been interrupted.
const MOST: f32 = 0.7;

/// The compared speed of two kernels.
#[derive(Clone, Copy)]
pub(in crate::bvh) struct KernelTimer {
    /// The natural logarithm of the first kernel's time divided by the second's, once they have been compared.
    ratio: Option<f32>,
    /// The faster kernel's time per ray in the last queue.
    before: Option<f32>,
    /// The slower kernel's time per ray, if it has just had its turn.
    between: Option<f32>,
    /// The number of queues between comparisons, and those left before the next.
    turns: u32,
    left: u32,
}

impl KernelTimer {
    /// Takes the first kernel to be faster until they have been compared.
    pub const NEW: KernelTimer =
        KernelTimer { ratio: None, before: None, between: None, turns: TURNS[0], left: 0 };

    /// The kernel that is faster, as far as is known.
    pub fn faster(&self) -> usize {
        usize::from(self.ratio.is_some_and(|ratio| ratio > 0.0))
    }

    /// The kernel to run next.
    pub fn next(&self) -> usize {
        let is_turn = self.left == 0 && self.before.is_some() && self.between.is_none();
        self.faster() ^ usize::from(is_turn)
    }

    /// Records a kernel's time per ray, in any unit.
    pub fn record(&mut self, runner: usize, time: f32) {
        let faster = self.faster();
        let time = time.max(f32::MIN_POSITIVE);
        if runner != faster {
            match (self.ratio, self.before) {
                // The first comparison need not be exact, but should come soon.
                (None, Some(before)) => self.compare(time / before),
                _ => self.between = Some(time),
            }
            return;
        }
        self.left = self.left.saturating_sub(1);
        let before = self.before.replace(time);
        if let Some((before, between)) = before.zip(self.between.take()) {
            self.compare(between / (0.5 * (before + time)));
        }
    }

    /// Records the ratio of the slower kernel's time to the faster one's.
    fn compare(&mut self, times: f32) {
        let faster = self.faster();
        let ahead = times.ln().clamp(-MOST, MOST);
        let ratio = if faster == 0 { -ahead } else { ahead };
        let ratio = self.ratio.map_or(ratio, |before| before + NEW * (ratio - before));
        self.ratio = Some(ratio);
        // The other kernel is ahead now, and the recorded time is not its own.
        if self.faster() != faster {
            self.before = None;
        }
        self.turns = match ratio.abs() {
            far if far > FAR_AHEAD => (4 * self.turns).min(TURNS[1]),
            ahead if ahead > AHEAD => (2 * self.turns).min(TURNS[1]),
            _ => TURNS[0].max(self.turns / 2),
        };
        self.left = self.turns;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs the kernels for this many queues, with these times for each; returns the number of queues of each kernel.
    fn run(race: &mut KernelTimer, queues: u32, took: [f32; 2]) -> [u32; 2] {
        let mut runs = [0; 2];
        for queue in 0..queues {
            let runner = race.next();
            runs[runner] += 1;
            // The cost of queues rises and falls.
            race.record(runner, took[runner] * (1.5 + (queue as f32 * 0.1).sin()));
        }
        runs
    }

    #[test]
    fn faster_kernel_runs_most_queues_and_may_change() {
        let mut race = KernelTimer::NEW;
        let [_, second] = run(&mut race, 300, [100.0, 200.0]);
        assert!((4..12).contains(&second), "{second}");
        let [_, second] = run(&mut race, 500, [200.0, 100.0]);
        assert!(second > 250, "{second}");
    }

    #[test]
    fn equally_fast_kernels_are_compared_more_often() {
        let mut race = KernelTimer::NEW;
        let [_, second] = run(&mut race, 300, [100.0, 105.0]);
        assert!(second > 30, "{second}");
    }
}
