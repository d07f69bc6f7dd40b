//! Decompression of buffer views of `EXT_meshopt_compression` and `KHR_meshopt_compression`, written from these
//! extensions' specifications (appendices A and B of the former, and the second version of attributes of the latter).

mod attributes;
mod filters;
mod indices;

use serde::Deserialize;

/// The extension of a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct MeshoptView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: usize,
    pub count: usize,
    pub mode: Mode,
    #[serde(default)]
    pub filter: Filter,
}

/// The kind of compressed data.
#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// The transformation of attributes before compression.
#[derive(Deserialize, Clone, Copy, Default, PartialEq)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

impl MeshoptView {
    /// The number of bytes of the decoded view; none on overflow.
    pub(super) fn decoded_length(&self) -> Option<usize> {
        self.count.checked_mul(self.byte_stride)
    }

    /// Decompresses the view; the error is a reason. The caller has reserved the memory.
    pub(super) fn decode(&self, data: &[u8]) -> Result<Vec<u8>, &'static str> {
        let (count, stride) = (self.count, self.byte_stride);
        match self.mode {
            Mode::Attributes => {
                if stride == 0 || stride > 256 || stride % 4 != 0 {
                    return Err("the byteStride of attributes must be a multiple of 4 up to 256");
                }
                let mut bytes = attributes::decode(data, count, stride).ok_or(DAMAGED)?;
                filters::apply(self.filter, &mut bytes, stride)?;
                Ok(bytes)
            }
            Mode::Triangles | Mode::Indices => {
                if stride != 2 && stride != 4 {
                    return Err("the byteStride of indices must be 2 or 4");
                }
                if self.filter != Filter::None {
                    return Err("indices have no filter");
                }
                let indices = match self.mode {
                    Mode::Triangles if count % 3 != 0 => return Err("the count must be a multiple of 3"),
                    Mode::Triangles => indices::triangles(data, count),
                    _ => indices::sequence(data, count),
                };
                let indices = indices.ok_or(DAMAGED)?;
                Ok(indices.iter().flat_map(|index| index.to_le_bytes().into_iter().take(stride)).collect())
            }
        }
    }
}

const DAMAGED: &str = "the compressed data are damaged";

/// A reader that takes bytes from the front.
struct ByteSource<'d>(&'d [u8]);

impl<'d> ByteSource<'d> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    fn take(&mut self, count: usize) -> Option<&'d [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    /// Reads a variable-length number: seven bits per byte, least significant first; the eighth bit is set if more
    /// bytes follow.
    fn number(&mut self) -> Option<u32> {
        let mut number = 0u32;
        for place in 0..5 {
            let byte = self.byte()?;
            number |= u32::from(byte & 127).checked_shl(7 * place)?;
            if byte < 128 {
                return Some(number);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compressed(mode: Mode, stride: usize, count: usize) -> MeshoptView {
        let filter = Filter::None;
        MeshoptView { buffer: 0, byte_offset: 0, byte_length: 0, byte_stride: stride, count, mode, filter }
    }

    #[test]
    fn index_sequences_decode_deltas_to_two_bases() {
        // 5, 6, 4 from the first base; 100 and 99 from the second; the tail.
        let mut data = vec![0xd1];
        for (base, delta) in [(0u32, 5i32), (0, 1), (1, 100), (0, -2), (1, -1)] {
            let folded = ((delta << 1) ^ (delta >> 31)) as u32;
            let word = folded << 1 | base;
            if word >= 128 {
                data.extend([word as u8 | 128, (word >> 7) as u8]);
            } else {
                data.push(word as u8);
            }
        }
        data.extend([0; 4]);
        let bytes = compressed(Mode::Indices, 2, 5).decode(&data).unwrap();
        assert_eq!(bytes, [5, 0, 6, 0, 100, 0, 4, 0, 99, 0]);
        assert!(compressed(Mode::Indices, 2, 6).decode(&data).is_err());
        assert!(compressed(Mode::Indices, 3, 5).decode(&data).is_err());
    }

    #[test]
    fn triangles_decode_edges_shared_with_earlier_ones() {
        // A first triangle of three new vertices, then one over its last edge with a new vertex.
        let mut data = vec![0xe1, 0xf0, 0x00];
        data.extend([0; 16]);
        let bytes = compressed(Mode::Triangles, 2, 6).decode(&data).unwrap();
        let words: Vec<u8> = bytes.chunks(2).map(|word| word[0]).collect();
        assert_eq!(words[..3], [0, 1, 2]);
        assert_eq!(words[5], 3);
    }

    #[test]
    fn attributes_decode_as_sums_of_deltas() {
        // Two elements of four bytes: the first is the baseline plus 0, each byte of the second is one more.
        let mut data = vec![0xa0];
        for _ in 0..4 {
            // Groups of 16: two bits per delta; the first is 0, the second 2, which means +1.
            data.extend([1, 0b0010_0000, 0, 0, 0]);
        }
        data.extend([0; 28]);
        data.extend([7, 8, 9, 10]);
        let bytes = compressed(Mode::Attributes, 4, 2).decode(&data).unwrap();
        assert_eq!(bytes, [7, 8, 9, 10, 8, 9, 10, 11]);
        for length in 0..data.len() {
            assert!(compressed(Mode::Attributes, 4, 2).decode(&data[..length]).is_err());
        }
    }

    #[test]
    fn filters_invert_the_encoding() {
        let apply = |filter: Filter, mut bytes: Vec<u8>, stride: usize| {
            filters::apply(filter, &mut bytes, stride).unwrap();
            bytes
        };
        assert_eq!(apply(Filter::Octahedral, vec![0, 0, 127, 1], 4), [0, 0, 127, 1]);
        assert_eq!(apply(Filter::Octahedral, vec![127, 0, 127, 1], 4), [127, 0, 0, 1]);
        // 3 · 2⁻¹
        assert_eq!(apply(Filter::Exponential, vec![3, 0, 0, 0xff], 4), 1.5f32.to_le_bytes());
        // All components but the largest, component 1, are 0.
        let scale = [0xfd, 0x7f];
        let quaternion = [0, 0, 0, 0, 0, 0, scale[0], scale[1]];
        assert_eq!(apply(Filter::Quaternion, quaternion.to_vec(), 8), [0, 0, 0xff, 0x7f, 0, 0, 0, 0]);
    }
}
