//! The numbers that settings can be, and whatever else has bounds. Readers of scene files make no other worlds; programs
//! and the records in films may.

use super::settings::{Background, Caustics, DepthLimits, PixelFilter, Settings, Sharing};
use crate::math::Rgb;

impl Settings {
    /// Errors: the first setting that is out of its range.
    pub(crate) fn check(&self) -> Result<(), String> {
        let [width, height] = self.size;
        let limits = [
            ("width", width, 1, Settings::MOST_PIXELS_A_SIDE),
            ("height", height, 1, Settings::MOST_PIXELS_A_SIDE),
            ("samples", self.samples, 1, Settings::MOST_SAMPLES),
            ("max_depth", self.max_depth, 0, Settings::MOST_DEPTH),
            ("copied_triangles", self.copied_triangles, 0, Settings::MOST_COPIED_TRIANGLES),
        ];
        let depths = self.depth_limits.given().map(|(name, limit)| (name, limit, 0, DepthLimits::MOST));
        let roulette = self.roulette_depth.map(|depth| ("roulette_depth", depth, 0, Settings::MOST_DEPTH));
        let mut limits = limits.into_iter().chain(depths).chain(roulette);
        let wrong = limits.find(|(_, value, least, most)| !(least..=most).contains(&value));
        if let Some((name, value, least, most)) = wrong {
            return Err(format!("{name} is {value}: it must be {least} to {most}"));
        }
        if let Sharing::Groups(pixels) = self.sharing
            && !Sharing::SIZES.contains(&pixels)
        {
            let sizes = Sharing::SIZES;
            return Err(format!("sharing is {pixels}: it must be one of {sizes:?}"));
        }
        if let Caustics::Photons { photons, radius } = self.caustics {
            above("the photons of caustics", photons, 0.0)?;
            within("the photons of caustics", photons, 0.0, Caustics::MOST_PHOTONS)?;
            within("the radius of caustics", radius, Caustics::LEAST_RADIUS, Caustics::LARGEST_RADIUS)?;
        }
        check_color("ambient", self.ambient)?;
        match self.background {
            Background::Constant(color) => check_color("background", color)?,
            Background::Gradient { bottom, top } => {
                [bottom, top].into_iter().try_for_each(|color| check_color("background", color))?;
            }
        }
        within("min_throughput", self.min_throughput, 0.0, f32::MAX)?;
        within("exposure_ev", self.exposure_ev, -64.0, 64.0)?;
        self.clamp.map_or(Ok(()), |clamp| above("clamp", clamp, 0.0))?;
        match self.filter {
            PixelFilter::Box => Ok(()),
            PixelFilter::Tent { radius }
            | PixelFilter::Gaussian { radius }
            | PixelFilter::BlackmanHarris { radius } => above("the filter's radius", radius, 0.0),
        }
    }
}

/// An angle or a number that must not be outside a range, but for rounding.
pub(crate) fn within(what: &str, value: f32, least: f32, most: f32) -> Result<(), String> {
    let slack = 1e-6 * most.abs().min(1e6);
    if least - slack <= value && value <= most + slack {
        return Ok(());
    }
    match (least, most) {
        (0.0, f32::MAX) => Err(format!("{what} is {value}: it must be at least 0, and finite")),
        (_, f32::MAX) => Err(format!("{what} is {value}: it must be finite")),
        _ => Err(format!("{what} is {value}: it must be {least} to {most}")),
    }
}

/// A number that must be above a limit, and finite.
pub(crate) fn above(what: &str, value: f32, limit: f32) -> Result<(), String> {
    if value > limit && value.is_finite() {
        return Ok(());
    }
    Err(format!("{what} is {value}: it must be above {limit}, and finite"))
}

/// Light that there can be.
pub(crate) fn check_color(what: &str, color: Rgb) -> Result<(), String> {
    let is_light = |part: &f32| *part >= 0.0 && part.is_finite();
    if color.to_array().iter().all(is_light) {
        return Ok(());
    }
    Err(format!("{what} is {:?}: it must be nowhere below 0, and finite", color.to_array()))
}
