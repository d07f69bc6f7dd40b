//! Faults that the image can do without: mended, with one warning for each kind.

use super::*;
use crate::math::{DVec3, Rgb, Vec2, Vec3};
use crate::world::{Camera, Light, Transform};

/// The warnings about a file, which must be read.
fn warnings(file: &Value) -> Vec<String> {
    read(file).warnings
}

#[test]
fn faults_beside_the_geometry_are_mended_and_named() {
    let camera = |lens: Value| json!([{"type": "perspective", "perspective": lens}]);
    let cases: &[(&str, Value, &str)] = &[
        ("/scene", json!(7), "/scene: there is no scene 7, the file has 1: the first one counts"),
        ("/scene", json!("main"), "is no number of a scene: the first one counts"),
        ("/scenes/0/nodes", json!([0, 0]), "/scenes/0/nodes/1: node 0 is there twice"),
        ("/nodes/0/name", json!(5), "/nodes/0/name: invalid type: integer `5`"),
        (
            "/nodes/0/camera",
            json!(0),
            "/nodes/0/camera: there is no camera 0, the file has 0: it is left out",
        ),
        ("/nodes/0/camera", json!("eye"), "/nodes/0/camera: invalid type: string \"eye\""),
        ("/nodes/0/skin", json!(3), "/nodes/0/skin: there is no skin 3"),
        (
            "/nodes/0/rotation",
            json!([0, 0, 0, 0]),
            "/nodes/0/rotation: a rotation is a quaternion of length 1",
        ),
        (
            "/nodes/0/extensions",
            json!({"KHR_node_visibility": 5}),
            "/nodes/0/extensions/KHR_node_visibility: ",
        ),
        ("/meshes/0/primitives/0/mode", json!(9), "primitives/0/mode: there is no such mode"),
        ("/meshes/0/primitives/0/material", json!(9), "primitives/0/material: there is no material 9"),
        ("/meshes/0/primitives/0/material", json!(-1), "primitives/0/material: invalid type: integer `-1`"),
        ("/meshes/0/primitives/0/attributes/NORMAL", json!(7), "attributes/NORMAL: there is no accessor 7"),
        ("/meshes/0/primitives/0/attributes/NORMAL", json!("up"), "attributes/NORMAL: invalid type"),
        ("/meshes/0/primitives/0/attributes/COLOR_0", json!(1), "COLOR_0: accessor 1 is Scalar of U16"),
        (
            "/cameras",
            camera(json!({"yfov": "wide", "znear": 1})),
            "/cameras/0/perspective/yfov: invalid type",
        ),
        ("/materials", json!([5]), "/materials/0: invalid type: integer `5`"),
        ("/textures", json!([{"source": "a.png"}]), "/textures/0/source: invalid type: string"),
        ("/samplers", json!([{"wrapS": "REPEAT"}]), "/samplers/0/wrapS: invalid type: string"),
        ("/images", json!([{"uri": 5}]), "/images/0/uri: invalid type: integer `5`"),
        ("/skins", json!([{"name": "no joints"}]), "/skins/0: missing field `joints`: left out"),
        (
            "/animations",
            json!([{"samplers": [{}], "channels": []}]),
            "/animations/0/samplers/0: missing field `input`",
        ),
        ("/animations", json!([7]), "/animations/0: this is no object"),
        ("/asset/generator", json!(["me"]), "/asset/generator: invalid type: sequence"),
        ("/extensionsUsed", json!([1]), "/extensionsUsed: this is not as expected"),
    ];
    for (pointer, value, expected) in cases {
        let mut file = with(&[(pointer, value.clone())]);
        if *pointer == "/scene" && value.is_string() {
            // Also what the crate would accept.
            set(&mut file, "/nodes/0/mesh", json!(0.0));
        }
        let mut found = warnings(&file);
        found.retain(|line| !line.contains("animations: nodes stand"));
        assert!(found.len() == 1 && found[0].contains(expected), "{expected}\n{found:?}");
    }
}

#[test]
fn numbers_that_are_no_json_are_left_out() {
    let text = with(&[
        ("/accessors/0/max", json!([1, "NAN", 0])),
        ("/materials", json!([{"name": "NaN", "emissiveFactor": ["NAN", 0, 0], "alphaCutoff": "-INF"}])),
        (
            "/cameras",
            json!([{"type": "perspective", "perspective": {"yfov": "NAN", "znear": 0.1, "zfar": "INF"}}]),
        ),
        ("/nodes/0/camera", json!(0)),
        ("/meshes/0/primitives/0/material", json!(0)),
        ("/nodes/0/extras", json!({"weight": "NAN"})),
    ])
    .to_string();
    let text = text.replace("\"NAN\"", "NaN").replace("\"-INF\"", "-Infinity").replace("\"INF\"", "Infinity");
    for bytes in [text.clone().into_bytes(), format!("\u{feff}{text}").into_bytes()] {
        let read = read_bytes(&bytes).unwrap();
        assert_eq!(read.assets.materials[1].name.as_deref(), Some("NaN"));
        assert_eq!(
            read.model.nodes[0].camera,
            Some(Camera::Pinhole { vertical_fov: std::f32::consts::FRAC_PI_4 })
        );
        assert_eq!(read.warnings.len(), 5, "{:?}", read.warnings);
        let cutoff = "/materials/0/alphaCutoff: this is not finite: left out";
        assert!(read.warnings.iter().any(|line| line.contains(cutoff)), "{:?}", read.warnings);
    }
    let node = text.replace("\"mesh\":0", "\"mesh\":0,\"translation\":[0,NaN,0]");
    let message = read_bytes(node.as_bytes()).unwrap_err().to_string();
    assert_eq!(message, "dir/test.gltf: /nodes/0/translation/1: this is null or NaN");
    let broken = read_bytes(b"{\"asset\": {\"version\": \"2.0\"}, \"a\": NaN, }").unwrap_err().to_string();
    assert!(broken.starts_with("dir/test.gltf:1:"), "{broken}");
}

#[test]
fn json_chunks_may_begin_with_a_byte_order_mark() {
    let mut bytes = b"glTF\x02\0\0\0\0\0\0\0\0\0\0\0JSON".to_vec();
    let mut json = format!("\u{feff}{}", triangle()).into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = json.len() as u32;
    bytes[12..16].copy_from_slice(&length.to_le_bytes());
    bytes[8..12].copy_from_slice(&(length + 20).to_le_bytes());
    bytes.extend(json);
    assert_eq!(read_bytes(&bytes).unwrap().mesh().triangles, [[0, 1, 2]]);
    // A number for the version, as scripts write it.
    let read = read(&with(&[("/asset/version", json!(2.0))]));
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);
}

#[test]
fn attributes_that_are_not_finite_are_made_anew() {
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let read = read(&with_attribute(
        "NORMAL",
        &floats(&[1.0, 0.0, 0.0, 0.0, nan, 1.0, inf, 0.0, 1.0]),
        5126,
        "VEC3",
    ));
    assert_eq!(read.mesh().normals, [Vec3::X, Vec3::Z, Vec3::Z], "the triangle faces +Z");
    let expected =
        "/meshes/0/primitives/0/attributes/NORMAL: 2 of these are not finite, the first is of vertex 1";
    assert!(read.warnings.len() == 1 && read.warnings[0].contains(expected), "{:?}", read.warnings);
    let read =
        super::read(&with_attribute("TEXCOORD_0", &floats(&[nan, 1.0, 0.5, 0.5, 1.0, -inf]), 5126, "VEC2"));
    assert_eq!(read.mesh().uvs, [Vec2::ZERO, Vec2::splat(0.5), Vec2::ZERO]);
    assert!(read.warnings[0].contains("TEXCOORD_0: 2 of these are not finite"), "{:?}", read.warnings);
    let colors = floats(&[nan, 0.0, 0.0, 0.25, 0.5, 0.5, 0.5, 0.5, 0.0, 1.0, 0.0, 1.0]);
    let read = super::read(&with_attribute("COLOR_0", &colors, 5126, "VEC4"));
    assert_eq!((read.mesh().colors[0], read.mesh().alphas[0]), (Rgb::WHITE, 1.0));
    assert_eq!((read.mesh().colors[1], read.mesh().alphas[1]), (Rgb::splat(0.5), 0.5));
}

#[test]
fn attributes_of_another_number_than_positions_are_left_out() {
    let mut file = with_attribute("NORMAL", &floats(&[1.0; 9]), 5126, "VEC3");
    set(&mut file, "/accessors/2/count", json!(2));
    let read = read(&file);
    assert!(read.mesh().normals.is_empty());
    assert!(read.warnings[0].contains("NORMAL: there are 2 of these for 3 positions: it is left out"));
}

#[test]
fn positions_that_are_not_finite_are_refused_only_where_triangles_use_them() {
    let numbers = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, f32::NAN, 0.0, f32::INFINITY];
    let mut file = triangle();
    let positions = add_accessor(&mut file, &floats(&numbers), 5126, "VEC3", 4);
    set(&mut file, "/meshes/0/primitives/0/attributes/POSITION", json!(positions));
    // Nor does it matter what else is wrong with a vertex that no triangle uses.
    let normals = add_accessor(
        &mut file,
        &floats(&[[0.0, 0.0, 1.0].repeat(3), vec![f32::NAN; 3]].concat()),
        5126,
        "VEC3",
        4,
    );
    set(&mut file, "/meshes/0/primitives/0/attributes/NORMAL", json!(normals));
    let read = read(&file);
    assert!(read.mesh().positions.iter().all(|position| position.is_finite()) && read.warnings.is_empty());
    let indices = add_accessor(&mut file, &[0, 1, 2, 0, 1, 3], 5121, "SCALAR", 6);
    set(
        &mut file,
        "/meshes/0/primitives/1",
        json!({"attributes": {"POSITION": positions}, "indices": indices}),
    );
    let expected =
        "/meshes/0/primitives/1/attributes/POSITION: vertex 3 is not finite, and a triangle uses it";
    assert_eq!(refused(&file), expected);
}

#[test]
fn joint_weights_and_targets_that_are_not_finite_do_nothing() {
    let mut file = moving::skinned();
    let weights = [f32::NAN, 0.5, 0.5, 0.0, 0.5, 0.5, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0];
    let weights = add_accessor(&mut file, &floats(&weights), 5126, "VEC4", 3);
    set(&mut file, "/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(weights));
    let read = read(&file);
    assert!(read.mesh().positions.iter().all(|position| position.is_finite()));
    assert!(
        read.warnings.len() == 1 && read.warnings[0].contains("WEIGHTS_0: that of vertex 0 is not finite"),
        "{:?}",
        read.warnings
    );
    let mut file = with_attribute("NORMAL", &floats(&[0.0, 0.0, 1.0].repeat(3)), 5126, "VEC3");
    let turns = add_accessor(
        &mut file,
        &floats(&[f32::NAN, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        5126,
        "VEC3",
        3,
    );
    set(&mut file, "/meshes/0/primitives/0/targets", json!([{"NORMAL": turns}]));
    set(&mut file, "/meshes/0/weights", json!([1]));
    let read = super::read(&file);
    assert_eq!(read.mesh().normals[..2], [Vec3::Z, Vec3::new(1.0, 0.0, 1.0)]);
    assert!(
        read.warnings[0].contains("/meshes/0/primitives/0/targets/0/NORMAL: that of vertex 0 is"),
        "{:?}",
        read.warnings
    );
}

#[test]
fn tangents_that_are_not_finite_are_generated() {
    let mut file = geometry::mirrored();
    let generated = read(&file);
    let tangents = floats(&[[1.0, 0.0, 0.0, 1.0].repeat(3), vec![f32::NAN; 4]].concat());
    let accessor = add_accessor(&mut file, &tangents, 5126, "VEC4", 4);
    set(&mut file, "/meshes/0/primitives/0/attributes/TANGENT", json!(accessor));
    let read = read(&file);
    assert_eq!(read.mesh(), generated.mesh());
    assert!(read.warnings[0].contains("TANGENT: that of vertex 3 is not finite"), "{:?}", read.warnings);
}

/// The light that a node gets, and the warnings.
fn lit(light: Value) -> (Option<Light>, Vec<String>) {
    let node = json!({"extensions": {"KHR_lights_punctual": {"light": 1}}});
    let lights = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}, light]}});
    let read = read(&with(&[("/nodes/0", node), ("/extensions", lights)]));
    (read.model.nodes[0].light.clone(), read.warnings)
}

#[test]
fn spotlights_have_any_cone_and_say_what_was_clamped() {
    let half = std::f32::consts::FRAC_PI_2;
    for (cone, expected, faults) in [
        (json!({"innerConeAngle": 0.5, "outerConeAngle": 0.5}), [0.5, 0.5], 0),
        (json!({"innerConeAngle": 0.0, "outerConeAngle": half + 5e-6}), [0.0, half], 0),
        (json!({"innerConeAngle": 0.75, "outerConeAngle": 0.5}), [0.5, 0.5], 1),
        (json!({"innerConeAngle": 0.25, "outerConeAngle": 3.0}), [0.25, half], 1),
        (json!({"innerConeAngle": -0.25, "outerConeAngle": 0.5}), [0.0, 0.5], 1),
        (json!({"innerConeAngle": "none", "outerConeAngle": 0.5}), [0.0, 0.5], 1),
        (Value::Null, [0.0, std::f32::consts::FRAC_PI_4], 1),
    ] {
        let (light, warnings) = lit(json!({"type": "spot", "spot": cone}));
        let Some(Light::Spot { inner_angle, outer_angle, .. }) = light else {
            panic!("{cone}: {warnings:?}")
        };
        assert_eq!(([inner_angle, outer_angle], warnings.len()), (expected, faults), "{cone}: {warnings:?}");
    }
}

#[test]
fn lights_that_are_not_as_expected_are_mended_or_left_out() {
    for (light, is_left_out, expected) in [
        (json!({"type": "area"}), true, "lights/1/type: unknown type \"area\": the light is left out"),
        (json!({"intensity": 3}), true, "lights/1/type: unknown type \"\""),
        (json!(5), true, "lights/1: invalid type"),
        (json!({"type": "point", "intensity": -3}), false, "lights/1: light cannot be negative"),
        (json!({"type": "point", "intensity": 1e39}), false, "lights/1/intensity: a number is too large"),
        (
            json!({"type": "point", "intensity": 1e38, "color": [9e37, 1, 1]}),
            true,
            "lights/1: the light is too bright",
        ),
    ] {
        let (found, warnings) = lit(light.clone());
        assert_eq!(found.is_none(), is_left_out, "{light}");
        assert!(warnings.len() == 1 && warnings[0].contains(expected), "{light}: {warnings:?}");
    }
    let (found, warnings) = lit(json!({"type": "directional", "color": [0.5, 0.25, 0.125, 1]}));
    let Some(Light::Directional { irradiance, .. }) = found else { panic!() };
    assert_eq!(irradiance, Rgb::new(0.5, 0.25, 0.125));
    assert!(
        warnings[0].contains("color: invalid length 4") && warnings[0].ends_with("the first three count")
    );
}

#[test]
fn cameras_that_are_not_as_expected_stay_at_their_place() {
    let usual = Camera::Pinhole { vertical_fov: std::f32::consts::FRAC_PI_4 };
    for (camera, expected, warning) in [
        (
            json!({"type": "perspective", "perspective": {"yfov": 0, "znear": 1}}),
            usual,
            "the angle 0 is not between",
        ),
        (json!({"type": "fisheye"}), usual, "/cameras/0: a camera needs its type"),
        (
            json!({"type": 3, "perspective": {"yfov": 0.5}}),
            Camera::Pinhole { vertical_fov: 0.5 },
            "/cameras/0: it has no type that fits its lens: it is perspective",
        ),
        (json!("wide"), usual, "/cameras/0: invalid type: string"),
        (
            json!({"type": "perspective", "orthographic": {"xmag": 1, "ymag": 2, "znear": 0, "zfar": 9}}),
            Camera::Orthographic { height_m: 4.0 },
            "/cameras/0: it has no type that fits its lens: it is orthographic",
        ),
    ] {
        let read = read(&with(&[("/cameras", json!([camera.clone()])), ("/nodes/0/camera", json!(0))]));
        assert_eq!(read.model.nodes[0].camera, Some(expected), "{camera}");
        assert!(read.warnings.iter().any(|line| line.contains(warning)), "{camera}: {:?}", read.warnings);
    }
}

#[test]
fn material_values_that_are_not_as_expected_have_their_defaults() {
    let cases = [
        (json!({"alphaMode": "CLIP"}), "/materials/0/alphaMode: alphaMode must be"),
        (
            json!({"normalTexture": {"index": 7}}),
            "/materials/0/normalTexture: there is no texture 7, the file has 1",
        ),
        (json!({"emissiveFactor": [1, 1]}), "/materials/0/emissiveFactor: invalid length 2"),
        (
            json!({"extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": "high"}}}),
            "/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor: invalid type: string",
        ),
        (
            json!({"extensions": {"KHR_materials_sheen": 5}}),
            "/materials/0/extensions/KHR_materials_sheen: invalid type",
        ),
        (
            json!({"extensions": {"KHR_materials_ior": {"ior": null}}}),
            "KHR_materials_ior/ior: this is null or NaN",
        ),
    ];
    for (material, expected) in cases {
        let read = materials::read_material(material);
        assert_eq!(*read.material(), Principled::default(), "{expected}");
        assert!(read.warnings.len() == 1 && read.warnings[0].contains(expected), "{:?}", read.warnings);
    }
    let read = materials::read_material(json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0]}}));
    assert_eq!(read.material().base_color, crate::world::ColorInput::Constant(Rgb::new(0.5, 0.25, 0.0)));
}

#[test]
fn textures_without_a_usable_image_are_left_out() {
    let cases: &[(&str, Value, &str)] = &[
        ("/textures/0/sampler", json!(9), "/textures/0/sampler: there is no sampler 9, the file has 1"),
        ("/textures/0/source", json!(12), "/textures/0: there is no image 12, the file has 1"),
        (
            "/images/0",
            json!({"uri": "https://example.org/a.png"}),
            "/images/0: \"https://example.org/a.png\" does not",
        ),
        ("/images/0", json!({"uri": "../a.png"}), "--allow-outside)"),
        ("/images/0", json!({}), "/images/0: an image needs a uri or a bufferView"),
        (
            "/images/0",
            json!({"bufferView": 9, "mimeType": "image/png"}),
            "/images/0: there is no buffer view 9",
        ),
        ("/images/0", json!({"uri": "data:;base64,Z"}), "/images/0: the data URI is not base64"),
    ];
    for (pointer, value, expected) in cases {
        let mut file = triangle();
        materials::add_texture(&mut file);
        let slot = json!({"index": 0});
        set(
            &mut file,
            "/materials",
            json!([{"pbrMetallicRoughness": {"baseColorTexture": slot}, "normalTexture": slot}]),
        );
        set(&mut file, "/meshes/0/primitives/0/material", json!(0));
        set(&mut file, pointer, value.clone());
        let found = warnings(&file);
        assert!(found.len() == 1 && found[0].contains(expected), "{expected}: {found:?}");
    }
}

#[test]
fn faults_of_one_kind_are_one_warning() {
    let materials: Vec<Value> = (0..40).map(|_| json!({"alphaMode": 3, "emissiveFactor": [0, 0]})).collect();
    let found = warnings(&with(&[("/materials", json!(materials))]));
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].contains("/materials/0/alphaMode and 39 more places: "), "{found:?}");
}

#[test]
fn matrices_may_be_affine_but_for_rounding() {
    let matrix = |last: [f64; 4]| {
        let [a, b, c, d] = last;
        with(&[("/nodes/0/matrix", json!([2, 0, 0, a, 0, 2, 0, b, 0, 0, 2, c, 4, 6, 8, d]))])
    };
    let placed = |last: [f64; 4]| {
        let read = read(&matrix(last));
        assert!(read.warnings.is_empty(), "{:?}", read.warnings);
        let Transform::Matrix(matrix) = read.model.nodes[0].transform else { panic!() };
        matrix.transform_point3(DVec3::X).as_vec3()
    };
    assert_eq!(placed([0.0, 1e-7, -1e-8, 1.0 + 1e-6]), Vec3::new(6.0, 6.0, 8.0));
    assert_eq!(placed([0.0, 0.0, 0.0, 2.0]), Vec3::new(3.0, 3.0, 4.0));
    for last in [[0.0, 0.0, 0.0, 0.0], [0.1, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, -1.0]] {
        assert!(refused(&matrix(last)).contains("/nodes/0/matrix: the matrix is not affine"));
    }
}

/// The translation of node 0 at 1 s, and the warnings, for keys at some times.
fn moved(times: &[f32], values: &[f32], change: &[(&str, Value)]) -> (Option<Vec3>, Vec<String>) {
    let mut file = with(&[("/nodes/0/translation", json!([9, 9, 9]))]);
    let input = add_accessor(&mut file, &floats(times), 5126, "SCALAR", times.len());
    let output = add_accessor(&mut file, &floats(values), 5126, "VEC3", values.len() / 3);
    let channel = json!({"sampler": 0, "target": {"node": 0, "path": "translation"}});
    let sampler = json!({"input": input, "output": output});
    set(&mut file, "/animations", json!([{"channels": [channel], "samplers": [sampler]}]));
    change.iter().for_each(|(pointer, value)| set(&mut file, pointer, value.clone()));
    let options = LoadOptions { time_s: Some(1.0), ..LoadOptions::default() };
    let read = read_with(file.to_string().as_bytes(), &options).unwrap();
    let Transform::Trs { translation, .. } = read.model.nodes[0].transform else { panic!() };
    let translation = translation.as_vec3();
    ((translation != Vec3::splat(9.0)).then_some(translation), read.warnings)
}

#[test]
fn animations_that_are_not_as_expected_are_mended_or_left_out() {
    let line = [0.0, 0.0, 0.0, 4.0, 0.0, 0.0];
    assert_eq!(moved(&[0.0, 2.0], &line, &[]), (Some(Vec3::X * 2.0), vec![]));
    let channel = "/animations/0/channels/0";
    for (change, expected) in [
        ((format!("{channel}/target/path"), json!("colour")), "target/path: there is no such property"),
        ((format!("{channel}/target/node"), json!(5)), "target/node: there is no node 5, the file has 1"),
        ((format!("{channel}/sampler"), json!(5)), "channels/0/sampler: there is no sampler 5"),
        ((format!("{channel}/sampler"), json!("a")), "channels/0/sampler: invalid type"),
        (("/animations/0/samplers/0/input".into(), json!(99)), "samplers/0/input: there is no accessor 99"),
        (("/animations/0/samplers/0/input".into(), json!(null)), "samplers/0/input: this is null"),
        (("/animations/0/samplers/0/output".into(), json!(0)), "output: 9 numbers do not fit 2 times"),
        (("/animations/0/samplers/0/output".into(), json!(1)), "output: accessor 1 is Scalar of U16"),
    ] {
        let (found, warnings) = moved(&[0.0, 2.0], &line, &[(&change.0, change.1.clone())]);
        assert!(
            found.is_none() && warnings.len() == 1 && warnings[0].contains(expected),
            "{expected}: {warnings:?}"
        );
        assert!(warnings[0].contains("left out"), "{warnings:?}");
    }
    let (found, warnings) =
        moved(&[0.0, 2.0], &line, &[("/animations/0/samplers/0/interpolation", json!("BEZIER"))]);
    assert!(
        found == Some(Vec3::X * 2.0) && warnings[0].contains("there is no such interpolation"),
        "{warnings:?}"
    );
}

#[test]
fn keys_that_are_not_as_expected_are_mended() {
    let at = |x: [f32; 3]| x.into_iter().flat_map(|x| [x, 0.0, 0.0]).collect::<Vec<_>>();
    let nan = f32::NAN;
    for (times, values, expected, warning) in [
        ([0.0, 1.0, 1.0], at([0.0, 2.0, 8.0]), 8.0, "two keys have the same time"),
        ([0.0, 2.0, 2.0], at([0.0, 2.0, 8.0]), 1.0, "two keys have the same time"),
        ([2.0, 0.0, 3.0], at([4.0, 0.0, 4.0]), 2.0, "times do not grow from key to key"),
        ([0.0, nan, 2.0], at([0.0, 7.0, 4.0]), 2.0, "a key is not finite"),
        ([0.0, 0.5, 2.0], at([0.0, nan, 4.0]), 2.0, "a key is not finite"),
    ] {
        let (found, warnings) = moved(&times, &values, &[]);
        assert_eq!(found, Some(Vec3::X * expected), "{warning}");
        assert!(warnings.len() == 1 && warnings[0].contains(warning), "{warnings:?}");
    }
    let (found, warnings) = moved(&[nan, nan], &[0.0; 6], &[]);
    assert!(found.is_none() && warnings.iter().any(|line| line.contains("no key is finite")), "{warnings:?}");
}

/// The JSON pointers of all values, outermost first.
fn pointers(value: &Value, at: &str, found: &mut Vec<String>) {
    let inside: Vec<(String, &Value)> = match value {
        Value::Object(members) => {
            members.iter().map(|(key, value)| (format!("{at}/{}", key.replace('/', "~1")), value)).collect()
        }
        Value::Array(items) => {
            items.iter().enumerate().map(|(number, value)| (format!("{at}/{number}"), value)).collect()
        }
        _ => Vec::new(),
    };
    for (pointer, value) in inside {
        found.push(pointer.clone());
        pointers(value, &pointer, found);
    }
}

/// True if a file may be refused for what is at a pointer: the lists of items, the hierarchy, and what places vertices.
fn places_geometry(pointer: &str) -> bool {
    let parts: Vec<&str> = pointer.split('/').skip(1).collect();
    match &parts[..] {
        ["asset" | "accessors" | "bufferViews" | "buffers" | "scenes" | "extensionsRequired", ..] | [_] => {
            true
        }
        ["nodes" | "meshes", _]
        | ["nodes", _, "children" | "mesh" | "matrix" | "translation" | "scale" | "rotation", ..] => true,
        ["nodes", _, "extensions", rest @ ..] => rest.is_empty() || rest[0] == "EXT_mesh_gpu_instancing",
        ["skins", _, "joints" | "inverseBindMatrices", ..] => true,
        ["meshes", _, "primitives", _, rest @ ..] | ["meshes", _, "primitives", rest @ ..] => match rest {
            ["attributes", name, ..] => ["POSITION", "JOINTS_0", "WEIGHTS_0"].contains(name),
            [] | ["attributes" | "indices" | "targets" | "mode" | "extensions", ..] => true,
            _ => false,
        },
        _ => false,
    }
}

/// Whatever stands anywhere else is mended, with a few warnings at most.
#[test]
fn odd_values_beside_the_geometry_never_refuse_a_file() {
    let bytes = robust::everything();
    let length = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
    let (json, binary) = (&bytes[20..20 + length], &bytes[20 + length + 8..]);
    let file: Value = serde_json::from_slice(json).unwrap();
    let usual = read_bytes(&bytes).unwrap().warnings.len();
    let mut all = Vec::new();
    pointers(&file, "", &mut all);
    let odd = [
        Value::Null,
        json!(-1),
        json!(99),
        json!(0.5),
        json!("x"),
        json!([]),
        json!({}),
        json!(1e39),
        json!([1, 2, 3]),
    ];
    let options = LoadOptions { time_s: Some(0.5), ..LoadOptions::default() };
    let (mut refused, mut tried) = (Vec::new(), 0);
    for pointer in all.iter().filter(|pointer| !places_geometry(pointer)) {
        for value in &odd {
            let mut changed = file.clone();
            *changed.pointer_mut(pointer).unwrap() = value.clone();
            tried += 1;
            match read_with(&glb(&changed, binary), &options) {
                Ok(read) if read.warnings.len() <= usual + 3 => {}
                Ok(read) => refused.push(format!("{pointer} {value}: {:?}", read.warnings)),
                Err(error) => refused.push(format!("{pointer} {value}: {error}")),
            }
        }
    }
    assert!(refused.is_empty(), "{} of {tried}:\n{}", refused.len(), refused.join("\n"));
    assert!(tried > 900, "{tried}");
}
