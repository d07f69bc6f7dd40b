use super::*;
use crate::compile::compile;
use crate::formats::{LoadOptions, load_with};
use crate::integrator::RenderSetup;
use crate::math::{DVec3, Vec3, Vector};
use crate::render::setup;

fn setup_of(camera: &str) -> RenderSetup {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    let text = format!(
        "(settings: (size: (120, 80)), entities: [
            (name: \"eye\", {camera}, transform: LookAt(from: (0, 1, 6), to: (0.5, 0, 0))),
            (shape: Torus(), transform: (translate: (1, 0.5, 0))), (shape: Sphere(radius_m: 0.5)),
            (shape: Plane(corners: ((-9, -1, -9), (-9, -1, 9), (9, -1, 9), (9, -1, -9)))),
        ])"
    );
    std::fs::write(&path, text).unwrap();
    let world = load_with(&path, &LoadOptions::default()).unwrap();
    setup(compile(&world, None).unwrap(), &world.settings)
}

const CAMERAS: [&str; 10] = [
    "camera: Pinhole(vertical_fov_degrees: 40)",
    "camera: ThinLens(lens_radius_m: 0.3, focus_distance_m: 5)",
    "camera: Photographic(f_stop: 1.4, focus_distance_m: 5, shift: (0.1, 0.2), tilt_degrees: (4, 3))",
    "camera: Orthographic(height_m: 5)",
    "camera: Intrinsics(fx: 400, fy: 420, cx: 300, cy: 250, size: (600, 400))",
    "camera: Panorama()",
    "camera: Fisheye(fov_degrees: 200)",
    "camera: Fisheye(fov_degrees: 150, mapping: Stereographic, circular: false)",
    "camera: Pinhole(vertical_fov_degrees: 40), stereo: (layout: SideBySide)",
    "camera: Panorama(), stereo: (layout: OverUnder)",
];

/// The distance of an edge from the camera's ray through a place, over the distance from the camera.
fn distance_from_ray(setup: &RenderSetup, [column, row]: [f32; 2], [a, b]: [Vec3; 2]) -> f64 {
    let pixel = (column.floor(), row.floor());
    let (ray, seen) = setup.image().ray((column, row), pixel, (0.0, 0.0));
    assert!(seen);
    let vector = |v: Vector<f32>| DVec3::new(v.x.into(), v.y.into(), v.z.into());
    let (origin, direction) = (vector(ray.origin), vector(ray.direction));
    // The parts of the way to a and along the edge that are perpendicular to the ray.
    let across = |way: DVec3| way - direction * way.dot(direction);
    let (a, edge) = (a.as_dvec3() - origin, b.as_dvec3() - a.as_dvec3());
    let along = (-across(a).dot(across(edge)) / across(edge).length_squared().max(1e-30)).clamp(0.0, 1.0);
    let way = a + edge * along;
    across(way).length() / way.length()
}

#[test]
fn ends_of_lines_lie_on_camera_rays_through_edges() {
    for camera in CAMERAS {
        let setup = setup_of(camera);
        let [width, height] = setup.size.map(|side| side as f32);
        let mut count = 0;
        for level in 0..=setup.scene.bvh.levels() {
            setup.scene.bvh.visit_level(level, 100, &mut |tree_box| {
                let edges = (0..8).flat_map(|a| (0..3).map(move |axis| (a, a ^ 1 << axis)));
                let edges: Vec<_> =
                    edges.map(|(a, b): (usize, usize)| [tree_box.corners[a], tree_box.corners[b]]).collect();
                for place in edges_of(&ImageLines::new(&setup), &tree_box).into_iter().flatten() {
                    let is_in =
                        (0.5..width - 0.5).contains(&place[0]) && (0.5..height - 0.5).contains(&place[1]);
                    if is_in {
                        let off = edges
                            .iter()
                            .map(|edge| distance_from_ray(&setup, place, *edge))
                            .fold(f64::INFINITY, f64::min);
                        // A pixel is a hundredth of the distance or wider.
                        assert!(off < 1e-3, "{camera}: {place:?} is {off} off");
                        count += 1;
                    }
                }
            });
        }
        assert!(count > 8, "{camera}: {count}");
    }
}

#[test]
fn lines_end_where_edges_leave_the_view() {
    // The floor reaches behind the camera.
    let setup = setup_of(CAMERAS[0]);
    let mut found = Vec::new();
    setup
        .scene
        .bvh
        .visit_level(0, 100, &mut |tree_box| found.extend(edges_of(&ImageLines::new(&setup), &tree_box)));
    assert!(!found.is_empty() && found.len() < 12, "{found:?}");
    assert!(found.iter().all(|line| line.len() == 2));
    assert!(found.iter().flatten().flatten().all(|at| at.abs() <= super::super::lines::FAR));
}

#[test]
fn lines_of_a_panorama_bend_and_do_not_cross_it() {
    let setup = setup_of("camera: Panorama()");
    let mut found = Vec::new();
    setup
        .scene
        .bvh
        .visit_level(0, 100, &mut |tree_box| found.extend(edges_of(&ImageLines::new(&setup), &tree_box)));
    let longest = found.iter().flat_map(|line| line.windows(2)).map(|ends| (ends[0][0] - ends[1][0]).abs());
    assert!(longest.fold(0.0, f32::max) < 60.0);
    assert!(found.iter().any(|line| line.len() > 4));
}
