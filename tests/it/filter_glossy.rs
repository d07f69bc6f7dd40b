//! `filter_glossy`: after a diffuse bounce, mirror lobes are as rough as if the materials were.

use rayfront::render::Options;

use crate::support::{film, picture, world};

const MIRROR: &str = "base_color: 0.9, roughness: ROUGH";
const GLASS: &str = "base_color: 1, metallic: 0, transmission: 1, roughness: ROUGH, ior: 1.5, volume: ()";
const LACQUER: &str = "base_color: 0.2, metallic: 0, specular: 0, clearcoat: 1, clearcoat_roughness: ROUGH";

/// A camera that sees only a matte floor, with a ball of a material above it.
fn scene(settings: &str, material: &str, roughness: f32) -> String {
    let material = material.replace("ROUGH", &roughness.to_string());
    format!(
        "(settings: (size: (24, 16), max_depth: 6, transport: Path, caustics: Off, sharing: Off, {settings}),
          entities: [
            (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 0), to: (0, 0, 0.01))),
            (shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))),
             material: Principled(base_color: 0.7, metallic: 0, specular: 0)),
            (shape: Sphere(radius_m: 0.5), transform: (translate: (-0.8, 1.8, 0)),
             material: Principled({material})),
            (light: Area(power_w: 40, size_m: (0.1, 0.1), visible: true),
             transform: LookAt(from: (0, 4, 0), to: (0, 0, 0.01))),
        ])"
    )
}

#[test]
fn what_a_floor_sees_is_as_rough_as_if_it_were_made_so() {
    for material in [MIRROR, GLASS, LACQUER] {
        let of = |settings: &str, roughness: f32| {
            film(&world(&scene(settings, material, roughness)), Options::default())
        };
        let (filtered, rough) = (of("filter_glossy: 0.4", 0.0), of("", 0.4));
        assert!(filtered == rough, "{material}");
        assert!(filtered != of("", 0.0), "{material}");
        assert!(rough == of("filter_glossy: 0.2", 0.4), "{material}: what is rougher stays as it is");
    }
}

/// In the mirror that it looks into, a camera sees a sharp lamp.
#[test]
fn what_the_camera_sees_stays_sharp() {
    let text = |settings: &str| {
        format!(
            "(settings: (size: (16, 16), samples: 4, transport: Path, caustics: Off, {settings}), entities: [
                (camera: Pinhole(vertical_fov_degrees: 60), transform: LookAt(from: (0, 2, 3), to: (0, 0, 0))),
                (shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))),
                 material: Principled(base_color: 0.9, roughness: 0)),
                (light: Area(power_w: 40, size_m: (1, 1), visible: true),
                 transform: LookAt(from: (0, 2, -3), to: (0, 0, 0)))])"
        )
    };
    let all = Options::default();
    assert!(film(&world(&text("filter_glossy: 1")), all) == film(&world(&text("")), all));
}

/// Rays to lamps go straight through a thin pane: so do paths after a diffuse bounce, and nothing counts twice.
#[test]
fn thin_panes_stay_clear() {
    let mean = |filter: f32| {
        let thin = GLASS.replace(", volume: ()", "");
        let text = scene(&format!("samples: 256, filter_glossy: {filter}"), &thin, 0.0);
        let pane = "shape: Plane(corners: ((-9, 1, -9), (-9, 1, 9), (9, 1, 9), (9, 1, -9)))";
        crate::support::mean(&picture(&text.replace("shape: Sphere(radius_m: 0.5)", pane)))
    };
    let (clear, filtered) = (mean(0.0), mean(0.5));
    assert!(clear > 0.01 && (filtered / clear - 1.0).abs() < 1e-3, "{filtered} instead of {clear}");
}
