//! Materials and textures.

use super::*;
use crate::math::{Rgb, Vec2};
use crate::world::assets::{TextureFilter, Wrap};
use crate::world::{ColorInput, Texture};

/// Adds texture 0: two pixels, black and white, in the BMP format.
pub(super) fn add_texture(file: &mut Value) {
    let mut bmp = b"BM".to_vec();
    for word in [54u32 + 8, 0, 54, 40, 2, 1, 1 | 24 << 16, 0, 8, 0, 0, 0, 0] {
        bmp.extend(word.to_le_bytes());
    }
    bmp.extend([0, 0, 0, 255, 255, 255, 0, 0]);
    set(file, "/images", json!([{"uri": data_uri(&bmp)}]));
    set(file, "/textures", json!([{"source": 0, "sampler": 0}]));
    set(file, "/samplers", json!([{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}]));
}

fn read_material(material: Value) -> Read {
    let mut file = triangle();
    add_texture(&mut file);
    set(&mut file, "/materials", json!([material]));
    set(&mut file, "/meshes/0/primitives/0/material", json!(0));
    read(&file)
}

fn material(source: Value) -> BlinnPhong {
    read_material(source).material().clone()
}

fn constant(input: ColorInput) -> Rgb {
    let ColorInput::Constant(color) = input else { panic!("{input:?}") };
    color
}

fn texture(read: &Read, input: ColorInput) -> Texture {
    let ColorInput::Texture(id) = input else { panic!("{input:?}") };
    read.assets.textures[id.0 as usize]
}

fn near(a: Rgb, b: Rgb) -> bool {
    (a + b * -1.0).map(f32::abs).max_component() < 1e-5
}

#[test]
fn rough_plastic_is_nearly_diffuse() {
    let plastic = material(
        json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0, 1], "metallicFactor": 0}}),
    );
    assert_eq!(constant(plastic.diffuse), Rgb::new(0.5, 0.25, 0.0));
    assert_eq!(plastic.shininess, 0.0);
    assert!(near(constant(plastic.specular), Rgb::splat(0.04 / 4.0)));
    assert!(constant(plastic.kr).is_black() && plastic.ior.is_none());
}

#[test]
fn smooth_metals_are_mirrors_and_rough_ones_are_not() {
    let metal = |roughness: f32| {
        let gold = [1.0, 0.8, 0.3, 1.0];
        material(json!({"pbrMetallicRoughness": {"baseColorFactor": gold, "roughnessFactor": roughness}}))
    };
    let mirror = metal(0.0);
    assert_eq!(constant(mirror.kr), Rgb::new(1.0, 0.8, 0.3));
    assert!(constant(mirror.diffuse).max_component() < 0.03);
    let satin = metal(0.5);
    assert!(constant(satin.kr).is_black());
    assert!((satin.shininess - 30.0).abs() < 1e-3, "2/α² − 2 with α = ¼");
    let three_quarters = Rgb::new(1.0, 0.8, 0.3) * (0.75 * 32.0 / 8.0);
    assert!(near(constant(satin.specular), three_quarters), "{:?}", satin.specular);
    let chalk = metal(1.0);
    assert_eq!(constant(chalk.diffuse), Rgb::new(1.0, 0.8, 0.3));
    assert!(constant(chalk.specular).is_black());
}

#[test]
fn textures_have_factors_samplers_and_transforms() {
    let transform = json!({"KHR_texture_transform": {"offset": [0.5, 0], "scale": [2, 3], "rotation": 1}});
    let read = read_material(json!({"pbrMetallicRoughness": {
        "metallicFactor": 0, "baseColorFactor": [0.5, 1, 1, 1],
        "baseColorTexture": {"index": 0, "extensions": transform},
    }}));
    let texture = texture(&read, read.material().diffuse);
    assert_eq!(texture.factor, Rgb::new(0.5, 1.0, 1.0));
    assert_eq!((texture.filter, texture.wrap), (TextureFilter::Nearest, [Wrap::Clamp, Wrap::Mirror]));
    assert_eq!((texture.scale, texture.offset), (Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.0)));
    assert!(read.warnings[0].contains("1 textures are rotated"), "{:?}", read.warnings);
}

#[test]
fn textures_of_metalness_and_roughness_count_by_their_means() {
    let read = read_material(json!({"pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 0}}}));
    let material = read.material();
    assert!((material.shininess - 30.0).abs() < 1e-3, "half of roughness 1");
    assert!(near(constant(material.diffuse), Rgb::splat(0.5 + 0.5 * 0.25)));
    assert!(read.assets.images.is_empty(), "its picture is not kept");
}

#[test]
fn glass_lets_its_color_through_and_bends_if_it_has_a_volume() {
    let glass = |extensions: Value| {
        material(json!({
            "pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 1, 1], "metallicFactor": 0},
            "extensions": extensions,
        }))
    };
    let through = json!({"transmissionFactor": 0.75});
    let volume = json!({
        "KHR_materials_transmission": through, "KHR_materials_volume": {"thicknessFactor": 1},
        "KHR_materials_ior": {"ior": 1.25},
    });
    let solid = glass(volume);
    assert_eq!(solid.ior, Some(1.25));
    assert_eq!(solid.kt, Rgb::new(0.375, 0.75, 0.75));
    assert_eq!(constant(solid.kr), Rgb::WHITE);
    assert_eq!(constant(solid.diffuse), Rgb::new(0.125, 0.25, 0.25));
    let wall = glass(json!({"KHR_materials_transmission": {"transmissionFactor": 1}}));
    assert_eq!(wall.ior, Some(1.0));
}

#[test]
fn light_is_given_off_by_strength_and_by_unlit_surfaces() {
    let lamp = material(json!({
        "emissiveFactor": [1, 0.5, 0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}},
    }));
    assert_eq!(constant(lamp.emission), Rgb::new(4.0, 2.0, 0.0));
    let read = read_material(json!({"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}));
    assert_eq!(texture(&read, read.material().emission).factor, Rgb::WHITE);
    let unlit = material(json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 1]},
        "extensions": {"KHR_materials_unlit": {}},
    }));
    assert_eq!(constant(unlit.emission), Rgb::new(0.1, 0.2, 0.3));
    assert!(constant(unlit.diffuse).is_black());
}

#[test]
fn what_is_see_through_or_has_no_picture_is_told() {
    let read = read_material(json!({"name": "leaf", "alphaMode": "MASK"}));
    assert!(read.warnings[0].ends_with("opaque: leaf"), "{:?}", read.warnings);
    let mut file = triangle();
    add_texture(&mut file);
    set(&mut file, "/images/0/uri", json!("no%20such.png"));
    let texture = json!({"index": 0});
    set(&mut file, "/materials", json!([{"pbrMetallicRoughness": {"baseColorTexture": texture}}]));
    set(&mut file, "/meshes/0/primitives/0/material", json!(0));
    let read = super::read(&file);
    assert!(read.warnings[0].contains("no such.png: cannot read"), "{:?}", read.warnings);
    assert_eq!(constant(read.material().diffuse), Rgb::WHITE);
}
