//! The life of a pixel's samples: every vertex of every path, told by the recursive schedule.

pub mod json;
mod recipe;

use std::collections::HashMap;
use std::sync::Arc;

use crate::film::{Film, Region};
use crate::integrator::bounces::LobeKind;
use crate::integrator::observe::{Components, Continuation, Event, EventKind, PathKey};
use crate::integrator::path_event::PathEvent;
use crate::integrator::{RenderSetup, Schedule};
use crate::math::Hit;
use crate::render::{Options, Session};
use crate::scene::CompiledScene;
use crate::scene::emitters::EmitterSource;
use crate::world::{Transport, World};
pub use recipe::Recipe;

/// A sample from the camera to the ends of all its paths.
#[derive(Clone, Debug)]
pub struct Life {
    /// Which.
    pub sample: u32,
    /// Its paths: first the camera's, each fork behind the path that it comes from.
    pub paths: Vec<Followed>,
    /// What photons bring that have ended where the sample sees them directly, and how many.
    pub drawn: (Components, u32),
}

impl Life {
    /// What it adds to the film.
    pub fn radiance(&self) -> Components {
        let mut sum = self.drawn.0;
        for path in &self.paths {
            (0..3).for_each(|channel| sum[channel] += path.radiance[channel]);
        }
        sum
    }
}

/// A path to its end.
#[derive(Clone, Debug)]
pub struct Followed {
    /// 0 for the camera's path; for forks a hash, or under the path transport their bounces by kind.
    pub branch: u32,
    /// The path from which it was forked, and at which bounce.
    pub from: Option<(usize, u32)>,
    /// Its rays and what they met.
    pub steps: Vec<Step>,
    /// What it adds to the film.
    pub radiance: Components,
    /// If its group shares paths, what happens to the light found beyond the first vertex.
    pub shares: Option<Shares>,
    /// Why it went no further.
    pub why: Why,
    /// True once that is known.
    has_ended: bool,
}

/// What a sample has from its group of paths, and from its own.
#[derive(Clone, Copy, Debug)]
pub struct Shares {
    /// What the path has found up to the first vertex.
    pub before: Components,
    /// What its own path has found beyond that for it alone.
    pub own: Components,
    /// What the second vertices of the group send, its own among them.
    pub shared: Components,
    /// How many of them send anything.
    pub vertices: u32,
}

/// A ray and what it met.
#[derive(Clone, Debug)]
pub struct Step {
    /// Bounces so far.
    pub depth: u32,
    /// The queue in which the ray waited: that of the camera's, of reflected or of refracted rays.
    pub queue: &'static str,
    /// Where from.
    pub origin: Components,
    /// Where to.
    pub direction: Components,
    /// The part of what it finds that reaches the film.
    pub throughput: Components,
    /// What it met, if anything.
    pub vertex: Option<Vertex>,
}

/// A place on a surface.
#[derive(Clone, Debug)]
pub struct Vertex {
    /// Name of the entity.
    pub entity: String,
    /// Name of the material.
    pub material: String,
    /// Where on it.
    pub hit: Hit,
    /// In world space.
    pub position: Components,
    /// Of the surface itself, on the viewer's side.
    pub geometric_normal: Components,
    /// For shading.
    pub normal: Components,
    /// What the surface itself emits, as it reaches the film.
    pub own: Components,
    /// Under the path transport, the weight of the drawn direction that led here in finding that light: the rest is
    /// found by rays to lights.
    pub own_share: f32,
    /// What photons bring that have ended around it, under the path transport.
    pub gathered: Components,
    /// Rays to lights.
    pub lights: Vec<ExplainedLightRay>,
    /// What becomes of the path there, under the path transport.
    pub fate: Option<PathEvent>,
}

/// A ray to a light.
#[derive(Clone, Debug)]
pub struct ExplainedLightRay {
    /// Name of the light's entity.
    pub light: String,
    /// Which of its samples.
    pub which: u32,
    /// Where to.
    pub direction: Components,
    /// How far.
    pub distance: f32,
    /// What reaches the film if nothing is between.
    pub contribution: Components,
    /// What did reach it.
    pub arrived: Components,
    /// Under the path transport, the weight of finding the light this way; otherwise 1.
    pub share: f32,
    /// Whether something is.
    pub blocked: bool,
}

/// Why a path went no further.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// It met nothing.
    Escaped,
    /// The surface neither mirrors nor lets light through.
    Surface,
    /// It had all the bounces that it may have.
    Bounces,
    /// Too little would have been left of it.
    Weak,
    /// It had all the bounces of a kind that it may have.
    Limit(LobeKind),
    /// The surface is unlit: it shows its colour and ignores all light.
    Unlit,
    /// No direction could be drawn.
    Absorbed,
    /// Nothing would have been left of it.
    Black,
    /// It has lost at Russian roulette.
    Roulette,
}

impl Why {
    /// For programs.
    pub fn name(self) -> String {
        match self {
            Why::Limit(kind) => format!("{} limit", kind.name()),
            other => format!("{other:?}").to_lowercase(),
        }
    }

    /// For people.
    pub fn text(self) -> &'static str {
        match self {
            Why::Escaped => "it met nothing and sees the background",
            Why::Surface => "the surface neither mirrors nor lets light through",
            Why::Bounces => "it has had max_depth bounces",
            Why::Weak => "less than min_throughput would be left of it",
            Why::Limit(LobeKind::Diffuse) => "it has had diffuse_depth diffuse bounces",
            Why::Limit(LobeKind::Glossy) => "it has had glossy_depth glossy bounces",
            Why::Limit(LobeKind::Transmission) => "it has been through transmission_depth surfaces",
            Why::Unlit => "the surface is unlit: it shows its colour and answers no light",
            Why::Absorbed => "no direction could be drawn: the surface absorbs, or it led to the wrong side",
            Why::Black => "nothing would be left of what comes from the drawn direction",
            Why::Roulette => "it has lost at Russian roulette",
        }
    }
}

/// What names people gave.
pub struct GivenNames {
    entities: HashMap<u32, String>,
    lights: Vec<String>,
}

impl GivenNames {
    /// Those of a world.
    pub fn new(world: &World) -> GivenNames {
        GivenNames { entities: world.names(), lights: crate::compile::light_names(world) }
    }

    /// No names: things are called by their numbers.
    pub fn none() -> GivenNames {
        GivenNames { entities: HashMap::new(), lights: Vec::new() }
    }

    fn entity(&self, number: u32) -> String {
        self.entities.get(&number).cloned().unwrap_or_else(|| format!("entity {number}"))
    }

    fn light(&self, index: u32) -> String {
        self.lights.get(index as usize).cloned().unwrap_or_else(|| format!("light {index}"))
    }

    /// The name of an emitter under the path transport.
    fn emitter(&self, scene: &CompiledScene, emitter: u32) -> String {
        match scene.emitters.source(emitter) {
            EmitterSource::Light(light) => self.light(light),
            EmitterSource::Surface(primitive, instance) => {
                self.entity(scene.geometry.entity_of(primitive, instance))
            }
            EmitterSource::Environment => "the environment".into(),
        }
    }
}

/// Follows samples of a pixel. Returns them and the pixel's film.
pub fn explain(
    setup: Arc<RenderSetup>,
    names: &GivenNames,
    [x, y]: [u32; 2],
    samples: std::ops::Range<u32>,
) -> (Vec<Life>, Film) {
    let region = Region { x0: x, y0: y, x1: x + 1, y1: y + 1 };
    let options = Options { schedule: Schedule::Recursive, region: Some(region), ..Options::default() };
    let session = Session::of(setup.clone(), samples.end, options).with_samples(samples);
    let mut story =
        Story { setup: &setup, names, lives: Vec::new(), begun: HashMap::new(), waiting: Vec::new() };
    let film = session.observe(Some([x, y]), &mut |event| {
        // Those that share with it are rendered, too.
        if let Event::Sample(place, what) = event
            && place.pixel == (x, y)
        {
            story.tell(*place, what);
        }
    });
    (story.lives, film)
}

/// Turns events into lives.
struct Story<'a> {
    setup: &'a RenderSetup,
    names: &'a GivenNames,
    lives: Vec<Life>,
    /// For each path that continues from a vertex, how, and from which path.
    begun: HashMap<PathKey, (Continuation, usize)>,
    /// Forks of the path transport: at how many bounces, and from which path.
    waiting: Vec<(u32, usize)>,
}

impl Story<'_> {
    fn tell(&mut self, place: PathKey, what: &EventKind) {
        match what {
            EventKind::Ray { origin, direction, throughput, hit } => {
                let queue = self.begin(place);
                let (origin, direction, throughput) = (*origin, *direction, *throughput);
                let vertex = (!hit.is_miss()).then(|| self.vertex(*hit));
                let step = Step { depth: place.depth, queue, origin, direction, throughput, vertex };
                self.path().into_iter().for_each(|path| path.steps.push(step.clone()));
            }
            EventKind::Vertex { position, geometric_normal, normal, radiance } => {
                let before = self.path().map_or([0.0; 3], |path| path.radiance);
                if let Some(path) = self.path() {
                    path.radiance = *radiance;
                }
                if let Some(vertex) = self.last_vertex() {
                    vertex.position = *position;
                    vertex.geometric_normal = *geometric_normal;
                    vertex.normal = *normal;
                    vertex.own = [0, 1, 2].map(|channel| radiance[channel] - before[channel]);
                }
            }
            EventKind::Choice { emission_share, fate } => {
                if let Some(vertex) = self.last_vertex() {
                    (vertex.own_share, vertex.fate) = (*emission_share, Some(*fate));
                }
            }
            EventKind::Gathered { light } => {
                if let Some(vertex) = self.last_vertex() {
                    vertex.gathered = *light;
                    // By rounding, a little may be left of nothing.
                    let all = near(vertex.own, *light);
                    vertex.own = [0, 1, 2].map(|i| if all { 0.0 } else { vertex.own[i] - light[i] });
                }
            }
            EventKind::Drawn { light } => {
                if let Some(life) = self.lives.iter_mut().find(|life| life.sample == place.sample) {
                    life.drawn = (add(life.drawn.0, *light), life.drawn.1 + 1);
                }
            }
            EventKind::Light { light, share, which, direction, distance, contribution, .. } => {
                let light = match self.setup.transport {
                    Transport::Whitted => self.names.light(*light),
                    Transport::Path => self.names.emitter(&self.setup.scene, *light),
                };
                let (which, share, direction, distance) = (*which, *share, *direction, *distance);
                let (contribution, arrived, blocked) = (*contribution, [0.0; 3], false);
                let lit = ExplainedLightRay {
                    light,
                    which,
                    direction,
                    distance,
                    contribution,
                    arrived,
                    share,
                    blocked,
                };
                self.last_vertex().into_iter().for_each(|vertex| vertex.lights.push(lit.clone()));
            }
            EventKind::Shadow { blocked, radiance } => self.shadow(*blocked, *radiance),
            EventKind::Onward { way, .. } => {
                let from = self.lives.last().map_or(0, |life| life.paths.len().saturating_sub(1));
                self.begun.insert(place, (*way, from));
                // Forks wait on a stack while their path is followed to its end.
                if self.setup.transport == Transport::Path && *way == Continuation::Refract {
                    self.waiting.push((place.depth, from));
                }
            }
            EventKind::Aside => {
                if let Some(path) = self.path() {
                    if place.depth == 0 {
                        let nothing = [0.0; 3];
                        let (before, own, shared) = (path.radiance, nothing, nothing);
                        path.shares = Some(Shares { before, own, shared, vertices: 0 });
                    }
                    path.radiance = [0.0; 3];
                }
            }
            EventKind::Received { own, shared, vertices } => self.received(place, *own, *shared, *vertices),
            EventKind::End { radiance } => {
                let why = self.why(place);
                if let Some(path) = self.path() {
                    (path.radiance, path.why, path.has_ended) = (*radiance, why, true);
                }
            }
        }
    }

    /// Adds up what a path and its group have found for a sample.
    fn received(&mut self, place: PathKey, own: Components, shared: Components, vertices: u32) {
        let life = self.lives.iter_mut().find(|life| life.sample == place.sample);
        let Some(path) = life.and_then(|life| life.paths.first_mut()) else { return };
        let before = path.shares.map_or(path.radiance, |shares| shares.before);
        path.shares = Some(Shares { before, own, shared, vertices });
        path.radiance = add(add(before, own), shared);
    }

    /// What a ray to a light has brought; under the path transport, whose surfaces may let a part of
    /// it through, this is told by what the path has gathered with it.
    fn shadow(&mut self, blocked: bool, after: Option<Components>) {
        let before = self.path().map_or([0.0; 3], |path| path.radiance);
        let Some(lit) = self.last_vertex().and_then(|vertex| vertex.lights.last_mut()) else { return };
        lit.blocked = blocked;
        lit.arrived = match after {
            _ if blocked => [0.0; 3],
            Some(after) if !near(after, add(before, lit.contribution)) => {
                [0, 1, 2].map(|channel| after[channel] - before[channel])
            }
            _ => lit.contribution,
        };
        let after = after.unwrap_or(add(before, lit.arrived));
        self.path().into_iter().for_each(|path| path.radiance = after);
    }

    /// Begins a new sample or path, if the ray does not belong to the current one. Returns the queue in which it waited.
    fn begin(&mut self, place: PathKey) -> &'static str {
        if self.lives.last().is_none_or(|life| life.sample != place.sample) {
            self.lives.push(Life { sample: place.sample, paths: Vec::new(), drawn: ([0.0; 3], 0) });
        }
        let begun = self.begun.get(&place);
        let mut from = begun.map(|(_, from)| (*from, place.depth.saturating_sub(1)));
        let mut queue = match begun {
            None => "camera",
            Some((Continuation::Reflect, _)) => "reflect",
            Some((Continuation::Refract, _)) => "refract",
            Some((Continuation::Scatter, _)) => "scatter",
        };
        let Some(life) = self.lives.last_mut() else { return queue };
        let follows = match self.setup.transport {
            Transport::Whitted => life.paths.last().is_some_and(|path| path.branch == place.branch),
            // Under the path transport a branch counts bounces.
            Transport::Path => life.paths.last().is_some_and(|path| !path.has_ended),
        };
        if self.setup.transport == Transport::Path {
            let fork = if follows { None } else { self.waiting.pop() };
            if let Some((depth, parent)) = fork {
                (from, queue) = (Some((parent, depth.saturating_sub(1))), "refract");
            } else if begun.is_some() {
                queue = "scatter";
            }
        }
        if !follows {
            let (branch, steps) = (place.branch, Vec::new());
            life.paths.push(Followed {
                branch,
                from,
                steps,
                radiance: [0.0; 3],
                shares: None,
                why: Why::Escaped,
                has_ended: false,
            });
        }
        queue
    }

    fn path(&mut self) -> Option<&mut Followed> {
        self.lives.last_mut().and_then(|life| life.paths.last_mut())
    }

    fn last_vertex(&mut self) -> Option<&mut Vertex> {
        self.path()?.steps.last_mut()?.vertex.as_mut()
    }

    /// What is known of a hit before it has been looked up.
    fn vertex(&self, hit: Hit) -> Vertex {
        let scene = &self.setup.scene;
        let material = scene.geometry.material_of(hit.primitive, hit.instance);
        let name = scene.material_names.get(material as usize);
        Vertex {
            entity: self.names.entity(scene.geometry.entity_of(hit.primitive, hit.instance)),
            material: name.cloned().unwrap_or_else(|| format!("material {material}")),
            hit,
            position: [0.0; 3],
            geometric_normal: [0.0; 3],
            normal: [0.0; 3],
            own: [0.0; 3],
            own_share: 1.0,
            gathered: [0.0; 3],
            lights: Vec::new(),
            fate: None,
        }
    }

    /// Why the path ends here.
    fn why(&mut self, place: PathKey) -> Why {
        let Some(vertex) = self.last_vertex() else { return Why::Escaped };
        let hit = vertex.hit;
        if let Some(fate) = vertex.fate {
            return self.why_of(fate, place);
        }
        let scene = &self.setup.scene;
        let material = scene.geometry.material_of(hit.primitive, hit.instance) as usize;
        let classic = &scene.materials[material].classic;
        if classic.kr.is_black() && classic.ior <= 0.0 {
            Why::Surface
        } else if place.depth >= self.setup.max_depth {
            Why::Bounces
        } else {
            Why::Weak
        }
    }

    /// The same under the path transport.
    fn why_of(&self, fate: PathEvent, place: PathKey) -> Why {
        match fate {
            PathEvent::Last => {
                let reached = self.setup.limits.and_then(|limits| limits.reached(place.branch));
                reached.map_or(Why::Bounces, Why::Limit)
            }
            PathEvent::Unlit => Why::Unlit,
            PathEvent::Absorbed => Why::Absorbed,
            PathEvent::Black => Why::Black,
            PathEvent::Scattered { .. } | PathEvent::Straight | PathEvent::Drawn { .. } => Why::Roulette,
        }
    }
}

fn add(a: Components, b: Components) -> Components {
    [0, 1, 2].map(|channel| a[channel] + b[channel])
}

/// Equal but for the rounding of a sum.
fn near(a: Components, b: Components) -> bool {
    (0..3).all(|channel| (a[channel] - b[channel]).abs() <= 1e-6 * a[channel].abs())
}

#[cfg(test)]
mod tests;
