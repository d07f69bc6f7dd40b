//! `rayfront compare` as run by scripts.

use std::path::Path;

use rayfront::internals::film::tonemap::DisplayTransform;
use rayfront::internals::formats::picture;
use rayfront::math::Rgb;
use rayfront::world::Tonemap;
use serde_json::{Value, json};

use super::program::{Folder, Place, empty_folder, folder};

fn save(path: &Path, width: u32, pixels: &[Rgb]) {
    let display = DisplayTransform::new(Tonemap::Clamp, 0.0, pixels);
    let height = pixels.len() as u32 / width;
    let bits = picture::PngBits::Sixteen;
    let output = picture::Output { bits, ..picture::Output::plain([width, height], pixels, display) };
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

/// The data window and the display window of an OpenEXR file: first and last column and row.
fn windows(file: &Path) -> [[i32; 4]; 2] {
    let meta = exr::meta::MetaData::read_from_file(file, true).expect("an OpenEXR file");
    let header = &meta.headers[0];
    let window = |bounds: exr::meta::attribute::IntegerBounds| {
        let last = bounds.max();
        [bounds.position.x(), bounds.position.y(), last.x(), last.y()]
    };
    [window(header.data_window()), window(header.shared_attributes.display_window)]
}

#[test]
fn crops_know_their_place_and_are_compared_with_whole_images() {
    let folder = folder(
        "(settings: (transport: Path, size: (16, 12), samples: 2), entities: [
            (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 4), to: (0, 0, 0))),
            (light: Environment()), (shape: Sphere(radius_m: 1))])",
    );
    for (name, crop) in
        [("whole", "0,0,16,12"), ("left", "3,2,10,9"), ("right", "8,4,16,12"), ("corner", "0,0,2,2")]
    {
        folder.out(&format!("scene.ron -q --crop {crop} -o {name}.exr -o {name}.png -o {name}.hdr"));
    }
    assert_eq!(windows(&folder.join("whole.exr")), [[0, 0, 15, 11]; 2]);
    assert_eq!(windows(&folder.join("left.exr")), [[3, 2, 9, 8], [0, 0, 15, 11]]);
    assert_eq!(windows(&folder.join("right.exr")), [[8, 4, 15, 11], [0, 0, 15, 11]]);
    for kind in ["exr", "png", "hdr"] {
        for (pair, size, place) in [
            ("left.KIND whole.KIND", [7, 7], "3,2,10,9 of 16x12"),
            ("whole.KIND right.KIND", [8, 8], "8,4,16,12 of 16x12"),
            ("left.KIND right.KIND", [2, 5], "8,4,10,9 of 16x12"),
        ] {
            let pair = pair.replace("KIND", kind);
            let found = report(&folder, 0, &pair);
            assert_eq!((&found["identical"], &found["size"]), (&true.into(), &json!(size)), "{pair}");
            assert!(folder.messages(&format!("compare {pair}")).contains(place), "{pair}");
        }
        assert_eq!(folder.messages(&format!("compare left.{kind} left.{kind}")), "");
        folder.fails(1, &format!("compare corner.{kind} right.{kind}"), &["do not overlap"]);
    }
    folder.messages("compare left.exr whole.exr --heatmap map.exr");
    // As a texture a crop fills its part of the image, and its film can be rendered again.
    let (width, height, pixels) = picture::load_linear(&folder.join("left.exr")).expect("a crop");
    assert_eq!((width, height, folder.image("left.exr").0), (16, 12, 7));
    let whole = folder.pixels("whole.exr");
    for (at, (pixel, other)) in pixels.iter().zip(&whole).enumerate() {
        let is_in = (3..10).contains(&(at % 16)) && (2..9).contains(&(at / 16));
        assert_eq!(*pixel, if is_in { *other } else { Rgb::BLACK });
    }
    folder.out("reproduce left.exr -q");
}

#[test]
fn images_that_cannot_be_compared_are_errors() {
    let folder = images();
    for (code, line, wanted) in [
        (1, "a.exr none.exr", "none.exr"),
        (1, "a.exr small.exr", "20x20 pixels and small.exr has 20x10"),
        (1, "a.exr broken.exr", "column 7 and row 2"),
        (3, "a.exr a.exr --heatmap map.gif", "map.gif"),
        (2, "a.exr a.exr --max-rmse nan", "finite"),
        (2, "a.exr", "REFERENCE"),
    ] {
        let run = folder.run(&format!("compare {line}"));
        assert_eq!(run.out, "", "{line}");
        run.ends(code, &[wanted]);
    }
}
