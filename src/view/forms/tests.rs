mod truth;

use super::*;
use crate::world::{Falloff, Material, Name};

fn world() -> World {
    let mut world = World::default();
    let glass = Material::Principled(Box::default());
    world.assets.add_material(Some("glass".into()), glass.clone());
    let own = world.assets.add_material(None, glass);
    let light = Light::Point { power_w: crate::math::Rgb::WHITE, falloff: Falloff::default(), radius_m: 0.0 };
    world.entities.spawn((Name("lamp".into()), light, own));
    world.entities.spawn((Name("lamp*".into()), Camera::Orthographic { height_m: 2.0 }));
    world
}

#[test]
fn things_with_clear_names_have_forms() {
    let statements: Vec<_> = targets(&world()).into_iter().map(|target| target.statement).collect();
    assert_eq!(
        statements,
        ["settings", r#"Material["glass"]"#, r#""lamp".material"#, r#""lamp".light"#, r#""lamp".transform"#]
    );
    assert!(form(&world(), r#"Material["wood"]"#).is_none());
}

#[test]
fn fields_have_values_ranges_units_and_meanings() {
    let form = form(&world(), r#""lamp".light"#).unwrap();
    let power = &form["fields"][0];
    assert_eq!(
        (&power["path"], &power["kind"], &power["unit"]),
        (&json!("power_w"), &json!("color"), &json!("W"))
    );
    assert_eq!((&power["range"], &power["value"]), (&json!("at least 0"), &json!([1.0, 1.0, 1.0])));
    let form = super::form(&world(), r#"Material["glass"]"#).unwrap();
    let fields = form["fields"].as_array().unwrap();
    let field = |path: &str| fields.iter().find(|field| field["path"] == path).unwrap();
    assert_eq!((&field("roughness")["min"], &field("roughness")["max"]), (&json!(0.0), &json!(1.0)));
    assert_eq!((&field("volume")["kind"], &field("normal")["kind"]), (&json!("absent"), &json!("texture")));
    assert!(field("anisotropy")["fields"][0]["path"].as_str().unwrap().starts_with("anisotropy."));
    assert!(fields.iter().all(|field| field["doc"] != ""));
}

const TEXTURED: &str = r#"(
    materials: { "m": Principled(
        base_color: Mix(a: Checker(scale: 4), b: Texture(image: "a.hdr", scale: 2), by: Noise(octaves: 2)),
        roughness: Image("a.hdr"), metallic: Gradient(stops: [(0, 0), (1, 1)]), normal: (texture: Image("a.hdr"), scale: 0.5),
        bump: (texture: Voronoi(), height_m: 0.01), clearcoat: 1, clearcoat_normal: Image("a.hdr"),
        anisotropy: (strength: 0.5, texture: Image("a.hdr")), iridescence: (factor: 1, thickness: Wood()), volume: (),
    ) },
    entities: [
        (name: "eye", camera: ThinLens(lens_radius_m: 0.1, focus_distance_m: 4), transform: LookAt(from: (0, 1, 4), to: (0, 0, 0))),
        (name: "lamp", light: Area(power_w: 9, size_m: (1, 2)), transform: (translate: (1e7, 3.25, 2), rotate_degrees: (-60, 0, 15))),
        (name: "box", shape: Box(size_m: (1, 2, 3)), material: "m", transform: Matrix(((2, 0, 0, 1), (0, 2, 0, 2), (0, 0, 2, 3)))),
        (name: "skew", shape: Torus(), transform: Matrix(((2, 1, 0, 1), (0, 2, 0, 2), (0, 0, 2, 3)))),
        (name: "tube", shape: Tube(points: [(0, 0, 0), (0, 1, 0)]), material: (diffuse: Marble(), alpha: Image("a.hdr", Green))),
    ],
)"#;

fn textured(folder: &std::path::Path, statements: &[String]) -> World {
    let path = folder.join("scene.ron");
    std::fs::write(&path, TEXTURED).unwrap();
    let pixel = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x80";
    std::fs::write(folder.join("a.hdr"), pixel).unwrap();
    let mut options = crate::formats::LoadOptions::default();
    options.edits.set = statements.to_vec();
    crate::formats::load_with(&path, &options).unwrap_or_else(|error| panic!("{statements:?}: {error}"))
}

/// The statements that set each field to the value that it has.
fn statements(target: &str, fields: &Value, all: &mut Vec<String>) {
    for field in fields.as_array().into_iter().flatten() {
        let value = &field["value"];
        let text = match field["kind"].as_str().unwrap() {
            "flag" | "number" if !value.is_null() => value.to_string(),
            "color" | "vector" => value.to_string().replace('[', "(").replace(']', ")"),
            "texture" if value == "Checker" => "Checker()".to_owned(),
            "choice" if field["fields"].as_array().is_some_and(|fields| fields.is_empty()) => {
                value.as_str().unwrap().to_owned()
            }
            _ => String::new(),
        };
        if !text.is_empty() {
            all.push(format!("{target}.{} = {text}", field["path"].as_str().unwrap()));
        }
        statements(target, &field["fields"], all);
    }
}

#[test]
fn every_field_of_a_form_can_be_set_and_then_has_that_value() {
    let folder = tempfile::tempdir().unwrap();
    let before = textured(folder.path(), &[]);
    let mut all = Vec::new();
    for target in targets(&before) {
        let form = form(&before, &target.statement).unwrap();
        statements(&target.statement, &form["fields"], &mut all);
    }
    for path in [
        r#"Material["m"].base_color.a.scale"#,
        r#"Material["m"].base_color.b.filter"#,
        r#"Material["m"].base_color.by.octaves"#,
        r#"Material["m"].roughness.channel"#,
        r#"Material["m"].normal.texture.wrap"#,
        r#"Material["m"].bump.texture.randomness"#,
        r#"Material["m"].anisotropy.texture.scale"#,
        r#""tube".material.diffuse.octaves"#,
        r#""box".shape.size_m"#,
        r#""box".transform.scale"#,
        r#""lamp".transform.rotate_degrees"#,
        r#"Camera[name="eye"].transform.translate"#,
        r#""tube".shape.curve"#,
    ] {
        assert!(all.iter().any(|statement| statement.starts_with(&format!("{path} ="))), "{path}: {all:#?}");
    }
    assert!(!all.iter().any(|statement| statement.starts_with("\"skew\".transform")));
    for statement in &all {
        textured(folder.path(), std::slice::from_ref(statement));
    }
    let after = textured(folder.path(), &all);
    for target in targets(&before) {
        let of = |world: &World| form(world, &target.statement).unwrap().to_string();
        if target.kind != "settings" {
            assert_eq!(of(&after), of(&before));
        }
    }
}

#[test]
fn transforms_have_short_angles_and_exact_places() {
    let folder = tempfile::tempdir().unwrap();
    let world = textured(folder.path(), &[]);
    let form = form(&world, r#""lamp".transform"#).unwrap();
    assert_eq!(form["fields"][0]["value"], json!([1e7, 3.25, 2.0]));
    assert_eq!(form["fields"][1]["value"], json!([-60.0, 0.0, 15.0]));
    let ramp = super::form(&world, r#"Material["m"]"#).unwrap();
    let metallic =
        ramp["fields"].as_array().unwrap().iter().find(|field| field["path"] == "metallic").unwrap();
    let a = metallic["fields"].as_array().unwrap().iter().find(|field| field["name"] == "a").unwrap();
    assert_eq!(a["without_effect"], "beside stops");
}
