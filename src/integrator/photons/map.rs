//! The photon map: the photons of one sample of all pixels, in a hash grid.

use std::num::Wrapping;

use crate::math::{NONE, Vector};
use crate::sampling::hash::{combine, mix};
use crate::shading::packed_normal::{from_square, to_square};
use crate::simd::{Float, Int, Mask};

/// A photon that has ended: 32 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Photon {
    /// The position in world space.
    pub position: [f32; 3],
    /// The flux in watts.
    pub flux: [f32; 3],
    /// The direction that it came from, on an unfolded octahedron: 16 bits for each coordinate.
    direction: u32,
    /// The normal of the surface, on the side where the photon arrived: 8 bits for each coordinate; the number of
    /// bounces, at most 255; the exponent of the density.
    rest: u32,
}

impl Photon {
    /// The largest number of bounces of a photon.
    pub const MOST_BOUNCES: u32 = 255;

    /// Packs a photon. `from` is the unit vector to where it came from. `density` is a power of two: see
    /// `PhotonEmission`.
    pub fn new(
        position: Vector<f32>,
        flux: [f32; 3],
        from: Vector<f32>,
        normal: Vector<f32>,
        bounces: u32,
        density: f32,
    ) -> Self {
        let [x, y] = packed(from, 65_535.0);
        let [nx, ny] = packed(normal, 255.0);
        let exponent = density.to_bits() >> 23 & 0xff;
        Self {
            position: [position.x, position.y, position.z],
            flux,
            direction: x | y << 16,
            rest: nx | ny << 8 | bounces.min(Self::MOST_BOUNCES) << 16 | exponent << 24,
        }
    }

    /// A sort key for the ends of one photon, by its bounces first.
    pub fn order(&self) -> (u32, [u32; 6]) {
        let [x, y, z] = self.position.map(f32::to_bits);
        let [r, g, b] = self.flux.map(f32::to_bits);
        (self.rest >> 16 & 0xff, [x, y, z, r, g, b])
    }

    /// Unit vector to where it came from.
    pub fn from(&self) -> Vector<f32> {
        unpacked([self.direction & 0xffff, self.direction >> 16], 65_535.0)
    }

    /// Unit normal of the surface, to two degrees.
    pub fn normal(&self) -> Vector<f32> {
        unpacked([self.rest & 0xff, self.rest >> 8 & 0xff], 255.0)
    }

    /// The number of its bounces.
    pub fn bounces(&self) -> u32 {
        self.rest >> 16 & 0xff
    }

    /// The number of a sample's photons per unit of its emitter's phase space.
    pub fn density(&self) -> f32 {
        f32::from_bits((self.rest >> 24) << 23)
    }
}

fn packed(v: Vector<f32>, steps: f32) -> [u32; 2] {
    let (x, y) = to_square(v);
    [x, y].map(|c| ((c * 0.5 + 0.5) * steps + 0.5).clamp(0.0, steps) as u32)
}

fn unpacked(words: [u32; 2], steps: f32) -> Vector<f32> {
    let [x, y] = words.map(|c| c as f32 * (2.0 / steps) - 1.0);
    from_square(x, y)
}

/// The radii at one sample.
#[derive(Clone, Copy, Debug, Default)]
pub struct Radii {
    /// The ratio of radii to those at the first sample.
    pub shrink: f32,
    /// The largest radius, in metres, twice the usual one: larger ones would reach into too many cells.
    pub most: f32,
}

impl Radii {
    /// The radius at this sample where the first sample's is `first`.
    #[inline(always)]
    pub fn of<F: Float>(&self, first: F) -> F {
        (first * F::splat(self.shrink)).min(F::splat(self.most))
    }
}

/// A photon map: photons in the cells of an unbounded grid, by a hash of the cell.
#[derive(Default)]
pub struct PhotonMap {
    /// 1 over the width of a cell.
    per_cell: f32,
    /// The radii at its sample.
    pub radii: Radii,
    /// The number of buckets − 1.
    mask: u32,
    /// A bit for each value of a longer hash of cells, set where photons are: most cells are empty, and this is small
    /// enough for the first-level cache.
    filled: Vec<u32>,
    /// The first photon of each bucket, and the end.
    starts: Vec<u32>,
    photons: Vec<Photon>,
    /// The light group of each photon, or [`NONE`]; empty if there are no groups.
    groups: Vec<u32>,
}

/// The width of a cell over the largest radius: four usual radii. Then no radius reaches into more than two cells along
/// an axis. Narrower cells hold fewer photons that are too far away, but more cells lie around a point, and most are
/// empty.
const CELL: f32 = 2.000_01;

/// A cell's column, row and layer.
type GridCell = [i32; 3];

impl PhotonMap {
    /// Builds the map from photons in their order, with their light groups, or none if there are no groups.
    pub fn new<'a>(photons: impl Iterator<Item = &'a Photon> + Clone, groups: &[u32], radii: Radii) -> Self {
        let cell = (radii.most * CELL).max(f32::MIN_POSITIVE);
        let count = photons.clone().count();
        let mask = (count as u32).next_power_of_two().max(2) - 1;
        let mut map = Self { per_cell: 1.0 / cell, radii, mask, ..Self::default() };
        map.filled = vec![0; ((mask as usize + 1) * BITS).div_ceil(32)];
        for photon in photons.clone() {
            let bit = map.hash(map.cell(photon.position)) & map.last_bit();
            map.filled[bit as usize / 32] |= 1 << (bit % 32);
        }
        // Counting sort: photons of a bucket keep their order.
        let mut starts = vec![0u32; mask as usize + 2];
        for photon in photons.clone() {
            starts[map.bucket(map.cell(photon.position)) as usize + 1] += 1;
        }
        for at in 1..starts.len() {
            starts[at] += starts[at - 1];
        }
        let mut next = starts.clone();
        map.photons = vec![Photon::default(); count];
        map.groups = vec![NONE; groups.len()];
        for (number, photon) in photons.enumerate() {
            let at = &mut next[map.bucket(map.cell(photon.position)) as usize];
            map.photons[*at as usize] = *photon;
            if let Some(group) = groups.get(number) {
                map.groups[*at as usize] = *group;
            }
            *at += 1;
        }
        map.starts = starts;
        map
    }

    /// The number of photons.
    pub fn count(&self) -> usize {
        self.photons.len()
    }

    /// The size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.photons[..])
            + size_of_val(&self.groups[..])
            + size_of_val(&self.starts[..])
            + size_of_val(&self.filled[..])
    }

    fn cell(&self, position: [f32; 3]) -> GridCell {
        position.map(|c| self.column(c).0 as i32)
    }

    fn hash(&self, [x, y, z]: GridCell) -> u32 {
        let hash = |c: i32, prime: u32| Wrapping(c as u32) * Wrapping(prime);
        let mixed = hash(x, PRIMES[0]) ^ hash(y, PRIMES[1]) ^ hash(z, PRIMES[2]);
        (mixed >> 15).0 ^ mixed.0
    }

    /// The index of the last bit of `filled`; the number of bits is a power of two.
    fn last_bit(&self) -> u32 {
        self.filled.len() as u32 * 32 - 1
    }

    /// The lanes around whose points some cell holds photons; [`PhotonMap::around`] tests the same for one point.
    #[inline(always)]
    pub fn may_hold<F: Float>(&self, place: Vector<F>, radius: F, mask: F::Mask) -> F::Mask {
        let zero = F::Int::splat(0);
        let mut holds = F::Mask::from_bits(0);
        let x = [self.column(place.x - radius), self.column(place.x + radius)];
        let y = [self.column(place.y - radius), self.column(place.y + radius)];
        let z = [self.column(place.z - radius), self.column(place.z + radius)];
        let last = F::Int::splat(self.last_bit());
        for corner in 0..8 {
            let (x, y, z) = (x[corner & 1], y[corner >> 1 & 1], z[corner >> 2]);
            let [first, second, third] = PRIMES;
            let mixed = (x * F::Int::splat(first)) ^ (y * F::Int::splat(second)) ^ (z * F::Int::splat(third));
            let bit = (mixed.shr::<15>() ^ mixed) & last;
            let word = F::Int::gather(&self.filled, bit.shr::<5>(), mask);
            let one = F::Int::gather(&POWERS, bit & F::Int::splat(31), mask);
            holds = holds | (mask & !(word & one).eq(zero));
        }
        holds
    }

    /// The index of a cell along one axis.
    #[inline(always)]
    fn column<F: Float>(&self, place: F) -> F::Int {
        (place * F::splat(self.per_cell)).clamp(-1e9, 1e9).floor().to_int()
    }

    fn bucket(&self, cell: GridCell) -> u32 {
        self.hash(cell) & self.mask
    }

    /// The photons around a point on a surface with this normal, in an order that depends on nothing else; none if all
    /// cells around it are empty. In a cell with more than `most` photons, every s-th one stands for s of them.
    pub fn around(
        &self,
        place: Vector<f32>,
        normal: Vector<f32>,
        radius: f32,
        most: u32,
    ) -> Option<PhotonsAround<'_>> {
        let position = [place.x, place.y, place.z];
        let low = self.cell(position.map(|c| c - radius));
        let high = self.cell(position.map(|c| c + radius));
        let last = self.last_bit();
        // A cell is wider than two radii, so there are at most two along each axis.
        let (mut cells, mut count) = ([[0; 3]; 8], 0);
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let bit = self.hash([x, y, z]) & last;
                    if self.filled[bit as usize / 32] >> (bit % 32) & 1 != 0 && count < cells.len() {
                        cells[count] = [x, y, z];
                        count += 1;
                    }
                }
            }
        }
        if count == 0 {
            return None;
        }
        let [x, y, z] = position.map(|c| Wrapping(c.to_bits()));
        let number = mix(combine(combine(x, y), z)).0;
        let (cell, at, end, step) = (0, 0, 0, 1);
        Some(PhotonsAround {
            map: self,
            place,
            normal,
            radius,
            most,
            number,
            cells,
            count,
            cell,
            at,
            end,
            step,
        })
    }
}

/// Hash factors that spread cells over buckets.
const PRIMES: [u32; 3] = [0x9e37_79b1, 0x85eb_ca77, 0xc2b2_ae3d];
/// The powers of two from 2⁰ to 2³¹.
const POWERS: [u32; 32] = {
    let mut powers = [1; 32];
    let mut i = 1;
    while i < 32 {
        powers[i] = powers[i - 1] << 1;
        i += 1;
    }
    powers
};
/// The number of bits of `filled` for each bucket.
const BITS: usize = 2;

/// An iterator over the photons around a point.
pub struct PhotonsAround<'a> {
    map: &'a PhotonMap,
    place: Vector<f32>,
    normal: Vector<f32>,
    radius: f32,
    /// The largest number of photons of a cell that are visited.
    most: u32,
    /// A random number of the point, which determines the first photon of each cell.
    number: u32,
    cells: [GridCell; 8],
    count: usize,
    /// The next cell.
    cell: usize,
    /// The next photon of the present cell, and the cell's end.
    at: u32,
    end: u32,
    /// The number of photons that each one stands for.
    step: u32,
}

/// The least cosine between normals of the same surface.
const ALIKE: f32 = 0.8;
/// The largest distance of a surface's photons from the tangent plane, in radii.
const FLAT: f32 = 0.3;

impl<'a> PhotonsAround<'a> {
    /// Returns the next photon of a light group, or of any, with at most `most` bounces, and the kernel there.
    pub fn next_within(&mut self, most: u32, group: Option<u32>) -> Option<(&'a Photon, f32)> {
        loop {
            let found = self.next()?;
            // `next` has gone on by a step.
            let own = self.map.groups.get((self.at - self.step) as usize).copied();
            if found.0.bounces() <= most && group.is_none_or(|group| own == Some(group)) {
                return Some(found);
            }
        }
    }
}

impl<'a> Iterator for PhotonsAround<'a> {
    /// A photon, and the Epanechnikov kernel there times the number of photons that it stands for.
    type Item = (&'a Photon, f32);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            while self.at < self.end {
                let photon = &self.map.photons[self.at as usize];
                self.at += self.step;
                let [x, y, z] = photon.position;
                let way = Vector::new(x, y, z) - self.place;
                let part = way.dot(way) / (self.radius * self.radius);
                if part < 1.0
                    && way.dot(self.normal).abs() < FLAT * self.radius
                    // On either side: light may be transmitted.
                    && photon.normal().dot(self.normal).abs() > ALIKE
                    // Cells of the same hash share a bucket.
                    && self.map.cell(photon.position) == self.cells[self.cell - 1]
                {
                    return Some((photon, 2.0 * (1.0 - part) * self.step as f32));
                }
            }
            if self.cell == self.count {
                return None;
            }
            let bucket = self.map.bucket(self.cells[self.cell]) as usize;
            let (first, end) = (self.map.starts[bucket], self.map.starts[bucket + 1]);
            self.step = (end - first).div_ceil(self.most).max(1);
            self.at = first + self.number.rotate_right(4 * self.cell as u32) % self.step;
            self.end = end;
            self.cell += 1;
        }
    }
}
