//! Encoding of sums as bytes: numbers are split into byte planes, lowest bytes first, and each plane is stored in its
//! smallest form. The highest bytes are all zero, the lowest ones are noise.

use std::io::{Read, Write};

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;

/// The encodings of a plane.
const ZERO: u8 = 0;
const RAW: u8 = 1;
const DEFLATED: u8 = 2;

/// A number of `N` bytes, stored little-endian.
pub trait Number<const N: usize>: Copy {
    /// Returns its bytes, lowest first.
    fn to_bytes(self) -> [u8; N];
    /// Returns the number with these bytes.
    fn from_bytes(bytes: [u8; N]) -> Self;
}

impl Number<8> for i64 {
    fn to_bytes(self) -> [u8; 8] {
        self.to_le_bytes()
    }

    fn from_bytes(bytes: [u8; 8]) -> Self {
        Self::from_le_bytes(bytes)
    }
}

impl Number<4> for u32 {
    fn to_bytes(self) -> [u8; 4] {
        self.to_le_bytes()
    }

    fn from_bytes(bytes: [u8; 4]) -> Self {
        Self::from_le_bytes(bytes)
    }
}

impl Number<16> for u128 {
    fn to_bytes(self) -> [u8; 16] {
        self.to_le_bytes()
    }

    fn from_bytes(bytes: [u8; 16]) -> Self {
        Self::from_le_bytes(bytes)
    }
}

/// Appends the planes of some numbers.
pub fn encode<T: Number<N>, const N: usize>(numbers: impl Iterator<Item = T> + Clone, out: &mut Vec<u8>) {
    let mut plane = Vec::new();
    for byte in 0..N {
        plane.clear();
        plane.extend(numbers.clone().map(|number| number.to_bytes()[byte]));
        encode_plane(&plane, out);
    }
}

fn encode_plane(plane: &[u8], out: &mut Vec<u8>) {
    if plane.iter().all(|byte| *byte == 0) {
        out.push(ZERO);
        return;
    }
    let start = out.len();
    if !is_noise(plane) {
        out.push(DEFLATED);
        out.extend([0; 4]);
        let mut encoder = DeflateEncoder::new(&mut *out, Compression::fast());
        // Writing to memory cannot fail; if it did, the plane would be stored uncompressed.
        let written = encoder.write_all(plane).and_then(|()| encoder.finish().map(|_| ()));
        let length = out.len() - start - 5;
        if written.is_ok() && length < plane.len() {
            out[start + 1..start + 5].copy_from_slice(&(length as u32).to_le_bytes());
            return;
        }
        out.truncate(start);
    }
    out.push(RAW);
    out.extend_from_slice(plane);
}

/// True if all byte values are about equally frequent: compression would take time and save nothing.
fn is_noise(plane: &[u8]) -> bool {
    let mut counts = [0u32; 256];
    plane.iter().for_each(|byte| counts[usize::from(*byte)] += 1);
    let total = plane.len() as f64;
    let bits = |count: &u32| -f64::from(*count) * libm::log2(f64::from(*count) / total);
    let entropy: f64 = counts.iter().filter(|count| **count > 0).map(bits).sum();
    entropy > 7.9 * total
}

/// Takes the planes of `count` numbers from the front of `bytes`; none if they are invalid.
pub fn decode<T: Number<N>, const N: usize>(bytes: &mut &[u8], count: usize) -> Option<Vec<T>> {
    let mut numbers = vec![[0u8; N]; count];
    let mut plane = Vec::new();
    for byte in 0..N {
        plane.clear();
        decode_plane(bytes, count, &mut plane)?;
        for (number, value) in numbers.iter_mut().zip(&plane) {
            number[byte] = *value;
        }
    }
    Some(numbers.into_iter().map(T::from_bytes).collect())
}

fn decode_plane(bytes: &mut &[u8], count: usize, plane: &mut Vec<u8>) -> Option<()> {
    match take(bytes, 1)? {
        [ZERO] => plane.resize(count, 0),
        [RAW] => plane.extend_from_slice(take(bytes, count)?),
        [DEFLATED] => {
            let length = u32::from_le_bytes(take(bytes, 4)?.try_into().ok()?);
            let packed = take(bytes, length as usize)?;
            // One byte more than expected suffices to detect damage.
            DeflateDecoder::new(packed).take(count as u64 + 1).read_to_end(plane).ok()?;
        }
        _ => return None,
    }
    (plane.len() == count).then_some(())
}

/// Takes `count` bytes from the front.
fn take<'a>(bytes: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (first, rest) = bytes.split_at_checked(count)?;
    *bytes = rest;
    Some(first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn encoded_numbers_decode_unchanged_and_cut_ones_fail(numbers in prop::collection::vec(any::<i64>(), 0..600), small in 0i64..4, fill in 0usize..3000) {
            let mut all = numbers;
            all.extend(std::iter::repeat_n(small, fill));
            let mut bytes = Vec::new();
            encode::<i64, 8>(all.iter().copied(), &mut bytes);
            let mut rest = &bytes[..];
            prop_assert_eq!(decode::<i64, 8>(&mut rest, all.len()), Some(all.clone()));
            prop_assert!(rest.is_empty());
            // Cut off.
            if !all.is_empty() {
                prop_assert_eq!(decode::<i64, 8>(&mut &bytes[..bytes.len() - 1], all.len()), None);
            }
        }
    }

    #[test]
    fn equal_numbers_compress_to_few_bytes() {
        let mut bytes = Vec::new();
        encode::<u32, 4>(std::iter::repeat_n(64, 10_000), &mut bytes);
        assert!(bytes.len() < 100, "{} bytes", bytes.len());
    }
}
