//! Checks that light reaches the visible surfaces, and finds the cause if not.

use super::probes::{Met, ProbeTracer, directions};
use super::{Checked, finding};
use crate::compile::{emits, no_light};
use crate::error::{Diagnostic, words};
use crate::math::{DAffine3, DVec3, Rgb, Vec3};
use crate::scene::material::Coverage;
use crate::world::{Light, Transport, transforms};

/// The number of rays from each light.
const RAYS: u32 = 64;
/// The most lights that are tested.
const MOST: usize = 32;

pub(super) fn check(checked: &Checked, findings: &mut Vec<Diagnostic>) {
    let Checked { world, scene, probes } = checked;
    let settings = &world.settings;
    let seen = probes.seen().next().is_some();
    let is_dark = seen && probes.dark() > 0.9;
    let around = !scene.environment.is_black();
    if !emits(scene) && (settings.transport == Transport::Whitted || !around) {
        if is_dark && around {
            findings.push(finding("surroundings-light-nothing", 
                None,
                "what is around the scene lights no surface under Whitted's transport, and there is no other light",
                "`--transport path`",
            ));
        } else if is_dark || !seen {
            findings.push(no_light());
        }
        return;
    }
    let is_whitted = settings.transport == Transport::Whitted;
    if is_whitted && scene.lights.is_empty() && scene.ambient.is_black() && seen && probes.dark() > 0.5 {
        let what = "what emits light lights nothing else under Whitted's transport, and no lamp does";
        findings.push(finding(
            "emission-lights-nothing",
            None,
            what,
            "`--transport path`, or add an entity with light: Point(power_w: 100)",
        ));
    }
    let Ok(mut placed) = transforms::to_world(world, &world.in_order()) else { return };
    transforms::relative_to(&mut placed, scene.origin);
    let mut tracers = LightTracers {
        blockers: ProbeTracer::from_lights(scene),
        surfaces: ProbeTracer::of_all_sides(scene),
    };
    let mut query = world.entities.query::<(hecs::Entity, &Light)>();
    let mut lamps: Vec<_> = query.iter().collect();
    lamps.sort_by_key(|(entity, _)| entity.id());
    for (entity, light) in lamps.into_iter().take(MOST) {
        let Some(matrix) = placed.get(&entity) else { continue };
        let subject = world.subject(entity);
        if power(light).is_black() {
            let what = format!("it shines with {}", nothing_of(light));
            findings.push(finding(
                "light-without-power",
                Some(subject),
                what,
                "give it more than 0, or leave it out",
            ));
            continue;
        }
        let Some(lamp) = PlacedLight::new(light, matrix) else { continue };
        findings.extend(
            lamp.fault(checked, &mut tracers, is_dark)
                .map(|(what, remedy)| finding("light-without-effect", Some(subject.clone()), what, remedy)),
        );
    }
}

/// Returns the places of lights that have one.
pub(super) fn places(checked: &Checked) -> Vec<Vec3> {
    let world = checked.world;
    let Ok(mut placed) = transforms::to_world(world, &world.in_order()) else { return Vec::new() };
    transforms::relative_to(&mut placed, checked.scene.origin);
    let mut query = world.entities.query::<(hecs::Entity, &Light)>();
    let all = query.iter().filter_map(|(entity, light)| PlacedLight::new(light, placed.get(&entity)?));
    all.map(|light| light.place).collect()
}

/// Returns a light's power, irradiance or radiance.
fn power(light: &Light) -> Rgb {
    match light {
        Light::Point { power_w, .. } | Light::Spot { power_w, .. } | Light::Photometric { power_w, .. } => {
            *power_w
        }
        Light::Area { power_w, radiance, .. } => *power_w + *radiance,
        Light::Directional { irradiance, .. } => *irradiance,
        Light::Environment { radiance, .. } | Light::Sky { radiance, .. } => *radiance,
    }
}

fn nothing_of(light: &Light) -> &'static str {
    match light {
        Light::Directional { .. } => "an irradiance of 0",
        Light::Environment { .. } | Light::Sky { .. } => "a radiance of 0",
        _ => "a power of 0 W",
    }
}

/// Tracers of rays from lights.
struct LightTracers<'a> {
    /// Hits what rays to the light are blocked by: of one-sided surfaces, the side that faces away from the light.
    blockers: ProbeTracer<'a>,
    /// Hits every surface from both sides.
    surfaces: ProbeTracer<'a>,
}

/// A light with a position.
struct PlacedLight {
    place: Vec3,
    /// The direction of −Z.
    axis: Vec3,
    /// The cosine of the angle to the axis beyond which it does not emit.
    cos_limit: f32,
}

impl PlacedLight {
    fn new(light: &Light, matrix: &DAffine3) -> Option<PlacedLight> {
        let cos_limit = match light {
            Light::Point { .. } | Light::Photometric { .. } => -1.0,
            Light::Spot { outer_angle, .. } => libm::cos(f64::from(*outer_angle)) as f32,
            Light::Area { .. } => 0.0,
            Light::Directional { .. } | Light::Environment { .. } | Light::Sky { .. } => return None,
        };
        let axis = matrix.transform_vector3(-glam::DVec3::Z).normalize().as_vec3();
        Some(PlacedLight { place: matrix.translation.as_vec3(), axis, cos_limit })
    }

    /// True if it emits into a direction.
    fn emits(&self, direction: Vec3) -> bool {
        direction.dot(self.axis) > self.cos_limit
    }

    /// Returns why it is useless, and a remedy.
    fn fault(
        &self,
        checked: &Checked,
        LightTracers { blockers, surfaces }: &mut LightTracers,
        is_dark: bool,
    ) -> Option<(String, String)> {
        if self.reaches_anything(checked, blockers) {
            return None;
        }
        let ways: Vec<Vec3> = directions(4 * RAYS).filter(|way| self.emits(*way)).collect();
        let step = (ways.len() / RAYS as usize).max(1);
        let met: Vec<Option<Met>> =
            ways.iter().step_by(step).map(|way| surfaces.first(self.place, *way, f32::INFINITY)).collect();
        // A cone that is too narrow for the directions still has its axis.
        let met =
            if met.is_empty() { vec![surfaces.first(self.place, self.axis, f32::INFINITY)] } else { met };
        if met.iter().all(Option::is_none) {
            let to = checked.scene.bounds.center() - self.place;
            let what = "it shines past everything";
            let DVec3 { x, y, z } = checked.scene.in_world(to + self.place);
            // A light that emits into all directions emits towards the scene, if from afar.
            let aims = self.cos_limit > -1.0;
            return (aims && (to.dot(self.axis) <= 0.0 || is_dark)).then(|| {
                (
                    format!("{what}: lamps shine along -Z"),
                    format!("turn it: LookAt(…, to: ({x:.3}, {y:.3}, {z:.3}))"),
                )
            });
        }
        let first = *met.iter().flatten().next()?;
        // Enclosed means in all directions, not only those it emits into.
        let enclosed = directions(RAYS).all(|way| {
            blockers.first(self.place, way, f32::INFINITY).is_some_and(|met| met.entity == first.entity)
        });
        let lets_out = |met: &Option<Met>| {
            met.is_some_and(|met| {
                let material = &checked.scene.materials[met.material as usize];
                material.coverage != Coverage::Whole
                    || !material.transmission.is_zero()
                    || !material.diffuse_transmission.is_zero()
            })
        };
        let name = words(&checked.name(first.entity));
        if enclosed
            && !met.iter().any(lets_out)
            && (is_dark || !is_around_the_camera(checked, surfaces, first.entity))
        {
            let what = format!("it is inside \"{name}\", which lets no light out");
            let remedy = match checked.world.settings.transport {
                Transport::Whitted => "move it out",
                Transport::Path => "move it out, or make that body shine itself: emission",
            };
            return Some((what, remedy.into()));
        }
        let seen: Vec<Vec3> = checked.probes.seen().map(|(_, place)| place).collect();
        let behind = !seen.is_empty()
            && seen.iter().all(|place| !self.emits((*place - self.place).normalize_or_zero()));
        if is_dark && behind {
            let at = seen[seen.len() / 2];
            let what = "it faces away from everything that is seen: lamps shine along -Z";
            return Some((
                what.into(),
                format!("turn it: LookAt(…, to: ({:.3}, {:.3}, {:.3}))", at.x, at.y, at.z),
            ));
        }
        is_dark.then(|| {
            let what = format!("nothing that is seen is lit by it: \"{name}\" stands between");
            (what, "move it, or what hides it".into())
        })
    }

    /// True if a ray from it reaches the visible side of a surface.
    fn reaches_anything(&self, checked: &Checked, tracer: &mut ProbeTracer) -> bool {
        checked.probes.seen().any(|(features, place)| {
            // The average of near and far places of a pixel may lie on no surface.
            const UNMIXED: f32 = 0.95;
            let is_one_place =
                features.coverage == 1.0 && Vec3::from_array(features.normal).length() > UNMIXED;
            if !is_one_place {
                return false;
            }
            let to = place - self.place;
            let (distance, direction) = (to.length(), to.normalize_or_zero());
            let is_before = Vec3::from_array(features.normal).dot(direction) < 0.0;
            is_before
                && self.emits(direction)
                && tracer
                    .first(self.place, direction, distance)
                    .is_none_or(|met| met.distance >= 0.98 * distance)
        })
    }
}

/// True if at least half of the rays around the camera hit an entity.
fn is_around_the_camera(checked: &Checked, tracer: &mut ProbeTracer, entity: u32) -> bool {
    let eye = checked.scene.camera.origin;
    let met: Vec<_> = directions(16).map(|way| tracer.first(eye, way, f32::INFINITY)).collect();
    met.iter().filter(|met| met.is_some_and(|met| met.entity == entity)).count() >= 8
}
