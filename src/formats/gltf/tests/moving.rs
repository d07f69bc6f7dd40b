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

#[test]
fn animation_errors_are_reported_only_if_a_time_is_given() {
    let mut file = triangle();
    animate(&mut file, "translation", "VEC3", 3, &[0.0; 9]);
    let options = LoadOptions { time_s: Some(0.0), ..LoadOptions::default() };
    let message = |file: &Value| read_with(file.to_string().as_bytes(), &options).unwrap_err().to_string();
    assert!(message(&file).contains("/animations/0/samplers/0/output: 9 numbers do not fit 2 times"));
    read(&file);
    set(&mut file, "/animations/0/channels/0/target/path", json!("colour"));
    assert!(message(&file).contains("/animations/0/channels/0/target/path: there is no such property"));
    set(&mut file, "/animations/0/channels/0/target", json!({"node": 5, "path": "scale"}));
    assert!(message(&file).contains("/animations/0/channels/0/target/node: there is no node 5"));
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
