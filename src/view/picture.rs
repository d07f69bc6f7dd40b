//! The displayed layers as eight-bit pixels, and the values of single pixels.

use std::borrow::Cow;
use std::num::Wrapping;
use std::str::FromStr;
use std::sync::Arc;

use rayon::prelude::*;
use serde_json::{Value, json};

use super::viewer::Snapshot;
use crate::film::exposure::automatic_ev;
use crate::film::metrics::colormap;
use crate::film::tonemap::{DisplayTransform, quantise_8_bit, srgb_encode};
use crate::film::{Features, PixelSum, Region, SampleRanges};
use crate::math::Rgb;
use crate::render::{Options, RenderState, Session};
use crate::sampling::hash::mix;
use crate::world::Tonemap;

/// A layer that the page can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// The image.
    Light,
    /// The image without its noise.
    Denoised,
    /// The depth of the first hit.
    Depth,
    /// Its shading normal.
    Normal,
    /// Its base colour.
    Albedo,
    /// Its entity.
    Entity,
    /// Its material.
    Material,
    /// The uncertainty of pixels relative to their brightness.
    Noise,
    /// The number of samples per pixel.
    Samples,
}

impl FromStr for Layer {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        const ALL: [(&str, Layer); 9] = [
            ("light", Layer::Light),
            ("denoised", Layer::Denoised),
            ("depth", Layer::Depth),
            ("normal", Layer::Normal),
            ("albedo", Layer::Albedo),
            ("entity", Layer::Entity),
            ("material", Layer::Material),
            ("noise", Layer::Noise),
            ("samples", Layer::Samples),
        ];
        let found = ALL.iter().find(|(known, _)| *known == name);
        found.map(|(_, layer)| *layer).ok_or_else(|| format!("there is no layer {name:?}"))
    }
}

/// The mapping from radiance to displayed colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Exposure in stops; none: automatic.
    pub exposure_ev: Option<f32>,
    /// The tone curve.
    pub tonemap: Tonemap,
}

/// Pixels in the form that the page draws.
pub struct PageImage {
    /// Width and height.
    pub size: [u32; 2],
    /// Red, green, blue and 255, row by row from the top.
    pub pixels: Vec<u8>,
    /// The exposure in stops.
    pub exposure_ev: f32,
}

/// The number of samples whose first hits are averaged for the feature layers.
const LOOKED_AT: u32 = 4;

/// Renders a layer of a snapshot. Factors mix its light groups, if there are as many.
pub fn picture(shown: &Snapshot, layer: Layer, display: Display, factors: &[Rgb]) -> PageImage {
    let shown = &mixed(shown, factors);
    let film = &shown.gathered.film;
    let own = |colors: Vec<[u8; 3]>, size: [u32; 2]| PageImage {
        size,
        pixels: colors.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect(),
        exposure_ev: display.exposure_ev.unwrap_or(0.0),
    };
    match layer {
        Layer::Light => light(radiance(shown), shown.size, display),
        Layer::Denoised => {
            let denoised = session(shown).and_then(|session| session.denoised());
            let radiance = denoised.map_or_else(|| radiance(shown), |denoised| denoised.radiance);
            light(radiance, shown.size, display)
        }
        Layer::Noise => own(noise(film.pixels()), shown.size),
        Layer::Samples => {
            let count = |p: &PixelSum| f64::from(p.count[0]) + f64::from(p.count[1]);
            let most = film.pixels().iter().map(count).fold(1.0, f64::max);
            own(film.pixels().iter().map(|p| heat(count(p) / most)).collect(), shown.size)
        }
        _ => {
            let whole = || features(shown, Region::whole(shown.setup.size));
            own(of_features(shown.features.get_or_init(whole), layer), shown.setup.size)
        }
    }
}

/// A snapshot with its light groups mixed.
fn mixed<'a>(shown: &'a Snapshot, factors: &[Rgb]) -> Cow<'a, Snapshot> {
    let film = &shown.gathered.film;
    if factors.len() != film.light_groups() || factors.iter().all(|factor| *factor == Rgb::WHITE) {
        return Cow::Borrowed(shown);
    }
    let gathered = RenderState { film: film.mixed(factors), ..(*shown.gathered).clone() };
    let small = shown.small.as_ref().map(|small| Arc::new(small.mixed(factors)));
    Cow::Owned(Snapshot { gathered: Arc::new(gathered), small, ..shown.clone() })
}

/// The radiance of all pixels; a pixel without samples takes that of the small image.
fn radiance(shown: &Snapshot) -> Vec<Rgb> {
    let film = &shown.gathered.film;
    let mut radiance = film.radiance();
    let Some(small) = &shown.small else { return radiance };
    let (light, [width, height]) = (small.radiance(), shown.size.map(|side| side as usize));
    let size = [small.region().width(), small.region().height()].map(|side| side as usize);
    for (at, (own, sums)) in radiance.iter_mut().zip(film.pixels()).enumerate() {
        if sums.count == [0, 0] {
            let [x, y] = [at % width * size[0] / width, at / width * size[1] / height];
            *own = light.get(y * size[0] + x).copied().unwrap_or(*own);
        }
    }
    radiance
}

fn light(radiance: Vec<Rgb>, size: [u32; 2], display: Display) -> PageImage {
    let exposure_ev = display.exposure_ev.unwrap_or_else(|| automatic_ev(&radiance));
    let curve = DisplayTransform::new(display.tonemap, exposure_ev, &radiance);
    let mut pixels = vec![255; 4 * radiance.len()];
    pixels.par_chunks_mut(4).zip(&radiance).with_min_len(4096).for_each(|(pixel, light)| {
        pixel[..3].copy_from_slice(&curve.apply_8_bit(*light));
    });
    PageImage { size, pixels, exposure_ev }
}

/// The difference of even and odd samples relative to their mean, mapped to colours from zero to a half and more.
fn noise(pixels: &[PixelSum]) -> Vec<[u8; 3]> {
    let of = |p: &PixelSum| {
        if p.count.contains(&0) {
            return heat(1.0);
        }
        let mean = |parity: usize| {
            p.sum[parity].iter().map(|sum| *sum as f64).sum::<f64>() / f64::from(p.count[parity])
        };
        let (even, odd) = (mean(0), mean(1));
        heat(2.0 * (even - odd).abs() / (even + odd).abs().max(1.0))
    };
    pixels.iter().map(of).collect()
}

fn of_features(features: &[Features], layer: Layer) -> Vec<[u8; 3]> {
    let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let depths = || features.iter().map(|f| f.depth_m).filter(|depth| depth.is_finite());
    let (near, far) = (depths().fold(f32::INFINITY, f32::min), depths().fold(0.0, f32::max));
    let of = |f: &Features| match layer {
        Layer::Depth if f.depth_m.is_finite() => {
            [byte(1.0 - 0.95 * (f.depth_m - near) / (far - near).max(1e-6)); 3]
        }
        Layer::Normal if f.coverage > 0.0 => f.normal.map(|part| byte(0.5 + 0.5 * part)),
        Layer::Albedo => f.albedo.to_array().map(|part| byte(srgb_encode(part))),
        Layer::Entity if f.entity > 0 => any_color(f.entity),
        Layer::Material if f.material > 0 => any_color(f.material.wrapping_add(1 << 16)),
        _ => [0; 3],
    };
    features.iter().map(of).collect()
}

/// A colour from dark for 0 to bright for 1.
fn heat(part: f64) -> [u8; 3] {
    colormap::color(part).to_array().map(|c| quantise_8_bit(srgb_encode(c)))
}

/// A pseudo-random colour for a number: neighbouring numbers differ.
fn any_color(number: u32) -> [u8; 3] {
    let Wrapping(mixed) = mix(Wrapping(number));
    [mixed, mixed >> 8, mixed >> 16].map(|part| 64 + (part & 0xff) as u8 / 4 * 3)
}

/// Features of the first hits in a region.
fn features(shown: &Snapshot, region: Region) -> Vec<Features> {
    let options = Options { region: Some(region), ..shown.options };
    let mut session = Session::of(shown.setup.clone(), LOOKED_AT, options);
    let mut samples = SampleRanges::default();
    samples.insert(0..LOOKED_AT);
    session.resume_from(RenderState { samples, ..session.state().clone() });
    session.features()
}

/// A session with the state of a snapshot; none while that is a smaller image.
fn session(shown: &Snapshot) -> Option<Session> {
    let mut session = Session::of(shown.setup.clone(), shown.wanted, shown.options);
    session.resume_from((*shown.gathered).clone()).then_some(session)
}

/// The values of a pixel of the whole image; none if the pixel lies outside.
pub fn pixel(shown: &Snapshot, [x, y]: [u32; 2]) -> Option<Value> {
    let [width, height] = shown.setup.size;
    if x >= width || y >= height {
        return None;
    }
    // The displayed image may be smaller.
    let film = &shown.gathered.film;
    let place = [x * shown.size[0] / width, y * shown.size[1] / height];
    let sum = film.pixels().get(film.region().index(place[0], place[1]))?;
    let radiance = radiance(shown).get(film.region().index(place[0], place[1])).copied()?;
    let features = features(shown, Region { x0: x, y0: y, x1: x + 1, y1: y + 1 });
    let seen = features.first().filter(|features| features.coverage > 0.0);
    let entity = seen.and_then(|f| shown.entities.get(&f.entity.checked_sub(1)?));
    let scene = &shown.setup.scene;
    let material = seen.and_then(|f| scene.material_names.get(f.material.checked_sub(1)? as usize));
    Some(json!({
        "x": x,
        "y": y,
        "radiance": radiance.to_array(),
        "samples": u64::from(sum.count[0]) + u64::from(sum.count[1]),
        "depth_m": seen.map(|f| f.depth_m),
        "normal": seen.map(|f| f.normal),
        "albedo": seen.map(|f| f.albedo.to_array()),
        "entity": entity,
        "material": material,
    }))
}
