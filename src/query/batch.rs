//! Columns of rays and hits that own their memory.

use crate::bvh::{HitsMut, Rays};
use crate::math::{Hit, NONE, Vec3};

/// Rays in columns, all of the same length.
#[derive(Clone, Debug, Default)]
pub struct RayBatch {
    origin: [Vec<f32>; 3],
    direction: [Vec<f32>; 3],
    t_min: Vec<f32>,
    t_max: Vec<f32>,
}

impl RayBatch {
    /// Creates an empty batch with room for `count` rays.
    pub fn with_capacity(count: usize) -> Self {
        let column = || Vec::with_capacity(count);
        let columns = || [column(), column(), column()];
        Self { origin: columns(), direction: columns(), t_min: column(), t_max: column() }
    }

    /// Adds the ray `origin + t · direction` with `t_min` < t ≤ `t_max`.
    pub fn push(&mut self, origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) {
        for axis in 0..3 {
            self.origin[axis].push(origin[axis]);
            self.direction[axis].push(direction[axis]);
        }
        self.t_min.push(t_min);
        self.t_max.push(t_max);
    }

    /// Moves all rays so that `origin`, a point of theirs, lies at (0, 0, 0).
    #[cfg(feature = "cli")]
    pub(crate) fn relative_to(&mut self, origin: crate::math::DVec3) {
        for axis in 0..3 {
            let moved = |value: &mut f32| *value = (f64::from(*value) - origin[axis]) as f32;
            self.origin[axis].iter_mut().for_each(moved);
        }
    }

    /// The number of rays.
    pub fn len(&self) -> usize {
        self.t_max.len()
    }

    /// True if there are no rays.
    pub fn is_empty(&self) -> bool {
        self.t_max.is_empty()
    }

    /// Removes all rays but keeps the memory.
    pub fn clear(&mut self) {
        self.origin.iter_mut().chain(&mut self.direction).for_each(Vec::clear);
        self.t_min.clear();
        self.t_max.clear();
    }

    /// A view of all rays.
    pub fn rays(&self) -> Rays<'_> {
        let [origin, direction] =
            [&self.origin, &self.direction].map(|columns| columns.each_ref().map(|column| &column[..]));
        Rays::new(origin, direction, &self.t_min, &self.t_max)
    }

    /// Views of all rays in order, `size` at a time; the last one may be shorter. A `size` of 0 counts as 1.
    pub fn chunks(&self, size: usize) -> impl Iterator<Item = Rays<'_>> {
        self.rays().chunks(size)
    }
}

/// Hits in columns, all of the same length.
#[derive(Clone, Debug, Default)]
pub struct HitBatch {
    t: Vec<f32>,
    u: Vec<f32>,
    v: Vec<f32>,
    primitive: Vec<u32>,
    instance: Vec<u32>,
}

impl HitBatch {
    /// Creates a batch of `count` misses.
    pub fn new(count: usize) -> Self {
        let mut batch = Self::default();
        batch.resize(count);
        batch
    }

    /// Resizes the batch to `count` hits; new ones are misses.
    pub fn resize(&mut self, count: usize) {
        self.t.resize(count, f32::INFINITY);
        self.u.resize(count, 0.0);
        self.v.resize(count, 0.0);
        self.primitive.resize(count, NONE);
        self.instance.resize(count, NONE);
    }

    /// The number of hits, misses included.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// True if there are no hits.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Returns the hit at an index; `None` beyond the end.
    pub fn get(&self, index: usize) -> Option<Hit> {
        (index < self.len()).then(|| self.at(index))
    }

    fn at(&self, i: usize) -> Hit {
        let (primitive, instance) = (self.primitive[i], self.instance[i]);
        Hit { t: self.t[i], u: self.u[i], v: self.v[i], primitive, instance }
    }

    /// All hits in order, misses included.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Hit> + '_ {
        (0..self.len()).map(|i| self.at(i))
    }

    /// A view of all hits for a query to write to.
    pub fn hits_mut(&mut self) -> HitsMut<'_> {
        HitsMut {
            t: &mut self.t,
            u: &mut self.u,
            v: &mut self.v,
            primitive: &mut self.primitive,
            instance: &mut self.instance,
        }
    }

    /// Views of all hits in order, `size` at a time, for queries to write to; the last one may be shorter. A `size`
    /// of 0 counts as 1.
    pub fn chunks_mut(&mut self, size: usize) -> impl Iterator<Item = HitsMut<'_>> {
        self.hits_mut().chunks(size)
    }

    /// Distances, in lengths of each ray's direction; infinity for a miss.
    pub fn t(&self) -> &[f32] {
        &self.t
    }

    /// Weights of triangles' second corners; 0 for spheres and misses.
    pub fn u(&self) -> &[f32] {
        &self.u
    }

    /// Weights of triangles' third corners; 0 for spheres and misses.
    pub fn v(&self) -> &[f32] {
        &self.v
    }

    /// Primitive ids; [`NONE`] for a miss.
    pub fn primitive(&self) -> &[u32] {
        &self.primitive
    }

    /// Instance ids; [`NONE`] for a miss and for primitives in world space.
    pub fn instance(&self) -> &[u32] {
        &self.instance
    }
}
