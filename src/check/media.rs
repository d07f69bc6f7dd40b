//! Bodies that scatter or absorb light: whether the camera is in one, and whether lamps light it.

use super::probes::{Tracer, directions};
use super::{Checked, Finding, is_smooth};
use crate::error::words;
use crate::scene::Material;
use crate::world::Transport;

/// Rays that ask whether the camera is within a body.
const RAYS: u32 = 8;
/// The most surfaces that a ray is followed through.
const MOST: usize = 64;

pub(super) fn check(checked: &Checked, findings: &mut Vec<Finding>) {
    let Checked { world, scene, .. } = checked;
    let acts = |material: &Material| material.encloses && !material.medium.is_clear();
    if world.settings.transport != Transport::Path || !scene.materials.iter().any(acts) {
        return;
    }
    if let Some(body) = around_the_camera(checked, acts) {
        let body = words(&checked.name(body));
        findings.push(Finding::new(
            None,
            format!("the camera is within \"{body}\", and its paths begin in air: nothing on them is absorbed or scattered there"),
            "move the camera out of it",
        ));
    }
    // What rays can hit has a material, or is all around.
    let shines = scene.materials.iter().any(Material::emits) || !scene.environment.is_black();
    let scatters = |material: &&Material| {
        acts(material)
            && material.medium.albedo.iter().any(|part| *part > 0.0)
            && material.transmission.factor > 0.0
            && is_smooth(material)
    };
    if !scene.lights.is_empty() && !shines && scene.materials.iter().any(|material| scatters(&material)) {
        findings.push(Finding::new(
            None,
            "there is a body that scatters light, and no light gets into it: no ray can hit the lamps that there are",
            "use Area(visible: true, …) or an Environment, or diffuse_transmission: 1 instead of transmission",
        ));
    }
}

/// A body with such a material in which the camera is: rays from there leave it once more often than they enter it.
fn around_the_camera(checked: &Checked, acts: impl Fn(&Material) -> bool) -> Option<u32> {
    let scene = checked.scene;
    let mut tracer = Tracer::new(scene);
    let mut counts: Vec<(u32, u32)> = Vec::new();
    for way in directions(RAYS) {
        let mut place = scene.camera.origin;
        let mut passed: Vec<(u32, u32)> = Vec::new();
        for _ in 0..MOST {
            let Some(met) = tracer.first(place, way, f32::INFINITY) else { break };
            place += way * met.distance;
            if acts(&scene.materials[met.material as usize]) {
                add(&mut passed, met.entity, 1);
            }
        }
        passed
            .iter()
            .filter(|(_, times)| times % 2 == 1)
            .for_each(|(entity, _)| add(&mut counts, *entity, 1));
    }
    counts.into_iter().find(|(_, ways)| *ways > 3 * RAYS / 4).map(|(entity, _)| entity)
}

fn add(counts: &mut Vec<(u32, u32)>, entity: u32, more: u32) {
    match counts.iter_mut().find(|(known, _)| *known == entity) {
        Some((_, count)) => *count += more,
        None => counts.push((entity, more)),
    }
}
