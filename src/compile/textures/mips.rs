//! Mip levels: smaller and smaller copies of an image, each texel the mean of those that it covers, in linear light.

use rayon::prelude::*;

use super::srgb::{CURVE, nearest};
use crate::film::texels::srgb_decode_16_bit;
use crate::world::assets::Texels;

/// Texels of a copy that are worth a job of their own.
const JOB: usize = 1 << 13;

/// Larger images are processed one after the other, each by all threads, because of the floats that are held while
/// their copies are made.
const LARGE: usize = 1 << 20;

/// Width and height in texels.
pub(super) type TexelSize = [usize; 2];

/// The destination of the texels of an image and of its copies.
pub(super) enum TexelsOut<'a> {
    Bytes(&'a mut [u32]),
    Floats(&'a mut [[f32; 3]]),
}

/// An image, the sizes of its levels, and their destination.
pub(super) struct MipJob<'a> {
    pub texels: &'a Texels,
    /// The image's own size, then those of its copies.
    pub sizes: Vec<TexelSize>,
    pub room: TexelsOut<'a>,
    /// The values of colour bytes and of alpha bytes.
    pub decode: [&'a [f32]; 2],
    /// True if colour bytes are sRGB-encoded.
    pub srgb: bool,
    /// True if colours are weighted by their alpha.
    pub cut: bool,
}

/// An image's size and, if it is to have copies, theirs: halves down to one texel.
pub(super) fn sizes(own: TexelSize, copies: bool) -> Vec<TexelSize> {
    let next = |size: &TexelSize| (copies && *size != [1, 1]).then(|| size.map(|s| (s / 2).max(1)));
    std::iter::successors(Some(own), next).collect()
}

impl MipJob<'_> {
    /// True if all threads should share the work.
    pub(super) fn is_large(&self) -> bool {
        self.sizes[0].iter().product::<usize>() > LARGE
    }

    /// Makes all texels.
    pub(super) fn run(self) {
        let Self { texels, sizes, room, decode, srgb, cut } = self;
        match (texels, room) {
            (Texels::Rgba8(texels), TexelsOut::Bytes(room)) if cut => {
                bytes::<true>(texels, &sizes, decode, srgb, room);
            }
            (Texels::Rgba8(texels), TexelsOut::Bytes(room)) => {
                bytes::<false>(texels, &sizes, decode, srgb, room);
            }
            (Texels::Rgba16(words), TexelsOut::Bytes(room)) => {
                let texels = Texels::Rgba8(words.par_iter().map(|texel| texel.map(byte_of)).collect());
                MipJob { texels: &texels, sizes, room: TexelsOut::Bytes(room), decode, srgb, cut }.run();
            }
            (Texels::Rgb32(texels), TexelsOut::Floats(room)) => floats(texels, |texel| texel, &sizes, room),
            (Texels::Rgba16(texels), TexelsOut::Floats(room)) => match srgb {
                true => floats(texels, |texel| color_of(texel, srgb_decode_16_bit), &sizes, room),
                false => {
                    floats(texels, |texel| color_of(texel, |word| f32::from(word) / 65_535.0), &sizes, room)
                }
            },
            _ => {}
        }
    }
}

/// Added to the weight of each colour: where all are transparent, these have to do.
const HARDLY: f32 = 1e-3;

/// Makes the levels of bytes. With `CUT`, colours are weighted by their alpha.
fn bytes<const CUT: bool>(
    texels: &[[u8; 4]],
    sizes: &[TexelSize],
    decode: [&[f32]; 2],
    srgb: bool,
    room: &mut [u32],
) {
    let [colors, alphas] = decode;
    let weight = |alpha: f32| if CUT { alpha + HARDLY } else { 1.0 };
    let read = |t: [u8; 4]| {
        let alpha = alphas[usize::from(t[3])];
        let color = |c: usize| colors[usize::from(t[c])] * weight(alpha);
        [color(0), color(1), color(2), alpha]
    };
    let curve = &*CURVE;
    let encode = |c: f32| if srgb { curve.byte(c) } else { nearest(c) };
    let pack = |[r, g, b, a]: [f32; 4]| {
        let [r, g, b] = [r, g, b].map(|c| encode(c / weight(a)));
        u32::from_le_bytes([r, g, b, nearest(a)])
    };
    let (own, mut rest) = room.split_at_mut(texels.len());
    own.par_chunks_mut(JOB).zip(texels.par_chunks(JOB)).for_each(|(words, texels)| {
        for (word, texel) in words.iter_mut().zip(texels) {
            *word = u32::from_le_bytes(*texel);
        }
    });
    // Each copy is made from the one before it, prior to rounding. The image itself is never held as floats: it may
    // fill half of the memory.
    let mut finer: Vec<[f32; 4]> = Vec::new();
    for pair in sizes.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let words;
        (words, rest) = rest.split_at_mut(to[0] * to[1]);
        let mut means = vec![[0.0; 4]; words.len()];
        let rows = means.par_chunks_mut(to[0]).zip(words.par_chunks_mut(to[0])).enumerate();
        rows.with_min_len(JOB.div_ceil(to[0])).for_each(|(y, (means, words))| {
            match finer.is_empty() {
                true => halve(texels, read, [from, to], y, means),
                false => halve(&finer, |texel| texel, [from, to], y, means),
            }
            for (word, mean) in words.iter_mut().zip(means) {
                *word = pack(*mean);
            }
        });
        finer = means;
    }
}

/// The byte nearest to a 16-bit value.
fn byte_of(word: u16) -> u8 {
    ((u32::from(word) + 128) / 257) as u8
}

fn color_of([r, g, b, _]: [u16; 4], decode: impl Fn(u16) -> f32) -> [f32; 3] {
    [r, g, b].map(decode)
}

/// Makes the levels of floats; `read` converts a stored texel.
fn floats<T: Copy + Sync>(
    texels: &[T],
    read: impl Fn(T) -> [f32; 3] + Sync,
    sizes: &[TexelSize],
    room: &mut [[f32; 3]],
) {
    let (mut finer, mut rest) = room.split_at_mut(texels.len());
    finer.par_chunks_mut(JOB).zip(texels.par_chunks(JOB)).for_each(|(to, from)| {
        for (to, from) in to.iter_mut().zip(from) {
            *to = read(*from);
        }
    });
    for pair in sizes.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let level;
        (level, rest) = rest.split_at_mut(to[0] * to[1]);
        let rows = level.par_chunks_mut(to[0]).enumerate().with_min_len(JOB.div_ceil(to[0]));
        rows.for_each(|(y, means)| halve(finer, |texel| texel, [from, to], y, means));
        finer = level;
    }
}

/// Computes a row of an image of half the size. Odd sizes lose no row: the last texel covers three.
fn halve<T: Copy, const N: usize>(
    texels: &[T],
    read: impl Fn(T) -> [f32; N],
    [from, to]: [TexelSize; 2],
    y: usize,
    means: &mut [[f32; N]],
) {
    let add = |sum: [f32; N], texel: [f32; N]| std::array::from_fn(|c| sum[c] + texel[c]);
    if from == to.map(|s| 2 * s) {
        let (upper, lower) = texels[2 * y * from[0]..][..2 * from[0]].split_at(from[0]);
        let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
        for (mean, (upper, lower)) in means.iter_mut().zip(pairs) {
            let texels = [upper[0], upper[1], lower[0], lower[1]].map(&read);
            *mean = texels.into_iter().fold([0.0; N], add).map(|c| c / 4.0);
        }
        return;
    }
    let covered =
        |i: usize, axis: usize| i * from[axis] / to[axis]..((i + 1) * from[axis]).div_ceil(to[axis]);
    for (x, mean) in means.iter_mut().enumerate() {
        let (mut sum, mut count) = ([0.0; N], 0.0);
        for row in covered(y, 1) {
            for column in covered(x, 0) {
                sum = add(sum, read(texels[row * from[0] + column]));
                count += 1.0;
            }
        }
        *mean = sum.map(|c| c / count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tonemap::{srgb_decode, srgb_encode};

    /// Bytes without a pattern.
    fn noise(count: usize) -> Vec<[u8; 4]> {
        let word = |i: usize| (i as u32).wrapping_mul(2_654_435_761).rotate_left(11);
        (0..count).map(|i| (word(i) ^ word(i) >> 15).to_le_bytes()).collect()
    }

    /// The copies by definition: each texel is the mean of those that it covers in the copy before.
    fn copies(own: Vec<[f32; 4]>, sizes: &[TexelSize]) -> Vec<[f32; 4]> {
        let (mut all, mut finer) = (Vec::new(), own);
        for pair in sizes.windows(2) {
            let [[w, h], [columns, rows]] = [pair[0], pair[1]];
            let mut level = Vec::new();
            for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
                let (mut sum, mut count) = ([0.0; 4], 0.0);
                for row in y * h / rows..((y + 1) * h).div_ceil(rows) {
                    for column in x * w / columns..((x + 1) * w).div_ceil(columns) {
                        sum = [0, 1, 2, 3].map(|c| sum[c] + finer[row * w + column][c]);
                        count += 1.0;
                    }
                }
                level.push(sum.map(|c| c / count));
            }
            all.extend_from_slice(&level);
            finer = level;
        }
        all
    }

    const SIZES: [TexelSize; 7] = [[1, 1], [8, 8], [256, 64], [5, 3], [1, 9], [6, 7], [33, 16]];

    #[test]
    fn sizes_are_halved_to_one_texel() {
        assert_eq!(sizes([5, 2], true), [[5, 2], [2, 1], [1, 1]]);
        assert_eq!(sizes([5, 2], false), [[5, 2]]);
    }

    #[test]
    fn copies_of_bytes_match_the_definition() {
        let unit = |byte: u8| f32::from(byte) / 255.0;
        let linear: Vec<f32> = (0..=255).map(unit).collect();
        let curved: Vec<f32> = linear.iter().map(|value| srgb_decode(*value)).collect();
        for (own, srgb) in SIZES.into_iter().flat_map(|size| [(size, false), (size, true)]) {
            let (texels, sizes) = (noise(own[0] * own[1]), sizes(own, true));
            let decode = |[r, g, b, a]: [u8; 4]| {
                let color = |byte| if srgb { srgb_decode(unit(byte)) } else { unit(byte) };
                [color(r), color(g), color(b), unit(a)]
            };
            let byte = |c: f32| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
            let color = |c: f32| byte(if srgb { srgb_encode(c) } else { c });
            let copies = copies(texels.iter().map(|t| decode(*t)).collect(), &sizes);
            let copies = copies.into_iter().map(|[r, g, b, a]| [color(r), color(g), color(b), byte(a)]);
            let expected: Vec<u32> = texels.iter().copied().chain(copies).map(u32::from_le_bytes).collect();
            let mut found = vec![0; expected.len()];
            let decode = [if srgb { &curved[..] } else { &linear }, &linear];
            let texels = Texels::Rgba8(texels);
            MipJob { texels: &texels, sizes, room: TexelsOut::Bytes(&mut found), decode, srgb, cut: false }
                .run();
            assert!(found == expected, "{own:?}, {srgb}");
        }
    }

    /// Transparent texels leave no fringe of their colour.
    #[test]
    fn colours_are_weighted_by_alpha() {
        let linear: Vec<f32> = (0..=255).map(|byte| byte as f32 / 255.0).collect();
        let (leaf, faint, gone) = ([40, 200, 80, 255], [240, 100, 80, 51], [255, 255, 255, 0]);
        let copy = |texels: [[u8; 4]; 4], cut: bool| {
            let mut found = [0; 5];
            let decode = [&linear[..]; 2];
            let room = TexelsOut::Bytes(&mut found);
            let texels = Texels::Rgba8(texels.to_vec());
            MipJob { texels: &texels, sizes: vec![[2, 2], [1, 1]], room, decode, srgb: false, cut }.run();
            found[4].to_le_bytes()
        };
        let near = |found: [u8; 4], expected: [u8; 4]| {
            assert!(found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1), "{found:?} {expected:?}");
        };
        near(copy([leaf, gone, gone, leaf], true), [40, 200, 80, 128]);
        near(copy([leaf, gone, gone, leaf], false), [148, 228, 168, 128]);
        // (40 + 240 / 5) / (1 + 1 / 5) and so on.
        near(copy([leaf, faint, gone, gone], true), [74, 183, 80, 77]);
        near(copy([gone; 4], true), gone);
        near(copy([leaf; 4], true), leaf);
    }

    #[test]
    fn copies_of_floats_match_the_definition() {
        for own in SIZES {
            let texels: Vec<[f32; 3]> = noise(own[0] * own[1])
                .iter()
                .map(|[r, g, b, _]| [*r, *g, *b].map(|c| f32::from(c) * 0.37))
                .collect();
            let sizes = sizes(own, true);
            let copies = copies(texels.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]).collect(), &sizes);
            let copies = copies.into_iter().map(|[r, g, b, _]| [r, g, b]);
            let expected: Vec<[f32; 3]> = texels.iter().copied().chain(copies).collect();
            let mut found = vec![[0.0; 3]; expected.len()];
            let texels = Texels::Rgb32(texels);
            let decode: [&[f32]; 2] = [&[]; 2];
            MipJob {
                texels: &texels,
                sizes,
                room: TexelsOut::Floats(&mut found),
                decode,
                srgb: false,
                cut: false,
            }
            .run();
            assert!(found == expected, "{own:?}");
        }
    }
}
