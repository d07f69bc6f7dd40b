//! Captures one queue of the wavefront: its rays, which can then be traced again by themselves, and their hits.

use std::collections::BTreeSet;
use std::mem::take;
use std::sync::Arc;

use super::ProfilePlan;
use crate::bvh::{self, Coherence, Stack};
use crate::formats::rays::HitRecord;
use crate::integrator::observe::{Event, EventKind};
use crate::integrator::{RenderSetup, Schedule, Stage};
use crate::math::Vec3;
use crate::query::{HitBatch, RayBatch};
use crate::render::Session;

/// A traced queue, in the order of tracing.
#[derive(Clone, Debug, Default)]
pub struct CapturedQueue {
    /// The rays, relative to the origin of the compiled scene.
    pub rays: RayBatch,
    /// The number of rays after each number of bounces.
    pub rays_by_bounce: Vec<u32>,
    /// The hits of the rays; of shadow rays only whether they are blocked.
    pub hits: Vec<HitRecord>,
    /// The queue's number among those of its stage, from 1.
    pub number: usize,
}

impl CapturedQueue {
    /// The number of rays after a number of bounces, or after any.
    fn rays_after(&self, bounces: Option<usize>) -> usize {
        let all = self.rays.len();
        bounces.map_or(all, |bounces| self.rays_by_bounce.get(bounces).map_or(0, |count| *count as usize))
    }

    fn push(&mut self, bounces: u32, origin: [f32; 3], direction: [f32; 3], t_max: f32) {
        let bounces = bounces as usize;
        if self.rays_by_bounce.len() <= bounces {
            self.rays_by_bounce.resize(bounces + 1, 0);
        }
        self.rays_by_bounce[bounces] += 1;
        self.rays.push(Vec3::from(origin), Vec3::from(direction), 0.0, t_max);
    }
}

/// All queues of a stage, of which the fullest is held.
#[derive(Clone, Debug)]
pub struct StageCapture {
    stage: Stage,
    bounces: Option<usize>,
    /// The queue being traced.
    current: CapturedQueue,
    /// The queue with the most rays after the given number of bounces; of equals the first.
    pub fullest: CapturedQueue,
    /// The number of queues.
    pub queues: usize,
    /// The numbers of bounces after which the stage traces rays.
    pub all_bounces: BTreeSet<usize>,
}

impl StageCapture {
    /// Renders with the wavefront on this thread and captures the queues of a stage that traces rays.
    pub fn new(
        setup: &Arc<RenderSetup>,
        plan: &ProfilePlan,
        stage: Stage,
        bounces: Option<usize>,
    ) -> StageCapture {
        let session = Session::of(setup.clone(), plan.samples, plan.options(Schedule::Wavefront));
        let nothing = CapturedQueue::default();
        let mut capture = StageCapture {
            stage,
            bounces,
            current: nothing.clone(),
            fullest: nothing,
            queues: 0,
            all_bounces: BTreeSet::new(),
        };
        session.observe(None, &mut |event| capture.take(event));
        capture
    }

    fn take(&mut self, event: &Event) {
        let current = &mut self.current;
        match (self.stage, event) {
            (Stage::Intersect, Event::Sample(key, EventKind::Ray { origin, direction, hit, .. })) => {
                current.push(key.depth, *origin, *direction, f32::INFINITY);
                current.hits.push(HitRecord::new(hit));
            }
            (Stage::Shadow, Event::Sample(key, EventKind::Light { origin, direction, distance, .. })) => {
                current.push(key.depth, *origin, *direction, *distance);
            }
            (Stage::Shadow, Event::Sample(_, EventKind::Shadow { blocked, .. })) => {
                current.hits.push(HitRecord::any(*blocked));
            }
            (stage, Event::Wave(flow)) if flow.stage == stage => self.end_queue(),
            _ => {}
        }
    }

    fn end_queue(&mut self) {
        let queue = CapturedQueue { number: self.queues + 1, ..take(&mut self.current) };
        if queue.rays.is_empty() {
            return;
        }
        self.queues += 1;
        let counts = queue.rays_by_bounce.iter().enumerate();
        self.all_bounces.extend(counts.filter(|(_, rays)| **rays > 0).map(|(bounces, _)| bounces));
        if queue.rays_after(self.bounces) > self.fullest.rays_after(self.bounces) {
            self.fullest = queue;
        }
    }

    /// Traces the fullest queue by itself, as `rayfront trace` does: without an any-hit filter.
    pub fn replay(&self, setup: &RenderSetup, plan: &ProfilePlan) -> Vec<HitRecord> {
        let (bvh, rays) = (&setup.scene.bvh, &self.fullest.rays);
        let stack = &mut Stack::new(bvh);
        if self.stage == Stage::Shadow {
            let mut blocked = vec![0; rays.len()];
            bvh::any(plan.isa, bvh, rays.rays(), Coherence::Unknown, stack, &mut blocked);
            return blocked.iter().map(|blocked| HitRecord::any(*blocked != 0)).collect();
        }
        let mut hits = HitBatch::new(rays.len());
        bvh::closest(plan.isa, bvh, rays.rays(), Coherence::Unknown, stack, hits.hits_mut());
        hits.iter().map(|hit| HitRecord::new(&hit)).collect()
    }
}
