//! Materials and textures.

use super::*;
use crate::math::{Rgb, Vec2};
use crate::world::assets::{ColorSpace, TextureFilter, Wrap};
use crate::world::{AlphaMode, Channel, ColorInput, ScalarInput, Texels, Texture, TextureId};

/// Adds texture 0: two pixels, black and white, as BMP.
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

pub(super) fn read_material(material: Value) -> Read {
    let mut file = triangle();
    add_texture(&mut file);
    set(&mut file, "/materials", json!([material]));
    set(&mut file, "/meshes/0/primitives/0/material", json!(0));
    read(&file)
}

fn material(source: Value) -> Principled {
    read_material(source).material().clone()
}

fn constant(input: ColorInput) -> Rgb {
    let ColorInput::Constant(color) = input else { panic!("{input:?}") };
    color
}

fn texture(read: &Read, id: TextureId) -> Texture {
    read.assets.textures[id.0 as usize]
}

fn of_color(read: &Read, input: ColorInput) -> Texture {
    let ColorInput::Texture(id) = input else { panic!("{input:?}") };
    texture(read, id)
}

fn of_scalar(read: &Read, input: ScalarInput) -> (f32, Texture, Channel) {
    let (id, channel) = input.texture.unwrap();
    (input.factor, texture(read, id), channel)
}

#[test]
fn missing_material_is_the_default_of_the_specification() {
    assert_eq!(material(json!({})), Principled::default());
    assert_eq!(*read(&triangle()).material(), Principled::default());
}

#[test]
fn core_factors_are_kept() {
    let read = material(json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0, 0.5], "metallicFactor": 0.1, "roughnessFactor": 0.2},
        "emissiveFactor": [1, 0.5, 0], "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.75,
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_unlit": {}},
    }));
    assert_eq!(constant(read.base_color), Rgb::new(0.5, 0.25, 0.0));
    assert_eq!((read.metallic, read.roughness), (ScalarInput::constant(0.1), ScalarInput::constant(0.2)));
    assert_eq!(constant(read.emission), Rgb::new(4.0, 2.0, 0.0));
    assert_eq!((read.alpha, read.alpha_mode), (ScalarInput::constant(0.5), AlphaMode::Mask { cutoff: 0.75 }));
    assert!(read.double_sided && read.unlit);
}

#[test]
fn textures_have_factors_samplers_and_transforms() {
    let transform = json!({"KHR_texture_transform": {
        "offset": [0.5, 0], "scale": [2, 3], "rotation": 1, "texCoord": 1,
    }});
    let slot = json!({"index": 0, "texCoord": 7, "extensions": transform});
    let read = read_material(json!({
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 1, 1, 0.25], "baseColorTexture": slot, "metallicRoughnessTexture": slot,
        },
        "alphaMode": "BLEND",
        "normalTexture": {"index": 0, "scale": 0.5, "extensions": transform},
        "emissiveTexture": slot, "emissiveFactor": [1, 1, 1],
    }));
    let material = read.material();
    let base = of_color(&read, material.base_color);
    assert_eq!((base.factor, base.color_space), (Rgb::new(0.5, 1.0, 1.0), ColorSpace::Srgb));
    let (alpha, same, channel) = of_scalar(&read, material.alpha);
    assert_eq!((alpha, same, channel), (0.25, base, Channel::Alpha));
    let (_, metallic, blue) = of_scalar(&read, material.metallic);
    let (_, roughness, green) = of_scalar(&read, material.roughness);
    assert_eq!((blue, green), (Channel::Blue, Channel::Green));
    assert_eq!((metallic.color_space, metallic), (ColorSpace::Linear, roughness));
    let normal = material.normal.unwrap();
    assert_eq!((normal.scale, texture(&read, normal.texture).color_space), (0.5, ColorSpace::Linear));
    for texture in [base, metallic, texture(&read, normal.texture), of_color(&read, material.emission)] {
        assert_eq!((texture.filter, texture.wrap), (TextureFilter::Nearest, [Wrap::Clamp, Wrap::Mirror]));
        assert_eq!((texture.scale, texture.offset), (Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.0)));
        assert_eq!((texture.rotation, texture.uv_set), (1.0, 1));
    }
    assert_eq!(read.assets.images.len(), 1);
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);
}

#[test]
fn texture_filter_follows_the_sampler() {
    let filter = |sampler: Option<Value>| {
        let mut file = triangle();
        add_texture(&mut file);
        set(&mut file, "/textures", json!([{"source": 0}]));
        if let Some(sampler) = sampler {
            set(&mut file, "/textures/0/sampler", json!(0));
            set(&mut file, "/samplers", json!([sampler]));
        }
        let texture = json!({"index": 0});
        set(&mut file, "/materials", json!([{"pbrMetallicRoughness": {"baseColorTexture": texture}}]));
        set(&mut file, "/meshes/0/primitives/0/material", json!(0));
        read(&file).assets.textures[0].filter
    };
    assert_eq!(filter(None), TextureFilter::Trilinear);
    assert_eq!(filter(Some(json!({}))), TextureFilter::Trilinear);
    assert_eq!(filter(Some(json!({"magFilter": 9729, "minFilter": 9987}))), TextureFilter::Trilinear);
    assert_eq!(filter(Some(json!({"minFilter": 9729}))), TextureFilter::Bilinear);
    assert_eq!(filter(Some(json!({"magFilter": 9728, "minFilter": 9987}))), TextureFilter::Nearest);
}

#[test]
fn glass_has_a_volume_if_its_thickness_is_positive() {
    let glass = |thickness: f32| {
        material(json!({"extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 0.75},
            "KHR_materials_volume": {
                "thicknessFactor": thickness, "attenuationColor": [1, 0.5, 0], "attenuationDistance": 2,
            },
            "KHR_materials_ior": {"ior": 1.25},
            "KHR_materials_dispersion": {"dispersion": 0.5},
        }}))
    };
    let solid = glass(1.0);
    assert_eq!((solid.ior, solid.dispersion), (1.25, 0.5));
    assert_eq!(solid.transmission, ScalarInput::constant(0.75));
    let volume = solid.volume.unwrap();
    assert_eq!((volume.attenuation_color, volume.attenuation_distance), (Rgb::new(1.0, 0.5, 0.0), 2.0));
    assert_eq!(volume.thickness, 1.0);
    assert_eq!(glass(0.0).volume, None);
    let clear = material(json!({"extensions": {"KHR_materials_volume": {"thicknessFactor": 1}}}));
    assert_eq!(clear.volume.unwrap().attenuation_distance, f32::INFINITY);
    let reflects_all = material(json!({"extensions": {"KHR_materials_ior": {"ior": 0}}}));
    assert_eq!(reflects_all.ior, 0.0);
}

#[test]
fn layer_textures_are_read_from_their_channels() {
    let slot = json!({"index": 0});
    let read = read_material(json!({"extensions": {
        "KHR_materials_specular": {
            "specularFactor": 0.5, "specularTexture": slot, "specularColorFactor": [2, 1, 0],
            "specularColorTexture": slot,
        },
        "KHR_materials_clearcoat": {
            "clearcoatFactor": 0.5, "clearcoatTexture": slot, "clearcoatRoughnessFactor": 0.25,
            "clearcoatRoughnessTexture": slot, "clearcoatNormalTexture": {"index": 0, "scale": 3},
        },
        "KHR_materials_sheen": {
            "sheenColorFactor": [1, 0.5, 0], "sheenColorTexture": slot, "sheenRoughnessFactor": 0.5,
            "sheenRoughnessTexture": slot,
        },
        "KHR_materials_anisotropy": {
            "anisotropyStrength": 0.5, "anisotropyRotation": 2, "anisotropyTexture": slot,
        },
        "KHR_materials_iridescence": {
            "iridescenceFactor": 0.5, "iridescenceTexture": slot, "iridescenceIor": 1.8,
            "iridescenceThicknessTexture": slot, "iridescenceThicknessMaximum": 500,
        },
        "KHR_materials_diffuse_transmission": {
            "diffuseTransmissionFactor": 0.5, "diffuseTransmissionTexture": slot,
            "diffuseTransmissionColorFactor": [1, 0, 1],
        },
        "KHR_materials_transmission": {"transmissionFactor": 0.5, "transmissionTexture": slot},
    }}));
    let material = read.material();
    for (input, expected) in [
        (material.specular, Channel::Alpha),
        (material.clearcoat, Channel::Red),
        (material.sheen_roughness, Channel::Alpha),
        (material.iridescence.factor, Channel::Red),
        (material.diffuse_transmission, Channel::Alpha),
        (material.transmission, Channel::Red),
    ] {
        let (factor, texture, channel) = of_scalar(&read, input);
        assert_eq!((factor, channel, texture.color_space), (0.5, expected, ColorSpace::Linear));
    }
    let (factor, _, channel) = of_scalar(&read, material.clearcoat_roughness);
    assert_eq!((factor, channel), (0.25, Channel::Green));
    assert_eq!(material.clearcoat_normal.unwrap().scale, 3.0);
    let specular = of_color(&read, material.specular_color);
    assert_eq!((specular.factor, specular.color_space), (Rgb::new(2.0, 1.0, 0.0), ColorSpace::Srgb));
    assert_eq!(of_color(&read, material.sheen_color).factor, Rgb::new(1.0, 0.5, 0.0));
    let anisotropy = material.anisotropy;
    assert_eq!((anisotropy.strength, anisotropy.rotation), (0.5, 2.0));
    assert_eq!(texture(&read, anisotropy.texture.unwrap()).color_space, ColorSpace::Linear);
    let film = material.iridescence;
    assert_eq!((film.ior, film.thickness_minimum, film.thickness_maximum), (1.8, 100.0, 500.0));
    assert_eq!(film.thickness.unwrap().1, Channel::Green);
    assert_eq!(constant(material.diffuse_transmission_color), Rgb::new(1.0, 0.0, 1.0));
}

#[test]
fn specular_glossiness_reflects_its_specular_color() {
    let older = |fields: Value| json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": fields}});
    let plain = material(older(json!({
        "diffuseFactor": [0.5, 0.25, 0, 1], "specularFactor": [1, 0.5, 0.25], "glossinessFactor": 0.75,
    })));
    assert_eq!(constant(plain.base_color), Rgb::new(0.5, 0.25, 0.0));
    assert_eq!((plain.ior, plain.metallic, plain.roughness.factor), (0.0, ScalarInput::constant(0.0), 0.25));
    assert_eq!(constant(plain.specular_color), Rgb::new(1.0, 0.5, 0.25));
    let read = read_material(older(json!({
        "glossinessFactor": 0.5, "specularGlossinessTexture": {"index": 0},
    })));
    let (factor, texture, channel) = of_scalar(&read, read.material().roughness);
    assert_eq!((factor, channel, texture.color_space), (1.0, Channel::Red, ColorSpace::Linear));
    let Texels::Rgba8(texels) = &read.assets.images[texture.image().unwrap().0 as usize].texels else {
        panic!()
    };
    assert_eq!(texels[0], [128, 0, 0, 255], "1 − 0.5 · alpha, which is 1 in a picture without");
}

#[test]
fn variants_replace_materials_by_name() {
    let mut file = with(&[
        ("/extensions", json!({"KHR_materials_variants": {"variants": [{"name": "red"}, {"name": "blue"}]}})),
        ("/materials", json!([{"name": "a"}, {"name": "b"}])),
    ]);
    let mappings = json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [1]}]}});
    set(&mut file, "/meshes/0/primitives/0/material", json!(0));
    set(&mut file, "/meshes/0/primitives/0/extensions", mappings);
    let name = |variant: Option<&str>| {
        let options = LoadOptions { variant: variant.map(str::to_owned), ..LoadOptions::default() };
        let read = read_with(file.to_string().as_bytes(), &options).map_err(|error| error.to_string())?;
        let id = read.mesh().triangle_materials[0];
        Ok::<_, String>(read.assets.materials[id.0 as usize].name.clone().unwrap())
    };
    assert_eq!([name(None), name(Some("red")), name(Some("blue"))].map(Result::unwrap), ["a", "a", "b"]);
    let message = name(Some("bleu")).unwrap_err();
    assert!(
        message.contains("did you mean \"blue\"") && message.contains("variants: red, blue"),
        "{message}"
    );

    // A variant without a name is called by its number.
    set(&mut file, "/extensions/KHR_materials_variants/variants/1", json!({}));
    let options = LoadOptions { variant: Some("1".into()), ..LoadOptions::default() };
    let read = read_with(file.to_string().as_bytes(), &options).unwrap();
    assert_eq!(
        read.assets.materials[read.mesh().triangle_materials[0].0 as usize].name.as_deref(),
        Some("b")
    );
}

#[test]
fn missing_images_cause_warnings() {
    let mut file = triangle();
    add_texture(&mut file);
    set(&mut file, "/images/0/uri", json!("no%20such.png"));
    let texture = json!({"index": 0});
    set(&mut file, "/materials", json!([{"pbrMetallicRoughness": {"baseColorTexture": texture}}]));
    set(&mut file, "/meshes/0/primitives/0/material", json!(0));
    let read = super::read(&file);
    assert!(read.warnings[0].contains("no such.png: cannot read"), "{:?}", read.warnings);
    assert_eq!(constant(read.material().base_color), Rgb::WHITE);
}

#[test]
fn third_set_of_texture_coordinates_causes_a_warning() {
    let slot = json!({"index": 0, "texCoord": 2});
    let read = read_material(json!({"pbrMetallicRoughness": {"baseColorTexture": slot}}));
    assert!(read.warnings[0].contains("1 texture uses a third set"), "{:?}", read.warnings);
}

/// Glass without a volume is a thin sheet, which is seldom intended for a closed mesh.
#[test]
fn closed_meshes_of_hollow_glass_cause_warnings_and_can_be_made_solid() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let seen = |generator: &str, faces: &[[usize; 3]], extensions: Value, solid_glass: bool| {
        // Each face has its own vertices, for flat shading.
        let numbers: Vec<f32> = faces.iter().flatten().flat_map(|corner| corners[*corner]).collect();
        let mut file = with(&[
            ("/materials", json!([{"extensions": extensions}])),
            ("/meshes/0/primitives/0/material", json!(0)),
            ("/asset/generator", json!(generator)),
        ]);
        let accessor = add_accessor(&mut file, &floats(&numbers), 5126, "VEC3", 3 * faces.len());
        set(&mut file, "/meshes/0/primitives/0/attributes/POSITION", json!(accessor));
        file["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
        let options = LoadOptions { solid_glass, ..LoadOptions::default() };
        let read = read_with(file.to_string().as_bytes(), &options).unwrap();
        let told =
            read.warnings.iter().any(|line| line.contains("1 closed mesh is of glass without a volume"));
        (told, read.material().volume.is_some())
    };
    let clear = json!({"KHR_materials_transmission": {"transmissionFactor": 1}});
    let filled = json!({
        "KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_volume": {"thicknessFactor": 1},
    });
    let blender = "Khronos glTF Blender I/O v4.2.57";
    assert_eq!(seen(blender, &faces, clear.clone(), false), (true, false));
    assert_eq!(seen("another", &faces, clear.clone(), false), (false, false));
    assert_eq!(seen(blender, &faces, clear.clone(), true), (false, true));
    assert_eq!(seen(blender, &faces[..3], clear, false), (false, false), "a window");
    assert_eq!(seen(blender, &faces, filled, false), (false, true));
    assert_eq!(seen(blender, &faces, json!({}), true), (false, false), "no glass");
}

/// A closed mesh that faces inwards and is invisible from behind is never intended.
#[test]
fn inside_out_meshes_cause_warnings_and_can_be_made_double_sided() {
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let seen = |turned: bool, open: bool, double_sided: bool, all: bool| {
        let corner =
            |corner: usize| [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]][corner];
        let faces = faces
            .iter()
            .skip(usize::from(open))
            .map(|[a, b, c]| if turned { [*a, *c, *b] } else { [*a, *b, *c] });
        let numbers: Vec<f32> = faces.flatten().flat_map(corner).collect();
        let mut file = with(&[
            ("/materials", json!([{"doubleSided": double_sided}])),
            ("/meshes/0/primitives/0/material", json!(0)),
        ]);
        let accessor = add_accessor(&mut file, &floats(&numbers), 5126, "VEC3", numbers.len() / 3);
        set(&mut file, "/meshes/0/primitives/0/attributes/POSITION", json!(accessor));
        file["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
        let options = LoadOptions { double_sided: all, ..LoadOptions::default() };
        let read = read_with(file.to_string().as_bytes(), &options).unwrap();
        let told = read.warnings.iter().any(|line| line.contains("1 closed mesh is inside out"));
        (told, read.material().double_sided)
    };
    assert_eq!(seen(false, false, false, false), (false, false));
    assert_eq!(seen(true, false, false, false), (true, false));
    assert_eq!(seen(true, true, false, false), (false, false), "open");
    assert_eq!(seen(true, false, true, false), (false, true));
    assert_eq!(seen(true, false, false, true), (false, true), "--double-sided");
}
