//! `rayfront trace` as a whole program, with rays whose hits are known analytically.

use std::path::Path;

use serde_json::Value;

use super::program::{Folder, Place, empty_folder};

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
fn traced() -> Folder {
    let folder = empty_folder();
    folder.write("mesh.ply", MESH);
    write_rays(&folder.join("rays.f32"), rays().into_iter().map(|(ray, _)| ray));
    folder
}

/// Returns the standard output of a successful run without messages.
#[track_caller]
fn stdout(folder: &Folder, line: &str) -> String {
    let mut run = folder.run(&format!("trace {line}"));
    let out = std::mem::take(&mut run.out);
    assert_eq!(run.ends(0, &[]), "");
    out
}

#[test]
fn closest_and_any_hits_match_the_expected_ones() {
    let folder = traced();
    stdout(&folder, "mesh.ply --rays rays.f32 --out hits.bin");
    let hits = read_hits(&folder.join("hits.bin"));
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

    stdout(&folder, "mesh.ply --rays rays.f32 --out any.bin --any");
    for (any, closest) in read_hits(&folder.join("any.bin")).iter().zip(&hits) {
        assert_eq!(*any, if *closest == MISS { MISS } else { (0.0, 0.0, 0.0, 0) });
    }
}

/// Triangles are indexed in the order of the file's faces.
#[test]
fn triangles_are_indexed_in_file_order() {
    let folder = traced();
    let mesh = rayfront::internals::formats::ply::load(&folder.join("mesh.ply")).expect("the mesh").mesh;
    assert_eq!(mesh.triangles.len(), 6);
    let middle = |t: &[u32; 3]| {
        t.iter()
            .map(|v| mesh.positions[*v as usize] / 3.0)
            .fold(Default::default(), |a: rayfront::math::Vec3, b| a + b)
    };
    write_rays(&folder.join("middles.f32"), mesh.triangles.iter().map(|t| down(middle(t).x, middle(t).y)));
    stdout(&folder, "mesh.ply --rays middles.f32 --out hits.bin");
    let numbers: Vec<u32> = read_hits(&folder.join("hits.bin")).iter().map(|hit| hit.3).collect();
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
    let folder = traced();
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
    write_rays(&folder.join("many.f32"), many);
    for any in ["", "--any"] {
        let trace = |more: &str| {
            stdout(&folder, &format!("mesh.ply --rays many.f32 --out out.bin {any} {more}"));
            folder.bytes("out.bin")
        };
        let first = trace("--threads 1");
        let found = first.chunks(16).filter(|hit| hit[12..] != [0xff; 4]).count();
        assert!(found > 2_000 && found < 48_000, "{found}");
        for more in [
            "--threads 3", "--repeat 3", "--simd portable", "--coherence coherent",
            "--coherence scattered --threads 2",
        ] {
            assert!(trace(more) == first, "{any} {more}");
        }
        for isa in rayfront::internals::simd::Isa::available() {
            assert!(trace(&format!("--simd {}", isa.name())) == first, "{any} {isa:?}");
        }
    }
}

#[test]
fn measurements_are_reported_as_json_and_text() {
    let folder = traced();
    let json = |more: &str| -> Value {
        let out = stdout(&folder, &format!("mesh.ply --rays rays.f32 --json {more}"));
        assert_eq!(out.lines().count(), 1);
        serde_json::from_str(&out).expect("JSON")
    };
    let facts = json("--threads 2 --repeat 4 --out hits.bin");
    let hits = rays().iter().filter(|(_, hit)| hit.is_some()).count();
    for (key, value) in [
        ("scene", Value::from("mesh.ply")),
        ("query", "closest".into()),
        ("coherence", "unknown".into()),
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
    let numbers = "mrays_per_s wall_s load_s compile_s build_s bvh_bytes bytes_per_triangle geometry_bytes";
    for key in numbers.split(' ') {
        assert!(facts[key].as_f64() > Some(0.0), "{key}: {}", facts[key]);
    }
    assert!(facts["build_peak_bytes"].is_u64());
    if cfg!(target_os = "linux") {
        for key in ["mrays_per_cpu_s", "cpu_s", "peak_rss_bytes"] {
            assert!(facts[key].as_f64() > Some(0.0), "{key}: {}", facts[key]);
        }
    }
    assert!(facts.get("mismatches").is_none());
    assert_eq!(json("--any")["query"], "any");
    assert_eq!(json("--any")["hits"], hits);

    assert_eq!(json("--reference hits.bin")["mismatches"], 0);
    // One hit moved and one lost: any-hit queries only detect the second change.
    let mut reference = folder.bytes("hits.bin");
    reference[..4].copy_from_slice(&3.001f32.to_le_bytes());
    reference.copy_within(16..32, 2 * 16);
    folder.write("other.bin", reference);
    assert_eq!(json("--reference other.bin")["mismatches"], 2);
    assert_eq!(json("--reference other.bin --any")["mismatches"], 1);

    let text = stdout(&folder, "mesh.ply --rays rays.f32 --reference other.bin");
    for word in ["6 triangles", "13, 5 hits", "CPU second", "2 mismatches", "bytes a triangle"] {
        assert!(text.contains(word), "{word}: {text}");
    }
}

/// A scene needs no camera to be traced; the high bit distinguishes spheres from triangles.
#[test]
fn scenes_with_instances_and_spheres_are_traced() {
    let folder = traced();
    let scene = r#"(settings: (copied_triangles: 0), entities: [
        (shape: Mesh("mesh.ply")),
        (shape: Mesh("mesh.ply"), transform: (translate: (0, 10, 0))),
        (shape: Sphere(radius_m: 1), transform: (translate: (-5, 0, 0))),
    ])"#;
    folder.write("scene.ron", scene);
    let places = [(0.25, 0.5), (0.25, 10.5), (-5.0, 0.0), (-5.0, 5.0)];
    write_rays(&folder.join("rays.f32"), places.map(|(x, y)| down(x, y)));
    let facts = folder.json("trace scene.ron --rays rays.f32 --out hits.bin");
    assert_eq!(
        (&facts["instances"], &facts["spheres"], &facts["triangles"]),
        (&2.into(), &1.into(), &6.into())
    );
    let hits = read_hits(&folder.join("hits.bin"));
    assert_eq!(hits.iter().map(|hit| hit.3).collect::<Vec<_>>(), [0, 0, 1 << 31, u32::MAX]);
    assert!((hits[2].0 - 2.0).abs() < 1e-6);

    write_rays(&folder.join("none.f32"), []);
    let facts = folder.json("trace scene.ron --rays none.f32");
    assert_eq!((&facts["rays"], &facts["hits"]), (&0.into(), &0.into()));
}

#[test]
fn errors_name_the_file_and_the_position() {
    let folder = traced();
    let mut cut = folder.bytes("rays.f32");
    cut.truncate(2 * 32 + 7);
    folder.write("cut.f32", cut);
    folder.write("short.bin", [0; 32]);
    folder.write("odd.bin", [0; 33]);
    folder.write("broken.ply", "ply\nformat ascii 1.0\n");
    for (code, line, words) in [
        (1, "mesh.ply --rays cut.f32", &["cut.f32: ", "ray 2", "byte 64", "7 of 32 bytes"][..]),
        (1, "mesh.ply --rays nowhere.f32", &["nowhere.f32: cannot read"]),
        (1, "mesh.ply --rays .", &[".: cannot read"]),
        (1, "nowhere.ply --rays rays.f32", &["nowhere.ply: cannot read"]),
        (1, "broken.ply --rays rays.f32", &["broken.ply:"]),
        (1, "mesh.ply --rays rays.f32 --reference short.bin", &["short.bin: has 2 hits", "13 rays"]),
        (1, "mesh.ply --rays rays.f32 --reference odd.bin", &["odd.bin: hit 2", "byte 32", "1 of 16"]),
        (3, "mesh.ply --rays rays.f32 --out missing/hits.bin", &["missing/hits.bin", "cannot write"]),
    ] {
        let run = folder.run(&format!("trace {line}"));
        assert_eq!(run.out, "", "{line}");
        let error = run.ends(code, words);
        assert!(error.starts_with("error: ") && error.lines().count() == 1, "{error}");
    }
    for line in [
        "mesh.ply",
        "--rays rays.f32",
        "mesh.ply --rays rays.f32 --repeat 0",
        "mesh.ply --rays rays.f32 --coherence some",
        "mesh.ply --rays rays.f32 --simd mmx",
    ] {
        folder.fails(2, &format!("trace {line}"), &[]);
    }
}
