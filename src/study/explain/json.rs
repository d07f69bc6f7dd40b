//! Records of samples as JSON, for other programs.

use serde_json::{Value, json};

use super::{ExplainedLamp, ExplainedLightRay, SampleTrace, Shares, Step};
use crate::integrator::observe::Components;
use crate::integrator::observe::decision::PathEvent;
use crate::math::{DVec3, NONE};

/// Returns a sample with all its paths.
pub fn life(life: &SampleTrace) -> Value {
    let paths: Vec<Value> = life
        .paths
        .iter()
        .map(|path| {
            json!({
                "branch": path.branch,
                "forked_off_path": path.from.map(|(parent, _)| parent),
                "forked_off_bounce": path.from.map(|(_, depth)| depth),
                "steps": path.steps.iter().map(|one| step(life, one)).collect::<Vec<_>>(),
                "radiance": path.radiance,
                "shares": path.shares.as_ref().map(shares),
                "end": path.why.name(),
            })
        })
        .collect();
    json!({"sample": life.sample, "radiance": life.radiance(), "photons": drawn(life), "paths": paths})
}

/// Returns the photons that a sample sees directly.
pub fn drawn(life: &SampleTrace) -> Value {
    let (light, count) = life.drawn;
    json!({"count": count, "radiance": light})
}

fn shares(shares: &Shares) -> Value {
    let Shares { before, own, shared, vertices } = shares;
    json!({"before": before, "own": own, "shared": shared, "vertices": vertices})
}

/// A position in world space. Without an offset it is printed with the digits of single precision.
fn position(life: &SampleTrace, position: Components) -> Value {
    if life.origin == DVec3::ZERO { json!(position) } else { json!(life.in_world(position)) }
}

fn step(life: &SampleTrace, step: &Step) -> Value {
    let vertex = step.vertex.as_ref().map(|vertex| {
        json!({
            "entity": vertex.entity,
            "material": vertex.material,
            "t": vertex.hit.t,
            "primitive": vertex.hit.primitive,
            "instance": (vertex.hit.instance != NONE).then_some(vertex.hit.instance),
            "position": position(life, vertex.position),
            "geometric_normal": vertex.geometric_normal,
            "normal": vertex.normal,
            "gives_off": vertex.own,
            "gives_off_weight": vertex.own_share,
            "photons": vertex.gathered,
            "lights": vertex.lights.iter().map(lit).collect::<Vec<_>>(),
            "lobe": vertex.fate.and_then(lobe),
        })
    });
    json!({
        "bounce": step.depth,
        "queue": step.queue,
        "origin": position(life, step.origin),
        "direction": step.direction,
        "throughput": step.throughput,
        "lamps": step.lamps.iter().map(lamp).collect::<Vec<_>>(),
        "vertex": vertex,
    })
}

fn lamp(lamp: &ExplainedLamp) -> Value {
    json!({
        "light": lamp.light,
        "distance": lamp.distance.is_finite().then_some(lamp.distance),
        "found": lamp.found,
        "weight": lamp.share,
    })
}

/// Returns the lobe that a direction was sampled from.
fn lobe(fate: PathEvent) -> Option<Value> {
    match fate {
        PathEvent::Drawn { kind, through, exact } => {
            Some(json!({"kind": kind.name(), "through": through, "exact": exact}))
        }
        PathEvent::Straight => Some(json!({"kind": "straight", "through": true, "exact": true})),
        _ => None,
    }
}

fn lit(lit: &ExplainedLightRay) -> Value {
    json!({
        "light": lit.light,
        "sample": lit.which,
        "direction": lit.direction,
        "distance": lit.distance.is_finite().then_some(lit.distance),
        "contribution": lit.contribution,
        "arrived": lit.arrived,
        "weight": lit.share,
        "blocked": lit.blocked,
    })
}
