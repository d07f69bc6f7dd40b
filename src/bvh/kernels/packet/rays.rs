//! The rays of a packet, by columns, and the set of active rays.

use crate::bvh::Rays;
use crate::bvh::intersect::hit_sink::Hits;
use crate::bvh::intersect::ray::{line_to_local, slab_scales};
use crate::bvh::intersect::triangle::Longest;
use crate::bvh::kernels::direction_classes::NUMBERS;
use crate::bvh::layout::Instance;
use crate::math::{Hit, NONE, Ray, Vector};
use crate::simd::{Float, Int, Mask};

/// The number of rays of a packet.
pub const RAYS: usize = 128;
/// A packet's groups have as many lanes as the processor has, but at least this many.
pub const LEAST_WIDTH: usize = 8;
/// The most groups of lanes that a packet is made of.
pub const GROUPS: usize = RAYS / LEAST_WIDTH;

/// A number for each ray.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub struct PacketColumn<T>(pub [T; RAYS]);

impl PacketColumn<f32> {
    /// Copies values, no more than there is room for, to the front.
    #[inline(always)]
    fn fill(&mut self, values: &[f32]) {
        // Nearly always there are as many as there is room for: known to the compiler, these are a few registers.
        if let Ok(values) = <&[f32; RAYS]>::try_from(values) {
            self.0 = *values;
        } else {
            self.0[..values.len()].copy_from_slice(values);
        }
    }
}

/// The rays, the values precomputed from them, and the best hit of each so far.
pub struct PacketRays {
    pub origin: [PacketColumn<f32>; 3],
    pub direction: [PacketColumn<f32>; 3],
    pub near_scale: [PacketColumn<f32>; 3],
    pub far_scale: [PacketColumn<f32>; 3],
    pub t_min: PacketColumn<f32>,
    /// The least entry distance: the start of the ray, or its entry into the instance.
    pub floor: PacketColumn<f32>,
    /// The nearest hit so far, at first the end of the ray; negative for a finished ray.
    pub t: PacketColumn<f32>,
    pub u: PacketColumn<f32>,
    pub v: PacketColumn<f32>,
    pub primitive: PacketColumn<u32>,
    pub instance: PacketColumn<u32>,
    /// The slopes of the other two axes over the longest one, and its reciprocal.
    pub shear: [PacketColumn<f32>; 3],
    /// The direction class of the ray: three signs, and the longest axis.
    class: PacketColumn<u32>,
}

/// The active lanes of each group, and the groups that have any.
#[derive(Clone, Copy)]
pub struct Active {
    pub lanes: [u32; GROUPS],
    pub groups: u32,
}

impl Active {
    /// No rays.
    pub const NONE: Active = Active { lanes: [0; GROUPS], groups: 0 };

    /// The number of rays.
    #[inline(always)]
    pub fn count(&self) -> u32 {
        self.lanes.iter().map(|lanes| lanes.count_ones()).sum()
    }

    /// The group and lane of the first ray.
    #[inline(always)]
    pub fn first(&self) -> (usize, usize) {
        let group = self.groups.trailing_zeros() as usize % GROUPS;
        (group, self.lanes[group].trailing_zeros() as usize)
    }

    /// Removes lanes of a group.
    #[inline(always)]
    pub fn remove(&mut self, group: usize, lanes: u32) {
        self.lanes[group] &= !lanes;
        self.groups &= !(u32::from(self.lanes[group] == 0) << group);
    }
}

/// Iterates over the indices of set bits, the lowest first.
pub struct SetBits(pub u32);

impl Iterator for SetBits {
    type Item = usize;
    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let place = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        Some(place)
    }
}

impl PacketRays {
    /// Rays with all values zero.
    pub fn new() -> Self {
        let (float, integer) = (PacketColumn([0.0; RAYS]), PacketColumn([0; RAYS]));
        Self {
            origin: [float; 3],
            direction: [float; 3],
            near_scale: [float; 3],
            far_scale: [float; 3],
            t_min: float,
            floor: float,
            t: float,
            u: float,
            v: float,
            primitive: integer,
            instance: integer,
            shear: [float; 3],
            class: integer,
        }
    }

    /// Loads and prepares the rays.
    #[inline(always)]
    pub fn load<F: Float>(&mut self, rays: &Rays, first: usize, count: usize) {
        let range = first..first + count;
        for axis in 0..3 {
            self.origin[axis].fill(&rays.origin[axis][range.clone()]);
            self.direction[axis].fill(&rays.direction[axis][range.clone()]);
        }
        self.t_min.fill(&rays.t_min[range.clone()]);
        self.t.fill(&rays.t_max[range]);
        for at in (0..count).step_by(F::WIDTH) {
            // NaN stays NaN, −0 becomes 0.
            let t_min = F::zero().max(F::load(&self.t_min.0[at..])) + F::zero();
            t_min.store(&mut self.t_min.0[at..]);
            t_min.store(&mut self.floor.0[at..]);
        }
        self.prepare::<F>(count);
    }

    /// Computes what follows from origins and directions, and clears the hits.
    #[inline(always)]
    fn prepare<F: Float>(&mut self, count: usize) {
        for at in (0..count).step_by(F::WIDTH) {
            let mut reciprocal = [F::zero(); 3];
            let mut class = F::Int::splat(0);
            for (axis, reciprocal) in reciprocal.iter_mut().enumerate() {
                let r = F::one() / F::load(&self.direction[axis].0[at..]);
                let (near_scale, far_scale) = slab_scales(r);
                near_scale.store(&mut self.near_scale[axis].0[at..]);
                far_scale.store(&mut self.far_scale[axis].0[at..]);
                class = class + class + r.to_bits().shr::<31>();
                *reciprocal = r;
            }
            let direction = [
                F::load(&self.direction[0].0[at..]),
                F::load(&self.direction[1].0[at..]),
                F::load(&self.direction[2].0[at..]),
            ];
            let longest = Longest::new(direction);
            (class + longest.axis().shl::<3>()).store(&mut self.class.0[at..]);
            let d = longest.rename(direction);
            let r = longest.rename(reciprocal)[2];
            (d[0] * r).store(&mut self.shear[0].0[at..]);
            (d[1] * r).store(&mut self.shear[1].0[at..]);
            r.store(&mut self.shear[2].0[at..]);
            F::zero().store(&mut self.u.0[at..]);
            F::zero().store(&mut self.v.0[at..]);
            F::Int::splat(NONE).store(&mut self.primitive.0[at..]);
            F::Int::splat(NONE).store(&mut self.instance.0[at..]);
        }
    }

    /// Transforms those of a packet's rays that enter an instance to its space, packed together, each from its entry
    /// (`near`) on. Stores their indices in `places` and returns their number.
    #[inline(always)]
    pub fn take_to<F: Float>(
        &mut self,
        instance: &Instance,
        (world, near): (&PacketRays, &PacketColumn<f32>),
        (groups, active): (u32, &Active),
        places: &mut PacketColumn<u32>,
    ) -> usize {
        let mut count = 0;
        for group in SetBits(groups) {
            let group = group % GROUPS;
            let at = group * F::WIDTH;
            let near = F::load(&near.0[at..]);
            // A lane that does not enter has a NaN distance.
            let entered = F::Mask::from_bits(active.lanes[group]) & near.ge(F::zero());
            let (origin, direction) = world.lines::<F>(group);
            let (origin, direction) = line_to_local(instance, origin, direction);
            for axis in 0..3 {
                origin[axis].compress(entered, &mut self.origin[axis].0[count..]);
                direction[axis].compress(entered, &mut self.direction[axis].0[count..]);
            }
            near.compress(entered, &mut self.floor.0[count..]);
            F::load(&world.t_min.0[at..]).compress(entered, &mut self.t_min.0[count..]);
            F::load(&world.t.0[at..]).compress(entered, &mut self.t.0[count..]);
            let numbers = F::Int::load(&NUMBERS) + F::Int::splat(at as u32);
            numbers.compress(entered, &mut places.0[count..]);
            count += entered.count();
        }
        self.prepare::<F>(count);
        count
    }

    /// Those of the first `count` rays that can hit anything at all.
    #[inline(always)]
    pub fn pending<F: Float>(&self, count: usize) -> Active {
        let mut pending = Active::NONE;
        for (group, lanes) in pending.lanes.iter_mut().enumerate().take(count.div_ceil(F::WIDTH)) {
            *lanes = self.alive::<F>(group * F::WIDTH, count - group * F::WIDTH);
            pending.groups |= u32::from(*lanes != 0) << group;
        }
        pending
    }

    /// The lanes from `at` on, at most `count`, with a ray that can hit anything at all.
    #[inline(always)]
    fn alive<F: Float>(&self, at: usize, count: usize) -> u32 {
        let mut zeros = F::zero();
        for axis in 0..3 {
            let o = F::load(&self.origin[axis].0[at..]);
            let d = F::load(&self.direction[axis].0[at..]);
            // NaN if something is not finite.
            zeros = zeros + o * F::zero() + d * F::zero();
        }
        let t_min = F::load(&self.t_min.0[at..]);
        let ends = t_min.le(F::load(&self.t.0[at..]));
        (zeros.eq(F::zero()) & ends & F::Mask::first(count.min(F::WIDTH))).bits()
    }

    /// Takes the pending rays of the same direction class as the first one.
    #[inline(always)]
    pub fn next_pass<F: Float>(&self, pending: &mut Active) -> Option<Active> {
        if pending.groups == 0 {
            return None;
        }
        let class = F::Int::splat(self.class_of::<F>(pending));
        let mut active = Active::NONE;
        for group in SetBits(pending.groups) {
            let group = group % GROUPS;
            let same = F::Int::load(&self.class.0[group * F::WIDTH..]).eq(class).bits();
            active.lanes[group] = pending.lanes[group] & same;
            active.groups |= u32::from(active.lanes[group] != 0) << group;
            pending.remove(group, same);
        }
        Some(active)
    }

    /// The direction class of the first active ray: three signs below, the longest axis above.
    #[inline(always)]
    pub fn class_of<F: Float>(&self, active: &Active) -> u32 {
        let (group, lane) = active.first();
        self.class.0[(group * F::WIDTH + lane) % RAYS]
    }

    /// The hits of the first `count` rays.
    #[inline(always)]
    pub fn hits(&self, count: usize) -> Hits<'_> {
        Hits {
            t: &self.t.0[..count],
            u: &self.u.0[..count],
            v: &self.v.0[..count],
            primitive: &self.primitive.0[..count],
            instance: &self.instance.0[..count],
        }
    }

    /// The origins and directions of a group.
    #[inline(always)]
    pub fn lines<F: Float>(&self, group: usize) -> ([F; 3], [F; 3]) {
        let at = group * F::WIDTH;
        let (mut origin, mut direction) = ([F::zero(); 3], [F::zero(); 3]);
        for axis in 0..3 {
            origin[axis] = F::load(&self.origin[axis].0[at..]);
            direction[axis] = F::load(&self.direction[axis].0[at..]);
        }
        (origin, direction)
    }

    /// Returns ray `i`, which ends at its best hit.
    pub fn ray(&self, i: usize) -> Ray<f32> {
        let of = |c: &[PacketColumn<f32>; 3]| Vector { x: c[0].0[i], y: c[1].0[i], z: c[2].0[i] };
        Ray {
            origin: of(&self.origin),
            direction: of(&self.direction),
            t_min: self.t_min.0[i],
            t_max: self.t.0[i],
        }
    }

    /// The best hit of ray `i` so far.
    #[inline(always)]
    pub fn best(&self, i: usize) -> Hit {
        Hit {
            t: self.t.0[i],
            u: self.u.0[i],
            v: self.v.0[i],
            primitive: self.primitive.0[i],
            instance: self.instance.0[i],
        }
    }

    /// The inverse of [`PacketRays::best`].
    #[inline(always)]
    pub fn put_best(&mut self, i: usize, hit: &Hit) {
        (self.t.0[i], self.u.0[i], self.v.0[i]) = (hit.t, hit.u, hit.v);
        (self.primitive.0[i], self.instance.0[i]) = (hit.primitive, hit.instance);
    }
}
