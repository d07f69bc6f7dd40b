//! `rayfront compare` as run by scripts.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use rayfront::internals::film::tonemap::DisplayTransform;
use rayfront::internals::formats::picture;
use rayfront::math::Rgb;
use rayfront::world::Tonemap;

fn save(path: &Path, width: u32, pixels: &[Rgb]) {
    let display = DisplayTransform::new(Tonemap::Clamp, 0.0, pixels);
    let height = pixels.len() as u32 / width;
    let bits = picture::PngBits::Sixteen;
    let output =
        picture::Output { width, height, radiance: pixels, display, bits, metadata: &[], channels: &[] };
    picture::save(path, &output).expect("a picture");
}

/// A folder with an image, a brighter copy, and one of another size.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let image = |gain: f32, count: usize| -> Vec<Rgb> {
        (0..count).map(|i| Rgb::new(0.01, 0.02, 0.005) * (gain * (1 + i % 30) as f32)).collect()
    };
    for name in ["a.exr", "a.png"] {
        save(&folder.path().join(name), 20, &image(1.0, 400));
    }
    save(&folder.path().join("b.exr"), 20, &image(1.25, 400));
    save(&folder.path().join("small.exr"), 20, &image(1.0, 200));
    let mut broken = image(1.0, 400);
    broken[47].g = f32::NAN;
    save(&folder.path().join("broken.exr"), 20, &broken);
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rayfront"));
    command.current_dir(folder).arg("compare").args(arguments).stdin(Stdio::null());
    command.output().expect("the program runs")
}

fn json(folder: &Path, arguments: &[&str], code: i32) -> serde_json::Value {
    let output = run(folder, &[arguments, &["--json"]].concat());
    assert_eq!(
        output.status.code(),
        Some(code),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn compare_reports_metrics_and_exceeded_limits() {
    let folder = folder();
    let same = json(
        folder.path(),
        &["a.exr", "a.exr", "--max-rmse", "0", "--max-flip", "0", "--min-ssim", "0.999"],
        0,
    );
    assert_eq!((&same["identical"], &same["mse"], &same["psnr_db"]), (&true.into(), &0.0.into(), &().into()));
    let rounded = json(folder.path(), &["a.png", "a.exr", "--min-psnr", "60"], 0);
    assert!(rounded["mse"].as_f64() > Some(0.0));

    let other = json(folder.path(), &["b.exr", "a.exr"], 0);
    for ratio in other["mean_ratio"].as_array().expect("three") {
        assert!((ratio.as_f64().expect("a number") - 1.25).abs() < 1e-6);
    }
    let limits = ["--max-rmse", "1", "--max-flip", "1e-6", "--min-psnr", "90"];
    let beyond = json(folder.path(), &[&["b.exr", "a.exr"][..], &limits].concat(), 5);
    assert_eq!(beyond["beyond"], serde_json::json!(["--min-psnr", "--max-flip"]));
    let text = run(folder.path(), &["b.exr", "a.exr", "--max-relmse", "0"]);
    assert_eq!(text.status.code(), Some(5));
    assert!(String::from_utf8_lossy(&text.stdout).contains("beyond     --max-relmse 0"));
}

#[test]
fn heatmap_shows_the_differences() {
    let folder = folder();
    json(folder.path(), &["b.exr", "a.exr", "--heatmap", "map.png"], 0);
    let (width, height, pixels) = picture::load_linear(&folder.path().join("map.png")).expect("a map");
    assert_eq!((width, height), (20, 20));
    assert!(pixels.iter().any(|p| p.luminance() > 0.02));
}

#[test]
fn images_that_cannot_be_compared_are_errors() {
    let folder = folder();
    for (arguments, code, wanted) in [
        (&["a.exr", "none.exr"][..], 1, "none.exr"),
        (&["a.exr", "small.exr"], 1, "20x20 pixels and small.exr has 20x10"),
        (&["a.exr", "broken.exr"], 1, "column 7 and row 2"),
        (&["a.exr", "a.exr", "--heatmap", "map.jpg"], 3, "map.jpg"),
        (&["a.exr", "a.exr", "--max-rmse", "nan"], 2, "finite"),
        (&["a.exr"], 2, "REFERENCE"),
    ] {
        let output = run(folder.path(), arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(wanted) && output.stdout.is_empty(), "{error}");
    }
}
