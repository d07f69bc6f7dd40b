//! Tests of reading and writing physically based materials.

use std::path::Path;

use super::{grey, read, read_entity};
use crate::formats::ron::write;
use crate::math::Rgb;
use crate::world::assets::{ColorSpace, TextureFilter};
use crate::world::*;

fn principled(keys: &str) -> (Principled, World) {
    let world = read_entity(&format!("material: Principled({keys})"));
    let material = world.assets.materials.last().unwrap().material.clone();
    let Material::Principled(material) = material else { panic!("classic") };
    (*material, world)
}

fn texture(world: &World, id: TextureId) -> Texture {
    world.assets.textures[id.0 as usize]
}

const ALL: &str = r#"
    base_color: Texture(image: "a.png", rotation_degrees: 90, factor: 0.5), alpha: Image("a.png"),
    alpha_mode: Mask(cutoff: 0.25), metallic: Image("b.png"), roughness: Image("b.png", Red),
    normal: (texture: Image("n.png"), scale: 0.5), emission: (10, 5, 0), double_sided: true, unlit: true,
    ior: 1.33, specular: 0.5, specular_color: (1, 0.5, 2),
    transmission: Texture(image: "b.png", channel: Blue, factor: 0.75, uv_set: 1),
    volume: (attenuation_color: (0.5, 0.75, 1), attenuation_distance_m: 0.125, thickness_m: 0.25, priority: -2), dispersion: 0.5,
    diffuse_transmission: 0.25, diffuse_transmission_color: (1, 0.5, 0.25),
    clearcoat: 1, clearcoat_roughness: 0.125, clearcoat_normal: Image("n.png"),
    sheen_color: 0.5, sheen_roughness: 0.25,
    anisotropy: (strength: 0.5, rotation_degrees: 90, texture: Image("d.png")),
    iridescence: (factor: 1, ior: 1.5, thickness_minimum_nm: 200, thickness_maximum_nm: 500,
                  thickness: Image("i.png")),
    caustics: false
"#;

#[test]
fn every_key_of_a_principled_material_is_read() {
    let (material, world) = principled(ALL);
    let scalar = |factor| ScalarInput::constant(factor);
    let ColorInput::Texture(base) = material.base_color else { panic!("no texture") };
    let base = texture(&world, base);
    assert_eq!((base.rotation, base.factor), (std::f32::consts::FRAC_PI_2, grey(0.5)));
    assert_eq!(base.color_space, ColorSpace::Srgb);
    assert_eq!(material.alpha.texture.unwrap().1, Channel::Alpha);
    assert_eq!(material.alpha_mode, AlphaMode::Mask { cutoff: 0.25 });
    let (metallic, channel) = material.metallic.texture.unwrap();
    assert_eq!((channel, material.metallic.factor), (Channel::Blue, 1.0));
    assert_eq!(texture(&world, metallic).color_space, ColorSpace::Linear);
    assert_eq!(material.roughness.texture, Some((metallic, Channel::Red)));
    let normal = material.normal.unwrap();
    assert_eq!((normal.scale, texture(&world, normal.texture).color_space), (0.5, ColorSpace::Linear));
    assert_eq!(material.emission, ColorInput::Constant(Rgb::new(10.0, 5.0, 0.0)));
    assert!(material.double_sided && material.unlit && !material.caustics);
    assert_eq!((material.ior, material.specular, material.dispersion), (1.33, scalar(0.5), 0.5));
    let (transmission, channel) = material.transmission.texture.unwrap();
    assert_eq!((channel, material.transmission.factor), (Channel::Blue, 0.75));
    assert_eq!((texture(&world, transmission).uv_set, texture(&world, transmission).factor), (1, Rgb::WHITE));
    let volume = Volume {
        attenuation_color: Rgb::new(0.5, 0.75, 1.0),
        attenuation_distance: 0.125,
        thickness: 0.25,
        priority: -2,
        ..Volume::default()
    };
    assert_eq!(material.volume, Some(volume));
    assert_eq!(material.diffuse_transmission, scalar(0.25));
    assert_eq!((material.clearcoat, material.clearcoat_roughness), (scalar(1.0), scalar(0.125)));
    assert_eq!(material.clearcoat_normal, Some(NormalMap { texture: normal.texture, scale: 1.0 }));
    assert_eq!(material.sheen_color, ColorInput::Constant(grey(0.5)));
    assert_eq!(material.anisotropy.rotation, std::f32::consts::FRAC_PI_2);
    assert!(material.anisotropy.texture.is_some());
    let film = material.iridescence;
    assert_eq!((film.factor, film.ior), (scalar(1.0), 1.5));
    assert_eq!((film.thickness_minimum, film.thickness_maximum), (200.0, 500.0));
    assert_eq!(film.thickness.unwrap().1, Channel::Green);
}

#[test]
fn missing_keys_have_the_defaults_of_the_world() {
    assert_eq!(principled("").0, Principled::default());
    let (glass, _) = principled("transmission: 1, volume: (), alpha_mode: Blend");
    let volume = Volume::default();
    assert_eq!((glass.volume, glass.alpha_mode), (Some(volume), AlphaMode::Blend));
    assert_eq!(principled("alpha_mode: Mask").0.alpha_mode, AlphaMode::Mask { cutoff: 0.5 });
    // The world's own field names are accepted, too.
    let (short, _) = principled("volume: (attenuation_distance: 2)");
    assert_eq!(short.volume.unwrap().attenuation_distance, 2.0);
}

#[test]
fn principled_materials_survive_saving() {
    for keys in ["", "volume: ()", "alpha_mode: Blend, ior: 0, metallic: 0", ALL] {
        let (material, world) = principled(keys);
        let text = write(&world, Path::new("scenes/test.ron")).unwrap();
        let again = read(&text).unwrap_or_else(|error| panic!("{error} in\n{text}"));
        assert_eq!(again.assets.materials.last().unwrap().material, Material::Principled(Box::new(material)));
        assert_eq!(again.assets.textures, world.assets.textures);
        assert_eq!(write(&again, Path::new("scenes/test.ron")).unwrap(), text);
    }
    let (_, world) = principled("roughness: Image(\"b.png\", Red), anisotropy: (strength: 0.5)");
    let text = write(&world, Path::new("scenes/test.ron")).unwrap();
    let expected = "(material: Principled(roughness: Image(\"b.png\", Red), anisotropy: (strength: 0.5)))";
    assert!(text.contains(expected), "{text}");
}

#[test]
fn trilinear_textures_and_environments_survive_saving() {
    let world = read("(entities: [(light: Environment(image: \"studio.exr\"), material: (kd: Texture(image: \"a.png\", filter: Trilinear)))])").unwrap();
    assert_eq!(world.assets.textures[0].filter, TextureFilter::Trilinear);
    let text = write(&world, Path::new("scenes/test.ron")).unwrap();
    assert!(text.contains("light: Environment(image: \"studio.exr\")"), "{text}");
    assert!(read(&text).is_ok());
}

#[test]
fn metals_are_polished_unless_their_fields_say_otherwise() {
    let metal =
        |text: &str| match &read(&format!("(entities: [(material: {text})])")).unwrap().assets.materials[1]
            .material
        {
            Material::Principled(material) => (**material).clone(),
            Material::BlinnPhong(_) => panic!("a metal"),
        };
    let gold = metal("Metal(\"gold\")");
    assert_eq!(gold.base_color, ColorInput::Constant(Rgb::new(1.0, 0.729, 0.364)));
    assert_eq!((gold.edge_tint.r, gold.metallic.factor, gold.roughness.factor), (0.991, 1.0, 0.0));
    let brushed = metal("Metal(name: \"gold\", roughness: 0.3, edge_tint: 1)");
    assert_eq!(
        (brushed.base_color, brushed.edge_tint, brushed.roughness.factor),
        (gold.base_color, Rgb::WHITE, 0.3)
    );
}
