//! Strips of small images that show the effect of the fields of a scene, for the guide to writing scenes.

mod lights;
mod materials;
mod pictures;
mod scenes;

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{Rgb, RgbImage, imageops};
use rayfront::compile::compile;
use rayfront::film::Film;
use rayfront::formats;
use rayfront::render::{Options, Session};
use rayfront::world::{Settings, World};

/// Width and height of an image, in pixels.
const SIDE: u32 = 140;
/// Pixels between two images.
const GAP: u32 = 4;

/// Images of one scene with different values, side by side.
pub struct Strip {
    pub name: &'static str,
    /// The parts of the scene, in which `VALUE` stands for one of the values.
    pub scene: &'static [&'static str],
    pub values: &'static [&'static str],
    /// Width and height of a rendered pixel in the image: more than 1 shows pixels enlarged.
    pub zoom: u32,
}

/// Renders all strips, or the one of a name, into `fields/` in the folder of the scenes.
pub fn make(scenes: &Path, only: Option<&str>) -> Result<(), Box<dyn Error>> {
    let folder = scenes.join("fields");
    std::fs::create_dir_all(&folder)?;
    pictures::save_all(&folder)?;
    for strip in strips().filter(|strip| only.is_none_or(|name| strip.name == name)) {
        let pictures = strip.values.iter().map(|value| strip.render(&folder, value));
        save(&folder, strip.name, &pictures.collect::<Result<Vec<_>, _>>()?)?;
    }
    if only.is_none_or(|name| name == lights::NAME) {
        save(&folder, lights::NAME, &lights::mixes(&folder)?)?;
    }
    Ok(())
}

/// Saves images side by side.
fn save(folder: &Path, name: &str, pictures: &[RgbImage]) -> Result<(), Box<dyn Error>> {
    let count = pictures.len() as u32;
    let mut joined = RgbImage::from_pixel(count * (SIDE + GAP) - GAP, SIDE, Rgb([255; 3]));
    for (number, picture) in (0..).zip(pictures) {
        imageops::replace(&mut joined, picture, number * i64::from(SIDE + GAP), 0);
    }
    // Invisible noise would take up a third of the file.
    joined
        .pixels_mut()
        .flat_map(|pixel| &mut pixel.0)
        .for_each(|level| *level = level.saturating_add(1) / 3 * 3);
    let file = BufWriter::new(File::create(folder.join(format!("{name}.png")))?);
    let encoder = PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive);
    joined.write_with_encoder(encoder)?;
    println!("{name}");
    Ok(())
}

/// All strips.
pub fn strips() -> impl Iterator<Item = &'static Strip> {
    scenes::STRIPS.iter().chain(materials::STRIPS)
}

impl Strip {
    /// Loads the scene with a value, as if it were a file in the folder.
    pub fn load(&self, folder: &Path, value: &str) -> Result<World, Box<dyn Error>> {
        let mut file = tempfile::Builder::new().suffix(".ron").tempfile_in(folder)?;
        file.write_all(self.scene.concat().replace("VALUE", value).as_bytes())?;
        formats::load(file.path()).map_err(|error| format!("{} with \"{value}\": {error}", self.name).into())
    }

    fn render(&self, folder: &Path, value: &str) -> Result<RgbImage, Box<dyn Error>> {
        let mut world = self.load(folder, value)?;
        world.settings.size = [SIDE / self.zoom; 2];
        let film = rendered(&world)?;
        Ok(shown(&film, &world.settings, self.zoom))
    }
}

fn rendered(world: &World) -> Result<Film, Box<dyn Error>> {
    let mut session = Session::new(compile(world, None)?, &world.settings, Options::default());
    session.finish(|_| ());
    Ok(session.film().clone())
}

/// The image of a film whose pixels are enlarged.
fn shown(film: &Film, settings: &Settings, zoom: u32) -> RgbImage {
    let pixels = formats::rgba8(film, settings, &formats::ImageOptions::default()).expect("no file is read");
    RgbImage::from_fn(SIDE, SIDE, |x, y| {
        let [r, g, b, _] = pixels[(y / zoom * (SIDE / zoom) + x / zoom) as usize];
        Rgb([r, g, b])
    })
}
