//! Entities that place a glTF file.

use std::path::{Path, PathBuf};

use super::{Fake, grey, read};
use crate::formats::ron::{parse, write};
use crate::world::{Light, MaterialId, Model, Name, Parent, Placed, Shape, World};

const SCENE: &str = r#"(entities: [
    (name: "room", gltf: "../models/room.glb", transform: (translate: (0, 1, 0))),
    (gltf: "../models/./room.glb"),
    (name: "lamp", shape: Sphere),
])"#;

fn names(world: &World) -> Vec<String> {
    world.in_order().into_iter().map(|entity| world.name_of(entity)).collect()
}

#[test]
fn its_nodes_stand_under_the_entity_after_the_scenes_own() {
    let mut files = Fake::default();
    let world = parse(SCENE, Path::new("scenes/test.ron"), &mut files).unwrap();
    assert_eq!(names(&world), ["room", "entity 1", "lamp", "lamp (2)", "entity 4", "lamp (3)", "entity 6"]);
    let order = world.in_order();
    let parent = |at: usize| world.entities.get::<&Parent>(order[at]).map(|parent| parent.0).ok();
    assert_eq!([parent(3), parent(4), parent(5)], [Some(order[0]), Some(order[3]), Some(order[1])]);
    assert_eq!(world.entities.get::<&Model>(order[0]).unwrap().0, PathBuf::from("scenes/../models/room.glb"));
    let meshes =
        [4, 6].map(|at| world.entities.get::<&Shape>(order[at]).map(|shape| (*shape).clone()).unwrap());
    assert_eq!(meshes[0], meshes[1], "both placements share the mesh");
    let light = world.entities.get::<&Light>(order[3]).unwrap();
    assert!(matches!(*light, Light::Point { power_w, .. } if power_w == grey(40.0 * std::f32::consts::PI)));
    assert!(world.assets.materials.iter().any(|material| material.name.as_deref() == Some("paint")));
}

#[test]
fn it_is_saved_as_a_reference() {
    let world = read(SCENE).unwrap();
    let text = write(&world, Path::new("scenes/test.ron")).unwrap();
    assert!(
        text.contains("name: \"room\", transform: (translate: (0, 1, 0)), gltf: \"../models/room.glb\""),
        "{text}"
    );
    assert!(!text.contains("lamp (2)") && !text.contains("paint"), "{text}");
    let again = read(&text).unwrap();
    assert_eq!(names(&again), names(&world));
    assert_eq!(write(&again, Path::new("scenes/test.ron")).unwrap(), text);
}

#[test]
fn what_stands_under_one_of_its_nodes_cannot_be_saved() {
    let mut world = read(SCENE).unwrap();
    let inside = world.in_order().into_iter().find(|entity| world.entities.get::<&Placed>(*entity).is_ok());
    world.entities.spawn((Name("mine".into()), Parent(inside.unwrap()), MaterialId::DEFAULT));
    let error = write(&world, Path::new("scenes/test.ron")).unwrap_err().to_string();
    assert!(error.contains("mine: its parent is inside a glTF file"), "{error}");
}

#[test]
fn its_mistakes_are_reported_where_it_is_named() {
    let message = |text: &str| read(text).err().unwrap().to_string();
    assert_eq!(
        message("(entities: [\n  (gltf: \"missing.glb\"),\n])"),
        "scenes/test.ron:2:10: scenes/missing.glb: this is no glTF: it has no \"asset\""
    );
    assert!(message("(entities: [(gltf: \"\")])").ends_with("1:20: the path is empty"));
}
