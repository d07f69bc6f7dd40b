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

pub(super) use self::transform::from_degrees;
use std::collections::HashMap;

use self::assets::LoweredAssets;
use super::source::{Raw, SceneText};
use super::{query, scan};
use crate::error::{Diagnostic, LoadError, Severity};
use crate::formats::AssetFiles;
use crate::world::{MaterialId, World};

/// The keys of a scene.
const SCENE: [&str; 6] = ["entities", "settings", "materials", "edits", "include", "variables"];

/// The state of lowering.
struct Lowering<'s, 'a> {
    source: &'s SceneText<'a>,
    world: World,
    assets: LoweredAssets<'s, 'a>,
    /// The named materials of the scene's files, without those of mesh files.
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

/// A note about the settings of an included file, the first time that it is included.
fn unused_settings(source: &SceneText, number: usize, settings: Raw) -> Option<Diagnostic> {
    let part = &source.parts[number];
    let (line, _) = part.position(settings.0);
    let what = "the settings of an included file are not used: those of the scene count";
    let is_first = !source.parts[..number].iter().any(|other| other.path == part.path);
    let note =
        || Diagnostic { severity: Severity::Note, ..Diagnostic::at_line("import", &part.path, line, what) };
    is_first.then(note)
}

/// Reads a whole scene.
pub(super) fn scene(source: &SceneText, files: &mut dyn AssetFiles) -> Result<World, LoadError> {
    let root = source.root()?;
    let keys = |number| source.keys(source.root_of(number)?, "a scene", 0, SCENE);
    let [entities, settings, materials, edits, include, _] =
        keys(0).map_err(|error| as_study(source, error, root))?;
    if entities.or(include).is_none() {
        return Err(source.error(root.0, "a scene needs the field \"entities\""));
    }
    source.collect_faults();
    let mut lowering = Lowering {
        source,
        world: World::default(),
        assets: LoweredAssets::new(&mut *files),
        materials: HashMap::new(),
        reads_numbers: false,
    };
    // The materials and the entities of each file, by its number.
    let (mut all_materials, mut all_entities) = (vec![(0, materials)], vec![(0, entities)]);
    let included = (0..source.parts.len()).filter(|number| source.parts[*number].inclusion.is_some());
    for number in included {
        let Some([entities, settings, materials, edits, ..]) = source.recover(keys(number))? else {
            continue;
        };
        if let Some(edits) = edits {
            let reason = "edits are for whole scenes: write them in the file that includes this one";
            source.recover(Err::<(), _>(source.error(edits.0, reason)))?;
        }
        lowering.world.warnings.extend(settings.and_then(|raw| unused_settings(source, number, raw)));
        all_materials.push((number, materials));
        all_entities.push((number, entities));
    }
    let (mut transport, mut names_depth) = (None, false);
    if let Some(settings) = settings {
        source.clock().refused.set(Some("settings stay what they are: keys are for entities and materials"));
        if let Some(read) = source.recover(lowering.settings(settings))? {
            (lowering.world.settings, transport, names_depth) = read;
        }
        source.clock().refused.set(None);
    }
    for (number, materials) in all_materials {
        source.recover(materials.map_or(Ok(()), |raw| lowering.named_materials(number, raw)))?;
    }
    source.recover(lowering.entities(&all_entities))?;
    let Lowering { mut world, assets, .. } = lowering;
    assets.read_images(source, &mut world)?;
    source.check_faults()?;
    world.warnings.extend(source.unused_options().into_iter().map(|name| {
        let what = format!("var: nothing in the scene uses ${name}, so its value changes nothing");
        Diagnostic::warning("var-without-effect", what)
    }));
    world.usual_depth = (!names_depth).then_some(world.settings.max_depth);
    let edits = edits.map_or(Ok(Vec::new()), |raw| source.list(raw, "the edits"))?;
    // Most scenes have no edits, and need no index of their entities.
    let mut changes = None;
    for raw in edits {
        let statement = source.string(raw, "a statement")?;
        changes
            .get_or_insert_with(|| query::EditRunner::new(&world))
            .carry_out(&mut world, &statement, files)
            .map_err(|error| source.error(raw.0, error.to_string()))?;
    }
    world.is_animated |= source.clock().asked.get();
    world.animated_until(source.clock().end_s.get());
    world.transport_is_chosen = transport.is_none();
    world.choose_transport();
    Ok(world)
}
