//! Scenes of any format, chosen by the file name's extension.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Edits, EnvironmentPreset, Files, auto_camera, environment_preset, extension, framing, ron};
use crate::error::{LoadError, did_you_mean, in_one_line};
use crate::world::{Model, SourceFiles, World};

/// Options for reading a scene. The default reads it as it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// The time at which animations (of glTF files) and keys (of `.ron` files) are read, in seconds. None: nodes have
    /// the poses in their file, and keyed values are those at 0 s. For `.ron`, `.gltf` and `.glb` files.
    pub time_s: Option<f32>,
    /// The name of a variant of the model's materials (KHR_materials_variants), or its number from 0. For `.gltf` and
    /// `.glb` files.
    pub variant: Option<String>,
    /// The name of one of the model's scenes, or its number from 0. None: the file's default scene. For `.gltf` and
    /// `.glb` files.
    pub scene: Option<String>,
    /// The unit of a model's lights. For glTF files, and `.ron` files that place them.
    pub light_units: LightUnits,
    /// True if glass without a volume encloses a solid body all the same. Otherwise it is a thin sheet, which light
    /// passes without refraction. For glTF files, and `.ron` files that place them.
    pub solid_glass: bool,
    /// True if all surfaces of models are visible from both sides. For glTF files, and `.ron` files that place them.
    pub double_sided: bool,
    /// Surroundings that replace the scene's own environments and skies. None: these stay.
    pub surroundings: Option<EnvironmentPreset>,
    /// Other changes.
    pub edits: Edits,
    /// Columns and rows of the image, each 1 to 65,536, in place of the scene's own.
    pub size: Option<[u32; 2]>,
}

impl LoadOptions {
    /// Fails for options that have no meaning for a file of this kind.
    fn are_for(&self, path: &Path, extension: &str) -> Result<(), LoadError> {
        let (to_gltf, to_scenes) = match extension {
            "gltf" | "glb" => return Ok(()),
            "ron" => (true, false),
            _ => (true, true),
        };
        let gltf = ".gltf and .glb files";
        let scenes = ".gltf and .glb files and .ron files that name these";
        let all = [
            ("variant", to_gltf && self.variant.is_some(), gltf),
            ("scene", to_gltf && self.scene.is_some(), gltf),
            ("light_units", to_scenes && self.light_units != LightUnits::Auto, scenes),
            ("solid_glass", to_scenes && self.solid_glass, scenes),
            ("double_sided", to_scenes && self.double_sided, scenes),
            ("time_s", to_scenes && self.time_s.is_some(), ".gltf, .glb and .ron files"),
        ];
        match all.iter().find(|(_, is_refused, _)| *is_refused) {
            Some((option, _, kinds)) => Err(LoadError::option(
                option,
                format!("this is for {kinds}, not for {}", in_one_line(&path.to_string_lossy())),
            )),
            None => Ok(()),
        }
    }
}

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

/// The unit of the lights in a glTF file. Its specification (KHR_lights_punctual) uses candela and lux; powers here are
/// in watts, so a factor is needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LightUnits {
    /// `Watt` if Blender's exporter wrote the file and its lights are too bright to be watts (which gives a warning),
    /// otherwise `Candela`.
    #[default]
    Auto,
    /// Candela and lux, as in the specification. A lumen counts as a watt, so that a light of 1 cd is as bright as 1 m²
    /// of a surface that emits 1 W m⁻² sr⁻¹.
    Candela,
    /// Candela and lux, but with 683 lumens to a watt. The emission of materials is in watts already.
    Watt,
}

/// Formats of other programs' scenes and meshes, which usually reach glTF through Blender.
const READ_BY_BLENDER: [&str; 12] =
    ["stl", "fbx", "dae", "3ds", "blend", "usd", "usda", "usdc", "usdz", "abc", "x3d", "wrl"];

/// Reads a scene as it is: [`load_with`] the default options.
pub fn load(path: impl AsRef<Path>) -> Result<World, LoadError> {
    load_with(path, &LoadOptions::default())
}

/// Reads a scene. The file name's extension determines its kind: a scene (`.ron`), a model (`.gltf`, `.glb`) or a mesh
/// (`.ply`, `.obj`). Models and meshes get the camera and the light that they lack. All files that a scene refers to
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
            let mut files = Files { options: common, sources: sources.clone() };
            let mut world = ron::load(path, &mut files)?;
            world.assets.files.extend(&files.sources);
            add_camera_for_models(&mut world);
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
                None if ["pbrt", "pov", "xml", "lxs", "scn"].contains(&other) => {
                    ": scenes/MIGRATING.md says how to write such a scene anew".to_owned()
                }
                None if READ_BY_BLENDER.contains(&other) => {
                    ": Blender imports it and exports .glb".to_owned()
                }
                None => did_you_mean(other, known),
            };
            let reason = format!("scenes are .ron, .gltf, .glb, .ply or .obj files, not \".{other}\"{hint}");
            Err(LoadError::invalid(path, reason))
        }
    }?;
    if let Some(surroundings) = &options.surroundings {
        environment_preset::surround(&mut world, surroundings)?;
    }
    if !options.edits.is_empty() {
        let mut files = Files { sources: sources.clone(), ..Files::default() };
        options.edits.apply(&mut world, &mut files)?;
    }
    // The choice depends on the surroundings and the edits, too.
    world.choose_transport();
    world.settings.size = options.size.unwrap_or(world.settings.size);
    auto_camera::place(&mut world, options, || {
        let Edits { set, only, hide, .. } = options.edits.clone();
        let edits = Edits { set, only, hide, ..Edits::default() };
        load_again(path, &LoadOptions { time_s: None, edits, ..options.clone() }, sources)
    })?;
    if options.time_s.is_some() && !world.is_animated {
        let what = "every moment looks the same: it has no Keys, and its glTF files no animations";
        world.warnings.push(what.into());
    }
    Ok(world)
}
