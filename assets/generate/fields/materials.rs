//! Strips about materials.

use super::Strip;

/// A floor for the Whitted transport, and a ball whose material comes next.
const WHITTED: &str = r#"(
    settings: (samples: 64, max_depth: 12, ambient: 0.12,
               background: Gradient(bottom: (0.30, 0.32, 0.36), top: (0.45, 0.55, 0.75))),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 20), transform: LookAt(from: (0, 1.9, 3.4), to: (0, 0.46, 0))),
        (light: Point(power_w: 130), transform: (translate: (-1.6, 3.4, 3))),
        (shape: Plane(corners: ((-8, 0, -8), (-8, 0, 8), (8, 0, 8), (8, 0, -8))),
         material: (diffuse: Texture(image: "../../assets/checker.png", scale: 4, filter: Nearest, factor: 0.7))),
        (shape: Sphere(radius_m: 0.5), transform: (translate: (0, 0.5, 0)), material: "#;

/// A hill with colours at its vertices, whose material comes next.
const HILL: &str = r#"(
    settings: (samples: 64, ambient: 0.15, background: Gradient(bottom: (0.30, 0.32, 0.36), top: (0.45, 0.55, 0.75))),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 24), transform: LookAt(from: (0.4, 2.4, 3.6), to: (0, 0.15, 0))),
        (light: Directional(irradiance: 3), transform: LookAt(from: (-3, 2.4, 2), to: (0, 0, 0))),
        (shape: Mesh("hill.ply"), modifiers: [Normals(smooth_degrees: 180)], material: "#;

/// A studio for the path transport. The floor's material comes next.
const STUDIO: &str = r#"(
    settings: (samples: 256, max_depth: 16, transport: Path, clamp: 8, tonemap: PbrNeutral),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 20), transform: LookAt(from: (0, 1.9, 3.4), to: (0, 0.46, 0))),
        (light: Environment(image: "../../assets/studio.png", radiance: 1.5), transform: (rotate_degrees: (0, -60, 0))),
        (light: Area(power_w: 60, size_m: 1.5, visible: true), transform: LookAt(from: (-2, 3, 2), to: (0, 0.5, 0))),
        (shape: Plane(corners: ((-8, 0, -8), (-8, 0, 8), (8, 0, 8), (8, 0, -8))), material: "#;

/// A plain floor and a ball whose material comes next.
const ON_GREY: &str = r#"(diffuse: 0.4)),
        (shape: Sphere(radius_m: 0.5), transform: (translate: (0, 0.5, 0)), material: "#;

/// A floor with squares and a ball whose material comes next.
const ON_SQUARES: &str = r#"(diffuse: Texture(image: "../../assets/checker.png", scale: 4, filter: Nearest, factor: 0.7))),
        (shape: Sphere(radius_m: 0.5), transform: (translate: (0, 0.5, 0)), material: "#;

/// The end of a scene, after the ball's material.
const END: &str = r#"),
    ],
)"#;

/// A square whose texture comes next.
const POSTER: &str = r#"(
    settings: (samples: 16, ambient: 1),
    entities: [
        (camera: Orthographic(height_m: 0.98), transform: LookAt(from: (0, 0, 1), to: (0, 0, 0))),
        (shape: Plane(corners: ((-0.5, 0.5, 0), (0.5, 0.5, 0), (0.5, -0.5, 0), (-0.5, -0.5, 0))),
         material: (diffuse: "#;

pub const STRIPS: &[Strip] = &[
    Strip {
        name: "procedural_textures",
        scene: &[STUDIO, ON_GREY, "Principled(metallic: 0, VALUE)", END],
        values: &[
            "roughness: 0.3, base_color: Checker(scale: (16, 8), a: 0.7, b: \"#304a78\")",
            "roughness: 0.8, base_color: Bricks(scale: (24, 14))",
            "roughness: 0.2, base_color: Marble(scale: 3, rotate_degrees: (0, 20, 30))",
            "roughness: 0.4, base_color: Wood(scale: 12, rotate_degrees: (70, 0, 10))",
            "roughness: 0.5, base_color: Noise(scale: 4, octaves: 8, stops: [(0.5, \"#204a90\"), (0.52, \"#c8b070\"), (0.55, \"#3c6a2c\"), (0.7, \"#f0f0f0\")])",
            "roughness: 0.4, base_color: Voronoi(kind: Edges, scale: 7, stops: [(0.05, \"#101010\"), (0.1, \"#b03020\")])",
            "roughness: 0.3, base_color: (0.8, 0.35, 0.1), bump: (texture: Noise(scale: 8, kind: Ridged), height_m: 0.04)",
        ],
        zoom: 1,
    },
    Strip {
        name: "vertex_colors",
        scene: &[HILL, "(VALUE)", END],
        values: &[
            "diffuse: 0.9",
            "diffuse: Vertex(channel: Red)",
            "diffuse: Vertex(channel: Green)",
            "diffuse: Mix(a: \"#40561f\", b: \"#d8d4cc\", by: Vertex(channel: Red))",
            "diffuse: Mix(a: Curve(of: Vertex(channel: Red), stops: [(0.3, \"#40561f\"), (0.4, \"#6a5a48\"), (0.8, \"#8c8278\"), (0.85, \"#f4f6fa\")]), b: \"#2a3c48\", by: Vertex(channel: Green))",
        ],
        zoom: 1,
    },
    Strip {
        name: "blinn_phong",
        scene: &[WHITTED, "(VALUE)", END],
        values: &[
            "diffuse: (0.7, 0.1, 0.08)",
            "diffuse: (0.7, 0.1, 0.08), specular: 0.7, shininess: 8",
            "diffuse: (0.7, 0.1, 0.08), specular: 0.7, shininess: 32",
            "diffuse: (0.7, 0.1, 0.08), specular: 0.7, shininess: 200",
            "diffuse: (0.7, 0.1, 0.08), specular: 0.7, shininess: 32, highlight: Phong",
            "diffuse: 0.1, emission: (0.9, 0.5, 0.1)",
        ],
        zoom: 1,
    },
    Strip {
        name: "mirror_and_glass",
        scene: &[WHITTED, "(VALUE)", END],
        values: &[
            "diffuse: (0.7, 0.1, 0.08), kr: 0.3",
            "diffuse: 0, kr: (0.95, 0.75, 0.4)",
            "ior: 1.1",
            "ior: 1.33",
            "ior: 1.5, specular: 0.7, shininess: 200",
            "ior: 1.5, kt: (0.3, 0.85, 0.45)",
        ],
        zoom: 1,
    },
    Strip {
        name: "metallic_and_roughness",
        scene: &[STUDIO, ON_SQUARES, "Principled(VALUE)", END],
        values: &[
            "base_color: (0.03, 0.2, 0.5), metallic: 0, roughness: 0",
            "base_color: (0.03, 0.2, 0.5), metallic: 0, roughness: 0.3",
            "base_color: (0.03, 0.2, 0.5), metallic: 0, roughness: 0.6",
            "base_color: (0.03, 0.2, 0.5), metallic: 0, roughness: 1",
            "base_color: (1, 0.77, 0.34), metallic: 1, roughness: 0",
            "base_color: (1, 0.77, 0.34), metallic: 1, roughness: 0.3",
            "base_color: (1, 0.77, 0.34), metallic: 1, roughness: 0.6",
            "base_color: (1, 0.77, 0.34), metallic: 1, roughness: 1",
        ],
        zoom: 1,
    },
    Strip {
        name: "metals",
        scene: &[STUDIO, ON_SQUARES, "Metal(name: \"VALUE\", roughness: 0.15)", END],
        values: &[
            "aluminium", "brass", "chromium", "copper", "gold", "iron", "nickel", "silver", "steel",
            "titanium",
        ],
        zoom: 1,
    },
    Strip {
        name: "transmission",
        scene: &[STUDIO, ON_SQUARES, "Principled(metallic: 0, VALUE)", END],
        values: &[
            "roughness: 0, transmission: 1",
            "roughness: 0, transmission: 1, volume: ()",
            "roughness: 0.25, transmission: 1, volume: ()",
            "roughness: 0, transmission: 1, volume: (attenuation_color: (0.2, 0.7, 0.5), attenuation_distance_m: 2)",
            "roughness: 0, transmission: 1, volume: (attenuation_color: (0.2, 0.7, 0.5), attenuation_distance_m: 0.5)",
            "roughness: 0, transmission: 1, volume: (), dispersion: 5",
        ],
        zoom: 1,
    },
    Strip {
        name: "scattering",
        scene: &[
            r#"(
    settings: (samples: 1024, max_depth: 16, transport: Path, clamp: 2, tonemap: PbrNeutral),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 20), transform: LookAt(from: (0, 1.9, 3.4), to: (0, 0.46, 0))),
        (light: Environment(radiance: 0.1)),
        (light: Area(power_w: 300, size_m: 3, visible: true), transform: LookAt(from: (-1.5, 3, -2.5), to: (0, 0.5, 0))),
        (shape: Plane(corners: ((-8, 0, -8), (-8, 0, 8), (8, 0, 8), (8, 0, -8))), material: (diffuse: 0.4)),
        (shape: Sphere(radius_m: 0.5), transform: (translate: (0, 0.5, 0)),
         material: Principled(metallic: 0, roughness: 0.3, "#,
            "VALUE)",
            END,
        ],
        values: &[
            "base_color: (0.9, 0.7, 0.4)",
            "diffuse_transmission: 0.5, diffuse_transmission_color: (0.9, 0.7, 0.4)",
            "diffuse_transmission: 1, diffuse_transmission_color: (0.9, 0.7, 0.4)",
            "transmission: 1, volume: (attenuation_color: (0.55, 0.4, 0.25), attenuation_distance_m: 0.5)",
            "transmission: 1, volume: (attenuation_color: (0.55, 0.4, 0.25), attenuation_distance_m: 0.5, multiscatter_color: (0.9, 0.7, 0.4))",
            "diffuse_transmission: 1, volume: (attenuation_color: (0.55, 0.4, 0.25), attenuation_distance_m: 0.05, multiscatter_color: (0.9, 0.7, 0.4))",
            "diffuse_transmission: 1, volume: (attenuation_color: (0.55, 0.4, 0.25), attenuation_distance_m: 0.05, multiscatter_color: (0.9, 0.7, 0.4), scatter_anisotropy: 0.9)",
        ],
        zoom: 1,
    },
    Strip {
        name: "clearcoat_and_sheen",
        scene: &[STUDIO, ON_GREY, "Principled(metallic: 0, VALUE)", END],
        values: &[
            "base_color: (0.5, 0.02, 0.03), roughness: 0.3, specular: 0",
            "base_color: (0.5, 0.02, 0.03), roughness: 0.3",
            "base_color: (0.5, 0.02, 0.03), roughness: 0.3, specular_color: (1, 0.6, 0)",
            "base_color: (0.5, 0.02, 0.03), roughness: 0.3, clearcoat: 1",
            "base_color: (0.5, 0.02, 0.03), roughness: 0.3, clearcoat: 1, clearcoat_roughness: 0.15",
            "base_color: (0.02, 0.03, 0.15)",
            "base_color: (0.02, 0.03, 0.15), sheen_color: (0.6, 0.7, 1), sheen_roughness: 0.25",
            "base_color: (0.02, 0.03, 0.15), sheen_color: (0.6, 0.7, 1), sheen_roughness: 0.6",
        ],
        zoom: 1,
    },
    Strip {
        name: "anisotropy_and_iridescence",
        scene: &[STUDIO, ON_GREY, "Principled(VALUE)", END],
        values: &[
            "base_color: 0.8, roughness: 0.3",
            "base_color: 0.8, roughness: 0.3, anisotropy: (strength: 0.9)",
            "base_color: 0.8, roughness: 0.3, anisotropy: (strength: 0.9, rotation_degrees: 90)",
            "base_color: 0.8, roughness: 0.15, iridescence: (factor: 1, ior: 1.8, thickness_maximum_nm: 150)",
            "base_color: 0.8, roughness: 0.15, iridescence: (factor: 1, ior: 1.8, thickness_maximum_nm: 220)",
            "base_color: 0.8, roughness: 0.15, iridescence: (factor: 1, ior: 1.8, thickness_maximum_nm: 320)",
            "base_color: (0.2, 0.5, 0.3), unlit: true",
        ],
        zoom: 1,
    },
    Strip {
        name: "alpha_and_relief",
        scene: &[
            STUDIO,
            ON_GREY,
            "Principled(base_color: (0.9, 0.35, 0.15), metallic: 0, roughness: 0.4, VALUE)",
            END,
        ],
        values: &[
            "alpha: 0.5, alpha_mode: Blend",
            r#"alpha: Image("../../assets/checker.png", Red), alpha_mode: Mask(cutoff: 0.5)"#,
            r#"alpha: Image("../../assets/checker.png", Red), alpha_mode: Mask(cutoff: 0.5), double_sided: true"#,
            r#"normal: Texture(image: "studs.png", scale: (8, 4))"#,
            r#"normal: (texture: Texture(image: "studs.png", scale: (8, 4)), scale: 0.3)"#,
            r#"bump: (texture: Texture(image: "../../assets/checker.png", scale: (2, 1)), height_m: 0.02)"#,
        ],
        zoom: 1,
    },
    Strip {
        name: "texture_placement",
        scene: &[POSTER, r#"Texture(image: "../../assets/dial.png", VALUE)"#, ")", END],
        values: &[
            "scale: 1", "scale: 0.5", "scale: 2", "scale: 2, wrap: Mirror", "scale: 2, wrap: Clamp",
            "offset: (0.25, 0)", "rotation_degrees: 30", "factor: (1, 0.6, 0.3)",
        ],
        zoom: 1,
    },
    Strip {
        name: "texture_filter",
        scene: &[r#"(
    settings: (samples: 1, ambient: 1, background: (0.4, 0.55, 0.8)),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 0.5, 1), to: (0, 0.2, 0))),
        (shape: Plane(corners: ((-40, 0, -79), (40, 0, -79), (40, 0, 1), (-40, 0, 1))),
         material: (diffuse: Texture(VALUE))),
    ],
)"#],
        values: &[
            r#"image: "../../assets/julia.png", scale: 2, offset: (-0.56, -1.57), filter: Nearest"#,
            r#"image: "../../assets/julia.png", scale: 2, offset: (-0.56, -1.57), filter: Bilinear"#,
            r#"image: "../../assets/checker.png", scale: 40, filter: Nearest"#,
            r#"image: "../../assets/checker.png", scale: 40, filter: Bilinear"#,
            r#"image: "../../assets/checker.png", scale: 40, filter: Trilinear"#,
        ],
        zoom: 1,
    },
];
