//! The first hits of a pixel's samples, averaged: depth, normals and so on.

use crate::math::Rgb;

/// The first hit of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// The distance from the camera along its axis, in metres.
    pub depth_m: f32,
    /// The shading normal of unit length, on the viewer's side.
    pub normal: [f32; 3],
    /// The base colour.
    pub albedo: Rgb,
    /// The position in world space, in metres.
    pub position: [f32; 3],
    /// The entity's number in the world.
    pub entity: u32,
    /// The number of the material's record in the scene.
    pub material: u32,
}

/// The first hits of all of a pixel's samples. Means are over the samples that hit anything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Features {
    /// The fraction of samples that hit anything.
    pub coverage: f32,
    /// The mean distance along the camera's axis, in metres; infinite if nothing was hit.
    pub depth_m: f32,
    /// The mean of unit normals, hence shorter where they differ.
    pub normal: [f32; 3],
    /// The mean base colour.
    pub albedo: Rgb,
    /// The mean position in world space, in metres.
    pub position: [f32; 3],
    /// The most frequent entity: 0 for none, else one more than the entity's number. Ties go to the smallest number.
    pub entity: u32,
    /// The most frequent material: 0 for none, else one more than the number of its record. Ties go to the smallest
    /// number.
    pub material: u32,
}

impl Features {
    /// The features of a pixel whose samples hit nothing.
    pub const NOTHING: Features = Features {
        coverage: 0.0,
        depth_m: f32::INFINITY,
        normal: [0.0; 3],
        albedo: Rgb::BLACK,
        position: [0.0; 3],
        entity: 0,
        material: 0,
    };
}

/// A 128-bit hash (XXH3): equal bits have equal hashes.
pub fn hash(features: &[Features]) -> u128 {
    let mut hasher = xxhash_rust::xxh3::Xxh3::new();
    for Features { coverage, depth_m, normal, albedo, position, entity, material } in features {
        let numbers = [&[*coverage, *depth_m], &normal[..], &albedo.to_array(), position];
        for number in numbers.into_iter().flatten() {
            hasher.update(&number.to_le_bytes());
        }
        hasher.update(&entity.to_le_bytes());
        hasher.update(&material.to_le_bytes());
    }
    hasher.digest128()
}

/// An accumulator for the first hits of a pixel's samples, which must be added in their order.
#[derive(Debug, Default)]
pub struct Gathering {
    hits: u32,
    /// Depth, normal, albedo, position.
    sums: [f64; 10],
    entities: Vec<u32>,
    materials: Vec<u32>,
}

impl Gathering {
    /// Adds the next sample.
    pub fn add(&mut self, hit: Option<&FirstHit>) {
        self.entities.push(hit.map_or(0, |hit| hit.entity + 1));
        self.materials.push(hit.map_or(0, |hit| hit.material + 1));
        let Some(hit) = hit else { return };
        self.hits += 1;
        let ([nx, ny, nz], [x, y, z], Rgb { r, g, b }) = (hit.normal, hit.position, hit.albedo);
        for (sum, value) in self.sums.iter_mut().zip([hit.depth_m, nx, ny, nz, r, g, b, x, y, z]) {
            *sum += f64::from(value);
        }
    }

    /// Returns the features of the samples so far, and begins a new pixel.
    pub fn take(&mut self) -> Features {
        let (hits, samples) = (f64::from(self.hits), self.entities.len());
        let [depth_m, nx, ny, nz, r, g, b, x, y, z] = self.sums.map(|sum| (sum / hits) as f32);
        let (entity, material) = (most_frequent(&mut self.entities), most_frequent(&mut self.materials));
        self.entities.clear();
        self.materials.clear();
        (self.hits, self.sums) = (0, [0.0; 10]);
        if hits == 0.0 {
            return Features::NOTHING;
        }
        Features {
            coverage: (hits / samples as f64) as f32,
            depth_m,
            normal: [nx, ny, nz],
            albedo: Rgb::new(r, g, b),
            position: [x, y, z],
            entity,
            material,
        }
    }
}

/// Returns the most frequent number; ties go to the smallest. 0 if there is none.
fn most_frequent(numbers: &mut [u32]) -> u32 {
    numbers.sort_unstable();
    let mut best: &[u32] = &[0; 0];
    for run in numbers.chunk_by(|a, b| a == b) {
        if run.len() > best.len() {
            best = run;
        }
    }
    best.first().copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit(depth_m: f32, entity: u32) -> FirstHit {
        let (normal, position) = ([0.0, depth_m - 2.0, 1.0], [depth_m, 0.0, -1.0]);
        FirstHit { depth_m, normal, albedo: Rgb::splat(0.5 * depth_m), position, entity, material: 7 }
    }

    #[test]
    fn features_are_means_over_hits_and_most_frequent_ids() {
        let mut pixel = Gathering::default();
        for sample in [Some(hit(1.0, 4)), None, Some(hit(3.0, 2)), Some(hit(2.0, 4))] {
            pixel.add(sample.as_ref());
        }
        let found = pixel.take();
        assert_eq!((found.coverage, found.depth_m, found.normal), (0.75, 2.0, [0.0, 0.0, 1.0]));
        assert_eq!((found.albedo, found.position), (Rgb::WHITE, [2.0, 0.0, -1.0]));
        assert_eq!((found.entity, found.material), (5, 8));
        assert_eq!(pixel.take(), Features::NOTHING);
    }

    #[test]
    fn ties_of_ids_go_to_the_smaller_number() {
        for order in [[3, 1, 1, 3], [1, 3, 3, 1]] {
            let mut pixel = Gathering::default();
            order.into_iter().for_each(|entity| pixel.add(Some(&hit(1.0, entity))));
            assert_eq!(pixel.take().entity, 2);
        }
        let mut pixel = Gathering::default();
        pixel.add(Some(&hit(1.0, 0)));
        pixel.add(None);
        assert_eq!(pixel.take().entity, 0, "as much nothing as something");
    }
}
