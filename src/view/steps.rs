//! A wave of the wavefront schedule, one stage after another: its rays as lines over the image, the lanes that shade its
//! hits, and the lengths of its queues.

use std::collections::BTreeSet;
use std::mem::take;

use serde_json::{Value, json};

use super::explanation::far;
use super::id_colors::material_color;
use super::lines::{ImageLines, in_tenths};
use super::viewer::Snapshot;
use crate::film::Region;
use crate::integrator::observe::{Components, Continuation, Event, EventKind, Flow, Observer, PathKey};
use crate::integrator::schedule::wavefront::material_ranges::MaterialRanges;
use crate::integrator::{RenderSetup, Schedule, Sorting, Stage};
use crate::math::Vec3;
use crate::render::{Options, Session};
use crate::world::Transport;

/// The width and height of the block of pixels that the wave renders: a multiple of the blocks of path reuse.
const BLOCK: u32 = 32;
/// The largest number of paths in the wave: a quarter of a block's, so that others take the places of those that end.
/// Path reuse takes as many at least.
const MOST_PATHS: usize = (BLOCK * BLOCK / 4) as usize;
/// The largest number of steps that are sent, and of rays that are traced for them.
const MOST_STEPS: usize = 300;
const MOST_RAYS: u64 = 1 << 18;

/// Returns the steps of the wave that renders the block of pixels around a place.
pub fn steps(shown: &Snapshot, place: [u32; 2]) -> Value {
    let setup = &shown.setup;
    let (options, region) = options(shown.options, setup.size, place);
    let session = Session::of(setup.clone(), shown.wanted.max(1), options);
    let recorder = record(setup, session, options, far(shown));
    let materials = recorder.materials.iter().map(|material| {
        let name = setup.scene.material_names.get(*material as usize);
        json!([material, name, material_color(*material)])
    });
    json!({
        "generation": shown.generation,
        "region": [region.x0, region.y0, region.x1, region.y1],
        "width": options.isa.lanes(),
        "transport": setup.transport,
        "materials": materials.collect::<Vec<_>>(),
        "is_complete": !recorder.is_cut,
        "steps": recorder.steps,
    })
}

/// The options with which the wave around a place is rendered, and its block.
fn options(shown: Options, size: [u32; 2], place: [u32; 2]) -> (Options, Region) {
    let region = block(size, place);
    let wave = shown.wave.min(MOST_PATHS);
    let options = Options { schedule: Schedule::Wavefront, region: Some(region), tile: BLOCK, wave, ..shown };
    (options, region)
}

/// Records the steps of the first sample of all pixels of a session.
fn record(setup: &RenderSetup, session: Session, options: Options, far: f32) -> Recorder<'_> {
    let mut recorder = Recorder::new(setup, options, far);
    session.with_samples(0..1).observe_by(None, &mut recorder);
    if !recorder.is_cut {
        recorder.end_turn(0);
    }
    recorder
}

/// The block of pixels that contains a place, or the last one.
fn block([width, height]: [u32; 2], [x, y]: [u32; 2]) -> Region {
    let start = |at: u32, size: u32| at.min(size.saturating_sub(1)) / BLOCK * BLOCK;
    let (x0, y0) = (start(x, width), start(y, height));
    Region { x0, y0, x1: (x0 + BLOCK).min(width), y1: (y0 + BLOCK).min(height) }
}

/// A ray of the wave.
struct WaveRay {
    key: PathKey,
    ends: [Vec3; 2],
    /// The material that it hits, if any.
    material: Option<u32>,
}

/// A ray to a light.
struct TracedLightRay {
    ends: [Vec3; 2],
    is_blocked: bool,
}

/// The items of queues at the end of a step.
#[derive(Clone, Copy, Debug, Default)]
struct QueueLengths {
    /// Paths of the wave.
    wave: usize,
    /// Rays to lights.
    shadow: usize,
    /// Paths that go on.
    next: usize,
    /// Paths that have forked off.
    forks: usize,
    /// Forks that wait for a place in the wave.
    waiting: usize,
}

/// Makes steps of a wave's events.
struct Recorder<'a> {
    setup: &'a RenderSetup,
    lines: ImageLines<'a>,
    far: f32,
    width: usize,
    /// The orders in which hits are shaded: sorted by material, and as they come.
    orders: [MaterialRanges; 2],
    turn: usize,
    /// The rays that have been traced since the last stage ended.
    found: Vec<WaveRay>,
    /// All rays of this turn.
    rays: Vec<WaveRay>,
    lights: Vec<TracedLightRay>,
    /// The number of rays to lights whose result is known.
    traced: usize,
    queues: QueueLengths,
    capacity: usize,
    /// True until the wave has gone through all stages once more.
    is_in_turn: bool,
    /// The paths that have ended in this turn.
    ended: usize,
    /// All materials that rays have hit.
    materials: BTreeSet<u32>,
    steps: Vec<Value>,
    /// True if there are more steps.
    is_cut: bool,
}

impl Observer for Recorder<'_> {
    fn is_active(&self) -> bool {
        true
    }

    fn report(&mut self, event: &Event) {
        self.take(event);
    }

    fn stops(&mut self, rays: u64) -> bool {
        self.is_cut |= self.steps.len() == MOST_STEPS || rays > MOST_RAYS;
        self.is_cut
    }
}

impl<'a> Recorder<'a> {
    fn new(setup: &'a RenderSetup, options: Options, far: f32) -> Self {
        let order = |sorting| MaterialRanges::new(MOST_PATHS, setup.scene.materials.len(), sorting);
        Self {
            setup,
            lines: ImageLines::new(setup),
            far,
            width: options.isa.lanes(),
            orders: [order(Sorting::ByMaterial), order(Sorting::Unsorted)],
            turn: 0,
            found: Vec::new(),
            rays: Vec::new(),
            lights: Vec::new(),
            traced: 0,
            queues: QueueLengths::default(),
            capacity: 0,
            is_in_turn: false,
            ended: 0,
            materials: BTreeSet::new(),
            steps: Vec::new(),
            is_cut: false,
        }
    }

    fn take(&mut self, event: &Event) {
        let along = |origin: &Components, direction: &Components, length: f32| {
            let origin = Vec3::from(*origin);
            [origin, origin + Vec3::from(*direction) * length.min(self.far)]
        };
        match event {
            Event::Sample(key, EventKind::Ray { origin, direction, hit, .. }) => {
                let geometry = &self.setup.scene.geometry;
                let material = (!hit.is_miss()).then(|| geometry.material_of(hit.primitive, hit.instance));
                let length = if hit.is_miss() { self.far } else { hit.t };
                self.found.push(WaveRay { key: *key, ends: along(origin, direction, length), material });
            }
            Event::Sample(_, EventKind::Light { origin, direction, distance, .. }) => {
                let ends = along(origin, direction, *distance);
                self.lights.push(TracedLightRay { ends, is_blocked: false });
            }
            Event::Sample(_, EventKind::Shadow { blocked, .. }) => {
                if let Some(ray) = self.lights.get_mut(self.traced) {
                    ray.is_blocked = *blocked;
                }
                self.traced += 1;
            }
            Event::Sample(_, EventKind::Onward { way: Continuation::Refract, .. }) => self.queues.forks += 1,
            Event::Sample(_, EventKind::Onward { .. }) => self.queues.next += 1,
            Event::Sample(_, EventKind::End { .. }) => self.ended += 1,
            Event::Sample(..) => {}
            Event::Wave(flow) => self.end_stage(flow),
        }
    }

    fn end_stage(&mut self, flow: &Flow) {
        if self.steps.len() == MOST_STEPS {
            return;
        }
        match flow.stage {
            Stage::Intersect => {
                let rays = take(&mut self.found);
                let new = rays.iter().filter(|ray| ray.key.depth == 0).count();
                self.end_turn(rays.len() - new);
                (self.rays, self.is_in_turn) = (rays, true);
                (self.capacity, self.queues.wave) = (flow.capacity, flow.entering);
                if new > 0 {
                    self.step(Stage::Generate, [new, new], json!({}));
                }
                let hits = self.rays.iter().filter_map(|ray| ray.material);
                self.materials.extend(hits.clone());
                let traced = [flow.entering, hits.count()];
                let rays: Vec<Value> = self.rays.iter().map(|ray| self.ray(ray)).collect();
                self.step(Stage::Intersect, traced, json!({"rays": rays}));
            }
            Stage::Retire => {
                self.queues.wave = flow.leaving;
                let lanes: Vec<Option<u32>> = self.rays.iter().map(|ray| ray.material).collect();
                self.step(Stage::Retire, [flow.entering, flow.leaving], json!({"items": lanes}));
            }
            Stage::Shade => {
                self.queues.shadow = self.lights.len();
                let hits: Vec<u32> = self.rays.iter().filter_map(|ray| ray.material).collect();
                let [sorted, unsorted] = self.orders.each_mut().map(|order| {
                    order.sort(&hits);
                    let groups = order.lane_groups(self.width);
                    groups.map(|(material, places)| json!([material, places.len()])).collect::<Vec<_>>()
                });
                let more = json!({"items": hits, "sorted": sorted, "unsorted": unsorted.len()});
                self.step(Stage::Shade, [flow.entering, flow.leaving], more);
            }
            Stage::Shadow => {
                let lights = take(&mut self.lights);
                if lights.is_empty() {
                    return;
                }
                if self.setup.transport == Transport::Whitted {
                    self.queues.shadow = lights.len();
                    self.step(Stage::Light, [self.queues.wave, lights.len()], json!({}));
                }
                let rays: Vec<Value> = lights.iter().map(|ray| self.light_ray(ray)).collect();
                (self.queues.shadow, self.traced) = (0, 0);
                self.step(Stage::Shadow, [flow.entering, flow.leaving], json!({"rays": rays}));
            }
            Stage::Connect => {
                self.end_turn(0);
                self.step(Stage::Connect, [flow.entering, flow.leaving], json!({}));
            }
            Stage::Generate | Stage::Light | Stage::Photons | Stage::Advance => {}
        }
    }

    /// Ends a turn through the stages, after which so many paths go on in the wave; the others wait.
    fn end_turn(&mut self, going_on: usize) {
        if !take(&mut self.is_in_turn) {
            return;
        }
        let QueueLengths { next, forks, waiting, .. } = self.queues;
        let waiting = (next + forks + waiting).saturating_sub(going_on);
        self.queues = QueueLengths { wave: going_on, waiting, ..QueueLengths::default() };
        let ended = take(&mut self.ended);
        self.step(Stage::Advance, [ended + next + forks, next + forks], json!({"ended": ended}));
        self.turn += 1;
    }

    fn step(&mut self, stage: Stage, [entering, leaving]: [usize; 2], more: Value) {
        if self.steps.len() == MOST_STEPS {
            return;
        }
        let QueueLengths { wave, shadow, next, forks, waiting } = self.queues;
        let mut step = json!({
            "stage": stage.name(),
            "turn": self.turn,
            "entering": entering,
            "leaving": leaving,
            "capacity": self.capacity,
            "queues": {"wave": wave, "shadow": shadow, "next": next, "forks": forks, "waiting": waiting},
        });
        if let (Some(all), Value::Object(more)) = (step.as_object_mut(), more) {
            all.extend(more);
        }
        self.steps.push(step);
    }

    /// The material that a ray hits, its depth, and its lines; of a camera's ray, its pixel.
    fn ray(&self, WaveRay { key, ends, material }: &WaveRay) -> Value {
        let lines = match key.depth {
            0 => {
                let (x, y) = (f64::from(key.pixel.0) + 0.5, f64::from(key.pixel.1) + 0.5);
                json!([[x, y, x, y]])
            }
            _ => in_tenths(&self.lines.draw([*ends])),
        };
        json!([material, key.depth, lines])
    }

    fn light_ray(&self, TracedLightRay { ends, is_blocked }: &TracedLightRay) -> Value {
        json!([u8::from(*is_blocked), in_tenths(&self.lines.draw([*ends]))])
    }
}

#[cfg(test)]
mod tests;
