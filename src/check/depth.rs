//! Light that is lost because paths end within glass.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Checked, finding};
use crate::error::{Diagnostic, words};
use crate::integrator::observe::decision::PathEvent;
use crate::integrator::observe::{Event, EventKind};
use crate::integrator::setup::NoPhotons;
use crate::integrator::{RenderSetup, Schedule};
use crate::math::{Hit, Rgb};
use crate::render::{Options, Session};
use crate::scene::MaterialRecord;
use crate::world::Transport;

/// Longer side of the small image whose paths are traced, in pixels, and samples per pixel.
const LONGER_SIDE: u32 = 24;
const SAMPLES: u32 = 4;
/// The fraction of the camera's light that must be lost for a finding.
const WORTH: f32 = 0.01;
/// The fraction that may be lost at the suggested depth, and the largest depth to suggest.
const LITTLE: f32 = 0.002;
const DEEPEST: u32 = 1024;

pub(super) fn check(checked: &Checked, setup: &RenderSetup, findings: &mut Vec<Diagnostic>) {
    findings.extend(without_caustics(checked, setup));
    // Limits by kind of bounce end paths intentionally.
    let bends = checked.scene.materials.iter().any(|material| material.encloses && material.refracts());
    if setup.transport != Transport::Path || !bends || setup.limits.is_some() {
        return;
    }
    let lost = lost_in_glass(setup, setup.max_depth);
    let all: f32 = lost.values().sum();
    let Some((entity, most)) = lost.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    if all < WORTH {
        return;
    }
    let depths = (3..).map(|power| 1 << power).filter(|depth| *depth > setup.max_depth);
    let mut deeper = depths.take_while(|depth| *depth <= DEEPEST);
    let enough = deeper.find(|depth| lost_in_glass(setup, *depth).values().sum::<f32>() <= LITTLE);
    let name = checked.name(entity);
    let others = if most < 0.9 * all { " and other glass" } else { "" };
    let what = format!(
        "{:.0} % of the light that the camera would see is lost inside \"{}\"{others}, where paths end after {} bounces",
        100.0 * all,
        words(&name),
        setup.max_depth
    );
    let remedy = match enough {
        Some(depth) => format!("`--depth {depth}`"),
        None => "a higher `--depth`; if that does not help, the glass lets no light out".into(),
    };
    findings.push(finding("depth-in-glass", None, what, remedy));
}

/// Finds glass whose light a limit on matte bounces leaves out: no light gets to the shadow of glass without photons.
fn without_caustics(checked: &Checked, setup: &RenderSetup) -> Option<Diagnostic> {
    let scene = checked.scene;
    let throws = |material: &MaterialRecord| material.makes_caustics() && material.refracts();
    let is_missed = setup.photons == Err(NoPhotons::NoBounces)
        && setup.chooses_photons
        && setup.max_depth > 0
        && !scene.emitters.is_empty()
        && scene.materials.iter().any(throws)
        && scene.materials.iter().any(|material| material.ends_photons_under(setup.transport));
    is_missed.then(|| {
        let what = "diffuse_depth: 0 leaves out the light that glass throws on matte surfaces (caustics)";
        finding("no-caustics", None, what, "`--diffuse-depth 1`, or `--caustics off`")
    })
}

/// Returns the fraction of the camera's light that is lost where paths end at glass or within it, by the glass's
/// entity.
fn lost_in_glass(setup: &RenderSetup, max_depth: u32) -> BTreeMap<u32, f32> {
    let small = Arc::new(RenderSetup { max_depth, ..setup.small(LONGER_SIDE) });
    let paths = (small.size[0] * small.size[1] * SAMPLES) as f32;
    let scene = small.scene.clone();
    let mut lost: BTreeMap<u32, f32> = BTreeMap::new();
    let mut last: Option<(Hit, f32)> = None;
    // The recursive schedule traces one path after another.
    let options = Options { schedule: Schedule::Recursive, ..Options::default() };
    Session::of(small, SAMPLES, options).observe(None, &mut |event| {
        let Event::Sample(_, what) = event else { return };
        match *what {
            EventKind::Ray { throughput: [r, g, b], hit, .. } => {
                last = Some((hit, Rgb::new(r, g, b).luminance()))
            }
            EventKind::Choice { fate: PathEvent::Last, .. } => {
                let Some((hit, part)) = last.take().filter(|(hit, _)| !hit.is_miss()) else { return };
                let material = scene.geometry.material_of(hit.primitive, hit.instance) as usize;
                if scene.materials[material].encloses && scene.materials[material].refracts() {
                    *lost.entry(scene.geometry.entity_of(hit.primitive, hit.instance)).or_default() +=
                        part / paths;
                }
            }
            _ => {}
        }
    });
    lost
}
