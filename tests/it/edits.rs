//! A scene compiled after edits, in any order, reuses unchanged parts and equals the scene compiled from scratch.

use std::path::Path;

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayfront::internals::compile::{MemoizedScene, compile, compile_after};
use rayfront::internals::formats::{LoadOptions, load_again};
use rayfront::internals::world::{AssetCache, SourceFiles};

/// The number of successive edits.
const EDITS: usize = 250;

/// Editable parts, each with the texts to choose from.
const CHOICES: &str = r#"
SETTINGS = | copied_triangles: 0, | background: (0.1, 0.2, 0.3),
PAINT = base_color: (0.8, 0.2, 0.1) | base_color: Image("a.png") | base_color: (0.8, 0.2, 0.1), alpha: Image("a.png", Alpha), alpha_mode: Mask(cutoff: 0.5) | double_sided: false
GLOW = 0 | 2 | Image("b.png") | (0, 3, 0)
GLASS = diffuse: 0.5 | kt: 1, ior: 1.5 | diffuse: Image("b.png") | emission: 1
BALL = (0, 0, 0) | (-0.0, 0, 0) | (0.5, 0, 0) | (0, 1, 0)
SHAPE = Sphere(radius_m: 1) | Mesh("a.ply") | Mesh("b.ply") | Triangle(vertices: ((0, 0, 0), (1, 0, 0), (0, 1, 0)))
STRETCH = 1 | (1, 2, 1) | (-1, 1, 1)
MODEL = 0 | 15 | -0.0
MORE = | (shape: Mesh("a.ply"), transform: (translate: (3, 0, 0))), | (shape: Mesh("a.ply"), material: "glow"), (shape: Mesh("b.ply")),
LAMP = Point(power_w: 10) | Area(power_w: 10, size_m: 1, visible: true) | Spot(power_w: 10, inner_degrees: 5, outer_degrees: 9) | Directional(irradiance: 1)
SKY = radiance: 1 | radiance: 0.5 | image: "b.png" | radiance: 2, image: "a.png"
TURN = 0 | 30
EYE = Pinhole(vertical_fov_degrees: 40) | Orthographic(height_m: 3) | ThinLens(vertical_fov_degrees: 40, lens_radius_m: 0.1, focus_distance_m: 3, aperture: "b.png")
FROM = (0, 1, 5) | (1, 1, 5)"#;

const SCENE: &str = r#"(
    settings: (SETTINGS size: (16, 9), samples: 1, transport: Path),
    materials: { "paint": Principled(PAINT), "glow": Principled(emission: GLOW), "glass": (GLASS) },
    entities: [
        (camera: EYE, transform: LookAt(from: FROM, to: (0, 0, 0))),
        MORE (name: "parent", transform: (translate: BALL)),
        (parent: "parent", shape: SHAPE, material: "paint", transform: (scale: STRETCH)),
        (shape: Sphere(radius_m: 1), material: "glass", transform: (translate: (2, 0, 0), scale: STRETCH)),
        (shape: Plane(corners: ((-4, -1, -4), (-4, -1, 4), (4, -1, 4), (4, -1, -4))), material: "glow"),
        (gltf: "model.gltf", transform: (rotate_degrees: (0, MODEL, 0))),
        (light: LAMP, transform: (translate: (0, 4, 0), rotate_degrees: (-90, TURN, 0))),
        (light: Environment(SKY), transform: (rotate_degrees: (0, TURN, 0))),
    ],
)"#;

fn ply(corner: f32) -> String {
    let head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    format!("{head}0 0 0\n1 0 0\n{corner} 1 0\n0 0 1\n3 0 1 2\n3 0 2 3\n")
}

/// An image of four by four pixels that depends on `value`.
fn png(path: &Path, value: u8) {
    let pixel = |x: u32, y: u32| {
        image::Rgba([(40 * x) as u8, value, (40 * y) as u8, if x > y { 255 } else { value }])
    };
    image::RgbaImage::from_fn(4, 4, pixel).save(path).expect("a picture");
}

fn model(color: f32) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0, 1]}}],
        "nodes": [{{"mesh": 0}}, {{"mesh": 0, "translation": [0, {color}, 2]}}],
        "materials": [{{"name": "paint", "pbrMetallicRoughness": {{"baseColorFactor": [{color}, 0.5, 0.5, 1]}}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "material": 0}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5121, "count": 3, "type": "VEC3"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 9}}],
        "buffers": [{{"byteLength": 9, "uri": "data:;base64,AAAAAQAAAAEA"}}]}}"#
    )
}

#[test]
fn incremental_compilation_equals_compilation_from_scratch() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name);
    let write = |name: &str, text: &str| std::fs::write(file(name), text).expect("a file");
    write("a.ply", &ply(0.0));
    write("b.ply", &ply(0.5));
    write("model.gltf", &model(0.2));
    png(&file("a.png"), 100);
    png(&file("b.png"), 100);
    let choices = CHOICES.trim_start().lines().filter_map(|line| line.split_once(" = "));
    let choices: Vec<(&str, Vec<&str>)> =
        choices.map(|(name, texts)| (name, texts.split('|').map(str::trim).collect())).collect();
    let mut chosen = vec![0; choices.len()];
    let mut random = ChaCha8Rng::seed_from_u64(18);
    let kept = AssetCache::keeping();
    let mut before: Option<MemoizedScene> = None;
    let (mut trees, mut textures) = (0, 0);
    for edit in 0..EDITS {
        let what = random.random_range(0..choices.len() + 3);
        let number: u8 = random.random();
        let part = f32::from(number) / 255.0;
        match what.checked_sub(choices.len()) {
            None => chosen[what] = random.random_range(0..choices[what].1.len()),
            Some(0) => png(&file(["a.png", "b.png"][edit % 2]), number),
            Some(1) => write(["a.ply", "b.ply"][edit % 2], &ply(part)),
            Some(_) => write("model.gltf", &model(part)),
        }
        let text = choices.iter().zip(&chosen);
        let text =
            text.fold(SCENE.to_owned(), |text, ((name, texts), chosen)| text.replace(name, texts[*chosen]));
        write("scene.ron", &text);
        let load = |kept: &AssetCache| {
            let sources = SourceFiles::with(kept.clone());
            load_again(&file("scene.ron"), &LoadOptions::default(), &sources).expect("a scene")
        };
        let after = compile_after(&load(&kept), None, before.as_ref()).expect("a scene");
        let alone = compile(&load(&AssetCache::default()), None).expect("a scene");
        assert_eq!(after.scene.difference(&alone), None, "edit {edit}, of {what}: {text}");
        if let Some(before) = &before {
            trees += usize::from(std::sync::Arc::ptr_eq(&before.scene.bvh, &after.scene.bvh));
            textures += usize::from(std::sync::Arc::ptr_eq(&before.scene.textures, &after.scene.textures));
        }
        before = Some(after);
        kept.forget_unused();
    }
    // Most edits leave most parts unchanged.
    assert!(trees > EDITS / 3 && textures > EDITS / 2, "{trees} trees and {textures} textures of {EDITS}");
}
