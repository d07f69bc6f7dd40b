//! Every case in which the page says that a field does nothing: no pixel changes with it, and elsewhere some do.

use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use serde_json::Value;

use super::super::form;
use crate::compile::compile;
use crate::formats::{self, LoadOptions};
use crate::math::Rgb;
use crate::render::{Options, Session, setup};
use crate::world::ineffective::{
    FieldContext, Ineffective, OF_BLINN_PHONG, OF_CAMERAS, OF_LIGHTS, OF_PRINCIPLED, OF_SETTINGS,
};
use crate::world::{Camera, Light, Material, World};

/// A component, a field of it and a new value; the component's text where the field does nothing, and where it does
/// something. A W before a text: under the Whitted transport; `first`: without a sky before it.
type Claim = [&'static str; 5];

#[rustfmt::skip]
const CLAIMS: &[Claim] = &[
    ["principled", "alpha", "0.4", "", "alpha_mode: Blend"],
    ["principled", "metallic", "0.6", "unlit: true", "metallic: 0"],
    ["principled", "edge_tint", "(0.3, 0.5, 0.9)", "unlit: true", "metallic: 0.7"],
    ["principled", "roughness", "0.2", "unlit: true", ""],
    ["principled", "normal", "Gradient()", "unlit: true", ""],
    ["principled", "bump", "(texture: Checker(scale: 9), height_m: 0.1)", "unlit: true", ""],
    ["principled", "emission", "0.5", "unlit: true", ""],
    ["principled", "shadow_catcher", "true", "unlit: true", ""],
    ["principled", "ior", "1.9", "unlit: true", "metallic: 0"],
    ["principled", "specular", "0.4", "unlit: true", "metallic: 0"],
    ["principled", "specular_color", "(0.2, 0.9, 0.4)", "unlit: true", "metallic: 0"],
    ["principled", "dispersion", "4", "unlit: true", "metallic: 0, transmission: 1, roughness: 0, volume: ()"],
    ["principled", "diffuse_transmission_color", "(0.2, 0.9, 0.4)", "unlit: true", "metallic: 0, diffuse_transmission: 0.6"],
    ["principled", "clearcoat", "0.8", "unlit: true", ""],
    ["principled", "clearcoat_roughness", "0.5", "unlit: true", "clearcoat: 1"],
    ["principled", "clearcoat_normal", "Gradient()", "unlit: true", "clearcoat: 1, clearcoat_roughness: 0.5"],
    ["principled", "sheen_color", "(0.9, 0.6, 0.4)", "unlit: true", ""],
    ["principled", "sheen_roughness", "0.7", "unlit: true", "sheen_color: 0.8, sheen_roughness: 0.3"],
    ["principled", "anisotropy.strength", "0.9", "unlit: true", "roughness: 0.4"],
    ["principled", "iridescence.factor", "1", "unlit: true", "metallic: 0"],
    ["principled", "caustics", "false", "unlit: true", "roughness: 0"],
    ["principled", "transmission", "0.6", "", "metallic: 0"],
    ["principled", "diffuse_transmission", "0.6", "", "metallic: 0"],
    ["principled", "diffuse_transmission", "0.6", "metallic: 0, transmission: 1", "metallic: 0, transmission: 0.3"],
    ["principled", "specular", "0.3", "", "metallic: 0"],
    ["principled", "specular_color", "(0.2, 0.9, 0.4)", "", "metallic: 0"],
    ["principled", "ior", "1.9", "", "metallic: 0"],
    ["principled", "edge_tint", "(0.3, 0.5, 0.9)", "metallic: 0", "metallic: 0.7"],
    ["principled", "specular_color", "(0.2, 0.9, 0.4)", "metallic: 0, specular: 0", "metallic: 0"],
    ["principled", "dispersion", "4", "metallic: 0, transmission: 1, roughness: 0", "metallic: 0, transmission: 1, roughness: 0, volume: ()"],
    ["principled", "dispersion", "4", "metallic: 0, volume: ()", "metallic: 0, transmission: 1, roughness: 0, volume: ()"],
    ["principled", "volume", "(attenuation_color: (0.2, 0.9, 0.4), attenuation_distance_m: 1)", "metallic: 0", "metallic: 0, transmission: 1"],
    ["principled", "volume.priority", "3", "metallic: 0, volume: ()", ""],
    ["principled", "volume.attenuation_color", "(0.2, 0.9, 0.4)", "metallic: 0, transmission: 1, volume: ()", "metallic: 0, transmission: 1, volume: (attenuation_distance_m: 1)"],
    ["principled", "volume.multiscatter_color", "0.8", "metallic: 0, transmission: 1, volume: (attenuation_distance_m: 1)", "metallic: 0, transmission: 1, volume: (attenuation_distance_m: 1, attenuation_color: 0.3)"],
    ["principled", "volume.scatter_anisotropy", "0.8", "metallic: 0, transmission: 1, volume: (attenuation_distance_m: 1, attenuation_color: 0.3)", "metallic: 0, transmission: 1, volume: (attenuation_distance_m: 1, attenuation_color: 0.3, multiscatter_color: 0.8)"],
    ["principled", "diffuse_transmission_color", "(0.2, 0.9, 0.4)", "metallic: 0", "metallic: 0, diffuse_transmission: 0.6"],
    ["principled", "clearcoat_roughness", "0.5", "", "clearcoat: 1"],
    ["principled", "clearcoat_normal", "Gradient()", "", "clearcoat: 1, clearcoat_roughness: 0.5"],
    ["principled", "sheen_roughness", "0.7", "", "sheen_color: 0.8, sheen_roughness: 0.3"],
    ["principled", "anisotropy.rotation_degrees", "40", "roughness: 0.4", "roughness: 0.4, anisotropy: (strength: 0.9)"],
    ["principled", "anisotropy.texture", "Checker(scale: 9)", "roughness: 0.4", "roughness: 0.4, anisotropy: (strength: 0.9)"],
    ["principled", "iridescence.ior", "1.8", "metallic: 0", "metallic: 0, iridescence: (factor: 1)"],
    ["principled", "iridescence.thickness_minimum_nm", "250", "metallic: 0", "metallic: 0, iridescence: (factor: 1, thickness: Gradient())"],
    ["principled", "iridescence.thickness_maximum_nm", "650", "metallic: 0", "metallic: 0, iridescence: (factor: 1)"],
    ["principled", "iridescence.thickness", "Gradient()", "metallic: 0", "metallic: 0, iridescence: (factor: 1)"],
    ["principled", "iridescence.thickness_minimum_nm", "250", "metallic: 0, iridescence: (factor: 1)", "metallic: 0, iridescence: (factor: 1, thickness: Gradient())"],
    ["principled", "caustics", "false", "Wroughness: 0", "roughness: 0"],
    ["principled", "clearcoat", "1", "W", ""],
    ["principled", "clearcoat_roughness", "0.5", "Wclearcoat: 1", "clearcoat: 1"],
    ["principled", "clearcoat_normal", "Gradient()", "Wclearcoat: 1", "clearcoat: 1, clearcoat_roughness: 0.5"],
    ["principled", "sheen_color", "0.8", "W", ""],
    ["principled", "sheen_roughness", "0.7", "Wsheen_color: 0.8", "sheen_color: 0.8, sheen_roughness: 0.3"],
    ["principled", "anisotropy.strength", "0.9", "Wroughness: 0.4", "roughness: 0.4"],
    ["principled", "iridescence.factor", "1", "Wmetallic: 0", "metallic: 0"],
    ["principled", "dispersion", "4", "Wmetallic: 0, transmission: 1, volume: ()", "metallic: 0, transmission: 1, roughness: 0, volume: ()"],
    ["principled", "diffuse_transmission", "0.6", "Wmetallic: 0", "metallic: 0"],
    ["principled", "diffuse_transmission_color", "(0.2, 0.9, 0.4)", "Wmetallic: 0, diffuse_transmission: 0.6", "metallic: 0, diffuse_transmission: 0.6"],
    ["principled", "shadow_catcher", "true", "W", ""],
    ["principled", "volume.attenuation_color", "(0.2, 0.9, 0.4)", "Wmetallic: 0, transmission: 1, volume: (attenuation_distance_m: 1)", "metallic: 0, transmission: 1, volume: (attenuation_distance_m: 1)"],
    ["principled", "volume.attenuation_distance_m", "0.5", "Wmetallic: 0, transmission: 1, volume: (attenuation_color: 0.5)", "metallic: 0, transmission: 1, volume: (attenuation_color: 0.5)"],
    ["principled", "edge_tint", "(0.3, 0.5, 0.9)", "Wmetallic: 0.7", "metallic: 0.7"],
    ["principled", "specular", "0.4", "Wmetallic: 0", "metallic: 0"],
    ["principled", "specular_color", "(0.2, 0.9, 0.4)", "Wmetallic: 0", "metallic: 0"],
    ["principled", "roughness.a", "0.9", "roughness: Gradient(stops: [(0, 0.2), (1, 0.6)])", "roughness: Gradient(a: 0.1, b: 0.6)"],
    ["principled", "roughness.b", "0.9", "roughness: Gradient(stops: [(0, 0.2), (1, 0.6)])", "roughness: Gradient(a: 0.1, b: 0.6)"],
    ["classic", "alpha", "0.4", "", "alpha_mode: Blend"],
    ["classic", "kt", "(0.3, 0.5, 0.9)", "", "ior: 1.5"],
    ["classic", "priority", "3", "", ""],
    ["classic", "diffuse", "(0.3, 0.5, 0.9)", "ior: 1.5", ""],
    ["classic", "kr", "0.4", "ior: 1.5", ""],
    ["classic", "specular", "0.4", "ior: 1.5", ""],
    ["classic", "shininess", "90", "ior: 1.5, specular: 0.5", "specular: 0.5"],
    ["classic", "highlight", "Phong", "specular: 0.5", "Wspecular: 0.5"],
    ["classic", "shininess", "90", "", "specular: 0.5"],
    ["classic", "highlight", "Phong", "W", "Wspecular: 0.5"],
    ["classic", "caustics", "false", "Wdiffuse: 0, kr: 1", "diffuse: 0, kr: 1"],
    ["light", "radius_m", "0.4", "Point(power_w: 90, falloff: Constant)", "Point(power_w: 90)"],
    ["light", "radius_m", "0.4", "WPoint(power_w: 90)", "Point(power_w: 90)"],
    ["light", "radius_m", "0.4", "Spot(power_w: 90, falloff: Constant)", "Spot(power_w: 90)"],
    ["light", "sun_degrees", "20", "Sky(sun: 0)", "Sky()"],
    ["light", "sun_degrees", "20", "WSky()", "Sky()"],
    ["light", "angle_degrees", "20", "WDirectional(irradiance: 2)", "Directional(irradiance: 2)"],
    ["light", "samples", "4", "Area(power_w: 90, size_m: 1)", "WArea(power_w: 90, size_m: 1)"],
    ["light", "pattern", "Regular", "Area(power_w: 90, size_m: 1)", "WArea(power_w: 90, size_m: 1)"],
    ["light", "radiance", "3", "Environment(radiance: 2)", "first Environment(radiance: 2)"],
    ["camera", "focus_distance_m", "1.5", "ThinLens(lens_radius_m: 0, focus_distance_m: 4)", "ThinLens(lens_radius_m: 0.2, focus_distance_m: 4)"],
    ["camera", "pattern", "Center", "WThinLens(lens_radius_m: 0, focus_distance_m: 4)", "WThinLens(lens_radius_m: 0.2, focus_distance_m: 4)"],
    ["camera", "pattern", "Center", "ThinLens(lens_radius_m: 0.2, focus_distance_m: 4)", "WThinLens(lens_radius_m: 0.2, focus_distance_m: 4)"],
    ["camera", "focus_distance_m", "1.5", "Photographic(focus_distance_m: 4)", "Photographic(focus_distance_m: 4, f_stop: 0.1)"],
    ["camera", "tilt_degrees", "(9, 4)", "Photographic(focus_distance_m: 4)", "Photographic(focus_distance_m: 4, f_stop: 0.1)"],
    ["camera", "pattern", "Center", "WPhotographic(focus_distance_m: 4)", "WPhotographic(focus_distance_m: 4, f_stop: 0.1)"],
    ["camera", "focus_distance_m", "1.5", "ThinLens(lens_radius_m: 0.2), focus_on: \"ball\"", "ThinLens(lens_radius_m: 0.2, focus_distance_m: 4)"],
    ["settings", "diffuse_depth", "1", "W", ""],
    ["settings", "glossy_depth", "0", "W", ""],
    ["settings", "transmission_depth", "0", "W", ""],
    ["settings", "roulette_depth", "0", "W", ""],
    ["settings", "clamp", "0.1", "W", ""],
    ["settings", "filter_glossy", "0.5", "W", ""],
    ["settings", "sampler", "Independent", "W", ""],
    ["settings", "sharing", "16", "W", ""],
    ["settings", "ambient", "1", "", "W"],
    ["settings", "min_throughput", "0.5", "", "W"],
    ["settings", "pixel_pattern", "Center", "", "W"],
    ["settings", "diffuse_depth", "1", "max_depth: 0", ""],
    ["settings", "glossy_depth", "0", "max_depth: 0", ""],
    ["settings", "transmission_depth", "0", "max_depth: 0", ""],
    ["settings", "caustics", "Off", "max_depth: 0", ""],
    ["settings", "caustics", "Off", "catcher", ""],
    ["settings", "sharing", "16", "diffuse_depth: 2", ""],
    ["settings", "backdrop", "(1, 0, 0)", "transparent: true", ""],
    ["settings", "backplate", "(1, 0, 0)", "transparent: true", ""],
    ["settings", "backdrop", "(1, 0, 0)", "backplate: 0.5", ""],
    ["settings", "background", "(1, 0, 0)", "", "dark"],
    ["settings", "light_groups", "true", "catcher", ""],
    ["settings", "light_by_bounce", "true", "catcher", ""],
    ["settings", "light_groups", "true", "light_by_bounce: true", ""],
];

/// The cases of one kind of component that claims have shown, by their number and field.
type Shown = HashSet<(&'static str, usize, &'static str)>;

fn scene(component: &str, text: &str) -> String {
    let is_whitted = text.starts_with('W');
    let is_first = text.starts_with("first ");
    let text = text.trim_start_matches('W').trim_start_matches("first ");
    let of = |kind: &str, usual: &str| {
        let own = if component == kind { text } else { usual };
        if own.is_empty() { usual.to_owned() } else { own.to_owned() }
    };
    let material = match component {
        "classic" => format!(
            "({})",
            if text.starts_with("diffuse") { text.to_owned() } else { format!("diffuse: 0.7, {text}") }
        ),
        "principled" => format!("Principled(base_color: (0.8, 0.7, 0.3), {text})"),
        _ => "Principled(roughness: 0.3)".to_owned(),
    };
    let settings = match (component, text) {
        ("settings", "catcher" | "dark") => "",
        ("settings", text) => text,
        _ => "",
    };
    let depth = if settings.contains("max_depth") { "" } else { "max_depth: 4," };
    let catcher =
        if text == "catcher" { "Principled(metallic: 0, shadow_catcher: true)" } else { "(diffuse: 0.6)" };
    let around = if text == "dark" || is_whitted || is_first {
        ""
    } else {
        "(name: \"sky\", light: Environment(radiance: 0.3)),"
    };
    let transport = if is_whitted { "Whitted" } else { "Path" };
    format!(
        "(settings: (size: (10, 8), samples: 2, transport: {transport}, {depth} {settings}),
        materials: {{ \"m\": {material} }},
        entities: [
            {around}
            (name: \"eye\", camera: {}, transform: LookAt(from: (0, 1, 4), to: (0, 0, 0))),
            (name: \"lamp\", light: {}, transform: (translate: (1, 3, 2), rotate_degrees: (-60, 0, 0))),
            (name: \"ball\", shape: Sphere(radius_m: 1), material: \"m\"),
            (name: \"glass\", shape: Sphere(radius_m: 0.4), transform: (translate: (1.2, -0.5, 1)),
                material: Principled(metallic: 0, roughness: 0, transmission: 1, volume: ())),
            (name: \"floor\", shape: Plane(corners: ((-4, -1, -4), (-4, -1, 4), (4, -1, 4), (4, -1, -4))), material: {catcher}),
        ])",
        of("camera", "Pinhole(vertical_fov_degrees: 40)"),
        of("light", "Point(power_w: 90)"),
    )
}

fn load(folder: &Path, text: &str, statements: &[String]) -> World {
    let path = folder.join("scene.ron");
    std::fs::write(&path, text).unwrap();
    let mut options = LoadOptions::default();
    options.edits.set = statements.to_vec();
    formats::load_with(&path, &options).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// The pixels of a small image, and the number of its light groups.
fn pixels_of(world: &World) -> (Vec<Rgb>, usize) {
    let setup = Arc::new(setup(compile(world, None).unwrap(), &world.settings));
    let mut session = Session::of(setup.clone(), world.settings.samples, Options::default());
    session.finish(|_| ());
    (session.film().radiance(), setup.light_groups())
}

/// True if pixels are equal but for the rounding of films of another scale.
fn are_same((a, groups): &(Vec<Rgb>, usize), (b, other_groups): &(Vec<Rgb>, usize)) -> bool {
    let mut pairs = a.iter().zip(b).flat_map(|(a, b)| a.to_array().into_iter().zip(b.to_array()));
    groups == other_groups && pairs.all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs().max(1e-3))
}

/// The field at a path of a form.
fn field<'a>(fields: &'a Value, path: &str) -> Option<&'a Value> {
    fields
        .as_array()?
        .iter()
        .find_map(|it| if it["path"] == path { Some(it) } else { field(&it["fields"], path) })
}

fn note<T>(
    shown: &mut Shown,
    cases: &'static [Ineffective<T>],
    part: &T,
    context: &FieldContext,
    kind: &'static str,
    path: &str,
) {
    for (number, case) in cases.iter().enumerate() {
        if let Some(field) = case.field_at(path).filter(|_| case.applies(part, context)) {
            shown.insert((kind, number, field));
        }
    }
}

fn note_claim(shown: &mut Shown, world: &World, [component, path, ..]: &Claim) {
    let named =
        |name: &str| world.in_order().into_iter().find(|entity| world.name_of(*entity) == name).unwrap();
    let entity = match *component {
        "camera" => Some(named("eye")),
        "light" => Some(named("lamp")),
        _ => None,
    };
    let context = FieldContext { world, entity };
    match *component {
        "settings" => note(shown, OF_SETTINGS, &world.settings, &context, "settings", path),
        "camera" => note(
            shown,
            OF_CAMERAS,
            &*world.entities.get::<&Camera>(named("eye")).unwrap(),
            &context,
            "camera",
            path,
        ),
        "light" => note(
            shown,
            OF_LIGHTS,
            &*world.entities.get::<&Light>(named("lamp")).unwrap(),
            &context,
            "light",
            path,
        ),
        _ => {
            match &world.assets.materials.iter().find(|it| it.name.as_deref() == Some("m")).unwrap().material
            {
                Material::Principled(m) => note(shown, OF_PRINCIPLED, m, &context, "principled", path),
                Material::BlinnPhong(m) => note(shown, OF_BLINN_PHONG, m, &context, "classic", path),
            }
        }
    }
}

fn all<T>(cases: &[Ineffective<T>], kind: &'static str) -> Vec<(&'static str, usize, &'static str)> {
    let each = cases.iter().enumerate();
    each.flat_map(|(number, case)| case.fields.iter().map(move |field| (kind, number, *field))).collect()
}

#[test]
fn fields_said_to_do_nothing_change_no_pixel_and_others_do() {
    let folder = tempfile::tempdir().unwrap();
    let (mut shown, mut wrong, mut films) = (Shown::new(), Vec::new(), HashMap::new());
    for claim in CLAIMS {
        let [component, path, value, idle, active] = *claim;
        let statement = match component {
            "settings" => "settings",
            "camera" => "Camera[name=\"eye\"].camera",
            "light" => "\"lamp\".light",
            _ => "Material[\"m\"]",
        };
        for (text, does_nothing) in [(idle, true), (active, false)] {
            // The second text is empty where nothing shows the field's effect.
            if !does_nothing
                && (text.is_empty() && ["light", "camera"].contains(&component) || path.ends_with("priority"))
            {
                continue;
            }
            let text = scene(component, text);
            let world = load(folder.path(), &text, &[]);
            let form = form(&world, statement).unwrap();
            // A part that is absent has no fields.
            let key = if path == "volume" && does_nothing { "volume" } else { path };
            let said = field(&form["fields"], key).map(|field| field["without_effect"].clone());
            if said.as_ref().is_some_and(|said| said.is_string() != does_nothing)
                || (does_nothing && said.is_none())
            {
                wrong.push(format!("{claim:?}: the page says {said:?} with {text}"));
            }
            if does_nothing {
                note_claim(&mut shown, &world, claim);
            }
            let before = &*films.entry(text.clone()).or_insert_with(|| pixels_of(&world));
            let changed = load(folder.path(), &text, &[format!("{statement}.{path} = {value}")]);
            if (are_same(&pixels_of(&changed), before)) != does_nothing {
                wrong.push(format!(
                    "{claim:?}: does nothing: {}, in {}",
                    !does_nothing,
                    ["the second scene", "the first scene"][usize::from(does_nothing)]
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let mut all_cases = all(OF_PRINCIPLED, "principled");
    all_cases.extend(all(OF_BLINN_PHONG, "classic"));
    all_cases.extend(all(OF_LIGHTS, "light"));
    all_cases.extend(all(OF_CAMERAS, "camera"));
    all_cases.extend(all(OF_SETTINGS, "settings"));
    // An image needs a file, which a lens looks up as any other value.
    let missing: Vec<_> = all_cases
        .into_iter()
        .filter(|case| !shown.contains(case) && !["image", "aperture"].contains(&case.2))
        .collect();
    assert!(missing.is_empty(), "no claim shows {missing:?}");
}
