use super::*;
use crate::formats::ron::tests::{Fake, read};
use crate::world::{ColorInput, Light, Material, Shape, World};

const SCENE: &str = r#"(
    materials: { "glass": Principled(metallic: 0, transmission: 1, base_color: Image("a.png")), "paint": (diffuse: 0.5) },
    entities: [
        (name: "eye", camera: Pinhole(vertical_fov_degrees: 40)),
        (name: "lamp 1", light: Point(power_w: (1, 2, 3))),
        (name: "lamp 2", light: Spot(power_w: 10, inner_degrees: 5, outer_degrees: 9)),
        (name: "ball", shape: Sphere(radius_m: 1), material: "glass"),
        (name: "knot", shape: Mesh("a.ply"), parent: "ball"),
    ],
)"#;

fn names(text: &str) -> Vec<String> {
    let world = read(SCENE).unwrap();
    match select(&world, &Query::parse(text, &world).unwrap()) {
        Selected::Entities(entities) => entities.into_iter().map(|entity| world.name_of(entity)).collect(),
        Selected::Materials(materials) => {
            let name = |id: &crate::world::MaterialId| world.assets.materials[id.0 as usize].name.clone();
            materials.iter().filter_map(name).collect()
        }
    }
}

#[test]
fn queries_select_by_kind_filter_and_operator() {
    assert_eq!(names("Light"), ["lamp 1", "lamp 2"]);
    assert_eq!(names("Mesh & !Material"), ["knot"]);
    assert_eq!(names("Light[name~\"*2\"] | Camera"), ["eye", "lamp 2"]);
    assert_eq!(names("!(Light | Shape)"), ["eye"]);
    assert_eq!(names("\"ball\""), ["ball"]);
    assert_eq!(names("Entity[parent=\"ball\"]"), ["knot"]);
    assert_eq!(names("Shape[material=\"glass\"]"), ["ball"]);
    assert_eq!(names("Material[\"gl*\"]"), ["glass"]);
    assert_eq!(names("Spot"), ["lamp 2"]);
    assert!(names("Sky").is_empty());
}

#[test]
fn stars_in_patterns_match_any_text() {
    for (text, pattern) in
        [("lamp", "lamp"), ("lamp 12", "lamp*"), ("a.b.c", "*.b.*"), ("aa", "a*a"), ("x", "*")]
    {
        assert!(is_like(text, pattern), "{text} {pattern}");
    }
    for (text, pattern) in [("lamp", "lamps"), ("a", "a*a"), ("ab", "b*"), ("abc", "*b")] {
        assert!(!is_like(text, pattern), "{text} {pattern}");
    }
}

#[test]
fn unnamed_materials_are_selected_by_number_and_changing_unused_ones_warns() {
    let text =
        SCENE.replace("material: \"glass\"", "material: (diffuse: 0.3)").replace("Mesh(\"a.ply\")", "Sphere");
    let mut world = read(&text).unwrap();
    // The default material is counted, since the knot has it.
    let count = |world: &World, text: &str| select(world, &Query::parse(text, world).unwrap()).len();
    assert_eq!([count(&world, "Material[\"*\"]"), count(&world, "Material[\"material 3\"]")], [4, 1]);
    world.warnings.clear();
    let mut told = |text: &str| {
        set(&mut world, text, &mut Fake::default()).unwrap();
        std::mem::take(&mut world.warnings)
    };
    assert!(told("Material[\"material 3\"].diffuse = 0.1").is_empty());
    assert!(told("Material[\"paint\"].diffuse = 0.1")[0].code == "set-without-effect");
    // The default material is not selected once no shape has it.
    told("\"knot\".material = \"paint\"");
    assert_eq!(count(&world, "Material[\"*\"]"), 3);
}

#[test]
fn material_of_a_model_entity_is_that_of_its_triangles() {
    let mut world =
        read(&SCENE.replace("shape: Mesh(\"a.ply\"), parent: \"ball\"", "gltf: \"room.glb\"")).unwrap();
    let shown = world
        .in_order()
        .into_iter()
        .find(|entity| matches!(world.entities.get::<&Shape>(*entity).as_deref(), Ok(Shape::Mesh(_))));
    let name = world.name_of(shown.unwrap());
    let statement = format!("\"{name}\".material.roughness = 0.25");
    set(&mut world, &statement, &mut Fake::default()).unwrap();
    let id = world.only_material(shown.unwrap()).unwrap();
    assert!(matches!(&world.assets.materials[id.0 as usize].material, Material::Principled(_)));
}

fn changed(text: &str) -> Result<World, QueryError> {
    let mut world = read(SCENE).unwrap();
    set(&mut world, text, &mut Fake::default()).map(|_| world)
}

fn powers(text: &str) -> Vec<[f32; 3]> {
    let world = changed(text).unwrap();
    let mut lights = Vec::new();
    for entity in world.in_order() {
        let light = world.entities.get::<&Light>(entity);
        if let Ok(Light::Point { power_w, .. } | Light::Spot { power_w, .. }) = light.as_deref() {
            lights.push(power_w.to_array());
        }
    }
    lights
}

#[test]
fn numbers_and_colours_are_set_and_changed() {
    assert_eq!(powers("Light.power_w = 7"), [[7.0; 3]; 2]);
    assert_eq!(powers("Light[name~\"lamp*\"].power_w *= 2"), [[2.0, 4.0, 6.0], [20.0; 3]]);
    assert_eq!(powers("Point.power_w += (1, 0, -1)"), [[2.0, 2.0, 2.0], [10.0; 3]]);
    assert_eq!(powers("\"lamp 2\".light.power_w /= 4"), [[1.0, 2.0, 3.0], [2.5; 3]]);
    assert_eq!(powers("Spot.outer_degrees -= 1")[1], [10.0; 3]);
    assert!(changed("Sphere.material.base_color = 0.5").is_ok() && changed("Entity.base_color = 1").is_err());
}

#[test]
fn materials_keep_fields_that_a_statement_does_not_set() {
    let of = |world: &World| match &world.assets.materials[1].material {
        Material::Principled(material) => (**material).clone(),
        Material::BlinnPhong(_) => panic!("glass"),
    };
    let before = of(&read(SCENE).unwrap());
    let after = of(&changed("Material[\"glass\"].ior = 1.6").unwrap());
    assert_eq!((after.ior, after.base_color), (1.6, before.base_color));
    assert!(matches!(after.base_color, ColorInput::Texture(_)));
    assert_eq!(
        of(&changed("Material[\"glass\"].volume = (attenuation_color: (1, 0.5, 0.5))").unwrap()).ior,
        before.ior
    );
    // A part that the file leaves out.
    let brushed = of(&changed("Material[\"glass\"].anisotropy.strength = 0.5").unwrap());
    assert_eq!((brushed.anisotropy.strength, brushed.ior), (0.5, before.ior));
    let unknown = changed("Material[\"glass\"].anisotropi.strength = 0.5").err().unwrap().to_string();
    assert!(unknown.contains("did you mean \"anisotropy\"") && unknown.contains("^^^^^^^^^^"), "{unknown}");
}

#[test]
fn settings_are_changed_by_statements() {
    let world = changed("settings.samples = 99").unwrap();
    assert_eq!((world.settings.samples, world.settings.transport), (99, crate::world::Transport::Path));
    let world = changed("settings.background = Gradient(bottom: 0, top: (0.1, 0.2, 0.3))").unwrap();
    assert!(matches!(world.settings.background, crate::world::Background::Gradient { .. }));
    assert!(changed("settings.sampels = 3").err().unwrap().to_string().contains("did you mean \"samples\""));
    assert!(changed("settings.samples = 0").is_err());
}

/// A depth that no file sets is that of glass, also if the scene's own edits change other settings.
#[test]
fn statements_about_settings_leave_the_depth_to_the_materials() {
    let glass = SCENE.replace("transmission: 1,", "transmission: 1, ior: 1.5, volume: (),");
    let depth = |settings: &str, edits: &str| {
        let text = glass.replacen('(', &format!("(settings: ({settings}), "), 1);
        let text = text.trim_end().trim_end_matches(')').to_owned() + &format!("edits: [{edits}])");
        read(&text).unwrap().settings.max_depth
    };
    assert_eq!(depth("", ""), 64);
    assert_eq!(depth("", "\"settings.samples = 4\""), 64);
    assert_eq!(depth("", "\"settings.samples = 4\", \"settings.max_depth = 5\""), 5);
    assert_eq!(depth("max_depth: 9", "\"settings.samples = 4\""), 9);
}

#[test]
fn mistakes_in_queries_are_marked_with_carets() {
    let error = |text: &str| changed(text).err().map(|error| error.to_string()).unwrap_or_default();
    let marked = |text: &str, what: &str, mark: &str| {
        let error = error(text);
        let lines: Vec<&str> = error.lines().collect();
        assert!(error.contains(what) && lines.len() == 3, "{text}: {error}");
        let at = lines[2].find('^').expect("a caret");
        let width = lines[2].len() - at;
        assert_eq!(&lines[1][at..at + width], mark, "{error}");
    };
    marked("Ligth.power_w = 1", "did you mean \"Light\"", "Ligth");
    marked("Light[nam=\"x\"].power_w = 1", "did you mean \"name\"", "nam");
    marked("Light.powr_w *= 2", "did you mean \"power_w\"", "powr_w");
    marked("Light.powr_w = 2", "did you mean \"power_w\"", "powr_w");
    marked("Light.power_w = -2", "power", "-2");
    marked("Light.power_w *= \"x\"", "unknown colour", "\"x\"");
    marked("Material[\"glas\"].ior = 2", "did you mean \"glass\"", "Material[\"glas\"]");
}

/// Messages about vectors and names print a statement, which can be typed.
#[test]
fn mistakes_about_vectors_and_names_print_what_to_type() {
    let scene = SCENE.replace("eye\", ", "eye\", transform: (translate: (0, 1, 6)), ").replace(
        "\"paint\": (diffuse: 0.5)",
        "\"paint\": (diffuse: (0.1, 0.2, 0.3)), \"knot\": (diffuse: 0.5)",
    );
    let run = |text: &str| {
        let mut world = read(&scene).unwrap();
        set(&mut world, text, &mut Fake::default()).map(|_| ()).map_err(|error| error.to_string())
    };
    for (text, typed, value) in [
        ("\"eye\".transform.translate.y = 0.5", "\"eye\".transform.translate = (0, 0.5, 6)", ""),
        ("\"eye\".transform.translate.z *= 2", "\"eye\".transform.translate = (0, 1, 12)", ""),
        ("\"ball\".transform.translate.y += 0.5", "\"ball\".transform.translate = (0, 0.5, 0)", ""),
        ("\"ball\".transform.rotate_degrees.x = 30", "\"ball\".transform.rotate_degrees = (30, 0, 0)", ""),
        ("\"ball\".transform.scale.x = 2", "\"ball\".transform.scale = (2, 1, 1)", ""),
        ("Entity.transform.translate.y += 1", "Entity.transform.translate += (0, 1, 0)", ""),
        (
            "Entity.transform.translate.y = 1",
            "Entity.transform.translate = (x, y, z), with all components",
            "-",
        ),
        ("Material[\"paint\"].diffuse.g = 1", "Material[\"paint\"].diffuse = (0.1, 1, 0.3)", ""),
        ("\"lamp 2\".light.power_w.g = 1", "\"lamp 2\".light.power_w = (10, 1, 10)", ""),
        ("settings.size.x = 30", "settings.size = (…), with all components", "-"),
        ("ball.transform.scale = 2", "\"ball\".transform", ".scale = 2"),
        ("Ball.radius_m = 2", "\"ball\".shape.radius_m", " = 2"),
        ("lamp 1.power_w = 2", "\"lamp 1\".light.power_w", " = 2"),
        ("paint.diffuse = 0.3", "Material[\"paint\"].diffuse", " = 0.3"),
        ("knot.diffuse = 0.3", "Material[\"knot\"].diffuse", " = 0.3"),
        ("\"glass\".ior = 1.4", "Material[\"glass\"].ior", " = 1.4"),
        ("\"glass\".material.ior = 1.4", "Material[\"glass\"].ior", " = 1.4"),
        ("\"glass\".transform.scale = 2", "Shape[material=\"glass\"]", ".transform.scale = 2"),
        ("\"ball\".ior = 1.4", "\"ball\".material.ior", " = 1.4"),
        ("\"lamp 1\".power_w = 2", "\"lamp 1\".light.power_w", " = 2"),
        ("Material['glass'].ior = 1.4", "in double quotes: \"glass\"", "-"),
        ("'glass'.ior = 1.4", "in double quotes: \"glass\"", "-"),
        ("Light.outer_degrees = 30", "Spot.outer_degrees", " = 30"),
        ("Light[name~\"*\"].outer_degrees = 30", "(Light[name~\"*\"] & Spot).light.outer_degrees", " = 30"),
        ("Shape.material.metallic = 0.5", "knot: unknown field", "-"),
        ("Material[\"*t\"].metallic = 0.5", "default: unknown field", "-"),
        ("Material[\"glass\"] = (diffuse: 1)", "Shape[material=\"glass\"].material", " = (diffuse: 1)"),
        ("variables.ink = \"navy\"", "--var 'ink=\"navy\"'", "-"),
        ("$ink = \"navy\"", "--var 'ink=\"navy\"'", "-"),
        ("Material[\"paint\"].diffuse = #ff0000", "a colour stands in quotes: \"#ff0000\"", "-"),
    ] {
        let error = run(text).unwrap_err();
        assert!(error.contains(typed), "{text}: {error}");
        if value == "-" {
            continue;
        }
        let typed = format!("{typed}{value}");
        run(&typed).unwrap_or_else(|error| panic!("{text}: {typed}: {error}"));
    }
}
