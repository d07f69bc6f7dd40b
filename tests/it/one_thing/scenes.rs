//! Lights, cameras, movements, axes and ids, as glTF files and as scenes write them.

use std::collections::HashSet;

use rayfront::formats::{LightUnits, LoadOptions, UpAxis, load_with};
use rayfront::math::DVec3;
use serde_json::{Value, json};

use super::files::{Number, Paint, obj, objects, ply, stl};
use super::gltf::{Encoding, Mover, gltf, moving};
use super::solid::Solid;
use super::{Comparison, EXACT, PLACES, Seen, Stage, at, rounded};
use crate::program::{Folder, Place, empty_folder};

/// An entity that shows a white box, and its file.
fn white_block(folder: &Folder, center: DVec3) -> &'static str {
    folder.write("block.ply", ply(&Solid::block(center), "ascii", Number::Double, Number::Byte, Paint::None));
    "(shape: Mesh(\"block.ply\"), material: \"white\"),"
}

/// A place and a direction, beside a centre.
#[derive(Clone, Copy)]
struct Aim {
    from: [f64; 3],
    to: [f64; 3],
}

impl Aim {
    fn transform(self, center: DVec3) -> String {
        format!("LookAt(from: {}, to: {})", at(center, self.from), at(center, self.to))
    }

    /// A glTF file whose only node is there: a turn about X, then about +Y.
    fn file(self, center: DVec3, mut node: Value, more: Value) -> Vec<u8> {
        let [x, y, z] = (DVec3::from(self.to) - DVec3::from(self.from)).normalize().to_array();
        let ((sy, cy), (sx, cx)) = ((f64::atan2(-x, -z) * 0.5).sin_cos(), (y.asin() * 0.5).sin_cos());
        node["translation"] = json!((center + DVec3::from(self.from)).to_array());
        node["rotation"] = json!([cy * sx, sy * cx, -sy * sx, cy * cx]);
        let mut file =
            json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [node]});
        if let (Value::Object(file), Value::Object(more)) = (&mut file, more) {
            file.extend(more);
        }
        file.to_string().into_bytes()
    }
}

/// Candela and lux of glTF files are a scene's watts per steradian and per square metre, unless the unit is the watt: then
/// 683 of them are one.
#[test]
fn lamps_give_the_same_light_in_all_formats() {
    const COLOR: [f64; 3] = [1.0, 0.5, 0.25];
    let colored = |factor: f64| {
        let [r, g, b] = COLOR.map(|channel| channel * factor);
        format!("({r}, {g}, {b})")
    };
    let sphere = 4.0 * std::f64::consts::PI;
    let degrees = |angle: f64| angle.to_degrees();
    // The type, the intensity, the cone in radians, and the light of a scene.
    let lamps = [
        ("point", 25.0, None, format!("Point(power_w: {})", colored(25.0 * sphere))),
        ("directional", 3.0, None, format!("Directional(irradiance: {})", colored(3.0))),
        (
            "spot",
            60.0,
            Some([0.1, 0.35]),
            format!(
                "Spot(power_w: {}, inner_degrees: {}, outer_degrees: {})",
                colored(60.0 * sphere),
                degrees(0.1),
                degrees(0.35)
            ),
        ),
        (
            "spot",
            60.0,
            Some([0.0, std::f64::consts::FRAC_PI_4]),
            format!("Spot(power_w: {}, inner_degrees: 0, outer_degrees: 45)", colored(60.0 * sphere)),
        ),
    ];
    let folder = &empty_folder();
    let aim = Aim { from: [1.0, 1.7, 1.3], to: [0.1, 0.2, 0.0] };
    for (kind, intensity, cone, light) in lamps {
        for transport in ["Path", "Whitted"] {
            let mut comparison = Comparison::default();
            for center in PLACES {
                let block = white_block(folder, center);
                let mut stage = Stage { transport, ..Stage::at(center) };
                stage.lights = format!("(light: {light}, transform: {}),", aim.transform(center));
                comparison.add(format!("{light} at {center}"), stage.render(folder, block), EXACT);
                for (units, factor) in [(LightUnits::Candela, 1.0), (LightUnits::Watt, 683.0)] {
                    let mut lamp = json!({"type": kind, "intensity": intensity * factor, "color": COLOR});
                    if let Some([inner, outer]) = cone {
                        lamp["spot"] = json!({"innerConeAngle": inner, "outerConeAngle": outer});
                    }
                    let node = json!({"extensions": {"KHR_lights_punctual": {"light": 0}}});
                    let more = json!({
                        "extensionsUsed": ["KHR_lights_punctual"],
                        "extensions": {"KHR_lights_punctual": {"lights": [lamp]}},
                    });
                    folder.write("lamp.gltf", aim.file(center, node, more));
                    stage.lights = "(gltf: \"lamp.gltf\"),".to_owned();
                    stage.options.light_units = units;
                    comparison.add(format!("{lamp} at {center}"), stage.render(folder, block), EXACT);
                }
            }
            comparison.finish();
        }
    }
}

/// The height of an image counts, whatever ratio of sides a file gives.
#[test]
fn cameras_see_the_same_in_all_formats() {
    let angle = 0.7f64;
    let perspective = |ratio: Option<f64>| {
        let mut lens = json!({"yfov": angle, "znear": 0.1, "zfar": 90});
        if let Some(ratio) = ratio {
            lens["aspectRatio"] = json!(ratio);
        }
        json!({"type": "perspective", "perspective": lens})
    };
    let orthographic = |x: f64| json!({"type": "orthographic", "orthographic": {"xmag": x, "ymag": 1.1, "znear": 0.1, "zfar": 90}});
    let cameras = [
        (
            format!("Pinhole(vertical_fov_degrees: {})", angle.to_degrees()),
            [perspective(None), perspective(Some(1.8))],
        ),
        ("Orthographic(height_m: 2.2)".to_owned(), [orthographic(1.1), orthographic(1.98)]),
    ];
    let folder = &empty_folder();
    let aim = Aim { from: [1.6, 1.5, 2.4], to: [0.0; 3] };
    for (camera, files) in cameras {
        for size in [[24, 24], [36, 20]] {
            let mut comparison = Comparison::default();
            for center in PLACES {
                let block = white_block(folder, center);
                let mut stage = Stage { size, ..Stage::at(center) };
                stage.camera = format!("(camera: {camera}, transform: {}),", aim.transform(center));
                comparison.add(format!("{camera} at {center}"), stage.render(folder, block), EXACT);
                for file in &files {
                    folder.write(
                        "eye.gltf",
                        aim.file(center, json!({"camera": 0}), json!({"cameras": [file]})),
                    );
                    stage.camera = "(gltf: \"eye.gltf\"),".to_owned();
                    comparison.add(format!("{file} at {center}"), stage.render(folder, block), EXACT);
                }
            }
            comparison.finish();
        }
    }
}

#[test]
fn moving_things_are_at_the_same_place_in_all_formats() {
    let moves =
        [(0.0, [0.0, 0.0, 0.0], 0.0), (0.5, [0.25, 0.0, -0.5], 30.0), (2.0, [-0.5, 0.25, 0.0], 110.0)];
    let keys = |value: &dyn Fn([f32; 3], f32) -> f32| {
        let rows = moves.map(|(time, place, turn)| format!("({time}, {})", value(place, turn)));
        format!("Keys([{}])", rows.join(", "))
    };
    let [x, y, z] = [0, 1, 2].map(|axis| keys(&|place, _| place[axis]));
    let turn = keys(&|_, turn| turn);
    let folder = &empty_folder();
    // Before, between, at and after keys.
    for time in [0.0, 0.3, 0.5, 1.1, 9.0] {
        let mut comparison = Comparison::default();
        for center in PLACES {
            white_block(folder, DVec3::ZERO);
            let stage = Stage { time_s: Some(time), ..Stage::at(center) };
            let entities = format!(
                "(name: \"place\", transform: (translate: {})),
                 (parent: \"place\", shape: Mesh(\"block.ply\"), material: \"white\",
                  transform: (translate: ({x}, {y}, {z}), rotate_degrees: (0, {turn}, 0))),",
                at(center, [0.0; 3])
            );
            comparison.add(format!("keys at {center}, {time} s"), stage.render(folder, &entities), EXACT);
            for mover in [Mover::Node, Mover::PackedNode, Mover::Skin] {
                folder.write("moving.gltf", moving(&Solid::block(center), mover, &moves));
                let seen = stage.render(folder, "(gltf: \"moving.gltf\"),");
                comparison.add(format!("{mover:?} at {center}, {time} s"), seen, rounded(4e-4));
            }
        }
        comparison.finish();
    }
}

/// The twin of a file whose Z axis points up is turned upright by a scene's transform, and by an option where it is the
/// whole scene.
#[test]
fn files_with_z_up_look_the_same_when_turned() {
    let folder = &empty_folder();
    for (center, is_far) in PLACES.into_iter().zip([false, true]) {
        let upright = Solid::block(center);
        let files = |solid: &Solid| {
            let mut files = vec![
                ("block.ply", ply(solid, "ascii", Number::Double, Number::Byte, Paint::None)),
                ("block.obj", obj(solid, Paint::None)),
                ("block.stl", stl(solid, false)),
            ];
            if !is_far {
                let binary = ply(solid, "binary_big_endian", Number::Float, Number::Byte, Paint::None);
                files.extend([("binary.ply", binary), ("binary.stl", stl(solid, true))]);
            }
            files
        };
        let mut turned = Comparison::default();
        let mut alone = Comparison::default();
        let shown_alone = |name: &str, up: UpAxis| {
            let options = LoadOptions { up, size: Some([24, 24]), ..LoadOptions::default() };
            let world = load_with(folder.join(name), &options).unwrap_or_else(|error| panic!("{error}"));
            Seen::of(&world)
        };
        for (name, bytes) in files(&upright) {
            folder.write(name, bytes);
            let entity = format!("(shape: Mesh(\"{name}\"), material: \"white\"),");
            turned.add(format!("{name} at {center}"), Stage::at(center).render(folder, &entity), EXACT);
            alone.add(format!("{name} at {center}"), shown_alone(name, UpAxis::Y), EXACT);
        }
        for (name, bytes) in files(&upright.with_z_up()) {
            folder.write(name, bytes);
            let entity = format!(
                "(shape: Mesh(\"{name}\"), material: \"white\", transform: (rotate_degrees: (-90, 0, 0))),"
            );
            let seen = Stage::at(center).render(folder, &entity);
            turned.add(format!("{name} with Z up at {center}"), seen, EXACT);
            alone.add(format!("{name} with Z up at {center}"), shown_alone(name, UpAxis::Z), EXACT);
        }
        turned.finish();
        alone.finish();
    }
}

/// Two things of two materials: files, objects of one file, and models.
#[test]
fn things_have_ids_of_their_own_in_all_formats() {
    let folder = &empty_folder();
    let mut comparison = Comparison::default();
    for center in PLACES {
        let [left, right] = [-0.7, 0.7].map(|x| {
            let mut solid = Solid::ball(center + DVec3::new(x, 0.0, 0.0));
            solid.positions.iter_mut().for_each(|position| *position -= DVec3::new(x * 0.1, 0.0, 0.0));
            solid
        });
        let stage = Stage::at(center);
        let shapes = |left: &str, right: &str| {
            let entity = |file: &str| format!("(shape: Mesh(\"{file}\"), material: (diffuse: 1)),");
            entity(left) + &entity(right)
        };
        for (name, solid) in [("left", &left), ("right", &right)] {
            let file = ply(solid, "ascii", Number::Double, Number::Byte, Paint::None);
            folder.write(&format!("{name}.ply"), file);
            folder.write(&format!("{name}.gltf"), gltf(solid, Encoding::Embedded, Paint::None));
        }
        folder.write("two.obj", objects(&[("left", &left), ("right", &right)], Paint::None));
        let seen = stage.render(folder, &shapes("left.ply", "right.ply"));
        let ids: HashSet<u32> = seen.features.iter().map(|seen| seen.entity).collect();
        assert_eq!(ids.len(), 3, "two balls before nothing");
        comparison.add(format!("PLY at {center}"), seen, EXACT);
        let seen = stage.render(folder, &shapes("two.obj#left", "two.obj#right"));
        comparison.add(format!("OBJ at {center}"), seen, EXACT);
        let seen = stage.render(folder, "(gltf: \"left.gltf\"), (gltf: \"right.gltf\"),");
        comparison.add(format!("glTF at {center}"), seen, EXACT);
    }
    comparison.finish();
}
