//! Material columns.

use crate::math::NONE;

/// Bits of [`Materials::flags`].
pub mod flag {
    /// The specular lobe is Phong's, not Blinn's.
    pub const PHONG: u32 = 1;
    /// Only the side that the normal points to gives off light.
    pub const ONE_SIDED_EMISSION: u32 = 2;
}

/// Parameters by material id.
#[derive(Debug, Default)]
pub struct Materials {
    /// kd.
    pub diffuse: ColorColumn,
    /// ks.
    pub specular: ColorColumn,
    /// Weight of the reflection.
    pub kr: ColorColumn,
    /// Radiance given off.
    pub emission: ColorColumn,
    /// Weight of the refraction.
    pub kt: Vec<[f32; 3]>,
    /// Exponent of the specular lobe.
    pub shininess: Vec<f32>,
    /// See [`flag`].
    pub flags: Vec<u32>,
    /// Index of refraction, 0 where light does not enter.
    pub ior: Vec<f32>,
    /// What people call them.
    pub names: Vec<String>,
}

/// A colour for each material: a constant, or the factor on a texture.
#[derive(Debug, Default)]
pub struct ColorColumn {
    /// Colours.
    pub constant: Vec<[f32; 3]>,
    /// Texture ids, [`NONE`] for none.
    pub texture: Vec<u32>,
}

impl ColorColumn {
    /// Whether any material has a texture here.
    pub fn is_textured(&self) -> bool {
        self.texture.iter().any(|t| *t != NONE)
    }
}
