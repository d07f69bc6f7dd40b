//! Colour ramps, and their means over ranges.

use crate::math::Color;
use crate::scene::procedures::RampStop;
use crate::simd::{Float, Mask};

/// The widest range that counts as a point.
const NARROW: f32 = 1e-3;

/// The mean colour over a range of numbers around `t`, `width` wide. `wrap` is that of
/// [`Ramp`](crate::scene::procedures::Ramp).
#[inline(always)]
pub(super) fn mean<F: Float>(stops: &[RampStop], wrap: u32, t: F, width: F, mask: F::Mask) -> Color<F> {
    let half = F::splat(0.5);
    let point = color(stops, wrapped(wrap, t));
    let wide = width.gt(F::splat(NARROW)) & mask;
    if !wide.any() {
        return point;
    }
    let width = width.max(F::splat(NARROW));
    let (mut low, mut high) = (t - width * half, t + width * half);
    if wrap != 1 {
        // Small numbers have more bits: both ends move by whole periods.
        let periods = (low * half).floor();
        (low, high) = (low - periods - periods, high - periods - periods);
    }
    let (from, to) = (integral(stops, wrap, low), integral(stops, wrap, high));
    let mean = (to - from) * (F::one() / width);
    Color::select(wide, mean, point)
}

/// The place within the ramp of a number beyond it.
#[inline(always)]
fn wrapped<F: Float>(wrap: u32, t: F) -> F {
    match wrap {
        0 => t - t.floor(),
        1 => t,
        _ => {
            let half = t * F::splat(0.5);
            let within = (half - half.floor()) * F::splat(2.0);
            within.min(F::splat(2.0) - within)
        }
    }
}

#[inline(always)]
fn color<F: Float>(stops: &[RampStop], t: F) -> Color<F> {
    let mut color = Color::splat(stops[0].color.into());
    for pair in stops.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let begins = t.ge(F::splat(from.at));
        let part = ((t - F::splat(from.at)) * F::splat(1.0 / (to.at - from.at).max(1e-9))).clamp(0.0, 1.0);
        let (a, b) = (Color::splat(from.color.into()), Color::splat(to.color.into()));
        color = Color::select(begins, a * (F::one() - part) + b * part, color);
    }
    color
}

/// The integral from 0 to `t`, which may lie beyond the ramp.
#[inline(always)]
fn integral<F: Float>(stops: &[RampStop], wrap: u32, t: F) -> Color<F> {
    let whole = within(stops, F::one());
    match wrap {
        0 => whole * t.floor() + within(stops, t - t.floor()),
        1 => within(stops, t),
        _ => {
            let half = t * F::splat(0.5);
            let place = (half - half.floor()) * F::splat(2.0);
            let back = within(stops, F::splat(2.0) - place);
            let there = Color::select(place.gt(F::one()), whole + whole - back, within(stops, place));
            whole * (half.floor() * F::splat(2.0)) + there
        }
    }
}

/// The integral from 0 to `t`, with the first and last colour beyond the stops.
#[inline(always)]
fn within<F: Float>(stops: &[RampStop], t: F) -> Color<F> {
    let mut sum = Color::splat(stops[0].color.into()) * t;
    for (at, stop) in stops.iter().enumerate() {
        let begins = t.ge(F::splat(stop.at));
        let beyond = t - F::splat(stop.at);
        let mut color = Color::splat(stop.color.into());
        if let Some(next) = stops.get(at + 1) {
            let length = (next.at - stop.at).max(1e-9);
            let part = beyond.clamp(0.0, length) * F::splat(0.5 / length);
            color = color * (F::one() - part) + Color::splat(next.color.into()) * part;
        }
        sum = Color::select(begins, Color::splat(stop.integral.into()) + color * beyond, sum);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stops() -> Vec<RampStop> {
        RampStop::chain(&[(0.1, [0.0; 3]), (0.4, [1.0, 0.5, 0.0]), (0.4, [0.2; 3]), (0.9, [0.8; 3])])
    }

    #[test]
    fn ramps_interpolate_between_stops_and_step_where_two_meet() {
        let red = |t: f32, wrap| mean(&stops(), wrap, t, 0.0, true).r;
        let near = |found: f32, expected: f32| assert!((found - expected).abs() < 1e-5, "{found} {expected}");
        for (t, expected) in [(0.0, 0.0), (0.25, 0.5), (0.3999, 0.99967), (0.4, 0.2), (0.65, 0.5), (1.0, 0.8)]
        {
            near(red(t, 1), expected);
        }
        near(red(1.25, 0), 0.5);
        near(red(-0.75, 0), 0.5);
        near(red(1.75, 2), 0.5);
        near(red(-7.0, 1), 0.0);
    }

    #[test]
    fn means_are_those_of_many_points() {
        for wrap in 0..3 {
            for (t, width) in [(0.3, 0.5), (0.5, 1.0), (0.0, 0.2), (1.3, 2.7), (-5.2, 0.4), (40.1, 11.0)] {
                let sum: f64 = (0..20_000)
                    .map(|k| t + width * ((k as f64 + 0.5) / 20_000.0 - 0.5))
                    .map(|t| f64::from(mean(&stops(), wrap, t as f32, 0.0, true).g))
                    .sum();
                let found = mean(&stops(), wrap, t as f32, width as f32, true).g;
                assert!((f64::from(found) - sum / 20_000.0).abs() < 1e-3, "{wrap} {t} {width}: {found}");
            }
        }
    }
}
