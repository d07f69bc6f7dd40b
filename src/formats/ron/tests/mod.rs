//! Tests with whole scenes: reading, errors, and writing and reading back.

mod errors;
mod keys;
mod models;
mod parts;
mod principled;
mod reading;
mod robust;
mod shapes;
mod solids;
mod writing;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{Diagnostic, LoadError};
use crate::formats::{AssetFiles, LoadOptions, gltf};
use crate::math::{Rgb, Vec3};
use crate::world::{Assets, DecodedImage, Image, Mesh, Texels, World};

/// Asset files that need no disk: every file exists, except those with "missing" in their path.
#[derive(Default)]
pub(in crate::formats::ron) struct Fake {
    loaded: Vec<PathBuf>,
}

impl AssetFiles for Fake {
    fn mesh(
        &mut self,
        path: &Path,
        _: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Arc<Mesh>, LoadError> {
        self.loaded.push(path.to_owned());
        if path.to_string_lossy().contains("missing") {
            return Err(LoadError::invalid(path, "there is no such file"));
        }
        warnings.push(Diagnostic::in_file("made-up", path, "was made up"));
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let source = Some(path.to_owned());
        Ok(Arc::new(Mesh { positions, source, triangles: vec![[0, 1, 2]], ..Mesh::default() }))
    }

    fn model(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<gltf::GltfModel, LoadError> {
        self.loaded.push(path.to_owned());
        let missing = path.to_string_lossy().contains("missing");
        let bytes = if missing { "{}" } else { MODEL };
        gltf::parse(bytes.as_bytes(), path, &LoadOptions::default(), assets, warnings)
    }

    fn image(&mut self, path: &Path) -> Result<DecodedImage, LoadError> {
        self.loaded.push(path.to_owned());
        if path.to_string_lossy().contains("missing") {
            return Err(LoadError::invalid(path, "there is no such file"));
        }
        let (source, texels) = (Some(path.to_owned()), Texels::Rgba8(vec![[0; 4]]));
        Ok(Image { source, width: 1, height: 1, texels }.into())
    }
}

/// A model of two nodes: a light, and below it a triangle with a named material.
const MODEL: &str = r#"{
    "asset": {"version": "2.0"}, "extensionsUsed": ["KHR_lights_punctual"],
    "nodes": [{"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}, "children": [1]}, {"mesh": 0}],
    "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 10}]}},
    "materials": [{"name": "paint"}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
    "accessors": [{"bufferView": 0, "componentType": 5121, "count": 3, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 9}],
    "buffers": [{"byteLength": 9, "uri": "data:;base64,AAAAAQAAAAEA"}]
}"#;

pub(in crate::formats) fn read(text: &str) -> Result<World, LoadError> {
    super::parse(text, Path::new("scenes/test.ron"), &mut Fake::default())
}

fn read_entity(keys: &str) -> World {
    read(&format!("(entities: [({keys})])")).unwrap()
}

/// The only component of its type in the world.
fn only<T: hecs::Component + Clone>(world: &World) -> T {
    let mut query = world.entities.query::<&T>();
    let mut found = query.iter();
    let component = found.next().unwrap().clone();
    assert!(found.next().is_none());
    component
}

fn grey(value: f32) -> Rgb {
    Rgb::splat(value)
}

/// A scene with every feature of the format.
const EVERYTHING: &str = r##"// Ein Kommentar mit Umlauten: äöü
#![enable(implicit_some)]
(
    settings: (
        size: (320, 200), samples: 4, max_depth: 3, diffuse_depth: 2, glossy_depth: Some(5), transmission_depth: None, min_throughput: 0.01, transport: Whitted, seed: 7,
        roulette_depth: None, clamp: 20, filter_glossy: 0.5, sampler: Independent, sharing: 16, caustics: (photons: 2.5), adaptive: On,
        filter: Gaussian(radius: 2), pixel_pattern: Regular,
        background: Gradient(bottom: 0.25, top: (0.1, 0.2, 1)), backdrop: 0.75, backplate: Gradient(bottom: 1, top: (0, 0.5, 1)), transparent: true, ambient: 0.01, tonemap: Aces,
        exposure_ev: -1.5, exposure: Auto, copied_triangles: 1000, light_groups: true, light_by_bounce: true, aov: [Normal, Depth],
    ),
    materials: {
        "glass": BlinnPhong(specular: 0.2, shininess: 200, ior: 1.5),
        "floor": (kd: Image("../assets/checker.png"), kr: 0.2, /* nested /* comment */ */ highlight: Phong),
        "wall": (
            diffuse: Texture(
                image: "../assets/checker.png", filter: Nearest, wrap: (Clamp, Mirror), scale: 4,
                offset: (0.5, 0), color_space: Linear, factor: (1, 0.5, 0.25),
            ),
            ks: 0.1, kt: 0.5, emission: (0, 0, 1),
        ),
        "car": Principled(
            base_color: (0.8, 0.1, 0), metallic: 0, roughness: Image("../assets/checker.png"), clearcoat: 1,
            normal: Texture(image: "../assets/checker.png", filter: Trilinear, rotation_degrees: 30, uv_set: 1),
        ),
    },
    entities: [
        (name: "camera", camera: ThinLens(vertical_fov_degrees: 40, lens_radius_m: 0.02, focus_distance_m: 5),
         transform: LookAt(from: (0, 1, 5), to: (0, 0.5, 0))),
        (name: "child", parent: "ball", shape: Sphere(radius_m: 0.25), material: "glass"),
        (name: "ball", shape: Sphere, material: "wall",
         transform: (translate: (0, 0.5, 0), rotate_degrees: (10, 20, 30), scale: (1, 2, 1))),
        (name: "kn\"o\"t", shape: Mesh("../assets/knot.ply"), material: (diffuse: (0.8, 0.3, 0.2))),
        (shape: Mesh("../assets/knot.ply"),
         transform: Matrix(((1, 0, 0, 1), (0, 2, 0, 0), (0, 0, 3, 0)))),
        (shape: Plane(corners: ((-5, 0, -5), (5, 0, -5), (5, 0, 5), (-5, 0, 5))), material: "floor"),
        (shape: Triangle(vertices: ((0, 0, 0), (1, 0, 0), (0, 1, 0)), normals: ((0, 0, 1), (0, 0, 1), (0, 1, 1)),
                         uvs: ((0, 0), (1, 0), (0, 1)))),
        (light: Area(power_w: (80, 76, 70), size_m: (1, 2), samples: 16, pattern: Uniform, visible: true)),
        (light: Point(power_w: 5, falloff: Constant), transform: (rotate_quaternion: (0, 0, 0.6, 0.8)), caustics: false),
        (light: Spot(power_w: 100, inner_degrees: 20, outer_degrees: 40)),
        (light: Directional(irradiance: (1, 1, 0.5)), name: r#"raw "name""#),
        (light: Environment(radiance: 2, image: "../assets/checker.png")),
        (light: Directional(irradiance: 1, angle_degrees: 0.53)),
        (camera: Orthographic(height_m: 3)), (camera: Pinhole(vertical_fov_degrees: Some(60.5))),
        (camera: Photographic(focal_length_mm: 85, f_stop: 1.8, shift: (0, 0.25)), focus_on: "ball"),
        (camera: Intrinsics(fx: 525.5, fy: 520, cx: 319.5, cy: 239.5, size: (640, 480)),
         transform: OpenCv(world_to_camera: ((1, 0, 0, 0.5), (0, 1, 0, -1), (0, 0, 1, 2)))),
        (camera: Panorama(vertical_degrees: 90), stereo: (layout: OverUnder, eye_distance_m: 0.06, convergence_m: 3)),
        (camera: Fisheye(fov_degrees: 220, mapping: Equisolid, circular: false), stereo: ()),
    ],
)
"##;
