//! Morph targets, skins and animations.

use super::*;
use crate::math::{DVec3, Vec3};
use crate::world::Transform;

fn at(file: &Value, time: Option<f32>) -> Read {
    let options = LoadOptions { time_s: time, ..LoadOptions::default() };
    read_with(file.to_string().as_bytes(), &options).unwrap()
}

/// Animates a property of node 0 from one value to another between 0 s and 2 s.
pub(super) fn animate(file: &mut Value, path: &str, kind: &str, count: usize, values: &[f32]) {
    let times = add_accessor(file, &floats(&[0.0, 2.0]), 5126, "SCALAR", 2);
    let output = add_accessor(file, &floats(values), 5126, kind, count);
    let target = json!({"node": 0, "path": path});
    let animation = json!([{
        "channels": [{"sampler": 0, "target": target}], "samplers": [{"input": times, "output": output}],
    }]);
    set(file, "/animations", animation);
}

/// The triangle with two targets: up and to the right.
fn morphing() -> Value {
    let mut file = triangle();
    let up = add_accessor(&mut file, &floats(&[0.0, 0.0, 8.0].repeat(3)), 5126, "VEC3", 3);
    let right = add_accessor(&mut file, &floats(&[8.0, 0.0, 0.0].repeat(3)), 5126, "VEC3", 3);
    set(&mut file, "/meshes/0/primitives/0/targets", json!([{"POSITION": up}, {"POSITION": right}]));
    file
}

#[test]
fn morph_weights_come_from_mesh_node_or_animation() {
    let mut file = morphing();
    let first = |file: &Value, time| at(file, time).mesh().positions[0];
    assert_eq!(first(&file, None), Vec3::ZERO, "all weights are 0");
    set(&mut file, "/meshes/0/weights", json!([0.5, 0]));
    assert_eq!(first(&file, None), Vec3::Z * 4.0);
    set(&mut file, "/nodes/0/weights", json!([0, 0.25]));
    assert_eq!(first(&file, None), Vec3::X * 2.0);
    animate(&mut file, "weights", "SCALAR", 4, &[0.0, 0.0, 1.0, 0.5]);
    assert_eq!(first(&file, None), Vec3::X * 2.0);
    assert_eq!(first(&file, Some(1.0)), Vec3::new(2.0, 0.0, 4.0));
}

#[test]
fn nodes_with_different_weights_get_separate_meshes() {
    let mut file = morphing();
    let nodes = json!([{"mesh": 0, "weights": [1, 0]}, {"mesh": 0}, {"mesh": 0, "weights": [1, 0]}]);
    set(&mut file, "/nodes", nodes);
    set(&mut file, "/scenes/0/nodes", json!([0, 1, 2]));
    let read = read(&file);
    let meshes: Vec<_> = read.model.nodes.iter().map(|node| node.mesh.unwrap().id.0).collect();
    assert_eq!(meshes, [0, 1, 0]);
}

#[test]
fn animations_move_nodes_at_the_given_time() {
    let mut file = with(&[("/nodes/0/translation", json!([9, 9, 9]))]);
    animate(&mut file, "translation", "VEC3", 2, &[0.0, 0.0, 0.0, 4.0, 0.0, 2.0]);
    let place = |time| match at(&file, time).model.nodes[0].transform {
        Transform::Trs { translation, .. } => translation,
        Transform::Matrix(_) => panic!(),
    };
    assert_eq!(place(None), DVec3::splat(9.0));
    assert_eq!(place(Some(0.5)), DVec3::new(1.0, 0.0, 0.5));
    assert_eq!([place(Some(-1.0)), place(Some(7.0))], [DVec3::ZERO, DVec3::new(4.0, 0.0, 2.0)]);
}

/// Two animations of node 0 and one of node 1: along x in 2 s, along y in 4 s, and along z.
fn clips() -> Value {
    let mut file = triangle();
    set(&mut file, "/nodes", json!([{"mesh": 0}, {"mesh": 0}]));
    set(&mut file, "/scenes/0/nodes", json!([0, 1]));
    let mut clip = |end: f32, to: Vec3, node: usize| {
        let input = add_accessor(&mut file, &floats(&[0.0, end]), 5126, "SCALAR", 2);
        set(&mut file, &format!("/accessors/{input}/max"), json!([end]));
        let places = floats(&[0.0, 0.0, 0.0, to.x, to.y, to.z]);
        let output = add_accessor(&mut file, &places, 5126, "VEC3", 2);
        let channel = json!({"sampler": 0, "target": {"node": node, "path": "translation"}});
        json!({"channels": [channel], "samplers": [{"input": input, "output": output}]})
    };
    let mut clips = [clip(2.0, Vec3::X, 0), clip(4.0, Vec3::Y, 0), clip(1.0, Vec3::Z, 1)];
    clips[0]["name"] = json!("idle");
    clips[1]["name"] = json!("Gru\u{308}\u{df}en");
    set(&mut file, "/animations", json!(clips));
    file
}

#[test]
fn animations_are_chosen_by_name_or_number() {
    let file = clips();
    let at = |animation: Option<&str>, time_s: Option<f32>| {
        let animation = animation.map(str::to_owned);
        let options = LoadOptions { time_s, animation, ..LoadOptions::default() };
        let read = read_with(file.to_string().as_bytes(), &options).unwrap();
        let places = [0, 1].map(|node: usize| match read.model.nodes[node].transform {
            Transform::Trs { translation, .. } => translation.as_vec3(),
            Transform::Matrix(_) => panic!(),
        });
        (places, read)
    };
    let (places, read) = at(None, Some(9.0));
    assert_eq!((places, read.model.end_s), ([Vec3::X, Vec3::Z], Some(4.0)));
    assert_eq!(read.warnings.len(), 1, "{:?}", read.warnings);
    let expected = "the animations \"idle\" and \"Gru\\u{308}\u{df}en\" move the same nodes: \"idle\" counts (--animation 1 shows";
    assert!(read.warnings[0].contains(expected), "{:?}", read.warnings);
    for (asked, expected, end) in [
        ("idle", [Vec3::X, Vec3::ZERO], 2.0),
        ("Gr\u{fc}\u{df}en", [Vec3::Y, Vec3::ZERO], 4.0),
        ("2", [Vec3::ZERO, Vec3::Z], 1.0),
    ] {
        let (places, read) = at(Some(asked), Some(9.0));
        assert_eq!((places, read.model.end_s), (expected, Some(end)), "{asked}");
        assert!(read.warnings.is_empty() && read.model.unknown_animation.is_none(), "{:?}", read.warnings);
    }
    let (places, read) = at(Some("2"), None);
    assert!(places == [Vec3::ZERO; 2] && read.warnings.is_empty(), "it begins: {:?}", read.warnings);
    let unknown = at(Some("walk"), None).1.model.unknown_animation.unwrap().to_string();
    assert!(unknown.contains("/animations: there is no animation \"walk\"; animations: idle, "), "{unknown}");
}

/// Each vertex follows nodes 1 and 2 half and half; the mesh's own node is far away.
pub(super) fn skinned() -> Value {
    let mut file = triangle();
    let joints = add_accessor(&mut file, &[0u8, 1, 0, 0].repeat(3), 5121, "VEC4", 3);
    let weights = add_accessor(&mut file, &floats(&[0.5, 0.5, 0.0, 0.0].repeat(3)), 5126, "VEC4", 3);
    set(&mut file, "/meshes/0/primitives/0/attributes/JOINTS_0", json!(joints));
    set(&mut file, "/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(weights));
    let mut inverse = [0.0f32; 32];
    for diagonal in [0, 5, 10, 15, 16, 21, 26, 31] {
        inverse[diagonal] = 1.0;
    }
    inverse[12] = -1.0;
    let inverses = add_accessor(&mut file, &floats(&inverse), 5126, "MAT4", 2);
    set(&mut file, "/skins", json!([{"joints": [1, 2], "inverseBindMatrices": inverses}]));
    let nodes = json!([
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]},
        {"translation": [1, 0, 4], "children": [2]}, {"translation": [0, 2, 0]},
    ]);
    set(&mut file, "/nodes", nodes);
    set(&mut file, "/scenes/0/nodes", json!([0, 1]));
    file
}

#[test]
fn skinned_vertices_far_away_keep_their_shape() {
    let mut file = skinned();
    let near = read(&file);
    assert_eq!(near.mesh().origin, DVec3::ZERO);
    let far = DVec3::new(450_123.4, 312.7, -5_412_345.6);
    set(&mut file, "/nodes/1/translation", json!((far + DVec3::new(1.0, 0.0, 4.0)).to_array()));
    let moved = read(&file);
    let origin = moved.mesh().origin;
    for (near, moved) in near.mesh().positions.iter().zip(&moved.mesh().positions) {
        let there = moved.as_dvec3() + origin;
        assert!((there - far - near.as_dvec3()).length() < 1e-6, "{there}");
    }
}

#[test]
fn skinned_vertices_follow_their_joints_only() {
    let mut file = skinned();
    let skinned = read(&file);
    // Half at (1, 0, 4) − (1, 0, 0), half at (1, 2, 4).
    assert_eq!(skinned.mesh().positions[0], Vec3::new(0.5, 1.0, 4.0));
    let node = skinned.model.nodes.iter().find(|node| node.mesh.is_some()).unwrap();
    assert_eq!((node.parent, node.transform), (None, Transform::IDENTITY));
    set(&mut file, "/nodes/2/translation", json!([0, 4, 0]));
    assert_eq!(read(&file).mesh().positions[0], Vec3::new(0.5, 2.0, 4.0));
    set(&mut file, "/skins/0/joints", json!([1]));
    assert!(refused(&file).contains("JOINTS_0: vertex 0 follows joint 1, which the skin has not"));
    set(&mut file, "/skins/0/joints", json!([1, 2, 0]));
    assert!(refused(&file).contains("/skins/0/inverseBindMatrices: there are 2 of these for 3 joints"));
    set(&mut file, "/skins/0/joints", json!([1, 7]));
    assert!(refused(&file).contains("/skins/0/joints/1: there is no node 7"));
}
