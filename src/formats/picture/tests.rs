use std::io::Cursor;

use exr::image::write::WritableImage;
use exr::prelude::{
    Blocks, Compression, Encoding, Layer, LayerAttributes, LineOrder, SpecificChannels, Vec2, f16,
};
use image::{DynamicImage, ImageFormat};
use proptest::prelude::*;

use super::*;

const SIZE: usize = 16;

fn value(x: usize, y: usize) -> f32 {
    (x + SIZE * y) as f32 / 64.0
}

fn by_image_crate(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    image.write_to(&mut file, format).expect("a test picture");
    file.into_inner()
}

fn gradient() -> DynamicImage {
    DynamicImage::ImageRgba8(image::RgbaImage::from_fn(SIZE as u32, SIZE as u32, |x, y| {
        image::Rgba([x as u8 * 15, y as u8 * 15, 128, if x > y { 255 } else { 200 }])
    }))
}

fn half_exr(compression: Compression, blocks: Blocks) -> Vec<u8> {
    let channels = SpecificChannels::rgb(|Vec2(x, y): Vec2<usize>| {
        (f16::from_f32(value(x, y)), f16::from_f32(0.5), f16::from_f32(4.0))
    });
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let layer = Layer::new((SIZE, SIZE), LayerAttributes::default(), encoding, channels);
    let image = exr::prelude::Image::from_layer(layer);
    exr_bytes(|file| image.write().to_buffered(file))
}

fn exr_bytes(write: impl FnOnce(&mut Cursor<Vec<u8>>) -> exr::error::UnitResult) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    write(&mut file).expect("a test picture");
    file.into_inner()
}

/// A small file of each supported format.
fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let picture = gradient();
    let opaque = DynamicImage::ImageRgb8(picture.to_rgb8());
    let tiles = Blocks::Tiles(Vec2(8, 8));
    vec![
        ("8.png", by_image_crate(&picture, ImageFormat::Png)),
        ("16.png", by_image_crate(&DynamicImage::ImageRgb16(picture.to_rgb16()), ImageFormat::Png)),
        ("rgb.jpg", by_image_crate(&opaque, ImageFormat::Jpeg)),
        ("grey.jpg", by_image_crate(&DynamicImage::ImageLuma8(picture.to_luma8()), ImageFormat::Jpeg)),
        ("a.tga", by_image_crate(&picture, ImageFormat::Tga)),
        ("a.bmp", by_image_crate(&opaque, ImageFormat::Bmp)),
        ("a.webp", by_image_crate(&picture, ImageFormat::WebP)),
        ("a.hdr", by_image_crate(&DynamicImage::ImageRgb32F(picture.to_rgb32f()), ImageFormat::Hdr)),
        ("zip.exr", half_exr(Compression::ZIP16, Blocks::ScanLines)),
        ("piz.exr", half_exr(Compression::PIZ, Blocks::ScanLines)),
        ("rle.exr", half_exr(Compression::RLE, tiles)),
        ("pxr24.exr", half_exr(Compression::PXR24, tiles)),
        ("b44.exr", half_exr(Compression::B44, Blocks::ScanLines)),
        ("plain.exr", half_exr(Compression::Uncompressed, tiles)),
    ]
}

/// True if decoding succeeds; it may fail only with a one-line message that names the file.
fn survives(name: &str, bytes: &[u8]) -> bool {
    match decode(bytes, Path::new(name)) {
        Ok((image, _)) => {
            let texels = match &image.texels {
                Texels::Rgba8(texels) => texels.len(),
                Texels::Rgba16(texels) => texels.len(),
                Texels::Rgb32(texels) => {
                    assert!(
                        texels.as_flattened().iter().all(|value| (0.0..=BRIGHTEST_TEXEL).contains(value))
                    );
                    texels.len()
                }
            };
            assert_eq!(texels, image.width as usize * image.height as usize);
            true
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.starts_with(name) && !message.contains('\n'), "{message}");
            false
        }
    }
}

#[test]
fn all_supported_formats_are_read() {
    for (name, bytes) in samples() {
        let image = decode(&bytes, Path::new(name)).unwrap().0;
        assert_eq!((image.width, image.height, &image.source), (16, 16, &None), "{name}");
        let floats = matches!(image.texels, Texels::Rgb32(_));
        assert_eq!(floats, name.ends_with("exr") || name.ends_with("hdr"), "{name}");
    }
}

#[test]
fn eight_bit_images_keep_their_bytes() {
    let wanted = gradient().to_rgba8();
    for (name, bytes) in samples().iter().filter(|(name, _)| ["8.png", "a.tga", "a.webp"].contains(name)) {
        let Texels::Rgba8(texels) = decode(bytes, Path::new(name)).unwrap().0.texels else {
            panic!("{name}")
        };
        assert_eq!(texels.as_flattened(), wanted.as_raw().as_slice(), "{name}");
    }
}

#[test]
fn sixteen_bit_images_keep_their_values_and_grey_becomes_rgb() {
    let grey = image::ImageBuffer::from_raw(2, 1, vec![0_u16, 32_768]).unwrap();
    let bytes = by_image_crate(&DynamicImage::ImageLuma16(grey), ImageFormat::Png);
    let texels = decode(&bytes, Path::new("a.png")).unwrap().0.texels;
    let opaque = |grey| [grey, grey, grey, u16::MAX];
    assert_eq!(texels, Texels::Rgba16(vec![opaque(0), opaque(32_768)]));
    let half = crate::film::texels::linear_colors(&texels)[1];
    assert!(half.iter().all(|value| (value - 0.214_05).abs() < 1e-4), "{half:?}");
    let clear = image::ImageBuffer::from_raw(1, 1, vec![1_u16, 2, 3, 40_000]).unwrap();
    let bytes = by_image_crate(&DynamicImage::ImageRgba16(clear), ImageFormat::Png);
    assert_eq!(decode(&bytes, Path::new("a.png")).unwrap().0.texels, Texels::Rgba16(vec![[1, 2, 3, 40_000]]));
}

#[test]
fn lossless_exr_reads_back_unchanged() {
    for (name, bytes) in
        samples().iter().filter(|(name, _)| name.ends_with("exr") && !name.starts_with("b44"))
    {
        let Texels::Rgb32(texels) = decode(bytes, Path::new(name)).unwrap().0.texels else {
            panic!("{name}")
        };
        for (index, texel) in texels.iter().enumerate() {
            assert_eq!(*texel, [value(index % SIZE, index / SIZE), 0.5, 4.0], "{name} at {index}");
        }
    }
}

#[test]
fn content_takes_precedence_over_the_extension() {
    let (_, png) = samples().swap_remove(0);
    assert!(survives("a.jpg", &png) && survives("no extension", &png));
    let error = decode(b"GIF89a......", Path::new("a.gif")).unwrap_err().to_string();
    assert!(
        error.starts_with("a.gif: this is a .gif picture: the kinds that can be read are png,"),
        "{error}"
    );
    let error = decode(b"hello", Path::new("a.txt")).unwrap_err().to_string();
    assert!(error.contains("no picture of a known kind"), "{error}");
}

#[test]
fn both_signatures_of_radiance_are_recognised() {
    for signature in ["#?RADIANCE", "#?RGBE"] {
        let mut bytes = format!("{signature}\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n").into_bytes();
        bytes.extend([128, 64, 0, 129, 0, 0, 0, 0]);
        let image = decode(&bytes, Path::new("probe")).unwrap().0;
        assert_eq!(image.texels, Texels::Rgb32(vec![[1.0, 0.5, 0.0], [0.0; 3]]));
    }
}

fn exr_of_layers(layers: &[(&str, &[&str])]) -> Vec<u8> {
    use exr::prelude::*;
    let layer = |index: usize, (name, channels): &(&str, &[&str])| {
        let channels = channels.iter().enumerate().map(|(number, channel)| {
            let sample = (index * 10 + number) as u32;
            let samples = match number {
                0 => FlatSamples::U32(vec![sample; 4]),
                1 => FlatSamples::F16(vec![f16::from_f32(sample as f32); 4]),
                _ => FlatSamples::F32(vec![sample as f32; 4]),
            };
            AnyChannel::new(*channel, samples)
        });
        let channels = AnyChannels::sort(channels.collect());
        Layer::new((2, 2), LayerAttributes::named(*name), Encoding::FAST_LOSSLESS, channels)
    };
    let layers: SmallVec<_> = layers.iter().enumerate().map(|(index, of)| layer(index, of)).collect();
    let image = Image::from_layers(ImageAttributes::with_size((2, 2)), layers);
    exr_bytes(|file| image.write().to_buffered(file))
}

#[test]
fn exr_colours_are_found_among_layers_and_channels() {
    let first_texel = |layers: &[(&str, &[&str])]| {
        let image = decode(&exr_of_layers(layers), Path::new("a.exr")).map_err(|error| error.to_string())?.0;
        let Texels::Rgb32(texels) = image.texels else { panic!() };
        Ok::<_, String>(texels[0])
    };
    assert_eq!(first_texel(&[("depth", &["Z"]), ("beauty", &["B", "G", "R"])]), Ok([12.0, 11.0, 10.0]));
    assert_eq!(first_texel(&[("one", &["Z", "view.R", "view.G", "view.B"])]), Ok([1.0, 2.0, 3.0]));
    assert_eq!(first_texel(&[("grey", &["A", "Y"])]), Ok([1.0; 3]));
    assert_eq!(first_texel(&[("some", &["A", "G"])]), Ok([0.0, 1.0, 0.0]));
    assert_eq!(first_texel(&[("grey", &["Y"]), ("colour", &["R", "G", "B"])]), Ok([10.0, 11.0, 12.0]));
    let error = first_texel(&[("depth", &["Z", "id"])]).unwrap_err();
    assert!(error.ends_with("neither channels R, G, B nor Y, but: Z, id"), "{error}");
}

#[test]
fn exr_image_has_the_size_of_its_display_window() {
    use exr::prelude::*;
    let channels = SpecificChannels::rgb(|Vec2(x, y): Vec2<usize>| (x as f32 + 1.0, y as f32 + 1.0, 9.0_f32));
    let attributes = LayerAttributes { layer_position: Vec2(-1, 1), ..LayerAttributes::default() };
    let layer = Layer::new((3, 4), attributes, Encoding::FAST_LOSSLESS, channels);
    let window = ImageAttributes::new(IntegerBounds::new((0, 0), (3, 2)));
    let image = Image::new(window, layer);
    let bytes = exr_bytes(|file| image.write().to_buffered(file));
    let image = super::decode(&bytes, Path::new("a.exr")).unwrap().0;
    assert_eq!((image.width, image.height), (3, 2));
    let black = [0.0; 3];
    let wanted = vec![black, black, black, [2.0, 1.0, 9.0], [3.0, 1.0, 9.0], black];
    assert_eq!(image.texels, Texels::Rgb32(wanted));
}

#[test]
fn textures_are_clamped_but_load_linear_keeps_all_values() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.exr");
    let odd = [Rgb::new(f32::NAN, -1.0, f32::INFINITY), Rgb::new(1e30, 1e-30, 0.5)];
    let display = crate::film::tonemap::DisplayTransform::new(crate::world::Tonemap::Clamp, 0.0, &[]);
    save(&path, &Output::plain([2, 1], &odd, display)).unwrap();
    let image = load(&path, &SourceFiles::default()).unwrap().image;
    assert_eq!(image.texels, Texels::Rgb32(vec![[0.0, 0.0, 1e9], [1e9, 1e-30, 0.5]]));
    assert_eq!(image.source.as_deref(), Some(path.as_path()));
    let (width, height, pixels) = load_linear(&path).unwrap();
    assert_eq!((width, height), (2, 1));
    assert!(pixels[0].r.is_nan() && pixels[0].g == -1.0 && pixels[0].b == f32::INFINITY);
}

#[test]
fn odd_texels_are_counted_and_named_once() {
    let (path, inf) = (Path::new("sky.exr"), f32::INFINITY);
    let mut texels = [[0.5; 3], [0.1, inf, 0.2], [f32::NAN; 3], [0.3, -1e-9, inf]];
    let warning = finite(&mut texels, 2, path).unwrap();
    assert_eq!(texels, [[0.5; 3], [0.1, 65_504.0, 0.2], [0.0; 3], [0.3, 0.0, 65_504.0]]);
    assert_eq!(warning.code, "odd-texels");
    let text = warning.to_string();
    assert!(
        text.starts_with("sky.exr: 3 texels are infinite, NaN or negative: the first at 1, 0;"),
        "{text}"
    );
    // Of floats, the brightest one is the measure.
    let mut texels = [[-inf, 0.0, 0.0], [1e6, inf, 3e9]];
    assert!(finite(&mut texels, 1, path).unwrap().to_string().contains("2 texels are"));
    assert_eq!(texels, [[0.0; 3], [1e6, 1e9, 1e9]]);
    let mut texels = [[0.0, 1e-30, 7e5]];
    assert_eq!(finite(&mut texels, 1, path), None);
    assert_eq!(texels, [[0.0, 1e-30, 7e5]]);
}

#[test]
fn oversized_images_are_rejected_with_a_reason() {
    let claims = |size: &str| {
        let header = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n");
        decode(header.as_bytes(), Path::new("a.hdr")).unwrap_err().to_string()
    };
    assert!(claims("-Y 1 +X 65537").contains("at most 65536 along a side"));
    assert!(claims("-Y 65536 +X 65536").contains("at most 2147483648 can be read"));
    assert!(claims("-Y 8000 +X 8000").contains("which a file of"));
    assert!(claims("-Y 0 +X 8").contains("no pixels"));
}

#[test]
fn small_file_may_expand_to_a_large_uniform_image() {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 4096, 4096);
    encoder.set_depth(png::BitDepth::One);
    encoder.write_header().unwrap().write_image_data(&vec![0; 4096 * 4096 / 8]).unwrap();
    assert!(bytes.len() < 16_384, "{}", bytes.len());
    assert!(survives("black.png", &bytes));
}

#[test]
fn truncated_files_do_not_panic() {
    for (name, bytes) in samples() {
        for length in 0..bytes.len() {
            survives(name, &bytes[..length]);
        }
    }
}

#[test]
fn missing_files_are_reported_with_their_path() {
    let error = load(Path::new("no/such.png"), &SourceFiles::default()).unwrap_err().to_string();
    assert!(error.starts_with("no/such.png: cannot read: "), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(512) })]

    #[test]
    fn damaged_files_do_not_panic(
        edits in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..6),
        early in any::<bool>(),
    ) {
        for (name, mut bytes) in samples() {
            // Most critical numbers are in the headers.
            let reach = if early { bytes.len().min(64) } else { bytes.len() };
            for (index, value) in &edits {
                bytes[index.index(reach)] = *value;
            }
            survives(name, &bytes);
        }
    }
}
