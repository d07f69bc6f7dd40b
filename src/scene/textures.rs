//! Texture columns and texels.

/// Bits of [`Textures::flags`].
pub mod flag {
    /// Blend four texels.
    pub const BILINEAR: u32 = 1;
    /// Eight-bit values are linear, not sRGB.
    pub const LINEAR: u32 = 2;
    /// Texels are floats.
    pub const FLOAT: u32 = 4;
    /// Shift of the two bits of the wrap mode along u: 0 repeat, 1 clamp, 2 mirror.
    pub const WRAP_U: i32 = 4;
    /// Shift of the two bits of the wrap mode along v.
    pub const WRAP_V: i32 = 6;
}

/// Pictures and how they are looked up, by texture id.
#[derive(Debug, Default)]
pub struct Textures {
    /// See [`flag`].
    pub flags: Vec<u32>,
    /// Width and height in texels.
    pub size: Vec<[f32; 2]>,
    /// The image's first texel in `texels8` or `texels32`.
    pub first: Vec<u32>,
    /// Scale of u and v, then what is added to them.
    pub transform: Vec<[f32; 4]>,
    /// A factor on the result.
    pub factor: Vec<[f32; 3]>,
    /// Eight bits a channel: red lowest, alpha highest.
    pub texels8: Vec<u32>,
    /// Linear floats.
    pub texels32: Vec<[f32; 3]>,
    /// Value / 255 (0 to 255), then the same through the sRGB curve (256 to 511).
    pub decode: Vec<f32>,
}

impl Textures {
    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.texels8[..]) + size_of_val(&self.texels32[..])
    }
}
