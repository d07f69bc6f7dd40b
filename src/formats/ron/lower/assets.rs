//! The asset files that a scene refers to, each read only once. Images are read after everything else, in parallel.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::error::LoadError;
use crate::formats::AssetFiles;
use crate::formats::asset_files::identity;
use crate::formats::gltf::GltfModel;
use crate::formats::ron::source::{Raw, SceneText};
use crate::world::{
    FontId, Image, ImageId, MeshId, StrandsId, Texels, Texture, TextureId, TextureSource, World,
};

/// The assets read so far.
pub(super) struct LoweredAssets<'s, 'a> {
    files: &'s mut dyn AssetFiles,
    /// Meshes by their path and by the file's canonical path.
    meshes: HashMap<PathBuf, MeshId>,
    models: HashMap<PathBuf, Rc<GltfModel>>,
    /// Strands and fonts by canonical paths.
    strands: HashMap<PathBuf, StrandsId>,
    fonts: HashMap<PathBuf, FontId>,
    images: HashMap<PathBuf, ImageId>,
    /// Images still to be read: their places in the text, ids and paths.
    named: Vec<Raw<'a>>,
    wanted: Vec<ImageId>,
    paths: Vec<PathBuf>,
    textures: HashMap<TextureKey, TextureId>,
    /// True if `"#3"` refers to the world's existing asset of that number.
    numbered: bool,
}

/// A [`Texture`] by its bits.
type TextureKey = (TextureSource, [u8; 5], [u32; 8]);

impl<'s, 'a> LoweredAssets<'s, 'a> {
    pub(super) fn new(files: &'s mut dyn AssetFiles) -> Self {
        Self {
            files,
            meshes: HashMap::new(),
            strands: HashMap::new(),
            fonts: HashMap::new(),
            models: HashMap::new(),
            images: HashMap::new(),
            named: Vec::new(),
            wanted: Vec::new(),
            paths: Vec::new(),
            textures: HashMap::new(),
            numbered: false,
        }
    }

    /// Enables references by number to existing assets of the world.
    pub(super) fn with_numbers(self) -> Self {
        Self { numbered: true, ..self }
    }

    /// The mesh of the file that `raw` names.
    pub(super) fn mesh(
        &mut self,
        source: &SceneText<'a>,
        raw: Raw<'a>,
        world: &mut World,
    ) -> Result<MeshId, LoadError> {
        let written = path_of(source, raw, "the path of a mesh")?;
        if let Some(number) = self.number(&written, world.assets.meshes.len()) {
            return Ok(MeshId(number));
        }
        let path = source.folder(raw).join(&written);
        if let Some(id) = self.meshes.get(&path) {
            return Ok(*id);
        }
        let file = identity(&path);
        let id = match self.meshes.get(&file) {
            Some(id) => *id,
            None => {
                let read = self.files.mesh(&path, &mut world.assets, &mut world.warnings);
                let mesh = read.map_err(|error| source.nested(raw, error))?;
                world.assets.add_mesh(mesh)
            }
        };
        self.meshes.insert(file, id);
        self.meshes.insert(path, id);
        Ok(id)
    }

    /// The strands of the file that `raw` names.
    pub(super) fn strands(
        &mut self,
        source: &SceneText<'a>,
        raw: Raw<'a>,
        world: &mut World,
    ) -> Result<StrandsId, LoadError> {
        let written = path_of(source, raw, "the path of a .txt or .hair file")?;
        if let Some(number) = self.number(&written, world.assets.strands.len()) {
            return Ok(StrandsId(number));
        }
        let path = source.folder(raw).join(&written);
        let known = self.strands.get(&identity(&path)).copied();
        let id = match known {
            Some(id) => id,
            None => {
                let read = self.files.strands(&path, &mut world.warnings);
                world.assets.strands.push(read.map_err(|error| source.nested(raw, error))?);
                StrandsId(world.assets.strands.len() as u32 - 1)
            }
        };
        self.strands.insert(identity(&path), id);
        Ok(id)
    }

    /// The font of the file that `raw` names.
    pub(super) fn font(
        &mut self,
        source: &SceneText<'a>,
        raw: Raw<'a>,
        world: &mut World,
    ) -> Result<FontId, LoadError> {
        let written = path_of(source, raw, "the path of a .ttf or .otf file")?;
        if let Some(number) = self.number(&written, world.assets.fonts.len()) {
            return Ok(FontId(number));
        }
        let path = source.folder(raw).join(&written);
        let known = self.fonts.get(&identity(&path)).copied();
        let id = match known {
            Some(id) => id,
            None => {
                let read = self.files.font(&path);
                world.assets.fonts.push(read.map_err(|error| source.nested(raw, error))?);
                FontId(world.assets.fonts.len() as u32 - 1)
            }
        };
        self.fonts.insert(identity(&path), id);
        Ok(id)
    }

    /// The number in a text such as `#3`, if references by number are enabled and it is below `count`.
    fn number(&self, written: &Path, count: usize) -> Option<u32> {
        let number = written.to_str()?.strip_prefix('#').filter(|_| self.numbered)?;
        number.parse().ok().filter(|number| (*number as usize) < count)
    }

    /// The model of the glTF file that `raw` names, and the file's path.
    pub(super) fn model(
        &mut self,
        source: &SceneText<'a>,
        raw: Raw<'a>,
        world: &mut World,
    ) -> Result<(Rc<GltfModel>, PathBuf), LoadError> {
        let path = source.folder(raw).join(path_of(source, raw, "the path of a glTF file")?);
        let file = identity(&path);
        if let Some(model) = self.models.get(&file) {
            return Ok((model.clone(), path));
        }
        let read = self.files.model(&path, &mut world.assets, &mut world.warnings);
        let model = Rc::new(read.map_err(|error| source.nested(raw, error))?);
        self.models.insert(file, model.clone());
        Ok((model, path))
    }

    /// The image of the file that `raw` names, to be read by [`LoweredAssets::read_images`].
    pub(super) fn image(
        &mut self,
        source: &SceneText<'a>,
        raw: Raw<'a>,
        world: &mut World,
    ) -> Result<ImageId, LoadError> {
        let written = path_of(source, raw, "the path of an image")?;
        if let Some(number) = self.number(&written, world.assets.images.len()) {
            return Ok(ImageId(number));
        }
        let path = source.folder(raw).join(&written);
        if let Some(id) = self.images.get(&path) {
            return Ok(*id);
        }
        let file = identity(&path);
        let id = match self.images.get(&file) {
            Some(id) => *id,
            None => {
                let nothing = Texels::Rgba8(vec![[0; 4]]);
                let id = world.assets.add_image(Image { source: None, width: 1, height: 1, texels: nothing });
                self.named.push(raw);
                self.wanted.push(id);
                self.paths.push(path.clone());
                id
            }
        };
        self.images.insert(file, id);
        self.images.insert(path, id);
        Ok(id)
    }

    /// The path of the picture that `raw` names, which is no asset of the scene. Errors: one that cannot be read.
    pub(super) fn picture(&mut self, source: &SceneText<'a>, raw: Raw<'a>) -> Result<PathBuf, LoadError> {
        let path = source.folder(raw).join(path_of(source, raw, "the path of an image")?);
        self.files.image(&path).map_err(|error| source.nested(raw, error))?;
        Ok(path)
    }

    /// Reads all images requested with [`LoweredAssets::image`].
    pub(super) fn read_images(self, source: &SceneText<'a>, world: &mut World) -> Result<(), LoadError> {
        let read = self.files.images(&self.paths);
        for ((image, id), raw) in read.into_iter().zip(self.wanted).zip(self.named) {
            let image = source.recover(image.map_err(|error| source.nested(raw, error)))?;
            if let Some(image) = image {
                world.assets.images[id.0 as usize] = image.report(&mut world.warnings);
            }
        }
        Ok(())
    }

    /// The id of a texture; equal textures share one. A hash map is used, since `Assets::add_texture` compares a
    /// texture with every other.
    pub(super) fn texture(&mut self, texture: Texture, world: &mut World) -> TextureId {
        if self.numbered {
            // The map lacks the textures that the world already had.
            return world.assets.add_texture(texture);
        }
        let Texture { source, filter, wrap, scale, rotation, offset, uv_set, color_space, factor } = texture;
        let numbers = [scale.x, scale.y, offset.x, offset.y, rotation, factor.r, factor.g, factor.b];
        let names = [filter as u8, wrap[0] as u8, wrap[1] as u8, color_space as u8, uv_set as u8];
        let key = (source, names, numbers.map(f32::to_bits));
        *self.textures.entry(key).or_insert_with(|| {
            world.assets.textures.push(texture);
            TextureId(world.assets.textures.len() as u32 - 1)
        })
    }
}

fn path_of<'a>(source: &SceneText<'a>, raw: Raw<'a>, what: &str) -> Result<PathBuf, LoadError> {
    let path = source.string(raw, what)?;
    if path.is_empty() { Err(source.error(raw.0, "the path is empty")) } else { Ok(PathBuf::from(path)) }
}
