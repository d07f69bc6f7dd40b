//! Adds what a mesh or model on its own lacks to be visible: a camera that shows all of it, and plain light.

use std::path::Path;

use super::auto_camera::AutoCamera;
use super::studio;
use crate::error::{Diagnostic, LoadError};
use crate::formats::names::TakenNames;
use crate::formats::{AssetFiles, EnvironmentPreset, Files, LoadOptions, gltf};
use crate::math::{DMat3, DVec3, Quat, Rgb, Vec3};
use crate::world::assets::NamedMaterial;
use crate::world::{
    Assets, Background, Camera, ColorInput, Light, Material, Model, Name, Shape, SourceFiles, Tonemap,
    Transform, Transport, World,
};

/// The warning for a scene without a camera of its own.
const CAMERA_ADDED: &str = "there is no camera: one that sees everything was added";
/// The warning for a model without light.
const STUDIO_ADDED: &str = "there is no light: a studio was put around it";
/// The warning for a mesh, which has no light.
const LIGHT_ADDED: &str = "there is no light: key, fill and ambient light were added";

/// Loads a mesh and adds camera and light.
pub(super) fn load_mesh(
    path: &Path,
    options: &LoadOptions,
    sources: &SourceFiles,
) -> Result<World, LoadError> {
    let mut world = World::default();
    world.assets.files = sources.clone();
    let mut files = Files { sources: sources.clone(), ..Files::default() };
    let mesh = files.mesh(path, &mut world.assets, &mut world.warnings)?;
    let id = world.assets.add_mesh(mesh);
    world.entities.spawn((Name("mesh".into()), Transform::IDENTITY, Shape::Mesh(id)));
    add_camera(&mut world);
    if options.surroundings.as_ref().is_some_and(|around| *around != EnvironmentPreset::None) {
        // Only this transport lights surfaces by an environment.
        world.settings.transport = Transport::Path;
    } else {
        add_light(&mut world);
    }
    Ok(world)
}

/// Loads a model and adds camera and light where it has none.
pub(super) fn load_model(
    path: &Path,
    options: &LoadOptions,
    sources: &SourceFiles,
) -> Result<World, LoadError> {
    let mut world = World::default();
    world.assets.files = sources.clone();
    let mut model = gltf::load(path, options, &mut world.assets, &mut world.warnings)?;
    if let Some(unknown) = model.unknown_animation.take() {
        return Err(unknown);
    }
    let root = world.entities.spawn((Transform::IDENTITY, Model(path.to_owned())));
    model.place(&mut world, Some(root));
    world.warnings.extend(after_the_end(options.time_s, world.animation_end_s));
    let settings = &mut world.settings;
    settings.transport = Transport::Path;
    settings.tonemap = tone_curve(&world.assets, &mut world.warnings);
    // Unlit colours have their exposure already.
    settings.auto_exposure = settings.tonemap != Tonemap::Clamp;
    (settings.max_depth, settings.samples) = (16, 64);
    if let Some(aspect) = model.aspect {
        settings.size = of_aspect(settings.size, aspect);
    }
    world.usual_depth = Some(world.settings.max_depth);
    add_camera(&mut world);
    if options.surroundings.is_none() && is_dark(&world) {
        let image = world.assets.add_made_image(studio::image());
        let name = TakenNames::of(&world).unique("studio");
        let light = Light::Environment { radiance: Rgb::WHITE, image: Some(image) };
        world.entities.spawn((name, light, Transform::IDENTITY));
        world.warnings.push(Diagnostic::note("studio-added", STUDIO_ADDED));
    }
    Ok(world)
}

/// The note about a moment after the end of an animation.
fn after_the_end(time_s: Option<f32>, end_s: Option<f32>) -> Option<Diagnostic> {
    let end = end_s.filter(|end| time_s.is_some_and(|time| time > end + END_TOLERANCE_S))?;
    let what = format!("the animation ends at {end} s: later moments look like its end");
    Some(Diagnostic::note("after-the-end", what))
}

/// Photographs and drawings on unlit surfaces are meant for the screen as they are; lit surfaces go through a tone
/// curve. An image has only one curve.
fn tone_curve(assets: &Assets, warnings: &mut Vec<Diagnostic>) -> Tonemap {
    // The first one is for meshes without a material.
    let own = assets.materials.get(1..).unwrap_or_default();
    let is_unlit = |named: &&NamedMaterial| matches!(&named.material, Material::Principled(it) if it.unlit);
    let (unlit, all) = (own.iter().filter(is_unlit).count(), own.len());
    if unlit > 0 && unlit == all {
        return Tonemap::Clamp;
    }
    if unlit > 0 {
        let what = "the tone curve, which is for those that light falls on, changes their colours, too";
        let what = format!("{unlit} of {all} materials are unlit: {what}");
        warnings.push(Diagnostic::warning("curve-on-unlit", what).fixed_by("`--tonemap clamp` has none"));
    }
    Tonemap::PbrNeutral
}

/// The size with the same longer side whose width is `aspect` times its height.
fn of_aspect(size: [u32; 2], aspect: f32) -> [u32; 2] {
    let longer = size[0].max(size[1]);
    let shorter = |ratio: f32| ((longer as f32 * ratio).round() as u32).clamp(1, longer);
    if aspect >= 1.0 { [longer, shorter(1.0 / aspect)] } else { [shorter(aspect), longer] }
}

/// True if nothing emits light. Surfaces that emit no more than white reflects in daylight (1) are taken for displays
/// and the like, which hardly light anything.
fn is_dark(world: &World) -> bool {
    let emits = |material: &Material| match material {
        Material::Principled(principled) => match principled.emission {
            ColorInput::Constant(color) => color.max_component() > 1.0,
            ColorInput::Texture(id) => {
                let texture = world.assets.textures.get(id.0 as usize);
                texture.is_some_and(|texture| texture.factor.max_component() > 1.0)
            }
        },
        Material::BlinnPhong(_) => false,
    };
    world.entities.query::<&Light>().iter().next().is_none()
        && !world.assets.materials.iter().any(|named| emits(&named.material))
}

/// Adds a camera if there is none; [`super::auto_camera`] places it where it sees everything.
pub(super) fn add_camera(world: &mut World) {
    if world.entities.query::<&Camera>().iter().next().is_some() {
        return;
    }
    let place = looking_from(CAMERA);
    let camera = Camera::Pinhole { vertical_fov: (2.0 * HALF_FOV_DEGREES).to_radians() as f32 };
    let name = TakenNames::of(world).unique("camera");
    world.entities.spawn((name, camera, place, AutoCamera(place)));
    world.warnings.push(Diagnostic::note("camera-added", CAMERA_ADDED));
}

/// The difference to the end of an animation that counts as rounding, in seconds.
const END_TOLERANCE_S: f32 = 1e-3;
const HALF_FOV_DEGREES: f64 = 20.0;
/// The direction to an added camera: from the front, right and above.
const CAMERA: DVec3 = DVec3::new(0.45, 0.35, 1.0);

/// Adds a key light on the viewer's right, a fill light on the left, ambient light and a background.
fn add_light(world: &mut World) {
    let mut names = TakenNames::of(world);
    let mut sun = |name: &str, irradiance: f32, from: DVec3| {
        let light = Light::Directional { irradiance: Rgb::splat(irradiance), angle: 0.0 };
        world.entities.spawn((names.unique(name), light, looking_from(from)));
    };
    sun("key", 0.75, DVec3::new(1.2, 1.6, 0.9));
    sun("fill", 0.25, DVec3::new(-1.5, 0.4, 0.8));
    world.settings.ambient = Rgb::splat(0.15);
    world.settings.background =
        Background::Gradient { bottom: Rgb::splat(0.25), top: Rgb::new(0.55, 0.6, 0.65) };
    world.warnings.push(Diagnostic::note("light-added", LIGHT_ADDED));
}

/// A transform that stands at `place` and looks at the origin along −Z, with +Y up.
fn looking_from(place: DVec3) -> Transform {
    let backward = place.normalize();
    let right = DVec3::Y.cross(backward).normalize();
    let axes = DMat3::from_cols(right, backward.cross(right), backward);
    let rotation = glam::DQuat::from_mat3(&axes).normalize();
    let rotation = Quat::from_array(rotation.to_array().map(|c| c as f32));
    Transform::Trs { translation: place, rotation, scale: Vec3::ONE }
}
