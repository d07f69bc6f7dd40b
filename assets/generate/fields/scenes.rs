//! Strips about everything except materials.

use super::Strip;

/// A floor and a wall, for the Whitted transport.
const ROOM: &str = r#"(
    settings: (samples: 64, ambient: 0.08),
    materials: {
        "orange": (diffuse: (0.8, 0.35, 0.1), specular: 0.5, shininess: 60),
    },
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 24), transform: LookAt(from: (0, 1.6, 4.2), to: (0, 0.6, 0))),
        (shape: Plane(corners: ((-4, 0, -1), (-4, 0, 4), (4, 0, 4), (4, 0, -1))), material: (diffuse: 0.5)),
        (shape: Plane(corners: ((-4, 4, -1), (4, 4, -1), (4, 0, -1), (-4, 0, -1))), material: (diffuse: 0.6)),
"#;

/// Balls in rows and small emitters behind them; the camera comes next.
const ROWS: &str = r#"(
    settings: (samples: 256, ambient: 0.2, background: (0.03, 0.04, 0.08)),
    materials: {
        "bulb": (diffuse: 0, emission: (9, 6, 2)),
    },
    entities: [
        (light: Point(power_w: 180), transform: (translate: (-2, 3.5, 2.5))),
        (shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))),
         material: (diffuse: Texture(image: "../../assets/checker.png", scale: 4.5, factor: 0.6))),
        (shape: Sphere(radius_m: 0.25), transform: (translate: (-0.35, 0.25, 1)), material: (diffuse: (0.7, 0.1, 0.1))),
        (shape: Sphere(radius_m: 0.25), transform: (translate: (0, 0.25, 0)), material: (diffuse: (0.1, 0.5, 0.15))),
        (shape: Sphere(radius_m: 0.25), transform: (translate: (0.35, 0.25, -1)), material: (diffuse: (0.1, 0.25, 0.7))),
        (shape: Sphere(radius_m: 0.03), material: "bulb", transform: (translate: (-1.2, 0.9, -3))),
        (shape: Sphere(radius_m: 0.03), material: "bulb", transform: (translate: (-0.5, 1.1, -3))),
        (shape: Sphere(radius_m: 0.03), material: "bulb", transform: (translate: (0.2, 0.95, -3))),
        (shape: Sphere(radius_m: 0.03), material: "bulb", transform: (translate: (0.9, 1.15, -3))),
        (shape: Sphere(radius_m: 0.03), material: "bulb", transform: (translate: (1.5, 0.95, -3))),
        "#;

/// A box with coloured walls.
const BOX: &str = r#"),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 39), transform: LookAt(from: (0, 1, 3.9), to: (0, 1, 0))),
        (light: Area(power_w: (26, 22, 15), size_m: 1, visible: true), transform: LookAt(from: (0, 1.99, 0), to: (0, 0, 0))),
        (shape: Plane(corners: ((-1, 0, -1), (-1, 0, 1), (1, 0, 1), (1, 0, -1))), material: (diffuse: 0.7)),
        (shape: Plane(corners: ((-1, 2, -1), (1, 2, -1), (1, 2, 1), (-1, 2, 1))), material: (diffuse: 0.7)),
        (shape: Plane(corners: ((-1, 0, -1), (1, 0, -1), (1, 2, -1), (-1, 2, -1))), material: (diffuse: 0.7)),
        (shape: Plane(corners: ((-1, 0, -1), (-1, 2, -1), (-1, 2, 1), (-1, 0, 1))), material: (diffuse: (0.65, 0.05, 0.05))),
        (shape: Plane(corners: ((1, 0, -1), (1, 0, 1), (1, 2, 1), (1, 2, -1))), material: (diffuse: (0.1, 0.45, 0.12))),
        (shape: Sphere(radius_m: 0.4), transform: (translate: (-0.4, 0.4, -0.3)), material: (diffuse: 0.05, kr: 0.9)),
        (shape: Sphere(radius_m: 0.35), transform: (translate: (0.45, 0.35, 0.3)), material: (ior: 1.5)),
    ],
)"#;

/// A floor and objects that cast shadows on it.
const YARD: &str = r#"(
    settings: (samples: 128, transport: Path),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 30), transform: LookAt(from: (0, 1.9, 4), to: (-0.1, 0.55, 0))),
        (shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9)))),
        (shape: Sphere(radius_m: 0.35), transform: (translate: (-0.5, 0.35, -0.3)), material: (diffuse: (0.8, 0.35, 0.1))),
        (shape: Sphere(radius_m: 0.5), transform: (translate: (0.4, 0.45, 0.1), scale: (0.12, 0.9, 0.12)),
         material: (diffuse: (0.15, 0.35, 0.7))),
        (light: Environment(radiance: 0.15)),
        "#;

const END: &str = r#"
    ],
)"#;

pub const STRIPS: &[Strip] = &[
    Strip {
        name: "transforms",
        scene: &[
            r#"(
    settings: (samples: 64, ambient: 0.15, background: (0.25, 0.32, 0.4)),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 21), transform: LookAt(from: (0.35, 0.62, 1.3), to: (0.03, 0.2, 0))),
        (light: Point(power_w: 24), transform: (translate: (-0.4, 1.3, 1))),
        (shape: Plane(corners: ((-1.6, 0, -1.6), (-1.6, 0, 1.6), (1.6, 0, 1.6), (1.6, 0, -1.6))),
         material: (diffuse: Texture(image: "../../assets/checker.png", scale: 2, factor: 0.6))),
        (shape: Mesh("../../assets/cabinet.ply"), transform: (VALUE),
         material: (diffuse: Texture(image: "../../assets/cabinet.png", wrap: Clamp), specular: 0.25, shininess: 30)),"#,
            END,
        ],
        values: &[
            "", "translate: (0.15, 0, 0)", "rotate_degrees: (0, 60, 0)", "rotate_degrees: (0, 0, -30)",
            "scale: 0.5", "scale: (2, 0.6, 1)", "scale: (-1, 1, 1)",
        ],
        zoom: 1,
    },
    Strip {
        name: "shapes",
        scene: &[
            ROOM,
            r#"        (light: Point(power_w: 200), transform: (translate: (-2, 3, 3))),
        (material: "orange", VALUE),"#,
            END,
        ],
        values: &[
            "shape: Sphere(radius_m: 0.6), transform: (translate: (0, 0.6, 0))",
            "shape: Sphere(radius_m: 0.6), transform: (translate: (0, 0.36, 0), scale: (1.2, 0.6, 0.8))",
            "shape: Triangle(vertices: ((-0.7, 0.05, 0.2), (0.7, 0.05, 0.2), (0, 1.25, -0.2)))",
            "shape: Triangle(vertices: ((-0.7, 0.05, 0.2), (0.7, 0.05, 0.2), (0, 1.25, -0.2)), normals: ((-1, 0, 0.7), (1, 0, 0.7), (0, 1, 0.7)))",
            "shape: Plane(corners: ((-0.7, 1.2, -0.3), (0.5, 1.3, -0.3), (0.8, 0, 0.4), (-0.4, -0.1, 0.4)))",
            r#"shape: Mesh("../../assets/knot.ply"), transform: (translate: (0, 0.62, 0), scale: 0.38)"#,
            r#"shape: Mesh("../../assets/brilliant.ply"), transform: (translate: (0, 0.62, 0), scale: 0.65)"#,
        ],
        zoom: 1,
    },
    Strip {
        name: "lights",
        scene: &[
            ROOM,
            r#"        (shape: Sphere(radius_m: 0.25), transform: (translate: (0.15, 0.25, -0.35)), material: "orange"),
        (light: VALUE, transform: LookAt(from: (-0.45, 1.5, 0.2), to: (0.05, 0.35, -0.7))),"#,
            END,
        ],
        values: &[
            "Point(power_w: 20)",
            "Point(power_w: 8, falloff: Constant)",
            "Spot(power_w: 20)",
            "Spot(power_w: 20, inner_degrees: 20, outer_degrees: 20)",
            "Spot(power_w: 20, inner_degrees: 0, outer_degrees: 30)",
            r#"Photometric(power_w: 3, profile: "lamp.ies")"#,
            r#"Photometric(power_w: 10, profile: "../../assets/checker.png")"#,
        ],
        zoom: 1,
    },
    Strip {
        name: "soft_shadows",
        scene: &[
            YARD,
            r#"(light: VALUE, transform: LookAt(from: (0.75, 1.3, -1.6), to: (-0.2, 0.2, 0))),"#,
            END,
        ],
        values: &[
            "Directional(irradiance: 3)",
            "Directional(irradiance: 3, angle_degrees: 5)",
            "Directional(irradiance: 3, angle_degrees: 30)",
            "Area(power_w: 35, size_m: 0.1, visible: true)",
            "Area(power_w: 35, size_m: 0.9, visible: true)",
            "Area(power_w: 35, size_m: (0.05, 1.2), visible: true)",
            "Area(power_w: 35, size_m: 0.9, outline: Disc, visible: true)",
        ],
        zoom: 1,
    },
    Strip {
        name: "surroundings",
        scene: &[
            r#"(
    settings: (samples: 512, transport: Path, tonemap: PbrNeutral, exposure: Auto, exposure_ev: 0.7, clamp: 4),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 60), transform: LookAt(from: (0, 0.5, 1.9), to: (0, 0.65, 0))),
        (shape: Plane(corners: ((-99, 0, -99), (-99, 0, 99), (99, 0, 99), (99, 0, -99))), material: (diffuse: 0.4)),
        (shape: Sphere(radius_m: 0.4), transform: (translate: (-0.45, 0.4, 0)), material: (diffuse: 0.8)),
        (shape: Sphere(radius_m: 0.4), transform: (translate: (0.45, 0.4, 0)), material: (diffuse: 0, kr: 0.9)),
        (light: VALUE),"#,
            END,
        ],
        values: &[
            "Environment(radiance: (0.5, 0.6, 0.8))",
            r#"Environment(image: "../../assets/studio.png")"#,
            "Sky(azimuth_degrees: 310, elevation_degrees: 60)",
            "Sky(azimuth_degrees: 310, elevation_degrees: 20)",
            "Sky(azimuth_degrees: 310, elevation_degrees: 4)",
            "Sky(azimuth_degrees: 310, elevation_degrees: 60, haze: 5)",
            "Sky(azimuth_degrees: 310, elevation_degrees: 20, haze: 5)",
            "Sky(azimuth_degrees: 310, elevation_degrees: 4, haze: 5)",
        ],
        zoom: 1,
    },
    Strip {
        name: "cameras",
        scene: &[ROWS, "(camera: VALUE, transform: LookAt(from: (0, 0.9, 3), to: (0, 0.4, 0))),", END],
        values: &[
            "Pinhole(vertical_fov_degrees: 20)",
            "Pinhole(vertical_fov_degrees: 45)",
            "Pinhole(vertical_fov_degrees: 90)",
            "Orthographic(height_m: 2)",
            "ThinLens(vertical_fov_degrees: 35, focus_distance_m: 3, lens_radius_m: 0.03)",
            "ThinLens(vertical_fov_degrees: 35, focus_distance_m: 3, lens_radius_m: 0.12)",
            r#"ThinLens(vertical_fov_degrees: 35, focus_distance_m: 3, lens_radius_m: 0.12, aperture: "star.png")"#,
        ],
        zoom: 1,
    },
    Strip {
        name: "more_cameras",
        scene: &[ROWS, "(VALUE, transform: LookAt(from: (0, 0.7, 1.9), to: (0, 0.5, 0))),", END],
        values: &[
            "camera: Photographic(focal_length_mm: 24, shift: (0, 0.3))",
            "camera: Panorama(horizontal_degrees: 180)",
            "camera: Fisheye()",
            "camera: Fisheye(mapping: Equisolid)",
            "camera: Fisheye(mapping: Stereographic)",
            "camera: Fisheye(mapping: Orthographic)",
            "camera: Fisheye(circular: false)",
            "camera: Pinhole(vertical_fov_degrees: 60), stereo: ()",
        ],
        zoom: 1,
    },
    Strip {
        name: "tilted_lens",
        scene: &[
            ROWS,
            "(camera: Photographic(f_stop: 0.3, VALUE), transform: LookAt(from: (0, 0.7, 2.6), to: (0, 0.35, 0))),",
            END,
        ],
        values: &[
            "focus_distance_m: 2.6",
            "focus_distance_m: 5.2, tilt_degrees: (0, 4.1)",
            "focus_distance_m: 2.6, tilt_degrees: (12, 0)",
            "focus_distance_m: 2.6, tilt_degrees: (0, -12)",
        ],
        zoom: 1,
    },
    Strip {
        name: "samples",
        scene: &["(settings: (transport: Path, sharing: Off, filter: Box, VALUE", BOX],
        values: &["samples: 1", "samples: 4", "samples: 16", "samples: 64", "samples: 256", "samples: 1024"],
        zoom: 2,
    },
    Strip {
        name: "depth_and_transport",
        scene: &["(settings: (samples: 512, VALUE", BOX],
        values: &[
            "transport: Path, max_depth: 0",
            "transport: Path, max_depth: 1",
            "transport: Path, max_depth: 2",
            "transport: Path, max_depth: 16",
            "transport: Path, max_depth: 16, diffuse_depth: 0",
            "transport: Whitted, max_depth: 16",
        ],
        zoom: 1,
    },
    Strip {
        name: "exposure_and_background",
        scene: &[
            "(settings: (samples: 64, VALUE",
            r#"),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 24), transform: LookAt(from: (0, 1, 4), to: (0, 0.6, 0))),
        (light: Point(power_w: 130), transform: (translate: (-1.6, 2.4, 2.2))),
        (shape: Plane(corners: ((-9, 0, -5), (-9, 0, 4), (9, 0, 4), (9, 0, -5))), material: (diffuse: 0.5)),
        (shape: Sphere(radius_m: 0.5), transform: (translate: (0, 0.5, 0)), material: (diffuse: (0.6, 0.2, 0.1), kr: 0.15)),
    ],
)"#,
        ],
        values: &[
            "background: (0.3, 0.4, 0.6), exposure_ev: -2",
            "background: (0.3, 0.4, 0.6), exposure_ev: 0",
            "background: (0.3, 0.4, 0.6), exposure_ev: 2",
            "",
            "background: Gradient(bottom: (0.9, 0.6, 0.4), top: (0.1, 0.25, 0.6))",
            "ambient: 0.2",
            "ambient: 0.6",
        ],
        zoom: 1,
    },
    Strip {
        name: "modifiers",
        scene: &[
            r#"(
    settings: (samples: 64, transport: Path),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 26), transform: LookAt(from: (1.6, 2, 3.6), to: (0, 0.48, 0))),
        (light: Environment(radiance: 0.5)),
        (light: Area(power_w: 120, size_m: 1), transform: LookAt(from: (-3, 4, 2), to: (0, 0, 0))),
        (shape: Grid(size_m: 20, columns: 1, rows: 1), material: (diffuse: 0.5)),
        (shape: VALUE, material: (diffuse: (0.75, 0.35, 0.15)), transform: (translate: (0, 0.5, 0))),"#,
            END,
        ],
        values: &[
            "Box(size_m: 1)",
            "Box(size_m: 1), modifiers: [Subdivide(levels: 1)]",
            "Box(size_m: 1), modifiers: [Subdivide(levels: 4)]",
            "Box(size_m: 1), modifiers: [Subdivide(levels: 4, scheme: CatmullClark)]",
            "Cylinder(radius_m: 0.5, height_m: 1, segments: 8), modifiers: [Subdivide(levels: 4, crease_degrees: 60)]",
            "Sphere(radius_m: 0.5), modifiers: [Displace(texture: Noise(scale: 6), height_m: 0.25)]",
            "Box(size_m: 1), modifiers: [Subdivide(levels: 6, smooth: false), Displace(texture: Bricks(space: Object, scale: 5), height_m: 0.03)]",
            "Torus(radius_m: 0.5, tube_radius_m: 0.25, segments: 16), modifiers: [Normals(smooth_degrees: 0)]",
        ],
        zoom: 1,
    },
    Strip {
        name: "copies",
        scene: &[
            r#"(
    settings: (samples: 64, transport: Path),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 28), transform: LookAt(from: (1.2, 2.4, 4.2), to: (0, 0.3, 0))),
        (light: Environment(radiance: 0.5)),
        (light: Area(power_w: 160, size_m: 1), transform: LookAt(from: (-3, 5, 2), to: (0, 0, 0))),
        (shape: Grid(size_m: 20, columns: 1, rows: 1), material: (diffuse: 0.5)),
        (name: "hill", shape: Sphere(radius_m: 0.9), transform: (scale: (1, 0.6, 1)), material: (diffuse: (0.3, 0.4, 0.2))),
        (shape: Cone(radius_m: 0.06, height_m: 0.3), material: (diffuse: (0.8, 0.45, 0.12)), VALUE),"#,
            END,
        ],
        values: &[
            "array: (count: 9, step: (translate: (0.2, 0, 0))), transform: (translate: (-0.8, 0.15, 1.05))",
            "array: [(count: 6, step: (translate: (0.3, 0, 0))), (count: 3, step: (translate: (0, 0, 0.25)))], transform: (translate: (-0.75, 0.15, 0.9))",
            "array: (count: 24, step: (rotate_degrees: (0, 15, 0))), transform: (translate: (1.15, 0.15, 0))",
            r#"scatter: (on: "hill", count: 150), transform: (translate: (0, 0.14, 0))"#,
            r#"scatter: (on: "hill", count: 150, align: 0), transform: (translate: (0, 0.14, 0))"#,
            r#"scatter: (on: "hill", count: 150, scale: (0.3, 1.6), seed: 2), transform: (translate: (0, 0.14, 0))"#,
        ],
        zoom: 1,
    },
    Strip {
        name: "tone_curves",
        scene: &[
            r#"(
    settings: (samples: 64, ambient: 0.1, tonemap: VALUE),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 24), transform: LookAt(from: (0, 1.6, 4.2), to: (0, 0.6, 0))),
        (light: Point(power_w: 300), transform: (translate: (-1.2, 2.2, 1))),
        (shape: Plane(corners: ((-4, 0, -1), (-4, 0, 4), (4, 0, 4), (4, 0, -1))), material: (diffuse: 0.5)),
        (shape: Plane(corners: ((-4, 4, -1), (4, 4, -1), (4, 0, -1), (-4, 0, -1))), material: (diffuse: (0.3, 0.5, 0.7))),
        (shape: Sphere(radius_m: 0.4), transform: (translate: (-0.45, 0.4, 0)), material: (diffuse: (0.9, 0.05, 0.02), specular: 1, shininess: 60)),
        (shape: Sphere(radius_m: 0.4), transform: (translate: (0.45, 0.4, 0)), material: (diffuse: (0.05, 0.1, 0.9), specular: 1, shininess: 60)),"#,
            END,
        ],
        values: &["Clamp", "ScaleByMaximum", "Reinhard", "Aces", "Agx", "PbrNeutral"],
        zoom: 1,
    },
    Strip {
        name: "filters",
        scene: &[
            r#"(
    settings: (ambient: 1, VALUE),
    entities: [
        (camera: Orthographic(height_m: 1), transform: LookAt(from: (0, 0, 1), to: (0, 0, 0))),
        (shape: Plane(corners: ((-1, 0.6, 0), (1, 1, 0), (1.4, -1, 0), (-0.6, -1.4, 0))),
         material: (diffuse: Texture(image: "../../assets/checker.png", scale: 0.7, filter: Nearest))),"#,
            END,
        ],
        values: &[
            "samples: 256, filter: Box",
            "samples: 256, filter: Tent()",
            "samples: 256, filter: Gaussian()",
            "samples: 256, filter: BlackmanHarris()",
            "samples: 4, filter: Box, pixel_pattern: Uniform",
            "samples: 4, filter: Box, pixel_pattern: Jittered",
            "samples: 4, filter: Box, pixel_pattern: Regular",
            "samples: 4, filter: Box, pixel_pattern: Center",
        ],
        zoom: 5,
    },
];
