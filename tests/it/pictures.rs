//! Images as textures: values of all depths mean the same; every image of the corpus at `RAYFRONT_CORPUS` is read, or
//! refused in one line.

use std::path::Path;

use rayfront::internals::film::tonemap::DisplayTransform;
use rayfront::internals::formats::picture;
use rayfront::math::Rgb;
use rayfront::world::{Texels, Tonemap};

use crate::corpus;
use crate::program::{Folder, Place, empty_folder, folder};
use crate::support::Picture;

const EXTENSIONS: [&str; 8] = ["png", "jpg", "jpeg", "tga", "bmp", "webp", "hdr", "exr"];

/// Files that cannot be read, by the end of their path.
const REFUSED: [&str; 16] = [
    // PngSuite's intentionally broken files.
    "corrupt/xc1n0g08.png", "corrupt/xc9n2c08.png", "corrupt/xcrn0g04.png", "corrupt/xcsn0g01.png",
    "corrupt/xd3n2c08.png", "corrupt/xdtn0g01.png", "corrupt/xhdn0g08.png", "corrupt/xlfn0g04.png",
    "corrupt/xs1n0g01.png", "corrupt/xs4n0g01.png",
    // Apple's variant of PNG, which no other program reads.
    "iphone/iphone_basi3p02.png", "iphone/iphone_bgyn6a16.png", "iphone/iphone_tbyn3p08.png",
    // The glTF validator's intentionally broken files.
    "image/invalid_image_data.jpg", "image/png_eos.png", "image/unrecognized_format.png",
];

/// Stores two by two pixels, by rows of colour and alpha, as a PNG of a colour type and depth; 16 bits hold what 8 bits
/// do. Palettes have 8 bits.
fn png(folder: &Folder, name: &str, color: png::ColorType, sixteen: bool, pixels: [[u8; 4]; 4]) {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 2, 2);
    encoder.set_color(color);
    encoder.set_depth(if sixteen { png::BitDepth::Sixteen } else { png::BitDepth::Eight });
    if color == png::ColorType::Indexed {
        encoder.set_palette(pixels.iter().flat_map(|pixel| pixel[..3].to_vec()).collect::<Vec<_>>());
    }
    let channels = |pixel: usize| match color {
        png::ColorType::Grayscale => pixels[pixel][..1].to_vec(),
        png::ColorType::Rgb => pixels[pixel][..3].to_vec(),
        png::ColorType::Indexed => vec![pixel as u8],
        _ => pixels[pixel].to_vec(),
    };
    let bytes = (0..4).flat_map(channels);
    // A byte times 257 is the same part of the largest value.
    let data = bytes.flat_map(|byte| if sixteen { vec![byte; 2] } else { vec![byte] }).collect::<Vec<_>>();
    encoder.write_header().expect("a header").write_image_data(&data).expect("pixels");
    folder.write(name, file);
}

const SHADES: [[u8; 4]; 4] =
    [[30, 90, 160, 255], [200, 20, 90, 40], [128, 128, 255, 128], [80, 240, 60, 200]];

/// The image of a square before the camera, of a scene or of a model with a camera and a light added by a scene.
fn shaded(folder: &Folder, square: &str) -> Vec<Rgb> {
    let scene = format!(
        "(settings: (transport: Path, size: (6, 6), samples: 4), entities: [
            (camera: Orthographic(height_m: 2), transform: (translate: (0, 0, 3))),
            (light: Directional(irradiance: 2), transform: LookAt(from: (1, 2, 3), to: (0, 0, 0))),
            ({square}), (light: Environment(radiance: 0.3))])"
    );
    folder.write("scene.ron", scene);
    let world = rayfront::formats::load(folder.join("scene.ron")).unwrap_or_else(|error| panic!("{error}"));
    Picture::of(&world).pixels
}

#[test]
fn sixteen_bits_mean_the_same_as_eight_in_every_use() {
    let plane = "shape: Plane(corners: ((-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)))";
    let folder = empty_folder();
    let uses = [
        "base_color: IMAGE",
        "base_color: Texture(image: \"a.png\", color_space: Linear)",
        "base_color: Texture(image: \"a.png\", filter: Trilinear, scale: 40)",
        "metallic: 0, normal: IMAGE",
        "roughness: IMAGE",
        "metallic: 0, bump: (texture: IMAGE, height_m: 0.2)",
        "emission: IMAGE",
        "alpha: Image(\"a.png\", Blue), alpha_mode: Blend",
        // Both ways at once.
        "base_color: IMAGE, roughness: IMAGE",
    ];
    for color in [png::ColorType::Grayscale, png::ColorType::Rgb, png::ColorType::Rgba] {
        for material in uses {
            let square =
                format!("{plane}, material: Principled({})", material.replace("IMAGE", "Image(\"a.png\")"));
            let images = [false, true].map(|sixteen| {
                png(&folder, "a.png", color, sixteen, SHADES);
                shaded(&folder, &square)
            });
            let far = |(a, b): (&Rgb, &Rgb)| {
                let [a, b] = [a, b].map(|color| color.to_array());
                (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max)
            };
            let worst = images[0].iter().zip(&images[1]).map(far).fold(0.0, f32::max);
            // Smaller copies of bytes are rounded to bytes.
            let allowed = if material.contains("Trilinear") { 0.01 } else { 1e-5 };
            assert!(worst <= allowed, "{material}, {color:?}: {worst}");
        }
    }
    // An image with alpha shows what its palette shows without.
    let square = format!("{plane}, material: Principled(base_color: Image(\"a.png\"))");
    png(&folder, "a.png", png::ColorType::Indexed, false, SHADES);
    let palette = shaded(&folder, &square);
    png(&folder, "a.png", png::ColorType::Rgb, true, SHADES);
    assert!(palette == shaded(&folder, &square));
}

#[test]
fn alpha_of_sixteen_bits_cuts_as_that_of_eight() {
    let folder = empty_folder();
    for mode in ["Blend", "Mask(cutoff: 0.5)"] {
        let square = format!(
            "shape: Plane(corners: ((-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0))), material: Principled(
                base_color: Image(\"a.png\"), alpha: Image(\"a.png\"), alpha_mode: {mode})"
        );
        let images = [false, true].map(|sixteen| {
            png(&folder, "a.png", png::ColorType::Rgba, sixteen, SHADES);
            shaded(&folder, &square)
        });
        assert!(images[0] == images[1], "{mode}");
        png(&folder, "a.png", png::ColorType::Rgb, true, SHADES);
        assert!(images[0] != shaded(&folder, &square), "{mode}");
    }
}

/// glTF's normal maps and MTL's linear maps are read by the same code.
#[test]
fn sixteen_bits_mean_the_same_as_eight_in_models() {
    let folder = empty_folder();
    folder.write(
        "a.gltf",
        r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0}},
            "normalTexture": {"index": 0}}],
        "textures": [{"source": 0, "sampler": 0}], "samplers": [{"minFilter": 9729}], "images": [{"uri": "a.png"}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteLength": 36, "byteStride": 12}],
        "buffers": [{"byteLength": 36, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#,
    );
    folder.write(
        "a.obj",
        "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n",
    );
    folder.write("a.mtl", "newmtl a\nKd 1 1 1\nmap_Kd -colorspace linear a.png\nmap_Ke a.png\n");
    for square in ["gltf: \"a.gltf\"", "shape: Mesh(\"a.obj\")"] {
        let images = [false, true].map(|sixteen| {
            png(&folder, "a.png", png::ColorType::Rgb, sixteen, SHADES);
            shaded(&folder, square)
        });
        assert!(images[0] == images[1], "{square}");
    }
}

/// Stores an OpenEXR image of grey floats, 8 by 4.
fn exr(folder: &Folder, name: &str, of: impl Fn(usize) -> f32) {
    let radiance: Vec<Rgb> = (0..32).map(|at| Rgb::splat(of(at))).collect();
    let display = DisplayTransform::new(Tonemap::Clamp, 0.0, &[]);
    let bits = picture::PngBits::Eight;
    let (metadata, channels) = (&[], &[]);
    let output = picture::Output::plain([8, 4], &radiance, display);
    let output = picture::Output { bits, metadata, channels, ..output };
    picture::save(&folder.join(name), &output).expect(name);
}

#[test]
fn odd_values_of_environments_and_emission_are_named_and_bounded() {
    let folder = empty_folder();
    let square = "shape: Plane(corners: ((-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)))";
    let uses = [
        format!("light: Environment(image: \"a.exr\")), ({square}"),
        format!("{square}, material: Principled(base_color: 0, emission: Image(\"a.exr\"))"),
        format!("{square}, material: BlinnPhong(emission: Image(\"a.exr\"))"),
    ];
    for used in &uses {
        let images = [65_504.0, f32::INFINITY, f32::NAN, -3.0, 0.0].map(|odd| {
            exr(&folder, "a.exr", |at| if at == 13 { odd } else { 0.5 });
            let image = shaded(&folder, used);
            let world = rayfront::formats::load(folder.join("scene.ron")).expect("a scene");
            let odd_texels = world.warnings.iter().filter(|warning| warning.code == "odd-texels");
            (image, odd_texels.map(|warning| warning.text.clone()).collect::<Vec<_>>())
        });
        let [usual, infinite, nan, negative, none] = &images;
        assert!(usual.0 == infinite.0 && nan.0 == none.0 && negative.0 == none.0, "{used}");
        assert!(usual.0 != none.0 && usual.1.is_empty() && none.1.is_empty(), "{used}");
        for (_, warnings) in [infinite, nan, negative] {
            assert_eq!(warnings.len(), 1, "{used}: {warnings:?}");
            assert!(warnings[0].starts_with("1 texel is infinite, NaN or negative: the first at 5, 1"));
        }
    }
    // What emits is seen as bright as it is.
    exr(&folder, "a.exr", |_| 1e6);
    let seen = shaded(&folder, &uses[1]);
    assert!(seen.iter().any(|pixel| (pixel.r - 1e6).abs() < 1e3), "{seen:?}");
}

const STILL: &str = "(settings: (transport: Path, size: (16, 8), samples: 2), entities: [
    (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 4), to: (0, 0, 0))),
    (light: Environment(radiance: (0.2, 0.5, 0.9))), (shape: Sphere(radius_m: 1))])";

#[test]
fn images_on_standard_output_are_those_in_files() {
    let folder = folder(STILL);
    for (format, start) in [
        ("png", "\u{89}PNG"),
        ("jpg", "\u{ff}\u{d8}"),
        ("webp", "RIFF"),
        ("exr", "v/1\u{1}"),
        ("hdr", "#?RADIANCE"),
    ] {
        let start: Vec<u8> = start.chars().map(|c| c as u8).collect();
        folder.out(&format!("scene.ron -o a.{format} -o a.film --overwrite -q"));
        for line in [
            format!("scene.ron -o {format}:-"),
            format!("scene.ron -o {format}:- --json"),
            format!("scene.ron -q -o {format}:- -o b.png"),
            format!("merge a.film -o {format}:-"),
        ] {
            let output = folder.command(&line).output().expect("the program runs");
            assert!(output.status.success() && output.stdout.starts_with(&start), "{line}");
            folder.write(&format!("b.{format}"), &output.stdout);
            if !line.starts_with("merge") {
                assert!(output.stdout == folder.bytes(&format!("a.{format}")), "{line}");
            }
            assert!(folder.image(&format!("b.{format}")) == folder.image(&format!("a.{format}")), "{line}");
            assert!(line.contains("-q") || !output.stderr.is_empty(), "{line}: no report");
        }
        // Each format stores how to render it again.
        folder.out(&format!("reproduce a.{format} -q"));
    }
    folder.out("scene.ron -q --denoise -o c.png");
    let output = folder.command("scene.ron -q --denoise -o png:-").output().expect("the program runs");
    assert!(output.stdout == folder.bytes("c.denoised.png"));
    folder.fails(2, "scene.ron -o png:- -o -", &["name a file for one of them"]);
    folder.fails(2, "scene.ron -o tiff:-", &["no format for standard output", "-o png:-"]);
    folder.fails(2, "scene.ron -o png:- --frames 1-2", &["-o frame.####.png"]);
    folder.fails(3, "scene.ron --size 16385x1 -o a.webp", &["WebP holds at most 16384 pixels"]);
}

#[test]
fn webp_keeps_every_byte_of_png_and_jpeg_nearly() {
    let folder = folder(STILL);
    folder.out("scene.ron -q -o a.png -o a.webp -o a.jpeg");
    let [png, webp, jpeg] = ["a.png", "a.webp", "a.jpeg"].map(|name| folder.pixels(name));
    assert!(png == webp);
    let far = png.iter().zip(&jpeg).map(|(a, b)| (a.luminance() - b.luminance()).abs()).fold(0.0, f32::max);
    assert!(far > 0.0 && far < 0.05, "{far}");
}

#[test]
fn corpus_images_load_or_fail_as_expected() {
    let Some(corpus) = corpus::folder() else { return };
    let pictures = corpus::files(&corpus, &EXTENSIONS);
    let mut surprises = Vec::new();
    for path in &pictures {
        let expected = !REFUSED.iter().any(|refused| path.ends_with(refused));
        match check(path) {
            Ok(summary) => {
                println!("{summary}");
                if !expected {
                    surprises.push(format!("{} should have been refused", path.display()));
                }
            }
            Err(reason) => {
                println!("refused: {reason}");
                if expected || reason.contains('\n') {
                    surprises.push(reason);
                }
            }
        }
    }
    println!("{} pictures", pictures.len());
    assert!(surprises.is_empty(), "{}", surprises.join("\n"));
}

/// The render of a white sphere in a white room: 0.5 in every pixel.
#[test]
fn corpus_furnace_image_is_uniform() {
    let Some(corpus) = corpus::folder() else { return };
    let path = corpus.join("apache-bsd/osl-testsuite/render-furnace-diffuse/ref/out.exr");
    let (width, height, pixels) = picture::load_linear(&path).expect("the furnace");
    assert_eq!((width, height), (160, 120));
    // The sphere's edge is slightly noisy.
    let is_even = |pixel: &Rgb| pixel.to_array().iter().all(|value| (value - 0.5).abs() < 0.01);
    assert!(pixels.iter().all(is_even));
    assert!(pixels.iter().filter(|pixel| **pixel == Rgb::splat(0.5)).count() > pixels.len() * 9 / 10);
}

fn check(path: &Path) -> Result<String, String> {
    let image = picture::load(path, &Default::default()).map_err(|error| error.to_string())?.image;
    let pixels = image.width as usize * image.height as usize;
    let kind = match &image.texels {
        Texels::Rgba8(texels) => {
            assert_eq!(texels.len(), pixels);
            "8 bits"
        }
        Texels::Rgba16(texels) => {
            assert_eq!(texels.len(), pixels);
            "16 bits"
        }
        Texels::Rgb32(texels) => {
            assert_eq!(texels.len(), pixels);
            assert!(texels.as_flattened().iter().all(|value| value.is_finite() && *value >= 0.0));
            "floats"
        }
    };
    Ok(format!("{} x {}, {kind}: {}", image.width, image.height, path.display()))
}
