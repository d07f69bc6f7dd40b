//! The decisions of the path transport at a vertex, for observers: the same functions run once more in one lane, with
//! results equal to the last bit. Rendering does not need this module.

use std::num::Wrapping;

use super::medium_light::MediumLightSample;
use super::reusable::gives_at;
use super::scatter_vertex::ScatterVertex;
use super::{catcher, direct, medium, onward, path_tracing};
use crate::integrator::RenderSetup;
use crate::integrator::observe::decision::{Decision, PathEvent};
use crate::integrator::path::Path;
use crate::integrator::path::bounces::LobeKind;
use crate::integrator::path::mis::emission_mis_weight;
use crate::integrator::path::shadow::ShadowRay;
use crate::integrator::path::termination::is_last;
use crate::integrator::photons::PhotonMaps;
use crate::math::{Color, Vector};
use crate::shading::principled::bsdf::Bsdf;
use crate::shading::principled::sample::BsdfSample;
use crate::shading::{HitLanes, Surface};
use crate::simd::Outlined;

/// Evaluates the decision of a path that has hit a material.
pub fn decide(
    setup: &RenderSetup,
    photons: Option<PhotonMaps>,
    path: &Path<f32>,
    hit: &HitLanes<f32>,
    material: u32,
) -> Decision {
    let scene = &setup.scene;
    let record = &scene.materials[material as usize];
    let surface = Surface::new(&scene.geometry, &path.ray(), hit, true);
    let width = path.width + path.spread * hit.t;
    let point = path_tracing::shading_point(setup, path, hit, material, &surface, width, true);
    let mut decision = Decision {
        position: surface.position,
        geometric_normal: surface.geometric_normal,
        normal: surface.normal,
        emission_mis_weight: 1.0,
        light: None,
        gathered: Color::black(),
        event: PathEvent::Last,
    };
    let flight = medium::free_flight(setup, path, hit.t, true);
    let path = &Path { throughput: flight.throughput, ..*path };
    let key = path.path_key(setup.seed);
    if flight.scattered {
        decision.position = path.origin + path.direction * flight.t;
        if !is_last(setup, path) {
            decision.event = PathEvent::Scattered { distance_m: flight.t };
            let lit = MediumLightSample { setup, path, flight: &flight, key }.run();
            decision.light = Some((lit.emitter.0, lit.share));
        }
        return decision;
    }
    decision.normal = point.normal();
    if record.emits() {
        let left = photons.map_or(1.0, |photons| photons.left_of_hit(path, hit, true));
        decision.emission_mis_weight = emission_mis_weight(setup, path, hit, true) * left;
    }
    let boundary = path_tracing::boundary(scene, path, &surface, record, true);
    if boundary.gone {
        return Decision { event: PathEvent::Straight, ..decision };
    }
    let last = is_last(setup, path);
    if last && !record.passes_shadow_rays {
        return decision;
    }
    if record.unlit {
        return Decision { event: PathEvent::Unlit, ..decision };
    }
    let bsdf = path_tracing::bsdf(point.has(), setup, path, &point, &boundary.outside, key, true);
    let (caught, mut to_light) = (catcher::caught(setup, path, record, !last), Vector::zero());
    if !last && !scene.emitters.is_empty() && bsdf.scatters() {
        let lit = direct::sampled_light(setup, path, &surface, &bsdf, key, [true, caught]);
        decision.light = Some((lit.emitter.0, lit.share));
        to_light = lit.sample.direction;
    }
    let drawn = onward::sampled(setup, path, &bsdf, key, true);
    let is_straight = boundary.is_straight(record);
    let (here, t) = (!last, hit.t);
    let vertex = ScatterVertex {
        setup,
        photons,
        path,
        boundary,
        surface: &surface,
        point: &point,
        key,
        here,
        draws: true,
        caught,
        t,
        width,
    };
    with_photons(&vertex, &bsdf, &drawn, to_light, &mut decision);
    let left = path.throughput * drawn.weight;
    let passed = record.passes_shadow_rays && onward::goes_straight(&drawn) && is_straight;
    decision.event = if last && !passed {
        PathEvent::Last
    } else if !drawn.valid {
        PathEvent::Absorbed
    } else if left.max_component() <= 0.0 {
        PathEvent::Black
    } else if passed {
        PathEvent::Straight
    } else {
        let (kind, through) = (LobeKind::of(drawn.wide, drawn.transmitted), drawn.transmitted);
        PathEvent::Drawn { kind, through, exact: drawn.pdf == 0.0 }
    };
    decision
}

/// Adds the gathered light, without the part that the vertex gives, and weights the light sample against photons.
fn with_photons(
    vertex: &ScatterVertex<f32>,
    bsdf: &Bsdf<f32>,
    drawn: &BsdfSample<f32>,
    to_light: Vector<f32>,
    decision: &mut Decision,
) {
    let Some(photons) = vertex.photons else { return };
    let (path, mut light) = (vertex.path, ShadowRay::none());
    if let Some((emitter, _)) = decision.light {
        (light.emitter, light.mask) = (Wrapping(emitter), true);
        light.ray.direction = to_light;
        light.contribution = Color::black().complement();
    }
    let found = vertex.with_photons(photons, bsdf, drawn, &mut light, &mut { *path });
    if let Some((_, share)) = &mut decision.light {
        *share *= light.contribution.r;
    }
    let gives = vertex.setup.sharing.is_some() && gives_at(path, vertex.point, true);
    let reusable = if gives { found.diffuse } else { Color::black() };
    decision.gathered = path.throughput * (found.light - reusable);
}
