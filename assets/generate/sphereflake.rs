//! Haines' sphereflake ("A Proposal for Standard Graphics Environments", IEEE CG&A 1987), from its published
//! description: every ball carries nine of a third of its size, six around its equator and three around its far pole.

use std::fmt::Write;

use glam::DVec3;

use crate::mesh::{polar, sin_cos_degrees};

/// The depth of the recursion.
const LEVELS: u32 = 4;

struct Ball {
    center: DVec3,
    radius: f64,
}

fn grow(balls: &mut Vec<Ball>, center: DVec3, radius: f64, axis: DVec3, side: DVec3, levels: u32) {
    balls.push(Ball { center, radius });
    if levels == 0 {
        return;
    }
    let other = axis.cross(side);
    // (count, first azimuth, elevation above the equator towards the far pole)
    for (count, first, elevation) in [(6, 0.0, 0.0), (3, 30.0, 54.735_610_317_245_346)] {
        let (sin, cos) = sin_cos_degrees(elevation);
        for i in 0..count {
            let around = polar(cos, first + 360.0 * f64::from(i) / f64::from(count));
            let direction = side * around.x + other * around.y + axis * sin;
            let tangent = if count == 6 { axis } else { side * around.y - other * around.x };
            let tangent = (tangent - direction * direction.dot(tangent)).normalize();
            grow(
                balls,
                center + direction * (radius * 4.0 / 3.0),
                radius / 3.0,
                direction,
                tangent,
                levels - 1,
            );
        }
    }
}

/// The scene file: 7,381 spheres and a floor.
pub fn scene() -> String {
    let mut balls = Vec::new();
    grow(&mut balls, DVec3::ZERO, 0.5, DVec3::Z, DVec3::X, LEVELS);
    let mut text = String::from(
        "// Haines' sphereflake with 7,381 spheres and a floor: 7,382 primitives, the size factor 4 of his\n\
         // Standard Procedural Databases. Written by `cargo run --release --example generate-assets`.\n\
         (\n    settings: (size: (512, 512), samples: 16, max_depth: 4, ambient: 0.08,\n               \
         background: (0.078, 0.361, 0.753)),\n    materials: {\n        \
         \"ball\": BlinnPhong(diffuse: (0.5, 0.45, 0.35), specular: 0.4, shininess: 60, kr: 0.5),\n        \
         \"floor\": BlinnPhong(diffuse: (1.0, 0.75, 0.33)),\n    },\n    entities: [\n        \
         (name: \"camera\", camera: Pinhole(vertical_fov_degrees: 45),\n         \
         transform: LookAt(from: (2.1, 1.3, 1.7), to: (0, 0, 0), up: (0, 0, 1))),\n",
    );
    for (index, light) in ["(4, 3, 2)", "(1, -4, 4)", "(-3, 1, 5)"].iter().enumerate() {
        let name = index + 1;
        let _ = writeln!(
            text,
            "        (name: \"light {name}\", light: Point(power_w: 6, falloff: Constant), transform: (translate: {light})),"
        );
    }
    text += "        (name: \"floor\", material: \"floor\",\n         \
             shape: Plane(corners: ((-12, -12, -0.5), (12, -12, -0.5), (12, 12, -0.5), (-12, 12, -0.5)))),\n";
    for Ball { center, radius } in balls {
        let [x, y, z] = center.to_array().map(|c| (c + 0.0) as f32 + 0.0);
        let radius = radius as f32;
        let _ = writeln!(
            text,
            "        (shape: Sphere(radius_m: {radius}), transform: (translate: ({x}, {y}, {z})), material: \"ball\"),"
        );
    }
    text + "    ],\n)\n"
}
