//! Scenes of any format, chosen by the file name's extension.

use std::path::Path;

use super::{auto_camera, framing, lens, surroundings};
use crate::error::Diagnostic;
use crate::error::{LoadError, did_you_mean};
use crate::formats::{Edits, Files, LoadOptions, MESHES, extension, ron};
use crate::world::{Model, SourceFiles, World};

/// Adds a camera to a scene that places models: its author need not choose a view.
fn add_camera_for_models(world: &mut World) {
    if world.entities.query::<&Model>().iter().next().is_some() {
        framing::add_camera(world);
    }
}

/// Completes a world that was parsed from a text as [`load`] does for files: chooses its transport, and adds a camera
/// if it only places models.
#[cfg(feature = "python")]
pub(crate) fn complete(world: &mut World) -> Result<(), LoadError> {
    add_camera_for_models(world);
    world.choose_transport();
    // The default options do not need the scene at rest.
    auto_camera::place(world, &LoadOptions::default(), || Ok(World::default()))
}

/// Formats of other programs' scenes and meshes, which usually reach glTF through Blender.
const READ_BY_BLENDER: [&str; 11] =
    ["fbx", "dae", "3ds", "blend", "usd", "usda", "usdc", "usdz", "abc", "x3d", "wrl"];

/// Reads a scene as it is: [`load_with`] the default options.
pub fn load(path: impl AsRef<Path>) -> Result<World, LoadError> {
    load_with(path, &LoadOptions::default())
}

/// Reads a scene. The file name's extension determines its kind: a scene (`.ron`), a model (`.gltf`, `.glb`) or a mesh
/// (`.ply`, `.obj`, `.stl`). Models and meshes get the camera and the light that they lack. All files that a scene refers to
/// must lie in its folder or below; if that folder or one above it holds a file `.rayfront-root`, anywhere below the
/// nearest of these.
///
/// Oddities that are no errors are in [`World::warnings`].
///
/// Errors: a file that cannot be opened ([`LoadError::Io`]); one that is malformed ([`LoadError::At`],
/// [`LoadError::Invalid`]), with the place in it and what would be right; one that does not fit into memory
/// ([`LoadError::TooLarge`]); an option that does not suit the file or is invalid in itself ([`LoadError::Option`]).
pub fn load_with(path: impl AsRef<Path>, options: &LoadOptions) -> Result<World, LoadError> {
    load_again(path.as_ref(), options, &SourceFiles::default())
}

/// Reads a scene that is read repeatedly: `sources` may hold the decoded contents of its files from before (see
/// [`SourceFiles::kept`]).
pub fn load_again(path: &Path, options: &LoadOptions, sources: &SourceFiles) -> Result<World, LoadError> {
    let extension = extension(path);
    options.are_for(path, &extension)?;
    sources.allow(path);
    sources.confine(path);
    let mut world = match &extension[..] {
        "ron" => {
            let common = LoadOptions { variant: None, scene: None, ..options.clone() };
            let mut files = Files::new(sources.clone(), common);
            let mut world = ron::load(path, &mut files)?;
            world.assets.files.extend(&files.sources);
            add_camera_for_models(&mut world);
            Ok(world)
        }
        "gltf" | "glb" => framing::load_model(path, options, sources),
        mesh if MESHES.contains(&mesh) => framing::load_mesh(path, options, sources),
        other => {
            let known = ["ron", "gltf", "glb", "ply", "obj", "stl"];
            let whole = known.iter().map(|extension| path.with_extension(extension));
            let whole = whole.filter(|_| other.is_empty()).find(|path| path.is_file());
            let hint = match whole {
                Some(path) => format!(" (did you mean \"{}\"?)", path.display()),
                None if ["pbrt", "pov", "xml", "lxs", "scn"].contains(&other) => {
                    ": scenes/MIGRATING.md says how to write such a scene anew".to_owned()
                }
                None if READ_BY_BLENDER.contains(&other) => {
                    ": Blender imports it and exports .glb".to_owned()
                }
                None => did_you_mean(other, known),
            };
            let reason =
                format!("scenes are .ron, .gltf, .glb, .ply, .obj or .stl files, not \".{other}\"{hint}");
            Err(LoadError::invalid(path, reason))
        }
    }?;
    if let Some(preset) = &options.surroundings {
        surroundings::surround(&mut world, preset)?;
    }
    if !options.edits.is_empty() {
        let mut files = Files::new(sources.clone(), LoadOptions::default());
        options.edits.apply(&mut world, &mut files)?;
    }
    // The choice depends on the surroundings and the edits, too.
    world.choose_transport();
    world.settings.size = options.size.unwrap_or(world.settings.size);
    lens::change(&mut world, &options.edits)?;
    auto_camera::place(&mut world, options, || {
        let Edits { set, only, hide, .. } = options.edits.clone();
        let edits = Edits { set, only, hide, ..Edits::default() };
        load_again(path, &LoadOptions { time_s: None, animation: None, edits, ..options.clone() }, sources)
    })?;
    if options.time_s.is_some() && !world.is_animated {
        let what = "every moment looks the same: it has no Keys, and its glTF files no animations";
        world.warnings.push(Diagnostic::warning("nothing-moves", what));
    }
    Ok(world)
}
