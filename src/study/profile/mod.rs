//! Where the time goes: both schedules under equal conditions, and what flows through the
//! stages of the wavefront.

pub mod counters;
pub mod flow;

use std::sync::Arc;
use std::time::Instant;

use crate::integrator::{RayCounts, RenderSetup, Schedule, Sorting, Stage, Stop};
use crate::render::{Options, Session, ThreadError, on_threads};
use crate::simd::Isa;

/// How to measure.
#[derive(Clone, Copy, Debug)]
pub struct ProfilePlan {
    /// Samples a pixel.
    pub samples: u32,
    /// Measured runs of each schedule, at least 1.
    pub runs: u32,
    /// Threads; 0 is one for each core.
    pub threads: usize,
    /// Paths of a wave.
    pub wave: usize,
    /// Instruction set.
    pub isa: Isa,
    /// CPU seconds of the process so far, where the system tells.
    pub cpu_seconds: fn() -> Option<f64>,
}

impl ProfilePlan {
    /// To render in a schedule.
    pub fn options(&self, schedule: Schedule) -> Options {
        Options { schedule, wave: self.wave, isa: self.isa, ..Options::default() }
    }
}

/// The middle of several measurements, the least and the most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Half of them are below.
    pub median: f64,
    /// The least.
    pub least: f64,
    /// The most.
    pub most: f64,
}

impl Spread {
    /// Of at least one measurement.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Spread> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let (least, most) = (*values.first()?, *values.last()?);
        let middle = values.len() / 2;
        let median =
            if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) };
        Some(Spread { median, least, most })
    }
}

/// One schedule's times.
#[derive(Clone, Debug)]
pub struct Timed {
    /// Which.
    pub schedule: Schedule,
    /// Wall-clock seconds.
    pub wall: Spread,
    /// Seconds of all threads, where the system tells.
    pub cpu: Option<Spread>,
    /// Rays of a run.
    pub rays: RayCounts,
    /// Forks that found no place in the wave.
    pub spilled: u64,
    /// Of the film.
    pub hash: u128,
}

impl Timed {
    /// Million rays a second of the clock, in the median.
    pub fn mrays_per_s(&self) -> f64 {
        self.rays.total() as f64 / self.wall.median.max(1e-9) / 1e6
    }

    /// Million rays a second of CPU time.
    pub fn mrays_per_cpu_s(&self) -> Option<f64> {
        self.cpu.map(|cpu| self.rays.total() as f64 / cpu.median.max(1e-9) / 1e6)
    }
}

/// Renders with both schedules in turn, after one run of each that does not count, so that
/// whatever else the machine does meets both alike.
pub fn time(
    setup: &Arc<RenderSetup>,
    plan: &ProfilePlan,
    progress: &mut (dyn FnMut(u32) + Send),
) -> Result<[Timed; 2], ThreadError> {
    const SCHEDULES: [Schedule; 2] = [Schedule::Wavefront, Schedule::Recursive];
    on_threads(plan.threads, || {
        let mut runs: [Vec<Measured>; 2] = [Vec::new(), Vec::new()];
        for round in 0..=plan.runs.max(1) {
            // Whichever was second goes first the next time.
            for turn in 0..2 {
                let which = (turn + round as usize) % 2;
                let run = run(setup, plan, SCHEDULES[which]);
                if round > 0 {
                    runs[which].push(run);
                }
            }
            progress(round);
        }
        [0, 1].map(|which| summary(SCHEDULES[which], &runs[which]))
    })
}

/// One rendering.
struct Measured {
    wall: f64,
    cpu: Option<f64>,
    session: Session,
}

fn run(setup: &Arc<RenderSetup>, plan: &ProfilePlan, schedule: Schedule) -> Measured {
    let mut session = Session::of(setup.clone(), plan.samples, plan.options(schedule));
    let (start, cpu) = (Instant::now(), (plan.cpu_seconds)());
    session.advance(u32::MAX);
    let wall = start.elapsed().as_secs_f64();
    let cpu = cpu.zip((plan.cpu_seconds)()).map(|(before, after)| after - before);
    Measured { wall, cpu, session }
}

fn summary(schedule: Schedule, runs: &[Measured]) -> Timed {
    let nothing = Spread { median: 0.0, least: 0.0, most: 0.0 };
    let (statistics, hash) = runs
        .last()
        .map_or_else(Default::default, |run| (*run.session.statistics(), run.session.film().hash()));
    Timed {
        schedule,
        wall: Spread::of(runs.iter().map(|run| run.wall)).unwrap_or(nothing),
        cpu: Spread::of(runs.iter().filter_map(|run| run.cpu)),
        rays: statistics.rays,
        spilled: statistics.spilled,
        hash,
    }
}

/// How long the stages of the wavefront take on one thread.
#[derive(Clone, Copy, Debug)]
pub struct StageTimes {
    /// Seconds of each.
    pub seconds: [f64; Stage::ALL.len()],
    /// True if these are seconds of the processor; if the system does not tell them, they are those of the clock.
    pub are_cpu: bool,
}

/// Renders with the wavefront on one thread and charges its time to the stages: the least of several runs, since what
/// else the machine does can only add to it.
pub fn stage_times(setup: &Arc<RenderSetup>, plan: &ProfilePlan) -> Result<StageTimes, ThreadError> {
    on_threads(1, || {
        let (start, are_cpu) = (Instant::now(), (plan.cpu_seconds)().is_some());
        let now = || (plan.cpu_seconds)().unwrap_or_else(|| start.elapsed().as_secs_f64());
        let mut least = [f64::INFINITY; Stage::ALL.len()];
        for _ in 0..plan.runs.max(1) {
            let mut session = Session::of(setup.clone(), plan.samples, plan.options(Schedule::Wavefront));
            // What is known before samples is no stage.
            session.prepare(&Stop::NEVER);
            let (mut seconds, mut last) = ([0.0; Stage::ALL.len()], now());
            session.time_stages(&mut |stage: Stage| {
                let time = now();
                seconds[stage as usize] += time - last;
                last = time;
            });
            least.iter_mut().zip(seconds).for_each(|(least, seconds)| *least = least.min(seconds));
        }
        StageTimes { seconds: least, are_cpu }
    })
}

/// Bytes of a worker's queues.
pub fn wave_bytes(setup: &RenderSetup, plan: &ProfilePlan) -> usize {
    crate::integrator::wavefront::Wave::new(setup, plan.wave, Sorting::default()).bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(Spread::of([]), None);
        assert_eq!(Spread::of([3.0, 1.0, 2.0]), Some(Spread { median: 2.0, least: 1.0, most: 3.0 }));
        assert_eq!(Spread::of([4.0, 1.0]).map(|s| s.median), Some(2.5));
    }
}
