//! Colours by their names: of CSS, of black bodies and of metals.

use crate::film::tonemap::srgb_decode;
use crate::math::Rgb;

/// The named colours of CSS Color Module Level 4, section 6.1: each name with its sRGB bytes.
const NAMES: &str = "
    aliceblue f0f8ff  antiquewhite faebd7  aqua 00ffff  aquamarine 7fffd4  azure f0ffff  beige f5f5dc  bisque ffe4c4
    black 000000  blanchedalmond ffebcd  blue 0000ff  blueviolet 8a2be2  brown a52a2a  burlywood deb887
    cadetblue 5f9ea0  chartreuse 7fff00  chocolate d2691e  coral ff7f50  cornflowerblue 6495ed  cornsilk fff8dc
    crimson dc143c  cyan 00ffff  darkblue 00008b  darkcyan 008b8b  darkgoldenrod b8860b  darkgray a9a9a9
    darkgreen 006400  darkgrey a9a9a9  darkkhaki bdb76b  darkmagenta 8b008b  darkolivegreen 556b2f  darkorange ff8c00
    darkorchid 9932cc  darkred 8b0000  darksalmon e9967a  darkseagreen 8fbc8f  darkslateblue 483d8b
    darkslategray 2f4f4f  darkslategrey 2f4f4f  darkturquoise 00ced1  darkviolet 9400d3  deeppink ff1493
    deepskyblue 00bfff  dimgray 696969  dimgrey 696969  dodgerblue 1e90ff  firebrick b22222  floralwhite fffaf0
    forestgreen 228b22  fuchsia ff00ff  gainsboro dcdcdc  ghostwhite f8f8ff  gold ffd700  goldenrod daa520
    gray 808080  green 008000  greenyellow adff2f  grey 808080  honeydew f0fff0  hotpink ff69b4  indianred cd5c5c
    indigo 4b0082  ivory fffff0  khaki f0e68c  lavender e6e6fa  lavenderblush fff0f5  lawngreen 7cfc00
    lemonchiffon fffacd  lightblue add8e6  lightcoral f08080  lightcyan e0ffff  lightgoldenrodyellow fafad2
    lightgray d3d3d3  lightgreen 90ee90  lightgrey d3d3d3  lightpink ffb6c1  lightsalmon ffa07a  lightseagreen 20b2aa
    lightskyblue 87cefa  lightslategray 778899  lightslategrey 778899  lightsteelblue b0c4de  lightyellow ffffe0
    lime 00ff00  limegreen 32cd32  linen faf0e6  magenta ff00ff  maroon 800000  mediumaquamarine 66cdaa
    mediumblue 0000cd  mediumorchid ba55d3  mediumpurple 9370db  mediumseagreen 3cb371  mediumslateblue 7b68ee
    mediumspringgreen 00fa9a  mediumturquoise 48d1cc  mediumvioletred c71585  midnightblue 191970  mintcream f5fffa
    mistyrose ffe4e1  moccasin ffe4b5  navajowhite ffdead  navy 000080  oldlace fdf5e6  olive 808000  olivedrab 6b8e23
    orange ffa500  orangered ff4500  orchid da70d6  palegoldenrod eee8aa  palegreen 98fb98  paleturquoise afeeee
    palevioletred db7093  papayawhip ffefd5  peachpuff ffdab9  peru cd853f  pink ffc0cb  plum dda0dd
    powderblue b0e0e6  purple 800080  rebeccapurple 663399  red ff0000  rosybrown bc8f8f  royalblue 4169e1
    saddlebrown 8b4513  salmon fa8072  sandybrown f4a460  seagreen 2e8b57  seashell fff5ee  sienna a0522d
    silver c0c0c0  skyblue 87ceeb  slateblue 6a5acd  slategray 708090  slategrey 708090  snow fffafa
    springgreen 00ff7f  steelblue 4682b4  tan d2b48c  teal 008080  thistle d8bfd8  tomato ff6347  turquoise 40e0d0
    violet ee82ee  wheat f5deb3  white ffffff  whitesmoke f5f5f5  yellow ffff00  yellowgreen 9acd32
";

/// A colour from its sRGB bytes.
pub(super) fn from_bytes(bytes: [u32; 3]) -> Rgb {
    bytes.map(|byte| srgb_decode(byte as f32 / 255.0)).into()
}

/// The colour that CSS calls by a name, in letters of either case.
pub(super) fn named(name: &str) -> Option<Rgb> {
    let mut words = NAMES.split_whitespace();
    while let (Some(known), Some(digits)) = (words.next(), words.next()) {
        if known.eq_ignore_ascii_case(name) {
            let bits = u32::from_str_radix(digits, 16).ok()?;
            return Some(from_bytes([bits >> 16, bits >> 8 & 255, bits & 255]));
        }
    }
    None
}

/// The names of CSS, for suggestions.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    NAMES.split_whitespace().step_by(2)
}

/// The colour matching functions x, y and z of the CIE 1931 standard observer at 380, 390, … 780 nm (CIE 15:2004, table
/// T.4).
const OBSERVER: [[f64; 3]; 41] = [
    [0.0014, 0.0000, 0.0065],
    [0.0042, 0.0001, 0.0201],
    [0.0143, 0.0004, 0.0679],
    [0.0435, 0.0012, 0.2074],
    [0.1344, 0.0040, 0.6456],
    [0.2839, 0.0116, 1.3856],
    [0.3483, 0.0230, 1.7471],
    [0.3362, 0.0380, 1.7721],
    [0.2908, 0.0600, 1.6692],
    [0.1954, 0.0910, 1.2876],
    [0.0956, 0.1390, 0.8130],
    [0.0320, 0.2080, 0.4652],
    [0.0049, 0.3230, 0.2720],
    [0.0093, 0.5030, 0.1582],
    [0.0633, 0.7100, 0.0782],
    [0.1655, 0.8620, 0.0422],
    [0.2904, 0.9540, 0.0203],
    [0.4334, 0.9950, 0.0087],
    [0.5945, 0.9950, 0.0039],
    [0.7621, 0.9520, 0.0021],
    [0.9163, 0.8700, 0.0017],
    [1.0263, 0.7570, 0.0011],
    [1.0622, 0.6310, 0.0008],
    [1.0026, 0.5030, 0.0003],
    [0.8544, 0.3810, 0.0002],
    [0.6424, 0.2650, 0.0000],
    [0.4479, 0.1750, 0.0000],
    [0.2835, 0.1070, 0.0000],
    [0.1649, 0.0610, 0.0000],
    [0.0874, 0.0320, 0.0000],
    [0.0468, 0.0170, 0.0000],
    [0.0227, 0.0082, 0.0000],
    [0.0114, 0.0041, 0.0000],
    [0.0058, 0.0021, 0.0000],
    [0.0029, 0.0010, 0.0000],
    [0.0014, 0.0005, 0.0000],
    [0.0007, 0.0002, 0.0000],
    [0.0003, 0.0001, 0.0000],
    [0.0002, 0.0001, 0.0000],
    [0.0001, 0.0000, 0.0000],
    [0.0000, 0.0000, 0.0000],
];

/// The wavelength of a row of [`OBSERVER`], in metres.
fn wavelength_m(row: usize) -> f64 {
    (380.0 + 10.0 * row as f64) * 1e-9
}

/// The linear colour with Rec. 709 primaries of a spectrum, given by its value at each row of [`OBSERVER`].
fn of_spectrum(value: impl Fn(usize) -> f64) -> [f64; 3] {
    /// XYZ to linear sRGB (IEC 61966-2-1).
    const TO_RGB: [[f64; 3]; 3] = [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ];
    let mut sums = [0.0; 3];
    for (row, weights) in OBSERVER.iter().enumerate() {
        let value = value(row);
        sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * value);
    }
    TO_RGB.map(|row| row.iter().zip(sums).map(|(factor, sum)| factor * sum).sum())
}

/// The temperatures in kelvin that [`black_body`] takes.
pub(super) const TEMPERATURES: [f32; 2] = [800.0, 100_000.0];

/// The colour of a black body (Planck's law), with a luminance of 1: a lamp keeps its brightness whatever its
/// temperature. Below about 1900 K the colour has no blue, and is the nearest one that has none.
pub(super) fn black_body(kelvin: f32) -> Rgb {
    /// Planck's constant times the speed of light over Boltzmann's constant, in m K.
    const SECOND_RADIATION: f64 = 1.438_776_877e-2;
    let radiance = |row: usize| {
        let length = wavelength_m(row);
        let exponent = SECOND_RADIATION / (length * f64::from(kelvin));
        // Relative to the middle of the spectrum, so that no number is too small.
        let middle = SECOND_RADIATION / (580e-9 * f64::from(kelvin));
        libm::pow(580e-9 / length, 5.0) * libm::expm1(middle) / libm::expm1(exponent)
    };
    let color = of_spectrum(radiance).map(|part| part.max(0.0));
    let luminance = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
    color.map(|part| (part / luminance) as f32).into()
}

/// Metals: the light that a smooth surface of each reflects straight on, and the factor on Schlick's approximation at the
/// angle of cosine 1/7 (82°); linear colours under daylight (D65), from measured indices of refraction n + i k and
/// Fresnel's equations, averaged with the [`OBSERVER`]'s weights. What is beyond 1, as red is of gold, is cut off. A test
/// computes them from the indices.
const METALS: [(&str, [f32; 3], [f32; 3]); 10] = [
    ("aluminium", [0.907, 0.916, 0.922], [0.874, 0.903, 0.933]),
    ("brass", [0.910, 0.778, 0.424], [0.952, 0.979, 1.0]),
    ("chromium", [0.550, 0.556, 0.554], [0.741, 0.749, 0.814]),
    ("copper", [0.932, 0.622, 0.522], [0.982, 0.947, 0.945]),
    ("gold", [1.0, 0.729, 0.364], [0.991, 1.0, 0.981]),
    ("iron", [0.530, 0.513, 0.494], [0.765, 0.767, 0.801]),
    ("nickel", [0.697, 0.641, 0.563], [0.815, 0.834, 0.871]),
    ("silver", [0.989, 0.984, 0.978], [0.993, 0.995, 0.999]),
    ("steel", [0.604, 0.587, 0.568], [0.814, 0.847, 0.903]),
    ("titanium", [0.619, 0.579, 0.543], [0.769, 0.790, 0.821]),
];

/// The names of the metals.
pub(super) const METAL_NAMES: [&str; METALS.len()] = {
    let mut names = [""; METALS.len()];
    let mut at = 0;
    while at < names.len() {
        names[at] = METALS[at].0;
        at += 1;
    }
    names
};

/// The reflectance of a metal straight on, and the tint of its edge.
pub(super) fn metal(name: &str) -> Option<[Rgb; 2]> {
    METALS
        .iter()
        .find(|(known, ..)| *known == name)
        .map(|(_, straight, edge)| [*straight, *edge].map(Rgb::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_css_are_sorted_and_complete() {
        let all: Vec<&str> = names().collect();
        assert_eq!(all.len(), 148);
        assert!(all.is_sorted());
        assert_eq!(named("RebeccaPurple"), Some(from_bytes([0x66, 0x33, 0x99])));
        assert_eq!((named("white"), named("lime")), (Some(Rgb::WHITE), Some(Rgb::new(0.0, 1.0, 0.0))));
        assert_eq!(named("reddish"), None);
        assert!(all.iter().all(|name| named(name).is_some()));
    }

    /// Chromaticities of the Planckian locus (Wyszecki and Stiles, Color Science, 2nd ed., table 1(3.11)).
    #[test]
    fn black_bodies_lie_on_the_planckian_locus() {
        for (kelvin, x, y) in [
            (2000.0, 0.5267, 0.4133),
            (2856.0, 0.4476, 0.4074),
            (5000.0, 0.3451, 0.3516),
            (10000.0, 0.2806, 0.2883),
        ] {
            let Rgb { r, g, b } = black_body(kelvin);
            let xyz = [
                0.4124564 * r + 0.3575761 * g + 0.1804375 * b,
                0.2126729 * r + 0.7151522 * g + 0.0721750 * b,
                0.0193339 * r + 0.119192 * g + 0.9503041 * b,
            ];
            let sum: f32 = xyz.iter().sum();
            assert!((xyz[0] / sum - x).abs() < 5e-4 && (xyz[1] / sum - y).abs() < 5e-4, "{kelvin}: {xyz:?}");
        }
        let [coldest, hottest] = TEMPERATURES;
        for step in 0..=100 {
            let kelvin = coldest * (hottest / coldest).powf(step as f32 / 100.0);
            let color = black_body(kelvin);
            assert!(color.is_finite() && color.to_array().iter().all(|part| *part >= 0.0), "{kelvin}");
            assert!((color.luminance() - 1.0).abs() < 1e-5, "{kelvin}: {color:?}");
        }
    }

    /// Daylight of 6504 K at the rows of [`OBSERVER`] (CIE standard illuminant D65).
    const D65: [f64; 41] = [
        49.98, 54.65, 82.75, 91.49, 93.43, 86.68, 104.86, 117.01, 117.81, 114.86, 115.92, 108.81, 109.35,
        107.80, 104.79, 107.69, 104.41, 104.05, 100.00, 96.33, 95.79, 88.69, 90.01, 89.60, 87.70, 83.29,
        83.70, 80.03, 80.21, 82.28, 78.28, 69.72, 71.61, 74.35, 61.60, 69.89, 75.09, 63.59, 46.42, 66.81,
        63.38,
    ];

    /// The wavelengths in nm of Johnson and Christy's measurements.
    const JOHNSON: [f64; 14] =
        [381.5, 397.4, 413.3, 430.5, 450.9, 471.4, 495.9, 520.9, 548.6, 582.1, 616.8, 659.5, 704.5, 756.0];
    const EVEN: [f64; 21] = [
        380.0, 400.0, 420.0, 440.0, 460.0, 480.0, 500.0, 520.0, 540.0, 560.0, 580.0, 600.0, 620.0, 640.0,
        660.0, 680.0, 700.0, 720.0, 740.0, 760.0, 780.0,
    ];
    const RAKIC: [f64; 11] =
        [364.66, 413.28, 442.80, 476.87, 516.60, 563.57, 619.93, 652.25, 688.81, 729.32, 774.91];

    type Measured = (&'static str, &'static [f64], &'static [f64], &'static [f64]);

    /// Indices n and k by wavelength, as listed by refractiveindex.info: Johnson and Christy, Phys. Rev. B 6, 4370
    /// (1972) for noble metals and 9, 5056 (1974) for transition metals; Rakić, Appl. Opt. 34, 4755 (1995) for aluminium;
    /// Querry, CRDC-CR-85034 (1985) for brass of 70 % copper; Karlsson and Ribbing, J. Appl. Phys. 53, 6340 (1982) for
    /// stainless steel.
    #[expect(clippy::approx_constant, reason = "an index that is near π by chance")]
    const MEASURED: [Measured; 10] = [
        (
            "aluminium",
            &RAKIC,
            &[0.39877, 0.52135, 0.6079, 0.7278, 0.8734, 1.0728, 1.366, 1.5724, 1.8301, 2.1606, 2.6154],
            &[4.3957, 5.0008, 5.3676, 5.7781, 6.2418, 6.7839, 7.4052, 7.7354, 8.0601, 8.3565, 8.4914],
        ),
        (
            "brass",
            &EVEN,
            &[
                1.487, 1.445, 1.35, 1.191, 0.994, 0.816, 0.686, 0.602, 0.549, 0.505, 0.468, 0.45, 0.449,
                0.444, 0.445, 0.444, 0.446, 0.45, 0.455, 0.458, 0.464,
            ],
            &[
                1.818, 1.805, 1.786, 1.797, 1.883, 2.046, 2.25, 2.464, 2.668, 2.86, 3.059, 3.253, 3.434,
                3.609, 3.778, 3.943, 4.106, 4.266, 4.424, 4.579, 4.737,
            ],
        ),
        (
            "chromium",
            &JOHNSON,
            &[1.92, 2.0, 2.08, 2.19, 2.33, 2.51, 2.75, 2.94, 3.18, 3.22, 3.17, 3.09, 3.05, 3.08],
            &[2.74, 2.83, 2.93, 3.04, 3.14, 3.24, 3.3, 3.33, 3.33, 3.3, 3.3, 3.34, 3.39, 3.42],
        ),
        (
            "copper",
            &JOHNSON,
            &[1.33, 1.32, 1.28, 1.25, 1.24, 1.25, 1.22, 1.18, 1.02, 0.7, 0.3, 0.22, 0.21, 0.24],
            &[
                2.045, 2.116, 2.207, 2.305, 2.397, 2.483, 2.564, 2.608, 2.577, 2.704, 3.205, 3.747, 4.205,
                4.665,
            ],
        ),
        (
            "gold",
            &JOHNSON,
            &[1.46, 1.47, 1.46, 1.45, 1.38, 1.31, 1.04, 0.62, 0.43, 0.29, 0.21, 0.14, 0.13, 0.14],
            &[
                1.933, 1.952, 1.958, 1.948, 1.914, 1.849, 1.833, 2.081, 2.455, 2.863, 3.272, 3.697, 4.103,
                4.542,
            ],
        ),
        (
            "iron",
            &JOHNSON,
            &[2.12, 2.24, 2.35, 2.48, 2.59, 2.67, 2.74, 2.86, 2.95, 2.94, 2.88, 2.92, 2.86, 2.87],
            &[2.5, 2.58, 2.65, 2.71, 2.77, 2.82, 2.88, 2.91, 2.93, 2.99, 3.05, 3.1, 3.19, 3.28],
        ),
        (
            "nickel",
            &JOHNSON,
            &[1.72, 1.72, 1.7, 1.71, 1.73, 1.78, 1.82, 1.85, 1.92, 1.96, 1.99, 1.99, 2.06, 2.13],
            &[2.48, 2.57, 2.69, 2.82, 2.95, 3.09, 3.25, 3.42, 3.61, 3.8, 4.02, 4.26, 4.5, 4.73],
        ),
        (
            "silver",
            &JOHNSON,
            &[0.05, 0.05, 0.05, 0.04, 0.04, 0.05, 0.05, 0.05, 0.06, 0.05, 0.06, 0.05, 0.04, 0.03],
            &[
                1.864, 2.07, 2.275, 2.462, 2.657, 2.869, 3.093, 3.324, 3.586, 3.858, 4.152, 4.483, 4.838,
                5.242,
            ],
        ),
        (
            "steel",
            &EVEN,
            &[
                1.2344, 1.3075, 1.3766, 1.4517, 1.5372, 1.6307, 1.7244, 1.8059, 1.873, 1.9355, 1.9969,
                2.0565, 2.1139, 2.1685, 2.2199, 2.2679, 2.3124, 2.3536, 2.3917, 2.4268, 2.4597,
            ],
            &[
                2.4214, 2.534, 2.6334, 2.7256, 2.8162, 2.9055, 2.9919, 3.0721, 3.1404, 3.2004, 3.2617,
                3.3248, 3.3881, 3.4507, 3.5118, 3.5707, 3.6273, 3.6821, 3.7354, 3.7877, 3.8395,
            ],
        ),
        (
            "titanium",
            &JOHNSON,
            &[1.99, 2.08, 2.14, 2.21, 2.27, 2.32, 2.36, 2.44, 2.54, 2.6, 2.67, 2.76, 2.86, 3.0],
            &[2.93, 2.95, 2.98, 3.01, 3.04, 3.1, 3.19, 3.3, 3.43, 3.58, 3.72, 3.84, 3.96, 4.01],
        ),
    ];

    /// The indices at a wavelength, interpolated.
    fn at(wavelengths: &[f64], values: &[f64], nm: f64) -> f64 {
        let next = wavelengths.partition_point(|known| *known < nm).clamp(1, wavelengths.len() - 1);
        let [low, high] = [wavelengths[next - 1], wavelengths[next]];
        let part = ((nm - low) / (high - low)).clamp(0.0, 1.0);
        values[next - 1] + (values[next] - values[next - 1]) * part
    }

    /// The part of unpolarised light that a conductor reflects (Born and Wolf, Principles of Optics, 14.2).
    fn conductor(n: f64, k: f64, cos: f64) -> f64 {
        let sin_square = 1.0 - cos * cos;
        let real = n * n - k * k - sin_square;
        let sum = (real * real + 4.0 * n * n * k * k).sqrt();
        let a = (0.5 * (sum + real)).max(0.0).sqrt();
        let across = (sum - 2.0 * a * cos + cos * cos) / (sum + 2.0 * a * cos + cos * cos);
        let [low, high] = [-1.0, 1.0]
            .map(|sign| sum * cos * cos + sign * 2.0 * a * cos * sin_square + sin_square * sin_square);
        0.5 * across * (1.0 + low / high)
    }

    #[test]
    fn metals_reflect_what_their_indices_say() {
        let white = of_spectrum(|row| D65[row]);
        for (name, wavelengths, n, k) in MEASURED {
            let reflected = |cos: f64| {
                let light = of_spectrum(|row| {
                    let nm = wavelength_m(row) * 1e9;
                    D65[row] * conductor(at(wavelengths, n, nm), at(wavelengths, k, nm), cos)
                });
                [0, 1, 2].map(|part| (light[part] / white[part]).min(1.0))
            };
            let [straight, edge] = [1.0, 1.0 / 7.0].map(reflected);
            let [known, tint] = metal(name).unwrap().map(Rgb::to_array);
            for part in 0..3 {
                let schlick = straight[part] + (1.0 - straight[part]) * (6.0f64 / 7.0).powi(5);
                let expected = [straight[part], (edge[part] / schlick).min(1.0)];
                let found = [known[part], tint[part]].map(f64::from);
                let near = (expected[0] - found[0]).abs() < 1e-3 && (expected[1] - found[1]).abs() < 1e-3;
                assert!(near, "{name}: {expected:?} is not {found:?}");
            }
        }
        assert_eq!(MEASURED.map(|(name, ..)| name), METAL_NAMES);
    }
}
