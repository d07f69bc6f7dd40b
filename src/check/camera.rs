//! Checks that the camera sees the scene, and the units of its parameters.

use super::probes::{ProbeTracer, directions};
use super::{Checked, finding};
use crate::error::{Diagnostic, words};
use crate::math::Vec3;
use crate::scene::Projection;
use crate::shading::camera::pixel_width;

/// The number of rays around the camera.
const ABOUT: u32 = 64;

/// An angle of view below this, in degrees, was probably meant in radians.
const NARROW_DEG: f32 = 2.0;
/// A lens with a radius above this fraction of its focus distance was probably meant in millimetres.
const WIDE: f32 = 0.5;

/// Finds values that were probably meant in other units.
fn check_units(checked: &Checked, findings: &mut Vec<Diagnostic>) {
    let (Projection::Pinhole { tan_half_fov } | Projection::ThinLens { tan_half_fov, .. }) =
        checked.scene.camera.projection
    else {
        return;
    };
    let angle = 2.0 * libm::atan(f64::from(tan_half_fov)).to_degrees() as f32;
    if angle < NARROW_DEG {
        let what = format!("the camera's angle of view is {angle:.2} degrees: is it in radians?");
        let meant = angle.to_degrees();
        findings.push(finding("narrow-view", None, what, format!("vertical_fov_degrees: {meant:.0}")));
    }
    if let Projection::ThinLens { lens_radius, focus_distance, .. } = checked.scene.camera.projection
        && lens_radius > WIDE * focus_distance
    {
        let what = format!(
            "the lens's radius is {lens_radius} m, and it focuses on {focus_distance} m: is it in millimetres?"
        );
        findings.push(finding("large-lens", None, what, format!("lens_radius_m: {}", lens_radius / 1000.0)));
    }
}

pub(super) fn check(checked: &Checked, findings: &mut Vec<Diagnostic>) {
    let Checked { scene, probes, .. } = checked;
    check_units(checked, findings);
    if is_a_dot(checked) {
        let size = scene.bounds.size().length();
        findings.push(finding(
            "tiny-scene",
            None,
            format!("everything is smaller than two pixels: the scene is {size:.1e} m across"),
            format!("move the camera nearer to {}", text(checked, scene.bounds.center())),
        ));
        return;
    }
    if probes.coverage() == 0.0 {
        // Small objects may lie between the rays.
        if !is_in_the_image(checked) {
            findings.push(sees_nothing(checked));
        }
        return;
    }
    // An entity that surrounds the camera is a body that the camera is in, unless it is the intended view: a room
    // contains other entities, or light enters it.
    let eye = scene.camera.origin;
    let mut tracer = ProbeTracer::new(scene);
    let met: Vec<_> = directions(ABOUT).map(|way| tracer.first(eye, way, f32::INFINITY)).collect();
    let Some(Some(first)) = met.first() else { return };
    let all_one = met.iter().all(|met| met.is_some_and(|met| met.entity == first.entity));
    let others = scene.geometry.parts.entity.iter().chain(&scene.geometry.instance_entities);
    let is_alone = others.copied().all(|entity| entity == first.entity);
    let material = &scene.materials[first.material as usize];
    if all_one && !is_alone && probes.dark() > 0.5 && !material.emits() {
        let (name, far) = (checked.name(first.entity), farthest(&met));
        findings.push(finding(
            "camera-inside",
            None,
            format!("the camera is inside \"{}\" and sees nothing else", words(&name)),
            format!("move it by more than {far:.3} m, or take the body away"),
        ));
    }
}

fn farthest(met: &[Option<super::probes::Met>]) -> f32 {
    met.iter().flatten().map(|met| met.distance).fold(0.0, f32::max)
}

/// True if the scene lies in the image but covers at most two pixels.
fn is_a_dot(checked: &Checked) -> bool {
    let (camera, bounds) = (&checked.scene.camera, checked.scene.bounds);
    let depth = (bounds.center() - camera.origin).dot(camera.forward);
    let (wide, wider) = pixel_width(camera, checked.world.settings.size[1] as f32);
    depth > 0.0 && bounds.size().length() < 2.0 * (wide + wider * depth)
}

/// True if the scene's bounding box may lie in the image: if its centre or a corner does.
fn is_in_the_image(checked: &Checked) -> bool {
    let (camera, bounds) = (&checked.scene.camera, checked.scene.bounds);
    let [width, height] = checked.world.settings.size.map(|side| side as f32);
    let is_seen = |place: Vec3| {
        let to = place - camera.origin;
        let depth = to.dot(camera.forward);
        let (wide, wider) = pixel_width(camera, height);
        let pixel = wide + wider * depth;
        depth > 0.0
            && to.dot(camera.right).abs() <= 0.5 * width * pixel
            && to.dot(camera.up).abs() <= 0.5 * height * pixel
    };
    let corner = |i: usize| {
        let side = |bit: usize| if i >> bit & 1 == 1 { bounds.max } else { bounds.min };
        Vec3::new(side(0).x, side(1).y, side(2).z)
    };
    is_seen(bounds.center()) || (0..8).map(corner).any(is_seen)
}

/// Formats a place in the scene as in a scene file.
fn text(checked: &Checked, place: Vec3) -> String {
    let v = checked.scene.in_world(place);
    format!("({:.4}, {:.4}, {:.4})", v.x, v.y, v.z)
}

/// Describes where the scene is, with a transform that faces it.
fn sees_nothing(checked: &Checked) -> Diagnostic {
    let (camera, bounds) = (&checked.scene.camera, checked.scene.bounds);
    let center = bounds.center();
    let to = center - camera.origin;
    let ahead = to.dot(camera.forward);
    let inside = (camera.origin.clamp(bounds.min, bounds.max) - camera.origin).length() == 0.0;
    let where_to = if ahead < 0.0 && !inside { "behind it" } else { "outside its view" };
    // A camera at the centre cannot face it: move it outside.
    let is_at_center = to.length() < 0.01 * bounds.size().length();
    let from = if is_at_center { center - camera.forward * bounds.size().length() } else { camera.origin };
    finding(
        "nothing-in-view",
        None,
        format!("the camera sees nothing: everything is {where_to}, about {}", text(checked, center)),
        format!("transform: LookAt(from: {}, to: {})", text(checked, from), text(checked, center)),
    )
}
