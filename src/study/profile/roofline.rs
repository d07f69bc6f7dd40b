//! The work of stages beside the machine's limits: operations and bytes per second (Williams et al., "Roofline",
//! Communications of the ACM, 2009).

use std::hint::black_box;
use std::time::Instant;

use super::flow::Flows;
use super::{ProfilePlan, StageTimes};
use crate::bvh::kernels::counters::Visits;
use crate::bvh::layout::{BLOCK, Node, TriangleBlock, WIDTH};
use crate::integrator::Stage;
use crate::render::{ThreadError, on_threads};
use crate::simd::{Float, Isa, Kernel, Lanes, dispatch};

/// Operations of a box: a subtraction and a multiplication for each of its six planes, six minima and maxima, a
/// comparison.
const OF_BOX: usize = 19;
/// Operations of a triangle that the ray misses: nine differences, twelve to shear the corners, nine of the edge
/// functions, four minima and maxima, two comparisons. One that is hit takes about twice as many.
const OF_TRIANGLE: usize = 36;
/// Floats of the larger buffer for copies: 128 MiB with its copy, more than most caches hold.
const LARGE: usize = 16 << 20;
/// Sums that are computed side by side, more than units for them and the latency of an operation ask for.
const CHAINS: usize = 12;

/// The most that one core can do, as measured.
#[derive(Clone, Copy, Debug)]
pub struct Ceilings {
    /// Operations per second: multiplications and additions that do not depend on each other.
    pub operations: f64,
    /// Bytes read and written per second by copies of arrays as large as the queues.
    pub queues: f64,
    /// Bytes read and written per second by copies of arrays that exceed most caches.
    pub memory: f64,
}

/// The work of a stage.
#[derive(Clone, Copy, Debug)]
pub struct StageWork {
    /// The stage.
    pub stage: Stage,
    /// Seconds on one thread.
    pub seconds: f64,
    /// Bytes of queues, and for tracing those of nodes and primitives, as often as they are needed.
    pub bytes: u64,
    /// Additions, multiplications, minima and comparisons, at least; known of tracing only.
    pub operations: Option<u64>,
}

impl StageWork {
    /// Operations for each byte.
    pub fn intensity(&self) -> Option<f64> {
        let operations = self.operations.filter(|operations| *operations > 0)?;
        (self.bytes > 0).then(|| operations as f64 / self.bytes as f64)
    }
}

/// Returns the work of all stages.
pub fn work(flows: &Flows, times: &StageTimes) -> [StageWork; Stage::ALL.len()] {
    let mut visits = [Visits::default(); 2];
    for bounce in &flows.bounces {
        visits[0].add(bounce.visits);
        visits[1].add(bounce.shadow_visits);
    }
    Stage::ALL.map(|stage| {
        let traced = match stage {
            Stage::Intersect => Some(&visits[0]),
            Stage::Shadow => Some(&visits[1]),
            _ => None,
        };
        StageWork {
            stage,
            seconds: times.seconds[stage as usize],
            bytes: flows.stages[stage as usize].bytes + traced.map_or(0, bytes),
            operations: traced.map(operations),
        }
    })
}

fn operations(visits: &Visits) -> u64 {
    visits.nodes * (WIDTH * OF_BOX) as u64 + visits.primitives * OF_TRIANGLE as u64
}

fn bytes(visits: &Visits) -> u64 {
    visits.nodes * size_of::<Node>() as u64 + visits.primitives * (size_of::<TriangleBlock>() / BLOCK) as u64
}

/// Measures what one core can do; takes about a second. `queues` is the size of the queues in bytes.
pub fn ceilings(plan: &ProfilePlan, queues: usize) -> Result<Ceilings, ThreadError> {
    on_threads(1, || Ceilings {
        operations: most_operations(plan.isa),
        // An array and its copy.
        queues: copied_bytes(queues / 2 / size_of::<f32>()),
        memory: copied_bytes(LARGE),
    })
}

/// The largest speed of several attempts of about 40 ms: other load can only slow them down.
fn best(mut work: impl FnMut() -> f64) -> f64 {
    let attempt = |work: &mut dyn FnMut() -> f64| {
        let (start, mut done) = (Instant::now(), 0.0);
        while start.elapsed().as_millis() < 40 {
            done += work();
        }
        done / start.elapsed().as_secs_f64()
    };
    (0..5).map(|_| attempt(&mut work)).fold(0.0, f64::max)
}

fn copied_bytes(floats: usize) -> f64 {
    let (from, mut to) = (vec![1.0f32; floats.max(1)], vec![0.0f32; floats.max(1)]);
    best(|| {
        to.copy_from_slice(black_box(&from));
        black_box(&mut to);
        2.0 * size_of_val(&from[..]) as f64
    })
}

fn most_operations(isa: Isa) -> f64 {
    let rounds = 100_000;
    best(|| {
        let width = black_box(dispatch(isa, MultiplyAndAdd { rounds }));
        (2 * CHAINS * width * rounds) as f64
    })
}

/// Multiplies and adds; returns the number of lanes.
struct MultiplyAndAdd {
    rounds: usize,
}

impl Kernel for MultiplyAndAdd {
    type Output = usize;
    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let factor = L::Queue::splat(black_box(0.5));
        let summand = L::Queue::splat(black_box(1.0));
        let mut sums = [L::Queue::one(); CHAINS];
        for _ in 0..self.rounds {
            for sum in &mut sums {
                *sum = *sum * factor + summand;
            }
        }
        let mut lanes = [0.0; 16];
        for sum in sums {
            sum.store(&mut lanes);
            black_box(&lanes);
        }
        L::Queue::WIDTH
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_of_tracing_is_that_of_its_visits() {
        let visits = Visits { nodes: 10, leaves: 3, primitives: 4, instances: 1 };
        assert_eq!(operations(&visits), 10 * 16 * 19 + 4 * 36);
        assert_eq!(bytes(&visits), 10 * 512 + 4 * 40);
    }

    #[test]
    fn machines_can_do_something() {
        let plan = ProfilePlan {
            samples: 1,
            runs: 1,
            threads: 1,
            wave: 16,
            isa: Isa::detect(),
            cpu_seconds: || None,
        };
        let Ceilings { operations, queues, memory } = ceilings(&plan, 1 << 20).unwrap();
        assert!(operations > 1e6 && queues > 1e6 && memory > 1e6, "{operations} {queues} {memory}");
    }
}
