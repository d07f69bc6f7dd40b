//! The scene that rays are traced through, and the tracer of a thread.

use super::builder::{InstanceId, ShapeId};
use super::error::LengthMismatch;
use crate::bvh::layout::sidedness::SPHERE;
use crate::bvh::{self, AnyHitFilter, BuildStatistics, Bvh, Coherence, HitsMut, Rays, Stack};
use crate::math::{Aabb, Hit, NONE, Ray, Vec3, Vector};
use crate::simd::Isa;

/// Placed shapes, ready for rays. Made by [`SceneBuilder::build`] and immutable, so threads share it by reference or in
/// an [`Arc`](std::sync::Arc).
///
/// [`SceneBuilder::build`]: super::SceneBuilder::build
#[derive(Clone, Debug)]
pub struct Scene {
    pub(super) bvh: Bvh,
    pub(super) owners: Owners,
    pub(super) statistics: Statistics,
}

/// The mapping from ids of the tree to those of the caller.
#[derive(Clone, Debug, Default)]
pub(super) struct Owners {
    /// The first triangle and the number of each shape that has any, ascending.
    pub triangles: Vec<(u32, u32)>,
    /// The first sphere and the number of each shape that has any, ascending.
    pub spheres: Vec<(u32, u32)>,
    /// The instance of each shape that lies in the world's tree, or [`NONE`].
    pub in_world: Vec<u32>,
    /// The caller's number of each instance of the tree.
    pub instances: Vec<u32>,
}

/// The contents of a scene, and statistics of its build.
#[derive(Clone, Copy, Debug)]
pub struct Statistics {
    /// Shapes that were added, placed or not.
    pub shapes: usize,
    /// Placed shapes.
    pub instances: usize,
    /// Triangles of all placed shapes, each shape counted once.
    pub triangles: usize,
    /// Spheres of all placed shapes, each shape counted once.
    pub spheres: usize,
    /// Statistics of the build.
    pub build: BuildStatistics,
}

/// The primitive that a ray hit, in the caller's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HitPrimitive {
    /// The placed shape.
    pub instance: InstanceId,
    /// The shape that the instance places.
    pub shape: ShapeId,
    /// The index of the triangle or sphere in the shape, counted from 0 in the order in which they were added.
    pub primitive: u32,
}

impl Scene {
    /// The axis-aligned box around everything that can be hit; `None` if there is nothing. It is padded by about 2⁻¹⁹
    /// of its coordinates.
    pub fn bounds(&self) -> Option<Aabb> {
        self.bvh.root.map(|root| root.bounds)
    }

    /// The number of bytes that the scene takes. The memory of the builder has been freed: triangles are stored only in
    /// the acceleration structure.
    pub fn memory_bytes(&self) -> usize {
        let Owners { triangles, spheres, in_world, instances } = &self.owners;
        self.bvh.bytes()
            + size_of_val(&triangles[..])
            + size_of_val(&spheres[..])
            + size_of_val(&in_world[..])
            + size_of_val(&instances[..])
    }

    /// Counts, and statistics of the build.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Creates a tracer with the widest instruction set that the processor has. Make one for each thread and reuse it:
    /// this allocates some kilobytes.
    pub fn tracer(&self) -> Tracer<'_> {
        self.tracer_at(Isa::detect())
    }

    /// [`Self::tracer`] with the instruction set `isa`. Hits are the same to the last bit.
    pub fn tracer_at(&self, isa: Isa) -> Tracer<'_> {
        Tracer { scene: self, isa, stack: Stack::new(&self.bvh) }
    }

    /// Creates a tracer with the buffers of another tracer of this scene.
    #[cfg(feature = "python")]
    pub(crate) fn tracer_with(&self, stack: Stack) -> Tracer<'_> {
        Tracer { scene: self, isa: Isa::detect(), stack }
    }

    /// Returns the primitive of a hit in the caller's numbers; `None` for a miss, and for ids that are not of this
    /// scene. Time grows with the logarithm of the number of shapes.
    pub fn locate(&self, hit: &Hit) -> Option<HitPrimitive> {
        if hit.is_miss() {
            return None;
        }
        let (firsts, count) = match hit.primitive & SPHERE {
            0 => (&self.owners.triangles, self.statistics.triangles),
            _ => (&self.owners.spheres, self.statistics.spheres),
        };
        let id = hit.primitive & !SPHERE;
        let before = firsts.partition_point(|(first, _)| *first <= id);
        let (first, shape) = *firsts.get(before.checked_sub(1)?).filter(|_| (id as usize) < count)?;
        let instance = match hit.instance {
            NONE => *self.owners.in_world.get(shape as usize).filter(|instance| **instance != NONE)?,
            placed => *self.owners.instances.get(placed as usize)?,
        };
        Some(HitPrimitive { instance: InstanceId(instance), shape: ShapeId(shape), primitive: id - first })
    }
}

/// A tracer of rays on one thread: a scene, an instruction set and a traversal stack.
pub struct Tracer<'a> {
    scene: &'a Scene,
    isa: Isa,
    stack: Stack,
}

impl Tracer<'_> {
    /// The buffers, for [`Scene::tracer_with`].
    #[cfg(feature = "python")]
    pub(crate) fn into_stack(self) -> Stack {
        self.stack
    }

    /// Finds the nearest hit of each ray. Every entry of `hits` is written; see [`HitsMut`] for the values of a miss,
    /// and the [module](super#what-a-ray-hits) for what counts as a hit.
    ///
    /// # Errors
    ///
    /// [`LengthMismatch`] if not all columns of `rays` and `hits` have one length.
    pub fn closest(&mut self, rays: Rays, coherence: Coherence, hits: HitsMut) -> Result<(), LengthMismatch> {
        check_rays(&rays)?;
        for (column, length) in [
            ("t", hits.t.len()),
            ("u", hits.u.len()),
            ("v", hits.v.len()),
            ("primitive", hits.primitive.len()),
            ("instance", hits.instance.len()),
        ] {
            check(column, length, rays.len())?;
        }
        bvh::closest(self.isa, &self.scene.bvh, rays, coherence, &mut self.stack, hits);
        Ok(())
    }

    /// Writes 1 for each ray that hits anything, else 0. Faster than [`Self::closest`], since traversal stops at the
    /// first hit found.
    ///
    /// # Errors
    ///
    /// [`LengthMismatch`] if not all columns of `rays`, and `blocked`, have one length.
    pub fn any(
        &mut self,
        rays: Rays,
        coherence: Coherence,
        blocked: &mut [u32],
    ) -> Result<(), LengthMismatch> {
        check_rays(&rays)?;
        check("blocked", blocked.len(), rays.len())?;
        bvh::any(self.isa, &self.scene.bvh, rays, coherence, &mut self.stack, blocked);
        Ok(())
    }

    /// Finds the nearest hit of the ray `origin + t · direction` with `t_min` < t ≤ `t_max`, as [`Self::closest`] does;
    /// [`Hit::MISS`] if there is none. For rays that depend on the hits of others: several at a time are faster.
    pub fn closest_one(&mut self, origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> Hit {
        let ray = ray(origin, direction, t_min, t_max);
        bvh::closest_ray(self.isa, &self.scene.bvh, &ray, AnyHitFilter::ACCEPT_ALL, &mut self.stack)
    }

    /// True if the ray `origin + t · direction` hits anything with `t_min` < t ≤ `t_max`: see [`Self::closest_one`].
    pub fn any_one(&mut self, origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> bool {
        let ray = ray(origin, direction, t_min, t_max);
        bvh::any_ray(self.isa, &self.scene.bvh, &ray, AnyHitFilter::ACCEPT_ALL, &mut self.stack)
    }
}

fn ray(origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> Ray<f32> {
    let [origin, direction] = [origin, direction].map(|v| Vector::new(v.x, v.y, v.z));
    Ray { origin, direction, t_min, t_max }
}

fn check_rays(rays: &Rays) -> Result<(), LengthMismatch> {
    let names = [["origin x", "origin y", "origin z"], ["direction x", "direction y", "direction z"]];
    for (names, columns) in names.iter().zip([rays.origin, rays.direction]) {
        for (name, column) in names.iter().zip(columns) {
            check(name, column.len(), rays.len())?;
        }
    }
    check("t_min", rays.t_min.len(), rays.len())
}

fn check(column: &'static str, length: usize, rays: usize) -> Result<(), LengthMismatch> {
    if length == rays { Ok(()) } else { Err(LengthMismatch { column, length, rays }) }
}
