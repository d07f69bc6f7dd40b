//! Checks that the camera sees the scene, and the units of its parameters.

use super::probes::{ProbeTracer, directions};
use super::{Checked, finding, lights};
use crate::error::{Diagnostic, words};
use crate::math::{Vec3, Vector};
use crate::scene::material::Coverage;
use crate::scene::{HalfSize, Lens, Projection};
use crate::shading::camera::CameraImage;
use crate::world::{Shape, StereoLayout, Transport};

/// The number of rays around the camera.
const ABOUT: u32 = 64;
/// Their number where the image is not dark, and something small may be beside the camera.
const MORE: u32 = 1024;

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
    findings.extend(inside(checked));
}

/// The one entity that rays from the camera meet, whatever their direction.
pub(super) struct Enclosure {
    entity: u32,
    material: u32,
    /// True if all rays meet the backs of triangles.
    is_from_behind: bool,
    /// The shortest way out: its length and direction.
    way_out: (f32, Vec3),
}

impl Enclosure {
    /// The enclosure of a place, by a number of rays; none if rays escape or meet several entities.
    fn of(tracer: &mut ProbeTracer, place: Vec3, rays: u32) -> Option<Enclosure> {
        let mut found: Option<Enclosure> = None;
        for way in directions(rays) {
            let met = tracer.first(place, way, f32::INFINITY)?;
            let all = found.get_or_insert(Enclosure {
                entity: met.entity,
                material: met.material,
                is_from_behind: true,
                way_out: (f32::INFINITY, way),
            });
            if met.entity != all.entity {
                return None;
            }
            all.is_from_behind &= met.back;
            if met.distance < all.way_out.0 {
                all.way_out = (met.distance, way);
            }
        }
        found
    }

    fn finding(&self, checked: &Checked, seen: &str) -> Diagnostic {
        let name = checked.name(self.entity);
        let (far, way) = self.way_out;
        let outside = text(checked, checked.scene.camera.origin + way * (1.5 * far));
        finding(
            "camera-inside",
            None,
            format!("the camera is inside \"{}\" and sees {seen}", words(&name)),
            format!("move it by more than {far:.3} m, such as to {outside}, or take the body away"),
        )
    }
}

/// Finds a camera inside an entity of which only the fronts are visible, with a tracer that sees all sides.
pub(super) fn behind(checked: &Checked, tracer: &mut ProbeTracer, entity: u32) -> Option<Diagnostic> {
    let around = Enclosure::of(tracer, checked.scene.camera.origin, ABOUT)?;
    let is_body = around.entity == entity && around.is_from_behind;
    is_body.then(|| around.finding(checked, "through its surfaces, which are there from their front alone"))
}

/// Finds a camera inside an entity that hides all else, unless that is the intended view: a room contains other entities,
/// or light enters it, or a lamp is in it.
fn inside(checked: &Checked) -> Option<Diagnostic> {
    let scene = checked.scene;
    let eye = scene.camera.origin;
    let mut tracer = ProbeTracer::new(scene);
    let around = Enclosure::of(&mut tracer, eye, ABOUT)?;
    let material = &scene.materials[around.material as usize];
    let emits = material.emits() || material.unlit;
    let is_dark = checked.probes.dark() > 0.5 && !emits;
    // An entity that is small in the image escapes the rays about the camera.
    let is_other = |entity: u32| entity != 0 && entity != around.entity + 1;
    let sees_other = checked.probes.seen().any(|(features, _)| is_other(features.entity));
    if sees_other || has_lamp_beside(checked, &mut tracer) {
        return None;
    }
    if !is_dark {
        let others = scene.geometry.parts.entity.iter().chain(&scene.geometry.instance_entities);
        let is_alone = others.copied().all(|entity| entity == around.entity);
        let is_body = around.is_from_behind || is_ball(checked, around.entity);
        let is_solid = !material.lets_through() && material.coverage == Coverage::Whole;
        // A picture may be all around the camera. Under the path transport, what lights its inside is there, too.
        let lights_itself = checked.world.settings.transport == Transport::Path && !emits;
        let is_meant = (is_alone && emits) || lights_itself;
        if !is_body || !is_solid || is_meant {
            return None;
        }
        Enclosure::of(&mut tracer, eye, MORE)?;
    }
    Some(around.finding(checked, "nothing else"))
}

/// True if an entity is a sphere, of which no hit tells the side.
fn is_ball(checked: &Checked, number: u32) -> bool {
    let mut entities = checked.world.entities.iter();
    let found = entities.find(|entity| entity.entity().id() == number);
    found.is_some_and(|found| {
        found.get::<&Shape>().is_some_and(|shape| matches!(*shape, Shape::Sphere { .. }))
    })
}

/// True if nothing is between the camera and some lamp.
fn has_lamp_beside(checked: &Checked, tracer: &mut ProbeTracer) -> bool {
    let eye = checked.scene.camera.origin;
    lights::places(checked).into_iter().any(|place| {
        let distance = (place - eye).length();
        distance == 0.0 || tracer.first(eye, (place - eye) / distance, distance).is_none()
    })
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
