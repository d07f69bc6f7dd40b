//! The displayed layers as eight-bit pixels, and the values of single pixels.

use std::borrow::Cow;
use std::collections::HashSet;
use std::str::FromStr;
use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use super::costs::CostMap;
use super::id_colors::{entity_color, material_color};
use super::viewer::Snapshot;
use crate::denoise::Denoised;
use crate::film::alpha::{Transparency, opacity};
use crate::film::exposure::LightMeter;
use crate::film::metrics::colormap;
use crate::film::tonemap::{DisplayTransform, encode_8_bit, quantise_8_bit, srgb_encode};
use crate::film::{Features, Film, PixelSum, Region, SampleRanges};
use crate::formats::picture::{ImagePixels, backplate};
use crate::formats::{ImageOptions, exr_bytes};
use crate::integrator::RenderSetup;
use crate::math::Rgb;
use crate::render::{Options, RenderState, Session};
use crate::world::{Settings, Tonemap};

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
    /// The nodes of the tree that a sample's rays visit.
    Nodes,
    /// The triangles and spheres that a sample's rays are tested against.
    Tests,
    /// The rays of a sample's path.
    PathLength,
    /// The time of a sample.
    Time,
}

impl Layer {
    /// All layers, with their names; the image comes first, with and without noise.
    pub const ALL: [(&str, Layer); 13] = [
        ("light", Layer::Light),
        ("denoised", Layer::Denoised),
        ("depth", Layer::Depth),
        ("normal", Layer::Normal),
        ("albedo", Layer::Albedo),
        ("entity", Layer::Entity),
        ("material", Layer::Material),
        ("noise", Layer::Noise),
        ("samples", Layer::Samples),
        ("nodes", Layer::Nodes),
        ("tests", Layer::Tests),
        ("path-length", Layer::PathLength),
        ("time", Layer::Time),
    ];
}

impl FromStr for Layer {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Layer::ALL.iter().find(|(known, _)| *known == name);
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
    /// Red, green, blue and opacity, row by row from the top.
    pub pixels: Vec<u8>,
    /// The exposure in stops.
    pub exposure_ev: f32,
    /// The meaning of the colours, if they stand for numbers.
    pub bar: Option<ColorBar>,
    /// True if noise was removed.
    pub is_denoised: bool,
}

/// The numbers that the colours of a layer stand for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ColorBar {
    /// The unit of the numbers, in ASCII.
    pub unit: &'static str,
    /// The number of the first colour.
    pub low: f32,
    /// The number of the last colour.
    pub high: f32,
    /// Evenly spaced colours.
    pub colors: Vec<[u8; 3]>,
}

impl ColorBar {
    /// The number of its colours.
    const COLORS: u8 = 17;

    /// A bar from the colour of each fraction of the range.
    pub(super) fn new(unit: &'static str, [low, high]: [f32; 2], color: impl Fn(f32) -> [u8; 3]) -> ColorBar {
        let fraction = |at: u8| f32::from(at) / f32::from(Self::COLORS - 1);
        ColorBar { unit, low, high, colors: (0..Self::COLORS).map(|at| color(fraction(at))).collect() }
    }
}

/// The number of samples whose first hits are averaged for the feature layers.
const LOOKED_AT: u32 = 4;

/// Renders a layer of a snapshot. Factors mix its light groups, if there are as many.
pub fn picture(shown: &Snapshot, layer: Layer, display: Display, factors: &[Rgb]) -> PageImage {
    let shown = &mixed(shown, factors);
    let film = &shown.gathered.film;
    let own = |colors: Vec<[u8; 3]>, bar: Option<ColorBar>| PageImage {
        size: shown.size,
        pixels: colors.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect(),
        exposure_ev: display.exposure_ev.unwrap_or(0.0),
        bar,
        is_denoised: false,
    };
    match layer {
        Layer::Light => light(&pixels(shown, None), &meter(shown), shown.size, display),
        Layer::Denoised => {
            let denoised = denoised(shown);
            let image = light(&pixels(shown, denoised.as_ref()), &meter(shown), shown.size, display);
            PageImage { is_denoised: denoised.is_some(), ..image }
        }
        Layer::Noise => {
            let bar = ColorBar::new("%", [0.0, 50.0], |part| heat(part.into()));
            own(
                (0..film.pixels().len()).map(|index| heat(2.0 * noise(&film.shown(index)))).collect(),
                Some(bar),
            )
        }
        Layer::Samples => {
            let most = film.pixels().iter().map(samples).max().unwrap_or(0).max(1);
            let bar = ColorBar::new("samples", [0.0, most as f32], |part| heat(part.into()));
            let colors = film.pixels().iter().map(|sums| heat(samples(sums) as f64 / most as f64));
            own(colors.collect(), Some(bar))
        }
        Layer::Nodes | Layer::Tests | Layer::PathLength | Layer::Time => {
            CostMap::of(shown, layer).picture(layer)
        }
        _ => {
            let features = all_features(shown);
            let range = depth_range(&features);
            let colors = features.iter().map(|first_hit| of_features(first_hit, layer, range)).collect();
            own(colors, bar_of_features(layer, range))
        }
    }
}

/// The image without noise; none while pixels have no sample.
pub fn denoised(shown: &Snapshot) -> Option<Denoised> {
    // A pixel without a sample would be black.
    let is_whole = shown.small.is_none();
    is_whole.then(|| session(shown)).flatten()?.denoised()
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

/// The pixels of the displayed image, or denoised ones; one without samples takes those of the small image.
fn pixels<'a>(shown: &Snapshot, denoised: Option<&'a Denoised>) -> ImagePixels<'a> {
    if shown.small.is_none() {
        return ImagePixels::new(&shown.gathered.film, plate(shown).as_deref(), denoised);
    }
    let [width, height] = shown.size;
    let places = || (0..width * height).into_par_iter().with_min_len(4096).map(|at| [at % width, at / width]);
    let let_through = |place: [u32; 2]| {
        let (film, index) = source_of(shown, place);
        film.let_through(index)
    };
    let transparency = |place: [u32; 2]| {
        let (film, index) = source_of(shown, place);
        Transparency::new(film.let_through(index), film.without_shadows(index))
    };
    let counts = shown.setup.transparent;
    let behind = |plate: Cow<[Rgb]>| {
        let seen = |place: [u32; 2]| plate[(place[1] * width + place[0]) as usize] * let_through(place);
        places().map(seen).collect()
    };
    ImagePixels {
        radiance: places().map(|place| radiance_at(shown, place)).collect::<Vec<_>>().into(),
        alpha: counts.then(|| places().map(|place| opacity(let_through(place))).collect()),
        transparency: counts.then(|| places().map(transparency).collect()),
        behind: plate(shown).map(behind),
    }
}

/// The backplate of the displayed image, which may be smaller than the whole one.
fn plate(shown: &Snapshot) -> Option<Cow<'_, [Rgb]>> {
    // A file that can no longer be read was told of when the scene was.
    let read = || {
        let settings = Settings { size: shown.size, ..shown.recipe.settings.clone() };
        backplate(&settings, Region::whole(shown.size)).ok().flatten()
    };
    match shown.size == shown.setup.size {
        true => shown.aside.plate.get_or_init(read).as_deref().map(Cow::Borrowed),
        false => read().map(Cow::Owned),
    }
}

/// A light meter of the displayed image: of the one with noise, as in files.
fn meter(shown: &Snapshot) -> LightMeter {
    let width = shown.size[0];
    let meter = LightMeter::new(shown.size, |at| {
        let place = [at as u32 % width, at as u32 / width];
        let (film, index) = source_of(shown, place);
        (radiance_at(shown, place), film.coverage_of(index))
    });
    meter.beside_catchers(shown.small.as_deref().unwrap_or(&shown.gathered.film))
}

/// The radiance of a pixel of the displayed image, which must contain it.
fn radiance_at(shown: &Snapshot, place: [u32; 2]) -> Rgb {
    let (film, index) = source_of(shown, place);
    film.shown(index).mean(film.unit().quantum())
}

/// The film with samples of a pixel of the displayed image, which must contain it, and the pixel's index there.
fn source_of(shown: &Snapshot, [x, y]: [u32; 2]) -> (&Film, usize) {
    let film = &shown.gathered.film;
    let index = film.region().index(x, y);
    match &shown.small {
        Some(small) if film.pixels()[index].count == [0, 0] => {
            let scaled = |place: u32, size: u32, small: u32| {
                (u64::from(place) * u64::from(small) / u64::from(size)) as u32
            };
            let (region, [width, height]) = (small.region(), shown.size);
            let place = [scaled(x, width, region.width()), scaled(y, height, region.height())];
            (small, region.index(place[0], place[1]))
        }
        _ => (film, index),
    }
}

/// Displays pixels, with the exposure that a meter chooses if it is automatic. Colours are not associated with an opacity
/// that the image has.
pub fn light(image: &ImagePixels, meter: &LightMeter, size: [u32; 2], display: Display) -> PageImage {
    let exposure_ev = display.exposure_ev.unwrap_or_else(|| meter.automatic_ev());
    let colors = image.own_colors();
    let curve = DisplayTransform::new(display.tonemap, exposure_ev, &colors);
    let mut pixels = vec![255; 4 * colors.len()];
    pixels.par_chunks_mut(4).enumerate().with_min_len(4096).for_each(|(at, pixel)| {
        let (shown, alpha) = match (&image.alpha, &image.behind, &image.transparency) {
            (Some(opacity), Some(behind), _) => (curve.apply_over(colors[at], opacity[at], behind[at]), 1.0),
            (_, None, Some(transparency)) => transparency[at].on_screens(curve.apply(colors[at])),
            _ => (curve.apply(colors[at]), 1.0),
        };
        pixel[3] = quantise_8_bit(alpha);
        pixel[..3].copy_from_slice(&encode_8_bit(shown));
    });
    PageImage { size, pixels, exposure_ev, bar: None, is_denoised: false }
}

/// The number of samples of a pixel.
fn samples(sums: &PixelSum) -> u64 {
    u64::from(sums.count[0]) + u64::from(sums.count[1])
}

/// The standard error of a pixel relative to its brightness, estimated from the difference of its even and odd samples;
/// a half until there are both.
fn noise(sums: &PixelSum) -> f64 {
    if sums.count.contains(&0) {
        return 0.5;
    }
    let mean = |parity: usize| {
        sums.sum[parity].iter().map(|sum| *sum as f64).sum::<f64>() / f64::from(sums.count[parity])
    };
    let (even, odd) = (mean(0), mean(1));
    (even - odd).abs() / (even + odd).abs().max(1.0)
}

/// The smallest and the largest depth.
fn depth_range(features: &[Features]) -> [f32; 2] {
    let depths = || features.iter().map(|f| f.depth_m).filter(|depth| depth.is_finite());
    [depths().fold(f32::INFINITY, f32::min), depths().fold(0.0, f32::max)]
}

fn byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// The grey of a depth, given as a fraction of the range of depths: far is dark, but not as dark as nothing.
fn grey_of_depth(part: f32) -> [u8; 3] {
    [byte(1.0 - 0.95 * part); 3]
}

fn of_features(f: &Features, layer: Layer, [near, far]: [f32; 2]) -> [u8; 3] {
    match layer {
        Layer::Depth if f.depth_m.is_finite() => grey_of_depth((f.depth_m - near) / (far - near).max(1e-6)),
        Layer::Normal if f.coverage > 0.0 => f.normal.map(|part| byte(0.5 + 0.5 * part)),
        Layer::Albedo => f.albedo.to_array().map(|part| byte(srgb_encode(part))),
        Layer::Entity if f.entity > 0 => entity_color(f.entity - 1),
        Layer::Material if f.material > 0 => material_color(f.material - 1),
        _ => [0; 3],
    }
}

fn bar_of_features(layer: Layer, [near, far]: [f32; 2]) -> Option<ColorBar> {
    match layer {
        Layer::Depth if near <= far => Some(ColorBar::new("m", [near, far], grey_of_depth)),
        Layer::Normal => Some(ColorBar::new("x red, y green, z blue", [-1.0, 1.0], |part| [byte(part); 3])),
        Layer::Albedo => Some(ColorBar::new("reflectance", [0.0, 1.0], |part| [byte(srgb_encode(part)); 3])),
        _ => None,
    }
}

/// A colour from dark for 0 to bright for 1.
pub(super) fn heat(part: f64) -> [u8; 3] {
    colormap::color(part).to_array().map(|c| quantise_8_bit(srgb_encode(c)))
}

/// Features of the first hits in all pixels of the displayed image, which may be smaller than the whole one.
fn all_features(shown: &Snapshot) -> Cow<'_, [Features]> {
    let region = Region::whole(shown.size);
    if shown.size == shown.setup.size {
        return Cow::Borrowed(
            shown.aside.features.get_or_init(|| features(&shown.setup, shown.options, region)),
        );
    }
    let setup = RenderSetup { size: shown.size, sharing: None, ..(*shown.setup).clone() };
    Cow::Owned(features(&Arc::new(setup), shown.options, region))
}

/// Features of the first hits in a region.
fn features(setup: &Arc<RenderSetup>, options: Options, region: Region) -> Vec<Features> {
    session_of(setup, Options { region: Some(region), ..options }, LOOKED_AT).features()
}

/// A session that has as many samples, none of which is rendered: for layers that render them again.
pub(super) fn session_of(setup: &Arc<RenderSetup>, options: Options, count: u32) -> Session {
    let mut session = Session::of(setup.clone(), count, options);
    let mut samples = SampleRanges::default();
    samples.insert(0..count);
    session.resume_from(RenderState { samples, ..session.state().clone() });
    session
}

/// A session with the state of a snapshot; none while that is a smaller image.
fn session(shown: &Snapshot) -> Option<Session> {
    let mut session = Session::of(shown.setup.clone(), shown.wanted, shown.options);
    session.resume_from((*shown.gathered).clone()).then_some(session)
}

/// The most pixels whose values the page writes over them.
const MOST_VALUES: u64 = 1024;

/// The numbers of a layer in a region of the displayed image, for each pixel; none if the region is too large or lies
/// outside, or if the layer has no numbers.
pub fn values(shown: &Snapshot, layer: Layer, [x0, y0, x1, y1]: [u32; 4]) -> Option<Value> {
    let is_inside = x0 < x1 && y0 < y1 && x1 <= shown.size[0] && y1 <= shown.size[1];
    if !is_inside || u64::from(x1 - x0) * u64::from(y1 - y0) > MOST_VALUES {
        return None;
    }
    let film = &shown.gathered.film;
    let sums = |[x, y]: [u32; 2]| film.shown(film.region().index(x, y));
    let of_features = |f: &Features| match layer {
        Layer::Depth => vec![f.depth_m],
        Layer::Normal => f.normal.to_vec(),
        _ => f.albedo.to_array().to_vec(),
    };
    let value = |place: [u32; 2]| match layer {
        Layer::Light => Some(radiance_at(shown, place).to_array().to_vec()),
        Layer::Noise => Some(vec![100.0 * noise(&sums(place)) as f32]),
        Layer::Samples => Some(vec![samples(&sums(place)) as f32]),
        Layer::Depth | Layer::Normal | Layer::Albedo => {
            let features = all_features(shown);
            features.get(place[1] as usize * shown.size[0] as usize + place[0] as usize).map(of_features)
        }
        Layer::Nodes | Layer::Tests | Layer::PathLength | Layer::Time => {
            let map = Some(CostMap::of(shown, layer)).filter(|map| map.size == shown.size)?;
            map.values(layer, place).map(<[f32]>::to_vec)
        }
        Layer::Denoised | Layer::Entity | Layer::Material => None,
    };
    let places = (y0..y1).flat_map(|y| (x0..x1).map(move |x| [x, y]));
    let values = places.map(value).collect::<Option<Vec<_>>>()?;
    Some(json!({"region": [x0, y0, x1, y1], "size": shown.size, "values": values}))
}

/// The outline of an entity in the displayed image, a byte for each pixel: 1 at its border, 2 just outside it, else 0.
/// None if there is no entity of this name.
pub fn outline(shown: &Snapshot, name: &str) -> Option<([u32; 2], Vec<u8>)> {
    let numbers: HashSet<u32> =
        shown.entities.iter().filter(|(_, known)| *known == name).map(|(number, _)| number + 1).collect();
    if numbers.is_empty() {
        return None;
    }
    let features = all_features(shown);
    let [width, height] = shown.size.map(|side| side as usize);
    let is_within = |x: usize, y: usize| {
        x < width && y < height && features.get(y * width + x).is_some_and(|f| numbers.contains(&f.entity))
    };
    let byte = |at: usize| {
        let (x, y) = (at % width, at / width);
        let inside = is_within(x, y);
        let around = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
        let is_border = around.iter().any(|(x, y)| is_within(*x, *y) != inside);
        if !is_border { 0 } else { 2 - u8::from(inside) }
    };
    Some((shown.size, (0..width * height).map(byte).collect()))
}

/// The bytes of an OpenEXR file of the displayed image, whole or with its noise removed.
pub fn exr(shown: &Snapshot, is_denoised: bool, factors: &[Rgb]) -> Result<Vec<u8>, String> {
    let shown = &mixed(shown, factors);
    let without_noise =
        is_denoised.then(|| denoised(shown).ok_or("there are too few samples yet")).transpose()?;
    if shown.small.is_some() {
        return Err("the image is not whole yet: save it after the first pass".to_owned());
    }
    let settings = Settings { size: shown.size, ..Settings::default() };
    let options = ImageOptions { denoised: without_noise.as_ref(), ..ImageOptions::default() };
    exr_bytes(&shown.gathered.film, &settings, &options).map_err(|error| error.to_string())
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
    let radiance = radiance_at(shown, place);
    let features = features(&shown.setup, shown.options, Region { x0: x, y0: y, x1: x + 1, y1: y + 1 });
    let seen = features.first().filter(|features| features.coverage > 0.0);
    let entity = seen.and_then(|f| shown.entities.get(&f.entity.checked_sub(1)?));
    let scene = &shown.setup.scene;
    let material = seen.and_then(|f| scene.material_names.get(f.material.checked_sub(1)? as usize));
    Some(json!({
        "x": x,
        "y": y,
        "radiance": radiance.to_array(),
        "samples": samples(sum),
        "depth_m": seen.map(|f| f.depth_m),
        "normal": seen.map(|f| f.normal),
        "albedo": seen.map(|f| f.albedo.to_array()),
        "entity": entity,
        "material": material,
    }))
}
