//! Bulk and shared data, referred to by index.

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;

use xxhash_rust::xxh3::Xxh3;

use crate::math::{DVec3, Rgb, Vec2, Vec3, Vec4};

use super::fields::for_each_texture;
use super::material::Material;
use super::procedure::Procedure;
use super::source_files::SourceFiles;

/// Index into [`Assets::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeshId(pub u32);
/// Index into [`Assets::images`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ImageId(pub u32);
/// Index into [`Assets::procedures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ProcedureId(pub u32);
/// Index into [`Assets::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);
/// Index into [`Assets::materials`]. Also a component: the entity's material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);

/// Index into [`Assets::strands`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StrandsId(pub u32);
/// Index into [`Assets::fonts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FontId(pub u32);

/// Data that entities share. Meshes and images are behind pointers, which unchanged ones keep when a scene is read
/// again.
#[derive(Debug)]
pub struct Assets {
    /// Triangle meshes.
    pub meshes: Vec<Arc<Mesh>>,
    /// Decoded images, each file once.
    pub images: Vec<Arc<Image>>,
    /// Textures: images with lookup parameters, and procedures.
    pub textures: Vec<Texture>,
    /// Textures that are computed.
    pub procedures: Vec<Procedure>,
    /// Curves of hair, cables and the like.
    pub strands: Vec<Arc<Strands>>,
    /// Fonts.
    pub fonts: Vec<Arc<Font>>,
    /// Materials; the first one is always the default material.
    pub materials: Vec<NamedMaterial>,
    /// The files that the assets were read from.
    pub(crate) files: SourceFiles,
}

impl Default for Assets {
    fn default() -> Self {
        Self {
            meshes: Vec::new(),
            images: Vec::new(),
            textures: Vec::new(),
            procedures: Vec::new(),
            strands: Vec::new(),
            fonts: Vec::new(),
            materials: vec![NamedMaterial::default()],
            files: SourceFiles::default(),
        }
    }
}

impl Assets {
    /// True for each material that has a texture of what is at a mesh's vertices.
    pub(crate) fn looks_up_vertices(&self) -> Vec<bool> {
        let mut textures = Vec::with_capacity(self.textures.len());
        for texture in &self.textures {
            let mut depends = false;
            if let TextureSource::Procedure(id) = texture.source {
                let procedure = &self.procedures[id.0 as usize];
                depends = procedure.is_at_vertices();
                procedure.for_each_input(&mut |input| depends |= textures[input.0 as usize]);
            }
            textures.push(depends);
        }
        let looks_up = |named: &NamedMaterial| {
            let mut found = false;
            for_each_texture(named.material.clone().part(), &mut |id, _| found |= textures[id.0 as usize]);
            found
        };
        self.materials.iter().map(looks_up).collect()
    }

    /// Returns a material's name, or a generated one if it has none.
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

    /// Adds a mesh made from files, or the cached equal one if there is one.
    pub(crate) fn add_made_mesh(&mut self, mesh: Mesh) -> MeshId {
        let mesh = self.files.kept.meshes.same(mesh, Mesh::hash);
        self.add_mesh(mesh)
    }

    /// Adds an image.
    pub fn add_image(&mut self, image: impl Into<Arc<Image>>) -> ImageId {
        self.images.push(image.into());
        ImageId(self.images.len() as u32 - 1)
    }

    /// Adds an image made from files, or the cached equal one if there is one.
    pub(crate) fn add_made_image(&mut self, image: Image) -> ImageId {
        let image = self.files.kept.computed.same(image, Image::hash);
        self.add_image(image)
    }

    /// Adds a texture, or returns the id of an equal one that was added before.
    pub fn add_texture(&mut self, texture: Texture) -> TextureId {
        let found = self.textures.iter().position(|t| *t == texture);
        TextureId(found.unwrap_or_else(|| {
            self.textures.push(texture);
            self.textures.len() - 1
        }) as u32)
    }

    /// The image of a texture; none if it is computed, or does not exist.
    pub fn image_of(&self, texture: TextureId) -> Option<&Arc<Image>> {
        self.images.get(self.textures.get(texture.0 as usize)?.image()?.0 as usize)
    }

    /// Adds a texture that is computed; returns that of an equal one if there is one.
    pub fn add_procedure(&mut self, procedure: Procedure) -> TextureId {
        let found = self.procedures.iter().position(|known| *known == procedure);
        let id = found.unwrap_or_else(|| {
            self.procedures.push(procedure);
            self.procedures.len() - 1
        });
        self.add_texture(Texture::of_procedure(ProcedureId(id as u32)))
    }

    /// Adds a material; `name` is its name in scene files, if it has one.
    pub fn add_material(&mut self, name: Option<String>, material: Material) -> MaterialId {
        self.materials.push(NamedMaterial { name, material });
        MaterialId(self.materials.len() as u32 - 1)
    }
}

/// A material and its name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NamedMaterial {
    /// The name that the author gave it, if any.
    pub name: Option<String>,
    /// The material.
    pub material: Material,
}

/// An indexed triangle mesh in local space. Each column has one entry per vertex or per triangle, or is empty.
/// Positions, normals, tangents and texture coordinates are finite, and every index is within `positions`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The name given by the author or the file.
    pub name: String,
    /// The file it was read from, if any; a saved scene refers to it.
    pub source: Option<PathBuf>,
    /// The point that positions are relative to, in metres: meshes far from (0, 0, 0) keep their details.
    pub origin: DVec3,
    /// Vertex positions in metres, relative to [`Mesh::origin`].
    pub positions: Vec<Vec3>,
    /// Shading normals, one per vertex, or empty for flat shading. They need not be of unit length; a zero normal means
    /// flat shading at that vertex.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per vertex, or empty. (0, 0) is the image's top left.
    pub uvs: Vec<Vec2>,
    /// A second set of texture coordinates, or empty.
    pub uvs1: Vec<Vec2>,
    /// Unit tangents in the direction of increasing u, and w = ±1 for the sign of the bitangent `w · normal × tangent`;
    /// one per vertex, or empty.
    pub tangents: Vec<Vec4>,
    /// Linear factors on the diffuse colour, one per vertex, or empty. That of [`MaterialId::DEFAULT`] is white on a
    /// mesh with colours.
    pub colors: Vec<Rgb>,
    /// Factors on alpha, one per vertex, or empty.
    pub alphas: Vec<f32>,
    /// Three vertex indices per triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// The mesh's own material for each triangle, or empty. An entity's [`MaterialId`] component takes precedence.
    pub triangle_materials: Vec<MaterialId>,
}

impl Mesh {
    /// The size of all columns in bytes.
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

    /// A hash of all of the mesh.
    pub(crate) fn hash(&self) -> u128 {
        let Self { name, source, origin, positions, normals, uvs, uvs1, tangents, colors, alphas, .. } = self;
        let mut hasher = Xxh3::new();
        let mut column = |bytes: &[u8]| {
            hasher.update(&bytes.len().to_le_bytes());
            hasher.update(bytes);
        };
        column(name.as_bytes());
        column(source.as_deref().map_or(&[], |path| path.as_os_str().as_encoded_bytes()));
        let colors: Vec<[f32; 3]> = colors.iter().map(|color| color.to_array()).collect();
        let materials: Vec<u32> = self.triangle_materials.iter().map(|id| id.0).collect();
        column(bytemuck::cast_slice(&origin.to_array()));
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

/// Curves through points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strands {
    /// The file that they were read from, if any.
    pub source: Option<PathBuf>,
    /// The points of all strands, one strand after the other, in metres; finite.
    pub points: Vec<Vec3>,
    /// The radius at each point, in metres, finite and at least 0; or empty.
    pub radii_m: Vec<f32>,
    /// The number of points up to the end of each strand, in ascending order.
    pub ends: Vec<u32>,
}

/// A TrueType or OpenType font.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Font {
    /// The file that it was read from, if any.
    pub source: Option<PathBuf>,
    /// The content of its file.
    pub data: Vec<u8>,
}

/// A decoded image, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The file it was read from, if any.
    pub source: Option<PathBuf>,
    /// Pixels per row, above zero.
    pub width: u32,
    /// The number of rows, above zero.
    pub height: u32,
    /// `width * height` pixels.
    pub texels: Texels,
}

impl Image {
    /// A hash of all of the image.
    pub(crate) fn hash(&self) -> u128 {
        let mut hasher = Xxh3::new();
        hasher.update(self.source.as_deref().map_or(&[], |path| path.as_os_str().as_encoded_bytes()));
        hasher.update(bytemuck::bytes_of(&[self.width, self.height]));
        hasher.update(match &self.texels {
            Texels::Rgba8(texels) => bytemuck::cast_slice(texels),
            Texels::Rgba16(texels) => bytemuck::cast_slice(texels),
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
    /// Channels of sixteen bits, encoded likewise.
    Rgba16(Vec<[u16; 4]>),
    /// Linear floats, finite: red, green, blue.
    Rgb32(Vec<[f32; 3]>),
}

impl Texels {
    /// The number of texels.
    pub(crate) fn count(&self) -> usize {
        match self {
            Texels::Rgba8(texels) => texels.len(),
            Texels::Rgba16(texels) => texels.len(),
            Texels::Rgb32(texels) => texels.len(),
        }
    }

    /// The stored channels of a texel, from 0 to 1 unless they are floats: red, green, blue, and alpha or 1.
    pub(crate) fn stored(&self, at: usize) -> [f64; 4] {
        match self {
            Texels::Rgba8(texels) => texels[at].map(|byte| f64::from(byte) / 255.0),
            Texels::Rgba16(texels) => texels[at].map(|word| f64::from(word) / 65_535.0),
            Texels::Rgb32(texels) => {
                let [r, g, b] = texels[at].map(f64::from);
                [r, g, b, 1.0]
            }
        }
    }
}

/// The reconstruction filter between texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureFilter {
    /// The texel whose square contains the point.
    Nearest,
    /// A blend of the four texels around the point.
    #[default]
    Bilinear,
    /// Bilinear in mip levels, chosen by the size of the ray's footprint. Under the Whitted transport this is
    /// [`TextureFilter::Bilinear`].
    Trilinear,
}

/// The treatment of texture coordinates outside the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Repeats the image.
    #[default]
    Repeat,
    /// Extends the image's border.
    Clamp,
    /// Repeats the image, mirrored at every edge.
    Mirror,
}

impl Wrap {
    /// The number in compiled scenes, from 0 in the order of the modes.
    pub(crate) fn number(self) -> u32 {
        match self {
            Wrap::Repeat => 0,
            Wrap::Clamp => 1,
            Wrap::Mirror => 2,
        }
    }
}

/// The encoding of the values of images with 8 or 16 bits a channel; floats are linear.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorSpace {
    /// The sRGB curve (IEC 61966-2-1).
    #[default]
    Srgb,
    /// Linear values.
    Linear,
}

/// The texels of a [`Texture`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureSource {
    /// An image.
    Image(ImageId),
    /// A procedure, which has a place of its own: only the texture's `factor` counts.
    Procedure(ProcedureId),
}

/// An image with its lookup parameters: it is sampled at `rotate(uv * scale) + offset`. Or a procedure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture {
    /// The image or procedure.
    pub source: TextureSource,
    /// The filter between texels.
    pub filter: TextureFilter,
    /// The wrap mode along u and v.
    pub wrap: [Wrap; 2],
    /// The number of repetitions of the image per unit of uv.
    pub scale: Vec2,
    /// The rotation after scaling, in radians, clockwise around (0, 0) as v points down (KHR_texture_transform: the
    /// matrix cos sin / −sin cos).
    pub rotation: f32,
    /// The offset, added after the rotation.
    pub offset: Vec2,
    /// The mesh's set of texture coordinates: 0 or 1.
    pub uv_set: u32,
    /// The encoding of images with 8 or 16 bits a channel.
    pub color_space: ColorSpace,
    /// A factor on the sampled colour.
    pub factor: Rgb,
}

impl Texture {
    /// Returns a texture for colours: bilinear, repeated, sRGB-encoded, not transformed.
    pub fn new(image: ImageId) -> Self {
        Self {
            source: TextureSource::Image(image),
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

    /// A texture that is computed.
    pub fn of_procedure(procedure: ProcedureId) -> Self {
        Self { source: TextureSource::Procedure(procedure), ..Self::of_numbers(ImageId(0)) }
    }

    /// The image, unless the texture is computed.
    pub fn image(&self) -> Option<ImageId> {
        match self.source {
            TextureSource::Image(image) => Some(image),
            TextureSource::Procedure(_) => None,
        }
    }

    /// An image as used by files that do not say how to filter it.
    #[cfg(feature = "formats")]
    pub(crate) fn trilinear(image: ImageId) -> Self {
        Self { filter: TextureFilter::Trilinear, ..Self::new(image) }
    }

    /// Returns a texture for numbers, such as roughness, normals and heights: bilinear, repeated, linear, not
    /// transformed.
    pub fn of_numbers(image: ImageId) -> Self {
        Self { color_space: ColorSpace::Linear, ..Self::new(image) }
    }
}
