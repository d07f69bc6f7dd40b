//! Replaces the surroundings of a scene.

use std::path::Path;

use hecs::Entity;

use super::studio;
use crate::error::{Diagnostic, LoadError};
use crate::formats::names::TakenNames;
use crate::formats::{AssetFiles, Edits, EnvironmentPreset, Files, LoadOptions};
use crate::math::Rgb;
use crate::world::{ImageId, Light, Parent, SourceFiles, Transform, World, transforms};

/// Marks surroundings that an option has added, or that a bare model got: `hide` is about what the files have.
pub(super) struct AddedSurroundings;

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
    world.entities.spawn((name, light, Transform::IDENTITY, AddedSurroundings));
    Ok(())
}

/// Turns environments and skies about the vertical axis, clockwise seen from above, and multiplies their light.
pub(super) fn change(
    world: &mut World,
    turn_degrees: Option<f64>,
    strength: Option<f32>,
) -> Result<(), LoadError> {
    let options = [("env_turn", turn_degrees.is_some()), ("env_strength", strength.is_some())];
    let Some((option, _)) = options.iter().find(|(_, is_given)| *is_given) else { return Ok(()) };
    if !turn_degrees.is_none_or(f64::is_finite) {
        return Err(LoadError::option("env_turn", "it must be finite, in degrees"));
    }
    if !strength.is_none_or(|factor| (0.0..=Edits::MOST_STRENGTH).contains(&factor)) {
        return Err(LoadError::option("env_strength", "it must be 0 to a million: 2 is twice as bright"));
    }
    let entities: Vec<Entity> = world.surroundings().collect();
    if entities.is_empty() {
        let what = format!("--{}: there is no environment and no sky", option.replace('_', "-"));
        world
            .warnings
            .push(Diagnostic::warning("env-without-effect", what).fixed_by("`--env studio` adds one"));
    }
    for entity in entities {
        if let Some(factor) = strength
            && let Ok(mut light) = world.entities.get::<&mut Light>(entity)
            && let Light::Environment { radiance, .. } | Light::Sky { radiance, .. } = &mut *light
        {
            *radiance = *radiance * factor;
        }
        if let Some(degrees) = turn_degrees {
            let parent = world.entities.get::<&Parent>(entity).ok().map(|parent| parent.0);
            // A parent that has no transform in space is reported when the scene is compiled.
            let above =
                parent.and_then(|parent| transforms::to_world(world, &[parent]).ok()?.remove(&parent));
            let own = world.entities.get::<&Transform>(entity).map(|own| *own).unwrap_or_default();
            let turned = own.turned(degrees, above.map(|above| above.matrix3));
            let _ = world.entities.insert_one(entity, turned);
        }
    }
    Ok(())
}

fn read(world: &mut World, path: &Path) -> Result<ImageId, LoadError> {
    let mut files = Files::new(SourceFiles::clone(&world.assets.files), LoadOptions::default());
    files.sources.allow(path);
    let image = files.image(path)?.report(&mut world.warnings);
    world.assets.files.extend(&files.sources);
    Ok(world.assets.add_image(image))
}
