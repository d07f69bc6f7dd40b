//! The files that a scene refers to.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use super::{LoadOptions, MESHES, extension, gltf, obj, picture, ply, references, stl, strands};
use crate::error::{Diagnostic, LoadError, did_you_mean};
use crate::files;
use crate::world::asset_cache::MeshFile;
use crate::world::shapes::check_font;
use crate::world::{
    Assets, BlinnPhong, ColorInput, DecodedImage, Font, Material, MaterialId, Mesh, SourceFiles, Strands,
    Texture,
};

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

    /// Reads curves of hair and the like. Oddities that are no errors are added to `warnings`.
    fn strands(&mut self, path: &Path, warnings: &mut Vec<Diagnostic>) -> Result<Arc<Strands>, LoadError> {
        let (strands, found) = strands::parse(&self.read(path)?, path)?;
        warnings.extend(found);
        Ok(Arc::new(strands))
    }

    /// Reads a font.
    fn font(&mut self, path: &Path) -> Result<Arc<Font>, LoadError> {
        font(path, self.read(path)?)
    }

    /// Reads a scene's own text.
    fn read(&mut self, path: &Path) -> Result<Vec<u8>, LoadError> {
        files::read(path).map_err(LoadError::io(path))
    }

    /// The time at which a scene is read, in seconds. None: keyed values are those at 0 s, and models have the poses of
    /// their nodes, without animations.
    fn time_s(&self) -> Option<f32> {
        None
    }

    /// The values of variables, as text of scene files, by their names.
    fn variables(&self) -> BTreeMap<String, String> {
        BTreeMap::new()
    }

    /// Reads and decodes several images.
    fn images(&mut self, paths: &[PathBuf]) -> Vec<Result<DecodedImage, LoadError>> {
        paths.iter().map(|path| self.image(path)).collect()
    }
}

/// The font of a file's content.
fn font(path: &Path, data: Vec<u8>) -> Result<Arc<Font>, LoadError> {
    let font = Font { source: Some(path.to_owned()), data };
    check_font(&font).map_err(|reason| LoadError::invalid(path, reason))?;
    Ok(Arc::new(font))
}

/// The canonical path of a file; the path itself if the file cannot be found.
pub(super) fn identity(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.components().collect())
}

/// Files on disk.
#[derive(Default)]
pub struct Files {
    /// The files that have been read.
    pub sources: SourceFiles,
    /// Options for reading models.
    pub options: LoadOptions,
    /// The objects of OBJ files of which a scene uses single ones.
    objects: HashMap<PathBuf, Vec<(String, Arc<Mesh>)>>,
}

/// The OBJ file and the object of a path such as `car.obj#wheel`; none if that is the name of a file.
fn object_of(path: &Path) -> Option<(&Path, &str)> {
    let text = path.to_str()?;
    let end = text.to_ascii_lowercase().find(".obj#")? + ".obj".len();
    (!path.is_file()).then(|| (Path::new(&text[..end]), &text[end + 1..]))
}

impl Files {
    /// Files read with options.
    pub fn new(sources: SourceFiles, options: LoadOptions) -> Files {
        Files { sources, options, objects: HashMap::new() }
    }

    /// Reads the objects of an OBJ file with their names.
    pub fn objects(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Vec<(String, Arc<Mesh>)>, LoadError> {
        assets.files = self.sources.clone();
        let parts = obj::load_objects(path, assets, warnings, &mut |path| self.image(path))?;
        let kept = &self.sources.kept.meshes;
        Ok(parts.into_iter().map(|(name, mesh)| (name, kept.same(mesh, Mesh::hash))).collect())
    }

    /// An object of an OBJ file.
    fn object(
        &mut self,
        path: &Path,
        object: &str,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Arc<Mesh>, LoadError> {
        if !self.objects.contains_key(path) {
            let objects = self.objects(path, assets, warnings)?;
            self.objects.insert(path.to_owned(), objects);
        }
        let objects = &self.objects[path];
        let found = objects.iter().find(|(name, _)| name == object);
        found.map(|(_, mesh)| mesh.clone()).ok_or_else(|| {
            let names = || objects.iter().map(|(name, _)| name.as_str());
            let some: Vec<String> = names().take(8).map(|name| format!("{name:?}")).collect();
            let more = if objects.len() > some.len() { ", …" } else { "" };
            let hint = did_you_mean(object, names());
            let list = some.join(", ");
            LoadError::invalid(path, format!("has no object {object:?}{hint}; there are: {list}{more}"))
        })
    }

    /// The mesh of a file with the images on it that the file names: as materials that reflect their colours.
    fn covered(
        &mut self,
        file: &MeshFile,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Arc<Mesh>, LoadError> {
        let Some((first, line)) = file.images.first() else { return Ok(file.mesh.clone()) };
        if file.mesh.uvs.is_empty() {
            let what =
                format!("the image {first:?} is not used: the vertices have no coordinates (s, t) in it");
            warnings.push(Diagnostic::at_line("import", path, *line, what));
            return Ok(file.mesh.clone());
        }
        let is_used = |number: usize| match file.image_of.is_empty() {
            true => number == 0,
            false => file.image_of.contains(&(number as u32)),
        };
        let mut materials = HashMap::new();
        for (number, (name, line)) in file.images.iter().enumerate().take(MOST_IMAGES) {
            if !is_used(number) {
                let what =
                    format!("the image {name:?} is not used: no face has its number (texnumber {number})");
                warnings.push(Diagnostic::at_line("import", path, *line, what));
                continue;
            }
            match self.image(&references::resolve(path, name)) {
                Ok(image) => {
                    let texture = Texture::trilinear(assets.add_image(image.report(warnings)));
                    let diffuse = ColorInput::Texture(assets.add_texture(texture));
                    let material = Material::BlinnPhong(BlinnPhong { diffuse, ..BlinnPhong::default() });
                    let id = assets.add_material(Some(references::stem(name)), material);
                    materials.insert(number as u32, id);
                }
                Err(error) => warnings.push(Diagnostic::warning("image-left-out", error.to_string())),
            }
        }
        let of = |number: u32| materials.get(&number).copied().unwrap_or(MaterialId::DEFAULT);
        let triangle_materials = match file.image_of.is_empty() {
            true => vec![of(0); file.mesh.triangles.len()],
            false => file.image_of.iter().map(|number| of(*number)).collect(),
        };
        let mesh = Mesh { triangle_materials, ..Mesh::clone(&file.mesh) };
        Ok(self.sources.kept.meshes.same(mesh, Mesh::hash))
    }
}

/// The largest number of images on one mesh.
const MOST_IMAGES: usize = 256;

impl AssetFiles for Files {
    fn mesh(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Arc<Mesh>, LoadError> {
        if let Some((path, object)) = object_of(path) {
            return self.object(path, object, assets, warnings);
        }
        match extension(path).as_str() {
            kind @ ("ply" | "stl") => {
                let bytes = self.read(path)?;
                let parse = || {
                    let file =
                        if kind == "ply" { ply::parse(&bytes, path) } else { stl::parse(&bytes, path) };
                    file.map(Arc::new)
                };
                let file = self.sources.kept.mesh_files.decoded(&bytes, path, parse)?;
                warnings.extend(file.warnings.iter().cloned());
                self.covered(&file, path, assets, warnings)
            }
            "obj" => {
                assets.files = self.sources.clone();
                let mesh = obj::load(path, assets, warnings, &mut |path| self.image(path))?;
                Ok(self.sources.kept.meshes.same(mesh, Mesh::hash))
            }
            other => {
                let hint = match other {
                    "gltf" | "glb" => " (an entity with gltf: \"…\" places a glTF file)".to_owned(),
                    _ => did_you_mean(other, MESHES),
                };
                Err(LoadError::invalid(
                    path,
                    format!("meshes are .ply, .obj or .stl files, not \".{other}\"{hint}"),
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

    fn strands(&mut self, path: &Path, warnings: &mut Vec<Diagnostic>) -> Result<Arc<Strands>, LoadError> {
        let bytes = self.read(path)?;
        let parse = || strands::parse(&bytes, path).map(|(strands, found)| (Arc::new(strands), found));
        let (strands, found) = self.sources.kept.strands.decoded(&bytes, path, parse)?;
        warnings.extend(found);
        Ok(strands)
    }

    fn font(&mut self, path: &Path) -> Result<Arc<Font>, LoadError> {
        let data = self.read(path)?;
        self.sources.kept.fonts.decoded(&data, path, || font(path, data.clone()))
    }

    fn time_s(&self) -> Option<f32> {
        self.options.time_s
    }

    fn variables(&self) -> BTreeMap<String, String> {
        self.options.var.clone()
    }

    fn read(&mut self, path: &Path) -> Result<Vec<u8>, LoadError> {
        self.sources.read(path).map_err(LoadError::io(path))
    }
}
