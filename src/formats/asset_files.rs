//! The files that a scene refers to.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use super::{LoadOptions, extension, gltf, obj, picture, ply};
use crate::error::{Diagnostic, LoadError, did_you_mean};
use crate::files;
use crate::world::{Assets, DecodedImage, Mesh, SourceFiles};

/// Reads the files that a scene refers to, in any format.
pub trait AssetFiles {
    /// Reads a mesh. Its materials and textures are added to `assets`, oddities that are no errors to `warnings`.
    fn mesh(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Arc<Mesh>, LoadError>;

    /// Reads a glTF file. Its meshes and materials are added to `assets`.
    fn model(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<gltf::GltfModel, LoadError>;

    /// Reads and decodes an image.
    fn image(&mut self, path: &Path) -> Result<DecodedImage, LoadError>;

    /// Reads a scene's own text.
    fn read(&mut self, path: &Path) -> Result<Vec<u8>, LoadError> {
        files::read(path).map_err(LoadError::io(path))
    }

    /// The time at which a scene is read, in seconds. None: keyed values are those at 0 s, and models have the poses of
    /// their nodes, without animations.
    fn time_s(&self) -> Option<f32> {
        None
    }

    /// Reads and decodes several images.
    fn images(&mut self, paths: &[PathBuf]) -> Vec<Result<DecodedImage, LoadError>> {
        paths.iter().map(|path| self.image(path)).collect()
    }
}

/// Files on disk.
#[derive(Default)]
pub struct Files {
    /// The files that have been read.
    pub sources: SourceFiles,
    /// Options for reading models.
    pub options: LoadOptions,
}

impl AssetFiles for Files {
    fn mesh(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Arc<Mesh>, LoadError> {
        match extension(path).as_str() {
            "ply" => {
                let bytes = self.read(path)?;
                self.sources.kept.meshes.decoded(&bytes, path, || ply::parse(&bytes, path).map(Arc::new))
            }
            "obj" => {
                assets.files = self.sources.clone();
                // The loader borrows the assets while it requests images: they are added afterwards.
                let (mut images, mut odd) = (Vec::new(), Vec::new());
                let first = assets.images.len() as u32;
                let mut decode = |path: &Path| {
                    images.push(self.image(path)?.report(&mut odd));
                    Ok(crate::world::ImageId(first + images.len() as u32 - 1))
                };
                let mesh = obj::load(path, assets, warnings, &mut decode);
                assets.images.append(&mut images);
                warnings.append(&mut odd);
                Ok(self.sources.kept.meshes.same(mesh?, Mesh::hash))
            }
            other => {
                let hint = match other {
                    "gltf" | "glb" => " (an entity with gltf: \"…\" places a glTF file)".to_owned(),
                    _ => did_you_mean(other, ["ply", "obj"]),
                };
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
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<gltf::GltfModel, LoadError> {
        match extension(path).as_str() {
            "gltf" | "glb" => {
                assets.files = self.sources.clone();
                let mut model = gltf::load(path, &self.options, assets, warnings)?;
                // Another model of the scene may have the animation; one that does not move need not.
                if let Some(unknown) = model.unknown_animation.take().filter(|_| model.moves()) {
                    let what = format!("{unknown}: all its animations count");
                    warnings.push(Diagnostic::warning("unknown-animation", what));
                }
                Ok(model)
            }
            other => {
                let hint = did_you_mean(other, ["gltf", "glb"]);
                let reason = format!("models are .gltf or .glb files, not \".{other}\"{hint}");
                Err(LoadError::invalid(path, reason))
            }
        }
    }

    fn image(&mut self, path: &Path) -> Result<DecodedImage, LoadError> {
        picture::load(path, &self.sources)
    }

    fn images(&mut self, paths: &[PathBuf]) -> Vec<Result<DecodedImage, LoadError>> {
        paths.par_iter().map(|path| picture::load(path, &self.sources)).collect()
    }

    fn time_s(&self) -> Option<f32> {
        self.options.time_s
    }

    fn read(&mut self, path: &Path) -> Result<Vec<u8>, LoadError> {
        self.sources.read(path).map_err(LoadError::io(path))
    }
}
