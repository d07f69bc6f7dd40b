//! Looking on while rays are traced: what happens to each sample, stage by stage, in words
//! that do not depend on the schedule.

use super::Stage;
use super::path::{Path, unpack_pixel};
use super::path_event::{Decision, PathEvent};
use crate::math::{Color, Hit, Ray, Vector};

/// Receives reports of what happens.
pub trait Observer {
    /// Whether anyone is listening. If not, nothing is reported.
    fn is_active(&self) -> bool;
    /// Something has happened.
    fn report(&mut self, event: &Event);
    /// The wave has finished a stage, to which the time since the last mark belongs.
    fn mark(&mut self, _: Stage) {}
    /// Whether to end within the tile, of which nothing is of any use then. It is asked before each wave or after some
    /// hundred rays, with the number of rays of the tile.
    fn stops(&mut self, _rays: u64) -> bool {
        false
    }
}

/// Listens to nothing, but stops when another one does.
pub struct Spilled<'a>(pub &'a mut dyn Observer);

impl Observer for Spilled<'_> {
    fn is_active(&self) -> bool {
        false
    }
    fn report(&mut self, _: &Event) {}
    fn stops(&mut self, rays: u64) -> bool {
        self.0.stops(rays)
    }
}

/// Nobody is listening.
pub struct NoObserver;

impl Observer for NoObserver {
    fn is_active(&self) -> bool {
        false
    }
    fn report(&mut self, _: &Event) {}
}

/// Passes every event on.
pub struct FnObserver<'a>(pub &'a mut dyn FnMut(&Event));

impl Observer for FnObserver<'_> {
    fn is_active(&self) -> bool {
        true
    }
    fn report(&mut self, event: &Event) {
        (self.0)(event);
    }
}

/// Somebody looks at the clock after each stage of the wave, and at nothing else.
pub struct Timekeeper<F>(pub F);

impl<F: FnMut(Stage)> Observer for Timekeeper<F> {
    fn is_active(&self) -> bool {
        false
    }
    fn report(&mut self, _: &Event) {}
    fn mark(&mut self, stage: Stage) {
        (self.0)(stage);
    }
}

/// What an observer is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// Something happened to a sample.
    Sample(PathKey, EventKind),
    /// The wave has gone through a stage.
    Wave(Flow),
}

/// Which part of a sample: a path and how many bounces it has behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PathKey {
    /// Column and row of the pixel.
    pub pixel: (u32, u32),
    /// Which of its samples.
    pub sample: u32,
    /// See [`Path::bounce_counts`].
    pub branch: u32,
    /// Bounces so far.
    pub depth: u32,
}

impl PathKey {
    /// The key of a path.
    pub fn of(path: &Path<f32>) -> PathKey {
        PathKey {
            pixel: unpack_pixel(path.pixel.0),
            sample: path.sample.0,
            branch: path.bounce_counts.0,
            depth: path.depth.0,
        }
    }
}

/// Three components.
pub type Components = [f32; 3];

/// What happened to a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind {
    /// A ray was traced along the path.
    Ray {
        /// Where from.
        origin: Components,
        /// Where to.
        direction: Components,
        /// The part of what it finds that reaches the film.
        throughput: Components,
        /// What it met.
        hit: Hit,
    },
    /// The surface at the hit has been looked up.
    Vertex {
        /// In world space.
        position: Components,
        /// Of the surface itself, on the viewer's side.
        geometric_normal: Components,
        /// For shading.
        normal: Components,
        /// What the path has gathered, including what the surface itself emits.
        radiance: Components,
    },
    /// What the path transport does there.
    Choice {
        /// See [`Decision::emission_mis_weight`].
        emission_share: f32,
        /// What becomes of the path.
        fate: PathEvent,
    },
    /// Photons have ended around the vertex.
    Gathered {
        /// What they bring.
        light: Components,
    },
    /// Photons have ended where the sample sees them directly.
    Drawn {
        /// What they bring.
        light: Components,
    },
    /// A ray to a light.
    Light {
        /// Which light; under the path transport which emitter.
        light: u32,
        /// Under the path transport, the weight of finding the light this way; otherwise 1.
        share: f32,
        /// Which of its samples.
        which: u32,
        /// Where from.
        origin: Components,
        /// Where to.
        direction: Components,
        /// Where it ends.
        distance: f32,
        /// What arrives at the film if nothing is between.
        contribution: Components,
    },
    /// The ray to a light has been traced.
    Shadow {
        /// Whether something is between.
        blocked: bool,
        /// What the path has gathered then, under the path transport.
        radiance: Option<Components>,
    },
    /// The path has gone on from its last vertex, or been forked off there.
    Onward {
        /// How.
        way: Continuation,
        /// Where to.
        direction: Components,
        /// The throughput along it.
        throughput: Components,
    },
    /// What the path has gathered was put where it is shared; the path continues with none of it.
    Aside,
    /// All paths of the group that it shares with have ended.
    Received {
        /// What its own path has found beyond the first vertex for it alone.
        own: Components,
        /// What the second vertices of the group send, its own among them.
        shared: Components,
        /// How many of them send anything.
        vertices: u32,
    },
    /// The path has come to its end.
    End {
        /// What it has gathered in all.
        radiance: Components,
    },
}

/// How a path goes on from a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continuation {
    /// Along the mirror image.
    Reflect,
    /// Through the surface.
    Refract,
    /// Wherever the path transport drew.
    Scatter,
}

/// What went through a stage of the wave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow {
    /// Which.
    pub stage: Stage,
    /// How many items came to it.
    pub entering: usize,
    /// How many went on.
    pub leaving: usize,
    /// How many the wave has room for.
    pub capacity: usize,
    /// The number of lanes that work together.
    pub width: usize,
    /// How often a group had this many lanes that went on.
    pub lanes: [u32; 17],
}

/// A path with the ray that was traced along it.
#[inline(always)]
pub fn ray(path: &Path<f32>, hit: Hit) -> Event {
    let what = EventKind::Ray {
        origin: triple(path.origin),
        direction: triple(path.direction),
        throughput: color(path.throughput),
        hit,
    };
    Event::Sample(PathKey::of(path), what)
}

/// A path at a vertex.
#[inline(always)]
pub fn vertex(
    path: &Path<f32>,
    position: Vector<f32>,
    geometric_normal: Vector<f32>,
    normal: Vector<f32>,
) -> Event {
    let what = EventKind::Vertex {
        position: triple(position),
        geometric_normal: triple(geometric_normal),
        normal: triple(normal),
        radiance: color(path.radiance),
    };
    Event::Sample(PathKey::of(path), what)
}

/// A path of the path transport at a vertex: where that is, and what happens there.
pub fn path_vertex(path: &Path<f32>, decision: &Decision) -> impl Iterator<Item = Event> {
    let Decision {
        position,
        geometric_normal,
        normal,
        emission_mis_weight: emission_share,
        gathered,
        event: fate,
        ..
    } = *decision;
    let choice = Event::Sample(PathKey::of(path), EventKind::Choice { emission_share, fate });
    let found = Event::Sample(PathKey::of(path), EventKind::Gathered { light: color(gathered) });
    let found = (gathered.max_component() > 0.0).then_some(found);
    [vertex(path, position, geometric_normal, normal), choice].into_iter().chain(found)
}

/// A path of the path transport with a ray to a light.
pub fn path_light(path: &Path<f32>, decision: &Decision, ray: &Ray<f32>, contribution: Color<f32>) -> Event {
    let (emitter, share) = decision.light.unwrap_or((crate::math::NONE, 1.0));
    to_light(path, (emitter, 0, share), ray, contribution)
}

/// A path of the path transport whose ray to a light has been traced, with what it has gathered.
pub fn path_shadow(path: &Path<f32>, blocked: bool, radiance: Color<f32>) -> Event {
    Event::Sample(PathKey::of(path), EventKind::Shadow { blocked, radiance: Some(color(radiance)) })
}

/// A path with a ray to a light.
#[inline(always)]
pub fn light(path: &Path<f32>, light: usize, which: u32, ray: &Ray<f32>, contribution: Color<f32>) -> Event {
    to_light(path, (light as u32, which, 1.0), ray, contribution)
}

#[inline(always)]
fn to_light(
    path: &Path<f32>,
    (light, which, share): (u32, u32, f32),
    ray: &Ray<f32>,
    contribution: Color<f32>,
) -> Event {
    let what = EventKind::Light {
        light,
        share,
        which,
        origin: triple(ray.origin),
        direction: triple(ray.direction),
        distance: ray.t_max,
        contribution: color(contribution),
    };
    Event::Sample(PathKey::of(path), what)
}

/// A path whose ray to a light has been traced.
#[inline(always)]
pub fn shadow(path: &Path<f32>, blocked: bool) -> Event {
    Event::Sample(PathKey::of(path), EventKind::Shadow { blocked, radiance: None })
}

/// A path that has gone on from a vertex.
#[inline(always)]
pub fn onward(way: Continuation, next: &Path<f32>) -> Event {
    let (direction, throughput) = (triple(next.direction), color(next.throughput));
    Event::Sample(PathKey::of(next), EventKind::Onward { way, direction, throughput })
}

/// A path whose radiance has been put where it is shared.
pub fn spilled(path: &Path<f32>) -> Event {
    Event::Sample(PathKey::of(path), EventKind::Aside)
}

/// A path whose group has shared what it found.
pub fn received(pixel: u32, sample: u32, own: Color<f32>, shared: Color<f32>, vertices: u32) -> Event {
    let key = PathKey { pixel: unpack_pixel(pixel), sample, branch: 0, depth: 0 };
    Event::Sample(key, EventKind::Received { own: color(own), shared: color(shared), vertices })
}

/// A sample that has seen photons directly.
pub fn drawn(pixel: (u32, u32), sample: u32, light: Color<f32>) -> Event {
    Event::Sample(PathKey { pixel, sample, branch: 0, depth: 0 }, EventKind::Drawn { light: color(light) })
}

/// A path at its end.
#[inline(always)]
pub fn end(path: &Path<f32>, radiance: Color<f32>) -> Event {
    Event::Sample(PathKey::of(path), EventKind::End { radiance: color(radiance) })
}

fn triple(v: Vector<f32>) -> Components {
    [v.x, v.y, v.z]
}

fn color(c: Color<f32>) -> Components {
    [c.r, c.g, c.b]
}
