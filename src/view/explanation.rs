//! The explanation of a pixel, drawn over the image.

use serde_json::{Value, json};

use super::lines::{ImageLines, in_tenths};
use super::viewer::Snapshot;
use crate::film::Region;
use crate::integrator::observe::Components;
use crate::integrator::observe::decision::PathEvent;
use crate::integrator::path::bounces::LobeKind;
use crate::integrator::{RenderSetup, Schedule};
use crate::math::{Vec3, Vector};
use crate::render::{Options, Session};
use crate::study::explain::{self, ExplainedLightRay, SampleTrace, Step};

/// The number of samples of a pixel that are rendered with both schedules for comparison, at most.
const COMPARED: u32 = 16;

/// Explains a sample of a pixel; none if there is no such pixel.
pub fn explanation(shown: &Snapshot, pixel: [u32; 2], sample: u32) -> Option<Value> {
    let [x, y] = pixel;
    let [width, height] = shown.setup.size;
    if x >= width || y >= height {
        return None;
    }
    let samples = shown.wanted.max(1);
    let sample = sample.min(samples - 1);
    let (lives, _) = explain::explain(shown.setup.clone(), &shown.names, pixel, sample..sample + 1);
    let compared = samples.min(COMPARED);
    let [(wave, by_wave), (one, by_one)] = [Schedule::Wavefront, Schedule::Recursive].map(|schedule| {
        let region = Region { x0: x, y0: y, x1: x + 1, y1: y + 1 };
        let options = Options { schedule, region: Some(region), ..shown.options };
        let mut session = Session::of(shown.setup.clone(), samples, options).with_samples(0..compared);
        session.advance(compared);
        let radiance = session.film().radiance().first().map_or([0.0; 3], |pixel| pixel.to_array());
        (session.film().hash(), radiance)
    });
    let paper = Paper { setup: &shown.setup, lines: ImageLines::new(&shown.setup), far: far(shown) };
    Some(json!({
        "pixel": pixel,
        "sample": sample,
        "samples": samples,
        "radiance": lives.first().map(SampleTrace::radiance),
        "agrees": wave == one,
        "compared": compared,
        "schedules": {"wavefront": by_wave, "recursive": by_one},
        "photons": lives.first().map(explain::json::drawn),
        "paths": lives.first().map_or_else(Vec::new, |life| paper.life(life)),
    }))
}

/// A distance beyond everything in the scene.
pub(super) fn far(shown: &Snapshot) -> f32 {
    2.0 * shown.setup.scene.bounds.size().length().max(1.0)
}

/// Projects points into the image.
struct Paper<'a> {
    setup: &'a RenderSetup,
    lines: ImageLines<'a>,
    far: f32,
}

impl Paper<'_> {
    /// The paths of a sample, with image positions of their rays and human-readable sentences.
    fn life(&self, life: &SampleTrace) -> Vec<Value> {
        let mut value = explain::json::life(life);
        let mut paths = value["paths"].as_array_mut().map(std::mem::take).unwrap_or_default();
        for (path, followed) in paths.iter_mut().zip(&life.paths) {
            path["end"] = json!(followed.why.text());
            let Some(steps) = path["steps"].as_array_mut() else { continue };
            for (value, step) in steps.iter_mut().zip(&followed.steps) {
                self.step(value, step);
            }
        }
        paths
    }

    fn step(&self, value: &mut Value, step: &Step) {
        let Some(vertex) = &step.vertex else {
            value["to"] = Value::Null;
            value["lines"] = self.along(step.origin, step.direction, self.far);
            return;
        };
        let ends = [step.origin, vertex.position].map(Vec3::from);
        value["to"] = json!(self.point(ends[1]));
        value["lines"] = in_tenths(&self.lines.draw([ends]));
        value["vertex"]["lobe"] = json!(vertex.fate.and_then(lobe));
        let Some(lights) = value["vertex"]["lights"].as_array_mut() else { return };
        for (value, ExplainedLightRay { direction, distance, .. }) in lights.iter_mut().zip(&vertex.lights) {
            value["lines"] = self.along(vertex.position, *direction, distance.min(self.far));
        }
    }

    /// The lines of a ray in the image.
    fn along(&self, origin: Components, direction: Components, length: f32) -> Value {
        let origin = Vec3::from(origin);
        in_tenths(&self.lines.draw([[origin, origin + Vec3::from(direction) * length]]))
    }

    /// The column and row of a point, which may be outside the image; none if the point is not in front of the camera.
    fn point(&self, place: Vec3) -> Option<[f64; 2]> {
        let point = self.setup.image().project::<f32>(None, Vector::splat(place), (0.5, 0.5));
        point.seen.then_some([f64::from(point.column), f64::from(point.row)])
    }
}

/// Describes the lobe that a direction was sampled from.
fn lobe(fate: PathEvent) -> Option<String> {
    match fate {
        PathEvent::Drawn { kind, through, exact } => {
            let article = if exact { "an exact" } else { "a" };
            let side = if through && kind == LobeKind::Diffuse { ", to the other side" } else { "" };
            Some(format!("{article} {} lobe{side}", kind.name()))
        }
        PathEvent::Straight => Some("straight through: no bounce".into()),
        PathEvent::Scattered { distance_m } => Some(format!("scattered within, after {distance_m} m")),
        _ => None,
    }
}
