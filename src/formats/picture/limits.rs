//! Size limits of images, checked on their headers before pixels are allocated.

use std::path::Path;

use crate::error::LoadError;
use crate::memory::{self, Reservation};

/// The largest number of pixels along a side.
pub const LARGEST_SIDE: u64 = 65_536;
/// The largest number of bytes of a decoded image.
pub const LARGEST_SIZE: u64 = 2 << 30;
/// The largest number of decoded bytes per byte of the file. Deflate packs up to 1,032 bytes into one, each of which
/// may be eight pixels of one bit that become four bytes each: 33,024; the rest is a margin for the other formats.
const LARGEST_EXPANSION: u64 = 1 << 16;
/// The number of decoded bytes allowed for any file, however short.
const ALWAYS_ALLOWED: u64 = 16 << 20;
/// Like [`LARGEST_EXPANSION`], for images larger than [`LARGE`]: real images of that size are not so uniform.
const LARGEST_EXPANSION_OF_LARGE: u64 = 1 << 12;
/// The decoded size in bytes above which an image counts as large.
const LARGE: u64 = 256 << 20;

/// Checks the size of an image of `width` times `height` pixels of `pixel_bytes` each. Errors: it is too large, larger
/// than a file of `file_bytes` can plausibly contain, or larger than memory allows. The reservation lasts while the
/// image is decoded.
pub(in crate::formats) fn check(
    path: &Path,
    [width, height]: [u64; 2],
    pixel_bytes: u64,
    file_bytes: usize,
) -> Result<Reservation<'static>, LoadError> {
    let refuse = |reason: String| Err(LoadError::invalid(path, reason));
    let too_large = |reason: String| Err(LoadError::too_large(path, reason));
    if width == 0 || height == 0 {
        return refuse(format!("the picture has no pixels ({width} x {height})"));
    }
    if width > LARGEST_SIDE || height > LARGEST_SIDE {
        return too_large(format!(
            "the picture is {width} x {height} pixels: at most {LARGEST_SIDE} along a side can be read"
        ));
    }
    let size = width * height * pixel_bytes;
    if size > LARGEST_SIZE {
        return too_large(format!(
            "the picture is {width} x {height} pixels, {size} bytes when decoded: at most {LARGEST_SIZE} can be read"
        ));
    }
    let expansion = if size > LARGE { LARGEST_EXPANSION_OF_LARGE } else { LARGEST_EXPANSION };
    if size > ALWAYS_ALLOWED && size / expansion > file_bytes as u64 {
        return refuse(format!(
            "the picture claims to be {width} x {height} pixels, which a file of {file_bytes} bytes does not hold"
        ));
    }
    // Once as the decoder holds it, and once as texels.
    let what = format_args!("the picture of {width} x {height} pixels");
    let claim = memory::reserve(what, 2 * size).map_err(|shortage| shortage.or("use a smaller one"));
    claim.map_err(LoadError::shortage(path))
}
