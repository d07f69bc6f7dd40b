//! Raw files of rays and hits, which ray tracers exchange to compare results and speed.
//!
//! Little-endian, without a header. A ray is eight 32-bit floats: origin x y z, direction x y z, t_min, t_max. A hit is
//! three 32-bit floats t u v and the primitive as a 32-bit integer; a miss is infinity, 0, 0 and 2³² − 1.

use std::io::Write;
use std::path::Path;

use xxhash_rust::xxh3::Xxh3;

use crate::bvh::Rays;
use crate::error::{LoadError, SaveError};
use crate::files::atomic_write::write_whole;
use crate::formats::fill;
use crate::math::{Hit, NONE, Vec3};
use crate::query::RayBatch;

/// Bytes of a ray in a file.
pub const RAY_BYTES: usize = 32;
/// Bytes of a hit in a file.
pub const HIT_BYTES: usize = 16;

/// The number of records that are read at a time.
const BLOCK: usize = 1 << 14;

/// A hit in the layout of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HitRecord {
    /// The ray parameter; infinity for a miss.
    pub t: f32,
    /// Barycentric weight of a triangle's second corner.
    pub u: f32,
    /// Barycentric weight of its third corner.
    pub v: f32,
    /// The primitive's number; [`NONE`] for a miss.
    pub primitive: u32,
}

impl HitRecord {
    /// The record of a ray that hits nothing.
    pub const MISS: HitRecord = HitRecord { t: f32::INFINITY, u: 0.0, v: 0.0, primitive: NONE };
    /// The record of an any-hit query's hit: the primitive's id is not needed.
    pub const BLOCKED: HitRecord = HitRecord { t: 0.0, u: 0.0, v: 0.0, primitive: 0 };

    /// Returns the record of a nearest-hit query's hit.
    pub fn new(hit: &Hit) -> HitRecord {
        HitRecord { t: hit.t, u: hit.u, v: hit.v, primitive: hit.primitive }
    }

    /// Returns the record of an any-hit query's result.
    pub fn any(is_blocked: bool) -> HitRecord {
        if is_blocked { HitRecord::BLOCKED } else { HitRecord::MISS }
    }

    /// The words of the record in a file.
    fn words(self) -> [u32; HIT_BYTES / 4] {
        [self.t.to_bits(), self.u.to_bits(), self.v.to_bits(), self.primitive]
    }

    /// True if nothing was hit.
    pub fn is_miss(&self) -> bool {
        self.primitive == NONE
    }
}

/// Reads a file of rays. A file with more than `most` rays is refused before it is in memory.
pub fn load_rays(path: &Path, most: u64) -> Result<RayBatch, LoadError> {
    let mut rays = RayBatch::default();
    let reserve = |rays: &mut RayBatch, count| *rays = RayBatch::with_capacity(count);
    read_records(path, "ray", most, &mut rays, reserve, |rays, record: [u8; RAY_BYTES]| {
        let number = |i: usize| float(&record, i);
        let vector = |i: usize| Vec3::new(number(i), number(i + 1), number(i + 2));
        rays.push(vector(0), vector(3), number(6), number(7));
    })?;
    Ok(rays)
}

/// Reads a file of hits. A file with more than `most` hits is refused before it is in memory.
pub fn load_hits(path: &Path, most: u64) -> Result<Vec<HitRecord>, LoadError> {
    let mut hits = Vec::new();
    let reserve = |hits: &mut Vec<HitRecord>, count| hits.reserve_exact(count);
    read_records(path, "hit", most, &mut hits, reserve, |hits, record: [u8; HIT_BYTES]| {
        let [.., a, b, c, d] = record;
        let primitive = u32::from_le_bytes([a, b, c, d]);
        hits.push(HitRecord { t: float(&record, 0), u: float(&record, 1), v: float(&record, 2), primitive });
    })?;
    Ok(hits)
}

fn float(record: &[u8], index: usize) -> f32 {
    let at = 4 * index;
    f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
}

/// Passes the records of a file, `SIZE` bytes each, to `add` one by one.
fn read_records<T, const SIZE: usize>(
    path: &Path,
    what: &str,
    most: u64,
    out: &mut T,
    reserve: impl Fn(&mut T, usize),
    add: impl Fn(&mut T, [u8; SIZE]),
) -> Result<(), LoadError> {
    let (mut file, length) = crate::files::open(path).map_err(LoadError::io(path))?;
    let too_many = |count: u64| {
        let reason = format!("has {count} {what}s or more, and there is memory for {most}: split the file");
        LoadError::too_large(path, reason)
    };
    if length / SIZE as u64 > most {
        return Err(too_many(length / SIZE as u64));
    }
    reserve(out, (length / SIZE as u64) as usize);
    let mut block = vec![0; BLOCK * SIZE];
    let mut count = 0u64;
    loop {
        let filled = fill(&mut file, &mut block).map_err(LoadError::io(path))?;
        let (records, rest) = block[..filled].as_chunks::<SIZE>();
        count += records.len() as u64;
        if count > most {
            return Err(too_many(count));
        }
        records.iter().for_each(|record| add(out, *record));
        if !rest.is_empty() {
            let (at, left) = (count * SIZE as u64, rest.len());
            return Err(LoadError::invalid(
                path,
                format!("{what} {count}, at byte {at}, is cut off: it has {left} of {SIZE} bytes"),
            ));
        }
        if filled < block.len() {
            return Ok(());
        }
    }
}

/// Writes a file of rays.
pub fn save_rays(path: &Path, rays: &RayBatch) -> Result<(), SaveError> {
    let Rays { origin: [x, y, z], direction: [dx, dy, dz], t_min, t_max, .. } = rays.rays();
    let columns = [x, y, z, dx, dy, dz, t_min, t_max];
    save_records(path, (0..rays.len()).map(|i| columns.map(|column| column[i].to_bits())))
}

/// Writes a file of hits.
pub fn save_hits(path: &Path, hits: impl Iterator<Item = HitRecord>) -> Result<(), SaveError> {
    save_records(path, hits.map(HitRecord::words))
}

/// The number of hits, and a hash of their records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HitSummary {
    /// The number of records that are no misses.
    pub hits: usize,
    /// XXH3 of the bytes of all records.
    pub hash: u64,
}

impl HitSummary {
    /// Summarizes the hits of some rays.
    pub fn of(records: impl Iterator<Item = HitRecord>) -> HitSummary {
        let (mut hits, mut hasher) = (0, Xxh3::new());
        for record in records {
            hits += usize::from(!record.is_miss());
            record.words().into_iter().for_each(|word| hasher.update(&word.to_le_bytes()));
        }
        HitSummary { hits, hash: hasher.digest() }
    }

    /// The hash in hexadecimal digits.
    pub fn digits(&self) -> String {
        format!("{:016x}", self.hash)
    }
}

fn save_records<const N: usize>(
    path: &Path,
    records: impl Iterator<Item = [u32; N]>,
) -> Result<(), SaveError> {
    write_whole(path, |mut file| {
        for word in records.flatten() {
            file.write_all(&word.to_le_bytes())?;
        }
        file.flush()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> std::path::PathBuf {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("a file");
        path
    }

    #[test]
    fn rays_are_read_as_they_lie_in_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        // More than one block, and not a multiple of it.
        let count = BLOCK + 3;
        let numbers: Vec<f32> = (0..count * 8).map(|i| i as f32).collect();
        let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
        let path = write(&folder, "rays.f32", &bytes);
        let rays = load_rays(&path, count as u64).expect("rays");
        assert_eq!(rays.len(), count);
        let columns = rays.rays();
        for i in [0, 1, BLOCK - 1, BLOCK, count - 1] {
            let [x, y, z] = columns.origin.map(|column| column[i]);
            let [dx, dy, dz] = columns.direction.map(|column| column[i]);
            let ray = [x, y, z, dx, dy, dz, columns.t_min[i], columns.t_max[i]];
            assert_eq!(ray, numbers[8 * i..][..8]);
        }
        let error = load_rays(&path, count as u64 - 1).expect_err("too many").to_string();
        assert!(error.contains(&format!("{count} rays")) && error.contains("split the file"), "{error}");
        let saved = folder.path().join("saved.f32");
        save_rays(&saved, &rays).expect("written");
        assert_eq!(std::fs::read(saved).expect("a file"), bytes);
        let path = write(&folder, "cut.f32", &bytes[..bytes.len() - 1]);
        let error = load_rays(&path, u64::MAX).expect_err("cut off").to_string();
        let at = (count - 1) * RAY_BYTES;
        assert!(
            error.ends_with(&format!("ray {}, at byte {at}, is cut off: it has 31 of 32 bytes", count - 1))
        );
        assert!(load_rays(&write(&folder, "empty.f32", &[]), 0).expect("no rays").is_empty());
    }

    #[test]
    fn hits_round_trip_through_a_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("hits.bin");
        let hit = |i: u32| HitRecord { t: i as f32 * 0.1, u: 0.25, v: f32::MIN_POSITIVE, primitive: i * 7 };
        let hits: Vec<HitRecord> =
            (0..BLOCK as u32 * 2 + 5).map(hit).chain([HitRecord::MISS, HitRecord::BLOCKED]).collect();
        save_hits(&path, hits.iter().copied()).expect("written");
        assert_eq!(load_hits(&path, u64::MAX).expect("hits"), hits);
        let bytes = std::fs::read(&path).expect("a file");
        let summary = HitSummary { hits: hits.len() - 1, hash: xxhash_rust::xxh3::xxh3_64(&bytes) };
        assert_eq!(HitSummary::of(hits.iter().copied()), summary);
        assert_eq!(bytes.len(), hits.len() * HIT_BYTES);
        let miss = [0, 0, 0x80, 0x7f, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff];
        assert_eq!(bytes[bytes.len() - 32..][..16], miss);
    }
}
