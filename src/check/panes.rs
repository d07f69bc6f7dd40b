//! Panes of solid glass, which block the light of emitters without a surface.

use super::probes::{Met, ProbeTracer};
use super::{Checked, finding, is_smooth};
use crate::compile::light_names;
use crate::error::{Diagnostic, Subject, words};
use crate::math::Vec3;
use crate::scene::emitter_rows::{DirectionalRow, PlanarRow, PointRow, SphereRow};
use crate::scene::emitters::{flag, kind};
use crate::scene::{MaterialRecord, WhittedLight};
use crate::world::{Caustics, Transport};

/// The fraction of the places facing a light that a pane must darken for a finding.
const MANY: f32 = 0.1;
/// The most lights that are tested.
const MOST: usize = 32;

/// The position of a light, as seen from the scene.
enum Whereabouts {
    Place(Vec3),
    /// The direction to an infinitely distant light.
    Direction(Vec3),
}

pub(super) fn check(checked: &Checked, findings: &mut Vec<Diagnostic>) {
    let Checked { world, scene, .. } = checked;
    // Refracted light comes from photons, or from paths that hit the surfaces of emitters.
    let settings = &world.settings;
    let has_photons = settings.caustics != Caustics::Off;
    let is_pane =
        |material: &MaterialRecord| is_pane(material) && !(has_photons && material.makes_caustics());
    if settings.transport != Transport::Path || !scene.materials.iter().any(is_pane) {
        return;
    }
    let mut tracer = ProbeTracer::to_lights(scene);
    for (light, name) in scene.lights.iter().zip(light_names(world)).take(MOST) {
        let Some((pane, part)) = pane_before(checked, &mut tracer, light, &is_pane) else { continue };
        let pane = words(&checked.name(pane));
        let part = 100.0 * part;
        findings.push(finding("dark-glass", 
            Some(Subject::named(name)),
            format!("the glass of \"{pane}\" keeps its light from {part:.0} % of what it would light: paths do not find this lamp behind it, and no photons bring its light"),
            remedy(has_photons),
        ));
    }
}

/// Returns the remedy.
fn remedy(has_photons: bool) -> &'static str {
    if has_photons {
        "make the glass clear (transmission: 1, without a texture), or a thin sheet, which lets light straight through: Principled(metallic: 0, roughness: 0, transmission: 1) without a volume"
    } else {
        "`--caustics auto`, or make the glass a thin sheet, which lets light straight through: Principled(metallic: 0, roughness: 0, transmission: 1) without a volume"
    }
}

/// Returns the first pane between the visible surfaces and a light without a surface, and the fraction of places that
/// it darkens.
fn pane_before(
    checked: &Checked,
    tracer: &mut ProbeTracer,
    light: &WhittedLight,
    is_pane: &dyn Fn(&MaterialRecord) -> bool,
) -> Option<(u32, f32)> {
    let scene = checked.scene;
    let (kind, row) = scene.emitters.row(light.emitter);
    if scene.emitters.flags[light.emitter as usize] & flag::VISIBLE != 0 {
        return None;
    }
    let whereabouts = match kind {
        kind::DIRECTIONAL => Whereabouts::Direction(DirectionalRow::of(row).to_light),
        kind::SPHERE => Whereabouts::Place(SphereRow::of(row).center),
        kind::POINT | kind::SPOT | kind::PHOTOMETRIC => Whereabouts::Place(PointRow::of(row).position),
        _ => {
            let PlanarRow { corner, e1, e2, .. } = PlanarRow::of(row);
            Whereabouts::Place(corner + (e1 + e2) * 0.5)
        }
    };
    let (mut lit, mut kept_out, mut pane) = (0u32, 0u32, None);
    for (features, place) in checked.probes.seen().filter(|(features, _)| features.coverage == 1.0) {
        let (to, distance) = match whereabouts {
            Whereabouts::Direction(to) => (to, f32::INFINITY),
            Whereabouts::Place(lamp) => ((lamp - place).normalize_or_zero(), 0.98 * (lamp - place).length()),
        };
        if Vec3::from_array(features.normal).dot(to) <= 0.0 {
            continue;
        }
        match tracer.first(place, to, distance) {
            None => lit += 1,
            Some(Met { material, entity, .. }) if is_pane(&scene.materials[material as usize]) => {
                kept_out += 1;
                pane.get_or_insert(entity);
            }
            Some(_) => {}
        }
    }
    let part = kept_out as f32 / (lit + kept_out).max(1) as f32;
    pane.filter(|_| part > MANY).map(|pane| (pane, part))
}

/// True for smooth glass that refracts.
fn is_pane(material: &MaterialRecord) -> bool {
    !material.passes_shadow_rays
        && !material.thin
        && material.transmission.factor > 0.5
        && is_smooth(material)
}
