//! What rays are traced through, and what a thread needs to trace them.

use super::builder::{InstanceId, ShapeId};
use super::error::LengthMismatch;
use crate::bvh::{self, BuildQuality, BuildStatistics, Bvh, Coherence, HitsMut, Rays, SPHERE, Stack};
use crate::math::{Aabb, Hit, NONE};
use crate::simd::Isa;

/// Shapes in their places, ready for rays. Made by [`SceneBuilder::build`] and never changed
/// again, so threads share it by reference or in an [`Arc`](std::sync::Arc).
///
/// [`SceneBuilder::build`]: super::SceneBuilder::build
#[derive(Clone, Debug)]
pub struct Scene {
    pub(super) bvh: Bvh,
    pub(super) owners: Owners,
    pub(super) statistics: Statistics,
}

/// From the ids of the tree to those of the caller.
#[derive(Clone, Debug, Default)]
pub(super) struct Owners {
    /// First triangle and number of each shape that has any, ascending.
    pub triangles: Vec<(u32, u32)>,
    /// The same for spheres.
    pub spheres: Vec<(u32, u32)>,
    /// For each shape the instance that lies in the world's tree, or [`NONE`].
    pub in_world: Vec<u32>,
    /// For each instance of the tree the caller's.
    pub instances: Vec<u32>,
}

/// What a scene holds and what building it took.
#[derive(Clone, Copy, Debug)]
pub struct Statistics {
    /// Shapes that were added, placed or not.
    pub shapes: usize,
    /// Placed shapes.
    pub instances: usize,
    /// Of all placed shapes, each shape's once.
    pub triangles: usize,
    /// Of all placed shapes, each shape's once.
    pub spheres: usize,
    /// The quality that was asked for.
    pub quality: BuildQuality,
    /// What building took.
    pub build: BuildStatistics,
}

/// What a ray hit, in the caller's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HitPrimitive {
    /// Which placed shape.
    pub instance: InstanceId,
    /// Which shape that is.
    pub shape: ShapeId,
    /// Which of its triangles or spheres, counted from 0 as they were handed over.
    pub primitive: u32,
}

impl Scene {
    /// The axis-aligned box around everything that can be hit; `None` if there is nothing. It is padded by about 2⁻¹⁹
    /// of its coordinates.
    pub fn bounds(&self) -> Option<Aabb> {
        self.bvh.root.map(|root| root.bounds)
    }

    /// Bytes that the scene takes. The memory of the builder has been freed: triangles are kept only in the
    /// acceleration structure.
    pub fn memory_bytes(&self) -> usize {
        let Owners { triangles, spheres, in_world, instances } = &self.owners;
        self.bvh.bytes()
            + size_of_val(&triangles[..])
            + size_of_val(&spheres[..])
            + size_of_val(&in_world[..])
            + size_of_val(&instances[..])
    }

    /// Counts, and what building took.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// What a thread needs to trace rays, with the widest instructions that the processor
    /// has. Make one for each thread and keep it: this allocates some kilobytes.
    pub fn tracer(&self) -> Tracer<'_> {
        self.tracer_at(Isa::detect())
    }

    /// [`Self::tracer`] with the instruction set of `level`. The answers are the same to the last bit.
    pub fn tracer_at(&self, isa: Isa) -> Tracer<'_> {
        Tracer { scene: self, isa, stack: Stack::new(&self.bvh) }
    }

    /// What a ray hit, in the caller's numbers; `None` for a miss, and for ids that are not of this scene. The time
    /// that it takes grows with the logarithm of the number of shapes.
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

/// Traces rays on one thread: a scene, an instruction set and a stack.
pub struct Tracer<'a> {
    scene: &'a Scene,
    isa: Isa,
    stack: Stack,
}

impl Tracer<'_> {
    /// Finds the nearest hit of each ray. Every entry of `hits` is written; see [`HitsMut`] for what a miss looks
    /// like, and the [module](super#what-a-ray-hits) for what counts as a hit.
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

    /// Writes 1 for each ray that hits anything, else 0. Faster than [`Self::closest`], since it stops at the first
    /// hit that it finds.
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
