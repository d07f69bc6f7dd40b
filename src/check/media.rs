//! Bodies that scatter light: checks that lights can illuminate them.

use super::{Checked, finding, is_smooth};
use crate::error::Diagnostic;
use crate::scene::MaterialRecord;
use crate::world::Transport;

pub(super) fn check(checked: &Checked, findings: &mut Vec<Diagnostic>) {
    let Checked { world, scene, .. } = checked;
    if world.settings.transport != Transport::Path {
        return;
    }
    // Rays find emissive materials, lamps with an extent and the environment.
    let emits = scene.materials.iter().any(MaterialRecord::emits)
        || !scene.emitters.unseen.placed.is_empty()
        || !scene.environment.is_black();
    let scatters = |material: &&MaterialRecord| {
        material.encloses
            && material.medium.scatters()
            && material.transmission.factor > 0.0
            && is_smooth(material)
            && !material.passes_shadow_rays
    };
    if !scene.lights.is_empty() && !emits && scene.materials.iter().any(|material| scatters(&material)) {
        findings.push(finding("unscattered-light", 
            None,
            "there is a body that scatters light, and none of the lamps' light is scattered in it: it bends light, and no ray within it finds the lamps that there are",
            "ior: 1 for fog; or use Area(…), Point(radius_m: 0.1, …) or an Environment, or diffuse_transmission: 1 instead of transmission",
        ));
    }
}
