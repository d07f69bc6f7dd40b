//! Profiles: both schedules under equal conditions, and the flow through the stages of the wavefront.

pub mod capture;
pub mod counters;
pub mod flow;
pub mod page;
pub mod parts;
pub mod report;
pub mod roofline;
pub mod steps;

use std::sync::Arc;
use std::time::Instant;

use self::steps::{ProfileStep, steps};
use crate::integrator::{RayCounts, RayStatistics, RenderSetup, Schedule, Sorting, Stage, Stop};
use crate::render::{Options, Session, ThreadError, on_threads};
use crate::simd::Isa;

/// The parameters of a measurement.
#[derive(Clone, Copy, Debug)]
pub struct ProfilePlan {
    /// Samples per pixel.
    pub samples: u32,
    /// Measured runs of each step, at least 1.
    pub runs: u32,
    /// The number of threads; 0 for one per core.
    pub threads: usize,
    /// The number of paths in a wave.
    pub wave: usize,
    /// The instruction set.
    pub isa: Isa,
    /// Returns the process's CPU seconds so far; none if the system does not report them.
    pub cpu_seconds: fn() -> Option<f64>,
}

impl ProfilePlan {
    /// Returns the options to render with a schedule.
    pub fn options(&self, schedule: Schedule) -> Options {
        Options { schedule, wave: self.wave, isa: self.isa, ..Options::default() }
    }
}

/// The median, minimum and maximum of several measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The minimum.
    pub least: f64,
    /// The maximum.
    pub most: f64,
}

impl Spread {
    /// Computes the spread; none without measurements.
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

/// The times of a step.
#[derive(Clone, Debug)]
pub struct Timed {
    /// The step.
    pub step: ProfileStep,
    /// The options.
    pub options: Options,
    /// Wall-clock seconds.
    pub wall: Spread,
    /// CPU seconds of all threads, if the system reports them.
    pub cpu: Option<Spread>,
    /// Rays per run.
    pub rays: RayCounts,
    /// Paths that left the wave because forks outgrew it.
    pub spilled: u64,
    /// The hash of the film.
    pub hash: u128,
}

impl Timed {
    /// Returns millions of rays per second of wall-clock time, by the median.
    pub fn mrays_per_s(&self) -> f64 {
        self.rays.total() as f64 / self.wall.median.max(1e-9) / 1e6
    }

    /// Returns millions of rays per second of CPU time, by the median.
    pub fn mrays_per_cpu_s(&self) -> Option<f64> {
        self.cpu.map(|cpu| self.rays.total() as f64 / cpu.median.max(1e-9) / 1e6)
    }
}

/// Renders all [`steps()`] in turn, after one warm-up run of each, so that other load on the machine affects all alike.
pub fn time(
    setup: &Arc<RenderSetup>,
    plan: &ProfilePlan,
    progress: &mut (dyn FnMut(u32) + Send),
) -> Result<Vec<Timed>, ThreadError> {
    let steps = steps(setup, plan);
    on_threads(plan.threads, || {
        let mut runs: Vec<Vec<Measured>> = steps.iter().map(|_| Vec::new()).collect();
        for round in 0..=plan.runs.max(1) {
            // The steps take turns in going first.
            for turn in 0..steps.len() {
                let which = (turn + round as usize) % steps.len();
                let run = run(setup, plan, steps[which].1);
                if round > 0 {
                    runs[which].push(run);
                }
            }
            progress(round);
        }
        steps.iter().zip(&runs).map(|(step, runs)| summary(*step, runs)).collect()
    })
}

/// One rendering.
struct Measured {
    wall: f64,
    cpu: Option<f64>,
    statistics: RayStatistics,
    hash: u128,
}

fn run(setup: &Arc<RenderSetup>, plan: &ProfilePlan, options: Options) -> Measured {
    let mut session = Session::of(setup.clone(), plan.samples, options);
    let (start, cpu) = (Instant::now(), (plan.cpu_seconds)());
    session.advance(u32::MAX);
    let wall = start.elapsed().as_secs_f64();
    let cpu = cpu.zip((plan.cpu_seconds)()).map(|(before, after)| after - before);
    Measured { wall, cpu, statistics: *session.statistics(), hash: session.film().hash() }
}

fn summary((step, options): (ProfileStep, Options), runs: &[Measured]) -> Timed {
    let nothing = Spread { median: 0.0, least: 0.0, most: 0.0 };
    let (statistics, hash) = runs.last().map_or_else(Default::default, |run| (run.statistics, run.hash));
    Timed {
        step,
        options,
        wall: Spread::of(runs.iter().map(|run| run.wall)).unwrap_or(nothing),
        cpu: Spread::of(runs.iter().filter_map(|run| run.cpu)),
        rays: statistics.rays,
        spilled: statistics.spilled,
        hash,
    }
}

/// Times of the wavefront's stages on one thread.
#[derive(Clone, Copy, Debug)]
pub struct StageTimes {
    /// Seconds of each stage.
    pub seconds: [f64; Stage::ALL.len()],
    /// True for CPU seconds; false for wall-clock seconds, which are used if the system does not report CPU time.
    pub are_cpu: bool,
}

/// Renders with the wavefront on one thread and charges its time to the stages. Returns each stage's minimum over
/// several runs, since other load on the machine can only add time.
pub fn stage_times(setup: &Arc<RenderSetup>, plan: &ProfilePlan) -> Result<StageTimes, ThreadError> {
    on_threads(1, || {
        let (start, are_cpu) = (Instant::now(), (plan.cpu_seconds)().is_some());
        let now = || (plan.cpu_seconds)().unwrap_or_else(|| start.elapsed().as_secs_f64());
        let mut least = [f64::INFINITY; Stage::ALL.len()];
        for _ in 0..plan.runs.max(1) {
            let mut session = Session::of(setup.clone(), plan.samples, plan.options(Schedule::Wavefront));
            // Preparation before the samples belongs to no stage.
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

/// Returns the bytes of a worker's queues.
pub fn wave_bytes(setup: &RenderSetup, plan: &ProfilePlan) -> usize {
    crate::integrator::schedule::wavefront::wave::Wave::new(setup, plan.wave, Sorting::default()).bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_has_the_median_of_odd_and_even_counts() {
        assert_eq!(Spread::of([]), None);
        assert_eq!(Spread::of([3.0, 1.0, 2.0]), Some(Spread { median: 2.0, least: 1.0, most: 3.0 }));
        assert_eq!(Spread::of([4.0, 1.0]).map(|s| s.median), Some(2.5));
    }
}
