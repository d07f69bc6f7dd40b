//! Tests of the shapes: they are closed, their outsides face outwards, their teeth mesh.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::mesh::{Polygons, Solid, polar};
use crate::outline::{Outline, circle, contours, distance, doubled_area};
use crate::triangulate::triangulate;
use crate::{clock, dynamo, fields, fractal, gears, glass, knot};

/// The number of directed edges between positions that have no partner in the other direction.
fn open_edges(mesh: &Polygons) -> usize {
    let place = |corner: u32| mesh.positions[corner as usize].map(f32::to_bits);
    let mut balance: HashMap<_, i32> = HashMap::new();
    for face in &mesh.faces {
        for (&a, &b) in face.iter().zip(face.iter().cycle().skip(1)) {
            *balance.entry((place(a), place(b))).or_default() += 1;
            *balance.entry((place(b), place(a))).or_default() -= 1;
        }
    }
    balance.values().filter(|&&count| count != 0).count()
}

/// The volume by the divergence theorem; positive if the faces point outwards.
fn volume(mesh: &Polygons) -> f64 {
    let at = |corner: u32| DVec3::from(mesh.positions[corner as usize].map(f64::from));
    let fan =
        |f: &Vec<u32>| -> f64 { (1..f.len() - 1).map(|i| at(f[0]).dot(at(f[i]).cross(at(f[i + 1])))).sum() };
    mesh.faces.iter().map(fan).sum::<f64>() / 6.0
}

fn assert_closed(name: &str, mesh: &Polygons) {
    assert_eq!(open_edges(mesh), 0, "{name} has holes");
    assert!(volume(mesh) > 0.0, "{name} is inside out");
}

#[test]
fn machine_parts_are_closed_and_face_outwards() {
    for (name, mesh) in clock::parts().into_iter().chain(dynamo::parts()) {
        assert_closed(name, &mesh);
    }
}

#[test]
fn glass_is_closed_and_faces_outwards() {
    let named: [(&str, Solid); 10] = [
        ("wine glass", glass::wine_glass()),
        ("wine", glass::wine()),
        ("tumbler", glass::tumbler()),
        ("drink", glass::drink()),
        ("ice cube", glass::ice_cube()),
        ("pool", glass::pool(1.2)),
        ("flask", glass::flask()),
        ("lens", glass::lens()),
        ("brilliant", glass::brilliant()),
        ("knot", knot::torus_knot(2.0, 3.0, 1.0)),
    ];
    for (name, solid) in named {
        assert_closed(name, &solid.flat());
    }
}

#[test]
fn brilliant_has_all_of_its_facets() {
    // Table, 8 + 8 + 16 on the crown, 8 + 16 on the pavilion, 32 around the girdle.
    assert_eq!(glass::brilliant().faces.len(), 89);
}

#[test]
fn fractal_is_closed_and_faces_outwards() {
    assert_closed("fractal", &fractal::julia());
}

#[test]
fn triangles_cover_an_outline_with_holes() {
    let outline = Outline::new(circle(DVec2::ZERO, 10.0, 40))
        .with_hole(circle(DVec2::new(4.0, 0.0), 3.0, 17))
        .with_hole(circle(DVec2::new(-4.0, 1.0), 2.5, 9))
        .with_hole(circle(DVec2::new(0.0, -6.0), 1.0, 5));
    let points: Vec<DVec2> = outline.loops().flatten().copied().collect();
    let triangles = triangulate(&outline);
    let area = |[a, b, c]: [u32; 3]| doubled_area(&[a, b, c].map(|i| points[i as usize]));
    let covered: f64 = triangles.iter().map(|&t| area(t)).sum();
    let wanted: f64 = outline.loops().map(|l| doubled_area(l)).sum();
    assert!((covered - wanted).abs() < 1e-9, "{covered} instead of {wanted}");
    assert!(triangles.iter().all(|&t| area(t) >= 0.0), "a triangle is turned over");
    assert_eq!(triangles.len(), points.len() + 2 * outline.holes.len() - 2);
}

#[test]
fn contours_follow_the_field() {
    let field = |p: DVec2| distance::ring(p, DVec2::ZERO, 5.0, 1.0);
    let found = contours(field, DVec2::splat(-7.0), DVec2::splat(7.0), 0.3, 0.002);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].holes.len(), 1);
    let area = 0.5 * found[0].loops().map(|l| doubled_area(l)).sum::<f64>();
    let wanted = std::f64::consts::PI * (36.0 - 16.0);
    assert!((area - wanted).abs() < 0.01 * wanted, "{area} instead of {wanted}");
}

#[test]
fn meshing_wheels_do_not_touch() {
    let (module, first, second, direction, turn) = (0.8, 80, 10, 215.0, 5.0);
    let center = polar(gears::pitch_radius(module, first + second), direction);
    let other_turn = gears::meshing_turn(first, turn, second, direction);
    let place = |teeth: u32, turn: f64, at: DVec2| -> Vec<DVec2> {
        let (sin, cos) = crate::mesh::sin_cos_degrees(turn);
        gears::teeth(module, teeth, 6).iter().map(|p| at + DVec2::new(cos, sin).rotate(*p)).collect()
    };
    let wheel = place(first, turn, DVec2::ZERO);
    let pinion = place(second, other_turn, center);
    assert!(!pinion.iter().any(|&p| crate::outline::contains(&wheel, p)), "leaves within the wheel");
    assert!(!wheel.iter().any(|&p| crate::outline::contains(&pinion, p)), "teeth within the pinion");
    let reach = pinion.iter().map(|p| p.length()).fold(f64::INFINITY, f64::min);
    assert!(reach < gears::pitch_radius(module, first), "the pinion's leaves reach between the teeth");
}

#[test]
fn strips_have_images_and_load_with_every_value() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/fields");
    for strip in fields::strips() {
        assert!(folder.join(format!("{}.png", strip.name)).exists(), "{} has no picture", strip.name);
        for value in strip.values {
            strip.load(&folder, value).unwrap_or_else(|error| panic!("{error}"));
        }
    }
}
