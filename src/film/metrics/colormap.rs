//! A perceptually uniform colour map.

use crate::math::Rgb;

/// Returns a linear colour for a value from 0 (nearly black) through blue, red and orange to 1 (pale yellow). In Oklab
/// (Björn Ottosson, 2020) lightness and hue are linear in the value, so equal steps look equal, in grey too. NaN counts
/// as 0.
pub fn color(value: f64) -> Rgb {
    let t = if value > 0.0 { value.min(1.0) } else { 0.0 };
    let lightness = 0.10 + 0.87 * t;
    let chroma = 0.03 + 0.58 * t * (1.0 - t);
    let hue = (275.0 + 190.0 * t).to_radians();
    let (a, b) = (chroma * libm::cos(hue), chroma * libm::sin(hue));
    let cube = |a_part: f64, b_part: f64| {
        let root = lightness + a_part * a + b_part * b;
        root * root * root
    };
    let l = cube(0.396_337_777_4, 0.215_803_757_3);
    let m = cube(-0.105_561_345_8, -0.063_854_172_8);
    let s = cube(-0.089_484_177_5, -1.291_485_548);
    let linear = [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ];
    Rgb::from(linear.map(|component| component.clamp(0.0, 1.0) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colormap_luminance_increases_with_value() {
        let mut before = -1.0;
        for step in 0..=100 {
            let luminance = color(f64::from(step) / 100.0).luminance();
            assert!(luminance > before, "step {step}");
            before = luminance;
        }
        assert!(color(0.0).luminance() < 0.01 && color(1.0).luminance() > 0.8);
        assert_eq!(color(f64::NAN), color(0.0));
        assert_eq!(color(7.0), color(1.0));
    }
}
