//! `KHR_texture_basisu`: KTX 2.0 images with blocks encoded by Basis Universal.

use std::path::Path;

use crate::error::{Diagnostic, LoadError};
use crate::formats::picture;
use crate::world::Image;

/// The first bytes of KTX 2.0 files.
const MAGIC: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Decodes an image in any format that glTF files may contain.
pub(super) fn decode(bytes: &[u8], path: &Path) -> Result<(Image, Option<Diagnostic>), LoadError> {
    match bytes.starts_with(MAGIC) {
        true => Ok((decode_ktx(bytes, path)?, None)),
        false => picture::decode(bytes, path),
    }
}

#[cfg(feature = "basisu")]
fn decode_ktx(bytes: &[u8], path: &Path) -> Result<Image, LoadError> {
    use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};

    use crate::world::Texels;

    let refuse =
        |reason: String| LoadError::invalid(path, format!("the picture cannot be decoded: {reason}"));
    let damaged = |error: basisu::Error| refuse(format!("{error:?}"));
    let sizes = |at: usize| bytes.get(at..)?.first_chunk().map(|word| u32::from_le_bytes(*word));
    let (Some(width), Some(height)) = (sizes(20), sizes(24)) else {
        return Err(refuse("the file ends within its header".to_owned()));
    };
    let _claim = picture::limits::check(path, [width.into(), height.into()], 4, bytes.len())?;
    let transcoder = Transcoder::new(bytes).map_err(damaged)?;
    if !matches!(transcoder.source_format(), SourceFormat::Etc1s | SourceFormat::UastcLdr) {
        return Err(refuse("it is neither ETC1S nor UASTC".to_owned()));
    }
    let texels = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(damaged)?;
    let texels = texels.as_chunks().0.to_vec();
    if texels.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(refuse("it has not as many pixels as it says".to_owned()));
    }
    Ok(Image { source: None, width, height, texels: Texels::Rgba8(texels) })
}

#[cfg(not(feature = "basisu"))]
fn decode_ktx(_: &[u8], path: &Path) -> Result<Image, LoadError> {
    Err(LoadError::invalid(
        path,
        "KTX 2.0 pictures need a program that was built with the feature \"basisu\"",
    ))
}

#[cfg(feature = "basisu")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Texels;

    /// An image of one UASTC block that is entirely red.
    fn red() -> Vec<u8> {
        let mut file = MAGIC.to_vec();
        let words: [u32; 17] = [0, 1, 4, 4, 0, 0, 1, 1, 0, 104, 44, 0, 0, 0, 0, 0, 0];
        words.iter().for_each(|word| file.extend(word.to_le_bytes()));
        // The level: offset, length, uncompressed length.
        [148u64, 16, 16].iter().for_each(|number| file.extend(number.to_le_bytes()));
        // The descriptor: UASTC, BT.709, linear; four by four texels; RGBA.
        let words: [u32; 11] = [
            44,
            0,
            40 << 16 | 2,
            166 | 1 << 8 | 1 << 16,
            3 | 3 << 8,
            16,
            0,
            127 << 16 | 3 << 24,
            0,
            0,
            u32::MAX,
        ];
        words.iter().for_each(|word| file.extend(word.to_le_bytes()));
        // Mode 8 is five bits, 0b10111, least significant first, then red, green, blue, alpha.
        let block = SOLID | 255u128 << 5 | 255u128 << 29;
        file.extend(block.to_le_bytes());
        file
    }

    const SOLID: u128 = 0b10111;

    #[test]
    fn uniform_uastc_block_is_decoded() {
        let (image, _) = decode(&red(), Path::new("red.ktx2")).unwrap();
        let Texels::Rgba8(texels) = image.texels else { panic!() };
        assert_eq!((image.width, image.height, texels), (4, 4, vec![[255, 0, 0, 255]; 16]));
    }

    #[test]
    fn damaged_ktx_files_are_rejected_without_panics() {
        let file = red();
        for length in 0..file.len() {
            assert!(decode(&file[..length], Path::new("red.ktx2")).is_err());
        }
        for at in 12..file.len() {
            let mut file = file.clone();
            file[at] ^= 0x55;
            drop(decode(&file, Path::new("red.ktx2")));
        }
    }
}
