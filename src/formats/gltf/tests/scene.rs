//! Nodes, cameras, lights, entities.

use super::*;
use crate::formats::staging::bounding_points::BoundingPoints;
use crate::math::{DVec3, Rgb, Vec3};
use crate::world::{Camera, Falloff, FromModel, Light, Name, Parent, Shape, Transform, World};

fn place(read: Read) -> World {
    let mut world = World { assets: read.assets, ..World::default() };
    read.model.place(&mut world, None);
    world
}

/// The maximum corner of the bounding box of everything visible.
fn most(world: &World) -> DVec3 {
    BoundingPoints::of(world).unwrap().bounds()[1]
}

#[test]
fn nodes_become_entities_that_share_meshes() {
    let nodes = json!([
        {"name": "root", "children": [2, 1], "translation": [1, 2, 3]},
        {"mesh": 0, "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 5, 1]},
        {"mesh": 0, "name": "root", "rotation": [0, 0, 2, 0], "scale": [1, 1, -1]},
    ]);
    let read = read(&with(&[("/nodes", nodes)]));
    assert_eq!(read.assets.meshes.len(), 1);
    let world = place(read);
    assert_eq!(most(&world), DVec3::new(3.0, 4.0, 8.0));
    let order = world.in_order();
    assert_eq!(order.len(), 3);
    let name = |at: usize| world.entities.get::<&Name>(order[at]).map(|name| name.0.clone()).ok();
    assert_eq!([name(0), name(1), name(2)], [Some("root".into()), Some("root (2)".into()), None]);
    for child in &order[1..] {
        assert_eq!(*world.entities.get::<&Parent>(*child).unwrap(), Parent(order[0]));
        assert!(world.entities.get::<&FromModel>(*child).is_ok());
        assert!(matches!(*world.entities.get::<&Shape>(*child).unwrap(), Shape::Mesh(id) if id.0 == 0));
    }
    let Transform::Trs { rotation, scale, .. } = *world.entities.get::<&Transform>(order[1]).unwrap() else {
        panic!()
    };
    assert_eq!((rotation.to_array(), scale), ([0.0, 0.0, 1.0, 0.0], Vec3::new(1.0, 1.0, -1.0)));
    let Transform::Matrix(matrix) = *world.entities.get::<&Transform>(order[2]).unwrap() else { panic!() };
    assert_eq!(matrix.transform_point3(DVec3::ONE), DVec3::new(2.0, 2.0, 7.0));
}

#[test]
fn default_scene_or_first_scene_or_all_roots_are_shown() {
    let nodes = json!([{"name": "a", "children": [1]}, {"name": "b"}, {"name": "c"}]);
    let names = |changes: &[(&str, Value)]| {
        let mut file = with(&[("/nodes", nodes.clone())]);
        file.as_object_mut().unwrap().remove("scene");
        changes.iter().for_each(|(pointer, value)| set(&mut file, pointer, value.clone()));
        let nodes = read(&file).model.nodes;
        nodes.into_iter().filter_map(|node| node.name).collect::<Vec<_>>().concat()
    };
    let scenes = json!([{"nodes": [2]}, {"nodes": [0]}]);
    assert_eq!(names(&[("/scenes", scenes.clone()), ("/scene", json!(1))]), "ab");
    assert_eq!(names(&[("/scenes", scenes)]), "c");
    assert_eq!(names(&[("/scenes", json!([]))]), "abc");
}

#[test]
fn scale_of_zero_hides_a_node_and_its_children() {
    let nodes = json!([{"children": [1], "scale": [0, 0, 0]}, {"mesh": 0}]);
    let read = read(&with(&[("/nodes", nodes)]));
    assert!(read.model.nodes.is_empty());
    assert!(read.warnings[0].contains("scale of 0"));
}

#[test]
fn deep_hierarchies_are_read_without_recursion() {
    let mut nodes: Vec<Value> = (1..20_000).map(|child| json!({"children": [child]})).collect();
    nodes.push(json!({"mesh": 0}));
    let read = read(&with(&[("/nodes", json!(nodes))]));
    assert_eq!(read.model.nodes.len(), 20_000);
    let world = place(read);
    assert_eq!(world.entities.len(), 20_000);
}

#[test]
fn perspective_and_orthographic_cameras_are_read() {
    let cameras = json!([
        {"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}, "name": "eye"},
        {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2, "znear": 0, "zfar": 9}},
    ]);
    let read = read(&with(&[
        ("/cameras", cameras),
        ("/nodes", json!([{"camera": 0, "children": [1]}, {"camera": 1}])),
    ]));
    let nodes = &read.model.nodes;
    assert_eq!(nodes[0].camera, Some(Camera::Pinhole { vertical_fov: 0.5 }));
    assert_eq!(nodes[0].name.as_deref(), Some("eye"));
    assert_eq!(nodes[1].camera, Some(Camera::Orthographic { height_m: 4.0 }));
}

/// Returns the only light of a file.
fn light(light: Value) -> Light {
    let node = json!({"extensions": {"KHR_lights_punctual": {"light": 0}}});
    let file =
        with(&[("/nodes/0", node), ("/extensions", json!({"KHR_lights_punctual": {"lights": [light]}}))]);
    read(&file).model.nodes[0].light.clone().unwrap()
}

#[test]
fn lights_keep_their_photometric_units() {
    let pi = std::f32::consts::PI;
    let Light::Point { power_w, falloff, .. } = light(json!({"type": "point", "intensity": 8})) else {
        panic!()
    };
    assert!((power_w.r / (4.0 * pi) - 8.0).abs() < 1e-5 && falloff == Falloff::InverseSquare);
    let sun = light(json!({"type": "directional", "intensity": 3, "color": [1, 0.5, 0]}));
    let Light::Directional { irradiance, .. } = sun else { panic!() };
    assert_eq!(irradiance, Rgb::new(3.0, 1.5, 0.0));
    let spot = light(json!({"type": "spot", "spot": {"innerConeAngle": 0.1}}));
    let Light::Spot { power_w, inner_angle, outer_angle, .. } = spot else { panic!() };
    assert_eq!((power_w.r, inner_angle, outer_angle), (4.0 * pi, 0.1, std::f32::consts::FRAC_PI_4));
}

/// Reads a sun and a point light from a file by `generator`: their irradiance and intensity, and the warnings.
fn sun_and_lamp(generator: &str, lights: [f32; 2], units: LightUnits) -> ([f32; 2], Vec<String>) {
    let node = |index: usize| json!({"extensions": {"KHR_lights_punctual": {"light": index}}});
    let [sun, lamp] = lights;
    let all = json!([{"type": "directional", "intensity": sun}, {"type": "point", "intensity": lamp}]);
    let file = with(&[
        ("/nodes", json!([node(0), node(1)])),
        ("/scenes/0/nodes", json!([0, 1])),
        ("/asset/generator", json!(generator)),
        ("/extensions", json!({"KHR_lights_punctual": {"lights": all}})),
    ]);
    let options = LoadOptions { light_units: units, ..LoadOptions::default() };
    let read = read_with(file.to_string().as_bytes(), &options).unwrap();
    let [Some(Light::Directional { irradiance, .. }), Some(Light::Point { power_w, .. })] =
        [0, 1].map(|at| read.model.nodes[at].light.clone())
    else {
        panic!()
    };
    ([irradiance.r, power_w.r / (4.0 * std::f32::consts::PI)], read.warnings)
}

/// Blender multiplies watts by 683, or does not; the files of other programs are taken as they are.
#[test]
fn lights_from_blender_are_in_watts_however_exported() {
    let blender = "Khronos glTF Blender I/O v4.2.57";
    let near = |found: [f32; 2], expected: [f32; 2]| {
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-4 * b)
    };
    let (standard, unitless) = ([3.0 * 683.0, 54351.4], [3.0, 79.577]);
    for (generator, lights, units, expected) in [
        (blender, standard, LightUnits::Auto, unitless),
        (blender, unitless, LightUnits::Auto, unitless),
        (blender, [3.0, 5000.0], LightUnits::Auto, [3.0, 5000.0]),
        (blender, [0.0, 54351.4], LightUnits::Auto, [0.0, 79.577]),
        (blender, standard, LightUnits::Candela, standard),
        ("another", standard, LightUnits::Auto, standard),
        ("another", standard, LightUnits::Watt, unitless),
    ] {
        let (found, warnings) = sun_and_lamp(generator, lights, units);
        assert!(near(found, expected), "{generator} {lights:?} {units:?}: {found:?}");
        let told = warnings.iter().any(|line| line.contains("--light-units candela"));
        assert_eq!(told, units == LightUnits::Auto && found != lights, "{warnings:?}");
    }
}

#[test]
fn ignored_extensions_and_animations_cause_warnings() {
    let read = read(&with(&[
        ("/extensionsUsed", json!(["KHR_lights_punctual", "EXT_new\nthing"])),
        ("/animations", json!([{"channels": [], "samplers": []}])),
    ]));
    assert!(read.warnings[0].ends_with("not supported and ignored: EXT_new\\nthing"), "{:?}", read.warnings);
    assert!(read.warnings[1].contains("animations: nodes stand as the file has them"), "{:?}", read.warnings);
}

#[test]
fn scenes_are_selected_by_name_or_number() {
    let file = with(&[
        ("/nodes", json!([{"name": "a"}, {"name": "b"}])),
        ("/scenes", json!([{"nodes": [0], "name": "1"}, {"nodes": [1], "name": "night"}])),
    ]);
    let first = |scene: &str| {
        let options = LoadOptions { scene: Some(scene.to_owned()), ..LoadOptions::default() };
        let read = read_with(file.to_string().as_bytes(), &options).map_err(|error| error.to_string())?;
        Ok::<_, String>(read.model.nodes[0].name.clone().unwrap())
    };
    assert_eq!([first("1"), first("night"), first("0")].map(Result::unwrap), ["a", "b", "a"]);
    let message = first("nihgt").unwrap_err();
    assert!(message.contains("did you mean \"night\"?") && message.contains("0 to 1"), "{message}");
    assert!(first("2").is_err() && first("-1").is_err());
}

#[test]
fn invisible_nodes_are_left_out_with_their_children() {
    let hidden = json!({"KHR_node_visibility": {"visible": false}});
    let nodes = json!([{"mesh": 0, "children": [1], "extensions": hidden}, {"mesh": 0, "name": "child"}]);
    let read = read(&with(&[("/nodes", nodes)]));
    assert!(read.model.nodes.iter().all(|node| node.mesh.is_none()));
}

#[test]
fn instances_share_a_mesh() {
    let mut file = triangle();
    let places = add_accessor(&mut file, &floats(&[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]), 5126, "VEC3", 2);
    let turns = add_accessor(&mut file, &[0, 0, 0, 127, 127, 0, 0, 0], 5120, "VEC4", 2);
    let instancing = json!({"attributes": {"TRANSLATION": places, "ROTATION": turns, "_ID": 0}});
    set(&mut file, "/nodes/0/extensions", json!({"EXT_mesh_gpu_instancing": instancing}));
    let instanced = read(&file);
    assert_eq!((instanced.assets.meshes.len(), instanced.model.nodes.len()), (1, 3));
    assert_eq!(instanced.model.nodes[2].parent, Some(0));
    assert_eq!(most(&place(instanced)), DVec3::new(6.0, 1.0, 0.0));
    set(&mut file, "/accessors/2/count", json!(1));
    assert!(refused(&file).contains("ROTATION: there are 2 of these and 1 of others"));
}

#[test]
fn camera_gives_the_aspect_ratio_of_the_image() {
    let cameras =
        json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 2}}]);
    let read = read(&with(&[("/cameras", cameras), ("/nodes/0/camera", json!(0))]));
    assert_eq!(read.model.aspect, Some(2.0));
}

/// Files without errors according to Khronos' validator.
#[test]
fn unusual_but_valid_files_are_read() {
    let mut file = with(&[("/scenes/0", json!({"name": "empty"}))]);
    assert!(read(&file).model.nodes.is_empty());
    // JSON does not distinguish 3.0 from 3.
    file = with(&[("/nodes/0/mesh", json!(0.0)), ("/accessors/0/count", json!(3.0)), ("/scene", json!(0.0))]);
    assert_eq!(read(&file).mesh().triangles.len(), 1);
    moving::animate(&mut file, "translation", "VEC3", 2, &[0.0, 0.0, 0.0, 4.0, 0.0, 2.0]);
    let channel = file["animations"][0]["channels"][0].clone();
    set(&mut file, "/animations/0/channels/1", channel);
    file["animations"][0]["channels"][0]["target"] = json!({"path": "rotation"});
    let moment = LoadOptions { time_s: Some(1.0), ..LoadOptions::default() };
    let read = read_with(file.to_string().as_bytes(), &moment).unwrap();
    assert_eq!(read.model.nodes.len(), 1, "a channel for nobody moves nothing");
    let half = with(&[("/accessors/0/count", json!(2.5))]);
    let refusal = read_bytes(half.to_string().as_bytes()).unwrap_err().to_string();
    assert!(refusal.contains("invalid type: floating point `2.5`"), "half a vertex: {refusal}");
}
