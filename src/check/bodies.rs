//! Nested bodies: checks that paths can track all of them, and that indices of refraction are absolute.

use super::materials::called;
use super::{Checked, finding};
use crate::bvh::Stack;
use crate::error::{Diagnostic, Subject};
use crate::math::Vector;
use crate::render::camera_medium::crossed;
use crate::world::{Material, World};

/// The most places that are tested.
const MOST: usize = 256;

pub(super) fn check(checked: &Checked, findings: &mut Vec<Diagnostic>) {
    let levels = checked.scene.bodies.levels();
    if let Some(names) = nested(checked, levels as usize) {
        findings.push(finding(
            "too-many-bodies",
            None,
            format!(
                "{} bodies are within each other in one place, and paths know of {levels}: {}",
                names.len(),
                names.join(", ")
            ),
            "close their surfaces, if some have holes; or fewer kinds of bodies",
        ));
    }
    findings.extend(thinner_than_air(checked.world));
}

/// Returns the names of bodies that overlap in one place, if they are more than a path can track.
fn nested(checked: &Checked, levels: usize) -> Option<Vec<String>> {
    let scene = checked.scene;
    if scene.materials.iter().all(|material| material.body == 0) {
        return None;
    }
    let mut stack = Stack::new(&scene.bvh);
    let far = scene.bounds.size().length();
    for (features, place) in checked.probes.seen().take(MOST) {
        // The ray goes straight through the visible surface.
        let [x, y, z] = features.normal.map(|c| -c);
        let direction = Vector::new(x, y, z);
        if direction.dot(direction) < 0.5 {
            continue;
        }
        let direction = direction.normalize();
        let origin = Vector::splat(place) - direction * far;
        let mut within: Vec<u32> = Vec::new();
        for surface in crossed(scene, origin, direction, &mut stack) {
            match within.iter().position(|entity| *entity == surface.entity) {
                Some(at) if surface.inside => {
                    within.remove(at);
                }
                None if !surface.inside => within.push(surface.entity),
                _ => {}
            }
            if within.len() > levels {
                return Some(within.into_iter().map(|entity| checked.name(entity)).collect());
            }
        }
    }
    None
}

/// Finds an index below that of air: before bodies knew their surroundings, such an index was the ratio of inside to
/// outside.
fn thinner_than_air(world: &World) -> Option<Diagnostic> {
    let ior = |material: &Material| match material {
        Material::BlinnPhong(material) => material.ior,
        Material::Principled(material) => material.volume.map(|_| material.ior),
    };
    let all = || world.assets.materials.iter().enumerate();
    let materials = || all().filter_map(|(number, named)| Some((number, named, ior(&named.material)?)));
    let (number, thin, ior) = materials().find(|(.., ior)| *ior > 0.0 && *ior < 1.0)?;
    materials().find(|(.., ior)| *ior > 1.0)?;
    Some(finding(
        "thinner-than-air",
        Some(Subject::named(called(world, number, thin))),
        format!(
            "its index of refraction is {ior}, below that of air; what is around a body is known from its surroundings"
        ),
        "ior: 1 for a bubble of air, wherever it is",
    ))
}
