//! `settings`.

use crate::error::LoadError;
use crate::formats::ron::schema;
use crate::formats::ron::source::{Raw, SceneText};
use crate::world::{
    Adaptive, Aov, Background, BuildQuality, Caustics, DepthLimits, Pattern, PixelFilter, Sampler, Settings,
    Sharing, Tonemap, Transport,
};

/// Image width and height in pixels.
const LARGEST_SIZE: u64 = Settings::MOST_PIXELS_A_SIDE as u64;
/// The most samples of a pixel, and of an area light.
pub(super) const MOST_SAMPLES: u64 = Settings::MOST_SAMPLES as u64;
const LARGEST_DEPTH: u64 = Settings::MOST_DEPTH as u64;

pub(super) const PATTERNS: &[(&str, Pattern)] = &[
    ("Uniform", Pattern::Uniform),
    ("Jittered", Pattern::Jittered),
    ("Regular", Pattern::Regular),
    ("Center", Pattern::Center),
];

const TRANSPORTS: &[(&str, Option<Transport>)] =
    &[("Whitted", Some(Transport::Whitted)), ("Path", Some(Transport::Path)), ("Auto", None)];

const ADAPTIVE: &[(&str, Adaptive)] =
    &[("On", Adaptive::On), ("Off", Adaptive::Off), ("Unbiased", Adaptive::Unbiased)];
const SAMPLERS: &[(&str, Sampler)] =
    &[("Sobol", Sampler::Sobol), ("Jittered", Sampler::Jittered), ("Independent", Sampler::Independent)];

const TONEMAPS: &[(&str, Tonemap)] = &[
    ("Clamp", Tonemap::Clamp),
    ("ScaleByMaximum", Tonemap::ScaleByMaximum),
    ("Reinhard", Tonemap::Reinhard),
    ("Aces", Tonemap::Aces),
    ("Agx", Tonemap::Agx),
    ("PbrNeutral", Tonemap::PbrNeutral),
];

const BUILD_QUALITIES: &[(&str, BuildQuality)] =
    &[("Fast", BuildQuality::Fast), ("Default", BuildQuality::Default), ("High", BuildQuality::High)];

/// The choices, and whether the image decides its exposure.
const EXPOSURES: &[(&str, bool)] = &[("Fixed", false), ("Auto", true)];

const AOVS: &[(&str, Aov)] = &[
    ("Depth", Aov::Depth),
    ("Normal", Aov::Normal),
    ("Albedo", Aov::Albedo),
    ("Position", Aov::Position),
    ("Entity", Aov::Entity),
    ("Material", Aov::Material),
    ("Coverage", Aov::Coverage),
    ("Samples", Aov::Samples),
    ("Variance", Aov::Variance),
];

/// Returns the transport, too: none if it is to be chosen when the rest is known; and whether the depth is named.
pub(super) fn settings<'a>(
    source: &SceneText<'a>,
    raw: Raw<'a>,
) -> Result<(Settings, Option<Transport>, bool), LoadError> {
    let read: schema::Settings = source.fields(raw, "settings")?;
    let mut settings = Settings::default();
    if let Some(raw) = read.size {
        let [width, height] = source.tuple(raw, "(width, height)")?;
        settings.size = [
            source.whole(width, "the width in pixels", 1, LARGEST_SIZE)? as u32,
            source.whole(height, "the height in pixels", 1, LARGEST_SIZE)? as u32,
        ];
    }
    if let Some(raw) = read.samples {
        settings.samples = source.whole(raw, "samples", 1, MOST_SAMPLES)? as u32;
    }
    if let Some(raw) = read.max_depth {
        settings.max_depth = source.whole(raw, "max_depth", 0, LARGEST_DEPTH)? as u32;
    }
    let limit = |raw: Option<Raw<'a>>, name| {
        let raw = raw.and_then(|raw| source.optional(raw));
        let most = raw.map(|raw| source.whole(raw, name, 0, DepthLimits::MOST.into())).transpose()?;
        Ok::<_, LoadError>(most.map(|most| most as u32))
    };
    settings.depth_limits = DepthLimits {
        diffuse: limit(read.diffuse_depth.0, "diffuse_depth")?,
        glossy: limit(read.glossy_depth.0, "glossy_depth")?,
        transmission: limit(read.transmission_depth.0, "transmission_depth")?,
    };
    if let Some(raw) = read.min_throughput {
        settings.min_throughput = source.at_least_zero(raw, "min_throughput")?;
    }
    if let Some(raw) = read.roulette_depth.0 {
        let depth = source.optional(raw).map(|raw| source.whole(raw, "roulette_depth", 0, LARGEST_DEPTH));
        settings.roulette_depth = depth.transpose()?.map(|depth| depth as u32);
    }
    if let Some(raw) = read.clamp {
        settings.clamp = Some(source.positive(raw, "clamp")?);
    }
    let transport = read.transport.map(|raw| source.choice(raw, "transport", TRANSPORTS));
    let transport = transport.transpose()?.flatten();
    settings.transport = transport.unwrap_or_default();
    if let Some(raw) = read.sampler {
        settings.sampler = source.choice(raw, "sampler", SAMPLERS)?;
    }
    if let Some(raw) = read.sharing {
        settings.sharing = sharing(source, raw)?;
    }
    if let Some(raw) = read.caustics {
        settings.caustics = caustics(source, raw)?;
    }
    if let Some(raw) = read.adaptive {
        settings.adaptive = source.choice(raw, "adaptive", ADAPTIVE)?;
    }
    if let Some(raw) = read.seed {
        settings.seed = source.whole(raw, "seed", 0, u64::MAX)?;
    }
    if let Some(raw) = read.filter {
        settings.filter = filter(source, raw)?;
    }
    if let Some(raw) = read.pixel_pattern {
        settings.pixel_pattern = source.choice(raw, "pattern", PATTERNS)?;
    }
    if let Some(raw) = read.background {
        settings.background = background(source, raw)?;
    }
    if let Some(raw) = read.ambient {
        settings.ambient = source.color(raw, "a radiance")?;
    }
    if let Some(raw) = read.tonemap {
        settings.tonemap = source.choice(raw, "tonemap", TONEMAPS)?;
    }
    if let Some(raw) = read.exposure_ev {
        settings.exposure_ev = source.number(raw)?;
    }
    if let Some(raw) = read.exposure {
        settings.auto_exposure = source.choice(raw, kind_of_exposure(raw), EXPOSURES)?;
    }
    if let Some(raw) = read.build_quality {
        settings.build_quality = source.choice(raw, "build quality", BUILD_QUALITIES)?;
    }
    if let Some(raw) = read.copied_triangles {
        let most = Settings::MOST_COPIED_TRIANGLES.into();
        settings.copied_triangles = source.whole(raw, "copied_triangles", 0, most)? as u32;
    }
    if let Some(raw) = read.aov {
        settings.aov = aovs(source, raw)?;
    }
    Ok((settings, transport, read.max_depth.is_some()))
}

/// What is expected, with what a number would mean.
fn kind_of_exposure(raw: Raw) -> &'static str {
    match raw.0.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
        true => "kind of exposure (in stops it is exposure_ev)",
        false => "kind of exposure",
    }
}

/// `All`, or a list of channels.
fn aovs<'a>(source: &SceneText<'a>, raw: Raw<'a>) -> Result<Vec<Aov>, LoadError> {
    if source.variant(raw).is_some_and(|variant| variant.name == "All") {
        return Ok(Aov::ALL.to_vec());
    }
    let mut aovs = Vec::new();
    for item in source.list(raw, "All, or output variables")? {
        let aov = source.choice(item, "output variable", AOVS)?;
        if !aovs.contains(&aov) {
            aovs.push(aov);
        }
    }
    Ok(aovs)
}

/// `Auto` or `Off`; none if it is neither a name nor one of these. Messages name all `forms`.
fn auto_or_off<'a, T>(
    source: &SceneText<'a>,
    raw: Raw<'a>,
    (auto, off): (T, T),
    forms: &str,
) -> Result<Option<T>, LoadError> {
    let Some(variant) = source.variant(raw) else { return Ok(None) };
    let value = match variant.name {
        "Auto" => auto,
        "Off" => off,
        _ => return Err(source.expected(raw, forms)),
    };
    source.no_fields(variant)?;
    Ok(Some(value))
}

/// `Auto`, `Off` or a number of pixels.
fn sharing<'a>(source: &SceneText<'a>, raw: Raw<'a>) -> Result<Sharing, LoadError> {
    const FORMS: &str = "Auto, Off, or 2, 4, 8, 16, 32 or 64 pixels that share";
    if let Some(sharing) = auto_or_off(source, raw, (Sharing::Auto, Sharing::Off), FORMS)? {
        return Ok(sharing);
    }
    let most = u64::from(Sharing::SIZES[Sharing::SIZES.len() - 1]);
    let pixels = source.whole(raw, "sharing", u64::from(Sharing::SIZES[0]), most)? as u32;
    if !Sharing::SIZES.contains(&pixels) {
        return Err(source.expected(raw, FORMS));
    }
    Ok(Sharing::Groups(pixels))
}

/// `Auto`, `Off` or numbers of photons.
fn caustics<'a>(source: &SceneText<'a>, raw: Raw<'a>) -> Result<Caustics, LoadError> {
    const FORMS: &str = "Auto, Off, or (photons: number, radius: pixels)";
    if let Some(caustics) = auto_or_off(source, raw, (Caustics::Auto, Caustics::Off), FORMS)? {
        return Ok(caustics);
    }
    if !raw.0.starts_with('(') {
        return Err(source.expected(raw, FORMS));
    }
    let read: schema::Photons = source.fields(raw, "photons")?;
    let number = |given: Option<Raw<'a>>, what: &str, usual: f32, [least, most]: [f32; 2]| {
        let Some(raw) = given else { return Ok(usual) };
        let value = source.positive(raw, what)?;
        if value > most || value < least {
            let least = if least > 0.0 { format!("at least {least} and ") } else { String::new() };
            return Err(source.expected(raw, &format!("{what} of {least}at most {most}")));
        }
        Ok(value)
    };
    let (photons, radius) =
        ([0.0, Caustics::MOST_PHOTONS], [Caustics::LEAST_RADIUS, Caustics::LARGEST_RADIUS]);
    Ok(Caustics::Photons {
        photons: number(read.photons, "photons", Caustics::PHOTONS, photons)?,
        radius: number(read.radius, "radius", Caustics::RADIUS, radius)?,
    })
}

fn filter<'a>(source: &SceneText<'a>, raw: Raw<'a>) -> Result<PixelFilter, LoadError> {
    const FILTERS: &[&str] = &["Box", "Tent", "Gaussian", "BlackmanHarris"];
    let Some(variant) = source.variant(raw) else {
        return Err(source.expected(raw, &format!("a filter: {}", FILTERS.join(", "))));
    };
    let radius = |default: f32| -> Result<f32, LoadError> {
        let read: schema::FilterRadius = source.variant_fields(variant)?;
        read.radius.map_or(Ok(default), |raw| source.positive(raw, "a filter's radius in pixels"))
    };
    Ok(match variant.name {
        "Box" => {
            source.no_fields(variant)?;
            PixelFilter::Box
        }
        "Tent" => PixelFilter::Tent { radius: radius(1.0)? },
        "Gaussian" => PixelFilter::Gaussian { radius: radius(1.5)? },
        "BlackmanHarris" => PixelFilter::BlackmanHarris { radius: radius(1.5)? },
        other => return Err(source.unknown(other, "filter", FILTERS)),
    })
}

fn background<'a>(source: &SceneText<'a>, raw: Raw<'a>) -> Result<Background, LoadError> {
    match source.variant(raw) {
        None => Ok(Background::Constant(source.color(raw, "a radiance")?)),
        Some(variant) if variant.name == "Srgb" => Ok(Background::Constant(source.color(raw, "a radiance")?)),
        Some(variant) if variant.name == "Gradient" => {
            let read: schema::Gradient = source.variant_fields(variant)?;
            Ok(Background::Gradient {
                bottom: source.color(read.bottom, "a radiance")?,
                top: source.color(read.top, "a radiance")?,
            })
        }
        Some(variant) => Err(source.unknown(variant.name, "background", &["Gradient", "Srgb"])),
    }
}
