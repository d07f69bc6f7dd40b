//! Hardware performance counters by stage, where the kernel permits reading them.

use std::sync::Arc;

use super::ProfilePlan;
use crate::integrator::RenderSetup;
use crate::integrator::Stage;
use crate::render::ThreadError;

/// Values of the processor's counters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Cycles.
    pub cycles: u64,
    /// Completed instructions.
    pub instructions: u64,
    /// Reads that missed the last-level cache.
    pub cache_misses: u64,
    /// Mispredicted branches.
    pub branch_misses: u64,
}

impl Counts {
    #[cfg(target_os = "linux")]
    fn since(self, before: Counts) -> Counts {
        Counts {
            cycles: self.cycles.saturating_sub(before.cycles),
            instructions: self.instructions.saturating_sub(before.instructions),
            cache_misses: self.cache_misses.saturating_sub(before.cache_misses),
            branch_misses: self.branch_misses.saturating_sub(before.branch_misses),
        }
    }

    #[cfg(target_os = "linux")]
    fn add(&mut self, other: Counts) {
        self.cycles += other.cycles;
        self.instructions += other.instructions;
        self.cache_misses += other.cache_misses;
        self.branch_misses += other.branch_misses;
    }
}

/// Counts of one rendering with each schedule on one thread.
#[derive(Clone, Copy, Debug)]
pub struct Counted {
    /// Counts of each stage of the wavefront.
    pub stages: [Counts; Stage::ALL.len()],
    /// Counts of the whole recursive schedule.
    pub recursive: Counts,
}

/// Counts both schedules, or returns a short reason why that is not possible.
pub fn count(setup: &Arc<RenderSetup>, plan: &ProfilePlan) -> Result<Result<Counted, String>, ThreadError> {
    // Counters count the thread that opens them.
    crate::render::on_threads(1, || here::count(setup, plan))
}

#[cfg(target_os = "linux")]
mod here {
    use std::io;
    use std::sync::Arc;

    use perf_event::events::Hardware;
    use perf_event::{Builder, Counter, Group};

    use super::super::ProfilePlan;
    use super::{Counted, Counts};
    use crate::integrator::{RenderSetup, Schedule, Stage, Stop};
    use crate::render::Session;

    pub(super) fn count(setup: &Arc<RenderSetup>, plan: &ProfilePlan) -> Result<Counted, String> {
        let refused = |error: io::Error| match error.kind() {
            io::ErrorKind::NotFound => "this processor, or the virtual machine, has none to read".to_owned(),
            io::ErrorKind::PermissionDenied => {
                "the kernel does not let this program read them: set kernel.perf_event_paranoid to 2 or less"
                    .to_owned()
            }
            _ => format!("they cannot be read: {error}"),
        };
        let mut counters = Counters::new().map_err(refused)?;
        let mut stages = [Counts::default(); Stage::ALL.len()];
        let mut failure = None;
        let mut wavefront = Session::of(setup.clone(), plan.samples, plan.options(Schedule::Wavefront));
        wavefront.prepare(&Stop::NEVER);
        let mut last = counters.read().map_err(refused)?;
        wavefront.time_stages(&mut |stage: Stage| match counters.read() {
            Ok(now) => {
                stages[stage as usize].add(now.since(last));
                last = now;
            }
            Err(error) => failure = Some(error),
        });
        if let Some(error) = failure {
            return Err(refused(error));
        }
        let mut session = Session::of(setup.clone(), plan.samples, plan.options(Schedule::Recursive));
        let before = counters.read().map_err(refused)?;
        session.advance(u32::MAX);
        let recursive = counters.read().map_err(refused)?.since(before);
        if recursive.cycles == 0 || recursive.instructions == 0 {
            return Err("this processor, or the virtual machine, has none to read".into());
        }
        Ok(Counted { stages, recursive })
    }

    /// Four counters that run as a group.
    struct Counters {
        group: Group,
        cycles: Counter,
        instructions: Counter,
        cache_misses: Counter,
        branch_misses: Counter,
    }

    impl Counters {
        fn new() -> io::Result<Counters> {
            let mut group = Group::new()?;
            let mut add = |event: Hardware| group.add(&Builder::new(event));
            let cycles = add(Hardware::CPU_CYCLES)?;
            let instructions = add(Hardware::INSTRUCTIONS)?;
            let cache_misses = add(Hardware::CACHE_MISSES)?;
            let branch_misses = add(Hardware::BRANCH_MISSES)?;
            group.enable()?;
            Ok(Counters { group, cycles, instructions, cache_misses, branch_misses })
        }

        fn read(&mut self) -> io::Result<Counts> {
            let counts = self.group.read()?;
            Ok(Counts {
                cycles: counts[&self.cycles],
                instructions: counts[&self.instructions],
                cache_misses: counts[&self.cache_misses],
                branch_misses: counts[&self.branch_misses],
            })
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod here {
    use std::sync::Arc;

    use super::super::ProfilePlan;
    use super::Counted;
    use crate::integrator::RenderSetup;

    pub(super) fn count(_: &Arc<RenderSetup>, _: &ProfilePlan) -> Result<Counted, String> {
        Err("they are read on Linux only".into())
    }
}
