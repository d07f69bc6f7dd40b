//! A scene of any format, by its file name's extension.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Edits, Files, Surroundings, extension, framing, ron, shot, surroundings};
use crate::error::{LoadError, did_you_mean};
use crate::world::{SourceFiles, World};

/// What of a model is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// The moment of its animations, in seconds; none: as its nodes stand without them.
    pub time_s: Option<f32>,
    /// The name of a variant of its materials.
    pub variant: Option<String>,
    /// The name of a scene or its number, from 0; none: the one that the file says.
    pub scene: Option<String>,
    /// What the numbers of its lights count.
    pub light_units: LightUnits,
    /// Glass without a volume is the boundary of a body all the same.
    pub solid_glass: bool,
    /// Surfaces of models are there from both sides.
    pub double_sided: bool,
    /// In place of its own environment.
    pub surroundings: Option<Surroundings>,
    /// What is said of it beside its files.
    pub edits: Edits,
    /// Columns and rows of the picture, in place of its own.
    pub size: Option<[u32; 2]>,
}

/// What the numbers of a glTF file's lights count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LightUnits {
    /// What its exporter is known to mean.
    #[default]
    Auto,
    /// Candela and lux, as the specification has it; a lumen counts as a watt, so that a lamp of 1 cd shines as
    /// what emits 1 does on a square metre.
    Candela,
    /// The same, 683 of which make up a watt; what emits is in watts already.
    Watt,
}

/// Reads a scene as it is: [`load_with`] nothing special.
pub fn load(path: impl AsRef<Path>) -> Result<World, LoadError> {
    load_with(path, &LoadOptions::default())
}

/// Reads a scene by its file name's extension: `.ron`, or a model (`.gltf`, `.glb`) or mesh
/// (`.ply`, `.obj`), which get the camera and light that they lack. What it refers to must lie in its folder or
/// below, or in the nearest folder above it that has a file `.rayfront-root`.
///
/// Errors: no such file; what is no scene, with the place in the file and what would be right; what memory does
/// not do for.
pub fn load_with(path: impl AsRef<Path>, options: &LoadOptions) -> Result<World, LoadError> {
    load_again(path.as_ref(), options, &SourceFiles::default())
}

/// The same for a scene that is read again and again: `sources` may know what its files are decoded to (see
/// [`SourceFiles::kept`]).
pub fn load_again(path: &Path, options: &LoadOptions, sources: &SourceFiles) -> Result<World, LoadError> {
    let extension = extension(path);
    let common = LoadOptions { variant: None, scene: None, ..options.clone() };
    let refused = match &extension[..] {
        "gltf" | "glb" => None,
        "ron" if *options == common => None,
        "ron" => Some("--variant and --scene are for .gltf and .glb files"),
        _ if LoadOptions { surroundings: None, edits: Edits::default(), size: None, ..options.clone() }
            == LoadOptions::default() =>
        {
            None
        }
        _ if options.light_units != LightUnits::Auto || options.solid_glass || options.double_sided => Some(
            "--light-units, --solid-glass and --double-sided are for .gltf and .glb files, and .ron files that name these",
        ),
        _ => Some("--time, --variant and --scene are for .gltf and .glb files (--time for .ron files, too)"),
    };
    if let Some(reason) = refused {
        return Err(LoadError::invalid(path, reason));
    }
    sources.name(path);
    sources.confine(path);
    let mut world = match &extension[..] {
        "ron" => {
            let mut files = Files { options: common, sources: sources.clone() };
            let world = ron::load(path, &mut files)?;
            world.assets.files.extend(&files.sources);
            Ok(world)
        }
        "gltf" | "glb" => framing::load_model(path, options, sources),
        "ply" | "obj" => framing::load_mesh(path, options, sources),
        other => {
            let known = ["ron", "gltf", "glb", "ply", "obj"];
            let whole = known.iter().map(|extension| path.with_extension(extension));
            let whole = whole.filter(|_| other.is_empty()).find(|path| path.is_file());
            let hint = match whole {
                Some(path) => format!(" (did you mean \"{}\"?)", path.display()),
                None => did_you_mean(other, known),
            };
            let reason = format!("scenes are .ron, .gltf, .glb, .ply or .obj files, not \".{other}\"{hint}");
            Err(LoadError::invalid(path, reason))
        }
    }?;
    if let Some(surroundings) = &options.surroundings {
        surroundings::surround(&mut world, surroundings)?;
    }
    if !options.edits.is_empty() {
        let mut files = Files { sources: sources.clone(), ..Files::default() };
        options.edits.apply(&mut world, &mut files)?;
    }
    // What was put around it and changed counts, too.
    world.choose_transport();
    world.settings.size = options.size.unwrap_or(world.settings.size);
    shot::arrange(&mut world, options, || {
        let Edits { set, only, hide, .. } = options.edits.clone();
        let edits = Edits { set, only, hide, ..Edits::default() };
        load_again(path, &LoadOptions { time_s: None, edits, ..options.clone() }, sources)
    })?;
    if options.time_s.is_some() && !world.moves {
        let what = "every moment looks the same: it has no Keys, and its glTF files no animations";
        world.warnings.push(what.into());
    }
    Ok(world)
}
