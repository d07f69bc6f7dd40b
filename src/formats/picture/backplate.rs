//! Pixels as files get them, and those of a backplate, which an image shows behind things.

use std::borrow::Cow;

use image::imageops::{FilterType, crop_imm, resize};
use image::{ImageBuffer, Rgb as Texel, Rgb32FImage};

use super::decode_unchanged;
use crate::denoise::Denoised;
use crate::error::LoadError;
use crate::film::alpha::{Transparency, opacity, unassociated};
use crate::film::texels::linear_colors;
use crate::film::tonemap::{srgb_decode, srgb_encode};
use crate::film::{Film, Region};
use crate::math::Rgb;
use crate::world::{Backplate, Image, Settings, Texels};

/// The pixels of a film's image, row by row from the top.
pub struct ImagePixels<'a> {
    /// Their radiance, with or without noise.
    pub radiance: Cow<'a, [Rgb]>,
    /// Their opacity, if the film counts it.
    pub alpha: Option<Vec<f32>>,
    /// The parts of colours that they let through, if the film counts opacity.
    pub transparency: Option<Vec<Transparency>>,
    /// The part of a backplate that they show, as linear display values.
    pub behind: Option<Vec<Rgb>>,
}

impl<'a> ImagePixels<'a> {
    /// The pixels of a film, or denoised ones, before a [`backplate`].
    pub fn new(film: &Film, plate: Option<&[Rgb]>, denoised: Option<&'a Denoised>) -> ImagePixels<'a> {
        let radiance = match denoised {
            Some(denoised) => Cow::Borrowed(&denoised.radiance[..]),
            None => Cow::Owned(film.radiance()),
        };
        let clean = |of: &dyn Fn(&'a Denoised) -> Option<&'a Vec<Rgb>>, at: usize| {
            denoised.and_then(of).and_then(|pixels| pixels.get(at).copied())
        };
        let let_through =
            |at: usize| clean(&|it| it.let_through.as_ref(), at).unwrap_or_else(|| film.let_through(at));
        let without_shadows =
            |at: usize| clean(&|it| it.without_shadows.as_ref(), at).or_else(|| film.without_shadows(at));
        let counts = film.counts_opacity();
        let places = || counts.then_some(0..radiance.len());
        let alpha = places().map(|all| all.map(|at| opacity(let_through(at))).collect());
        let transparency_of = |at: usize| Transparency::new(let_through(at), without_shadows(at));
        let transparency = places().map(|all| all.map(transparency_of).collect());
        let seen = |(at, plate): (usize, &Rgb)| *plate * let_through(at);
        let behind = plate.filter(|_| counts).map(|plate| plate.iter().enumerate().map(seen).collect());
        ImagePixels { radiance, alpha, transparency, behind }
    }

    /// The colours by themselves, without the opacity that they are associated with.
    pub fn own_colors(&self) -> Cow<'_, [Rgb]> {
        unassociated(&self.radiance, self.alpha.as_deref())
    }
}

/// The backplate of an image in a region: a linear display value for each pixel, row by row from the top.
/// None without a backplate, and in transparent images. A picture is scaled so that it covers the whole image, and what
/// is left over is cut off on both sides.
///
/// Errors: a picture that cannot be read.
pub fn backplate(settings: &Settings, region: Region) -> Result<Option<Vec<Rgb>>, LoadError> {
    let Some(plate) = settings.backplate.as_ref().filter(|_| !settings.transparent) else { return Ok(None) };
    let [width, height] = settings.size;
    let pixels = match plate {
        Backplate::Constant(color) => vec![*color; region.area()],
        Backplate::Gradient { bottom, top } => {
            let row = |y: u32| gradient(*bottom, *top, (y as f32 + 0.5) / height as f32);
            (region.y0..region.y1).flat_map(|y| vec![row(y); region.width() as usize]).collect()
        }
        Backplate::Image(path) => {
            let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
            let whole = covering(&decode_unchanged(&bytes, path)?, [width, height]);
            let part = crop_imm(&whole, region.x0, region.y0, region.width(), region.height()).to_image();
            part.pixels().map(|Texel(color)| Rgb::from(*color)).collect()
        }
    };
    Ok(Some(pixels))
}

/// A colour between two, given by its way from the top. Steps are even to the eye, as those of gradients in CSS are.
fn gradient(bottom: Rgb, top: Rgb, down: f32) -> Rgb {
    let [bottom, top] = [bottom, top].map(|color| color.to_array().map(srgb_encode));
    let mix = |at: usize| srgb_decode(top[at] + (bottom[at] - top[at]) * down);
    Rgb::from([0, 1, 2].map(mix))
}

/// An image scaled to a size: its middle, as much as has the format of that size.
fn covering(image: &Image, [width, height]: [u32; 2]) -> Rgb32FImage {
    let part = |of: u32, other: u32, size: u32, other_size: u32| {
        let fitting = f64::from(other) * f64::from(size) / f64::from(other_size);
        (fitting.round() as u32).clamp(1, of)
    };
    let across = part(image.width, image.height, width, height);
    let down = part(image.height, image.width, height, width);
    let texels = opaque(&image.texels).into_flattened();
    let all: Rgb32FImage = ImageBuffer::from_raw(image.width, image.height, texels).unwrap_or_default();
    let middle = crop_imm(&all, (image.width - across) / 2, (image.height - down) / 2, across, down);
    // Its weights of far texels are not negative, so flat colours stay as they are, and edges have no halos.
    resize(&*middle, width, height, FilterType::Triangle)
}

/// The colours of texels on white, from 0 to 1.
fn opaque(texels: &Texels) -> Vec<[f32; 3]> {
    let alpha = |at: usize| match texels {
        Texels::Rgba8(texels) => f32::from(texels[at][3]) / 255.0,
        Texels::Rgba16(texels) => f32::from(texels[at][3]) / 65_535.0,
        Texels::Rgb32(_) => 1.0,
    };
    let on_white = |(at, color): (usize, &[f32; 3])| {
        let alpha = alpha(at);
        // False for NaN.
        color.map(|value| if value > 0.0 { value.min(1.0) } else { 0.0 } * alpha + (1.0 - alpha))
    };
    linear_colors(texels).iter().enumerate().map(on_white).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(backplate: Backplate, size: [u32; 2]) -> Settings {
        Settings { size, backplate: Some(backplate), ..Settings::default() }
    }

    /// The pixels behind the whole of an image.
    fn whole(settings: &Settings) -> Vec<Rgb> {
        backplate(settings, Region::whole(settings.size)).expect("a picture").expect("a backplate")
    }

    #[test]
    fn there_is_nothing_behind_an_image_without_a_backplate_or_with_an_opacity() {
        let plain = Settings { size: [2, 2], ..Settings::default() };
        let region = Region::whole([2, 2]);
        assert_eq!(backplate(&plain, region).expect("nothing to read"), None);
        let white = settings(Backplate::Constant(Rgb::WHITE), [2, 2]);
        assert_eq!(backplate(&white, region).expect("nothing to read"), Some(vec![Rgb::WHITE; 4]));
        let transparent = Settings { transparent: true, ..white };
        assert_eq!(backplate(&transparent, region).expect("nothing to read"), None);
    }

    #[test]
    fn gradients_go_from_the_top_row_to_the_bottom_row_in_even_steps() {
        let plate = Backplate::Gradient { bottom: Rgb::WHITE, top: Rgb::BLACK };
        let pixels = whole(&settings(plate, [3, 4]));
        let shown: Vec<f32> = pixels.iter().map(|pixel| srgb_encode(pixel.r)).collect();
        for (y, row) in shown.chunks(3).enumerate() {
            let expected = (y as f32 + 0.5) / 4.0;
            assert!(row.iter().all(|value| (value - expected).abs() < 1e-6), "{row:?}");
        }
    }

    #[test]
    fn pictures_cover_images_of_any_format_and_regions_show_parts_of_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("street.png");
        // Red, green, green, blue: the green is in the middle.
        let file = image::RgbImage::from_fn(8, 4, |x, _| {
            Texel([[255, 0, 0], [0, 255, 0], [0, 255, 0], [0, 0, 255]][x as usize / 2])
        });
        file.save(&path).expect("room");
        let plate = Backplate::Image(path.clone());
        let square = whole(&settings(plate.clone(), [4, 4]));
        assert!(square.iter().all(|pixel| *pixel == Rgb::new(0.0, 1.0, 0.0)), "{square:?}");
        let wide = whole(&settings(plate.clone(), [32, 16]));
        assert_eq!((wide[0], wide[31]), (Rgb::new(1.0, 0.0, 0.0), Rgb::new(0.0, 0.0, 1.0)));
        let region = Region { x0: 4, y0: 2, x1: 30, y1: 3 };
        let part =
            backplate(&settings(plate.clone(), [32, 16]), region).expect("a picture").expect("a backplate");
        assert_eq!(part, wide[2 * 32 + 4..2 * 32 + 30]);
        assert_eq!(whole(&settings(plate.clone(), [8, 4]))[3], Rgb::new(0.0, 1.0, 0.0));
        let tall = whole(&settings(plate, [3, 300]));
        assert!(tall.iter().all(|pixel| (pixel.g - 1.0).abs() < 1e-6), "{tall:?}");
        assert!(backplate(&settings(Backplate::Image("none.png".into()), [2, 2]), region).is_err());
    }

    #[test]
    fn transparent_texels_are_on_white() {
        let texels = Texels::Rgba8(vec![[0, 0, 0, 0], [255, 0, 0, 255]]);
        assert_eq!(opaque(&texels), [[1.0; 3], [1.0, 0.0, 0.0]]);
    }
}
