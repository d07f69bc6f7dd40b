//! Flow through the wavefront: rays by bounce, items by stage, and the cost of rays.

use std::collections::HashMap;
use std::sync::Arc;

use smallvec::SmallVec;

use super::parts::{PartCosts, PartCounter, tests};
use super::{ProfilePlan, StageTimes};
use crate::bvh::kernels::counters::Visits;
use crate::integrator::observe::visits::VisitCounter;
use crate::integrator::observe::{Continuation, Event, EventKind, Flow, PathKey};
use crate::integrator::photons::map::Photon;
use crate::integrator::schedule::wavefront::queue::{HIT_BYTES, PATH_BYTES};
use crate::integrator::schedule::wavefront::shadow_queue::SHADOW_BYTES;
use crate::integrator::schedule::wavefront::vertices::VERTEX_BYTES;
use crate::integrator::{RenderSetup, Schedule, Stage};
use crate::render::{Options, Session};
use crate::world::Transport;

/// Rays with the same number of preceding bounces.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bounce {
    /// Rays from the camera.
    pub camera: u64,
    /// Mirror reflections.
    pub reflect: u64,
    /// Rays transmitted through surfaces.
    pub refract: u64,
    /// Rays in directions sampled by the path transport.
    pub scatter: u64,
    /// The number of rays that hit something.
    pub hits: u64,
    /// Rays to lights from the hits.
    pub shadow: u64,
    /// The number of rays to lights that were blocked.
    pub blocked: u64,
    /// The number of paths that ended.
    pub ends: u64,
    /// The traversal cost of the closest hits, each ray traced by itself.
    pub visits: Visits,
    /// The traversal cost of the rays to lights.
    pub shadow_visits: Visits,
}

impl Bounce {
    /// Returns the number of rays without those to lights.
    pub fn rays(&self) -> u64 {
        self.camera + self.reflect + self.refract + self.scatter
    }
}

/// Items that went through a stage.
#[derive(Clone, Copy, Debug, Default)]
pub struct StageFlow {
    /// The number of times it ran.
    pub calls: u64,
    /// The number of items that entered.
    pub entering: u64,
    /// The number of items that left.
    pub leaving: u64,
    /// The capacity of the queue, summed over the runs.
    pub room: u64,
    /// The number of lanes in a group.
    pub width: usize,
    /// The number of groups by their number of lanes that went on.
    pub lanes: [u64; 17],
    /// Bytes of queues read and written, by the sizes of their items.
    pub bytes: u64,
}

impl StageFlow {
    /// Returns how full the queue was, from 0 to 1; none for a queue without a limit.
    pub fn fill(&self) -> Option<f64> {
        ratio(self.entering, self.room)
    }

    /// Returns the fraction of lanes that hold an item: below 1 only because of each run's last group. None if the
    /// stage does not process items in groups.
    pub fn occupied(&self) -> Option<f64> {
        ratio(self.entering, self.all_lanes())
    }

    /// Returns the fraction of lanes whose item goes on; none as for [`StageFlow::occupied`].
    pub fn active(&self) -> Option<f64> {
        ratio(self.leaving, self.all_lanes())
    }

    fn all_lanes(&self) -> u64 {
        self.lanes.iter().sum::<u64>() * self.width as u64
    }

    fn add(&mut self, flow: &Flow) {
        self.calls += 1;
        self.entering += flow.entering as u64;
        self.leaving += flow.leaving as u64;
        self.room += flow.capacity as u64;
        self.width = flow.width;
        for (sum, more) in self.lanes.iter_mut().zip(flow.lanes) {
            *sum += u64::from(more);
        }
    }
}

/// Returns `part / whole`; none if the whole is 0.
fn ratio(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

/// The flow through all stages.
#[derive(Clone, Debug, Default)]
pub struct Flows {
    /// Rays by their number of bounces.
    pub bounces: Vec<Bounce>,
    /// Items by stage, in order.
    pub stages: [StageFlow; Stage::ALL.len()],
    /// The items that entered each stage that reports them, each time that the wave went through the stages.
    pub turns: Vec<[u32; Stage::ALL.len()]>,
    /// The costs of entities and materials.
    pub parts: PartCosts,
}

impl Flows {
    /// The seconds of stages by bounce, about: those of tracing in proportion to nodes and tests, those of other stages
    /// in proportion to their items. Photons belong to no bounce.
    pub fn seconds_by_bounce(&self, times: &StageTimes) -> Vec<[f64; Stage::ALL.len()]> {
        let weight = |bounce: &Bounce, stage: Stage| match stage {
            Stage::Generate => bounce.camera,
            Stage::Intersect => tests(&bounce.visits),
            Stage::Retire => bounce.rays(),
            Stage::Shade | Stage::Advance => bounce.hits,
            Stage::Light => bounce.shadow,
            Stage::Shadow | Stage::Connect => tests(&bounce.shadow_visits),
            Stage::Photons => 0,
        };
        let all =
            Stage::ALL.map(|stage| self.bounces.iter().map(|bounce| weight(bounce, stage)).sum::<u64>());
        let seconds = |bounce: &Bounce, stage: Stage| {
            let part = ratio(weight(bounce, stage), all[stage as usize]);
            times.seconds[stage as usize] * part.unwrap_or(0.0)
        };
        self.bounces.iter().map(|bounce| Stage::ALL.map(|stage| seconds(bounce, stage))).collect()
    }
}

/// Renders once more with the wavefront, on one thread, and counts.
pub fn count(setup: &Arc<RenderSetup>, plan: &ProfilePlan) -> Flows {
    of_region(setup, plan.options(Schedule::Wavefront), plan.samples)
}

/// Renders a region of the image again, on one thread, and counts.
pub fn of_region(setup: &Arc<RenderSetup>, options: Options, samples: u32) -> Flows {
    let session = Session::of(setup.clone(), samples, options);
    let mut counter = FlowCounter {
        visits: VisitCounter::new(&setup.scene.bvh),
        ways: HashMap::new(),
        parts: PartCounter::new(&setup.scene),
        flows: Flows::default(),
    };
    session.observe(None, &mut |event| counter.take(event));
    let mut flows = Flows { parts: counter.parts.costs, ..counter.flows };
    complete(&mut flows, setup.transport);
    flows
}

struct FlowCounter<'a> {
    visits: VisitCounter<'a>,
    /// The continuations that led to pending paths.
    ways: HashMap<PathKey, SmallVec<[Continuation; 1]>>,
    parts: PartCounter<'a>,
    flows: Flows,
}

impl FlowCounter<'_> {
    fn take(&mut self, event: &Event) {
        let (place, what) = match event {
            Event::Wave(flow) => {
                if flow.stage == Stage::Shade {
                    self.parts.shaded();
                }
                self.turn(flow);
                return self.flows.stages[flow.stage as usize].add(flow);
            }
            Event::Sample(place, what) => (*place, what),
        };
        let depth = place.depth as usize;
        if self.flows.bounces.len() <= depth {
            self.flows.bounces.resize(depth + 1, Bounce::default());
        }
        let visits = self.visits.of(what).unwrap_or_default();
        self.parts.take(place, what, visits);
        match what {
            EventKind::Ray { hit, .. } => {
                let way = self.way(place);
                let bounce = &mut self.flows.bounces[depth];
                match way {
                    None => bounce.camera += 1,
                    Some(Continuation::Reflect) => bounce.reflect += 1,
                    Some(Continuation::Refract) => bounce.refract += 1,
                    Some(Continuation::Scatter) => bounce.scatter += 1,
                }
                bounce.hits += u64::from(!hit.is_miss());
                bounce.visits.add(visits);
            }
            EventKind::Light { .. } => {
                let bounce = &mut self.flows.bounces[depth];
                bounce.shadow += 1;
                bounce.shadow_visits.add(visits);
            }
            EventKind::Shadow { blocked, .. } => self.flows.bounces[depth].blocked += u64::from(*blocked),
            EventKind::Onward { way, .. } => self.ways.entry(place).or_default().push(*way),
            EventKind::End { .. } => self.flows.bounces[depth].ends += 1,
            EventKind::LampFound { .. }
            | EventKind::Vertex { .. }
            | EventKind::Choice { .. }
            | EventKind::Gathered { .. }
            | EventKind::Drawn { .. }
            | EventKind::Spilled
            | EventKind::Received { .. } => {}
        }
    }

    /// Counts the items of a stage; tracing is the first stage to report in each turn.
    fn turn(&mut self, flow: &Flow) {
        let turns = &mut self.flows.turns;
        if flow.stage == Stage::Intersect || turns.is_empty() {
            turns.push([0; Stage::ALL.len()]);
        }
        if let Some(last) = turns.last_mut() {
            last[flow.stage as usize] += flow.entering as u32;
        }
    }

    /// Returns the continuation that led to a path; paths of several forks may share a key.
    fn way(&mut self, place: PathKey) -> Option<Continuation> {
        let ways = self.ways.get_mut(&place)?;
        let way = ways.pop();
        if ways.is_empty() {
            self.ways.remove(&place);
        }
        way
    }
}

/// Bytes of a ray's columns, of a colour's, and of a number's.
const RAY: usize = 32;
const COLOR: usize = 12;
const NUMBER: usize = 4;

/// Adds the stages that report nothing themselves, and bytes by the sizes of queue items.
fn complete(flows: &mut Flows, transport: Transport) {
    let sum = |what: fn(&Bounce) -> u64| flows.bounces.iter().map(what).sum::<u64>();
    let (camera, onward) = (sum(|b| b.camera), sum(|b| b.reflect + b.refract + b.scatter));
    let shade = flows.stages[Stage::Shade as usize];
    let generate = &mut flows.stages[Stage::Generate as usize];
    (generate.calls, generate.entering, generate.leaving) = (shade.calls, camera, camera);
    let advance = &mut flows.stages[Stage::Advance as usize];
    (advance.calls, advance.entering, advance.leaving) = (shade.calls, shade.entering, onward);
    // Bytes per item that enters, and per item that leaves.
    let costs = |stage: Stage| match stage {
        Stage::Generate => (2 * NUMBER, PATH_BYTES),
        Stage::Intersect => (RAY + HIT_BYTES, 0),
        Stage::Retire => (PATH_BYTES + HIT_BYTES, PATH_BYTES + HIT_BYTES),
        Stage::Shade if transport == Transport::Path => (PATH_BYTES + HIT_BYTES + COLOR + 2 * NUMBER, 0),
        Stage::Shade => (PATH_BYTES + HIT_BYTES + VERTEX_BYTES + COLOR + NUMBER, 0),
        Stage::Light => (PATH_BYTES + VERTEX_BYTES, SHADOW_BYTES),
        Stage::Shadow => (RAY + 2 * NUMBER, 3 * COLOR),
        Stage::Connect => (RAY + 2 * NUMBER, COLOR),
        Stage::Photons => (2 * PATH_BYTES + HIT_BYTES, size_of::<Photon>()),
        Stage::Advance => (NUMBER, 2 * PATH_BYTES + 2 * COLOR),
    };
    for stage in Stage::ALL {
        let (come, go) = costs(stage);
        let flow = &mut flows.stages[stage as usize];
        flow.bytes = flow.entering * come as u64 + flow.leaving * go as u64;
    }
    // Shading writes a path for each continuation, of which an item may have two; under the path transport it also
    // writes the rays to lights.
    let lit = if transport == Transport::Path { sum(|b| b.shadow) } else { 0 };
    let written = onward * PATH_BYTES as u64 + lit * SHADOW_BYTES as u64;
    flows.stages[Stage::Shade as usize].bytes += written;
}
