//! The decisions of the path transport at a vertex, as observers receive them.

use crate::integrator::path::bounces::LobeKind;
use crate::math::{Color, Vector};

/// The decision at a vertex of a path.
#[derive(Clone, Copy)]
pub struct Decision {
    /// The position in world space.
    pub position: Vector<f32>,
    /// The normal of the surface itself, on the viewer's side.
    pub geometric_normal: Vector<f32>,
    /// The shading normal, with the effect of a normal map.
    pub normal: Vector<f32>,
    /// The MIS weight (power heuristic) of the drawn direction by which the path found the surface's emission, times
    /// the part that photons leave to the path; 1 if no other technique can find it.
    pub emission_mis_weight: f32,
    /// The emitter that a shadow ray is sent to, if any, and the MIS weight of finding it that way.
    pub light: Option<(u32, f32)>,
    /// The light of photons that have ended around the vertex, without the part that the vertex gives.
    pub gathered: Color<f32>,
    /// The event that continues or ends the path.
    pub event: PathEvent,
}

/// An unseen lamp that a path has found on its way.
#[derive(Clone, Copy)]
pub struct LampDecision {
    /// The emitter.
    pub emitter: u32,
    /// The distance from where the path's direction was drawn.
    pub distance: f32,
    /// The MIS weight, times the part that photons leave to the path.
    pub weight: f32,
    /// The radiance that reaches the film.
    pub light: Color<f32>,
}

/// An event that continues or ends a path at a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathEvent {
    /// This was the ray after the last bounce, of all or of a kind.
    Last,
    /// The path was scattered within its body before it reached the surface.
    Scattered {
        /// The distance from the origin of its ray.
        distance_m: f32,
    },
    /// The surface is unlit: it shows its colour and ignores all light.
    Unlit,
    /// The path goes straight on behind the surface, as through a filter or where there is no boundary: no bounce.
    Straight,
    /// No direction could be drawn: the surface absorbs, or the drawn direction leads to the wrong side.
    Absorbed,
    /// The throughput along the drawn direction is zero.
    Black,
    /// A direction has been drawn. If the path ends nevertheless, Russian roulette has ended it.
    Drawn {
        /// The kind of the lobe.
        kind: LobeKind,
        /// True if the direction leads to the other side.
        through: bool,
        /// True if it is the only direction of its lobe, as of a smooth mirror.
        exact: bool,
    },
}
