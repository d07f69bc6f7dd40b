//! The background, infinitely far away.

use crate::math::{Rgb, Vec3};
use crate::sampling::table::Distribution2d;
use crate::world::Background;

/// The radiance of rays that hit nothing, and the light from there.
#[derive(Debug)]
pub struct Environment {
    /// The background if there is no panorama.
    pub background: Background,
    /// An image of all directions.
    pub panorama: Option<Panorama>,
    /// The radiance that camera rays see instead.
    pub backdrop: Option<Background>,
}

/// An equirectangular image: its centre lies along local −Z, its top along +Y.
#[derive(Debug)]
pub struct Panorama {
    /// Texels per row.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// Radiance, row by row from the top.
    pub texels: Vec<[f32; 3]>,
    /// A factor on the texels.
    pub factor: Rgb,
    /// Rows of the rotation from world to local.
    pub to_local: [Vec3; 3],
    /// The distribution of the panorama's light: a grid over the image, with each row weighted by the part of the
    /// sphere that it covers.
    pub table: Distribution2d,
    /// The approximate irradiance that the table represents, as luminance, without the factor.
    pub irradiance: f32,
}

impl Environment {
    /// The largest component of any radiance of the environment or backdrop, and the approximate mean of its light.
    pub fn levels(&self) -> (f32, f32) {
        let seen = match self.backdrop {
            Some(Background::Constant(color)) => color.max_component(),
            Some(Background::Gradient { bottom, top }) => bottom.max_component().max(top.max_component()),
            None => 0.0,
        };
        let (brightest, usual) = self.light_levels();
        (brightest.max(seen), usual)
    }

    fn light_levels(&self) -> (f32, f32) {
        match (&self.panorama, self.background) {
            (Some(panorama), _) => {
                let (mut most, mut sum) = (0.0f32, 0.0);
                for texel in &panorama.texels {
                    let value = Rgb::from(*texel).max_component();
                    (most, sum) = (most.max(value), sum + f64::from(value));
                }
                let factor = panorama.factor.max_component();
                (most * factor, (sum / panorama.texels.len().max(1) as f64) as f32 * factor)
            }
            (None, Background::Constant(color)) => (color.max_component(), color.max_component()),
            (None, Background::Gradient { bottom, top }) => {
                let (bottom, top) = (bottom.max_component(), top.max_component());
                (bottom.max(top), (bottom + top) * 0.5)
            }
        }
    }

    /// The size in bytes.
    pub fn bytes(&self) -> usize {
        let of = |panorama: &Panorama| size_of_val(&panorama.texels[..]) + panorama.table.bytes();
        self.panorama.as_ref().map_or(0, of)
    }

    /// True if the environment emits no light.
    pub fn is_black(&self) -> bool {
        match (&self.panorama, self.background) {
            (Some(panorama), _) => panorama.factor.is_black(),
            (None, background) => background.is_black(),
        }
    }
}
