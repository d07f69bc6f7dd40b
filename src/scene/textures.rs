//! Textures and texels.

use std::sync::Arc;

/// Pictures and how they are looked up, by texture id.
#[derive(Debug, Default)]
pub struct Textures {
    /// Eight bits a channel: red lowest, alpha highest.
    pub texels8: Arc<Vec<u32>>,
    /// Linear floats.
    pub texels32: Arc<Vec<[f32; 3]>>,
    /// Value / 255 (0 to 255), then the same through the sRGB curve (256 to 511).
    pub decode: Vec<f32>,
    /// By texture id.
    pub sampled: Vec<SampledTexture>,
    /// Of all images.
    pub levels: Levels,
}

/// How a texture is looked up: one record each, because all lanes that are shaded
/// together have the same material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledTexture {
    /// Rows of the matrix from mesh coordinates to the image's, then what is added.
    pub matrix: [[f32; 3]; 2],
    /// Which of the mesh's sets of coordinates.
    pub uv_set: u32,
    /// A factor on red, green and blue.
    pub factor: [f32; 3],
    /// Blend four texels.
    pub blends: bool,
    /// Eight-bit values go through the sRGB curve.
    pub srgb: bool,
    /// Texels are floats.
    pub float: bool,
    /// Along u and v: 0 repeat, 1 clamp, 2 mirror.
    pub wrap: [u32; 2],
    /// The image's first entry in the tables of levels.
    pub first_level: u32,
    /// Levels after that one, 0 for none.
    pub smaller_levels: u32,
}

/// Images in smaller and smaller copies.
#[derive(Debug, Default, PartialEq)]
pub struct Levels {
    /// The first texel.
    pub first: Vec<u32>,
    /// Width in texels.
    pub width: Vec<f32>,
    /// Height in texels.
    pub height: Vec<f32>,
}

impl Textures {
    /// Width and height of a texture's image in texels.
    pub fn size(&self, sampled: &SampledTexture) -> (f32, f32) {
        let level = sampled.first_level as usize;
        (self.levels.width[level], self.levels.height[level])
    }

    /// The brightest texel of a texture, and about the mean of all, with its factor: the largest components. Texels of 8
    /// bits count as white.
    pub fn brightness(&self, sampled: &SampledTexture) -> (f32, f32) {
        let factor = sampled.factor.into_iter().fold(0.0, f32::max);
        if !sampled.float {
            return (factor, factor);
        }
        let (width, height) = self.size(sampled);
        let first = self.levels.first[sampled.first_level as usize] as usize;
        let texels = &self.texels32[first..first + width as usize * height as usize];
        let (mut most, mut sum) = (0.0f32, 0.0f64);
        for texel in texels {
            let component = texel.iter().copied().fold(0.0, f32::max);
            most = most.max(component);
            sum += f64::from(component);
        }
        (most * factor, (sum / texels.len().max(1) as f64) as f32 * factor)
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.texels8[..]) + size_of_val(&self.texels32[..])
    }
}
