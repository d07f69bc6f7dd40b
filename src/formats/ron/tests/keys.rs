//! Tests of values that change with time.

use std::path::Path;
use std::sync::Arc;

use super::{Fake, only};
use crate::error::{Diagnostic, LoadError};
use crate::formats::AssetFiles;
use crate::formats::ron::parse;
use crate::math::{Quat, Rgb, Vec3};
use crate::world::{Assets, Camera, ColorInput, DecodedImage, Light, Material, Mesh, Transform, World};

/// A time in seconds, with files that are never read.
struct At(f32);

impl AssetFiles for At {
    fn mesh(&mut self, path: &Path, a: &mut Assets, w: &mut Vec<Diagnostic>) -> Result<Arc<Mesh>, LoadError> {
        Fake::default().mesh(path, a, w)
    }

    fn model(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<crate::formats::gltf::GltfModel, LoadError> {
        Fake::default().model(path, assets, warnings)
    }

    fn image(&mut self, path: &Path) -> Result<DecodedImage, LoadError> {
        Fake::default().image(path)
    }

    fn time_s(&self) -> Option<f32> {
        Some(self.0)
    }
}

fn at(time_s: f32, text: &str) -> Result<World, LoadError> {
    parse(text, Path::new("scenes/test.ron"), &mut At(time_s))
}

fn entity_at(time_s: f32, keys: &str) -> World {
    at(time_s, &format!("(entities: [({keys})])")).unwrap()
}

fn parts(world: &World) -> (Vec3, Quat, Vec3) {
    match only::<Transform>(world) {
        Transform::Trs { translation, rotation, scale } => (translation.as_vec3(), rotation, scale),
        Transform::Matrix(_) => panic!("a matrix"),
    }
}

#[test]
fn keyed_transforms_are_interpolated() {
    let keys = "transform: (translate: Keys([(1, (0, 0, 0)), (3, (4, 8, 2))]), \
                rotate_degrees: (0, Keys([(0, 0), (4, 360)]), 0), \
                scale: Keys([(0, 1), (2, (3, 1, 1))], Step))";
    let (translation, rotation, scale) = parts(&entity_at(1.5, keys));
    assert_eq!((translation, scale), (Vec3::new(1.0, 2.0, 0.5), Vec3::ONE));
    assert!(rotation.abs_diff_eq(Quat::from_rotation_y(135_f32.to_radians()), 1e-6), "{rotation}");
    assert!(entity_at(1.5, keys).is_animated && !entity_at(1.5, "name: \"still\"").is_animated);
    let (before, _, _) = parts(&entity_at(-1.0, keys));
    let (after, _, stepped) = parts(&entity_at(99.0, keys));
    assert_eq!((before, after, stepped), (Vec3::ZERO, Vec3::new(4.0, 8.0, 2.0), Vec3::new(3.0, 1.0, 1.0)));
    // A single number has keys; a smooth one is halfway at half time.
    let smooth = "transform: (translate: (7, Keys([(0, 0), (2, 10)], Smooth), 0))";
    assert_eq!(parts(&entity_at(1.0, smooth)).0, Vec3::new(7.0, 5.0, 0.0));
    assert!(parts(&entity_at(0.1, smooth)).0.y < 0.1, "it sets off slowly");
}

#[test]
fn turns_take_the_shorter_way() {
    // The second key is a quarter turn, written as the negative quaternion.
    for between in ["Linear", "Smooth"] {
        let keys = format!(
            "transform: (rotate_quaternion: Keys([(0, (0, 0, 0, 1)), (1, (0, 0, -0.70710677, -0.70710677))], {between}))"
        );
        let (_, rotation, _) = parts(&entity_at(0.5, &keys));
        assert!(rotation.abs_diff_eq(Quat::from_rotation_z(45_f32.to_radians()), 1e-6), "{rotation}");
    }
}

#[test]
fn keyed_lights_cameras_and_materials_are_interpolated() {
    let light = "light: Point(power_w: Keys([(0, 10), (2, (30, 10, 0))]))";
    let Light::Point { power_w, .. } = only::<Light>(&entity_at(1.0, light)) else { panic!() };
    assert_eq!(power_w, Rgb::new(20.0, 10.0, 5.0));
    let camera = "camera: Pinhole(vertical_fov_degrees: Keys([(0, 90), (1, 30)]))";
    let Camera::Pinhole { vertical_fov } = only::<Camera>(&entity_at(0.5, camera)) else { panic!() };
    assert!((vertical_fov - 60_f32.to_radians()).abs() < 1e-6);
    let scene = "(entities: [], materials: {\"paint\": Principled(base_color: Keys([(0, 0), (1, (1, 0.5, 0))]), \
                 roughness: Keys([(0, 0.25), (1, 0.75)]))})";
    let world = at(0.5, scene).unwrap();
    let Some(Material::Principled(paint)) = world.assets.materials.last().map(|named| &named.material) else {
        panic!()
    };
    assert_eq!(paint.base_color, ColorInput::Constant(Rgb::new(0.5, 0.25, 0.0)));
    assert_eq!(paint.roughness.factor, 0.5);
}
