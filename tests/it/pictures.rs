//! Every image of the corpus at `RAYFRONT_CORPUS` is read, or refused in one line.

use std::path::Path;

use rayfront::internals::formats::picture;
use rayfront::math::Rgb;
use rayfront::world::Texels;

use crate::corpus;

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
    let image = picture::load(path, &Default::default()).map_err(|error| error.to_string())?;
    let pixels = image.width as usize * image.height as usize;
    let kind = match &image.texels {
        Texels::Rgba8(texels) => {
            assert_eq!(texels.len(), pixels);
            "8 bits"
        }
        Texels::Rgb32(texels) => {
            assert_eq!(texels.len(), pixels);
            assert!(texels.as_flattened().iter().all(|value| value.is_finite() && *value >= 0.0));
            "floats"
        }
    };
    Ok(format!("{} x {}, {kind}: {}", image.width, image.height, path.display()))
}
