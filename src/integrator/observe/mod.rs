//! Observation of rendering: reports of what happens to each sample, stage by stage, in terms that do not depend on the
//! schedule.

pub mod decision;
pub mod statistics;
pub mod stop;
pub mod visits;

use crate::integrator::Stage;
use crate::integrator::path::{Path, unpack_pixel};
use crate::math::{Color, Hit, Ray, Vector};
use decision::{Decision, LampDecision, PathEvent};

/// A receiver of reports.
pub trait Observer {
    /// True if reports are wanted. If not, none are made.
    fn is_active(&self) -> bool;
    /// Receives an event.
    fn report(&mut self, event: &Event);
    /// Marks the end of a stage of the wave, which that many items have entered; the time since the last mark belongs to
    /// it.
    fn mark(&mut self, _: Stage, _items: usize) {}
    /// True if the rendering is to end within the tile, which is useless then. Called before each wave or after some
    /// hundred rays, with the number of rays of the tile.
    fn stops(&mut self, _rays: u64) -> bool {
        false
    }
}

/// An observer without reports that stops when another one does.
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

/// An observer without reports.
pub struct NoObserver;

impl Observer for NoObserver {
    fn is_active(&self) -> bool {
        false
    }
    fn report(&mut self, _: &Event) {}
}

/// An observer that calls a function for every event.
pub struct FnObserver<'a>(pub &'a mut dyn FnMut(&Event));

impl Observer for FnObserver<'_> {
    fn is_active(&self) -> bool {
        true
    }
    fn report(&mut self, event: &Event) {
        (self.0)(event);
    }
}

/// An observer without reports that calls a function after each stage of the wave.
pub struct Timekeeper<F>(pub F);

impl<F: FnMut(Stage, usize)> Observer for Timekeeper<F> {
    fn is_active(&self) -> bool {
        false
    }
    fn report(&mut self, _: &Event) {}
    fn mark(&mut self, stage: Stage, items: usize) {
        (self.0)(stage, items);
    }
}

/// An event that is reported to an observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// Something happened to a sample.
    Sample(PathKey, EventKind),
    /// The wave has gone through a stage.
    Wave(Flow),
}

/// The key of a part of a sample: a path and its depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PathKey {
    /// Column and row of the pixel.
    pub pixel: (u32, u32),
    /// The number of the sample within the pixel.
    pub sample: u32,
    /// See [`Path::bounce_counts`].
    pub branch: u32,
    /// See [`Path::depth`].
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

/// The three components of a vector or a colour.
pub type Components = [f32; 3];

/// An event of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind {
    /// A ray was traced along the path.
    Ray {
        /// The origin of the ray.
        origin: Components,
        /// The direction of the ray.
        direction: Components,
        /// The fraction of the radiance found next that reaches the film.
        throughput: Components,
        /// The hit.
        hit: Hit,
    },
    /// The path has found an unseen lamp before the hit.
    LampFound {
        /// The emitter.
        emitter: u32,
        /// The distance from where the path's direction was drawn.
        distance: f32,
        /// The MIS weight, times the part that photons leave to the path.
        share: f32,
        /// The light that reaches the film.
        light: Components,
        /// The radiance of the path with the light of all such lamps.
        radiance: Components,
    },
    /// The surface at the hit has been evaluated.
    Vertex {
        /// The position in world space.
        position: Components,
        /// The normal of the surface itself, on the viewer's side.
        geometric_normal: Components,
        /// The shading normal.
        normal: Components,
        /// The radiance of the path, including the surface's emission.
        radiance: Components,
    },
    /// The path transport has decided at the vertex.
    Choice {
        /// See [`Decision::emission_mis_weight`].
        emission_mis_weight: f32,
        /// The event that continues or ends the path.
        fate: PathEvent,
    },
    /// Photons have ended around the vertex.
    Gathered {
        /// The light that they bring.
        light: Components,
    },
    /// Photons have ended where the sample sees them directly.
    Drawn {
        /// The light that they bring.
        light: Components,
    },
    /// A ray to a light.
    Light {
        /// The number of the light; under the path transport, of the emitter.
        light: u32,
        /// The MIS weight of the light sample under the path transport; otherwise 1.
        share: f32,
        /// The number of the light's sample.
        which: u32,
        /// The origin of the ray.
        origin: Components,
        /// The direction of the ray.
        direction: Components,
        /// The distance at which the ray ends.
        distance: f32,
        /// The contribution to the film if the ray is unblocked.
        contribution: Components,
    },
    /// The ray to a light has been traced.
    Shadow {
        /// True if it is blocked.
        blocked: bool,
        /// The radiance of the path afterwards, under the path transport.
        radiance: Option<Components>,
    },
    /// The path has gone on from its last vertex, or has been forked off there.
    Onward {
        /// The kind of continuation.
        way: Continuation,
        /// The direction.
        direction: Components,
        /// The throughput along it.
        throughput: Components,
    },
    /// The path's radiance has been stored for path reuse; the path continues without it.
    Spilled,
    /// All paths of its reuse group have ended.
    Received {
        /// The radiance that the path has found beyond its first vertex and keeps.
        own: Components,
        /// The radiance that the second vertices of the group give, its own among them.
        shared: Components,
        /// The number of them that give any.
        vertices: u32,
    },
    /// The path has ended.
    End {
        /// The radiance of the path.
        radiance: Components,
    },
}

/// The continuation of a path from a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continuation {
    /// Along the reflection.
    Reflect,
    /// Through the surface.
    Refract,
    /// In a direction drawn by the path transport.
    Scatter,
}

/// The flow of items through a stage of the wave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow {
    /// The stage.
    pub stage: Stage,
    /// The number of items that entered it.
    pub entering: usize,
    /// The number of items that went on.
    pub leaving: usize,
    /// The number of items that there is room for.
    pub capacity: usize,
    /// The number of lanes that work together.
    pub width: usize,
    /// The number of lane groups, by how many of their lanes went on.
    pub lanes: [u32; 17],
}

/// The event of a ray traced along a path.
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

/// The event of an unseen lamp that a path has found.
pub fn lamp(path: &Path<f32>, decision: &LampDecision) -> Event {
    let LampDecision { emitter, distance, weight: share, light } = *decision;
    let (light, radiance) = (color(light), color(path.radiance));
    Event::Sample(PathKey::of(path), EventKind::LampFound { emitter, distance, share, light, radiance })
}

/// The event of a path at a vertex.
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

/// The events of a path of the path transport at a vertex: its position, the decision, and photons.
pub fn path_vertex(path: &Path<f32>, decision: &Decision) -> impl Iterator<Item = Event> {
    let Decision { position, geometric_normal, normal, emission_mis_weight, gathered, event: fate, .. } =
        *decision;
    let choice = Event::Sample(PathKey::of(path), EventKind::Choice { emission_mis_weight, fate });
    let found = Event::Sample(PathKey::of(path), EventKind::Gathered { light: color(gathered) });
    let found = (gathered.max_component() > 0.0).then_some(found);
    [vertex(path, position, geometric_normal, normal), choice].into_iter().chain(found)
}

/// The event of a shadow ray of the path transport.
pub fn path_light(path: &Path<f32>, decision: &Decision, ray: &Ray<f32>, contribution: Color<f32>) -> Event {
    let (emitter, share) = decision.light.unwrap_or((crate::math::NONE, 1.0));
    to_light(path, (emitter, 0, share), ray, contribution)
}

/// The event of a traced shadow ray of the path transport, with the path's radiance.
pub fn path_shadow(path: &Path<f32>, blocked: bool, radiance: Color<f32>) -> Event {
    Event::Sample(PathKey::of(path), EventKind::Shadow { blocked, radiance: Some(color(radiance)) })
}

/// The event of a shadow ray.
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

/// The event of a traced shadow ray.
#[inline(always)]
pub fn shadow(path: &Path<f32>, blocked: bool) -> Event {
    Event::Sample(PathKey::of(path), EventKind::Shadow { blocked, radiance: None })
}

/// The event of a path that has gone on from a vertex.
#[inline(always)]
pub fn onward(way: Continuation, next: &Path<f32>) -> Event {
    let (direction, throughput) = (triple(next.direction), color(next.throughput));
    Event::Sample(PathKey::of(next), EventKind::Onward { way, direction, throughput })
}

/// The event of a path whose radiance has been stored for path reuse.
pub fn spilled(path: &Path<f32>) -> Event {
    Event::Sample(PathKey::of(path), EventKind::Spilled)
}

/// The event of a path that has taken light from its reuse group.
pub fn received(pixel: u32, sample: u32, own: Color<f32>, shared: Color<f32>, vertices: u32) -> Event {
    let key = PathKey { pixel: unpack_pixel(pixel), sample, branch: 0, depth: 0 };
    Event::Sample(key, EventKind::Received { own: color(own), shared: color(shared), vertices })
}

/// The event of a sample that sees photons directly.
pub fn drawn(pixel: (u32, u32), sample: u32, light: Color<f32>) -> Event {
    Event::Sample(PathKey { pixel, sample, branch: 0, depth: 0 }, EventKind::Drawn { light: color(light) })
}

/// The event of a path that has ended.
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
