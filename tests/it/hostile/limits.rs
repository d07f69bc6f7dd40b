//! What is too large is refused before it is taken; what is forecast comes true.

use std::path::Path;

use super::{ball, expect, folder, run, scene, shell};

/// A sheet of about so many triangles.
fn sheet(path: &Path, triangles: usize) {
    let side = ((triangles / 2) as f64).sqrt() as u32 + 1;
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        side * side,
        2 * (side - 1) * (side - 1)
    )
    .into_bytes();
    for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
        let height = ((x * 7 + y * 13) % 17) as f32 * 0.05;
        [x as f32, height, y as f32].iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    }
    for (y, x) in (1..side).flat_map(|y| (1..side).map(move |x| (y, x))) {
        let corner = |y: u32, x: u32| y * side + x;
        for face in [
            [corner(y - 1, x - 1), corner(y - 1, x), corner(y, x)],
            [corner(y - 1, x - 1), corner(y, x), corner(y, x - 1)],
        ] {
            bytes.push(3);
            face.iter().for_each(|index| bytes.extend(index.to_le_bytes()));
        }
    }
    std::fs::write(path, bytes).expect("a file");
}

/// A PNG of one colour, of a few bits a pixel.
fn flat(path: &Path, side: u32, color: png::ColorType, depth: png::BitDepth) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).expect("a file"), side, side);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let row = (side as usize * color.samples() * depth as usize).div_ceil(8);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&vec![0; row * side as usize]).expect("rows");
}

fn json(output: &std::process::Output) -> serde_json::Value {
    expect(output, 0, &[]);
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
#[cfg(target_os = "linux")]
fn info_forecasts_the_peak() {
    let folder = folder("");
    let here = folder.path();
    for triangles in [1_000, 30_000, 1_000_000] {
        sheet(&here.join(format!("{triangles}.ply")), triangles);
    }
    let pictures = 24;
    for i in 0..pictures {
        flat(&here.join(format!("{i}.png")), 512 + i, png::ColorType::Rgb, png::BitDepth::Eight);
    }
    let balls = (0..pictures)
        .map(|i| format!("(shape: Sphere(radius_m: 1), material: (diffuse: Image(\"{i}.png\"))),"));
    std::fs::write(here.join("pictures.ron"), scene("", &balls.collect::<String>())).expect("a file");
    std::fs::write(here.join("film.ron"), ball("").replace("size: (16, 12)", "size: (2000, 1500)"))
        .expect("a file");
    for file in ["1000.ply", "30000.ply", "1000000.ply", "pictures.ron", "film.ron"] {
        let forecast = json(&run(here, &["info", file, "--json"]));
        let rendered = json(&run(here, &[file, "-s", "1", "-q", "--json", "-o", "a.png"]));
        let [forecast, peak] =
            [forecast, rendered].map(|it| it["memory_bytes"]["peak"].as_f64().expect("bytes"));
        println!("{file}: {:.1} MB forecast, {:.1} MB at the peak", forecast / 1e6, peak / 1e6);
        // Small ones depend on when threads make their stacks.
        assert!(
            (forecast - peak).abs() < 0.1 * peak + 4e6,
            "{file}: {forecast} forecast, {peak} at the peak"
        );
    }
}

#[test]
#[cfg(target_os = "linux")]
fn what_is_too_large_is_a_line() {
    let folder = folder(&ball(""));
    let here = folder.path();
    sheet(&here.join("sheet.ply"), 300_000);
    flat(&here.join("large.png"), 6_000, png::ColorType::Rgb, png::BitDepth::Eight);
    flat(&here.join("bomb.png"), 20_000, png::ColorType::Grayscale, png::BitDepth::One);
    let pictures = (0..60).map(|i| {
        flat(&here.join(format!("{i}.png")), 1_000 + i, png::ColorType::Rgb, png::BitDepth::Eight);
        format!("(shape: Sphere(radius_m: 1), material: (diffuse: Image(\"{i}.png\"))),")
    });
    let pictures = scene("", &pictures.collect::<String>());
    for (name, text) in [
        ("large.ron", ball(r#"diffuse: Image("large.png")"#)),
        ("bomb.ron", ball(r#"diffuse: Image("bomb.png")"#)),
        ("many.ron", pictures),
    ] {
        std::fs::write(here.join(name), text).expect("a file");
    }
    for (line, code, words) in [
        ("scene.ron --memory 200M --size 6000x6000", 4, &["an image of 6000x6000", "--crop", "--memory"][..]),
        ("sheet.ply --memory 70M", 4, &["sheet.ply", "--memory"]),
        ("large.ron --memory 150M", 4, &["large.png", "the picture of 6000 x 6000 pixels"]),
        ("many.ron --memory 200M", 4, &["--memory"]),
        ("bomb.ron", 1, &["bomb.png", "20000 x 20000", "does not hold"]),
        ("scene.ron --memory 10", 2, &["--memory"]),
        ("scene.ron --threads 100000", 4, &["100000", "no use"]),
    ] {
        let output = run(here, &[&line.split(' ').collect::<Vec<_>>()[..], &["-q", "-o", "a.png"]].concat());
        let error = expect(&output, code, words);
        assert!(code == 2 || error.lines().count() == 1, "{line}: {error}");
    }
    // With as much as is forecast they render.
    for file in ["sheet.ply", "large.ron", "many.ron"] {
        let forecast = json(&run(here, &["info", file, "--json"]));
        let bytes = forecast["memory_bytes"]["peak"].as_f64().expect("bytes") * 1.6 + 60e6;
        let memory = format!("{}M", (bytes / 1e6).ceil());
        expect(&run(here, &[file, "--memory", &memory, "-s", "1", "-q", "-o", "a.png"]), 0, &[]);
    }
}

/// When a limit of the system is reached there is a message, whichever part reaches it first.
#[test]
#[cfg(target_os = "linux")]
fn limits_of_the_system_are_no_abort() {
    let folder = folder(&ball(""));
    let here = folder.path();
    sheet(&here.join("sheet.ply"), 1_000_000);
    expect(
        &shell(here, "ulimit -v 1500000; rayfront scene.ron --size 6000x6000"),
        4,
        &["an image of 6000x6000", "ulimit -v"],
    );
    expect(
        &shell(here, "RAYON_NUM_THREADS=100000 rayfront scene.ron -q -o a.png"),
        4,
        &["100000", "RAYON_NUM_THREADS"],
    );
    expect(&shell(here, "ulimit -s 64; rayfront scene.ron -s 1 -q -o a.png"), 0, &[]);
    for kilobytes in [60_000, 100_000, 200_000, 250_000, 300_000] {
        let output = shell(here, &format!("ulimit -v {kilobytes}; rayfront sheet.ply -t 2 -s 1 -q -o a.png"));
        let error = String::from_utf8_lossy(&output.stderr);
        // Whatever it is that does not fit: the scene, its threads, or the program itself.
        assert!(
            matches!(output.status.code(), Some(0 | 4 | 127)),
            "{kilobytes}: {:?} {error}",
            output.status
        );
        assert!(!error.contains("panicked"), "{kilobytes}: {error}");
    }
}

/// Branches that double at each bounce are announced.
/// Profiles and texts in a PNG are packed, a thousand to one. None is unpacked.
#[test]
#[cfg(target_os = "linux")]
fn notes_in_pictures_take_no_memory() {
    const LARGE: usize = 256 << 20;
    let folder = folder(&ball(r#"diffuse: Image("t.png")"#));
    let here = folder.path();
    let mut info = png::Info::with_size(8, 8);
    info.color_type = png::ColorType::Rgb;
    info.icc_profile = Some(vec![b'a'; LARGE].into());
    let mut bytes = Vec::new();
    let mut writer =
        png::Encoder::with_info(&mut bytes, info).expect("a header").write_header().expect("a header");
    writer.write_image_data(&[200; 8 * 8 * 3]).expect("rows");
    writer.finish().expect("an end");
    std::fs::write(here.join("t.png"), &bytes).expect("a file");
    let found = json(&run(here, &["scene.ron", "--json", "-q", "-o", "a.png"]));
    let peak = found["memory_bytes"]["peak"].as_u64().expect("a number");
    assert!(bytes.len() < 2_000_000 && peak < LARGE as u64 / 2, "{peak} for {}", bytes.len());
    // The same text as a record.
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 8, 8);
    encoder.set_color(png::ColorType::Rgb);
    encoder.add_itxt_chunk("rayfront".into(), "a".into()).expect("a text");
    let mut writer = encoder.write_header().expect("a header");
    let mut text = png::text_metadata::ITXtChunk::new("rayfront", "a".repeat(LARGE / 16));
    text.compress_text().expect("packed");
    writer.write_text_chunk(&text).expect("a text");
    writer.write_image_data(&[200; 8 * 8 * 3]).expect("rows");
    writer.finish().expect("an end");
    std::fs::write(here.join("r.png"), &bytes).expect("a file");
    expect(&run(here, &["reproduce", "r.png"]), 1, &["r.png"]);
}

/// Comparing images takes many times their own memory.
#[test]
fn comparisons_stay_within_memory() {
    let folder = folder(&ball(""));
    let here = folder.path();
    for name in ["a.png", "b.png"] {
        flat(&here.join(name), 1_000, png::ColorType::Rgb, png::BitDepth::Eight);
    }
    let with = |memory: &str| run(here, &["compare", "a.png", "b.png", "--memory", memory]);
    expect(&with("200M"), 4, &["comparing images of 1000x1000", "--memory"]);
    expect(&with("400M"), 0, &[]);
}

#[test]
fn endless_work_is_announced() {
    let glass = "(shape: Sphere(radius_m: 1), material: (kt: 0.9, kr: 0.9, ior: 1.5)),";
    let said = |settings: &str| {
        let folder = folder(&scene(settings, glass));
        String::from_utf8_lossy(&run(folder.path(), &["info", "scene.ron"]).stdout).into_owned()
    };
    assert!(said("max_depth: 40, min_throughput: 0").contains("up to 2^40 of them"));
    assert!(!said("max_depth: 40").contains("2^40"));
    assert!(!said("max_depth: 8, min_throughput: 0").contains("2^8"));
}

/// Light that a film cannot count is told of.
#[test]
fn what_is_cut_is_told() {
    // Before the camera, and too small to light anything else.
    let spark = "(shape: Sphere(radius_m: 0.0004), transform: (translate: (0, 0.9996, 4.998)), \
                  material: (diffuse: 0, emission: 1e9)), \
                 (shape: Sphere(radius_m: 0.8), transform: (translate: (1.6, 0, 0)), material: (diffuse: 0.5)),";
    let folder = folder(&scene("background: 0.1", spark));
    let output = run(folder.path(), &["scene.ron", "-o", "a.png"]);
    expect(&output, 0, &["samples are brighter than", "times): the first is"]);
}

/// A full disk costs no other output, and not what was rendered.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_loses_nothing() {
    let folder = folder(&ball(""));
    let here = folder.path();
    for name in ["full", "home"] {
        std::fs::create_dir(here.join(name)).expect("a folder");
    }
    let full = |line: &str| {
        let mount = "mount -t tmpfs -o size=64k none full && dd if=/dev/zero of=full/filler bs=1k count=60 2>/dev/null";
        shell(here, &format!("unshare -rm bash -c '{mount}; {} {line}'", env!("CARGO_BIN_EXE_rayfront")))
    };
    if !full("--version").status.success() {
        println!("skipped: not everybody may mount something");
        return;
    }
    let size = "--size 160x120 -q";
    let error = expect(
        &full(&format!("scene.ron {size} -o full/a.exr -o good.png -o good.exr")),
        3,
        &["full/a.exr: cannot write", "what was rendered is in", "rayfront merge"],
    );
    let load = |name: &str| rayfront::internals::formats::picture::load_linear(&here.join(name)).expect(name);
    let (good, _) = (load("good.exr"), load("good.png"));
    // What the message says.
    let command = error.split("rayfront merge ").nth(1).expect("a command");
    let film = command.split(' ').next().expect("a film");
    expect(&run(here, &["merge", film, "-q", "-o", "again.exr"]), 0, &[]);
    assert_eq!(load("again.exr"), good);
    std::fs::remove_file(film).expect("it is there");
    // A film that was asked for, too, goes elsewhere; one that is there is named.
    let error = expect(
        &full(&format!("scene.ron {size} -o full/a.film -o b.png")),
        3,
        &["full/a.film: cannot write"],
    );
    assert!(error.contains("what was rendered is in") && here.join("b.png").is_file(), "{error}");
    expect(&full(&format!("scene.ron {size} -o good.film -o full/a.exr")), 3, &["is in good.film"]);
    // A file that may not grow is a full disk.
    let error = expect(
        &shell(here, "ulimit -f 4; rayfront scene.ron -q --size 160x120 -o big.exr"),
        3,
        &["big.exr: cannot write"],
    );
    assert!(error.contains("nowhere was room"), "{error}");
    let left = std::fs::read_dir(here).expect("a folder").flatten();
    assert!(left.map(|file| file.file_name()).all(|name| !name.to_string_lossy().ends_with(".part")));
}

/// Names that the disk does not take are found before an hour of rendering.
#[test]
fn bad_names_are_found_at_once() {
    let folder = folder(&ball(""));
    let here = folder.path();
    let long = "a".repeat(250);
    for output in [
        format!("{long}aaaaa.png"),
        format!("{long}a.film"),
        "/dev/null/a.png".into(),
        "scene.ron/a.png".into(),
    ] {
        let arguments = ["scene.ron", "--size", "4096x4096", "-s", "4096", "-q", "-o", &output];
        expect(&run(here, &arguments), 3, &["cannot write"]);
    }
    // The name of the denoised image is longer.
    let output = format!("{}.png", "a".repeat(248));
    let arguments = ["scene.ron", "--size", "4096x4096", "-s", "4096", "-q", "--denoise", "-o", &output];
    expect(&run(here, &arguments), 3, &["cannot write"]);
}
