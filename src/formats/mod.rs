//! Files: what a person or another program wrote, read into a [`World`], and what we
//! write ourselves. The only place that knows file formats.

mod edits;
mod extent;
pub mod film_file;
mod framing;
pub mod gltf;
mod names;
pub mod obj;
pub mod picture;
pub mod ply;
pub mod rays;
pub mod ron;
mod shot;
mod studio;
pub mod study;
pub mod surroundings;
mod track;
pub mod triangulate;

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::{LoadError, did_you_mean};
use crate::files;
use crate::world::{Assets, Image, Mesh, SourceFiles, World};
pub use edits::Edits;
use surroundings::Surroundings;

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

/// [`load_with`] nothing special.
pub fn load(path: &Path) -> Result<World, LoadError> {
    load_with(path, &LoadOptions::default())
}

/// Reads a scene by its file name's extension: `.ron`, or a model (`.gltf`, `.glb`) or mesh
/// (`.ply`, `.obj`), which get the camera and light that they lack. What it refers to must lie in its folder or below (see
/// [`SourceFiles::confine`]).
pub fn load_with(path: &Path, options: &LoadOptions) -> Result<World, LoadError> {
    load_again(path, options, &SourceFiles::default())
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

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Reads until the buffer is full or there is no more; says how many bytes there were.
fn fill(from: &mut dyn Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match from.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

/// Reads the files that a scene refers to, whatever their formats are.
pub trait AssetFiles {
    /// Reads a mesh. What it brings along (materials, textures) goes into `assets`, what is
    /// odd but no error into `warnings`.
    fn mesh(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<String>,
    ) -> Result<Arc<Mesh>, LoadError>;

    /// Reads a glTF file. Its meshes and materials go into `assets`.
    fn model(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<String>,
    ) -> Result<gltf::Model, LoadError>;

    /// Reads and decodes a picture.
    fn image(&mut self, path: &Path) -> Result<Arc<Image>, LoadError>;

    /// Reads a scene's own text.
    fn read(&mut self, path: &Path) -> Result<Vec<u8>, LoadError> {
        files::read(path).map_err(LoadError::io(path))
    }

    /// The moment that a scene is read at, in seconds; none: values with keys as at 0, models as their nodes stand
    /// without animations.
    fn time_s(&self) -> Option<f32> {
        None
    }

    /// Reads and decodes several.
    fn images(&mut self, paths: &[PathBuf]) -> Vec<Result<Arc<Image>, LoadError>> {
        paths.iter().map(|path| self.image(path)).collect()
    }
}

/// Files on disk.
#[derive(Default)]
pub struct Files {
    /// Which have been read.
    pub sources: SourceFiles,
    /// Of models.
    pub options: LoadOptions,
}

impl AssetFiles for Files {
    fn mesh(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<String>,
    ) -> Result<Arc<Mesh>, LoadError> {
        match extension(path).as_str() {
            "ply" => {
                let bytes = self.read(path)?;
                self.sources.kept.meshes.decoded(&bytes, path, || ply::parse(&bytes, path).map(Arc::new))
            }
            "obj" => {
                assets.files = self.sources.clone();
                // The loader borrows the assets while it asks for images: they are added afterwards.
                let mut images = Vec::new();
                let first = assets.images.len() as u32;
                let mut decode = |path: &Path| {
                    images.push(self.image(path)?);
                    Ok(crate::world::ImageId(first + images.len() as u32 - 1))
                };
                let mesh = obj::load(path, assets, warnings, &mut decode);
                assets.images.append(&mut images);
                Ok(self.sources.kept.meshes.same(mesh?, Mesh::hash))
            }
            other => {
                let hint = did_you_mean(other, ["ply", "obj"]);
                Err(LoadError::invalid(
                    path,
                    format!("meshes are .ply or .obj files, not \".{other}\"{hint}"),
                ))
            }
        }
    }

    fn model(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<String>,
    ) -> Result<gltf::Model, LoadError> {
        match extension(path).as_str() {
            "gltf" | "glb" => {
                assets.files = self.sources.clone();
                gltf::load(path, &self.options, assets, warnings)
            }
            other => {
                let hint = did_you_mean(other, ["gltf", "glb"]);
                let reason = format!("models are .gltf or .glb files, not \".{other}\"{hint}");
                Err(LoadError::invalid(path, reason))
            }
        }
    }

    fn image(&mut self, path: &Path) -> Result<Arc<Image>, LoadError> {
        picture::load(path, &self.sources)
    }

    fn images(&mut self, paths: &[PathBuf]) -> Vec<Result<Arc<Image>, LoadError>> {
        paths.par_iter().map(|path| picture::load(path, &self.sources)).collect()
    }

    fn time_s(&self) -> Option<f32> {
        self.options.time_s
    }

    fn read(&mut self, path: &Path) -> Result<Vec<u8>, LoadError> {
        self.sources.read(path).map_err(LoadError::io(path))
    }
}
