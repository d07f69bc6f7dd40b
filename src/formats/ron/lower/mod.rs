//! Lowers the structures of a file to a [`World`].

mod assets;
mod corners;
mod emitter;
mod entity;
mod fields;
mod material;
mod overrides;
pub(super) mod reread;
mod settings;
mod texture;
mod transform;

use std::collections::HashMap;

use self::assets::LoweredAssets;
use super::source::{Raw, SceneText};
use super::{query, scan};
use crate::error::LoadError;
use crate::formats::AssetFiles;
use crate::world::{MaterialId, World};

/// The keys of a scene; the first one is required.
pub(super) const SCENE: [&str; 4] = ["entities", "settings", "materials", "edits"];

/// The state of lowering.
struct Lowering<'s, 'a> {
    source: &'s SceneText<'a>,
    world: World,
    assets: LoweredAssets<'s, 'a>,
    /// The scene's own named materials, without those of mesh files.
    materials: HashMap<String, MaterialId>,
    /// True while the inputs of a computed texture of numbers are read: their images are linear.
    reads_numbers: bool,
}

/// Replaces the error for unknown fields if the file is a study, which has a title.
fn as_study(source: &SceneText, error: LoadError, root: Raw) -> LoadError {
    let is_title = |item: &&str| scan::key_and_value(item).is_some_and(|(key, _)| key == "title");
    match error {
        LoadError::At { file, line, column, .. } if source.values(root.0).any(|item| is_title(&item)) => {
            let reason = "this is a study, not a scene: rayfront study measures it".to_owned();
            LoadError::At { file, line, column, reason }
        }
        error => error,
    }
}

/// Reads a whole scene.
pub(super) fn scene(source: &SceneText, files: &mut dyn AssetFiles) -> Result<World, LoadError> {
    let root = source.root()?;
    let [entities, settings, materials, edits] =
        source.keys(root, "a scene", 1, SCENE).map_err(|error| as_study(source, error, root))?;
    source.collect_faults();
    let mut lowering = Lowering {
        source,
        world: World::default(),
        assets: LoweredAssets::new(source.path(), &mut *files),
        materials: HashMap::new(),
        reads_numbers: false,
    };
    let (mut transport, mut names_depth) = (None, false);
    if let Some(settings) = settings {
        source.clock().refused.set(Some("settings stay what they are: keys are for entities and materials"));
        if let Some(read) = source.recover(lowering.settings(settings))? {
            (lowering.world.settings, transport, names_depth) = read;
        }
        source.clock().refused.set(None);
    }
    if let Some(materials) = materials {
        source.recover(lowering.named_materials(materials))?;
    }
    source.recover(entities.map_or(Ok(()), |raw| lowering.entities(raw)))?;
    let Lowering { mut world, assets, .. } = lowering;
    assets.read_images(source, &mut world)?;
    source.check_faults()?;
    world.usual_depth = (!names_depth).then_some(world.settings.max_depth);
    let edits = edits.map_or(Ok(Vec::new()), |raw| source.list(raw, "the edits"))?;
    let mut changes = query::EditRunner::new(&world);
    for raw in edits {
        let statement = source.string(raw, "a statement")?;
        changes
            .carry_out(&mut world, &statement, files)
            .map_err(|error| source.error(raw.0, error.to_string()))?;
    }
    world.is_animated |= source.clock().asked.get();
    world.animated_until(source.clock().end_s.get());
    world.transport_is_chosen = transport.is_none();
    world.choose_transport();
    Ok(world)
}
