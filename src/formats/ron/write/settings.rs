//! `settings`.

use super::Written;
use super::number::{Keys, color, number, same};
use crate::world::{Aov, Background, Caustics, PixelFilter, Settings, Sharing, Transport};

/// `fitting` is the transport, and `fitting_depth` the depth, that a file gets if it does not name one.
pub(super) fn settings(settings: &Settings, fitting: Transport, fitting_depth: u32) -> Written {
    let Settings {
        size: [width, height],
        samples,
        max_depth,
        depth_limits,
        min_throughput,
        roulette_depth,
        clamp,
        sampler,
        sharing,
        caustics,
        adaptive,
        transport,
        seed,
        filter,
        pixel_pattern,
        background,
        ambient,
        tonemap,
        exposure_ev,
        auto_exposure,
        build_quality,
        copied_triangles,
        aov,
    } = settings;
    let default = Settings::default();
    let mut keys = Keys::default();
    keys.push_unless([*width, *height] == default.size, "size", || Ok(format!("({width}, {height})")))?;
    keys.push_unless(*samples == default.samples, "samples", || Ok(samples.to_string()))?;
    keys.push_unless(*max_depth == fitting_depth, "max_depth", || Ok(max_depth.to_string()))?;
    depth_limits.given().for_each(|(key, limit)| keys.push(key, limit.to_string()));
    let is_default = same(&[*min_throughput], &[default.min_throughput]);
    keys.push_unless(is_default, "min_throughput", || number(*min_throughput))?;
    keys.push_unless(*roulette_depth == default.roulette_depth, "roulette_depth", || {
        Ok(roulette_depth.map_or_else(|| "None".to_owned(), |depth| depth.to_string()))
    })?;
    if let Some(clamp) = clamp {
        keys.push("clamp", number(*clamp)?);
    }
    keys.push_unless(*transport == fitting, "transport", || Ok(format!("{transport:?}")))?;
    keys.push_unless(*sampler == default.sampler, "sampler", || Ok(format!("{sampler:?}")))?;
    keys.push_unless(*sharing == default.sharing, "sharing", || {
        Ok(match sharing {
            Sharing::Groups(pixels) => pixels.to_string(),
            other => format!("{other:?}"),
        })
    })?;
    keys.push_unless(*caustics == default.caustics, "caustics", || {
        Ok(match caustics {
            Caustics::Photons { photons, radius } => {
                format!("(photons: {}, radius: {})", number(*photons)?, number(*radius)?)
            }
            other => format!("{other:?}"),
        })
    })?;
    keys.push_unless(*adaptive == default.adaptive, "adaptive", || Ok(format!("{adaptive:?}")))?;
    keys.push_unless(*seed == default.seed, "seed", || Ok(seed.to_string()))?;
    keys.push_unless(*filter == default.filter, "filter", || pixel_filter(*filter))?;
    let is_default = *pixel_pattern == default.pixel_pattern;
    keys.push_unless(is_default, "pixel_pattern", || Ok(format!("{pixel_pattern:?}")))?;
    let is_default = matches!(background, Background::Constant(c) if same(&c.to_array(), &[0.0; 3]));
    keys.push_unless(is_default, "background", || match background {
        Background::Constant(radiance) => color(*radiance),
        Background::Gradient { bottom, top } => {
            Ok(format!("Gradient(bottom: {}, top: {})", color(*bottom)?, color(*top)?))
        }
    })?;
    let is_default = same(&ambient.to_array(), &default.ambient.to_array());
    keys.push_unless(is_default, "ambient", || color(*ambient))?;
    keys.push_unless(*tonemap == default.tonemap, "tonemap", || Ok(format!("{tonemap:?}")))?;
    let is_default = same(&[*exposure_ev], &[default.exposure_ev]);
    keys.push_unless(is_default, "exposure_ev", || number(*exposure_ev))?;
    keys.push_unless(!auto_exposure, "exposure", || Ok("Auto".to_owned()))?;
    let is_default = *build_quality == default.build_quality;
    keys.push_unless(is_default, "build_quality", || Ok(format!("{build_quality:?}")))?;
    let is_default = *copied_triangles == default.copied_triangles;
    keys.push_unless(is_default, "copied_triangles", || Ok(copied_triangles.to_string()))?;
    keys.push_unless(aov.is_empty(), "aov", || {
        Ok(if aov[..] == Aov::ALL { "All".to_owned() } else { format!("{aov:?}") })
    })?;
    Ok(keys.finish(""))
}

fn pixel_filter(filter: PixelFilter) -> Written {
    Ok(match filter {
        PixelFilter::Box => "Box".to_owned(),
        PixelFilter::Tent { radius } => format!("Tent(radius: {})", number(radius)?),
        PixelFilter::Gaussian { radius } => format!("Gaussian(radius: {})", number(radius)?),
        PixelFilter::BlackmanHarris { radius } => format!("BlackmanHarris(radius: {})", number(radius)?),
    })
}
