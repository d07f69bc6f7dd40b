//! Positions of cameras placed by the command line, and of default cameras.

use std::path::Path;

use rayfront::compile::compile;
use rayfront::internals::formats::{LoadOptions, load_with};
use rayfront::internals::scene::CompiledCamera;
use rayfront::math::Vec3;

use super::program::{Place, empty_folder, folder};

const SCENE: &str = r#"(
    settings: (size: (24, 16), samples: 2),
    materials: {"paper": (diffuse: (0.8, 0.4, 0.2))},
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 45), transform: LookAt(from: (0, 0, 5), to: (0, 0, 0))),
        (shape: Sphere, material: "paper"),
        (light: Point(power_w: 300), transform: (translate: (2, 4, 3))),
    ],
)"#;

#[test]
fn orbit_and_zoom_move_the_camera_like_look_at() {
    let folder = folder(SCENE);
    let film = |options: &str| folder.hash(&format!("scene.ron {options}"));
    let as_is = film("");
    for (options, written) in [
        ("--orbit 90,0", "--look-at 5,0,0 0,0,0"),
        ("--orbit=-90,0 --zoom 2", "--look-at -2.5,0,0 0,0,0"),
        ("--orbit 0,30", "--look-at 0,2.5,4.33013 0,0,0"),
        // Around the point that it is aimed at.
        ("--look-at 1,0,5 1,0,1 --orbit 180,0", "--look-at 1,0,-3 1,0,1"),
    ] {
        assert_eq!(film(options), film(written), "{options}");
        assert_ne!(film(options), as_is, "{options}");
    }
    assert_ne!(film("--ground"), as_is);
    folder.fails(2, "scene.ron --zoom 0", &[]);
}

/// The camera of a scene for an image of some size.
fn camera(path: &Path, size: [u32; 2], time_s: Option<f32>) -> CompiledCamera {
    let options = LoadOptions { size: Some(size), time_s, ..LoadOptions::default() };
    let world = load_with(path, &options).expect("a world");
    compile(&world, None).expect("a scene").camera
}

/// Without a camera the scene fills an image of any aspect ratio: its outermost vertex is where a margin of 8 % begins.
#[test]
fn default_camera_frames_the_mesh_with_a_margin() {
    let folder = empty_folder();
    let vertices = [[0, 0, 0], [9, 0, 0], [9, 2, 0], [0, 2, -5], [4, 1, 3]];
    let mut text: String = vertices.map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat();
    // No face uses this vertex, so it is not visible.
    text += "v 100 100 100\nf 1 2 3\nf 1 3 4\nf 1 4 5\n";
    folder.write("a.obj", text);
    for size in [[160, 90], [90, 160], [400, 40]] {
        let camera = camera(&folder.join("a.obj"), size, None);
        let slope = 20_f32.to_radians().tan();
        let outermost = vertices.map(|vertex| {
            let to = Vec3::from(vertex.map(|c| c as f32)) - camera.origin;
            let half = slope * to.dot(camera.forward);
            let aspect = size[0] as f32 / size[1] as f32;
            (to.dot(camera.right) / (half * aspect)).abs().max((to.dot(camera.up) / half).abs())
        });
        let outermost = outermost.into_iter().fold(0.0, f32::max);
        assert!((outermost - 0.92).abs() < 1e-3, "{size:?}: {outermost}");
    }
}

#[test]
fn default_camera_does_not_depend_on_the_time() {
    let Some(corpus) = std::env::var_os("RAYFRONT_CORPUS") else { return };
    let path =
        Path::new(&corpus).join("khronos-sample-assets/Models/BoxAnimated/glTF-Binary/BoxAnimated.glb");
    let [rest, first, last] = [None, Some(0.0), Some(2.5)].map(|time| camera(&path, [64, 48], time));
    assert_eq!((first.origin, last.origin), (rest.origin, rest.origin));
}
