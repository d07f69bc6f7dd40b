//! `rayfront compare` as run by scripts.

use std::path::Path;

use rayfront::internals::film::tonemap::DisplayTransform;
use rayfront::internals::formats::picture;
use rayfront::math::Rgb;
use rayfront::world::Tonemap;
use serde_json::{Value, json};

use super::program::{Folder, Place, empty_folder};

fn save(path: &Path, width: u32, pixels: &[Rgb]) {
    let display = DisplayTransform::new(Tonemap::Clamp, 0.0, pixels);
    let height = pixels.len() as u32 / width;
    let bits = picture::PngBits::Sixteen;
    let output =
        picture::Output { width, height, radiance: pixels, display, bits, metadata: &[], channels: &[] };
    picture::save(path, &output).expect("a picture");
}

/// A folder with an image, a brighter copy, and one of another size.
fn images() -> Folder {
    let folder = empty_folder();
    let image = |gain: f32, count: usize| -> Vec<Rgb> {
        (0..count).map(|i| Rgb::new(0.01, 0.02, 0.005) * (gain * (1 + i % 30) as f32)).collect()
    };
    for name in ["a.exr", "a.png"] {
        save(&folder.join(name), 20, &image(1.0, 400));
    }
    save(&folder.join("b.exr"), 20, &image(1.25, 400));
    save(&folder.join("small.exr"), 20, &image(1.0, 200));
    let mut broken = image(1.0, 400);
    broken[47].g = f32::NAN;
    save(&folder.join("broken.exr"), 20, &broken);
    folder
}

/// Returns the report of a comparison that ends with this code.
#[track_caller]
fn report(folder: &Path, code: i32, line: &str) -> Value {
    let run = folder.run(&format!("compare {line} --json"));
    let report = serde_json::from_str(&run.out).expect("JSON");
    run.ends(code, &[]);
    report
}

#[test]
fn compare_reports_metrics_and_exceeded_limits() {
    let folder = images();
    let same = report(&folder, 0, "a.exr a.exr --max-rmse 0 --max-flip 0 --min-ssim 0.999");
    assert_eq!((&same["identical"], &same["mse"], &same["psnr_db"]), (&true.into(), &0.0.into(), &().into()));
    let rounded = report(&folder, 0, "a.png a.exr --min-psnr 60");
    assert!(rounded["mse"].as_f64() > Some(0.0));

    let other = report(&folder, 0, "b.exr a.exr");
    for ratio in other["mean_ratio"].as_array().expect("three") {
        assert!((ratio.as_f64().expect("a number") - 1.25).abs() < 1e-6);
    }
    let beyond = report(&folder, 5, "b.exr a.exr --max-rmse 1 --max-flip 1e-6 --min-psnr 90");
    assert_eq!(beyond["beyond"], json!(["--min-psnr", "--max-flip"]));
    let run = folder.run("compare b.exr a.exr --max-relmse 0");
    assert!(run.code == Some(5) && run.out.contains("beyond     --max-relmse 0"), "{}", run.out);
}

#[test]
fn heatmap_shows_the_differences() {
    let folder = images();
    report(&folder, 0, "b.exr a.exr --heatmap map.png");
    let (width, height, pixels) = folder.image("map.png");
    assert_eq!((width, height), (20, 20));
    assert!(pixels.iter().any(|p| p.luminance() > 0.02));
}

#[test]
fn images_that_cannot_be_compared_are_errors() {
    let folder = images();
    for (code, line, wanted) in [
        (1, "a.exr none.exr", "none.exr"),
        (1, "a.exr small.exr", "20x20 pixels and small.exr has 20x10"),
        (1, "a.exr broken.exr", "column 7 and row 2"),
        (3, "a.exr a.exr --heatmap map.jpg", "map.jpg"),
        (2, "a.exr a.exr --max-rmse nan", "finite"),
        (2, "a.exr", "REFERENCE"),
    ] {
        let run = folder.run(&format!("compare {line}"));
        assert_eq!(run.out, "", "{line}");
        run.ends(code, &[wanted]);
    }
}
