//! A record of a pixel's samples with every vertex of every path, rendered by the recursive schedule.

pub mod json;
mod recipe;
mod sums;
mod why;

use std::collections::HashMap;
use std::sync::Arc;

use self::sums::{add, near, rest};
use crate::film::{Film, Region};
use crate::integrator::observe::decision::PathEvent;
use crate::integrator::observe::{Components, Continuation, Event, EventKind, PathKey};
use crate::integrator::{RenderSetup, Schedule};
use crate::math::{DVec3, Hit, Vec3};
use crate::render::{Options, Session};
use crate::scene::CompiledScene;
use crate::scene::emitters::EmitterSource;
use crate::world::{Transport, World};
pub use recipe::Recipe;
pub use why::Why;

/// A sample, from the camera to the ends of all its paths.
#[derive(Clone, Debug)]
pub struct SampleTrace {
    /// The point of world space that positions are relative to (see [`CompiledScene::origin`]).
    pub origin: DVec3,
    /// The number of the sample.
    pub sample: u32,
    /// The camera's path, followed by the forks, each after the path that it split off from.
    pub paths: Vec<Followed>,
    /// The radiance of photons that the sample sees directly, and their number.
    pub drawn: (Components, u32),
}

impl SampleTrace {
    /// Returns a position in world space.
    pub fn in_world(&self, position: Components) -> [f64; 3] {
        (self.origin + Vec3::from_array(position).as_dvec3()).to_array()
    }

    /// Returns the radiance that the sample adds to the film.
    pub fn radiance(&self) -> Components {
        let mut sum = self.drawn.0;
        for path in &self.paths {
            (0..3).for_each(|channel| sum[channel] += path.radiance[channel]);
        }
        sum
    }
}

/// A path, up to its end.
#[derive(Clone, Debug)]
pub struct Followed {
    /// 0 for the camera's path; for forks a hash, or under the path transport their numbers of bounces by kind.
    pub branch: u32,
    /// The index of the path that it split off from, and the bounce.
    pub from: Option<(usize, u32)>,
    /// Its rays and the vertices that they hit.
    pub steps: Vec<Step>,
    /// The radiance that it adds to the film.
    pub radiance: Components,
    /// The light found beyond the first vertex, if the path's group reuses paths.
    pub shares: Option<Shares>,
    /// The reason why the path ended.
    pub why: Why,
    /// True once the path has ended.
    has_ended: bool,
}

/// The light of a sample under path reuse: from its own path, and from its group.
#[derive(Clone, Copy, Debug)]
pub struct Shares {
    /// The radiance found up to the first vertex.
    pub before: Components,
    /// The radiance that its own path found beyond the first vertex and that is not given to others.
    pub own: Components,
    /// The radiance given by the group's second vertices, its own included.
    pub shared: Components,
    /// The number of second vertices that give any radiance.
    pub vertices: u32,
}

/// A ray and its hit.
#[derive(Clone, Debug)]
pub struct Step {
    /// The number of bounces before this ray.
    pub depth: u32,
    /// The kind of ray, which is also the queue that held it: camera, reflect, refract or scatter.
    pub queue: &'static str,
    /// The ray's origin.
    pub origin: Components,
    /// The ray's direction.
    pub direction: Components,
    /// The fraction of the radiance found along the ray that reaches the film.
    pub throughput: Components,
    /// The lamps without a surface that it finds on the way.
    pub lamps: Vec<ExplainedLamp>,
    /// The vertex at the hit; none for a miss.
    pub vertex: Option<Vertex>,
}

/// A lamp without a surface that a path's ray finds.
#[derive(Clone, Debug)]
pub struct ExplainedLamp {
    /// The name of the light's entity.
    pub light: String,
    /// The distance from where the ray's direction was drawn.
    pub distance: f32,
    /// The radiance that reaches the film.
    pub found: Components,
    /// The MIS weight of the direction; rays to lights have the rest.
    pub share: f32,
}

/// A vertex on a surface.
#[derive(Clone, Debug)]
pub struct Vertex {
    /// The name of the entity.
    pub entity: String,
    /// The name of the material.
    pub material: String,
    /// The hit.
    pub hit: Hit,
    /// The position in world space.
    pub position: Components,
    /// The normal of the geometry, on the viewer's side.
    pub geometric_normal: Components,
    /// The shading normal.
    pub normal: Components,
    /// The radiance that the surface itself emits, attenuated as it reaches the film.
    pub own: Components,
    /// Under the path transport, the MIS weight of the sampled direction that hit the emitter here; rays to lights have
    /// the rest.
    pub own_share: f32,
    /// The radiance of photons gathered around the vertex, under the path transport.
    pub gathered: Components,
    /// The rays to lights.
    pub lights: Vec<ExplainedLightRay>,
    /// The path's event at the vertex, under the path transport.
    pub fate: Option<PathEvent>,
}

/// A ray to a light.
#[derive(Clone, Debug)]
pub struct ExplainedLightRay {
    /// The name of the light's entity.
    pub light: String,
    /// The number of the light's sample.
    pub which: u32,
    /// The direction to the light.
    pub direction: Components,
    /// The distance to the light.
    pub distance: f32,
    /// The radiance that reaches the film if the light is visible.
    pub contribution: Components,
    /// The radiance that did reach it.
    pub arrived: Components,
    /// The MIS weight of the ray under the path transport; otherwise 1.
    pub share: f32,
    /// True if the light is blocked.
    pub blocked: bool,
}

/// Names of entities and lights as given in the scene.
pub struct GivenNames {
    entities: HashMap<u32, String>,
    lights: Vec<String>,
}

impl GivenNames {
    /// Returns the names of a world.
    pub fn new(world: &World) -> GivenNames {
        GivenNames { entities: world.names(), lights: crate::compile::light_names(world) }
    }

    /// Returns no names: entities and lights are called by their numbers.
    pub fn none() -> GivenNames {
        GivenNames { entities: HashMap::new(), lights: Vec::new() }
    }

    fn entity(&self, number: u32) -> String {
        self.entities.get(&number).cloned().unwrap_or_else(|| format!("entity {number}"))
    }

    fn light(&self, index: u32) -> String {
        self.lights.get(index as usize).cloned().unwrap_or_else(|| format!("light {index}"))
    }

    /// Returns the name of an emitter under the path transport.
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

/// Traces samples of a pixel again. Returns their records and the pixel's film.
pub fn explain(
    setup: Arc<RenderSetup>,
    names: &GivenNames,
    [x, y]: [u32; 2],
    samples: std::ops::Range<u32>,
) -> (Vec<SampleTrace>, Film) {
    let region = Region { x0: x, y0: y, x1: x + 1, y1: y + 1 };
    let options = Options { schedule: Schedule::Recursive, region: Some(region), ..Options::default() };
    let session = Session::of(setup.clone(), samples.end, options).with_samples(samples);
    let mut story =
        Story { setup: &setup, names, lives: Vec::new(), begun: HashMap::new(), waiting: Vec::new() };
    let film = session.observe(Some([x, y]), &mut |event| {
        // The pixels that reuse paths together with this one are rendered, too.
        if let Event::Sample(place, what) = event
            && place.pixel == (x, y)
        {
            story.tell(*place, what);
        }
    });
    (story.lives, film)
}

/// Collects events into records of samples.
struct Story<'a> {
    setup: &'a RenderSetup,
    names: &'a GivenNames,
    lives: Vec<SampleTrace>,
    /// The kind of continuation and the index of the path, for each path that continues from a vertex.
    begun: HashMap<PathKey, (Continuation, usize)>,
    /// Pending forks of the path transport: the depth and the index of the path.
    waiting: Vec<(u32, usize)>,
}

impl Story<'_> {
    fn tell(&mut self, place: PathKey, what: &EventKind) {
        match what {
            EventKind::Ray { origin, direction, throughput, hit } => {
                let queue = self.begin(place);
                let (origin, direction, throughput) = (*origin, *direction, *throughput);
                let vertex = (!hit.is_miss()).then(|| self.vertex(*hit));
                let depth = place.depth;
                let step = Step { depth, queue, origin, direction, throughput, lamps: Vec::new(), vertex };
                self.path().into_iter().for_each(|path| path.steps.push(step.clone()));
            }
            EventKind::LampFound { emitter, distance, share, light: found, radiance } => {
                let light = self.names.emitter(&self.setup.scene, *emitter);
                self.found(
                    ExplainedLamp { light, distance: *distance, found: *found, share: *share },
                    *radiance,
                );
            }
            EventKind::Vertex { position, geometric_normal, normal, radiance } => {
                self.evaluated([*position, *geometric_normal, *normal], *radiance);
            }
            EventKind::Choice { emission_mis_weight, fate } => {
                if let Some(vertex) = self.last_vertex() {
                    (vertex.own_share, vertex.fate) = (*emission_mis_weight, Some(*fate));
                }
            }
            EventKind::Gathered { light } => {
                let sum = self.path().map_or([0.0; 3], |path| path.radiance);
                if let Some(vertex) = self.last_vertex() {
                    vertex.gathered = *light;
                    vertex.own = rest(vertex.own, *light, sum);
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
                // Forks are on a stack until their path has ended.
                if self.setup.transport == Transport::Path && *way == Continuation::Refract {
                    self.waiting.push((place.depth, from));
                }
            }
            EventKind::Spilled => {
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

    /// Stores the position and the normals of a vertex, and what it emits, by the path's radiance.
    fn evaluated(&mut self, [position, geometric_normal, normal]: [Components; 3], radiance: Components) {
        let Some(path) = self.path() else { return };
        let before = std::mem::replace(&mut path.radiance, radiance);
        if let Some(vertex) = self.last_vertex() {
            (vertex.position, vertex.geometric_normal, vertex.normal) = (position, geometric_normal, normal);
            vertex.own = rest(radiance, before, radiance);
        }
    }

    /// Stores a lamp that a path has found on its way, with the path's radiance.
    fn found(&mut self, lamp: ExplainedLamp, radiance: Components) {
        let Some(path) = self.path() else { return };
        path.radiance = radiance;
        path.steps.last_mut().into_iter().for_each(|step| step.lamps.push(lamp.clone()));
    }

    /// Sums what the path itself and its group found for a sample.
    fn received(&mut self, place: PathKey, own: Components, shared: Components, vertices: u32) {
        let life = self.lives.iter_mut().find(|life| life.sample == place.sample);
        let Some(path) = life.and_then(|life| life.paths.first_mut()) else { return };
        let before = path.shares.map_or(path.radiance, |shares| shares.before);
        path.shares = Some(Shares { before, own, shared, vertices });
        path.radiance = add(add(before, own), shared);
    }

    /// Stores the result of a ray to a light. Under the path transport, surfaces may transmit a fraction of the light:
    /// it is the difference in the radiance gathered by the path.
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

    /// Starts a new sample or path, unless the ray continues the current one. Returns the name of the ray's queue.
    fn begin(&mut self, place: PathKey) -> &'static str {
        if self.lives.last().is_none_or(|life| life.sample != place.sample) {
            let origin = self.setup.scene.origin;
            let drawn = ([0.0; 3], 0);
            self.lives.push(SampleTrace { origin, sample: place.sample, paths: Vec::new(), drawn });
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

    /// Returns the vertex of a hit; the surface's attributes follow with the next event.
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

    /// Returns the reason why the path ends here.
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

    /// Returns the reason why a path ends, under the path transport.
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

#[cfg(test)]
mod tests;
