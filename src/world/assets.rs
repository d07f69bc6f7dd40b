//! Bulk and shared data, referred to by ids.

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;

use xxhash_rust::xxh3::Xxh3;

use crate::math::{Rgb, Vec2, Vec3, Vec4};

use super::material::Material;
use super::source_files::SourceFiles;

/// Index into [`Assets::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeshId(pub u32);
/// Index into [`Assets::images`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ImageId(pub u32);
/// Index into [`Assets::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);
/// Index into [`Assets::materials`]. Also a component: the entity's material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);

/// Everything that entities share. Meshes and images are behind pointers: when a scene is read again, those that have
/// not changed keep theirs.
#[derive(Debug)]
pub struct Assets {
    /// Triangle meshes.
    pub meshes: Vec<Arc<Mesh>>,
    /// Decoded pictures, each file once.
    pub images: Vec<Arc<Image>>,
    /// Ways of looking up an image.
    pub textures: Vec<Texture>,
    /// Materials. The first is always the default one.
    pub materials: Vec<NamedMaterial>,
    /// The files that all this was read from.
    pub(crate) files: SourceFiles,
}

impl Default for Assets {
    fn default() -> Self {
        Self {
            meshes: Vec::new(),
            images: Vec::new(),
            textures: Vec::new(),
            materials: vec![NamedMaterial::default()],
            files: SourceFiles::default(),
        }
    }
}

impl Assets {
    /// A material's name, or what it is called without one.
    pub(crate) fn material_name(&self, id: MaterialId) -> Cow<'_, str> {
        match (self.materials.get(id.0 as usize).and_then(|named| named.name.as_deref()), id) {
            (Some(name), _) => name.into(),
            (None, MaterialId::DEFAULT) => "default".into(),
            (None, MaterialId(number)) => format!("material {number}").into(),
        }
    }

    /// Adds a mesh.
    pub fn add_mesh(&mut self, mesh: impl Into<Arc<Mesh>>) -> MeshId {
        self.meshes.push(mesh.into());
        MeshId(self.meshes.len() as u32 - 1)
    }

    /// Adds a mesh that was made from files; if an equal one was made before, it is that one.
    pub(crate) fn add_made_mesh(&mut self, mesh: Mesh) -> MeshId {
        let mesh = self.files.kept.meshes.same(mesh, Mesh::hash);
        self.add_mesh(mesh)
    }

    /// Adds an image.
    pub fn add_image(&mut self, image: impl Into<Arc<Image>>) -> ImageId {
        self.images.push(image.into());
        ImageId(self.images.len() as u32 - 1)
    }

    /// Adds an image that was made from files; if an equal one was made before, it is that one.
    pub(crate) fn add_made_image(&mut self, image: Image) -> ImageId {
        let image = self.files.kept.images.same(image, Image::hash);
        self.add_image(image)
    }

    /// Adds a texture; if an equal one is there already, it is that one.
    pub fn add_texture(&mut self, texture: Texture) -> TextureId {
        let found = self.textures.iter().position(|t| *t == texture);
        TextureId(found.unwrap_or_else(|| {
            self.textures.push(texture);
            self.textures.len() - 1
        }) as u32)
    }

    /// Adds a material; `name` is what scene files call it, if they have a name for it.
    pub fn add_material(&mut self, name: Option<String>, material: Material) -> MaterialId {
        self.materials.push(NamedMaterial { name, material });
        MaterialId(self.materials.len() as u32 - 1)
    }
}

/// A material and what it is called.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NamedMaterial {
    /// The author's name for it, if it has one.
    pub name: Option<String>,
    /// The material.
    pub material: Material,
}

/// An indexed triangle mesh in local space. Each column has one entry for every vertex, or for every triangle, or is
/// empty. Positions, normals, tangents and texture coordinates are finite, and every index is within `positions`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// What the author or the file calls it.
    pub name: String,
    /// The file that it came from, if any; what a saved scene refers to.
    pub source: Option<PathBuf>,
    /// Vertices in metres.
    pub positions: Vec<Vec3>,
    /// Shading normals, one for each vertex, or empty for flat shading. They need not be of unit length; a zero
    /// normal means "flat here".
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one a vertex, or empty. (0, 0) is the image's top left.
    pub uvs: Vec<Vec2>,
    /// A second set of texture coordinates, or empty.
    pub uvs1: Vec<Vec2>,
    /// Unit tangents along which u grows, and ±1 for the side of the bitangent
    /// `w · normal × tangent`; one a vertex, or empty.
    pub tangents: Vec<Vec4>,
    /// Linear factors on the diffuse colour, one a vertex, or empty.
    pub colors: Vec<Rgb>,
    /// Factors on alpha, one a vertex, or empty.
    pub alphas: Vec<f32>,
    /// Three vertex indices a triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// The mesh's own material for each triangle, or empty. An entity's [`MaterialId`] component takes precedence.
    pub triangle_materials: Vec<MaterialId>,
}

impl Mesh {
    /// Bytes of its vertices and triangles.
    pub(crate) fn bytes(&self) -> usize {
        let Self { positions, normals, uvs, uvs1, tangents, colors, alphas, .. } = self;
        size_of_val(&positions[..])
            + size_of_val(&normals[..])
            + size_of_val(&uvs[..])
            + size_of_val(&uvs1[..])
            + size_of_val(&tangents[..])
            + size_of_val(&colors[..])
            + size_of_val(&alphas[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.triangle_materials[..])
    }

    /// Of all that it is.
    pub(crate) fn hash(&self) -> u128 {
        let Self { name, source, positions, normals, uvs, uvs1, tangents, colors, alphas, .. } = self;
        let mut hasher = Xxh3::new();
        let mut column = |bytes: &[u8]| {
            hasher.update(&bytes.len().to_le_bytes());
            hasher.update(bytes);
        };
        column(name.as_bytes());
        column(source.as_deref().map_or(&[], |path| path.as_os_str().as_encoded_bytes()));
        let colors: Vec<[f32; 3]> = colors.iter().map(|color| color.to_array()).collect();
        let materials: Vec<u32> = self.triangle_materials.iter().map(|id| id.0).collect();
        column(bytemuck::cast_slice(positions));
        column(bytemuck::cast_slice(normals));
        column(bytemuck::cast_slice(uvs));
        column(bytemuck::cast_slice(uvs1));
        column(bytemuck::cast_slice(tangents));
        column(bytemuck::cast_slice(&colors));
        column(bytemuck::cast_slice(alphas));
        column(bytemuck::cast_slice(&self.triangles));
        column(bytemuck::cast_slice(&materials));
        hasher.digest128()
    }
}

/// A decoded picture, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The file that it came from, if any.
    pub source: Option<PathBuf>,
    /// Pixels a row, above zero.
    pub width: u32,
    /// Rows, above zero.
    pub height: u32,
    /// `width * height` pixels.
    pub texels: Texels,
}

impl Image {
    /// Of all that it is.
    pub(crate) fn hash(&self) -> u128 {
        let mut hasher = Xxh3::new();
        hasher.update(self.source.as_deref().map_or(&[], |path| path.as_os_str().as_encoded_bytes()));
        hasher.update(bytemuck::bytes_of(&[self.width, self.height]));
        hasher.update(match &self.texels {
            Texels::Rgba8(texels) => bytemuck::cast_slice(texels),
            Texels::Rgb32(texels) => bytemuck::cast_slice(texels),
        });
        hasher.digest128()
    }
}

/// The pixels of an [`Image`].
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// Eight bits a channel: red, green, blue in the sRGB curve (unless a texture
    /// says otherwise), then linear alpha.
    Rgba8(Vec<[u8; 4]>),
    /// Linear floats, finite: red, green, blue.
    Rgb32(Vec<[f32; 3]>),
}

/// What lies between texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureFilter {
    /// The texel whose square the point is in.
    Nearest,
    /// A blend of the four texels around the point.
    #[default]
    Bilinear,
    /// The same in smaller copies of the image (mip levels), chosen by the size of the ray's footprint. Under the
    /// Whitted transport this is [`TextureFilter::Bilinear`].
    Trilinear,
}

/// What lies outside the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image's border.
    Clamp,
    /// The image mirrored at every edge.
    Mirror,
}

/// How an eight-bit image's values are to be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorSpace {
    /// By the sRGB curve (IEC 61966-2-1).
    #[default]
    Srgb,
    /// As they are.
    Linear,
}

/// An image and how it is looked up: at `rotate(uv * scale) + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture {
    /// Which image.
    pub image: ImageId,
    /// Between texels.
    pub filter: TextureFilter,
    /// Outside the unit square, along u and v.
    pub wrap: [Wrap; 2],
    /// How often the image fits into a unit of uv.
    pub scale: Vec2,
    /// Clockwise around (0, 0) as v points down, in radians (KHR_texture_transform: the matrix
    /// cos sin / −sin cos), after scaling.
    pub rotation: f32,
    /// Added after rotating.
    pub offset: Vec2,
    /// Which of the mesh's sets of texture coordinates: 0 or 1.
    pub uv_set: u32,
    /// For eight-bit images.
    pub color_space: ColorSpace,
    /// A factor on what was looked up.
    pub factor: Rgb,
}

impl Texture {
    /// The image as it is, for colours: bilinear, repeated, in the sRGB curve, not transformed.
    pub fn new(image: ImageId) -> Self {
        Self {
            image,
            filter: TextureFilter::default(),
            wrap: [Wrap::Repeat; 2],
            scale: Vec2::ONE,
            rotation: 0.0,
            offset: Vec2::ZERO,
            uv_set: 0,
            color_space: ColorSpace::Srgb,
            factor: Rgb::WHITE,
        }
    }

    /// The same for numbers, such as roughness, normals and heights: values as they are stored.
    pub fn of_numbers(image: ImageId) -> Self {
        Self { color_space: ColorSpace::Linear, ..Self::new(image) }
    }
}
