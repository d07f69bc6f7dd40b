//! The display transform of linear radiance: exposure, a tone curve, the sRGB curve and rounding to 8 or 16 bits.
//! Everything is computed in f64 with `libm`, so that an image has the same bytes on every machine.

use std::sync::LazyLock;

use crate::math::Rgb;
use crate::world::Tonemap;

/// A 3 × 3 matrix, row by row.
type Matrix = [[f64; 3]; 3];

/// The upper limit of radiance; small enough that no curve overflows f64.
const LARGEST: f64 = f32::MAX as f64;

/// The transform from the pixels of one image to display values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplayTransform {
    curve: Tonemap,
    /// The factor on radiance, 2^exposure.
    gain: f64,
    /// The divisor of [`Tonemap::ScaleByMaximum`], above zero.
    maximum: f64,
}

impl DisplayTransform {
    /// Creates the transform for an image of `pixels`, which only [`Tonemap::ScaleByMaximum`] uses: it divides by their
    /// largest finite component (by 1 if all are black).
    pub fn new(curve: Tonemap, exposure_ev: f32, pixels: &[Rgb]) -> Self {
        let exposure_ev = if exposure_ev.is_nan() { 0.0 } else { exposure_ev.clamp(-128.0, 128.0) };
        let gain = libm::exp2(f64::from(exposure_ev));
        let largest = match curve {
            Tonemap::ScaleByMaximum => largest_finite(pixels),
            _ => 1.0,
        };
        let maximum = if largest > 0.0 { exposed(largest, gain) } else { 1.0 };
        Self { curve, gain, maximum }
    }

    /// Returns linear Rec. 709 display values, each in [0, 1]. Negative components and NaN count as 0, infinity as the
    /// largest finite radiance.
    pub fn apply(&self, radiance: Rgb) -> Rgb {
        let light = radiance.to_array().map(|component| exposed(component, self.gain));
        let shown = match self.curve {
            Tonemap::Clamp => light,
            Tonemap::ScaleByMaximum => light.map(|component| component / self.maximum),
            Tonemap::Reinhard => reinhard(light),
            Tonemap::Aces => aces(light),
            Tonemap::Agx => agx(light),
            Tonemap::PbrNeutral => pbr_neutral(light),
        };
        Rgb::from(shown.map(|component| component.clamp(0.0, 1.0) as f32))
    }

    /// [`DisplayTransform::apply`] for a pixel of an opacity from 0 to 1 that shows this of what is behind it, as a linear
    /// display value (Porter and Duff 1984, "over").
    pub fn apply_over(&self, radiance: Rgb, opacity: f32, behind: Rgb) -> Rgb {
        let sum = self.apply(radiance) * opacity + behind;
        // Rounding, and glass that reflects one colour and lets another through.
        Rgb::from(sum.to_array().map(|component| component.min(1.0)))
    }

    /// [`DisplayTransform::apply`], encoded for an 8-bit sRGB file.
    pub fn apply_8_bit(&self, radiance: Rgb) -> [u8; 3] {
        encode_8_bit(self.apply(radiance))
    }
}

/// Encodes linear display values from 0 to 1 for an 8-bit sRGB file.
pub fn encode_8_bit(shown: Rgb) -> [u8; 3] {
    shown.to_array().map(|component| STEPS.step(component))
}

/// Encodes linear display values from 0 to 1 for a 16-bit sRGB file.
pub fn encode_16_bit(shown: Rgb) -> [u16; 3] {
    shown.to_array().map(|component| quantise_16_bit(srgb_encode(component)))
}

fn exposed(component: f32, gain: f64) -> f64 {
    let light = f64::from(component) * gain;
    if light > 0.0 { light.min(LARGEST) } else { 0.0 }
}

fn largest_finite(pixels: &[Rgb]) -> f32 {
    let components = pixels.iter().flat_map(|pixel| pixel.to_array());
    components.filter(|component| component.is_finite()).fold(0.0, f32::max)
}

/// Encodes a display-linear value by the sRGB curve (IEC 61966-2-1), which maps 0 to 0 and 1 to 1.
pub fn srgb_encode(linear: f32) -> f32 {
    let linear = f64::from(linear);
    if linear <= 0.003_130_8 {
        (12.92 * linear) as f32
    } else {
        (1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055) as f32
    }
}

/// The inverse of [`srgb_encode`].
pub fn srgb_decode(encoded: f32) -> f32 {
    let encoded = f64::from(encoded);
    if encoded <= 0.040_45 {
        (encoded / 12.92) as f32
    } else {
        libm::pow((encoded + 0.055) / 1.055, 2.4) as f32
    }
}

/// Rounds [0, 1] to the nearest of 256 steps; values outside are clamped.
pub fn quantise_8_bit(value: f32) -> u8 {
    (f64::from(value) * 255.0 + 0.5) as u8
}

/// Rounds [0, 1] to the nearest of 65,536 steps; values outside are clamped.
pub fn quantise_16_bit(value: f32) -> u16 {
    (f64::from(value) * 65_535.0 + 0.5) as u16
}

/// A lookup table of [`quantise_8_bit`] of [`srgb_encode`], whose power would take most of the time of displaying an
/// image.
struct Steps {
    /// The least value of each step.
    least: [f32; 256],
    /// The step of the least value with given leading bits. Values with the same leading bits differ by at most one
    /// step.
    step: [u8; Self::PLACES],
}

static STEPS: LazyLock<Steps> = LazyLock::new(Steps::new);

impl Steps {
    /// The number of trailing bits of a value that do not affect its place in the table.
    const BEHIND: u32 = 16;
    /// The bits of 2⁻¹³: values below are black.
    const FIRST: u32 = (127 - 13) << 23;
    /// The size of the table: one place for values below [`Self::FIRST`], thirteen octaves up to 1, and 1 itself.
    const PLACES: usize = 2 + (13 << (23 - Self::BEHIND));

    fn new() -> Self {
        let mut least = [0.0; 256];
        for (step, least) in (0..=255u8).zip(&mut least).skip(1) {
            let reaches = |value: f32| quantise_8_bit(srgb_encode(value)) >= step;
            // The curve is increasing, and its inverse is a few roundings off.
            *least = srgb_decode((f32::from(step) - 0.5) / 255.0);
            while reaches(least.next_down()) {
                *least = least.next_down();
            }
            while !reaches(*least) {
                *least = least.next_up();
            }
        }
        let first_of = |place: usize| match place {
            0 => 0,
            _ => Self::FIRST + ((place as u32 - 1) << Self::BEHIND),
        };
        let step_of =
            |place| least[1..].partition_point(|least| *least <= f32::from_bits(first_of(place))) as u8;
        Self { least, step: std::array::from_fn(step_of) }
    }

    /// Returns the step of a value from 0 to 1.
    fn step(&self, value: f32) -> u8 {
        // False for NaN and −0.
        let is_placed = value >= f32::from_bits(Self::FIRST);
        let place = if is_placed { 1 + ((value.to_bits() - Self::FIRST) >> Self::BEHIND) } else { 0 };
        let step = self.step[(place as usize).min(Self::PLACES - 1)];
        // The last step has no successor.
        let next = self.least.get(usize::from(step) + 1);
        if next.is_some_and(|least| value >= *least) { step + 1 } else { step }
    }
}

fn transform(matrix: &Matrix, v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// The extended operator of Reinhard and others (2002), equation 4, on luminance.
fn reinhard(light: [f64; 3]) -> [f64; 3] {
    const WHITE: f64 = 4.0;
    let luminance = 0.2126 * light[0] + 0.7152 * light[1] + 0.0722 * light[2];
    let factor = (1.0 + luminance / (WHITE * WHITE)) / (1.0 + luminance);
    light.map(|component| component * factor)
}

/// Stephen Hill's fit of the ACES reference rendering transform and sRGB output transform (BakingLab, 2015). The fit is
/// darker than ACES; like three.js we divide by 0.6 first, so that its images and ours are the same at the same
/// exposure.
fn aces(light: [f64; 3]) -> [f64; 3] {
    /// Linear sRGB to the space of the fit, with the transform's desaturation.
    const INPUT: Matrix =
        [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
    const OUTPUT: Matrix =
        [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
    let fit =
        |x: f64| (x * (x + 0.024_578_6) - 0.000_090_537) / (x * (0.983_729 * x + 0.432_951) + 0.238_081);
    let scene = transform(&INPUT, light.map(|component| component / 0.6));
    transform(&OUTPUT, scene.map(fit))
}

/// Troy Sobotka's AgX, base look, on Rec. 2020 primaries as Blender 4 and three.js have it; the sigmoid is Benjamin
/// Wrensch's polynomial of sixth order.
fn agx(light: [f64; 3]) -> [f64; 3] {
    /// ITU-R BT.2087, from the primaries of BT.709 and BT.2020.
    const REC_709_TO_2020: Matrix = [
        [0.627_403_895_935, 0.329_283_038_378, 0.043_313_065_687],
        [0.069_097_289_358, 0.919_540_395_075, 0.011_362_315_566],
        [0.016_391_438_875, 0.088_013_307_877, 0.895_595_253_248],
    ];
    const REC_2020_TO_709: Matrix = [
        [1.660_491_002_108, -0.587_641_138_789, -0.072_849_863_320],
        [-0.124_550_474_522, 1.132_899_897_126, -0.008_349_422_604],
        [-0.018_150_763_355, -0.100_578_898_008, 1.118_729_661_363],
    ];
    const INSET: Matrix = [
        [0.856_627_153_315_983, 0.095_121_240_538_158_8, 0.048_251_606_145_858_3],
        [0.137_318_972_929_847, 0.761_241_990_602_591, 0.101_439_036_467_562],
        [0.111_898_212_999_95, 0.076_799_418_603_190_3, 0.811_302_368_396_859],
    ];
    const OUTSET: Matrix = [
        [1.127_100_581_814_436_8, -0.110_606_643_096_603_23, -0.016_493_938_717_834_573],
        [-0.141_329_763_498_438_3, 1.157_823_702_216_272, -0.016_493_938_717_834_257],
        [-0.141_329_763_498_438_26, -0.110_606_643_096_602_94, 1.251_936_406_595_040_5],
    ];
    /// The range of the curve in stops relative to 1 (10 below and 6.5 above a middle grey of 0.18).
    const LOG2_RANGE: (f64, f64) = (-12.473_93, 4.026_069);

    let inset = transform(&INSET, transform(&REC_709_TO_2020, light));
    let contrasted = inset.map(|component| {
        let log2 = libm::log2(component.max(1e-10));
        let x = ((log2 - LOG2_RANGE.0) / (LOG2_RANGE.1 - LOG2_RANGE.0)).clamp(0.0, 1.0);
        let coefficients = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232];
        coefficients.iter().fold(0.0, |sum, coefficient| sum * x + coefficient)
    });
    // The curve's output is meant for a display of gamma 2.2.
    let display = transform(&OUTSET, contrasted).map(|component| libm::pow(component.max(0.0), 2.2));
    transform(&REC_2020_TO_709, display)
}

/// The tone mapper of the Khronos PBR Neutral Tone Mapper specification.
fn pbr_neutral(light: [f64; 3]) -> [f64; 3] {
    /// The Fresnel reflectance at normal incidence, which is subtracted.
    const F90: f64 = 0.04;
    const START_COMPRESSION: f64 = 0.8 - F90;
    const DESATURATION: f64 = 0.15;
    let [r, g, b] = light;
    let smallest = r.min(g).min(b);
    let offset = if smallest <= 2.0 * F90 { smallest - smallest * smallest / (4.0 * F90) } else { F90 };
    let base = light.map(|component| component - offset);
    let peak = base[0].max(base[1]).max(base[2]);
    if peak <= START_COMPRESSION {
        return base;
    }
    let room = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - room * room / (peak + room - START_COMPRESSION);
    let saturation = 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    base.map(|component| component * (new_peak / peak) * saturation + new_peak * (1.0 - saturation))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const CURVES: [Tonemap; 6] = [
        Tonemap::Clamp,
        Tonemap::ScaleByMaximum,
        Tonemap::Reinhard,
        Tonemap::Aces,
        Tonemap::Agx,
        Tonemap::PbrNeutral,
    ];

    fn shown(curve: Tonemap, radiance: Rgb) -> [u8; 3] {
        DisplayTransform::new(curve, 0.0, &[]).apply_8_bit(radiance)
    }

    fn grey(curve: Tonemap, radiance: f32) -> f32 {
        let shown = DisplayTransform::new(curve, 0.0, &[Rgb::splat(8.0)]).apply(Rgb::splat(radiance));
        assert!((shown.r - shown.g).abs() < 2e-5 && (shown.r - shown.b).abs() < 2e-5, "{curve:?} {shown:?}");
        shown.g
    }

    /// The table gives the step that is computed: around all edges, and elsewhere.
    #[test]
    fn step_table_matches_srgb_curve() {
        let computed = |value: f32| quantise_8_bit(srgb_encode(value));
        let edges = STEPS.least.iter().map(|least| least.to_bits());
        let places = (0..Steps::PLACES as u32).map(|place| Steps::FIRST + (place << Steps::BEHIND));
        let around = edges.chain(places).flat_map(|bits| bits.saturating_sub(200)..bits + 200);
        let anywhere = (0..=1.0f32.to_bits()).step_by(9_973);
        for value in around.chain(anywhere).map(f32::from_bits).filter(|value| *value <= 1.0) {
            assert_eq!(STEPS.step(value), computed(value), "{value:e}");
        }
        for value in [-0.0, f32::NAN, f32::MIN_POSITIVE / 8.0] {
            assert_eq!(STEPS.step(value), 0);
        }
    }

    #[test]
    fn aces_matches_three_js() {
        // The reference was rendered by a GPU, hence the tolerance; the exact values are 65.50, 197.05 and 33.48.
        for (byte, golden) in shown(Tonemap::Aces, Rgb::new(0.0, 0.5, 0.0)).into_iter().zip([66, 197, 34]) {
            assert!(byte.abs_diff(golden) <= 1);
        }
        for (radiance, byte) in [(0.18, 127), (0.5, 197), (1.0, 226)] {
            assert_eq!(shown(Tonemap::Aces, Rgb::splat(radiance)), [byte; 3]);
        }
    }

    #[test]
    fn agx_matches_independent_evaluation() {
        // Computed in NumPy from the same published constants.
        assert_eq!(shown(Tonemap::Agx, Rgb::splat(0.18)), [128; 3]);
        assert_eq!(shown(Tonemap::Agx, Rgb::splat(1.0)), [202; 3]);
        assert_eq!(shown(Tonemap::Agx, Rgb::splat(16.0)), [254; 3]);
        assert_eq!(shown(Tonemap::Agx, Rgb::new(1.0, 0.0, 0.0)), [221, 92, 73]);
        assert_eq!(shown(Tonemap::Agx, Rgb::new(0.0, 0.5, 0.0)), [95, 172, 65]);
        assert_eq!(shown(Tonemap::Agx, Rgb::new(0.0, 0.0, 2.0)), [92, 136, 245]);
    }

    #[test]
    fn reinhard_reaches_white_at_four() {
        assert_eq!(grey(Tonemap::Reinhard, 4.0), 1.0);
        assert!((grey(Tonemap::Reinhard, 1.0) - 17.0 / 32.0).abs() < 1e-6);
    }

    #[test]
    fn pbr_neutral_subtracts_fresnel_below_compression() {
        let display = DisplayTransform::new(Tonemap::PbrNeutral, 0.0, &[]);
        let shown = display.apply(Rgb::new(0.7, 0.3, 0.1));
        for (a, b) in shown.to_array().into_iter().zip([0.66, 0.26, 0.06]) {
            assert!((a - b).abs() < 1e-6);
        }
        // The toe: the smallest component x becomes 6.25 x².
        assert!((display.apply(Rgb::splat(0.04)).r - 0.01).abs() < 1e-7);
        // Base colours are preserved: the 0.04 of Fresnel is subtracted.
        assert!((display.apply(Rgb::splat(0.8)).r - 0.76).abs() < 1e-6);
    }

    #[test]
    fn scale_by_maximum_maps_largest_component_to_one() {
        let pixels = [Rgb::new(0.1, 0.3, 0.2), Rgb::new(7.7, f32::NAN, 3.0), Rgb::splat(f32::INFINITY)];
        for exposure_ev in [-3.3, 0.0, 1.7, 100.0] {
            let display = DisplayTransform::new(Tonemap::ScaleByMaximum, exposure_ev, &pixels);
            assert_eq!(display.apply(pixels[1]).r, 1.0);
            assert_eq!(display.apply(pixels[2]), Rgb::WHITE);
        }
        let dark = DisplayTransform::new(Tonemap::ScaleByMaximum, 0.0, &[Rgb::splat(0.25)]);
        assert_eq!(dark.apply(Rgb::splat(0.125)), Rgb::splat(0.5));
        let black = DisplayTransform::new(Tonemap::ScaleByMaximum, 0.0, &[Rgb::BLACK; 4]);
        assert_eq!(black.apply(Rgb::BLACK), Rgb::BLACK);
    }

    #[test]
    fn exposure_is_in_stops() {
        let display = DisplayTransform::new(Tonemap::Clamp, -2.0, &[]);
        assert_eq!(display.apply(Rgb::new(2.0, 1.0, 0.5)), Rgb::new(0.5, 0.25, 0.125));
    }

    #[test]
    fn curves_keep_black_and_the_order_of_greys() {
        for curve in CURVES {
            assert_eq!(grey(curve, 0.0), 0.0, "{curve:?}");
            let mut before = 0.0;
            for step in 0..4000 {
                let now = grey(curve, libm::exp2(f64::from(step) / 100.0 - 20.0) as f32);
                assert!(now >= before, "{curve:?} at step {step}: {now} after {before}");
                before = now;
            }
            assert!(before > 0.98, "{curve:?} ends at {before}");
        }
    }

    #[test]
    fn srgb_curve_has_published_values() {
        assert_eq!((srgb_encode(0.0), srgb_encode(1.0)), (0.0, 1.0));
        assert_eq!((srgb_decode(0.0), srgb_decode(1.0)), (0.0, 1.0));
        assert!((srgb_encode(0.5) - 0.735_357).abs() < 1e-6);
        for byte in 0..=255_u8 {
            assert_eq!(quantise_8_bit(srgb_encode(srgb_decode(f32::from(byte) / 255.0))), byte);
        }
        for word in 0..=u16::MAX {
            assert_eq!(quantise_16_bit(srgb_encode(srgb_decode(f32::from(word) / 65_535.0))), word);
        }
    }

    proptest! {
        #[test]
        fn every_input_has_a_displayable_output(
            r in any::<f32>(), g in any::<f32>(), b in any::<f32>(), exposure_ev in any::<f32>(),
        ) {
            check(Rgb::new(r, g, b), exposure_ev);
        }
    }

    #[test]
    fn extreme_inputs_have_a_displayable_output() {
        let extremes = [0.0, 1e30, f32::MAX, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-45, -1.0];
        for r in extremes {
            for g in extremes {
                for b in extremes {
                    for exposure_ev in [0.0, 300.0, -300.0, f32::NAN] {
                        check(Rgb::new(r, g, b), exposure_ev);
                    }
                }
            }
        }
    }

    fn check(radiance: Rgb, exposure_ev: f32) {
        for curve in CURVES {
            let shown = DisplayTransform::new(curve, exposure_ev, &[radiance]).apply(radiance);
            for component in shown.to_array() {
                assert!((0.0..=1.0).contains(&component), "{curve:?} {radiance:?}: {shown:?}");
            }
        }
    }
}
