//! Mapping of textures onto shapes.

use super::*;

#[test]
fn planes_map_their_first_corner_to_the_textures_top_left() {
    let text = format!(
        "(settings: (size: (2, 2), {EXACT}), entities: [
            (camera: Orthographic(height_m: 2), transform: (translate: (0, 0, 3))),
            (shape: Plane(corners: ((-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0))),
             material: (kd: 0, emission: Texture(image: \"quarters.png\", filter: Nearest))),
        ])"
    );
    let image = picture(&text);
    let row = |y| [image.at(0, y).to_array(), image.at(1, y).to_array()];
    assert_eq!(row(0), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], "red, green");
    assert_eq!(row(1), [[0.0, 0.0, 1.0], [1.0, 1.0, 1.0]], "blue, white");
}

/// Returns the texture coordinates at the centre of the view from `direction`, which the image encodes as colours.
fn uv_from(direction: [f64; 3], shape: &str) -> [f64; 2] {
    let [x, y, z] = direction.map(|c| 5.0 * c);
    let camera = format!(
        "(camera: Orthographic(height_m: 1e-5), transform: LookAt(from: ({x}, {y}, {z}), to: (0, 0, 0)))"
    );
    let shape = format!("({shape}, material: (kd: 0, emission: Image(\"ramp.hdr\")))");
    let [u, v, _] = pixel("", &[&camera, &shape]);
    [u, v]
}

/// u from −X by +Z around +Y, v from the +Y pole, as the shape's documentation says.
fn sphere_uv([x, y, z]: [f64; 3]) -> [f64; 2] {
    let turn = z.atan2(-x) / (2.0 * PI);
    let length = (x * x + y * y + z * z).sqrt();
    [if turn < 0.0 { turn + 1.0 } else { turn }, (y / length).acos() / PI]
}

#[test]
fn spheres_are_mapped_as_documented() {
    assert_eq!(sphere_uv([0.0, 0.0, 1.0]), [0.25, 0.5]);
    let directions = [
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0],
        [0.6, 0.64, 0.48],
        [-0.48, -0.64, -0.6],
        [-0.48, 0.6, 0.64],
    ];
    for d in directions {
        let expected = sphere_uv(d);
        let found = uv_from(d, "shape: Sphere");
        near(found[0], expected[0], 1e-4);
        near(found[1], expected[1], 1e-4);
        // A quarter turn about Y takes X to −Z, so the point at (x, y, z) was at (−z, y, x).
        let turned = uv_from(d, "shape: Sphere(radius_m: 2), transform: (rotate_degrees: (0, 90, 0))");
        let local = sphere_uv([-d[2], d[1], d[0]]);
        if local[0] > 0.01 && local[0] < 0.99 {
            near(turned[0], local[0], 1e-4);
            near(turned[1], local[1], 1e-4);
        }
        // Stretched along Y: the local point is the world's with y halved, wherever it is hit.
        let ellipsoid = uv_from(d, "shape: Sphere, transform: (scale: (1, 2, 1))");
        let local = sphere_uv([d[0], d[1] / 2.0, d[2]]);
        near(ellipsoid[0], local[0], 1e-4);
        near(ellipsoid[1], local[1], 1e-4);
    }
}

#[test]
fn triangles_are_mapped_by_their_corners() {
    // Seen from +Z at the origin, which is ¼ a + ½ b + ¼ c.
    let shape = "shape: Triangle(vertices: ((-1, -1, 0), (1, 0, 0), (-1, 1, 0)), uvs: ((0.1, 0.2), (0.9, 0.4), (0.3, 0.8)))";
    let [u, v] = uv_from([0.0, 0.0, 1.0], shape);
    near(u, 0.25 * 0.1 + 0.5 * 0.9 + 0.25 * 0.3, 1e-4);
    near(v, 0.25 * 0.2 + 0.5 * 0.4 + 0.25 * 0.8, 1e-4);
    let [u, v] = uv_from([0.0, 0.0, 1.0], "shape: Triangle(vertices: ((-1, -1, 0), (1, 0, 0), (-1, 1, 0)))");
    near(u, 0.5, 1e-4);
    near(v, 0.25, 1e-4);
}
