//! Single-sided surfaces seen from behind.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::probes::ProbeTracer;
use super::{Checked, camera, finding};
use crate::bvh::Sidedness;
use crate::error::Diagnostic;
use crate::scene::CompiledScene;
use crate::shading::camera::CameraImage;

/// The number of rays along the longer side of the image.
const LONGER_SIDE: u32 = 48;
/// A surface must be missing in at least this fraction of the image.
const WORTH: f32 = 0.05;

pub(super) fn check(checked: &Checked, findings: &mut Vec<Diagnostic>) {
    let scene = checked.scene;
    if !scene.materials.iter().any(|material| material.hides_back) {
        return;
    }
    let everywhere = with_all_sides(scene);
    let [mut seen, mut whole] = [ProbeTracer::new(scene), ProbeTracer::new(&everywhere)];
    // By entity: rays that hit its hidden back first, and rays that hit it otherwise.
    let mut counts: BTreeMap<u32, [u32; 2]> = BTreeMap::new();
    let image = CameraImage::new(&scene.camera, checked.world.settings.size);
    let [width, height] = checked.world.settings.size.map(|side| side as f32);
    let step = width.max(height) / LONGER_SIDE as f32;
    let (columns, rows) = ((width / step).ceil() as u32, (height / step).ceil() as u32);
    for (column, row) in (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))) {
        let [x, y] = [(column as f32 + 0.5) * step, (row as f32 + 0.5) * step];
        let (ray, exists) = image.ray((x, y), (x, y), (0.0f32, 0.0f32));
        if !exists {
            continue;
        }
        let (origin, way) = (ray.origin.into(), ray.direction.into());
        let Some(first) = whole.first(origin, way, f32::INFINITY) else { continue };
        let passes = seen.first(origin, way, f32::INFINITY).is_none_or(|met| met.distance > first.distance);
        counts.entry(first.entity).or_default()[usize::from(!(first.back && passes))] += 1;
    }
    let worth = WORTH * (columns * rows) as f32;
    // Many entities that are each small in the image count if they cover most of the scene's area in it.
    let most = counts.values().map(|[missed, met]| (missed + met) as f32).sum::<f32>() / 2.0;
    let from_behind = |[missed, met]: [u32; 2]| missed > 10 * met;
    let all: f32 =
        counts.values().filter(|count| from_behind(**count)).map(|[missed, _]| *missed as f32).sum();
    for (entity, [missed, met]) in counts {
        if (missed as f32 > worth || all > most) && from_behind([missed, met]) {
            let hidden = || {
                finding(
                    "hidden-back",
                    Some(checked.subject(entity)),
                    "it is seen from behind, and its surfaces are there from their front alone",
                    "double_sided: true in its material, `--double-sided` for models, or turn it",
                )
            };
            findings.push(camera::behind(checked, &mut whole, entity).unwrap_or_else(hidden));
        }
    }
}

/// Returns the scene with all surfaces visible from both sides.
fn with_all_sides(scene: &CompiledScene) -> CompiledScene {
    let mut scene = scene.clone();
    let placed = vec![None; scene.bvh.instances.len()];
    Arc::make_mut(&mut scene.bvh).set_sidedness(|_| Sidedness::Always, &placed);
    scene
}
