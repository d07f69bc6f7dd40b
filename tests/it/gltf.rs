//! Every glTF file of the corpus, if present: set RAYFRONT_CORPUS to its folder.

use std::sync::Arc;

use rayfront::compile::compile;
use rayfront::internals::formats::{self, LoadOptions};
use rayfront::internals::integrator::Schedule;
use rayfront::internals::scene::CompiledScene;
use rayfront::render::{Options, Session};
use rayfront::world::{Camera, Light, Settings, Tonemap, Transport, World};

use crate::corpus;

/// Checks the invariants of every world.
fn check(world: &World) {
    for mesh in &world.assets.meshes {
        let vertices = mesh.positions.len();
        assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < vertices));
        assert!(mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite()));
        assert!(mesh.uvs.iter().all(|uv| uv.is_finite()));
        let (tangents, alphas) = (mesh.tangents.len(), mesh.alphas.len());
        let columns =
            [mesh.normals.len(), mesh.uvs.len(), mesh.uvs1.len(), mesh.colors.len(), tangents, alphas];
        assert!(columns.iter().all(|length| *length == 0 || *length == vertices));
        let unit = |length: f32| (length - 1.0).abs() < 1e-3;
        assert!(mesh.tangents.iter().all(|t| unit(t.truncate().length()) && unit(t.w.abs())));
        assert!(mesh.uvs1.iter().all(|uv| uv.is_finite()));
        assert_eq!(mesh.triangle_materials.len(), mesh.triangles.len());
        assert!(mesh.triangle_materials.iter().all(|id| (id.0 as usize) < world.assets.materials.len()));
    }
    assert!(world.warnings.iter().all(|warning| !warning.to_string().contains('\n')), "{:?}", world.warnings);
}

/// The hashes of a small image under both schedules.
fn hashes(world: &World, scene: CompiledScene) -> [u128; 2] {
    let settings = Settings { size: [32, 24], samples: 1, ..world.settings.clone() };
    let setup = Arc::new(rayfront::internals::render::setup(scene, &settings));
    [Schedule::Wavefront, Schedule::Recursive].map(|schedule| {
        let mut session = Session::of(setup.clone(), 1, Options { schedule, ..Options::default() });
        session.advance(1);
        session.film().hash()
    })
}

#[test]
fn corpus_models_render_identically_with_both_schedules_or_fail_as_expected() {
    let Some(corpus) = corpus::folder() else { return };
    let files = corpus::files(&corpus, &["gltf", "glb"]);
    let (mut surprises, mut loaded) = (Vec::new(), 0);
    for path in &files {
        let outcome = formats::load(path);
        let error = outcome.as_ref().err().map(|error| error as &dyn std::error::Error);
        surprises.extend(corpus::surprise(&corpus, path, error));
        let Ok(world) = outcome else { continue };
        loaded += 1;
        check(&world);
        match compile(&world, None) {
            Err(error) => surprises.push(format!("{} does not compile: {error}", path.display())),
            Ok(scene) => {
                let [wavefront, recursive] = hashes(&world, scene);
                if wavefront != recursive {
                    surprises.push(format!("{}: the schedules differ", path.display()));
                }
            }
        }
    }
    println!("{loaded} of {} files look the same both ways", files.len());
    assert!(surprises.is_empty(), "{}", surprises.join("\n"));
}

/// A triangle without a light, and optionally with a camera.
fn triangle(name: &str, camera: bool) -> std::path::PathBuf {
    let vertices: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = vertices.iter().flat_map(|number| number.to_le_bytes()).collect();
    let data: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    let camera = if camera {
        r#", "cameras": [{"type": "perspective",
            "perspective": {"yfov": 1, "znear": 0.1, "aspectRatio": 0.5}}]"#
    } else {
        ""
    };
    let node = if camera.is_empty() { "" } else { r#", {"camera": 0}"# };
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}{node}]{camera},
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
        "buffers": [{{"byteLength": 36, "uri": "data:application/octet-stream,{data}"}}]}}"#
    );
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn models_get_a_camera_and_a_studio() {
    let world = formats::load(triangle("alone.gltf", false)).unwrap();
    let settings = &world.settings;
    assert_eq!((settings.transport, settings.tonemap), (Transport::Path, Tonemap::PbrNeutral));
    assert_eq!((settings.max_depth, settings.samples, settings.size), (16, 64, [960, 540]));
    let mut lights = world.entities.query::<&Light>();
    let Some(Light::Environment { image: Some(image), .. }) = lights.iter().next() else { panic!() };
    assert!(world.assets.images.get(image.0 as usize).is_some());
    assert_eq!(world.entities.query::<&Camera>().iter().count(), 1);
    assert!(world.warnings[0].code == "camera-added" && world.warnings[1].code == "studio-added");
}

/// A scene file that only places a model gets a camera that shows all of it, like the model itself.
#[test]
fn scenes_that_only_place_a_model_get_a_camera() {
    triangle("placed.gltf", false);
    let scene = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("placed.ron");
    std::fs::write(&scene, r#"(entities: [(gltf: "placed.gltf"), (light: Sky)])"#).unwrap();
    let mut world = formats::load(&scene).unwrap();
    assert_eq!(world.entities.query::<&Camera>().iter().count(), 1);
    assert!(world.warnings.iter().any(|warning| warning.code == "camera-added"), "{:?}", world.warnings);
    (world.settings.size, world.settings.samples) = ([32, 18], 1);
    let seen = crate::support::film(&world, Options::default());
    assert!(seen.radiance().iter().any(|pixel| pixel.luminance() > 0.0));
}

/// `--env` replaces a scene's environment and the default one.
#[test]
fn env_option_replaces_the_environment() {
    let around = |path: &std::path::Path, name: &str| {
        let options = LoadOptions { surroundings: Some(name.parse().unwrap()), ..LoadOptions::default() };
        let world = formats::load_with(path, &options).unwrap();
        let lights: Vec<Light> = world.entities.query::<&Light>().iter().cloned().collect();
        assert!(!world.warnings.iter().any(|warning| warning.code == "no-light"), "{:?}", world.warnings);
        lights
    };
    let model = triangle("around.gltf", false);
    let [Light::Sky { elevation, azimuth, .. }] = around(&model, "sky:30,90")[..] else { panic!() };
    assert!((elevation.to_degrees() - 30.0).abs() < 1e-4 && (azimuth.to_degrees() - 90.0).abs() < 1e-4);
    assert!(matches!(around(&model, "studio")[..], [Light::Environment { image: Some(_), .. }]));
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let scene = folder.join("around.ron");
    let text = "(entities: [(light: Environment(radiance: 3)), (light: Point(power_w: 1)), (shape: Sphere),
                            (camera: Pinhole)])";
    std::fs::write(&scene, text).unwrap();
    let lights = around(&scene, "sky");
    assert_eq!(lights.len(), 2);
    assert!(lights.iter().any(|light| matches!(light, Light::Point { .. })));
    assert!(lights.iter().any(|light| matches!(light, Light::Sky { .. })));
    let missing =
        LoadOptions { surroundings: Some("nothing.exr".parse().unwrap()), ..LoadOptions::default() };
    let Err(error) = formats::load_with(&scene, &missing) else { panic!() };
    assert!(error.to_string().contains("nothing.exr"), "{error}");
}

#[test]
fn unlit_models_are_not_tone_mapped() {
    let plain = std::fs::read_to_string(triangle("lit.gltf", false)).unwrap();
    let with = |name: &str, materials: &str| {
        let primitives = plain.replace(
            r#"[{"attributes": {"POSITION": 0}}]"#,
            r#"[{"attributes": {"POSITION": 0}, "material": 0}, {"attributes": {"POSITION": 0}, "material": 1}]"#,
        );
        let used = format!(r#""extensionsUsed": ["KHR_materials_unlit"], "materials": {materials}, "nodes""#);
        let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::write(&path, primitives.replacen(r#""nodes""#, &used, 1)).unwrap();
        formats::load(&path).unwrap()
    };
    let unlit = r#"{"extensions": {"KHR_materials_unlit": {}}}"#;
    assert_eq!(with("unlit.gltf", &format!("[{unlit}, {unlit}]")).settings.tonemap, Tonemap::Clamp);
    let mixed = with("mixed.gltf", &format!("[{unlit}, {{}}]"));
    assert_eq!(mixed.settings.tonemap, Tonemap::PbrNeutral);
    assert!(mixed.warnings.iter().any(|warning| warning.text.contains("1 of 2 materials are unlit")));
}

#[test]
fn image_size_follows_the_cameras_aspect_ratio() {
    let path = triangle("upright.gltf", true);
    assert_eq!(formats::load(&path).unwrap().settings.size, [480, 960]);
}

/// Writes [`triangle`] with its material, and more nodes or other members before its nodes.
fn variation(name: &str, replace: &[(&str, &str)]) -> std::path::PathBuf {
    let path = triangle(name, true);
    let mut text = std::fs::read_to_string(&path).unwrap();
    for (old, new) in replace {
        assert!(text.contains(old), "{old}");
        text = text.replacen(old, new, 1);
    }
    std::fs::write(&path, text).unwrap();
    path
}

/// True if the words of each command of a diagnostic's remedy are options of the program.
fn can_be_typed(found: &rayfront::error::Diagnostic) -> bool {
    let commands = found.remedy.as_ref().map_or_else(Vec::new, |remedy| remedy.commands());
    let understood = |words: &Vec<String>| {
        let line = ["rayfront".to_owned(), "scene.glb".to_owned()].into_iter().chain(words.clone());
        rayfront::internals::cli::understands(&line.collect::<Vec<_>>()).is_ok()
    };
    !commands.is_empty() && commands.iter().all(understood)
}

#[test]
fn size_of_another_ratio_than_the_cameras_is_noted() {
    let path = triangle("framed.gltf", true);
    let note = |size: [u32; 2], edits: formats::Edits| {
        let options = LoadOptions { size: Some(size), edits, ..LoadOptions::default() };
        let warnings = formats::load_with(&path, &options).unwrap().warnings;
        warnings.into_iter().find(|warning| warning.code == "other-aspect-ratio")
    };
    let wide = note([640, 360], formats::Edits::default()).unwrap();
    let expected = "the camera's image is 0.50 times as wide as high: this one shows more at its sides \
                    (--size 320x640 shows the camera's)";
    assert_eq!(wide.to_string(), expected);
    assert!(can_be_typed(&wide));
    assert!(note([100, 400], formats::Edits::default()).unwrap().text.contains("shows less"));
    for fits in [[480, 960], [33, 65], [7, 15]] {
        assert_eq!(note(fits, formats::Edits::default()), None, "{fits:?}");
    }
    let turned = formats::Edits { orbit: Some([10.0, 0.0]), ..formats::Edits::default() };
    assert_eq!(note([640, 360], turned), None, "the camera is another one");
}

/// A white triangle that fills the image: a photograph of paper.
#[test]
fn white_of_unlit_surfaces_is_no_finding() {
    let found = |name: &str, material: &str| {
        let material = format!(r#""materials": [{{"doubleSided": true, {material}}}], "nodes""#);
        let path = variation(
            name,
            &[
                (r#""nodes""#, &material),
                (r#"{"POSITION": 0}}"#, r#"{"POSITION": 0}, "material": 0}"#),
                (r#"{"camera": 0}"#, r#"{"camera": 0, "translation": [0.2, 0.2, 0.1]}"#),
            ],
        );
        let mut world = formats::load(&path).unwrap();
        (world.settings.size, world.settings.samples) = ([16, 32], 4);
        (world.settings.auto_exposure, world.settings.exposure_ev) = (false, 0.0);
        let setup = rayfront::internals::render::setup(compile(&world, None).unwrap(), &world.settings);
        let mut session = Session::of(Arc::new(setup), 4, Options::default());
        session.advance(4);
        let image = rayfront::internals::check::FinishedImage::new(&world.settings, session.film());
        rayfront::internals::check::of_image(session.setup(), &image, false).map(|found| found.code)
    };
    assert_eq!(found("paper.gltf", r#""extensions": {"KHR_materials_unlit": {}}"#), None);
    let bright = r#""emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 40}}"#;
    assert_eq!(found("lamp.gltf", bright), Some("overexposed"));
}

#[test]
fn light_of_models_that_emit_is_noted_with_the_other_choice() {
    let strength = r#""extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 9}}"#;
    let materials = format!(r#""materials": [{{}}, {{"emissiveFactor": [1, 1, 1], {strength}}}], "nodes""#);
    let note = |name: &str, second: &str| {
        let primitives = format!(r#"{{"POSITION": 0}}, "material": {second}}}"#);
        let path = variation(name, &[(r#""nodes""#, &materials), (r#"{"POSITION": 0}}"#, &primitives)]);
        let world = formats::load(&path).unwrap();
        let found = world.warnings.iter().find(|warning| warning.remedy.is_some()).cloned().unwrap();
        assert!(can_be_typed(&found), "{found}");
        (found.code, world.entities.query::<&Light>().iter().count())
    };
    // The camera sees nothing but what emits, or nothing that does.
    assert_eq!(note("all_emits.gltf", "1"), ("lit-by-emission", 0));
    let eye = r#"{"camera": 0, "translation": [0.2, 0.2, 1]}, {"mesh": 1, "translation": [0, 0, -1]}"#;
    let mesh = r#""meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 1}]}, "#;
    let path = variation(
        "emits_behind.gltf",
        &[
            (r#""nodes""#, &materials),
            (r#""meshes": ["#, mesh),
            (r#"{"mesh": 0}"#, r#"{"mesh": 0, "translation": [0, 0, -3]}"#),
            (r#"{"camera": 0}"#, eye),
        ],
    );
    let world = formats::load(&path).unwrap();
    let found = world.warnings.iter().find(|warning| warning.code == "studio-added").unwrap();
    assert!(can_be_typed(found) && found.text.starts_with("materials emit light, but"), "{found}");
    assert_eq!(world.entities.query::<&Light>().iter().count(), 1);
}

/// Two animations of one node, of 2 s and of 1 s.
fn clips(name: &str) -> std::path::PathBuf {
    let data = |numbers: &[f32]| {
        let bytes = numbers.iter().flat_map(|number| number.to_le_bytes());
        bytes.map(|byte| format!("%{byte:02x}")).collect::<String>()
    };
    let numbers = [0.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let clip = |name: &str, input: u32| {
        let sampler = format!(r#"{{"input": {input}, "output": {}}}"#, input + 1);
        let channel = r#"{"sampler": 0, "target": {"node": 0, "path": "translation"}}"#;
        format!(r#"{{"name": "{name}", "channels": [{channel}], "samplers": [{sampler}]}}"#)
    };
    let animations = format!(r#""animations": [{}, {}], "nodes""#, clip("idle", 1), clip("walk", 3));
    let accessor = |offset: u32, kind: &str| {
        format!(
            r#", {{"bufferView": 1, "byteOffset": {offset}, "componentType": 5126, "count": 2, "type": "{kind}"}}"#
        )
    };
    let accessors =
        [accessor(0, "SCALAR"), accessor(8, "VEC3"), accessor(32, "SCALAR"), accessor(40, "VEC3")];
    let accessors = format!(r#""type": "VEC3"}}{}]"#, accessors.concat());
    let buffer = format!(
        r#""buffers": [{{"byteLength": 64, "uri": "data:application/octet-stream,{}"}}, "#,
        data(&numbers)
    );
    variation(
        name,
        &[
            (r#""nodes""#, &animations),
            (r#""type": "VEC3"}]"#, &accessors),
            (
                r#"{"buffer": 0, "byteLength": 36}"#,
                r#"{"buffer": 1, "byteLength": 36}, {"buffer": 0, "byteLength": 64}"#,
            ),
            (r#""buffers": ["#, &buffer),
        ],
    )
}

#[test]
fn animations_of_a_model_can_be_chosen_and_end() {
    let path = clips("clips.gltf");
    let load = |time_s: Option<f32>, animation: Option<&str>| {
        let animation = animation.map(str::to_owned);
        formats::load_with(&path, &LoadOptions { time_s, animation, ..LoadOptions::default() })
    };
    let codes = |time_s: f32, animation: Option<&str>| -> Vec<&str> {
        let world = load(Some(time_s), animation).unwrap();
        world.warnings.iter().map(|warning| warning.code).filter(|code| *code != "studio-added").collect()
    };
    assert_eq!(codes(1.5, None), ["several-animations"]);
    assert_eq!(codes(1.5, Some("walk")), ["after-the-end"]);
    assert!(codes(0.5, Some("walk")).is_empty() && codes(2.0, Some("0")).is_empty());
    let several = load(Some(1.0), None).unwrap().warnings;
    assert!(several.iter().any(|warning| warning.code == "several-animations" && can_be_typed(warning)));
    let message = load(None, Some("wakl")).err().unwrap().to_string();
    assert!(
        message.contains("/animations: there is no animation \"wakl\" (did you mean \"walk\"?)"),
        "{message}"
    );
    // A scene passes the choice to the models that it places.
    let scene = path.with_file_name("clips.ron");
    std::fs::write(&scene, r#"(entities: [(gltf: "clips.gltf"), (light: Sky)])"#).unwrap();
    let options = |animation: &str| LoadOptions {
        time_s: Some(1.0),
        animation: Some(animation.into()),
        ..LoadOptions::default()
    };
    let world = formats::load_with(&scene, &options("walk")).unwrap();
    let codes = ["several-animations", "unknown-animation", "import"];
    assert!(!world.warnings.iter().any(|it| codes.contains(&it.code)), "{:?}", world.warnings);
    let world = formats::load_with(&scene, &options("run")).unwrap();
    assert!(world.warnings.iter().any(|warning| warning.code == "unknown-animation"), "{:?}", world.warnings);
}

/// macOS writes an accent as a character of its own.
#[test]
fn names_are_found_with_composed_and_decomposed_accents() {
    let path = variation(
        "names.gltf",
        &[
            (r#"{"camera": 0}"#, "{\"camera\": 0, \"name\": \"Tu\u{308}r\"}"),
            (r#"{"mesh": 0}"#, "{\"mesh\": 0, \"name\": \"W\u{fc}rfel\"}"),
        ],
    );
    let world = formats::load(&path).unwrap();
    assert!(compile(&world, Some("T\u{fc}r")).is_ok() && compile(&world, Some("Tu\u{308}r")).is_ok());
    for query in ["\"Wu\u{308}rfel\"", "\"W\u{fc}*\"", "\"Wu\u{308}*\"", "Mesh[name=\"Wu\u{308}rfel\"]"] {
        let edits = formats::Edits { hide: vec![query.to_owned()], ..formats::Edits::default() };
        let options = LoadOptions { edits, ..LoadOptions::default() };
        assert!(formats::load_with(&path, &options).is_ok(), "{query}");
    }
}

#[test]
fn options_for_models_are_refused_for_other_files() {
    let options = LoadOptions { time_s: Some(1.0), ..LoadOptions::default() };
    let path = triangle("moment.gltf", false);
    let still = formats::load_with(&path, &options).unwrap();
    let is_told = still.warnings.iter().any(|warning| warning.code == "nothing-moves");
    assert!(is_told, "{:?}", still.warnings);
    let other = path.with_extension("ply");
    let message = formats::load_with(&other, &options).err().unwrap().to_string();
    assert!(message.starts_with("time_s: this is for .gltf, .glb and .ron files, not for "), "{message}");
    let options = LoadOptions { variant: Some("red".into()), ..LoadOptions::default() };
    let message = formats::load_with(path.with_extension("ron"), &options).err().unwrap().to_string();
    assert!(message.starts_with("variant: this is for .gltf and .glb files, not for "), "{message}");
}

/// The corners of all triangles, rounded and sorted.
fn corners(world: &World) -> Vec<[i64; 9]> {
    let mut corners: Vec<[i64; 9]> = Vec::new();
    for mesh in &world.assets.meshes {
        for triangle in &mesh.triangles {
            let mut points = triangle.map(|vertex| {
                mesh.positions[vertex as usize].to_array().map(|c| (f64::from(c) * 1000.0).round() as i64)
            });
            points.sort_unstable();
            corners.push(std::array::from_fn(|i| points[i / 3][i % 3]));
        }
    }
    corners.sort_unstable();
    corners
}

#[test]
fn compressed_meshes_equal_their_uncompressed_copies() {
    let Some(corpus) = corpus::folder() else { return };
    let load = |path: &str| corners(&formats::load(corpus.join(path)).unwrap_or_else(|e| panic!("{e}")));
    let models = "khronos-sample-assets/Models/Box";
    let plain = load(&format!("{models}/glTF/Box.gltf"));
    assert_eq!(plain, load(&format!("{models}/glTF-Draco/Box.gltf")));
    let meshopt = "apache-bsd/gltf-pipeline/specs/data/2.0/extensions";
    let ext =
        load(&format!("{meshopt}/EXT_meshopt_compression/meshopt-no-fallback/meshopt-no-fallback.gltf"));
    let khr = load(&format!("{meshopt}/KHR_meshopt_compression/meshopt-fallback/meshopt-fallback.gltf"));
    assert_eq!(ext, khr);
    // The ranges stated by the accessors.
    let path = format!("{meshopt}/EXT_meshopt_compression/meshopt-no-fallback/meshopt-no-fallback.gltf");
    let world = formats::load(corpus.join(path)).unwrap();
    for (mesh, (least, most)) in world.assets.meshes.iter().zip([(0.0, 16_383.0), (1315.0, 15_068.0)]) {
        let numbers = mesh.positions.iter().flat_map(|position| position.to_array());
        let [low, high] = [f32::min, f32::max].map(|pick| numbers.clone().reduce(pick).unwrap());
        assert_eq!((low, high), (least, most), "{}", mesh.name);
        assert!(mesh.normals.iter().all(|normal| (normal.length() - 1.0).abs() < 0.02));
    }
}

#[test]
fn damaged_draco_data_are_refused_or_read() {
    let Some(corpus) = corpus::folder() else { return };
    let from = corpus.join("khronos-sample-assets/Models/Box/glTF-Draco");
    let to = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("draco");
    std::fs::create_dir_all(&to).unwrap();
    std::fs::copy(from.join("Box.gltf"), to.join("Box.gltf")).unwrap();
    let data = std::fs::read(from.join("Box.bin")).unwrap();
    for at in 0..data.len() {
        for change in [0x01, 0x80, 0xff] {
            let mut data = data.clone();
            data[at] ^= change;
            std::fs::write(to.join("Box.bin"), data).unwrap();
            if let Err(error) = formats::load(to.join("Box.gltf")) {
                let message = error.to_string();
                assert!(
                    message.contains("KHR_draco_mesh_compression") && !message.contains('\n'),
                    "{message}"
                );
            }
        }
    }
}

#[test]
fn corpus_models_render_visible_images() {
    let Some(corpus) = corpus::folder() else { return };
    let models = corpus.join("khronos-sample-assets/Models");
    for name in [
        "Box/glTF/Box.gltf",
        "BoxVertexColors/glTF-Binary/BoxVertexColors.glb",
        "Suzanne/glTF/Suzanne.gltf",
        "LightsPunctualLamp/glTF/LightsPunctualLamp.gltf",
        "TransmissionTest/glTF/TransmissionTest.gltf",
        "SimpleSparseAccessor/glTF/SimpleSparseAccessor.gltf",
    ] {
        let mut world = formats::load(models.join(name)).unwrap();
        world.settings.size = [32, 32];
        world.settings.samples = 4;
        let scene = compile(&world, None).unwrap();
        let mut session = Session::new(scene, &world.settings, Options::default());
        session.advance(4);
        let radiance = session.film().radiance();
        assert!(radiance.iter().all(|pixel| pixel.is_finite()), "{name}");
        let brightness = |pixel: usize| radiance[pixel].luminance();
        let corner = brightness(0);
        let differs = (0..radiance.len()).filter(|pixel| (brightness(*pixel) - corner).abs() > 0.05).count();
        assert!(differs > 20, "{name}: only {differs} pixels show it");
    }
}

/// An image of one red texel, and a truncated one.
const RED: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP4z8DwHwAFAAH/VscvDQAAAABJRU5ErkJggg==";
const CUT_OFF: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAf";

#[test]
fn only_images_of_visible_materials_are_loaded() {
    use serde_json::json;
    let shows = |index: usize| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}});
    let triangle =
        |material: usize| json!({"primitives": [{"attributes": {"POSITION": 0}, "material": material}]});
    let mut coated = shows(0);
    coated["extensions"] =
        json!({"KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatTexture": {"index": 2}}});
    let mut red = shows(0);
    red["occlusionTexture"] = json!({"index": 3});
    let file = json!({
        "asset": {"version": "2.0"}, "extensionsUsed": ["KHR_materials_clearcoat"], "scene": 0,
        "scenes": [{"nodes": [0, 2, 3, 4]}, {"nodes": [5]}],
        "nodes": [{"children": [1]}, {"mesh": 0}, {"mesh": 1}, {"mesh": 2}, {"mesh": 3}, {"mesh": 4}],
        "meshes": [triangle(0), triangle(1), triangle(1), triangle(2), triangle(3)],
        // Red; truncated; red with a coat's texture; that of another scene.
        "materials": [red, shows(1), coated, shows(3)],
        "textures": [{"source": 0}, {"source": 1}, {"source": 2}, {"source": 3}],
        "images": [{"uri": RED}, {"uri": CUT_OFF}, {"uri": RED}, {"uri": CUT_OFF}],
        "accessors": [{"bufferView": 0, "componentType": 5121, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 9}],
        "buffers": [{"byteLength": 9, "uri": "data:;base64,AAAAAQAAAAEA"}],
    });
    let (mut assets, mut warnings) = (rayfront::world::Assets::default(), Vec::new());
    let (bytes, path) = (file.to_string().into_bytes(), std::path::Path::new("pictures.gltf"));
    formats::gltf::parse(&bytes, path, &LoadOptions::default(), &mut assets, &mut warnings).unwrap();
    let red = rayfront::world::Texels::Rgba8(vec![[255, 0, 0, 255]]);
    assert_eq!(assets.images.iter().map(|image| &image.texels).collect::<Vec<_>>(), [&red; 2]);
    // Each broken image is reported once, and unused ones are not reported.
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(
        warnings[0].to_string().starts_with("pictures.gltf: /images/1: the picture cannot be decoded"),
        "{warnings:?}"
    );
}
