//! Events of a sample as human-readable names and values.

use crate::integrator::observe::{Components, Continuation, EventKind};
use crate::math::NONE;

/// Returns a short title of an event.
pub fn title(what: &EventKind) -> &'static str {
    match what {
        EventKind::Ray { .. } => "ray",
        EventKind::LampFound { .. } => "lamp on the way",
        EventKind::Vertex { .. } => "vertex",
        EventKind::Choice { .. } => "choice",
        EventKind::Gathered { .. } => "photons",
        EventKind::Drawn { .. } => "photons seen directly",
        EventKind::Light { .. } => "ray to a light",
        EventKind::Shadow { .. } => "shadow",
        EventKind::Onward { way: Continuation::Reflect, .. } => "reflected",
        EventKind::Onward { way: Continuation::Refract, .. } => "refracted",
        EventKind::Onward { way: Continuation::Scatter, .. } => "scattered",
        EventKind::Spilled => "put aside",
        EventKind::Received { .. } => "received",
        EventKind::End { .. } => "end",
    }
}

/// Returns the fields of an event. Floats are printed exactly: different values have different texts.
pub fn describe(what: &EventKind) -> Vec<(&'static str, String)> {
    match what {
        EventKind::Ray { origin, direction, throughput, hit } => vec![
            ("origin", triple(origin)),
            ("direction", triple(direction)),
            ("throughput", triple(throughput)),
            ("t", hit.t.to_string()),
            ("u", hit.u.to_string()),
            ("v", hit.v.to_string()),
            ("primitive", id(hit.primitive)),
            ("instance", id(hit.instance)),
        ],
        EventKind::LampFound { emitter, distance, share, light, radiance } => vec![
            ("light", emitter.to_string()),
            ("distance", distance.to_string()),
            ("share of light", share.to_string()),
            ("light found", triple(light)),
            ("radiance", triple(radiance)),
        ],
        EventKind::Vertex { position, geometric_normal, normal, radiance } => vec![
            ("position", triple(position)),
            ("geometric normal", triple(geometric_normal)),
            ("shading normal", triple(normal)),
            ("radiance", triple(radiance)),
        ],
        EventKind::Choice { emission_mis_weight, fate } => {
            vec![("share of emission", emission_mis_weight.to_string()), ("fate", format!("{fate:?}"))]
        }
        EventKind::Gathered { light } | EventKind::Drawn { light } => vec![("light", triple(light))],
        EventKind::Light { light, share, which, origin, direction, distance, contribution } => vec![
            ("light", light.to_string()),
            ("share of light", share.to_string()),
            ("sample of it", which.to_string()),
            ("origin", triple(origin)),
            ("direction", triple(direction)),
            ("distance", distance.to_string()),
            ("contribution", triple(contribution)),
        ],
        EventKind::Shadow { blocked, radiance } => {
            let radiance = radiance.map(|radiance| ("radiance", triple(&radiance)));
            [("blocked", blocked.to_string())].into_iter().chain(radiance).collect()
        }
        EventKind::Onward { way, direction, throughput } => vec![
            ("way", format!("{way:?}").to_lowercase()),
            ("direction", triple(direction)),
            ("throughput", triple(throughput)),
        ],
        EventKind::Spilled => Vec::new(),
        EventKind::Received { own, shared, vertices } => {
            vec![("own", triple(own)), ("shared", triple(shared)), ("second vertices", vertices.to_string())]
        }
        EventKind::End { radiance } => vec![("radiance", triple(radiance))],
    }
}

/// Prints floats with the fewest digits that identify them.
fn triple([x, y, z]: &Components) -> String {
    format!("({x}, {y}, {z})")
}

fn id(id: u32) -> String {
    if id == NONE { "none".into() } else { id.to_string() }
}
