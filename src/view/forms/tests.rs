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
    assert_eq!(statements, ["settings", r#"Material["glass"]"#, r#""lamp".light"#, r#""lamp".material"#]);
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
    assert_eq!((&field("volume")["kind"], &field("normal")["kind"]), (&json!("absent"), &json!("fixed")));
    assert!(field("anisotropy")["fields"][0]["path"].as_str().unwrap().starts_with("anisotropy."));
    assert!(fields.iter().all(|field| field["doc"] != ""));
}
