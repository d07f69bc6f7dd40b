//! `rayfront trace` as a whole program, with rays whose hits are known analytically.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

/// A triangle at z = 0, a square at z = −1 and a pentagon at z = −2, side by side and each two units wide: six
/// triangles.
const MESH: &str = "ply
format ascii 1.0
element vertex 12
property float x
property float y
property float z
element face 3
property list uchar int vertex_indices
end_header
0 0 0
2 0 0
0 2 0
10 0 -1
12 0 -1
12 2 -1
10 2 -1
20 0 -2
22 0 -2
22 1 -2
21 2 -2
20 1 -2
3 0 1 2
4 3 4 5 6
5 7 8 9 10 11
";

const MISS: (f32, f32, f32, u32) = (f32::INFINITY, 0.0, 0.0, u32::MAX);

/// A ray straight down from z = 3 at x and y.
fn down(x: f32, y: f32) -> [f32; 8] {
    [x, y, 3.0, 0.0, 0.0, -1.0, 0.0, 1e30]
}

/// t and the triangle's index; none for a miss.
type Expected = Option<(f32, u32)>;

/// Rays with their expected hits.
fn rays() -> Vec<([f32; 8], Expected)> {
    let below = |z: f32, t_min: f32, t_max: f32| [0.25, 0.5, z, 0.0, 0.0, -1.0, t_min, t_max];
    vec![
        (down(0.25, 0.5), Some((3.0, 0))),
        (down(1.9, 1.9), None),
        (down(11.5, 0.5), Some((4.0, 1))),
        (down(10.5, 1.5), Some((4.0, 2))),
        (down(5.0, 0.5), None),
        (below(3.0, 0.0, 2.5), None),
        (below(3.0, 3.5, 9.0), None),
        (below(3.0, 2.5, 3.5), Some((3.0, 0))),
        ([f32::NAN, 0.5, 3.0, 0.0, 0.0, -1.0, 0.0, 1e30], None),
        ([0.25, f32::INFINITY, 3.0, 0.0, 0.0, -1.0, 0.0, 1e30], None),
        ([0.25, 0.5, 3.0, 0.0, 0.0, 0.0, 0.0, 1e30], None),
        ([0.25, 0.5, 3.0, 0.0, 0.0, -1.0, 0.0, f32::NAN], None),
        ([0.25, 0.5, 6.0, 0.0, 0.0, -2.0, 0.0, f32::INFINITY], Some((3.0, 0))),
    ]
}

fn write_rays(path: &Path, rays: impl IntoIterator<Item = [f32; 8]>) {
    let bytes: Vec<u8> = rays.into_iter().flatten().flat_map(f32::to_le_bytes).collect();
    std::fs::write(path, bytes).expect("a file");
}

fn read_hits(path: &Path) -> Vec<(f32, f32, f32, u32)> {
    let bytes = std::fs::read(path).expect("hits");
    let (words, rest) = bytes.as_chunks::<4>();
    assert!(rest.is_empty() && words.len() % 4 == 0);
    let words: Vec<u32> = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
    let float = f32::from_bits;
    words.chunks(4).map(|w| (float(w[0]), float(w[1]), float(w[2]), w[3])).collect()
}

/// A folder with `mesh.ply` and `rays.f32`.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("mesh.ply"), MESH).expect("a file");
    write_rays(&folder.path().join("rays.f32"), rays().into_iter().map(|(ray, _)| ray));
    folder
}

fn run(folder: &TempDir, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rayfront"));
    let command = command.current_dir(folder.path()).arg("trace").args(arguments).stdin(Stdio::null());
    command.output().expect("the program runs")
}

#[track_caller]
fn stdout(folder: &TempDir, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {error}");
    assert!(error.is_empty(), "{error}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Returns the single line of a run's error message.
#[track_caller]
fn failure(folder: &TempDir, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let error = String::from_utf8(output.stderr).expect("UTF-8");
    let code = if arguments.contains(&"--out") { 3 } else { 1 };
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
    assert!(output.stdout.is_empty() && error.starts_with("error: "), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
    error
}

#[test]
fn closest_and_any_hits_match_the_expected_ones() {
    let folder = folder();
    stdout(&folder, &["mesh.ply", "--rays", "rays.f32", "--out", "hits.bin"]);
    let hits = read_hits(&folder.path().join("hits.bin"));
    assert_eq!(hits.len(), rays().len());
    for (i, (hit, (_, expected))) in hits.iter().zip(rays()).enumerate() {
        match expected {
            None => assert_eq!(*hit, MISS, "ray {i}"),
            Some((t, triangle)) => {
                assert!((hit.0 - t).abs() < 1e-5, "ray {i}: {hit:?}");
                assert_eq!(hit.3, triangle, "ray {i}");
            }
        }
    }
    // Barycentric coordinates of the second and third corner.
    assert!((hits[0].1 - 0.125).abs() < 1e-6 && (hits[0].2 - 0.25).abs() < 1e-6, "{:?}", hits[0]);

    stdout(&folder, &["mesh.ply", "--rays", "rays.f32", "--out", "any.bin", "--any"]);
    for (any, closest) in read_hits(&folder.path().join("any.bin")).iter().zip(&hits) {
        assert_eq!(*any, if *closest == MISS { MISS } else { (0.0, 0.0, 0.0, 0) });
    }
}

/// Triangles are indexed in the order of the file's faces.
#[test]
fn triangles_are_indexed_in_file_order() {
    let folder = folder();
    let mesh = rayfront::internals::formats::ply::load(&folder.path().join("mesh.ply")).expect("the mesh");
    assert_eq!(mesh.triangles.len(), 6);
    let middle = |t: &[u32; 3]| {
        t.iter()
            .map(|v| mesh.positions[*v as usize] / 3.0)
            .fold(Default::default(), |a: rayfront::math::Vec3, b| a + b)
    };
    write_rays(
        &folder.path().join("middles.f32"),
        mesh.triangles.iter().map(|t| down(middle(t).x, middle(t).y)),
    );
    stdout(&folder, &["mesh.ply", "--rays", "middles.f32", "--out", "hits.bin"]);
    let numbers: Vec<u32> = read_hits(&folder.path().join("hits.bin")).iter().map(|hit| hit.3).collect();
    assert_eq!(numbers, [0, 1, 2, 3, 4, 5]);
    let face = |triangle: u32| [0, 1, 1, 2, 2, 2][triangle as usize];
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        let first = [0, 3, 7, 12];
        let range = first[face(triangle as u32)]..first[face(triangle as u32) + 1];
        assert!(corners.iter().all(|v| range.contains(&(*v as usize))), "{triangle}: {corners:?}");
    }
}

#[test]
fn hits_do_not_depend_on_threads_lanes_or_repeats() {
    let folder = folder();
    // A little more than three chunks of rays in all directions, from a small generator of our own.
    let mut state = 1u32;
    let mut number = |size: f32| {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (state >> 8) as f32 / (1 << 24) as f32 * size
    };
    let many: Vec<[f32; 8]> = (0..3 * rayfront::internals::bvh::QUEUE + 7)
        .map(|_| {
            let (x, y) = (number(24.0), number(3.0));
            [x, y, 5.0, number(0.4) - 0.2, number(0.4) - 0.2, -1.0, 0.0, 1e30]
        })
        .collect();
    write_rays(&folder.path().join("many.f32"), many);
    for any in [&[][..], &["--any"]] {
        let trace = |more: &[&str]| {
            let arguments = [&["mesh.ply", "--rays", "many.f32", "--out", "out.bin"], any, more].concat();
            stdout(&folder, &arguments);
            std::fs::read(folder.path().join("out.bin")).expect("hits")
        };
        let first = trace(&["--threads", "1"]);
        let found = first.chunks(16).filter(|hit| hit[12..] != [0xff; 4]).count();
        assert!(found > 2_000 && found < 48_000, "{found}");
        for more in [
            &["--threads", "3"][..],
            &["--repeat", "3"],
            &["--simd", "portable"],
            &["--coherence", "coherent"],
            &["--coherence", "scattered", "--threads", "2"],
        ] {
            assert!(trace(more) == first, "{any:?} {more:?}");
        }
        for isa in rayfront::internals::simd::Isa::available() {
            assert!(trace(&["--simd", isa.name()]) == first, "{any:?} {isa:?}");
        }
    }
}

#[test]
fn measurements_are_reported_as_json_and_text() {
    let folder = folder();
    let json = |more: &[&str]| -> Value {
        let out = stdout(&folder, &[&["mesh.ply", "--rays", "rays.f32", "--json"], more].concat());
        assert_eq!(out.lines().count(), 1);
        serde_json::from_str(&out).expect("JSON")
    };
    let facts = json(&["--threads", "2", "--repeat", "4", "--quality", "high", "--out", "hits.bin"]);
    let hits = rays().iter().filter(|(_, hit)| hit.is_some()).count();
    for (key, value) in [
        ("scene", Value::from("mesh.ply")),
        ("query", "closest".into()),
        ("coherence", "unknown".into()),
        ("quality", "high".into()),
        ("rays", rays().len().into()),
        ("hits", hits.into()),
        ("threads", 2.into()),
        ("repeat", 4.into()),
        ("triangles", 6.into()),
        ("spheres", 0.into()),
        ("instances", 0.into()),
        ("simd", rayfront::internals::simd::Isa::detect().name().into()),
    ] {
        assert_eq!(facts[key], value, "{key}");
    }
    for key in [
        "mrays_per_s",
        "wall_s",
        "load_s",
        "compile_s",
        "build_s",
        "bvh_bytes",
        "bytes_per_triangle",
        "geometry_bytes",
    ] {
        assert!(facts[key].as_f64() > Some(0.0), "{key}: {}", facts[key]);
    }
    assert!(facts["build_peak_bytes"].is_u64());
    if cfg!(target_os = "linux") {
        for key in ["mrays_per_cpu_s", "cpu_s", "peak_rss_bytes"] {
            assert!(facts[key].as_f64() > Some(0.0), "{key}: {}", facts[key]);
        }
    }
    assert!(facts.get("mismatches").is_none());
    assert_eq!(json(&["--any"])["query"], "any");
    assert_eq!(json(&["--any"])["hits"], hits);

    assert_eq!(json(&["--reference", "hits.bin"])["mismatches"], 0);
    // One hit moved and one lost: any-hit queries only detect the second change.
    let mut reference = std::fs::read(folder.path().join("hits.bin")).expect("hits");
    reference[..4].copy_from_slice(&3.001f32.to_le_bytes());
    reference.copy_within(16..32, 2 * 16);
    std::fs::write(folder.path().join("other.bin"), reference).expect("a file");
    assert_eq!(json(&["--reference", "other.bin"])["mismatches"], 2);
    assert_eq!(json(&["--reference", "other.bin", "--any"])["mismatches"], 1);

    let text = stdout(&folder, &["mesh.ply", "--rays", "rays.f32", "--reference", "other.bin"]);
    for word in ["6 triangles", "13, 5 hits", "CPU second", "2 mismatches", "bytes a triangle"] {
        assert!(text.contains(word), "{word}: {text}");
    }
}

/// A scene needs no camera to be traced; the high bit distinguishes spheres from triangles.
#[test]
fn scenes_with_instances_and_spheres_are_traced() {
    let folder = folder();
    let scene = r#"(settings: (copied_triangles: 0), entities: [
        (shape: Mesh("mesh.ply")),
        (shape: Mesh("mesh.ply"), transform: (translate: (0, 10, 0))),
        (shape: Sphere(radius_m: 1), transform: (translate: (-5, 0, 0))),
    ])"#;
    std::fs::write(folder.path().join("scene.ron"), scene).expect("a file");
    let places = [(0.25, 0.5), (0.25, 10.5), (-5.0, 0.0), (-5.0, 5.0)];
    write_rays(&folder.path().join("rays.f32"), places.map(|(x, y)| down(x, y)));
    let out = stdout(&folder, &["scene.ron", "--rays", "rays.f32", "--out", "hits.bin", "--json"]);
    let facts: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(
        (&facts["instances"], &facts["spheres"], &facts["triangles"]),
        (&2.into(), &1.into(), &6.into())
    );
    let hits = read_hits(&folder.path().join("hits.bin"));
    assert_eq!(hits.iter().map(|hit| hit.3).collect::<Vec<_>>(), [0, 0, 1 << 31, u32::MAX]);
    assert!((hits[2].0 - 2.0).abs() < 1e-6);

    write_rays(&folder.path().join("none.f32"), []);
    let facts: Value =
        serde_json::from_str(&stdout(&folder, &["scene.ron", "--rays", "none.f32", "--json"])).expect("JSON");
    assert_eq!((&facts["rays"], &facts["hits"]), (&0.into(), &0.into()));
}

#[test]
fn errors_name_the_file_and_the_position() {
    let folder = folder();
    let mut cut = std::fs::read(folder.path().join("rays.f32")).expect("rays");
    cut.truncate(2 * 32 + 7);
    std::fs::write(folder.path().join("cut.f32"), cut).expect("a file");
    std::fs::write(folder.path().join("short.bin"), [0; 32]).expect("a file");
    std::fs::write(folder.path().join("odd.bin"), [0; 33]).expect("a file");
    std::fs::write(folder.path().join("broken.ply"), "ply\nformat ascii 1.0\n").expect("a file");
    let rays = ["mesh.ply", "--rays", "rays.f32"];
    for (arguments, words) in [
        (&["mesh.ply", "--rays", "cut.f32"][..], &["cut.f32: ", "ray 2", "byte 64", "7 of 32 bytes"][..]),
        (&["mesh.ply", "--rays", "nowhere.f32"], &["nowhere.f32: cannot read"]),
        (&["mesh.ply", "--rays", "."], &[".: cannot read"]),
        (&["nowhere.ply", "--rays", "rays.f32"], &["nowhere.ply: cannot read"]),
        (&["broken.ply", "--rays", "rays.f32"], &["broken.ply:"]),
        (&[&rays[..], &["--reference", "short.bin"]].concat(), &["short.bin: has 2 hits", "13 rays"]),
        (&[&rays[..], &["--reference", "odd.bin"]].concat(), &["odd.bin: hit 2", "byte 32", "1 of 16"]),
        (&[&rays[..], &["--out", "missing/hits.bin"]].concat(), &["missing/hits.bin", "cannot write"]),
    ] {
        let error = failure(&folder, arguments);
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
    for arguments in [
        &["mesh.ply"][..],
        &["--rays", "rays.f32"],
        &[&rays[..], &["--repeat", "0"]].concat(),
        &[&rays[..], &["--quality", "best"]].concat(),
        &[&rays[..], &["--coherence", "some"]].concat(),
        &[&rays[..], &["--simd", "mmx"]].concat(),
    ] {
        assert_eq!(run(&folder, arguments).status.code(), Some(2), "{arguments:?}");
    }
}
