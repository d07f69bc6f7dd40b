//! Checks that the sizes of the scene and of its lights fit together.

use super::{Checked, finding};
use crate::error::Diagnostic;
use crate::world::Light;

/// A scene larger than this, in metres, with lights in watts is probably written in another unit.
const HUGE_M: f32 = 1000.0;
/// A scene smaller than this, in metres, is too.
const TINY_M: f32 = 1e-3;

pub(super) fn check(checked: &Checked, findings: &mut Vec<Diagnostic>) {
    let Checked { world, scene, probes } = checked;
    let size = scene.bounds.size().length();
    let lamps = world.entities.query::<&Light>().iter().filter(|light| has_power(light)).count();
    // Little is left of a few watts of light a kilometre away.
    if let Some(light) = probes.light.as_ref().filter(|_| lamps > 0 && probes.dark() < 1.0) {
        let most = light.iter().map(|pixel| pixel.max_component()).fold(0.0, f32::max);
        if size > HUGE_M && most > 0.0 && most < 1e-3 {
            findings.push(finding("large-scene", 
                None,
                format!("the scene is {size:.0} m across, and its lamps, which shine with watts, are lost in it"),
                "is it in millimetres? put all of it under an entity with transform: (scale: 0.001), or `--exposure auto`",
            ));
        }
        if size < TINY_M && most > 1e3 {
            findings.push(finding("small-scene", 
                None,
                format!("the scene is {size:.1e} m across, so near to its lamps that everything is white"),
                "is it in metres? put all of it under an entity with transform: (scale: 1000), or `--exposure auto`",
            ));
        }
    }
}

/// True if a light gets weaker with distance.
fn has_power(light: &Light) -> bool {
    matches!(light, Light::Point { .. } | Light::Spot { .. } | Light::Photometric { .. } | Light::Area { .. })
}
