//! Checks that the camera sees the scene, and the units of its parameters.

use super::probes::{ProbeTracer, directions};
use super::{Checked, finding};
use crate::error::{Diagnostic, words};
use crate::math::{Vec3, Vector};
use crate::scene::{HalfSize, Lens, Projection};
use crate::shading::camera::CameraImage;
use crate::world::StereoLayout;

/// The number of rays around the camera.
const ABOUT: u32 = 64;

/// An angle of view below this, in degrees, was probably meant in radians.
const NARROW_DEG: f32 = 2.0;
/// A lens with a radius above this fraction of its focus distance was probably meant in millimetres.
const WIDE: f32 = 0.5;

/// Finds values that were probably meant in other units.
fn check_units(checked: &Checked, findings: &mut Vec<Diagnostic>) {
    let (Projection::Pinhole(view) | Projection::ThinLens { view, .. }) = checked.scene.camera.projection
    else {
        return;
    };
    // Others have no angle and no radius that were typed.
    let HalfSize::Height(tan_half_fov) = view.half else { return };
    let angle = 2.0 * libm::atan(f64::from(tan_half_fov)).to_degrees() as f32;
    if angle < NARROW_DEG {
        let what = format!("the camera's angle of view is {angle:.2} degrees: is it in radians?");
        let meant = angle.to_degrees();
        findings.push(finding("narrow-view", None, what, format!("vertical_fov_degrees: {meant:.0}")));
    }
    if let Projection::ThinLens { lens: Lens { radius: lens_radius, focus, .. }, .. } =
        checked.scene.camera.projection
        && lens_radius * focus.length() > WIDE
    {
        let focus_distance = 1.0 / focus.length();
        let what = format!(
            "the lens's radius is {lens_radius} m, and it focuses on {focus_distance} m: is it in millimetres?"
        );
        findings.push(finding("large-lens", None, what, format!("lens_radius_m: {}", lens_radius / 1000.0)));
    }
}

/// Finds a panorama whose image has another shape than its angles.
fn stretched(checked: &Checked) -> Option<Diagnostic> {
    let camera = &checked.scene.camera;
    let Projection::Panorama { half_turns: [across, above] } = camera.projection else { return None };
    let [width, height] = checked.world.settings.size;
    let eyes = match camera.stereo.map(|pair| pair.layout) {
        None | Some(StereoLayout::Left | StereoLayout::Right) => [1, 1],
        Some(StereoLayout::SideBySide) => [2, 1],
        Some(StereoLayout::OverUnder) => [1, 2],
    };
    let rows = f64::from(width) / f64::from(eyes[0]) * f64::from(above / across) * f64::from(eyes[1]);
    let fitting = rows.round().max(1.0) as u32;
    if fitting.abs_diff(height) <= height / 50 + 1 {
        return None;
    }
    let degrees = [across, above].map(|half| (720.0 * half).round());
    let what = format!(
        "the panorama is stretched: {} x {} degrees are an image of {width} x {height} pixels",
        degrees[0], degrees[1]
    );
    Some(finding("stretched-panorama", None, what, format!("size: ({width}, {fitting})")))
}

pub(super) fn check(checked: &Checked, findings: &mut Vec<Diagnostic>) {
    let Checked { scene, probes, .. } = checked;
    check_units(checked, findings);
    findings.extend(stretched(checked));
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
    let ways: Vec<Vec3> = directions(ABOUT).collect();
    let met: Vec<_> = ways.iter().map(|way| tracer.first(eye, *way, f32::INFINITY)).collect();
    let Some(Some(first)) = met.first() else { return };
    let all_one = met.iter().all(|met| met.is_some_and(|met| met.entity == first.entity));
    let others = scene.geometry.parts.entity.iter().chain(&scene.geometry.instance_entities);
    let is_alone = others.copied().all(|entity| entity == first.entity);
    let material = &scene.materials[first.material as usize];
    if all_one && !is_alone && probes.dark() > 0.5 && !material.emits() {
        let name = checked.name(first.entity);
        let (far, way) = nearest(&met, &ways);
        let outside = text(checked, eye + way * (1.5 * far));
        findings.push(finding(
            "camera-inside",
            None,
            format!("the camera is inside \"{}\" and sees nothing else", words(&name)),
            format!("move it by more than {far:.3} m, such as to {outside}, or take the body away"),
        ));
    }
}

/// The shortest way out: its length and direction.
fn nearest(met: &[Option<super::probes::Met>], ways: &[Vec3]) -> (f32, Vec3) {
    let lengths = met.iter().map(|met| met.map_or(f32::INFINITY, |met| met.distance));
    let ways = lengths.zip(ways.iter().copied());
    ways.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, Vec3::ZERO))
}

/// True if the scene lies in the image but covers at most two pixels.
fn is_a_dot(checked: &Checked) -> bool {
    let (camera, bounds) = (&checked.scene.camera, checked.scene.bounds);
    let to = bounds.center() - camera.origin;
    let depth = if camera.is_flat() { to.dot(camera.forward) } else { to.length() };
    let (wide, wider) = CameraImage::new(camera, checked.world.settings.size).pixel_width();
    depth > 0.0 && bounds.size().length() < 2.0 * (wide + wider * depth)
}

/// True if the scene's bounding box may lie in the image: if its centre or a corner does.
fn is_in_the_image(checked: &Checked) -> bool {
    let (camera, bounds) = (&checked.scene.camera, checked.scene.bounds);
    let size = checked.world.settings.size;
    let [width, height] = size.map(|side| side as f32);
    let image = CameraImage::new(camera, size);
    let is_seen = |place: Vec3| {
        let point = image.project::<f32>(None, Vector::splat(place), (0.5, 0.5));
        point.seen && (0.0..=width).contains(&point.column) && (0.0..=height).contains(&point.row)
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
