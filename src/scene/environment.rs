//! What lies infinitely far away.

use crate::math::{Rgb, Vec3};
use crate::sampling::table::Distribution2d;
use crate::world::Background;

/// What rays see that hit nothing, and the light that comes from there.
#[derive(Debug)]
pub struct Environment {
    /// Where there is no picture.
    pub background: Background,
    /// A picture of all directions.
    pub panorama: Option<Panorama>,
}

/// An equirectangular picture: its centre lies along local −Z, its top along +Y.
#[derive(Debug)]
pub struct Panorama {
    /// Texels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance, row by row from the top.
    pub texels: Vec<[f32; 3]>,
    /// A factor on them.
    pub factor: Rgb,
    /// Rows of the rotation from world to local.
    pub to_local: [Vec3; 3],
    /// Where its light comes from: a grid over the picture, every row weighed by the part of the
    /// sphere that it covers.
    pub table: Distribution2d,
}

impl Environment {
    /// The largest component of any radiance that comes from there.
    pub fn brightest(&self) -> f32 {
        match (&self.panorama, self.background) {
            (Some(panorama), _) => {
                let texels = panorama.texels.iter().map(|texel| Rgb::from(*texel).max_component());
                texels.fold(0.0, f32::max) * panorama.factor.max_component()
            }
            (None, Background::Constant(color)) => color.max_component(),
            (None, Background::Gradient { bottom, top }) => bottom.max_component().max(top.max_component()),
        }
    }

    /// Whether no light comes from there.
    pub fn is_black(&self) -> bool {
        match (&self.panorama, self.background) {
            (Some(panorama), _) => panorama.factor.is_black(),
            (None, Background::Constant(color)) => color.is_black(),
            (None, Background::Gradient { bottom, top }) => bottom.is_black() && top.is_black(),
        }
    }
}
