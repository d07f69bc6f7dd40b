//! Tests of entities that place a glTF file.

use std::path::{Path, PathBuf};

use super::{Fake, grey, read};
use crate::formats::ron::{parse, write};
use crate::world::{
    FocusOn, FromModel, Light, MaterialId, Model, Name, Overrides, Parent, ScatteredCopies, Shape, World,
};

const SCENE: &str = r#"(entities: [
    (name: "room", gltf: "../models/room.glb", transform: (translate: (0, 1, 0))),
    (gltf: "../models/./room.glb"),
    (name: "lamp", shape: Sphere),
])"#;

fn names(world: &World) -> Vec<String> {
    world.in_order().into_iter().map(|entity| world.name_of(entity)).collect()
}

#[test]
fn model_nodes_are_placed_below_their_entity_after_the_scenes_own() {
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
fn model_is_saved_as_a_reference() {
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

/// Parents and what cameras focus on may be nodes of a glTF file, and saved scenes name them again.
#[test]
fn scenes_refer_to_nodes_of_models() {
    let text = r#"(entities: [
    (gltf: "../models/room.glb"),
    (name: "room", gltf: "../models/room.glb"),
    (name: "mine", parent: "room/LAMP", shape: Sphere),
    (shape: Sphere(radius_m: 0.1), scatter: (on: "room/lamp (2)", count: 3)),
    (name: "eye", camera: ThinLens(vertical_fov_degrees: 40, lens_radius_m: 0.1), focus_on: "room/lamp (2)"),
])"#;
    // Names of nodes are unique in the world: the second model's lamp is the second one.
    assert!(read(text).err().unwrap().to_string().contains("the model has no node \"LAMP\""));
    let world = read(&text.replace("LAMP", "lamp (2)")).unwrap();
    let named = |world: &World, name: &str| {
        world.in_order().into_iter().find(|entity| world.name_of(*entity) == name).unwrap()
    };
    let check = |world: &World| {
        let get = &world.entities;
        let lamp = named(world, "lamp (2)");
        assert_eq!(get.get::<&Parent>(named(world, "mine")).unwrap().0, lamp);
        assert_eq!(get.get::<&FocusOn>(named(world, "eye")).unwrap().0, lamp);
        assert!(get.query::<&ScatteredCopies>().iter().all(|scatter| scatter.on == "lamp (2)"));
    };
    check(&world);
    let written = write(&world, Path::new("scenes/test.ron")).unwrap();
    assert!(written.contains("parent: \"room/lamp (2)\"") && written.contains("focus_on: \"room/lamp (2)\""));
    check(&read(&written).unwrap());
    let error =
        read(&text.replace("LAMP", "lamp (2)").replace("focus_on: \"room/lamp (2)", "focus_on: \"room/lump"));
    assert!(error.err().unwrap().to_string().contains("the model has no node \"lump\""));
}

/// A node without a name has no reference; an entity without a name that is needed gets one.
#[test]
fn references_into_models_need_names_of_nodes() {
    let mut world = read(SCENE).unwrap();
    let inside =
        |name: &str| world.in_order().into_iter().find(|entity| world.name_of(*entity) == name).unwrap();
    let [lamp, bare] = ["lamp (3)", "entity 6"].map(inside);
    let mine = world.entities.spawn((Name("mine".into()), Parent(lamp), MaterialId::DEFAULT));
    let text = write(&world, Path::new("scenes/test.ron")).unwrap();
    assert!(text.contains("parent: \"entity 1/lamp (3)\"") && text.contains("name: \"entity 1\""), "{text}");
    world.entities.insert_one(mine, Parent(bare)).unwrap();
    let error = write(&world, Path::new("scenes/test.ron")).unwrap_err().to_string();
    assert!(error.contains("mine: its parent is a node without a name in a glTF file"), "{error}");
}

#[test]
fn mistakes_in_a_model_are_reported_where_it_is_named() {
    let message = |text: &str| read(text).err().unwrap().to_string();
    assert_eq!(
        message("(entities: [\n  (gltf: \"missing.glb\"),\n])"),
        "scenes/test.ron:2:10: scenes/missing.glb: this is not glTF: it has no \"asset\""
    );
    assert!(message("(entities: [(gltf: \"\")])").ends_with("1:20: the path is empty"));
}

#[test]
fn model_materials_are_overridden_by_name() {
    let text = r#"(
        materials: {"red": (diffuse: (1, 0, 0))},
        entities: [
            (name: "room", gltf: "room.glb", overrides: {"paint": "red"}),
            (gltf: "room.glb", overrides: {"paint": (diffuse: 0.25)}),
            (gltf: "room.glb"),
        ],
    )"#;
    let world = read(text).unwrap();
    let order = world.in_order();
    let material = |at: usize| world.entities.get::<&MaterialId>(order[at]).ok().map(|id| *id);
    let shapes: Vec<usize> =
        (0..order.len()).filter(|at| world.entities.get::<&Shape>(order[*at]).is_ok()).collect();
    let [first, second, third] = shapes[..] else { panic!("{shapes:?}") };
    let name = |id: MaterialId| world.assets.materials[id.0 as usize].name.clone();
    assert_eq!(name(material(first).unwrap()).as_deref(), Some("red"));
    assert_eq!(name(material(second).unwrap()), None);
    assert_eq!(material(third), None);
    assert_eq!(world.assets.meshes.len(), 1, "a mesh of one material needs no copy");
    assert_eq!(world.entities.get::<&Overrides>(order[0]).unwrap().0[0].0, "paint");
    let text = write(&world, Path::new("scenes/test.ron")).unwrap();
    assert!(text.contains("gltf: \"room.glb\", overrides: {\"paint\": \"red\"}"), "{text}");
    assert!(text.contains("overrides: {\"paint\": (diffuse: 0.25)}"), "{text}");
    assert_eq!(write(&read(&text).unwrap(), Path::new("scenes/test.ron")).unwrap(), text);
}

#[test]
fn mesh_of_several_materials_is_copied_if_some_are_overridden() {
    let text = r#"(entities: [
        (gltf: "two.gltf", overrides: {"metal": (diffuse: 0.25)}), (gltf: "two.gltf"),
        (gltf: "two.gltf", overrides: {"metal": (diffuse: 0.5), "paint": (diffuse: 0.75)}),
    ])"#;
    let two = super::MODEL
        .replace(r#"{"name": "paint"}"#, r#"{"name": "paint"}, {"name": "metal"}"#)
        .replace(r#""material": 0}]"#, r#""material": 0}, {"attributes": {"POSITION": 0}, "material": 1}]"#);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("two.gltf"), two).unwrap();
    let scene = folder.path().join("scene.ron");
    std::fs::write(&scene, text).unwrap();
    let world = crate::formats::staging::load(&scene).unwrap();
    let mut meshes = Vec::new();
    for entity in world.in_order() {
        if let Ok(shape) = world.entities.get::<&Shape>(entity) {
            let Shape::Mesh(id) = *shape else { panic!("no mesh") };
            meshes.push(id);
            assert!(world.entities.get::<&MaterialId>(entity).is_err());
        }
    }
    let materials = |at: usize| {
        let ids = &world.assets.meshes[meshes[at].0 as usize].triangle_materials;
        ids.iter().map(|id| world.assets.materials[id.0 as usize].name.as_deref()).collect::<Vec<_>>()
    };
    assert_eq!(materials(0), [Some("paint"), None]);
    assert_eq!(materials(1), [Some("paint"), Some("metal")]);
    assert_eq!(materials(2), [None, None]);
    assert_eq!(world.assets.meshes.len(), 3);
}

/// Two meshes of the file are merged into one mesh of the world, used with two materials.
#[test]
fn shared_mesh_is_overridden_by_the_material_of_each_entity() {
    let shared = super::MODEL
        .replace(r#"{"name": "paint"}"#, r#"{"name": "paint"}, {"name": "metal"}"#)
        .replace(r#"{"mesh": 0}]"#, r#"{"mesh": 0}, {"mesh": 1}]"#)
        .replace(
            r#""material": 0}]}]"#,
            r#""material": 0}]}, {"primitives": [{"attributes": {"POSITION": 0}, "material": 1}]}]"#,
        );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("shared.gltf"), shared).unwrap();
    let materials = |overrides: &str| {
        let scene = folder.path().join("scene.ron");
        let text = format!(
            "(materials: {{\"red\": (diffuse: (1, 0, 0))}}, entities: [(gltf: \"shared.gltf\"{overrides})])"
        );
        std::fs::write(&scene, text).unwrap();
        let world = crate::formats::staging::load(&scene).map_err(|error| error.to_string())?;
        assert_eq!(world.assets.meshes.len(), 1);
        let shown = world.in_order().into_iter().filter_map(|entity| {
            let Ok(Shape::Mesh(mesh)) = world.entities.get::<&Shape>(entity).as_deref().cloned() else {
                return None;
            };
            let own = world.entities.get::<&MaterialId>(entity).ok().map(|id| *id);
            let id = own.unwrap_or(world.assets.meshes[mesh.0 as usize].triangle_materials[0]);
            world.assets.materials[id.0 as usize].name.clone()
        });
        Ok::<_, String>(shown.collect::<Vec<_>>())
    };
    assert_eq!(materials("").unwrap(), ["paint", "metal"]);
    assert_eq!(materials(", overrides: {\"metal\": \"red\"}").unwrap(), ["paint", "red"]);
    assert_eq!(materials(", overrides: {\"paint\": \"red\"}").unwrap(), ["red", "metal"]);
    assert!(materials(", overrides: {\"meatl\": \"red\"}").unwrap_err().contains("did you mean \"metal\""));
}

#[test]
fn changed_entities_of_a_model_cannot_be_saved() {
    let mut world = read(SCENE).unwrap();
    let inside =
        world.in_order().into_iter().find(|entity| world.entities.get::<&FromModel>(*entity).is_ok());
    world.entities.insert_one(inside.unwrap(), MaterialId::DEFAULT).unwrap();
    let error = write(&world, Path::new("scenes/test.ron")).unwrap_err().to_string();
    assert!(error.contains("it came with a glTF file and has been changed"), "{error}");
}

#[test]
fn model_nodes_can_be_parents_and_be_edited() {
    let text = r#"(
        entities: [
            (name: "car", gltf: "car.glb", transform: (translate: (0, 0, 7))),
            (name: "hood", parent: "car/lamp", shape: Sphere(radius_m: 1)),
        ],
        edits: ["Point[name=\"lamp\"].power_w = 3", "Transform[\"lamp\"].translate = (1, 2, 3)"],
    )"#;
    let world = read(text).unwrap();
    let find = |name: &str| world.in_order().into_iter().find(|e| world.name_of(*e) == name).unwrap();
    assert_eq!(world.entities.get::<&Parent>(find("hood")).unwrap().0, find("lamp"));
    let lamp = world.entities.get::<&Light>(find("lamp")).unwrap();
    assert!(matches!(&*lamp, Light::Point { power_w, .. } if power_w.to_array() == [3.0; 3]), "{lamp:?}");
    let places = crate::world::transforms::to_world(&world, &world.in_order()).unwrap();
    assert_eq!(places[&find("hood")].translation.to_array(), [1.0, 2.0, 10.0]);
    let error = |text: &str| read(text).err().map(|error| error.to_string()).unwrap_or_default();
    let wrong = error(&text.replace("car/lamp", "car/lmap"));
    assert!(wrong.contains("no node \"lmap\"") && wrong.contains("did you mean \"lamp\""), "{wrong}");
    let wrong = error(&text.replace(".power_w = 3", ".powr_w = 3"));
    assert!(wrong.contains(":6:") && wrong.contains("did you mean \"power_w\""), "{wrong}");
}
