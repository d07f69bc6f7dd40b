//! References to meshes and images in a scene file.

use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

use super::{Written, quote};
use crate::formats::MESHES;
use crate::world::{Assets, FontId, ImageId, MeshId, StrandsId, Texture, TextureId};

/// Writes references to assets: paths relative to the scene's folder, or numbers.
pub(super) struct AssetPaths<'a> {
    pub assets: &'a Assets,
    folder: PathBuf,
    /// The number of meshes from each file, and of each name in it.
    meshes_of: HashMap<&'a Path, HashMap<&'a str, usize>>,
    /// True if assets are referred to by number, as `"#3"`, instead of by file.
    numbered: bool,
}

impl<'a> AssetPaths<'a> {
    pub(super) fn new(assets: &'a Assets, scene: &Path) -> Self {
        let mut meshes_of: HashMap<_, HashMap<_, _>> = HashMap::new();
        for mesh in &assets.meshes {
            if let Some(source) = mesh.source.as_deref() {
                *meshes_of.entry(source).or_default().entry(mesh.name.as_str()).or_default() += 1;
            }
        }
        Self { assets, folder: normal(scene.parent().unwrap_or(Path::new(""))), meshes_of, numbered: false }
    }

    /// Creates references by number.
    pub(super) fn numbers(assets: &'a Assets) -> Self {
        Self { assets, folder: PathBuf::new(), meshes_of: HashMap::new(), numbered: true }
    }

    /// The mesh's file or number in quotes.
    pub(super) fn mesh(&self, id: MeshId) -> Written {
        let number = id.0;
        if self.numbered {
            return quote(&format!("#{number}"));
        }
        let mesh = self.assets.meshes.get(number as usize);
        let mesh = mesh.ok_or_else(|| format!("there is no mesh of number {number}"))?;
        let name =
            if mesh.name.is_empty() { format!("number {number}") } else { format!("\"{}\"", mesh.name) };
        let source = mesh.source.as_deref();
        let source = source
            .ok_or_else(|| format!("mesh {name} has no file to refer to: export it to a .ply file first"))?;
        let extension = source.extension().unwrap_or_default().to_ascii_lowercase();
        if !MESHES.iter().any(|known| extension == *known) {
            let file = source.display();
            return Err(format!(
                "mesh {name} is inside {file}: a scene refers to .ply, .obj and .stl files only"
            ));
        }
        let of_file = self.meshes_of.get(source);
        if of_file.is_some_and(|names| names.values().any(|count| *count > 1)) {
            let file = source.display();
            return Err(format!("mesh {name} is one of several from {file}: a scene cannot say which"));
        }
        // Only OBJ files have several.
        if of_file.is_some_and(|names| names.len() > 1) {
            return self.relative(source, Some(&mesh.name));
        }
        self.relative(source, None)
    }

    /// The path of a glTF file in quotes.
    pub(super) fn model(&self, file: &Path) -> Written {
        self.relative(file, None)
    }

    /// The image's file or number in quotes.
    pub(super) fn image(&self, id: ImageId) -> Written {
        let source = self.assets.images.get(id.0 as usize).map(|image| image.source.as_deref());
        self.file("image", id.0, source)
    }

    /// The path in quotes of a picture that is no asset.
    pub(super) fn picture(&self, file: &Path) -> Written {
        self.relative(file, None)
    }

    /// The file or number of strands in quotes.
    pub(super) fn strands(&self, id: StrandsId) -> Written {
        let source = self.assets.strands.get(id.0 as usize).map(|strands| strands.source.as_deref());
        self.file("strands", id.0, source)
    }

    /// The file or number of a font in quotes.
    pub(super) fn font(&self, id: FontId) -> Written {
        let source = self.assets.fonts.get(id.0 as usize).map(|font| font.source.as_deref());
        self.file("font", id.0, source)
    }

    /// The file of an asset that may exist and may have a file, or its number, in quotes.
    fn file(&self, what: &str, number: u32, source: Option<Option<&Path>>) -> Written {
        if self.numbered {
            return quote(&format!("#{number}"));
        }
        let source = source.ok_or_else(|| format!("there is no {what} of number {number}"))?;
        self.relative(source.ok_or_else(|| format!("{what} number {number} has no file to refer to"))?, None)
    }

    /// The file or number of a texture's image in quotes.
    pub(super) fn image_of(&self, id: TextureId) -> Written {
        let texture = self.assets.textures.get(id.0 as usize);
        let image = texture.and_then(Texture::image);
        self.image(image.ok_or_else(|| format!("there is no texture of number {} with an image", id.0))?)
    }

    /// The path of a file in quotes, with the name of the object in it that is meant.
    fn relative(&self, file: &Path, object: Option<&str>) -> Written {
        let file = normal(file);
        let shared = file.components().zip(self.folder.components()).take_while(|(a, b)| a == b).count();
        let mut path = PathBuf::new();
        if shared == 0 {
            // On another drive.
            path.push(&file);
        } else {
            path.extend(self.folder.components().skip(shared).map(|_| Component::ParentDir));
            path.extend(file.components().skip(shared));
        }
        let text = path.to_str().ok_or_else(|| format!("the path {} is not UTF-8", path.display()))?;
        let separator = std::path::MAIN_SEPARATOR_STR;
        let text = if separator == "/" { text.to_owned() } else { text.replace(separator, "/") };
        quote(&object.map_or(text.clone(), |object| format!("{text}#{object}")))
    }
}

/// The absolute path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let absolute =
        if path.as_os_str().is_empty() { std::env::current_dir() } else { std::path::absolute(path) };
    let mut normal = PathBuf::new();
    for component in absolute.unwrap_or_else(|_| path.to_owned()).components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir => {
                normal.pop();
            }
            other => normal.push(other),
        }
    }
    normal
}
