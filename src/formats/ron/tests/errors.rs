//! Tests that every error is reported with its place, its reason and a remedy.

use std::path::Path;

use super::{Fake, read};
use crate::error::LoadError;
use crate::formats::ron::load;

/// Checks that reading fails with `reason` at the `^` in the text, which is removed before reading.
fn fails(marked: &str, reason: &str) {
    let place = marked.find('^').expect("a mark");
    let text = marked.replacen('^', "", 1);
    let line = text[..place].matches('\n').count() + 1;
    let column = text[..place].chars().rev().take_while(|c| *c != '\n').count() + 1;
    match read(&text) {
        Err(LoadError::At { file, line: l, column: c, reason: found }) => {
            assert_eq!(file, Path::new("scenes/test.ron"));
            assert_eq!(((l, c), found.as_str()), ((line, column), reason), "in {text}");
        }
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("{text} was accepted"),
    }
}

/// Checks that reading an entity's keys fails (see [`fails`]), with non-ASCII text in front to test line and column.
fn entity_fails(marked: &str, reason: &str) {
    fails(&format!("// ä\n(entities: [\n    /* ö */ ({marked}),\n])"), reason);
}

fn settings_fail(marked: &str, reason: &str) {
    fails(&format!("(settings: ({marked}), entities: [])"), reason);
}

#[test]
fn message_has_file_line_column_and_suggestion() {
    let text =
        "(entities: [\n  (name: \"ball\", material: \"galss\"),\n], materials: {\"glass\": (ior: 1.5)})";
    let message = read(text).err().unwrap().to_string();
    assert_eq!(message, "scenes/test.ron:2:28: unknown material \"galss\" (did you mean \"glass\"?)");
}

#[test]
fn unknown_fields_are_refused_with_suggestions() {
    entity_fails(
        "shape: Sphere(^radius: 1)",
        "unknown field \"radius\" in Sphere (did you mean \"radius_m\"?); fields: radius_m",
    );
    entity_fails(
        "name: \"ü\", ^shpe: Sphere",
        "unknown field \"shpe\" in an entity (did you mean \"shape\"?); \
         fields: name, parent, transform, shape, gltf, overrides, material, light, camera, caustics",
    );
    fails(
        "(^setings: (), entities: [])",
        "unknown field \"setings\" in a scene (did you mean \"settings\"?); fields: entities, settings, materials, edits",
    );
    entity_fails(
        "transform: (^position: (1, 2, 3))",
        "unknown field \"position\" in a transform (did you mean \"translate\"?); fields: translate, rotate_degrees, rotate_quaternion, scale",
    );
    entity_fails(
        "light: Directional(^power_w: 1)",
        "unknown field \"power_w\" in Directional; fields: irradiance, angle_degrees",
    );
}

#[test]
fn unknown_variants_are_refused_with_suggestions() {
    let shapes = "shapes: Sphere, Triangle, Plane, Mesh";
    entity_fails(
        "shape: ^Shere(radius_m: 1)",
        &format!("unknown shape \"Shere\" (did you mean \"Sphere\"?); {shapes}"),
    );
    let mesh = "that is a Mesh: from a .ply, .obj or .glb file";
    entity_fails("shape: ^Cube", &format!("unknown shape \"Cube\" ({mesh}); {shapes}"));
    settings_fail(
        "tonemap: ^AGX2",
        "unknown tonemap \"AGX2\" (did you mean \"Agx\"?); \
         tonemaps: Clamp, ScaleByMaximum, Reinhard, Aces, Agx, PbrNeutral",
    );
    settings_fail(
        "filter: ^Gauss(radius: 1)",
        "unknown filter \"Gauss\"; filters: Box, Tent, Gaussian, BlackmanHarris",
    );
    settings_fail(
        "build_quality: ^Best",
        "unknown build quality \"Best\"; build qualities: Fast, Default, High",
    );
    for found in ["On", "3"] {
        settings_fail(
            &format!("caustics: ^{found}"),
            &format!("expected Auto, Off, or (photons: number, radius: pixels), found {found}"),
        );
    }
    settings_fail("caustics: (photons: 1, ^photons: 2)", "photons has the field \"photons\" twice");
    settings_fail("caustics: (photons: ^65)", "photons must be above 0 and at most 64, not 65");
    settings_fail("caustics: (radius: ^0.001)", "radius must be from 0.01 to 64, not 0.001");
    settings_fail("background: ^Gradient(bottom: 1)", "Gradient needs the field \"top\"");
    settings_fail("background: ^Gradient(bottom: 1, top: None)", "Gradient needs the field \"top\"");
    entity_fails("light: ^Point(power_w: None)", "Point needs the field \"power_w\"");
    settings_fail("sharing: ^On", "expected Auto, Off, or 2, 4, 8, 16, 32 or 64 pixels that share, found On");
    entity_fails(
        "material: ^Glossy(kd: 1)",
        "unknown material model \"Glossy\"; material models: BlinnPhong, Principled",
    );
    entity_fails(
        "material: (kd: ^Imge(\"a.png\"))",
        "unknown texture \"Imge\" (did you mean \"Image\"?); textures: Image, Texture",
    );
    entity_fails(
        "transform: ^Lookat(from: 1)",
        "unknown transform \"Lookat\" (did you mean \"LookAt\"?); transforms: LookAt, Matrix, (translate: …)",
    );
    entity_fails(
        "light: ^Sun()",
        "unknown light \"Sun\" (Directional(irradiance: …, angle_degrees: 0.53), or Sky()); lights: Point, Spot, Photometric, Directional, Environment, Sky, Area",
    );
    entity_fails(
        "camera: ^Pinhol()",
        "unknown camera \"Pinhol\" (did you mean \"Pinhole\"?); cameras: Pinhole, ThinLens, Orthographic",
    );
    settings_fail("background: ^Sky()", "unknown background \"Sky\"; backgrounds: Gradient, Srgb");
}

#[test]
fn values_of_wrong_types_are_refused() {
    entity_fails("name: ^5", "expected a name in quotes, found 5");
    entity_fails(
        "shape: ^\"Sphere\"",
        "expected a shape: Sphere, Triangle, Plane, Mesh, found the string \"Sphere\"",
    );
    entity_fails("shape: Sphere(radius_m: ^\"1\")", "expected a number, found the string \"1\"");
    entity_fails("shape: Sphere(radius_m: ^(1, 2))", "expected a number, found the tuple (1, 2)");
    entity_fails("shape: Sphere(^1)", "Sphere wants every value with its name, as (key: value, …)");
    entity_fails("shape: Mesh(^5)", "expected the path of a mesh in quotes, found 5");
    entity_fails("shape: Mesh^(\"a\", \"b\")", "expected Mesh(\"path\"), found 2 values");
    entity_fails("shape: Mesh^(path: \"a\")", "expected Mesh(\"path\"), found a structure (path: …)");
    entity_fails("shape: ^Mesh", "expected Mesh(\"path\"), found Mesh");
    entity_fails("transform: (translate: ^(1, 2))", "expected (x, y, z), found 2 values");
    entity_fails("transform: (translate: ^[1, 2, 3])", "expected (x, y, z), found a list […]");
    entity_fails("transform: (translate: (1, ^true, 3))", "expected a number, found true");
    entity_fails("transform: (translate: ^(x: 1))", "expected (x, y, z), found a structure (x: …)");
    entity_fails("transform: ^5", "expected a transform, as (translate: …), LookAt(…) or Matrix(…), found 5");
    entity_fails(
        "material: ^glass",
        "expected a material, as \"name\", BlinnPhong(…), Principled(…) or (diffuse: …), found glass",
    );
    entity_fails(
        "material: (kd: ^\"red\")",
        "expected diffuse, as (r, g, b), one number, Srgb(r, g, b) or \"#rrggbb\", found the string \"red\"",
    );
    entity_fails(
        "shape: Sphere, caustics: ^false",
        "an entity without a light has no caustics of its own: write it in the material",
    );
    entity_fails("light: Area(power_w: 1, size_m: 1, visible: ^1)", "expected true or false, found 1");
    settings_fail("size: (^\"1\", 2)", "expected a whole number from 1 to 65536, found the string \"1\"");
    settings_fail("pixel_pattern: ^1", "expected a pattern: Uniform, Jittered, Regular, Center, found 1");
    settings_fail("tonemap: Aces(^1)", "Aces has no fields");
    fails("(entities: [^5])", "expected an entity, as (key: value, …), found 5");
    fails("(entities: ^{})", "expected the entities in square brackets, found a map {…}");
    fails(
        "(materials: ^[], entities: [])",
        "expected the materials in braces, as {\"name\": …}, found a list […]",
    );
    fails(
        "(materials: {^glass: ()}, entities: [])",
        "expected the name of a material in quotes, found glass",
    );
    fails("^5", "expected a scene, as (key: value, …), found 5");
}

#[test]
fn missing_fields_are_reported() {
    fails("^()", "a scene needs the field \"entities\"");
    entity_fails("light: ^Point(falloff: Constant)", "Point needs the field \"power_w\"");
    entity_fails("light: ^Area(power_w: 1)", "Area needs the field \"size_m\"");
    entity_fails("camera: ^ThinLens()", "ThinLens needs the field \"lens_radius_m\"");
    entity_fails("transform: ^LookAt(from: (1, 2, 3))", "LookAt needs the field \"to\"");
    entity_fails("shape: ^Triangle", "Triangle needs the field \"vertices\"");
    entity_fails("material: (kd: ^Texture(wrap: Clamp))", "Texture needs the field \"image\"");
    fails(
        "(entities: [^()])",
        "an entity needs at least one key; keys: name, parent, transform, shape, gltf, overrides, material, light, camera, caustics",
    );
}

#[test]
fn duplicate_fields_and_names_are_refused() {
    entity_fails("name: \"a\", ^name: \"b\"", "an entity has the field \"name\" twice");
    entity_fails("material: (diffuse: 1, ^kd: 1)", "BlinnPhong has the field \"diffuse\" twice");
    fails("(entities: [], ^entities: [])", "a scene has the field \"entities\" twice");
    fails("(materials: {\"a\": (), ^\"a\": ()}, entities: [])", "there is already a material \"a\"");
    fails("(entities: [(name: \"a\"),\n (name: ^\"a\")])", "there is already an entity \"a\" at 1:20");
}

#[test]
fn syntax_errors_are_reported_where_they_are() {
    fails("^(entities: [(name: \"a\")]", "this \"(\" is never closed");
    fails("(entities: ^[(name: \"a\")", "this \"[\" is never closed");
    fails("(entities: [(name: ^\"a)])", "this string is never closed");
    fails("(entities: []) ^/* a", "this comment is never closed");
    entity_fails("name: \"a\" ^shape: Sphere", "expected a comma or a closing bracket, found \"s\"");
    entity_fails("transform: (translate: (1 ^2 3))", "expected a comma or a closing bracket, found \"2\"");
    entity_fails("name ^\"a\"", "expected a comma or a closing bracket, found a string");
    entity_fails("name: ^, shape: Sphere", "expected a value, found \",\"");
    entity_fails("name: \"a\",^, shape: Sphere", "expected the name of a field, found \",\"");
    entity_fails("shape: Sphere(radius_m: ^1.2.3)", "this is not a number");
    fails(
        "(entities: [\n (shape: Sphere(radius_m: 1),\n ^(name: \"b\"),\n])",
        "expected the name of a field, found \"(\"; \"(\" of 2:2 is not closed",
    );
    fails("(entities: []) ^5", "expected the end of the scene, found \"5\"");
    fails("(materials: {\"a\" ^()}, entities: [])", "expected a colon after the key, found \"(\"");
    fails("^", "the file ends too early");
}

#[test]
fn deep_nesting_is_refused_without_stack_overflow() {
    for (open, start) in
        [("(", ""), ("[", "(entities: "), ("{1: ", "(materials: "), ("a(", "(entities: "), ("Some(", "")]
    {
        let text = format!("{start}{}", open.repeat(100_000));
        let reason = read(&text).err().unwrap().to_string();
        assert!(reason.contains("nested too deeply"), "{reason:.200}");
        let closed = format!(
            "{text}{}",
            match open {
                "[" => "]",
                "{1: " => "}",
                _ => ")",
            }
            .repeat(100_000)
        );
        assert!(read(&closed).is_err());
    }
}

#[test]
fn numbers_out_of_range_are_refused() {
    entity_fails("shape: Sphere(radius_m: ^NaN)", "expected a finite number, found NaN");
    entity_fails("transform: (translate: (0, ^-inf, 0))", "expected a finite number, found -inf");
    entity_fails("shape: Sphere(radius_m: ^1e39)", "the number is too large (at most 3.4e38)");
    entity_fails(
        "camera: Pinhole(vertical_fov_degrees: ^1e400)",
        "the number is too large (at most 1.8e308)",
    );
    entity_fails("shape: Sphere(radius_m: ^0)", "the shape's radius_m must be above 0, not 0");
    entity_fails("shape: Sphere(radius_m: ^-1.5)", "the shape's radius_m must be above 0, not -1.5");
    let samples = "samples must be a whole number from 1 to 4194304, not";
    for wrong in ["0", "16777217", "16.5", "-1", "99999999999999999999"] {
        settings_fail(&format!("samples: ^{wrong}"), &format!("{samples} {wrong}"));
    }
    entity_fails("light: Area(power_w: 1, size_m: 1, samples: ^0)", &format!("the light's {samples} 0"));
    settings_fail("size: (10, ^0)", "the height in pixels must be a whole number from 1 to 65536, not 0");
    settings_fail(
        "size: (^65537, 1)",
        "the width in pixels must be a whole number from 1 to 65536, not 65537",
    );
    settings_fail("max_depth: ^65536", "max_depth must be a whole number from 0 to 65535, not 65536");
    settings_fail(
        "copied_triangles: ^16777217",
        "copied_triangles must be a whole number from 0 to 16777216, not 16777217",
    );
    settings_fail("glossy_depth: ^1001", "glossy_depth must be a whole number from 0 to 1000, not 1001");
    settings_fail("min_throughput: ^-1", "min_throughput must be at least 0, not -1");
    settings_fail("filter: Tent(radius: ^0)", "the filter's radius must be above 0, not 0");
    settings_fail(
        "aov: [Depth, ^Depht]",
        "unknown output variable \"Depht\" (did you mean \"Depth\"?); output variables: Depth, Normal, Albedo, \
         Position, Entity, Material, Coverage, Samples, Variance",
    );
    settings_fail("aov: ^1", "expected All, or output variables in square brackets, found 1");
    settings_fail(
        "exposure: ^2",
        "expected a kind of exposure (in stops it is exposure_ev): Fixed, Auto, found 2",
    );
    settings_fail("exposure_ev: ^inf", "expected a finite number, found inf");
    settings_fail("ambient: (0, ^-1, 0)", "ambient must be at least 0, not -1");
    for wrong in ["0", "180", "-10", "179.999999999"] {
        let reason =
            format!("the camera's vertical_fov_degrees must be above 0 and below 180 degrees, not {wrong}");
        entity_fails(&format!("camera: Pinhole(vertical_fov_degrees: ^{wrong})"), &reason);
    }
    entity_fails("light: Point(power_w: ^-5)", "the light's power_w must be at least 0, not -5");
    entity_fails("material: (kd: (1, 1, ^-0.5))", "diffuse must be at least 0, not -0.5");
    entity_fails("material: (ks: ^-0.5)", "specular must be at least 0, not -0.5");
    entity_fails("material: (kr: ^-0.5)", "kr must be at least 0, not -0.5");
    entity_fails("material: (shininess: ^-2)", "shininess must be at least 0, not -2");
    entity_fails("material: (ior: ^0)", "ior must be above 0, not 0");
    entity_fails(
        "light: Spot(power_w: 1, outer_degrees: ^91)",
        "the light's outer_degrees must be from 0 to 90 degrees, not 91",
    );
    entity_fails(
        "light: Spot(power_w: 1, inner_degrees: 50, outer_degrees: ^40)",
        "outer_degrees (40) must be at least inner_degrees (50)",
    );
    entity_fails(
        "light: Spot(power_w: 1, inner_degrees: ^50.1)",
        "outer_degrees (45) must be at least inner_degrees (50.1)",
    );
    entity_fails("light: Area(power_w: 1, size_m: (1, ^0))", "the light's size_m must be above 0, not 0");
    entity_fails("camera: Orthographic(height_m: ^0)", "the camera's height_m must be above 0, not 0");
}

#[test]
fn transforms_without_an_inverse_are_refused() {
    let flat = "a scale of 0 makes things flat: it must have an inverse";
    entity_fails("transform: (scale: ^0)", flat);
    entity_fails("transform: (scale: (1, ^0.0, 1))", flat);
    entity_fails("transform: (scale: ^1e-45)", flat);
    let no_inverse = "the matrix has no inverse: it makes things flat";
    entity_fails("transform: Matrix(^((1, 0, 0, 0), (0, 0, 0, 0), (0, 0, 1, 0)))", no_inverse);
    entity_fails("transform: Matrix(^((1, 2, 3, 0), (2, 4, 6, 0), (0, 0, 1, 0)))", no_inverse);
    entity_fails("transform: Matrix(^((1e-42, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)))", no_inverse);
    entity_fails(
        "transform: Matrix((^(1, 2, 3), (2, 4, 6, 0), (0, 0, 1, 0)))",
        "expected a row (a, b, c, d), found 3 values",
    );
    entity_fails(
        "transform: LookAt(from: (1, 2, 3), to: ^(1, 2, 3))",
        "LookAt needs two different points in \"from\" and \"to\"",
    );
    entity_fails(
        "transform: LookAt(from: (0, 0, 0), to: (1, 1, 1), up: ^(-2, -2, -2))",
        "\"up\" is parallel to the direction of view: choose another",
    );
    entity_fails(
        "transform: LookAt(from: (0, 0, 0), to: (1, 1, 1), up: ^(0, 0, 0))",
        "\"up\" has no direction",
    );
    entity_fails(
        "transform: (rotate_quaternion: ^(0, 0, 1, 1))",
        "a rotation is a quaternion of length 1, not 1.4142",
    );
    entity_fails(
        "transform: (rotate_degrees: ^(0, 0, 1), rotate_quaternion: (0, 0, 0, 1))",
        "give rotate_degrees or rotate_quaternion, not both",
    );
}

#[test]
fn degenerate_shapes_are_refused() {
    entity_fails(
        "shape: Triangle(vertices: ^((0, 0, 0), (1, 1, 1), (2, 2, 2)))",
        "the triangle has no area: its corners lie on one line",
    );
    entity_fails(
        "shape: Plane(corners: (^(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)))",
        "the corners are not in one plane (this one is 2.494e-2 m off): move it or use two triangles",
    );
    let reason =
        "the plane is not convex at this corner: give the corners in order around it, or use two triangles";
    entity_fails("shape: Plane(corners: ((0, 0, 0), (4, 0, 0), ^(1, 1, 0), (0, 4, 0)))", reason);
    // A corner on an edge is refused, too.
    entity_fails("shape: Plane(corners: ((0, 0, 0), ^(1, 0, 0), (2, 0, 0), (0, 1, 0)))", reason);
    let no_area = "the plane has no area: give its corners in order around it";
    entity_fails("shape: Plane(corners: ^((0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)))", no_area);
    entity_fails("shape: Plane(corners: ^((0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0)))", no_area);
}

#[test]
fn files_that_do_not_load_are_reported_where_they_are_named() {
    entity_fails("shape: Mesh(^\"missing.ply\")", "scenes/missing.ply: there is no such file");
    entity_fails("material: (kd: Image(^\"missing.png\"))", "scenes/missing.png: there is no such file");
    entity_fails(
        "material: (kd: Texture(image: ^\"missing.png\"))",
        "scenes/missing.png: there is no such file",
    );
    entity_fails("shape: Mesh(^\"\")", "the path is empty");
}

#[test]
fn unknown_parents_and_materials_are_refused() {
    fails(
        "(entities: [(name: \"ball\"), (parent: ^\"bal\")])",
        "unknown parent \"bal\" (did you mean \"ball\"?)",
    );
    entity_fails("material: ^\"wood\"", "unknown material \"wood\"");
    // A name that is too long for suggestions and is shortened in the message.
    let long = "x".repeat(1_000_000);
    let reason = format!("unknown material \"{}…\"", "x".repeat(48));
    entity_fails(&format!("material: ^\"{long}\""), &reason);
}

#[test]
fn cycles_of_parents_are_refused() {
    fails(
        "(entities: [(name: \"z\", parent: \"a\"), (name: \"a\", parent: ^\"b\"), (name: \"b\", parent: \"a\")])",
        "an entity cannot be its own ancestor: \"a\" is a child of \"b\" is a child of \"a\"",
    );
    fails(
        "(entities: [(name: \"a\", parent: ^\"a\")])",
        "an entity cannot be its own ancestor: \"a\" is a child of \"a\"",
    );
    // A long chain of ancestors is not a cycle and does not overflow the stack.
    let mut text = String::from("(entities: [(name: \"0\")");
    for generation in 1..20_000 {
        text.push_str(&format!(", (name: \"{generation}\", parent: \"{}\")", generation - 1));
    }
    assert!(read(&format!("{text}])")).is_ok());
}

#[test]
fn mistakes_are_found_deep_in_a_long_file() {
    const WRONG: usize = 1500;
    let scene = |wrong: &str| {
        let mut text = String::from("( // line 1\nmaterials: {\"glass\": (ior: 1.5)},\nentities: [\n");
        for line in 4..=1999 {
            let ball =
                format!("    (name: \"bäll {line}\", shape: Sphere(radius_m: 0.5), material: \"glass\"),\n");
            text.push_str(if line == WRONG { wrong } else { &ball });
        }
        text + "])\n"
    };
    for (wrong, column, reason) in [
        (
            "    (name: \"bäll\", shape: Sphere(radus_m: 0.5), material: \"glass\"),\n",
            34,
            "unknown field \"radus_m\" in Sphere (did you mean \"radius_m\"?); fields: radius_m",
        ),
        (
            "    (name: \"bäll\", shape: Sphere(radius_m: 0.5), material: \"galss\"),\n",
            60,
            "unknown material \"galss\" (did you mean \"glass\"?)",
        ),
        (
            "    (name: \"bäll\", shape: Sphere(radius_m: NaN), material: \"glass\"),\n",
            44,
            "expected a finite number, found NaN",
        ),
    ] {
        let text = scene(wrong);
        assert_eq!(text.lines().count(), 2000);
        let message = read(&text).err().unwrap().to_string();
        assert_eq!(message, format!("scenes/test.ron:{WRONG}:{column}: {reason}"));
    }
}

#[test]
fn files_that_are_unreadable_or_not_utf_8_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ron");
    std::fs::write(&path, b"(entities:\n [\xff])").unwrap();
    let message = load(&path, &mut Fake::default()).err().unwrap().to_string();
    assert!(message.ends_with("a.ron:2:3: this is not UTF-8: save the file in that encoding"), "{message}");
    let message = load(&folder.path().join("b.ron"), &mut Fake::default()).err().unwrap().to_string();
    assert!(message.contains("b.ron: cannot read: "), "{message}");
}
