//! Adds what a mesh or model on its own lacks to be visible: a camera that shows all of it, and plain light.

use std::path::Path;
use std::sync::Arc;

use super::auto_camera::AutoCamera;
use super::surroundings::AddedSurroundings;
use super::{emission, studio};
use crate::error::{Diagnostic, LoadError};
use crate::formats::names::TakenNames;
use crate::formats::{AssetFiles, EnvironmentPreset, Files, LoadOptions, extension, gltf};
use crate::math::{DMat3, DVec3, Quat, Rgb, Vec3};
use crate::world::assets::NamedMaterial;
use crate::world::{
    Assets, Background, Camera, Light, Material, Mesh, Model, Name, Parent, Shape, SourceFiles, Tonemap,
    Transform, Transport, World,
};

/// The warning for a scene without a camera of its own.
const CAMERA_ADDED: &str = "there is no camera: one that sees everything was added";
/// The warning for a model without light.
const STUDIO_ADDED: &str = "there is no light: a studio was put around it";
/// The note about a model that emits light, but lights little with it.
const STUDIO_ADDED_TO_EMISSION: &str =
    "materials emit light, but leave most of what is seen dark: a studio was put around it";
/// The other choice.
const LEAVES_EMISSION: &str = "`--env none` leaves only what they emit";
/// The note about a model whose light is what it emits.
const LIT_BY_EMISSION: &str = "there is no light but what materials emit";
/// The other choice.
const ADDS_STUDIO: &str = "`--env studio` puts a studio around it";
/// The warning for a mesh, which has no light.
const LIGHT_ADDED: &str = "there is no light: key, fill and ambient light were added";

/// The name of the entity that a mesh becomes. The named objects of an OBJ file are entities below it.
const MESH: &str = "mesh";

/// Loads a mesh and adds camera and light.
pub(super) fn load_mesh(
    path: &Path,
    options: &LoadOptions,
    sources: &SourceFiles,
) -> Result<World, LoadError> {
    let mut world = World::default();
    world.assets.files = sources.clone();
    let mut files = Files::new(sources.clone(), LoadOptions::default());
    let World { assets, warnings, .. } = &mut world;
    let parts = match extension(path).as_str() {
        "obj" => files.objects(path, assets, warnings)?,
        _ => vec![(String::new(), files.mesh(path, assets, warnings)?)],
    };
    place_parts(&mut world, options.up.upright(), parts);
    if world.has_principled() {
        // Metals show nothing but their surroundings.
        light_as_model(&mut world, None, path, options, sources)?;
        return Ok(world);
    }
    add_camera(&mut world);
    if options.surroundings.as_ref().is_some_and(|around| *around != EnvironmentPreset::None) {
        // Only this transport lights surfaces by an environment.
        world.settings.transport = Transport::Path;
    } else {
        add_light(&mut world);
    }
    Ok(world)
}

/// Adds an entity for a mesh without a name, or one for each of several and one above them.
fn place_parts(world: &mut World, transform: Transform, parts: Vec<(String, Arc<Mesh>)>) {
    let root = world.entities.spawn((Name(MESH.into()), transform));
    if let [(name, mesh)] = &parts[..]
        && name.is_empty()
    {
        let id = world.assets.add_mesh(mesh.clone());
        // The entity was added above.
        let _ = world.entities.insert_one(root, Shape::Mesh(id));
        return;
    }
    let mut names = TakenNames::of(world);
    for (name, mesh) in parts {
        let id = world.assets.add_mesh(mesh);
        let name = names.unique(if name.is_empty() { MESH } else { &name });
        world.entities.spawn((name, Transform::IDENTITY, Shape::Mesh(id), Parent(root)));
    }
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
    let root = world.entities.spawn((options.up.upright(), Model(path.to_owned())));
    model.place(&mut world, Some(root));
    world.warnings.extend(after_the_end(options.time_s, world.animation_end_s));
    light_as_model(&mut world, model.aspect, path, options, sources)?;
    Ok(world)
}

/// Chooses the settings for physically based materials, and adds a camera and, where there is none, light. `aspect` is
/// that of the model's camera.
fn light_as_model(
    world: &mut World,
    aspect: Option<f32>,
    path: &Path,
    options: &LoadOptions,
    sources: &SourceFiles,
) -> Result<(), LoadError> {
    let settings = &mut world.settings;
    settings.transport = Transport::Path;
    settings.tonemap = tone_curve(&world.assets, &mut world.warnings);
    // Unlit colours have their exposure already.
    settings.auto_exposure = settings.tonemap != Tonemap::Clamp;
    (settings.max_depth, settings.samples) = (16, 64);
    if let Some(aspect) = aspect {
        settings.size = of_aspect(settings.size, aspect);
        let is_moved = options.edits.look_at.is_some() || options.edits.orbit.is_some();
        let wanted = options.size.filter(|_| !is_moved && options.edits.zoom.is_none());
        world.warnings.extend(wanted.and_then(|size| other_frame(size, aspect)));
    }
    world.usual_depth = Some(world.settings.max_depth);
    add_camera(world);
    if options.surroundings.is_none() {
        add_studio(world, path, options, sources)?;
    }
    Ok(())
}

/// Adds a studio unless the model has lights, or emits enough light itself. Says so.
fn add_studio(
    world: &mut World,
    path: &Path,
    options: &LoadOptions,
    sources: &SourceFiles,
) -> Result<(), LoadError> {
    if world.entities.query::<&Light>().iter().next().is_some() {
        return Ok(());
    }
    let emits = emits(world);
    // All frames of an animation have the same light.
    let is_moved = world.is_animated && (options.time_s.is_some() || options.animation.is_some());
    let is_lit = emits
        && match is_moved {
            false => emission::lights_most(world),
            true => {
                let at_rest = LoadOptions { time_s: None, animation: None, ..options.clone() };
                load_model(path, &at_rest, sources)?.surroundings().next().is_none()
            }
        };
    if is_lit {
        world.warnings.push(Diagnostic::note("lit-by-emission", LIT_BY_EMISSION).fixed_by(ADDS_STUDIO));
        return Ok(());
    }
    let image = world.assets.add_made_image(studio::image());
    let name = TakenNames::of(world).unique("studio");
    let light = Light::Environment { radiance: Rgb::WHITE, image: Some(image) };
    world.entities.spawn((name, light, Transform::IDENTITY, AddedSurroundings));
    world.warnings.push(match emits {
        true => Diagnostic::note("studio-added", STUDIO_ADDED_TO_EMISSION).fixed_by(LEAVES_EMISSION),
        false => Diagnostic::note("studio-added", STUDIO_ADDED),
    });
    Ok(())
}

/// The note about an image whose sides have another ratio than those of the camera's.
fn other_frame(size: [u32; 2], aspect: f32) -> Option<Diagnostic> {
    let [width, height] = of_aspect(size, aspect);
    // A size in whole pixels is rarely exact.
    let is_near = |side: usize| size[side].abs_diff([width, height][side]) <= 1 + size[side] / 200;
    if is_near(0) && is_near(1) {
        return None;
    }
    let is_wider = size[0] as f32 > size[1] as f32 * aspect;
    let what = if is_wider { "more" } else { "less" };
    let what = format!(
        "the camera's image is {aspect:.2} times as wide as high: this one shows {what} at its sides"
    );
    let remedy = format!("`--size {width}x{height}` shows the camera's");
    Some(Diagnostic::note("other-aspect-ratio", what).fixed_by(remedy))
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

/// True if a material emits more light than a display.
fn emits(world: &World) -> bool {
    world.assets.materials.iter().any(|named| match &named.material {
        Material::Principled(material) => emission::most_emitted(world, material) > emission::DISPLAY,
        Material::BlinnPhong(_) => false,
    })
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
