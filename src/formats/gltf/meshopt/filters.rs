//! The inverses of the filters applied to attributes before compression. Integers are normalised as everywhere in glTF;
//! results are rounded, halves away from 0.

use super::Filter;

/// Inverts a filter on elements of `stride` bytes.
pub(super) fn apply(filter: Filter, bytes: &mut [u8], stride: usize) -> Result<(), &'static str> {
    match (filter, stride) {
        (Filter::None, _) => {}
        (Filter::Octahedral, 4) => each::<4>(bytes, |e| {
            octahedral(e.map(|byte| f32::from(byte as i8)), 127.0).map(|n| n as i8 as u8)
        }),
        (Filter::Octahedral, 8) => {
            each::<8>(bytes, |e| words(octahedral(of_words(e).map(f32::from), 32_767.0).map(|n| n as i16)))
        }
        (Filter::Quaternion, 8) => each::<8>(bytes, |e| words(quaternion(of_words(e)))),
        (Filter::Exponential, _) => each::<4>(bytes, |e| exponential(i32::from_le_bytes(e)).to_le_bytes()),
        (Filter::Color, 4) => each::<4>(bytes, |e| {
            let [y, co, cg, alpha] = e;
            let signed = [co, cg].map(|byte| i32::from(byte as i8));
            color(y.into(), signed, alpha.into(), 255.0).map(|n| n as u8)
        }),
        (Filter::Color, 8) => each::<8>(bytes, |e| {
            let [y, co, cg, alpha] = of_words(e);
            let signed = [co, cg].map(i32::from);
            let [y, alpha] = [y, alpha].map(|word| i32::from(word as u16));
            words(color(y, signed, alpha, 65_535.0).map(|n| n as u16 as i16))
        }),
        (Filter::Octahedral | Filter::Color, _) => return Err("this filter needs a byteStride of 4 or 8"),
        (Filter::Quaternion, _) => return Err("quaternions need a byteStride of 8"),
    }
    Ok(())
}

fn each<const N: usize>(bytes: &mut [u8], change: impl Fn([u8; N]) -> [u8; N]) {
    bytes.as_chunks_mut().0.iter_mut().for_each(|element| *element = change(*element));
}

fn of_words(bytes: [u8; 8]) -> [i16; 4] {
    std::array::from_fn(|i| i16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]))
}

fn words(words: [i16; 4]) -> [u8; 8] {
    std::array::from_fn(|i| words[i / 2].to_le_bytes()[i % 2])
}

/// Decodes a unit vector from octahedral coordinates, folded onto the square |x| + |y| ≤ one; the fourth component
/// stays as it is.
fn octahedral([x, y, one, w]: [f32; 4], largest: f32) -> [f32; 4] {
    let z = one - x.abs() - y.abs();
    let fold = z.min(0.0);
    let unfold = |c: f32| if c >= 0.0 { c + fold } else { c - fold };
    let [x, y] = [unfold(x), unfold(y)];
    let length = (x * x + y * y + z * z).sqrt();
    let scale = if length > 0.0 { largest / length } else { 0.0 };
    [(x * scale).round(), (y * scale).round(), (z * scale).round(), w]
}

/// Decodes a unit quaternion whose largest component was left out; two bits give its index.
fn quaternion([x, y, z, scale]: [i16; 4]) -> [i16; 4] {
    let largest = usize::from(scale as u16 & 3);
    let unit = std::f32::consts::FRAC_1_SQRT_2 / f32::from(scale | 3);
    let rest = [x, y, z].map(|c| f32::from(c) * unit);
    let left = 1.0 - rest.iter().map(|c| c * c).sum::<f32>();
    let mut quaternion = [0; 4];
    let whole = |c: f32| (c * 32_767.0).round() as i16;
    quaternion[largest] = whole(left.max(0.0).sqrt());
    rest.iter().enumerate().for_each(|(i, c)| quaternion[(largest + 1 + i) & 3] = whole(*c));
    quaternion
}

/// Decodes a float from a signed exponent of 8 bits and a signed mantissa of 24.
fn exponential(number: i32) -> f32 {
    let (exponent, mantissa) = (number >> 24, number << 8 >> 8);
    libm::ldexp(f64::from(mantissa), exponent) as f32
}

/// Decodes red, green and blue from luma and two chroma differences, and alpha, whose highest set bit gives the bit
/// depth of all.
fn color(y: i32, [co, cg]: [i32; 2], alpha: i32, largest: f32) -> [i32; 4] {
    let bits = 32 - alpha.leading_zeros();
    let ones = ((1i64 << bits) - 1) as i32;
    let scale = if ones > 0 { largest / ones as f32 } else { 0.0 };
    let alpha = (alpha << 1 & ones) | (alpha & 1);
    [y + co - cg, y + cg, y - co - cg, alpha].map(|c| (c as f32 * scale).round().clamp(0.0, largest) as i32)
}
