//! One picture in all formats of pictures, as a colour and as other data.

use std::path::Path;

use exr::prelude::{f16, write_rgb_file};
use image::codecs::{hdr::HdrEncoder, jpeg::JpegEncoder};
use image::{ImageBuffer, Rgb, RgbImage};

use super::files::{Number, Paint, ply};
use super::gltf::{Encoding, gltf};
use super::solid::Solid;
use super::{Comparison, EXACT, Stage, Tolerance, rounded, squares, srgb_decode};
use crate::program::{Place, empty_folder};
use rayfront::math::DVec3;

const SIDE: usize = 32;

/// A format of pictures: a file's name, and what it may make differ.
const FORMATS: [(&str, Tolerance); 9] = [
    ("eight.png", EXACT),
    ("sixteen.png", EXACT),
    ("picture.tga", EXACT),
    ("picture.bmp", EXACT),
    ("lossless.webp", EXACT),
    ("float.exr", EXACT),
    ("half.exr", rounded(1e-3)),
    // A mantissa of eight bits for the largest of three channels.
    ("picture.hdr", rounded(2e-2)),
    ("best.jpg", rounded(3e-2)),
];

/// Writes bytes in a format; formats of floats hold what `decode` makes of them.
fn write(path: &Path, bytes: &RgbImage, decode: impl Fn(u8) -> f32 + Sync) {
    let name = path.file_name().and_then(|name| name.to_str()).expect("a name");
    let floats = |x: usize, y: usize| bytes.get_pixel(x as u32, y as u32).0.map(&decode);
    match name {
        "sixteen.png" => {
            let wide = bytes.pixels().flat_map(|pixel| pixel.0.map(|byte| u16::from(byte) * 257)).collect();
            let side = SIDE as u32;
            ImageBuffer::<Rgb<u16>, Vec<u16>>::from_raw(side, side, wide)
                .expect("texels")
                .save(path)
                .unwrap();
        }
        "float.exr" => write_rgb_file(path, SIDE, SIDE, |x, y| floats(x, y).into()).unwrap(),
        "half.exr" => {
            write_rgb_file(path, SIDE, SIDE, |x, y| floats(x, y).map(f16::from_f32).into()).unwrap();
        }
        "picture.hdr" => {
            let texels: Vec<Rgb<f32>> =
                (0..SIDE * SIDE).map(|at| Rgb(floats(at % SIDE, at / SIDE))).collect();
            let file = std::fs::File::create(path).unwrap();
            HdrEncoder::new(file).encode(&texels, SIDE, SIDE).unwrap();
        }
        "best.jpg" => {
            let file = std::fs::File::create(path).unwrap();
            JpegEncoder::new_with_quality(file, 100).encode_image(bytes).unwrap();
        }
        _ => bytes.save(path).unwrap(),
    }
}

/// Renders the box with a material that has a texture, in all formats.
fn check(bytes: &RgbImage, decode: impl Fn(u8) -> f32 + Sync, material: &str) {
    let folder = &empty_folder();
    let block = Solid::block(DVec3::ZERO);
    folder
        .write("block.ply", ply(&block, "ascii", Number::Double, Number::Byte, Paint::Picture("eight.png")));
    let mut comparison = Comparison::default();
    for (name, tolerance) in FORMATS {
        write(&folder.join(name), bytes, &decode);
        let mut stage = Stage::at(DVec3::ZERO);
        stage.paint = material.replace("FILE", &format!("\"{name}\""));
        let seen = stage.render(folder, "(shape: Mesh(\"block.ply\"), material: \"paint\"),");
        comparison.add(format!("{name} in {material}"), seen, tolerance);
    }
    comparison.finish();
}

fn as_they_are(byte: u8) -> f32 {
    f32::from(byte) / 255.0
}

#[test]
fn colors_of_pictures_are_the_same_in_all_formats() {
    let decode = |byte| srgb_decode(f64::from(byte) / 255.0) as f32;
    check(&squares(), decode, "(diffuse: Image(FILE))");
    check(&squares(), decode, "Principled(base_color: Image(FILE), metallic: 0, specular: 0)");
    check(&squares(), decode, "(diffuse: 0, emission: Image(FILE))");
}

#[test]
fn data_of_pictures_are_the_same_in_all_formats() {
    check(&squares(), as_they_are, "Principled(metallic: 0, roughness: Image(FILE))");
    check(&squares(), as_they_are, "Principled(metallic: Image(FILE), roughness: 0.6)");
    check(
        &squares(),
        as_they_are,
        "(diffuse: 1, alpha: Texture(image: FILE, channel: Green, filter: Nearest), alpha_mode: Mask(cutoff: 0.6))",
    );
    let texture = "Texture(image: FILE, color_space: Linear)";
    check(&squares(), as_they_are, &format!("(diffuse: {texture})"));
    let relief = RgbImage::from_fn(SIDE as u32, SIDE as u32, |x, y| {
        Rgb([98 + 20 * (x / 8) as u8, 158 - 20 * (y / 8) as u8, 240])
    });
    check(&relief, as_they_are, "Principled(metallic: 0, specular: 0, normal: Image(FILE))");
    // In squares, and by gradients.
    check(
        &relief,
        as_they_are,
        "Principled(metallic: 0, specular: 0, bump: (texture: Image(FILE, Red), height_m: 0.2))",
    );
}

/// The pictures that glTF files may have.
#[test]
fn pictures_of_models_are_the_same_as_those_of_scenes() {
    let folder = &empty_folder();
    let block = Solid::block(DVec3::ZERO);
    let mut comparison = Comparison::default();
    for (name, tolerance) in
        FORMATS.into_iter().filter(|(name, _)| ["png", "jpg", "ebp"].contains(&&name[name.len() - 3..]))
    {
        write(&folder.join(name), &squares(), as_they_are);
        folder.write("block.ply", ply(&block, "ascii", Number::Double, Number::Byte, Paint::Picture(name)));
        let mut stage = Stage::at(DVec3::ZERO);
        stage.paint = format!("(diffuse: Texture(image: \"{name}\", filter: Trilinear))");
        let seen = stage.render(folder, "(shape: Mesh(\"block.ply\"), material: \"paint\"),");
        comparison.add(format!("a scene with {name}"), seen, tolerance);
        folder.write("block.gltf", gltf(&block, Encoding::Embedded, Paint::Picture(name)));
        let seen = stage.render(folder, "(gltf: \"block.gltf\"),");
        comparison.add(format!("a model with {name}"), seen, tolerance);
    }
    comparison.finish();
}
