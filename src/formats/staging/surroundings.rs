//! Replaces the surroundings of a scene.

use std::path::Path;

use super::studio;
use crate::error::LoadError;
use crate::formats::names::TakenNames;
use crate::formats::{AssetFiles, EnvironmentPreset, Files};
use crate::math::Rgb;
use crate::world::{ImageId, Light, SourceFiles, Transform, World};

/// Replaces the environments and skies of a scene.
pub(super) fn surround(world: &mut World, surroundings: &EnvironmentPreset) -> Result<(), LoadError> {
    let old: Vec<_> = world.surroundings().collect();
    for entity in old {
        // It is known to exist.
        let _ = world.entities.remove_one::<Light>(entity);
    }
    let around = |image| Light::Environment { radiance: Rgb::WHITE, image: Some(image) };
    let (name, light) = match surroundings {
        EnvironmentPreset::None => return Ok(()),
        EnvironmentPreset::Studio => ("studio", around(world.assets.add_made_image(studio::image()))),
        EnvironmentPreset::Sky(sky) => ("sky", sky.light(Rgb::WHITE)),
        EnvironmentPreset::Picture(path) => ("environment", around(read(world, path)?)),
    };
    let name = TakenNames::of(world).unique(name);
    world.entities.spawn((name, light, Transform::IDENTITY));
    Ok(())
}

fn read(world: &mut World, path: &Path) -> Result<ImageId, LoadError> {
    let mut files = Files { sources: SourceFiles::clone(&world.assets.files), ..Files::default() };
    files.sources.allow(path);
    let image = files.image(path)?.report(&mut world.warnings);
    world.assets.files.extend(&files.sources);
    Ok(world.assets.add_image(image))
}
