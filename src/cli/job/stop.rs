//! The rules that stop a render.

use std::time::{Duration, Instant};

use crate::render::Session;

/// The shortest time that a pass under way gets after the time limit.
const GRACE: Duration = Duration::from_secs(5);

/// Returns the time at which even a pass under way ends: as long again after the time limit, and at least [`GRACE`], so
/// that all pixels get equally many samples unless one sample of each takes that long.
pub fn deadline(begun: Instant, max_time: Option<Duration>) -> Option<Instant> {
    let max_time = max_time?;
    begun.checked_add(max_time.checked_add(max_time.max(GRACE))?)
}

/// The limits that stop a render.
#[derive(Clone, Copy, Default)]
pub struct StopLimits {
    /// The noise, as a fraction of the image's brightness.
    pub until: Option<f64>,
    /// The time.
    pub max_time: Option<Duration>,
}

/// The rules that stop a render between two passes, and their inputs.
pub struct StopRules {
    limits: StopLimits,
    begun: Instant,
    /// The number of samples at the beginning.
    already: u32,
}

/// Returns the sample at which a pass ends. The first passes are short, so that every pixel soon holds something worth
/// saving. The result depends only on the samples' numbers, so that the noise is checked at the same points as without
/// an interruption.
fn next_end(sample: u32) -> u32 {
    match sample {
        0 => 1,
        1..4 => 4,
        4.. => (sample / 16 + 1).saturating_mul(16),
    }
}

/// Returns the number of samples of the next pass.
pub fn pass_end(session: &Session) -> u32 {
    let next = session.next_sample().unwrap_or(0);
    next_end(next) - next
}

impl StopRules {
    /// Creates the requested rules; time counts from now.
    pub fn new(limits: StopLimits, session: &Session) -> StopRules {
        StopRules { limits, begun: Instant::now(), already: session.samples_done().0 }
    }

    /// Returns the rule that stops the render now, if any.
    pub fn holds(&self, session: &Session) -> Option<String> {
        let (done, _) = session.samples_done();
        let elapsed = self.begun.elapsed();
        if session.state().pass.is_some() || done == 0 {
            return None;
        }
        if let Some(limit) = self.limits.until
            && let Some(noise) = session.film().relative_noise().filter(|noise| *noise <= limit)
        {
            let (noise, limit) = (100.0 * noise, 100.0 * limit);
            return Some(format!("noise {noise:.2} %, at most {limit} %, after {done} samples"));
        }
        let limit = self.limits.max_time.filter(|limit| elapsed >= *limit)?;
        Some(format!(
            "time {:.1} s of {:.1} s, after {done} samples",
            elapsed.as_secs_f64(),
            limit.as_secs_f64()
        ))
    }

    /// Returns the time at which even a pass under way ends, if time is limited.
    pub fn deadline(&self) -> Option<Instant> {
        deadline(self.begun, self.limits.max_time)
    }

    /// Returns the rule that stopped a render within a pass, if that was its deadline.
    pub fn overdue(&self, session: &Session) -> Option<String> {
        let limit = self.limits.max_time.filter(|_| !session.is_done())?;
        self.deadline().filter(|deadline| Instant::now() >= *deadline)?;
        let (done, _) = session.samples_done();
        let (elapsed, limit) = (self.begun.elapsed().as_secs_f64(), limit.as_secs_f64());
        Some(format!("time {elapsed:.1} s of {limit:.1} s, within a pass, after {done} samples"))
    }

    /// Returns a message about a render that has all its samples, and more noise than was wanted.
    pub fn missed(&self, session: &Session) -> Option<String> {
        let limit = self.limits.until?;
        let noise = session.film().relative_noise().filter(|noise| *noise > limit && session.is_done())?;
        let (done, _) = session.samples_done();
        // The square of the noise is inversely proportional to the number of samples.
        let wanted = (f64::from(done) * (noise / limit).powi(2)).min(f64::from(u32::MAX));
        Some(format!(
            "--until: the noise is {:.2} %, not {} %, and all {done} samples are done (about {} are needed: --spp)",
            100.0 * noise,
            100.0 * limit,
            rounded_up(wanted)
        ))
    }

    /// Reduces a number of samples to those for which the time suffices, at least one.
    pub fn limit(&self, count: u32, session: &Session) -> u32 {
        let Some(limit) = self.limits.max_time else { return count };
        let done = session.samples_done().0.saturating_sub(self.already);
        if done == 0 {
            return count;
        }
        let each = self.begun.elapsed().as_secs_f64() / f64::from(done);
        let left = limit.saturating_sub(self.begun.elapsed()).as_secs_f64();
        count.min((left / each.max(1e-9)) as u32).max(1)
    }
}

/// Rounds an estimated count up to two digits.
fn rounded_up(count: f64) -> u64 {
    let step = 10_f64.powf((count.max(1.0).log10().floor() - 1.0).max(0.0));
    ((count / step).ceil() * step) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_are_rounded_up_to_two_digits() {
        assert_eq!([0.2, 9.1, 64.0, 1234.0, 98_765.0].map(rounded_up), [1, 10, 64, 1300, 99_000]);
    }

    #[test]
    fn passes_end_at_the_same_samples_wherever_they_begin() {
        let ends = |first: u32| {
            std::iter::successors(Some(first), |sample| Some(next_end(*sample)))
                .skip(1)
                .take(4)
                .collect::<Vec<_>>()
        };
        assert_eq!(ends(0), [1, 4, 16, 32]);
        assert_eq!(ends(2), [4, 16, 32, 48]);
        assert_eq!(ends(17), [32, 48, 64, 80]);
    }
}
