//! Which of two kernels is faster, found out by the clock on the rays at hand.
//!
//! Boxes for each ray, lanes in use and the like say little: what they cost differs from processor to processor, and
//! with where the tree lies in memory. So now and then the slower kernel answers a queue, and is compared with what
//! the other one took for the queues before and after it, which are much alike. The answers do not depend on any of
//! this.

/// The part of an estimate that a new measurement makes up.
const NEW: f32 = 0.4;
/// Queues between two comparisons: at first, and the most, if one is ahead each time.
const TURNS: [u32; 2] = [4, 64];
/// A kernel that is this many times as fast, as a logarithm, is ahead, or far ahead.
const AHEAD: f32 = 0.15;
const FAR_AHEAD: f32 = 0.6;
/// The most that one comparison counts for, as a logarithm: a thread may have been interrupted.
const MOST: f32 = 0.7;

/// Two kernels, and how they compare.
#[derive(Clone, Copy)]
pub(super) struct KernelTimer {
    /// Natural logarithm of how many times as long the first one takes, if they have been compared.
    ratio: Option<f32>,
    /// What the faster one took for a ray of the last queue.
    before: Option<f32>,
    /// The same of the slower one, if that was its turn.
    between: Option<f32>,
    /// Queues before the next comparison.
    turns: u32,
    left: u32,
}

impl KernelTimer {
    /// The first one is taken to be faster until they have been compared.
    pub const NEW: KernelTimer =
        KernelTimer { ratio: None, before: None, between: None, turns: TURNS[0], left: 0 };

    /// The one that is faster, as far as is known.
    pub fn faster(&self) -> usize {
        usize::from(self.ratio.is_some_and(|ratio| ratio > 0.0))
    }

    /// Which one answers next.
    pub fn next(&self) -> usize {
        let is_turn = self.left == 0 && self.before.is_some() && self.between.is_none();
        self.faster() ^ usize::from(is_turn)
    }

    /// What one of them took for a ray, in whatever unit.
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

    /// Records how many times as long as the other one the slower one took.
    fn compare(&mut self, times: f32) {
        let faster = self.faster();
        let ahead = times.ln().clamp(-MOST, MOST);
        let ratio = if faster == 0 { -ahead } else { ahead };
        let ratio = self.ratio.map_or(ratio, |before| before + NEW * (ratio - before));
        self.ratio = Some(ratio);
        // The other one is ahead now, and what is known of the last queue is not its own.
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

    /// Has them answer this many queues, for each of which they take these times; returns how many each of them got.
    fn run(race: &mut KernelTimer, queues: u32, took: [f32; 2]) -> [u32; 2] {
        let mut runs = [0; 2];
        for queue in 0..queues {
            let runner = race.next();
            runs[runner] += 1;
            // Queues become dearer and cheaper again.
            race.record(runner, took[runner] * (1.5 + (queue as f32 * 0.1).sin()));
        }
        runs
    }

    #[test]
    fn the_faster_one_runs_and_may_change() {
        let mut race = KernelTimer::NEW;
        let [_, second] = run(&mut race, 300, [100.0, 200.0]);
        assert!((4..12).contains(&second), "{second}");
        let [_, second] = run(&mut race, 500, [200.0, 100.0]);
        assert!(second > 250, "{second}");
    }

    #[test]
    fn who_is_as_fast_is_compared_more_often() {
        let mut race = KernelTimer::NEW;
        let [_, second] = run(&mut race, 300, [100.0, 105.0]);
        assert!(second > 30, "{second}");
    }
}
