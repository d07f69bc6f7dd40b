//! What happened to a sample, as names and values that people can read.

use crate::integrator::observe::{Continuation, Triple, What};
use crate::math::NONE;

/// What kind of thing happened, in a few words.
pub fn title(what: &What) -> &'static str {
    match what {
        What::Ray { .. } => "ray",
        What::Vertex { .. } => "vertex",
        What::Choice { .. } => "choice",
        What::Gathered { .. } => "photons",
        What::Drawn { .. } => "photons seen directly",
        What::Light { .. } => "ray to a light",
        What::Shadow { .. } => "shadow",
        What::Onward { way: Continuation::Reflect, .. } => "reflected",
        What::Onward { way: Continuation::Refract, .. } => "refracted",
        What::Onward { way: Continuation::Scatter, .. } => "scattered",
        What::Aside => "put aside",
        What::Received { .. } => "received",
        What::End { .. } => "end",
    }
}

/// Everything about it. Floats are as exact as they are: two that differ look different.
pub fn facts(what: &What) -> Vec<(&'static str, String)> {
    match what {
        What::Ray { origin, direction, throughput, hit } => vec![
            ("origin", triple(origin)),
            ("direction", triple(direction)),
            ("throughput", triple(throughput)),
            ("t", hit.t.to_string()),
            ("u", hit.u.to_string()),
            ("v", hit.v.to_string()),
            ("primitive", id(hit.primitive)),
            ("instance", id(hit.instance)),
        ],
        What::Vertex { position, geometric_normal, normal, radiance } => vec![
            ("position", triple(position)),
            ("geometric normal", triple(geometric_normal)),
            ("shading normal", triple(normal)),
            ("radiance", triple(radiance)),
        ],
        What::Choice { emission_share, fate } => {
            vec![("share of emission", emission_share.to_string()), ("fate", format!("{fate:?}"))]
        }
        What::Gathered { light } | What::Drawn { light } => vec![("light", triple(light))],
        What::Light { light, share, which, origin, direction, distance, contribution } => vec![
            ("light", light.to_string()),
            ("share of light", share.to_string()),
            ("sample of it", which.to_string()),
            ("origin", triple(origin)),
            ("direction", triple(direction)),
            ("distance", distance.to_string()),
            ("contribution", triple(contribution)),
        ],
        What::Shadow { blocked, radiance } => {
            let radiance = radiance.map(|radiance| ("radiance", triple(&radiance)));
            [("blocked", blocked.to_string())].into_iter().chain(radiance).collect()
        }
        What::Onward { way, direction, throughput } => vec![
            ("way", format!("{way:?}").to_lowercase()),
            ("direction", triple(direction)),
            ("throughput", triple(throughput)),
        ],
        What::Aside => Vec::new(),
        What::Received { own, shared, vertices } => {
            vec![("own", triple(own)), ("shared", triple(shared)), ("second vertices", vertices.to_string())]
        }
        What::End { radiance } => vec![("radiance", triple(radiance))],
    }
}

/// The shortest digits that mean these floats.
fn triple([x, y, z]: &Triple) -> String {
    format!("({x}, {y}, {z})")
}

fn id(id: u32) -> String {
    if id == NONE { "none".into() } else { id.to_string() }
}
