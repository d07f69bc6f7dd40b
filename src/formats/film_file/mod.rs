//! Films on disk (`.film`): exact sums, and all the data needed to continue rendering them or to merge several.
//!
//! | bytes | |
//! |---|---|
//! | 8 | `89 52 46 49 4c 4d 0d 0a`: a transfer that treats the file as text damages these bytes, so it is detected |
//! | 4 | version of the format, 1 |
//! | 4 | length of the header |
//! | 16 | XXH3 of the version, the length and the header |
//! | | the header ([`FilmHeader`]) as JSON |
//! | | blocks of rows, from the top |
//!
//! A block has as many rows as make about 65,536 pixels, but at least one. It consists of the length of its content (4
//! bytes), the XXH3 of the block's number, that length and the content (16 bytes), and the content: byte planes
//! (`planes.rs`) of the sums (even and odd samples; red, green, blue), of the counts (even and odd), of the sums of each
//! group, and of the squares, if there are any. All numbers are little-endian. Several films may follow each other in a file; they are read one by
//! one.

mod bounds;
mod header;
mod planes;
#[cfg(test)]
mod tests;

use std::io::{self, Read, Write};
use std::path::Path;

use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_128;

use crate::error::{LoadError, SaveError};
pub use crate::files::atomic_write::writable;
use crate::files::{self, atomic_write};
use crate::film::{Film, GroupKinds, GroupSum, Moments, PixelSum, Region};
use crate::formats::fill;
use crate::memory;
pub use header::{Begun, FilmHeader, Note, PROGRAM, RenderedView, Source};

const MAGIC: [u8; 8] = *b"\x89RFILM\r\n";
const VERSION: u32 = 1;
/// Longer headers are invalid: that of a scene with 100,000 files is shorter.
const LONGEST_HEADER: u32 = 1 << 26;
/// The approximate number of pixels per block.
const BLOCK: usize = 1 << 16;
/// The largest number of blocks that are packed or unpacked in parallel.
const MOST_AT_ONCE: usize = 16;

/// A film and its header.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFile {
    /// The header.
    pub header: FilmHeader,
    /// The sums.
    pub film: Film,
    /// The sums of squared samples, if they were requested.
    pub moments: Option<Moments>,
}

/// Writes a film. The file appears, or replaces an older one, only when it is complete.
pub fn save(
    path: &Path,
    header: &FilmHeader,
    film: &Film,
    moments: Option<&Moments>,
) -> Result<(), SaveError> {
    begin(path, header, film, moments)?.finish()
}

/// The first half of [`save`], after which the film may change: the file is complete, but has no name yet.
pub fn begin(
    path: &Path,
    header: &FilmHeader,
    film: &Film,
    moments: Option<&Moments>,
) -> Result<atomic_write::UnnamedFile, SaveError> {
    atomic_write::begin(path, |mut writer| write(&mut writer, header, film, moments))
}

/// The most memory that writing or reading takes besides the film, in bytes.
pub fn packed_bytes(region: Region, variance: bool, groups: GroupKinds) -> u64 {
    let block = u64::from(rows(region)) * u64::from(region.width()) * bytes_a_pixel(variance, groups) as u64;
    block * at_once().min(blocks(region)) as u64
}

/// The number of blocks processed in parallel, one per thread.
fn at_once() -> usize {
    rayon::current_num_threads().min(MOST_AT_ONCE)
}

/// Bytes per pixel, with or without squares, and with these groups.
fn bytes_a_pixel(variance: bool, groups: GroupKinds) -> usize {
    let squares = if variance { size_of::<[u128; 3]>() } else { 0 };
    size_of::<PixelSum>() + squares + groups.count() * size_of::<GroupSum>()
}

/// True if a path has the extension of films.
pub fn is_film(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("film"))
}

/// Writes a film to a byte stream. The header must describe its contents: see [`FilmHeader::set_film`].
pub fn write(
    to: &mut dyn Write,
    header: &FilmHeader,
    film: &Film,
    moments: Option<&Moments>,
) -> io::Result<()> {
    let header = serde_json::to_vec(header)?;
    let length = u32::try_from(header.len()).ok().filter(|length| *length <= LONGEST_HEADER);
    let length = length.ok_or_else(|| io::Error::other("the scene has too many files"))?;
    to.write_all(&MAGIC)?;
    to.write_all(&VERSION.to_le_bytes())?;
    to.write_all(&length.to_le_bytes())?;
    to.write_all(&header_sum(&header).to_le_bytes())?;
    to.write_all(&header)?;
    let numbers: Vec<usize> = (0..blocks(film.region())).collect();
    for some in numbers.chunks(at_once()) {
        let packed: Vec<Vec<u8>> = some.par_iter().map(|number| pack(film, moments, *number)).collect();
        for (number, content) in some.iter().zip(packed) {
            to.write_all(&(content.len() as u32).to_le_bytes())?;
            to.write_all(&block_sum(*number, &content).to_le_bytes())?;
            to.write_all(&content)?;
        }
    }
    to.flush()
}

/// Reads the film at `path`; the file must end where the film does.
pub fn load(path: &Path) -> Result<FilmFile, LoadError> {
    let (file, _) = files::open(path).map_err(LoadError::io(path))?;
    let mut reader = io::BufReader::new(file);
    let film = read(&mut reader, path)?.ok_or_else(|| LoadError::invalid(path, "this is an empty file"))?;
    match reader.read(&mut [0]).map_err(LoadError::io(path))? {
        0 => Ok(film),
        _ => Err(LoadError::invalid(path, "there is more behind the film's end: it is damaged")),
    }
}

/// Reads only the header of the film at `path`.
pub fn load_header(path: &Path) -> Result<FilmHeader, LoadError> {
    let (file, _) = files::open(path).map_err(LoadError::io(path))?;
    let header = read_header(&mut io::BufReader::new(file), path)?;
    header.ok_or_else(|| LoadError::invalid(path, "this is an empty file"))
}

/// Reads the next film from a stream that may contain several; none at its end. Messages call the stream `path`.
pub fn read(from: &mut dyn Read, path: &Path) -> Result<Option<FilmFile>, LoadError> {
    let Some(header) = read_header(from, path)? else { return Ok(None) };
    let region = header.region;
    let count = blocks(region);
    let what = format_args!("the film of {}x{} pixels", region.width(), region.height());
    let groups = header.groups();
    let bytes = region.area() as u64 * bytes_a_pixel(header.variance, groups) as u64;
    let bytes = bytes + packed_bytes(region, header.variance, groups);
    let _claim = memory::reserve(what, bytes).map_err(LoadError::shortage(path))?;
    let mut pixels: Vec<PixelSum> = Vec::new();
    let mut squares: Vec<[u128; 3]> = Vec::new();
    let mut of_groups: Vec<GroupSum> = Vec::new();
    let mut number = 0;
    while number < count {
        let some = number..(number + at_once()).min(count);
        let contents = some.clone().map(|number| read_block(from, &header, number, path));
        let contents = contents.collect::<Result<Vec<_>, _>>()?;
        let unpacked = some.clone().into_par_iter().zip(contents);
        let unpacked: Vec<_> = unpacked.map(|(number, content)| unpack(&header, number, &content)).collect();
        for (number, block) in some.clone().zip(unpacked) {
            let block = block.ok_or_else(|| damaged(&header, number, path))?;
            pixels.extend(block.pixels);
            squares.extend(block.squares);
            of_groups.extend(block.groups);
        }
        number = some.end;
    }
    let moments = if header.variance { Moments::with_squares(region, squares) } else { None };
    let film = Film::with_pixels(region, header.unit, pixels);
    let film = film.and_then(|film| film.with_group_sums(groups, of_groups));
    let same = |film: &Film| {
        format!("{:032x}", film.hash()) == header.film_hash
            && moments.as_ref().map(|moments| format!("{:032x}", moments.hash())) == header.moments_hash
            && moments.is_some() == header.variance
    };
    match film.filter(same) {
        Some(film) => Ok(Some(FilmFile { header, film, moments })),
        None => Err(LoadError::invalid(path, "checksum mismatch: the file is damaged")),
    }
}

fn read_header(from: &mut dyn Read, path: &Path) -> Result<Option<FilmHeader>, LoadError> {
    let mut magic = [0; 8];
    let found = fill(from, &mut magic).map_err(LoadError::io(path))?;
    if found == 0 {
        return Ok(None);
    }
    let wrong = |reason: String| LoadError::invalid(path, reason);
    if magic != MAGIC {
        return Err(wrong("this is not a film that rayfront has written".into()));
    }
    let [version, length] = [number(from, path)?, number(from, path)?];
    if version != VERSION {
        let reason =
            format!("this is a film of format {version}, and this version of rayfront reads {VERSION}");
        return Err(wrong(format!("{reason}: use the version that has written it")));
    }
    let mut sum = [0; 16];
    exactly(from, &mut sum, path)?;
    let damaged = || wrong("its header is damaged: render it again, or use another copy".into());
    if length > LONGEST_HEADER {
        return Err(damaged());
    }
    let mut header = Vec::new();
    from.take(u64::from(length)).read_to_end(&mut header).map_err(LoadError::io(path))?;
    if header.len() < length as usize {
        return Err(cut_off(path));
    }
    if header_sum(&header) != u128::from_le_bytes(sum) {
        return Err(damaged());
    }
    FilmHeader::parse(&header).map(Some).map_err(|reason| wrong(format!("its header {reason}")))
}

fn header_sum(header: &[u8]) -> u128 {
    let mut hasher = xxhash_rust::xxh3::Xxh3::new();
    hasher.update(&VERSION.to_le_bytes());
    hasher.update(&(header.len() as u32).to_le_bytes());
    hasher.update(header);
    hasher.digest128()
}

fn block_sum(number: usize, content: &[u8]) -> u128 {
    let start = [(number as u32).to_le_bytes(), (content.len() as u32).to_le_bytes()].concat();
    xxh3_128(&[&start[..], &xxh3_128(content).to_le_bytes()].concat())
}

/// The number of rows per block.
fn rows(region: Region) -> u32 {
    (BLOCK as u32 / region.width().max(1)).clamp(1, region.height().max(1))
}

fn blocks(region: Region) -> usize {
    region.height().div_ceil(rows(region)) as usize
}

/// The range of a block's pixels.
fn pixels_of(region: Region, block: usize) -> std::ops::Range<usize> {
    let size = rows(region) as usize * region.width() as usize;
    let start = (block * size).min(region.area());
    start..(start + size).min(region.area())
}

fn pack(film: &Film, moments: Option<&Moments>, block: usize) -> Vec<u8> {
    let range = pixels_of(film.region(), block);
    let pixels = &film.pixels()[range.clone()];
    let mut out = Vec::new();
    for parity in 0..2 {
        for channel in 0..3 {
            planes::encode::<i64, 8>(pixels.iter().map(|p| p.sum[parity][channel]), &mut out);
        }
    }
    for parity in 0..2 {
        planes::encode::<u32, 4>(pixels.iter().map(|p| p.count[parity]), &mut out);
    }
    let groups = film.group_kinds().count();
    let sums = &film.group_sums()[range.start * groups..range.end * groups];
    for group in 0..groups {
        for (parity, channel) in
            [0, 1].into_iter().flat_map(|parity| [0, 1, 2].map(|channel| (parity, channel)))
        {
            let own = sums.iter().skip(group).step_by(groups);
            planes::encode::<i64, 8>(own.map(|sum| sum[parity][channel]), &mut out);
        }
    }
    for squares in moments.iter().map(|moments| &moments.squares()[range.clone()]) {
        (0..3).for_each(|channel| planes::encode::<u128, 16>(squares.iter().map(|s| s[channel]), &mut out));
    }
    out
}

struct Block {
    pixels: Vec<PixelSum>,
    groups: Vec<GroupSum>,
    squares: Vec<[u128; 3]>,
}

fn unpack(header: &FilmHeader, block: usize, content: &[u8]) -> Option<Block> {
    let count = pixels_of(header.region, block).len();
    let mut rest = content;
    let mut pixels = vec![PixelSum::default(); count];
    for parity in 0..2 {
        for channel in 0..3 {
            let sums = planes::decode::<i64, 8>(&mut rest, count)?;
            pixels.iter_mut().zip(sums).for_each(|(pixel, sum)| pixel.sum[parity][channel] = sum);
        }
    }
    for parity in 0..2 {
        let counts = planes::decode::<u32, 4>(&mut rest, count)?;
        pixels.iter_mut().zip(counts).for_each(|(pixel, count)| pixel.count[parity] = count);
    }
    let groups = header.groups().count();
    let mut of_groups = vec![GroupSum::default(); count * groups];
    for group in 0..groups {
        for (parity, channel) in
            [0, 1].into_iter().flat_map(|parity| [0, 1, 2].map(|channel| (parity, channel)))
        {
            let sums = planes::decode::<i64, 8>(&mut rest, count)?;
            let own = of_groups.iter_mut().skip(group).step_by(groups);
            own.zip(sums).for_each(|(to, sum)| to[parity][channel] = sum);
        }
    }
    let mut squares = Vec::new();
    if header.variance {
        squares.resize(count, [0; 3]);
        for channel in 0..3 {
            let sums = planes::decode::<u128, 16>(&mut rest, count)?;
            squares.iter_mut().zip(sums).for_each(|(squares, sum)| squares[channel] = sum);
        }
    }
    rest.is_empty().then_some(Block { pixels, groups: of_groups, squares })
}

fn read_block(
    from: &mut dyn Read,
    header: &FilmHeader,
    block: usize,
    path: &Path,
) -> Result<Vec<u8>, LoadError> {
    let length = number(from, path)?;
    let mut sum = [0; 16];
    exactly(from, &mut sum, path)?;
    // A plane takes at most its bytes and five more.
    let pixel = bytes_a_pixel(header.variance, header.groups());
    if length as usize > pixels_of(header.region, block).len() * pixel + 5 * pixel {
        return Err(damaged(header, block, path));
    }
    let mut content = Vec::new();
    from.take(u64::from(length)).read_to_end(&mut content).map_err(LoadError::io(path))?;
    match content.len() {
        found if found < length as usize => Err(cut_off(path)),
        _ if block_sum(block, &content) != u128::from_le_bytes(sum) => Err(damaged(header, block, path)),
        _ => Ok(content),
    }
}

fn damaged(header: &FilmHeader, block: usize, path: &Path) -> LoadError {
    let first = header.region.y0 + block as u32 * rows(header.region);
    let last = (first + rows(header.region)).min(header.region.y1);
    let reason = format!("rows {first} to {last} are damaged: render it again, or use another copy");
    LoadError::invalid(path, reason)
}

fn cut_off(path: &Path) -> LoadError {
    LoadError::invalid(path, "the film is cut off: render it again, or use another copy")
}

/// Reads a little-endian number of four bytes.
fn number(from: &mut dyn Read, path: &Path) -> Result<u32, LoadError> {
    let mut bytes = [0; 4];
    exactly(from, &mut bytes, path)?;
    Ok(u32::from_le_bytes(bytes))
}

fn exactly(from: &mut dyn Read, bytes: &mut [u8], path: &Path) -> Result<(), LoadError> {
    match fill(from, bytes).map_err(LoadError::io(path))? {
        found if found == bytes.len() => Ok(()),
        _ => Err(cut_off(path)),
    }
}
