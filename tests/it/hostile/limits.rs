//! Requests above a limit are refused before memory is allocated; memory estimates are accurate.

use std::path::Path;

use super::{ball, scene};
use crate::program::{Place, folder};

/// A sheet of about this many triangles.
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

/// A PNG of one colour, with a few bits per pixel.
fn flat(path: &Path, side: u32, color: png::ColorType, depth: png::BitDepth) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).expect("a file"), side, side);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let row = (side as usize * color.samples() * depth as usize).div_ceil(8);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&vec![0; row * side as usize]).expect("rows");
}

#[test]
#[cfg(target_os = "linux")]
fn info_forecasts_the_peak() {
    let here = folder("");
    for triangles in [1_000, 30_000, 1_000_000] {
        sheet(&here.join(format!("{triangles}.ply")), triangles);
    }
    let pictures = 24;
    for i in 0..pictures {
        flat(&here.join(format!("{i}.png")), 512 + i, png::ColorType::Rgb, png::BitDepth::Eight);
    }
    let balls = (0..pictures)
        .map(|i| format!("(shape: Sphere(radius_m: 1), material: (diffuse: Image(\"{i}.png\"))),"));
    here.write("pictures.ron", scene("", &balls.collect::<String>()));
    here.write("film.ron", ball("").replace("size: (16, 12)", "size: (2000, 1500)"));
    for file in ["1000.ply", "30000.ply", "1000000.ply", "pictures.ron", "film.ron"] {
        let forecast = here.json(&["info", file]);
        let rendered = here.json(&format!("{file} -s 1 -q -o a.png"));
        let [forecast, peak] =
            [forecast, rendered].map(|it| it["memory_bytes"]["peak"].as_f64().expect("bytes"));
        println!("{file}: {:.1} MB forecast, {:.1} MB at the peak", forecast / 1e6, peak / 1e6);
        // Small ones depend on when threads allocate their stacks.
        assert!(
            (forecast - peak).abs() < 0.1 * peak + 4e6,
            "{file}: {forecast} forecast, {peak} at the peak"
        );
    }
}

#[test]
#[cfg(target_os = "linux")]
fn what_is_too_large_is_a_line() {
    let here = folder(&ball(""));
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
        here.write(name, text);
    }
    for (line, code, words) in [
        ("scene.ron --memory 200M --size 6000x6000", 4, &["an image of 6000x6000", "--crop", "--memory"][..]),
        (
            "scene.ron --memory 200M --size 2000x1200 --spp 64 --adaptive=unbiased",
            4,
            &["an image of 2000x1200"],
        ),
        ("sheet.ply --memory 70M", 4, &["sheet.ply", "--memory"]),
        ("large.ron --memory 150M", 4, &["large.png", "the picture of 6000 x 6000 pixels"]),
        ("many.ron --memory 200M", 4, &["--memory"]),
        ("bomb.ron", 1, &["bomb.png", "20000 x 20000", "does not hold"]),
        ("scene.ron --memory 10", 2, &["--memory"]),
        ("scene.ron --threads 100000", 4, &["100000", "no use"]),
    ] {
        let error = here.run(&format!("{line} -q -o a.png")).ends(code, words);
        assert!(code == 2 || error.lines().count() == 1, "{line}: {error}");
    }
    // They render with as much memory as estimated.
    for file in ["sheet.ply", "large.ron", "many.ron"] {
        let forecast = here.json(&["info", file]);
        let bytes = forecast["memory_bytes"]["peak"].as_f64().expect("bytes") * 1.6 + 60e6;
        here.out(&format!("{file} --memory {}M -s 1 -q -o a.png", (bytes / 1e6).ceil()));
    }
}

/// Reaching a limit of the system gives a message, whichever part reaches it first.
#[test]
#[cfg(target_os = "linux")]
fn limits_of_the_system_are_no_abort() {
    let here = folder(&ball(""));
    sheet(&here.join("sheet.ply"), 1_000_000);
    here.shell("ulimit -v 1500000; rayfront scene.ron --size 6000x6000")
        .ends(4, &["an image of 6000x6000", "ulimit -v"]);
    here.shell("export RAYON_NUM_THREADS=100000; rayfront scene.ron -q -o a.png")
        .ends(4, &["100000", "RAYON_NUM_THREADS"]);
    here.shell("ulimit -s 64; rayfront scene.ron -s 1 -q -o a.png").ends(0, &[]);
    for kilobytes in [60_000, 100_000, 200_000, 250_000, 300_000] {
        let run = here.shell(&format!("ulimit -v {kilobytes}; rayfront sheet.ply -t 2 -s 1 -q -o a.png"));
        // The scene, its threads, or the program itself may not fit.
        let is_clean = matches!(run.code, Some(0 | 4 | 127)) && !run.err.contains("panicked");
        assert!(is_clean, "{kilobytes}: {:?} {}", run.code, run.err);
    }
}

/// Saving films during a rendering takes no memory beyond the estimate.
#[test]
#[cfg(target_os = "linux")]
fn checkpoints_take_no_memory() {
    let here = folder(&ball("").replace("size: (16, 12), samples: 2", "size: (1200, 900), samples: 1"));
    let peak = |line: &str| {
        let found = here.json(&format!("scene.ron -q -t 1 {line}"));
        found["memory_bytes"]["peak"].as_f64().expect("bytes")
    };
    // The film has 60 MB.
    let without = peak("-o a.png --checkpoint off");
    for line in ["-o a.png --checkpoint 5ms", "-o a.png -o a.film --checkpoint 5ms"] {
        let with = peak(line);
        println!("{line}: {:.1} MB, {:.1} MB without", with / 1e6, without / 1e6);
        assert!(with < without + 12e6, "{line}: {with}, {without} without");
    }
    // A resumed rendering also has a single film.
    std::fs::remove_file(here.join("a.film")).expect("a film");
    let line = "scene.ron -q --spp 3 --samples 0..2 --sampler independent --transport path -t 1 -o a.film";
    here.out(line);
    let found = here.json("resume a.film -q -t 1 -o b.png");
    let resumed = found["memory_bytes"]["peak"].as_f64().expect("bytes");
    assert!(resumed < without + 12e6, "{resumed}, {without} from the beginning");
}

/// An image of one tile needs one wave, with any number of threads; and raising the limit never makes a rendering fail.
#[test]
#[cfg(target_os = "linux")]
fn what_fits_is_not_refused() {
    let here = folder(&ball(""));
    let line = "scene.ron -q -o a.png --size 64x36 --threads 64 --memory 150M";
    here.out(line);
    for threads in [1, 2, 16] {
        let mut fits = false;
        for megabytes in [96, 128, 160, 192, 224, 256, 320, 400, 512] {
            let limit = megabytes * 1024;
            let line = format!("ulimit -v {limit}; rayfront scene.ron -q -o a.png -s 1 --threads {threads}");
            let code = here.shell(&line).code;
            assert!(code == Some(0) || !fits, "{threads} threads: {megabytes} MB do not do, and less did");
            fits |= code == Some(0);
        }
        assert!(fits, "{threads} threads");
    }
}

/// A morph has a different mesh in each frame: only the most recent ones are cached.
#[test]
#[cfg(target_os = "linux")]
fn frames_take_no_more_memory_than_one() {
    const SIDE: u32 = 90;
    let here = folder("");
    let grid = || (0..SIDE * SIDE).map(|i| ((i % SIDE) as f32, (i / SIDE) as f32));
    let positions: Vec<f32> = grid().flat_map(|(x, y)| [x, y, 0.0]).collect();
    let moved: Vec<f32> = grid().flat_map(|(x, y)| [0.0, 0.0, (x * 7.0 + y * 3.0) % 5.0]).collect();
    let indices: Vec<u32> = (0..(SIDE - 1) * (SIDE - 1))
        .map(|i| i / (SIDE - 1) * SIDE + i % (SIDE - 1))
        .flat_map(|corner| [corner, corner + 1, corner + SIDE, corner + SIDE, corner + 1, corner + SIDE + 1])
        .collect();
    let times = [0.0f32, 10.0, 0.0, 1.0];
    let floats = |numbers: &[f32]| numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    let of_indices: Vec<u8> = indices.iter().flat_map(|n| n.to_le_bytes()).collect();
    let bytes = [floats(&positions), floats(&moved), of_indices, floats(&times)].concat();
    here.write("morph.bin", &bytes);
    let (vertices, corners, last) = (SIDE * SIDE, indices.len(), SIDE - 1);
    let (of_vertices, of_corners) = (vertices * 12, corners as u32 * 4);
    let (third, fourth) = (2 * of_vertices, 2 * of_vertices + of_corners);
    let model = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
        "meshes": [{{"weights": [0], "primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 2, "targets": [{{"POSITION": 1}}]}}]}}],
        "animations": [{{"channels": [{{"sampler": 0, "target": {{"node": 0, "path": "weights"}}}}], "samplers": [{{"input": 3, "output": 4}}]}}],
        "accessors": [
            {{"bufferView": 0, "componentType": 5126, "count": {vertices}, "type": "VEC3", "min": [0, 0, 0], "max": [{last}, {last}, 0]}},
            {{"bufferView": 1, "componentType": 5126, "count": {vertices}, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 5]}},
            {{"bufferView": 2, "componentType": 5125, "count": {corners}, "type": "SCALAR"}},
            {{"bufferView": 3, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [10]}},
            {{"bufferView": 4, "componentType": 5126, "count": 2, "type": "SCALAR"}}],
        "bufferViews": [
            {{"buffer": 0, "byteOffset": 0, "byteLength": {of_vertices}}},
            {{"buffer": 0, "byteOffset": {of_vertices}, "byteLength": {of_vertices}}},
            {{"buffer": 0, "byteOffset": {third}, "byteLength": {of_corners}}},
            {{"buffer": 0, "byteOffset": {fourth}, "byteLength": 8}},
            {{"buffer": 0, "byteOffset": {}, "byteLength": 8}}],
        "buffers": [{{"byteLength": {}, "uri": "morph.bin"}}]}}"#,
        fourth + 8,
        bytes.len()
    );
    here.write("morph.gltf", model);
    let peak = |frames: &str| {
        let line =
            format!("morph.gltf -q --json -t 1 --size 16x9 -s 1 --frames {frames} --overwrite -o f.#.png");
        let text = here.out(&line);
        let last = text.lines().last().expect("a frame");
        let found: serde_json::Value = serde_json::from_str(last).expect("JSON");
        found["memory_bytes"]["peak"].as_f64().expect("bytes")
    };
    let (few, many) = (peak("1-3"), peak("1-30"));
    println!("{:.1} MB after 3 frames, {:.1} MB after 30", few / 1e6, many / 1e6);
    assert!(many < few + 4e6, "{many} after 30 frames, {few} after 3");
}

/// Profiles and texts in a PNG are compressed by a factor of a thousand. They are not decompressed.
#[test]
#[cfg(target_os = "linux")]
fn notes_in_pictures_take_no_memory() {
    const LARGE: usize = 256 << 20;
    let here = folder(&ball(r#"diffuse: Image("t.png")"#));
    let mut info = png::Info::with_size(8, 8);
    info.color_type = png::ColorType::Rgb;
    info.icc_profile = Some(vec![b'a'; LARGE].into());
    let mut bytes = Vec::new();
    let mut writer =
        png::Encoder::with_info(&mut bytes, info).expect("a header").write_header().expect("a header");
    writer.write_image_data(&[200; 8 * 8 * 3]).expect("rows");
    writer.finish().expect("an end");
    here.write("t.png", &bytes);
    let found = here.json("scene.ron -q -o a.png");
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
    here.write("r.png", &bytes);
    here.run("reproduce r.png").ends(1, &["r.png"]);
}

/// Comparing images takes many times their own memory.
#[test]
fn comparisons_stay_within_memory() {
    let here = folder(&ball(""));
    for name in ["a.png", "b.png"] {
        flat(&here.join(name), 1_000, png::ColorType::Rgb, png::BitDepth::Eight);
    }
    let with = |memory: &str| here.run(&["compare", "a.png", "b.png", "--memory", memory]);
    with("200M").ends(4, &["comparing images of 1000x1000", "--memory"]);
    with("400M").ends(0, &[]);
}

#[test]
fn endless_work_is_announced() {
    let glass = "(shape: Sphere(radius_m: 1), material: (kt: 0.9, kr: 0.9, ior: 1.5)),";
    let said = |settings: &str| folder(&scene(settings, glass)).out("info scene.ron");
    assert!(said("max_depth: 40, min_throughput: 0").contains("up to 2^40 of them"));
    assert!(!said("max_depth: 40").contains("2^40"));
    assert!(!said("max_depth: 8, min_throughput: 0").contains("2^8"));
}

/// Radiance above the film's range is reported.
#[test]
fn what_is_cut_is_told() {
    // In front of the camera, and too small to light anything else.
    let spark = "(shape: Sphere(radius_m: 0.0004), transform: (translate: (0, 0.9996, 4.998)), \
                  material: (diffuse: 0, emission: 1e9)), \
                 (shape: Sphere(radius_m: 0.8), transform: (translate: (1.6, 0, 0)), material: (diffuse: 0.5)),";
    let folder = folder(&scene("background: 0.1", spark));
    let output = folder.run("scene.ron -o a.png");
    output.ends(0, &["samples are brighter than", "times): the first is"]);
}

/// A full disk affects no other output, and the rendered samples are kept.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_loses_nothing() {
    let here = folder(&ball(""));
    for name in ["full", "home"] {
        std::fs::create_dir(here.join(name)).expect("a folder");
    }
    let full = |line: &str| {
        let mount = "mount -t tmpfs -o size=64k none full && dd if=/dev/zero of=full/filler bs=1k count=60 2>/dev/null";
        here.shell(&format!("unshare -rm bash -c '{mount}; {} {line}'", env!("CARGO_BIN_EXE_rayfront")))
    };
    if full("--version").code != Some(0) {
        println!("skipped: not everybody may mount something");
        return;
    }
    let size = "--size 160x120 -q";
    let error = full(&format!("scene.ron {size} -o full/a.exr -o good.png -o good.exr"))
        .ends(3, &["full/a.exr: cannot write", "what was rendered is in", "rayfront merge"]);
    let (good, _) = (here.image("good.exr"), here.image("good.png"));
    // The command from the message.
    let command = error.split("rayfront merge ").nth(1).expect("a command");
    let film = command.split(' ').next().expect("a film");
    here.run(&["merge", film, "-q", "-o", "again.exr"]).ends(0, &[]);
    assert_eq!(here.image("again.exr"), good);
    std::fs::remove_file(film).expect("it is there");
    // A requested film is saved elsewhere, too; an existing one is named.
    let parts = ["full/a.film: cannot write", "what was rendered is in"];
    full(&format!("scene.ron {size} -o full/a.film -o b.png")).ends(3, &parts);
    assert!(here.has("b.png"));
    full(&format!("scene.ron {size} -o good.film -o full/a.exr")).ends(3, &["is in good.film"]);
    // A file that may not grow is like a full disk.
    let run = here.shell("ulimit -f 4; rayfront scene.ron -q --size 160x120 -o big.exr");
    run.ends(3, &["big.exr: cannot write", "nowhere was room"]);
    let left = std::fs::read_dir(&here).expect("a folder").flatten();
    assert!(left.map(|file| file.file_name()).all(|name| !name.to_string_lossy().ends_with(".part")));
}

/// Invalid output names are detected before an hour of rendering.
#[test]
fn bad_names_are_found_at_once() {
    let here = folder(&ball(""));
    let long = "a".repeat(250);
    for output in [
        format!("{long}aaaaa.png"),
        format!("{long}a.film"),
        "/dev/null/a.png".into(),
        "scene.ron/a.png".into(),
    ] {
        here.fails(3, &format!("scene.ron --size 4096x4096 -s 4096 -q -o {output}"), &["cannot write"]);
    }
    // The name of the denoised image is longer.
    let output = format!("{}.png", "a".repeat(248));
    here.fails(3, &format!("scene.ron --size 4096x4096 -s 4096 -q --denoise -o {output}"), &["cannot write"]);
}
