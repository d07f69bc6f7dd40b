//! Textures and texels.

use std::sync::Arc;

use super::procedures::{RampStop, TextureStep};

/// Images and the parameters of their lookups, by texture id.
#[derive(Debug, Default)]
pub struct Textures {
    /// Eight bits a channel: red lowest, alpha highest.
    pub texels8: Arc<Vec<u32>>,
    /// Texels of linear floats.
    pub texels32: Arc<Vec<[f32; 3]>>,
    /// Decoding table of 8-bit values: value / 255 (0 to 255), then decoded from sRGB (256 to 511).
    pub decode: Vec<f32>,
    /// Lookup parameters by texture id.
    pub sampled: Vec<SampledTexture>,
    /// The mip levels of all images.
    pub levels: Levels,
    /// The steps of procedural textures.
    pub steps: Vec<TextureStep>,
    /// The stops of their ramps.
    pub stops: Vec<RampStop>,
}

/// The parameters of a texture lookup: one record per texture, because all lanes that are shaded together have the same
/// material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledTexture {
    /// The rows of the affine map from the mesh's texture coordinates to the image's; the translation is last.
    pub matrix: [[f32; 3]; 2],
    /// The set of texture coordinates of the mesh.
    pub uv_set: u32,
    /// A factor on red, green and blue.
    pub factor: [f32; 3],
    /// True to interpolate four texels.
    pub blends: bool,
    /// True to decode 8-bit values from sRGB.
    pub srgb: bool,
    /// True if texels are floats.
    pub float: bool,
    /// Wrap modes along u and v: 0 repeat, 1 clamp, 2 mirror.
    pub wrap: [u32; 2],
    /// The image's first entry in the tables of [`Levels`].
    pub first_level: u32,
    /// The number of smaller levels after that one; 0 for none.
    pub smaller_levels: u32,
    /// The range of the steps of a procedural texture in [`Textures::steps`]; empty for an image.
    pub program: [u32; 2],
    /// The largest component and the approximate mean of a procedural texture.
    pub levels: [f32; 2],
}

impl SampledTexture {
    /// True if the texture has no image.
    pub fn is_procedural(&self) -> bool {
        self.program[0] < self.program[1]
    }
}

/// Mip levels of images.
#[derive(Debug, Default, PartialEq)]
pub struct Levels {
    /// Index of the level's first texel.
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

    /// The brightest texel of a texture and its approximate mean, with its factor: the largest components. Texels of 8
    /// bits count as white.
    pub fn brightness(&self, sampled: &SampledTexture) -> (f32, f32) {
        if sampled.is_procedural() {
            return sampled.levels.into();
        }
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

    /// The size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.texels8[..]) + size_of_val(&self.texels32[..])
    }
}
