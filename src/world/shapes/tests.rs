use std::f64::consts::{PI, TAU};

use proptest::prelude::*;

use super::*;
use crate::math::{DVec2, DVec3};
use crate::world::boundary::{MeshEdges, area, six_volumes};

pub(super) fn made(shape: &Shape, fineness: Fineness) -> Mesh {
    shape.check(&Assets::default()).unwrap();
    shape.to_mesh(&Assets::default(), fineness).expect("a parametric shape").unwrap()
}

pub(super) fn corners(mesh: &Mesh) -> impl Iterator<Item = [Vec3; 3]> {
    mesh.triangles.iter().map(|triangle| triangle.map(|vertex| mesh.positions[vertex as usize]))
}

pub(super) fn area_of(mesh: &Mesh) -> f64 {
    corners(mesh).map(area).sum()
}

pub(super) fn volume_of(mesh: &Mesh) -> f64 {
    six_volumes(Vec3::ZERO, corners(mesh)) / 6.0
}

pub(super) fn is_closed(mesh: &Mesh) -> bool {
    MeshEdges::of(&mesh.positions, mesh.triangles.iter().copied()).open.is_empty()
}

/// Asserts what holds for every shape: unit normals on the outer side of their triangles, texture coordinates from 0 to
/// 1 that show images unmirrored, and no triangle without an area.
#[track_caller]
pub(super) fn assert_sound(mesh: &Mesh) {
    assert_eq!(mesh.normals.len(), mesh.positions.len());
    assert_eq!(mesh.uvs.len(), mesh.positions.len());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
        let face = (b - a).cross(c - a);
        assert!(face.length() > 0.0, "{triangle:?}");
        for vertex in triangle {
            let normal = mesh.normals[*vertex as usize].as_dvec3();
            assert!((normal.length() - 1.0).abs() < 1e-5, "{normal}");
            assert!(normal.dot(face) > 0.0, "{triangle:?}: {normal} against {face}");
        }
        let [a, b, c] = triangle.map(|vertex| mesh.uvs[vertex as usize].as_dvec2());
        assert!([a, b, c].iter().all(|uv| uv.min_element() >= -1e-6 && uv.max_element() <= 1.0 + 1e-6));
        // v goes down.
        assert!((b - a).perp_dot(c - a) < 1e-9, "{triangle:?}: {a} {b} {c}");
    }
}

/// A shape with its volume, its area, and the place and normal of the point of its surface that is nearest to another.
type Known = (Shape, f64, f64, fn(DVec3) -> (f64, DVec3));

/// Shapes of this size and their signed distances are in Quílez, "Distance functions".
fn known() -> Vec<Known> {
    let segments = None;
    let (h, r, t) = (3.0f64, 0.5f64, 0.25f64);
    vec![
        (
            Shape::Box { size_m: Vec3::new(2.0, 1.0, 3.0), bevel_m: 0.25, segments },
            // A core, slabs, quarter cylinders and one ball.
            1.5 * 0.5 * 2.5 + 2.0 * t * (0.75 + 3.75 + 1.25) + PI * t * t * 4.5 + 4.0 / 3.0 * PI * t * t * t,
            2.0 * (0.75 + 3.75 + 1.25) + TAU * t * 4.5 + 4.0 * PI * t * t,
            |p| {
                let out = p - p.clamp(DVec3::new(-0.75, -0.25, -1.25), DVec3::new(0.75, 0.25, 1.25));
                (out.length() - 0.25, out.normalize())
            },
        ),
        (
            Shape::Capsule { radius_m: 0.5, height_m: 3.0, segments },
            PI * r * r * (h - 1.0) + 4.0 / 3.0 * PI * r * r * r,
            TAU * r * h,
            |p| {
                let out = p - DVec3::Y * p.y.clamp(-1.0, 1.0);
                (out.length() - 0.5, out.normalize())
            },
        ),
        (
            Shape::Torus { radius_m: 3.0, tube_radius_m: 0.5, segments },
            2.0 * PI * PI * h * r * r,
            4.0 * PI * PI * h * r,
            |p| {
                let out = p - 3.0 * DVec3::new(p.x, 0.0, p.z).normalize();
                (out.length() - 0.5, out.normalize())
            },
        ),
    ]
}

#[test]
fn round_shapes_converge_to_their_volume_and_area_with_vertices_and_normals_on_the_true_surface() {
    for (shape, volume, area, nearest) in known() {
        let errors = [4e-3, 1e-3].map(|error| {
            let mesh = made(&shape, Fineness::Metres(error));
            assert_sound(&mesh);
            assert!(is_closed(&mesh), "{shape:?}");
            for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
                let (distance, true_normal) = nearest(position.as_dvec3());
                assert!(distance.abs() < 1e-6, "{shape:?}: {position} is {distance} off");
                assert!((normal.as_dvec3() - true_normal).length() < 1e-5, "{shape:?}: {normal}");
            }
            // The silhouette: the middles of edges are within the error.
            for triangle in corners(&mesh) {
                for k in 0..3 {
                    let middle = 0.5 * (triangle[k] + triangle[(k + 1) % 3]).as_dvec3();
                    let (distance, _) = nearest(middle);
                    assert!(distance.abs() < 2.0 * error, "{shape:?}: {distance} for {error}");
                }
            }
            [1.0 - volume_of(&mesh) / volume, 1.0 - area_of(&mesh) / area]
        });
        for (coarse, fine) in errors[0].into_iter().zip(errors[1]) {
            assert!(coarse > 0.0 && fine > 0.0 && fine < 0.02, "{shape:?}: {errors:?}");
            assert!((2.0..6.0).contains(&(coarse / fine)), "{shape:?}: {errors:?}");
        }
    }
}

/// A regular polygon's area and perimeter, relative to those of the circle around it.
pub(super) fn polygon(n: f64) -> [f64; 2] {
    [n / TAU * libm::sin(TAU / n), n / PI * libm::sin(PI / n)]
}

#[test]
fn cylinders_cones_and_discs_are_prisms_pyramids_and_polygons_of_their_segments() {
    let segments = Some(20);
    let [disc, rim] = polygon(20.0);
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-5, "{a}, not {b}");
    let mesh = made(&Shape::Cylinder { radius_m: 0.5, height_m: 3.0, segments }, Fineness::DEFAULT);
    assert!(is_closed(&mesh));
    assert_sound(&mesh);
    near(volume_of(&mesh), disc * PI * 0.25 * 3.0);
    near(area_of(&mesh), rim * PI * 3.0 + disc * PI * 0.5);
    for (top, bottom) in [(0.5f64, 1.0f64), (0.0, 2.0), (1.5, 0.0), (1.0, 1.0)] {
        let [radius_m, top_radius_m] = [bottom as f32, top as f32];
        let mesh = made(&Shape::Cone { radius_m, top_radius_m, height_m: 2.0, segments }, Fineness::DEFAULT);
        assert!(is_closed(&mesh), "{top} {bottom}");
        assert_sound(&mesh);
        near(volume_of(&mesh), disc * PI * 2.0 / 3.0 * (top * top + top * bottom + bottom * bottom));
        // On the side, normals are perpendicular to the slope.
        let slope = DVec2::new(bottom - top, -2.0).normalize();
        let side = mesh.normals.iter().filter(|normal| normal.y.abs() < 0.99);
        for normal in side.map(|normal| normal.as_dvec3()) {
            let outward = DVec2::new(DVec2::new(normal.x, normal.z).length(), normal.y);
            assert!(outward.dot(slope).abs() < 1e-6, "{normal}");
        }
    }
    let disc_mesh = |inner_radius_m: f32| {
        let mesh = made(&Shape::Disc { radius_m: 2.0, inner_radius_m, segments }, Fineness::DEFAULT);
        assert_sound(&mesh);
        assert!(mesh.normals.iter().all(|normal| *normal == Vec3::Y));
        area_of(&mesh)
    };
    near(disc_mesh(0.0), disc * PI * 4.0);
    near(disc_mesh(1.0), disc * PI * 3.0);
}

#[test]
fn boxes_without_bevel_have_twelve_triangles_and_those_of_full_bevel_are_balls_and_capsules() {
    let size_m = Vec3::new(2.0, 1.0, 3.0);
    let mesh = made(&Shape::Box { size_m, bevel_m: 0.0, segments: None }, Fineness::DEFAULT);
    assert_sound(&mesh);
    assert_eq!((mesh.triangles.len(), mesh.positions.len()), (12, 24));
    assert!(is_closed(&mesh));
    assert!((volume_of(&mesh) - 6.0).abs() < 1e-6 && (area_of(&mesh) - 22.0).abs() < 1e-6);
    let ball = |size_m: Vec3| {
        let mesh = made(&Shape::Box { size_m, bevel_m: 0.5, segments: Some(64) }, Fineness::DEFAULT);
        assert_sound(&mesh);
        assert!(is_closed(&mesh));
        volume_of(&mesh)
    };
    let exact = 4.0 / 3.0 * PI / 8.0;
    assert!((ball(Vec3::ONE) / exact - 1.0).abs() < 8e-3);
    assert!((ball(Vec3::new(1.0, 3.0, 1.0)) / (exact + 0.5 * PI) - 1.0).abs() < 8e-3);
}

#[test]
fn images_on_shapes_are_upright_where_the_guide_says() {
    /// The position of a texture coordinate on the surface, if it is on a triangle whose normal is about `towards`.
    fn place(mesh: &Mesh, uv: [f64; 2], towards: DVec3) -> DVec3 {
        let uv = DVec2::from_array(uv);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| mesh.uvs[vertex as usize].as_dvec2());
            let p = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
            let whole = (b - a).perp_dot(c - a);
            let [s, t] = [(uv - a).perp_dot(c - a) / whole, (b - a).perp_dot(uv - a) / whole];
            let face = (p[1] - p[0]).cross(p[2] - p[0]).normalize();
            if s >= -1e-6 && t >= -1e-6 && s + t <= 1.0 + 1e-6 && face.dot(towards) > 0.5 {
                return p[0] + s * (p[1] - p[0]) + t * (p[2] - p[0]);
            }
        }
        panic!("no {uv} towards {towards}");
    }
    #[track_caller]
    fn is(at: DVec3, wanted: [f64; 3]) {
        assert!((at - DVec3::from_array(wanted)).length() < 0.02, "{at}, not {wanted:?}");
    }
    let segments = Some(256);
    let block = made(&Shape::Box { size_m: Vec3::splat(2.0), bevel_m: 0.0, segments }, Fineness::DEFAULT);
    is(place(&block, [0.0, 0.0], DVec3::Z), [-1.0, 1.0, 1.0]);
    is(place(&block, [0.0, 0.0], DVec3::X), [1.0, 1.0, 1.0]);
    is(place(&block, [1.0, 0.0], DVec3::Y), [1.0, 1.0, -1.0]);
    is(place(&block, [1.0, 0.0], DVec3::NEG_Y), [1.0, -1.0, 1.0]);
    let can = made(&Shape::Cylinder { radius_m: 1.0, height_m: 2.0, segments }, Fineness::DEFAULT);
    is(place(&can, [0.5, 0.25], DVec3::X), [1.0, 0.5, 0.0]);
    is(place(&can, [0.25, 0.5], DVec3::Z), [0.0, 0.0, 1.0]);
    is(place(&can, [0.5, 0.25], DVec3::Y), [0.0, 1.0, -0.5]);
    is(place(&can, [0.75, 0.25], DVec3::NEG_Y), [0.5, -1.0, 0.5]);
    let ring = made(&Shape::Torus { radius_m: 2.0, tube_radius_m: 0.5, segments }, Fineness::DEFAULT);
    is(place(&ring, [0.5, 0.25], DVec3::Y), [2.0, 0.5, 0.0]);
    is(place(&ring, [0.5, 0.5], DVec3::X), [2.5, 0.0, 0.0]);
    let pill = made(&Shape::Capsule { radius_m: 0.5, height_m: 3.0, segments }, Fineness::DEFAULT);
    is(place(&pill, [0.25, 0.5], DVec3::Z), [0.0, 0.0, 0.5]);
}

#[test]
fn fineness_gives_as_many_chords_as_the_error_needs_and_no_more() {
    for (radius, error) in [(1.0, 1e-2), (1.0, 1e-4), (50.0, 1e-2), (1e-3, 1e-6)] {
        let n = Fineness::Metres(error).segments(radius, None, 12.0);
        let sagitta = |n: usize| radius * (1.0 - libm::cos(PI / n as f64));
        assert!(
            sagitta(n) <= error && sagitta(n - 4) > error && n.is_multiple_of(4),
            "{radius} {error}: {n}"
        );
    }
    assert_eq!(Fineness::Metres(100.0).segments(1.0, None, 12.0), 12);
    assert_eq!(Fineness::Metres(1e-30).segments(1.0, None, 12.0), 1024);
    assert_eq!(Fineness::Metres(1e-3).segments(1.0, Some(7), 12.0), 7);
    assert_eq!(Fineness::DEFAULT.segments(7.0, None, 12.0), 72);
}

proptest! {
    #[test]
    fn shapes_of_any_size_are_closed_and_sound(
        size in prop::array::uniform3(0.01f32..100.0),
        part in 0.0f32..1.0,
        segments in prop::option::of(3u32..40),
    ) {
        let [a, b, _] = size;
        let bevel_m = 0.5 * size.into_iter().fold(f32::INFINITY, f32::min) * part;
        for shape in [
            Shape::Box { size_m: size.into(), bevel_m, segments },
            Shape::Cylinder { radius_m: a, height_m: b, segments },
            Shape::Cone { radius_m: a, top_radius_m: a * part, height_m: b, segments },
            Shape::Capsule { radius_m: a, height_m: 2.0 * a + b, segments },
            Shape::Torus { radius_m: a, tube_radius_m: a * part.max(0.01), segments },
        ] {
            let mesh = made(&shape, Fineness::DEFAULT);
            assert_sound(&mesh);
            prop_assert!(is_closed(&mesh), "{:?}", shape);
            prop_assert!(volume_of(&mesh) > 0.0);
            let [low, high] = shape.corners_around(&Assets::default()).unwrap();
            let slack = 1e-5 * (high - low).max_element();
            for position in &mesh.positions {
                prop_assert!(position.cmpge(low - slack).all() && position.cmple(high + slack).all(), "{:?}", shape);
            }
        }
    }
}
