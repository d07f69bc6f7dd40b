//! Every picture of the corpus at `RAYFRONT_CORPUS` is read, or refused in one line.

use std::path::{Path, PathBuf};

use rayfront::formats::picture;
use rayfront::world::Texels;

const EXTENSIONS: [&str; 8] = ["png", "jpg", "jpeg", "tga", "bmp", "webp", "hdr", "exr"];

/// Files that cannot be read, by the end of their path. PngSuite's are broken on purpose.
const REFUSED: [&str; 14] = [
    "pngsuite/xc1n0g08.png",
    "pngsuite/xc9n2c08.png",
    "pngsuite/xcrn0g04.png",
    "pngsuite/xcsn0g01.png",
    "pngsuite/xd0n2c08.png",
    "pngsuite/xd3n2c08.png",
    "pngsuite/xd9n2c08.png",
    "pngsuite/xdtn0g01.png",
    "pngsuite/xhdn0g08.png",
    "pngsuite/xlfn0g04.png",
    "pngsuite/xs1n0g01.png",
    "pngsuite/xs2n0g01.png",
    "pngsuite/xs4n0g01.png",
    "pngsuite/xs7n0g01.png",
];

#[test]
fn every_picture_of_the_corpus() {
    let Some(corpus) = std::env::var_os("RAYFRONT_CORPUS") else {
        println!("skipped: RAYFRONT_CORPUS is not set to a folder of test pictures");
        return;
    };
    let mut pictures = Vec::new();
    collect(Path::new(&corpus), &mut pictures);
    pictures.sort();
    assert!(!pictures.is_empty(), "no pictures below {}", corpus.display());
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

fn collect(folder: &Path, pictures: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a readable corpus") {
        let path = entry.expect("a readable corpus").path();
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        if path.is_dir() {
            collect(&path, pictures);
        } else if EXTENSIONS.contains(&extension.as_str()) {
            pictures.push(path);
        }
    }
}

fn check(path: &Path) -> Result<String, String> {
    let image = picture::load(path).map_err(|error| error.to_string())?;
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
