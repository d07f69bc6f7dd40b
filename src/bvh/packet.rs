//! Packets: the kernel for rays that run side by side.
//!
//! Up to [`RAYS`] rays go through the tree together, with one stack. A *beam* of six planes
//! holds them all: four that bound where the rays are, as straight lines between the ends
//! of the beam (so that rays from one point, to one point, and side by side are bounded
//! equally well), and its two ends. The beam is tested against a node's 16 children at
//! once; what it meets is tested ray by ray, with the slabs of the single-ray kernel, when
//! it comes off the stack. At a leaf the beam leaves out triangles, and the others
//! meet the rays, a ray a lane, in the canonical test. (Large packets after Overbeck,
//! Ramamoorthi and Mark, "Large ray packets for real-time Whitted ray tracing", 2008; the
//! beam is Reshetov's frustum, "Multi-level ray tracing algorithm", 2005, with ends.)
//!
//! Rays of a packet whose directions have other signs or another longest axis than those of
//! the first one are left to a pass of their own.

use std::marker::PhantomData;

use super::Rays;
use super::layout::{Bvh, Child, Kind, Node, PADDING, TriangleBlock, WIDTH};
use super::query::Answers;
use super::traverse::{self, Keys, Part};
use super::triangle::{self, Shear};
use crate::math::{Hit, NONE, Ray, Vector};
use crate::simd::sixteen::key;
use crate::simd::{Float, Int, Lanes, Mask, Sixteen};

/// Rays of a packet.
pub(super) const RAYS: usize = 128;
/// A packet has groups of as many lanes as the processor has, but at least of so many.
pub(super) const LEAST_WIDTH: usize = 8;
/// The most groups of lanes that a packet is made of.
const GROUPS: usize = RAYS / LEAST_WIDTH;
/// Passes over a packet before the rest of it is left to the single-ray kernel.
const PASSES: usize = 4;
/// A beam whose slopes differ by more than this is not worth it.
const WIDEST: f32 = 0.35;
/// A pass with fewer rays is not worth it.
const FEWEST: u32 = 12;

/// A number for each ray.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Column<T>([T; RAYS]);

/// A packet and its stack.
pub(super) struct Packet {
    origin: [Column<f32>; 3],
    direction: [Column<f32>; 3],
    near_scale: [Column<f32>; 3],
    far_scale: [Column<f32>; 3],
    t_min: Column<f32>,
    /// The nearest hit so far, at first where the ray ends; below 0 for a ray that is done.
    t: Column<f32>,
    u: Column<f32>,
    v: Column<f32>,
    primitive: Column<u32>,
    instance: Column<u32>,
    /// The slopes of the other two axes over the longest one, and its reciprocal.
    shear: [Column<f32>; 3],
    /// Which way the ray goes: three signs, and the longest axis.
    class: Column<u32>,
    /// Where a ray enters the box that is being visited.
    near: Column<f32>,
    stack: Vec<Entry>,
}

/// A box that the beam meets.
#[derive(Clone, Copy, Default)]
struct Entry {
    /// What is in it.
    child: u32,
    /// Its node, and its place there.
    node: u32,
    slot: u32,
    /// The groups that reach its parent.
    groups: u32,
}

/// The lanes of each group that take part in a pass.
#[derive(Clone, Copy)]
struct Active {
    lanes: [u32; GROUPS],
    groups: u32,
}

/// The half spaces `coordinate − slope · depth` ≥ `low` and ≤ `high` for each of two axes,
/// and the range of depths. All are widened by what rounding could do.
struct Beam {
    /// The two other axes, and the longest one.
    axes: [usize; 3],
    slope: [[f32; 2]; 2],
    bound: [[f32; 2]; 2],
    ends: [f32; 2],
    /// Which of a box's planes along each axis are the near ones.
    sides: [usize; 3],
    /// Where all of its rays start, if that is one point.
    apex: Option<[f32; 3]>,
}

impl Packet {
    /// For queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        let (float, integer) = (Column([0.0; RAYS]), Column([0; RAYS]));
        Self {
            origin: [float; 3],
            direction: [float; 3],
            near_scale: [float; 3],
            far_scale: [float; 3],
            t_min: float,
            t: float,
            u: float,
            v: float,
            primitive: integer,
            instance: integer,
            shear: [float; 3],
            class: integer,
            near: float,
            stack: vec![Entry::default(); bvh.stack_size + WIDTH],
        }
    }

    /// Answers the rays from `first` on, at most [`RAYS`], if that is worth while: returns
    /// whether it did.
    #[inline(always)]
    pub fn trace<L: Lanes, A: Answers>(
        &mut self,
        bvh: &Bvh,
        rays: &Rays,
        first: usize,
        count: usize,
        keys: &mut Keys,
        answers: &mut A,
    ) -> bool {
        let width = L::Queue::WIDTH;
        let Some(root) = bvh.root else { return false };
        self.load::<L::Queue>(rays, first, count);
        let mut waiting = Active { lanes: [0; GROUPS], groups: 0 };
        for (group, lanes) in waiting.lanes.iter_mut().enumerate().take(count.div_ceil(width)) {
            *lanes = self.alive::<L::Queue>(group * width, count - group * width);
            waiting.groups |= u32::from(*lanes != 0) << group;
        }
        for pass in 0..PASSES {
            let Some(active) = self.next_pass::<L::Queue>(&mut waiting) else { break };
            let beam = self.beam::<L::Queue>(&active, &root);
            let beam = beam.filter(|_| active.lanes.iter().map(|l| l.count_ones()).sum::<u32>() >= FEWEST);
            match beam {
                Some(beam) if beam.apex.is_some() => self.walk::<L, A, true>(bvh, active, &beam, keys),
                Some(beam) => self.walk::<L, A, false>(bvh, active, &beam, keys),
                // Nothing has been done yet, and the caller has a better way.
                None if pass == 0 => return false,
                None => self.one_by_one::<L, A>(bvh, active, width, keys),
            }
        }
        self.one_by_one::<L, A>(bvh, waiting, width, keys);
        for i in 0..count {
            let hit = Hit {
                t: self.t.0[i],
                u: self.u.0[i],
                v: self.v.0[i],
                primitive: self.primitive.0[i],
                instance: self.instance.0[i],
            };
            answers.put(first + i, &hit);
        }
        true
    }

    /// Loads and prepares the rays.
    #[inline(always)]
    fn load<F: Float>(&mut self, rays: &Rays, first: usize, count: usize) {
        for axis in 0..3 {
            self.origin[axis].0[..count].copy_from_slice(&rays.origin[axis][first..first + count]);
            self.direction[axis].0[..count].copy_from_slice(&rays.direction[axis][first..first + count]);
        }
        self.t_min.0[..count].copy_from_slice(&rays.t_min[first..first + count]);
        self.t.0[..count].copy_from_slice(&rays.t_max[first..first + count]);
        for at in (0..count).step_by(F::WIDTH) {
            let mut reciprocal = [F::zero(); 3];
            let mut class = F::Int::splat(0);
            for (axis, reciprocal) in reciprocal.iter_mut().enumerate() {
                let r = F::one() / F::load(&self.direction[axis].0[at..]);
                (r * F::splat(PADDING - 1.0)).store(&mut self.near_scale[axis].0[at..]);
                (r * F::splat(-1.0 - PADDING)).store(&mut self.far_scale[axis].0[at..]);
                class = class + class + r.to_bits().shr::<31>();
                *reciprocal = r;
            }
            let direction = [
                F::load(&self.direction[0].0[at..]),
                F::load(&self.direction[1].0[at..]),
                F::load(&self.direction[2].0[at..]),
            ];
            let [x, y, z] = [direction[0].abs(), direction[1].abs(), direction[2].abs()];
            let first = x.gt(y);
            let (is_x, is_y) = (first & x.gt(z), !first & y.gt(z));
            let longest = F::Int::select(is_x, F::Int::splat(0), F::Int::splat(2));
            let longest = F::Int::select(is_y, F::Int::splat(1), longest);
            (class + longest.shl::<3>()).store(&mut self.class.0[at..]);
            let d = triangle::rename(direction, is_x, is_y);
            let r = triangle::rename(reciprocal, is_x, is_y)[2];
            (d[0] * r).store(&mut self.shear[0].0[at..]);
            (d[1] * r).store(&mut self.shear[1].0[at..]);
            r.store(&mut self.shear[2].0[at..]);
            // A NaN stays one, −0 becomes 0.
            (F::zero().max(F::load(&self.t_min.0[at..])) + F::zero()).store(&mut self.t_min.0[at..]);
            F::zero().store(&mut self.u.0[at..]);
            F::zero().store(&mut self.v.0[at..]);
            F::Int::splat(NONE).store(&mut self.primitive.0[at..]);
            F::Int::splat(NONE).store(&mut self.instance.0[at..]);
        }
    }

    /// The lanes from `at` on, `count` at the most, with a ray that can hit something at all.
    #[inline(always)]
    fn alive<F: Float>(&self, at: usize, count: usize) -> u32 {
        let mut zeros = F::zero();
        for axis in 0..3 {
            let o = F::load(&self.origin[axis].0[at..]);
            let d = F::load(&self.direction[axis].0[at..]);
            zeros = zeros + (o - o) + (d - d);
        }
        let t_min = F::load(&self.t_min.0[at..]);
        let ends = t_min.le(F::load(&self.t.0[at..]));
        (zeros.eq(F::zero()) & ends & F::Mask::first(count.min(F::WIDTH))).bits()
    }

    /// Takes those that go the same way as the first one that waits.
    #[inline(always)]
    fn next_pass<F: Float>(&self, waiting: &mut Active) -> Option<Active> {
        if waiting.groups == 0 {
            return None;
        }
        let group = waiting.groups.trailing_zeros() as usize % GROUPS;
        let lane = waiting.lanes[group].trailing_zeros() as usize;
        let class = F::Int::splat(self.class.0[(group * F::WIDTH + lane) % RAYS]);
        let mut active = Active { lanes: [0; GROUPS], groups: 0 };
        let mut groups = waiting.groups;
        while groups != 0 {
            let group = groups.trailing_zeros() as usize % GROUPS;
            groups &= groups - 1;
            let same = F::Int::load(&self.class.0[group * F::WIDTH..]).eq(class).bits();
            active.lanes[group] = waiting.lanes[group] & same;
            waiting.lanes[group] &= !same;
            active.groups |= u32::from(active.lanes[group] != 0) << group;
            waiting.groups &= !(u32::from(waiting.lanes[group] == 0) << group);
        }
        Some(active)
    }

    /// The beam around the active rays; none if they spread too far.
    #[inline(always)]
    fn beam<F: Float>(&self, active: &Active, root: &super::Root) -> Option<Beam> {
        let group = active.groups.trailing_zeros() as usize % GROUPS;
        let lane = active.lanes[group].trailing_zeros() as usize;
        let class = self.class.0[(group * F::WIDTH + lane) % RAYS];
        let axes = Shear::AXES[(class >> 3) as usize % 4];
        let sides = [class >> 2, class >> 1, class].map(|c| c as usize & 1);
        let (low, high) = (root.bounds.min.to_array(), root.bounds.max.to_array());
        let depth = axes[2];
        let forwards = sides[depth] == 0;
        let sign = if forwards { 1.0 } else { -1.0 };
        // Along the longest axis, counted in the direction of the rays.
        let (mut start, mut end) = (F::splat(f32::INFINITY), F::splat(f32::NEG_INFINITY));
        let apex = [0, 1, 2].map(|axis| self.origin[axis].0[(group * F::WIDTH + lane) % RAYS]);
        let mut is_apex = true;
        let mut slopes = [[F::splat(f32::INFINITY), F::splat(f32::NEG_INFINITY)]; 2];
        let mut groups = active.groups;
        while groups != 0 {
            let group = groups.trailing_zeros() as usize % GROUPS;
            groups &= groups - 1;
            let (at, mask) = (group * F::WIDTH, F::Mask::from_bits(active.lanes[group]));
            let z = F::load(&self.origin[depth].0[at..]) * F::splat(sign);
            let dz = F::load(&self.direction[depth].0[at..]) * F::splat(sign);
            for (axis, apex) in apex.iter().enumerate() {
                let same = F::load(&self.origin[axis].0[at..]).to_bits().eq(F::Int::splat(apex.to_bits()));
                is_apex &= !(mask & !same).any();
            }
            start = F::select(mask, z.min(start), start);
            end = F::select(mask, (z + dz * F::load(&self.t.0[at..])).max(end), end);
            for axis in 0..2 {
                let slope = F::load(&self.shear[axis].0[at..]);
                slopes[axis][0] = F::select(mask, slope.min(slopes[axis][0]), slopes[axis][0]);
                slopes[axis][1] = F::select(mask, slope.max(slopes[axis][1]), slopes[axis][1]);
            }
        }
        for [least, most] in slopes {
            if largest(most) - smallest(least) > WIDEST {
                return None;
            }
        }
        let (box_start, box_end) =
            if forwards { (low[depth], high[depth]) } else { (-high[depth], -low[depth]) };
        let start = smallest(start).max(box_start);
        let end = largest(end).min(box_end).max(start);
        let at_ends = self.extent::<F>(active, &axes, sign, [start, end]);
        let reach = low.iter().chain(&high).fold(0.0f32, |most, c| most.max(c.abs()));
        let mut beam = Beam {
            axes,
            slope: [[0.0; 2]; 2],
            bound: [[0.0; 2]; 2],
            ends: [start, end],
            sides,
            apex: is_apex.then_some(apex),
        };
        let mut slack = 0.0f32;
        for axis in 0..2 {
            for side in 0..2 {
                let [first, last] = at_ends[axis].map(|ends| ends[side]);
                let slope = (last - first) / (end - start);
                let slope = if slope.is_finite() { slope } else { 0.0 };
                let outwards = if side == 0 { -1.0 } else { 1.0 };
                // Of the two ends the one that is farther out, for where the line is not exact.
                let line = [first - slope * start, last - slope * end];
                let line = if side == 0 { line[0].min(line[1]) } else { line[0].max(line[1]) };
                let size = reach + first.abs() + last.abs() + slope.abs() * (reach + start.abs() + end.abs());
                let margin = size * (16.0 * PADDING) * 0.25;
                slack = slack.max(margin);
                beam.slope[axis][side] = slope * sign;
                beam.bound[axis][side] = line + outwards * margin;
            }
        }
        let margin = (reach + start.abs() + end.abs()) * PADDING;
        beam.ends = [start - margin, end + margin];
        (slack.is_finite() && start.is_finite() && end.is_finite()).then_some(beam)
    }

    /// The least and the largest of the other two coordinates of the active rays where they
    /// have come to each of two depths.
    #[inline(always)]
    fn extent<F: Float>(
        &self,
        active: &Active,
        axes: &[usize; 3],
        sign: f32,
        depths: [f32; 2],
    ) -> [[[f32; 2]; 2]; 2] {
        let mut out = [[[F::splat(f32::INFINITY), F::splat(f32::NEG_INFINITY)]; 2]; 2];
        let mut groups = active.groups;
        while groups != 0 {
            let group = groups.trailing_zeros() as usize % GROUPS;
            groups &= groups - 1;
            let (at, mask) = (group * F::WIDTH, F::Mask::from_bits(active.lanes[group]));
            let z = F::load(&self.origin[axes[2]].0[at..]);
            for axis in 0..2 {
                let x = F::load(&self.origin[axes[axis]].0[at..]);
                let slope = F::load(&self.shear[axis].0[at..]);
                for (depth, out) in depths.iter().zip(&mut out[axis]) {
                    let there = x + (F::splat(depth * sign) - z) * slope;
                    out[0] = F::select(mask, there.min(out[0]), out[0]);
                    out[1] = F::select(mask, there.max(out[1]), out[1]);
                }
            }
        }
        let mut bounds = [[[0.0; 2]; 2]; 2];
        for axis in 0..2 {
            for end in 0..2 {
                bounds[axis][end] = [smallest(out[axis][end][0]), largest(out[axis][end][1])];
            }
        }
        bounds
    }

    /// Takes a pass through the tree.
    #[inline(always)]
    fn walk<L: Lanes, A: Answers, const APEX: bool>(
        &mut self,
        bvh: &Bvh,
        mut active: Active,
        beam: &Beam,
        keys: &mut Keys,
    ) {
        let Some(root) = bvh.root else { return };
        let planes = [root.bounds.min.to_array(), root.bounds.max.to_array()];
        let mut groups = self.enter::<L::Queue, APEX>(&active, active.groups, &planes, beam);
        let mut child = root.child;
        let mut top = 0;
        loop {
            if groups != 0 {
                match child.kind() {
                    Kind::Node => self.open::<L>(bvh, child.index(), groups, beam, &mut top),
                    Kind::Triangles => {
                        let block = &bvh.triangles[child.index()];
                        let done = self.test::<L, A, APEX>(block, groups, &mut active, beam);
                        if done {
                            return;
                        }
                    }
                    _ => {
                        self.leave_to_single::<L, A>(bvh, child, groups, &mut active, keys);
                        if active.groups == 0 {
                            return;
                        }
                    }
                }
            }
            if top == 0 {
                return;
            }
            top -= 1;
            let entry = self.stack[top];
            let node = &bvh.nodes[entry.node as usize];
            let slot = entry.slot as usize % WIDTH;
            let planes = [0, 1].map(|side| node.planes.map(|axis| axis[side][slot]));
            groups = self.enter::<L::Queue, APEX>(&active, entry.groups & active.groups, &planes, beam);
            child = Child(entry.child);
        }
    }

    /// Which groups have a ray that enters a box; `near` holds where.
    #[inline(always)]
    fn enter<F: Float, const APEX: bool>(
        &mut self,
        active: &Active,
        mut groups: u32,
        planes: &[[f32; 3]; 2],
        beam: &Beam,
    ) -> u32 {
        // The planes as the rays meet them; seen from the apex if there is one.
        let apex = if APEX { beam.apex.unwrap_or([0.0; 3]) } else { [0.0; 3] };
        let (mut near_planes, mut far_planes) = ([F::zero(); 3], [F::zero(); 3]);
        for axis in 0..3 {
            let side = beam.sides[axis] & 1;
            let (near, far) = (planes[side][axis], planes[1 - side][axis]);
            near_planes[axis] = F::splat(if APEX { apex[axis] - near } else { near });
            far_planes[axis] = F::splat(if APEX { apex[axis] - far } else { far });
        }
        let mut entered = 0;
        while groups != 0 {
            let group = groups.trailing_zeros() as usize % GROUPS;
            groups &= groups - 1;
            let at = group * F::WIDTH;
            let (mut near, mut far) = (F::load(&self.t_min.0[at..]), F::load(&self.t.0[at..]));
            for axis in 0..3 {
                let near_scale = F::load(&self.near_scale[axis].0[at..]);
                let far_scale = F::load(&self.far_scale[axis].0[at..]);
                let (mut near_plane, mut far_plane) = (near_planes[axis], far_planes[axis]);
                if !APEX {
                    let origin = F::load(&self.origin[axis].0[at..]);
                    (near_plane, far_plane) = (origin - near_plane, origin - far_plane);
                }
                near = (near_plane * near_scale).max(near);
                far = (far_plane * far_scale).min(far);
            }
            // A lane that does not enter gets no distance, with which no comparison is true.
            let inside = near.le(far);
            F::select(inside, near, F::splat(f32::NAN)).store(&mut self.near.0[at..]);
            entered |= u32::from(inside.bits() & active.lanes[group] != 0) << group;
        }
        entered
    }

    /// Puts the children of a node that the beam meets on the stack, the nearest on top.
    #[inline(always)]
    fn open<L: Lanes>(&mut self, bvh: &Bvh, index: usize, groups: u32, beam: &Beam, top: &mut usize) {
        let node = &bvh.nodes[index];
        let mut bits = beam.meets::<L::Node>(node);
        let depth = &node.planes[beam.axes[2] % 3][beam.sides[beam.axes[2] % 3] & 1];
        let sign = if beam.sides[beam.axes[2] % 3] == 0 { 1.0 } else { -1.0 };
        let mut order = [0u64; WIDTH];
        let mut count = 0;
        while bits != 0 {
            let slot = bits.trailing_zeros() as usize % WIDTH;
            bits &= bits - 1;
            let found = key(Float::max(depth[slot] * sign - beam.ends[0], 0.0), slot as u32);
            let mut place = count;
            while place > 0 && order[(place - 1) % WIDTH] < found {
                order[place % WIDTH] = order[(place - 1) % WIDTH];
                place -= 1;
            }
            order[place % WIDTH] = found;
            count += 1;
        }
        for found in &order[..count] {
            let slot = *found as u32;
            let child = node.child[slot as usize % WIDTH];
            bvh.fetch(Child(child));
            self.stack[*top] = Entry { child, node: index as u32, slot, groups };
            *top += 1;
        }
    }

    /// Tests a block against the rays that enter it; whether all rays of the pass are done.
    #[inline(always)]
    fn test<L: Lanes, A: Answers, const APEX: bool>(
        &mut self,
        block: &TriangleBlock,
        groups: u32,
        active: &mut Active,
        beam: &Beam,
    ) -> bool {
        let mut met = beam.meets_triangles::<L::Block>(block);
        while met != 0 {
            let place = met.trailing_zeros() as usize % 8;
            met &= met - 1;
            let vertices = block.corners(place);
            let apex = if APEX { beam.apex.unwrap_or([0.0; 3]) } else { [0.0; 3] };
            let corners = vertices
                .map(|c| beam.axes.map(|axis| if APEX { c[axis % 3] - apex[axis % 3] } else { c[axis % 3] }));
            let mut todo = groups & active.groups;
            while todo != 0 {
                let group = todo.trailing_zeros() as usize % GROUPS;
                todo &= todo - 1;
                self.test_one::<L::Queue, A, APEX>(
                    &vertices,
                    &corners,
                    block.primitive[place],
                    group,
                    active,
                    beam,
                );
            }
            if A::ANY && active.groups == 0 {
                return true;
            }
        }
        false
    }

    /// One triangle against one group of rays.
    #[inline(always)]
    fn test_one<F: Float, A: Answers, const APEX: bool>(
        &mut self,
        vertices: &[[f32; 3]; 3],
        corners: &[[f32; 3]; 3],
        primitive: u32,
        group: usize,
        active: &mut Active,
        beam: &Beam,
    ) {
        let at = group * F::WIDTH;
        let shear = [
            F::load(&self.shear[0].0[at..]),
            F::load(&self.shear[1].0[at..]),
            F::load(&self.shear[2].0[at..]),
        ];
        let mut seen = [[F::zero(); 3]; 3];
        for (seen, corner) in seen.iter_mut().zip(corners) {
            for ((seen, corner), axis) in seen.iter_mut().zip(corner).zip(beam.axes) {
                *seen = F::splat(*corner);
                if !APEX {
                    *seen = *seen - F::load(&self.origin[axis % 3].0[at..]);
                }
            }
        }
        let hits = triangle::intersect_rays(seen, &shear, |lane| {
            triangle::exact_t(*vertices, &self.ray((at + lane) % RAYS))
        });
        if !hits.mask.any() {
            return;
        }
        let (near, best) = (F::load(&self.near.0[at..]), F::load(&self.t.0[at..]));
        // NaN distances fail the first comparison.
        let t = hits.t.max(near);
        let beyond = hits.mask & hits.t.gt(F::load(&self.t_min.0[at..])) & t.le(best);
        let id = F::Int::splat(primitive);
        // Nothing in a packet's own hands is in an instance, and those have the largest number.
        let smaller = id.lt(F::Int::load(&self.primitive.0[at..]));
        let better = beyond & (t.lt(best) | smaller) & F::Mask::from_bits(active.lanes[group]);
        if !better.any() {
            return;
        }
        if A::ANY {
            F::select(better, F::splat(-1.0), best).store(&mut self.t.0[at..]);
            active.lanes[group] &= !better.bits();
            active.groups &= !(u32::from(active.lanes[group] == 0) << group);
        } else {
            F::select(better, t, best).store(&mut self.t.0[at..]);
            F::select(better, hits.u, F::load(&self.u.0[at..])).store(&mut self.u.0[at..]);
            F::select(better, hits.v, F::load(&self.v.0[at..])).store(&mut self.v.0[at..]);
            let none = F::Int::splat(NONE);
            F::Int::select(better, none, F::Int::load(&self.instance.0[at..]))
                .store(&mut self.instance.0[at..]);
        }
        F::Int::select(better, id, F::Int::load(&self.primitive.0[at..])).store(&mut self.primitive.0[at..]);
    }

    fn ray(&self, i: usize) -> Ray<f32> {
        let of = |c: &[Column<f32>; 3]| Vector { x: c[0].0[i], y: c[1].0[i], z: c[2].0[i] };
        Ray {
            origin: of(&self.origin),
            direction: of(&self.direction),
            t_min: self.t_min.0[i],
            t_max: self.t.0[i],
        }
    }

    /// Spheres and instances, ray by ray.
    #[inline(always)]
    fn leave_to_single<L: Lanes, A: Answers>(
        &mut self,
        bvh: &Bvh,
        child: Child,
        mut groups: u32,
        active: &mut Active,
        keys: &mut Keys,
    ) {
        while groups != 0 {
            let group = groups.trailing_zeros() as usize % GROUPS;
            groups &= groups - 1;
            let mut lanes = active.lanes[group];
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let i = (group * L::Queue::WIDTH + lane) % RAYS;
                if self.near.0[i] >= 0.0 && self.single::<L, A>(bvh, i, key(self.near.0[i], child.0), keys) {
                    active.lanes[group] &= !(1 << lane);
                }
            }
            active.groups &= !(u32::from(active.lanes[group] == 0) << group);
        }
    }

    /// What goes its own way.
    #[inline(always)]
    fn one_by_one<L: Lanes, A: Answers>(&mut self, bvh: &Bvh, rest: Active, width: usize, keys: &mut Keys) {
        let mut groups = rest.groups;
        while groups != 0 {
            let group = groups.trailing_zeros() as usize % GROUPS;
            groups &= groups - 1;
            let mut lanes = rest.lanes[group];
            while lanes != 0 {
                let i = (group * width + lanes.trailing_zeros() as usize) % RAYS;
                lanes &= lanes - 1;
                if let Some(start) = traverse::start(bvh, &self.ray(i)) {
                    self.single::<L, A>(bvh, i, start, keys);
                }
            }
        }
    }

    /// One ray through a part of the tree; whether it is done, since any hit will do.
    #[inline(always)]
    fn single<L: Lanes, A: Answers>(&mut self, bvh: &Bvh, i: usize, start: u64, keys: &mut Keys) -> bool {
        let mut best = Hit {
            t: self.t.0[i],
            u: self.u.0[i],
            v: self.v.0[i],
            primitive: self.primitive.0[i],
            instance: self.instance.0[i],
        };
        let (ray, answers) = (&self.ray(i), PhantomData::<A>);
        let done = L::apart(Part { bvh, ray, start, keys, best: &mut best, answers });
        (self.t.0[i], self.u.0[i], self.v.0[i]) = (if done { -1.0 } else { best.t }, best.u, best.v);
        (self.primitive.0[i], self.instance.0[i]) = (best.primitive, best.instance);
        done
    }
}

impl Beam {
    /// The children of a node that it meets.
    #[inline(always)]
    fn meets<S: Sixteen>(&self, node: &Node) -> u32 {
        let depth = &node.planes[self.axes[2] % 3];
        let (shallow, deep) = (S::load(&depth[0]), S::load(&depth[1]));
        let mut bits = if self.sides[self.axes[2] % 3] == 0 {
            S::splat(self.ends[0]).le(deep) & shallow.le(S::splat(self.ends[1]))
        } else {
            S::splat(-self.ends[1]).le(deep) & shallow.le(S::splat(-self.ends[0]))
        };
        for axis in 0..2 {
            let planes = &node.planes[self.axes[axis] % 3];
            for side in 0..2 {
                let slope = self.slope[axis][side];
                // The corner of each box that is farthest on the inner side.
                let corner = if (slope > 0.0) == (side == 0) { shallow } else { deep };
                let inner = S::load(&planes[1 - side]) - corner * S::splat(slope);
                let bound = S::splat(self.bound[axis][side]);
                bits &= if side == 0 { bound.le(inner) } else { inner.le(bound) };
            }
        }
        bits
    }

    /// The triangles of a block that it meets.
    #[inline(always)]
    fn meets_triangles<F: Float>(&self, block: &TriangleBlock) -> u32 {
        let mut met = 0;
        for at in (0..block.primitive.len()).step_by(F::WIDTH) {
            let mut mask = !F::Int::load(&block.primitive[at..]).eq(F::Int::splat(NONE));
            let depth = &block.vertex[self.axes[2] % 3];
            let depth = [F::load(&depth[0][at..]), F::load(&depth[1][at..]), F::load(&depth[2][at..])];
            for axis in 0..2 {
                let vertex = &block.vertex[self.axes[axis] % 3];
                for side in 0..2 {
                    let slope = F::splat(self.slope[axis][side]);
                    let a = F::load(&vertex[0][at..]) - depth[0] * slope;
                    let b = F::load(&vertex[1][at..]) - depth[1] * slope;
                    let c = F::load(&vertex[2][at..]) - depth[2] * slope;
                    let bound = F::splat(self.bound[axis][side]);
                    mask =
                        mask & if side == 0 { a.max(b).max(c).ge(bound) } else { a.min(b).min(c).le(bound) };
                }
            }
            met |= mask.bits() << at;
        }
        met
    }
}

#[inline(always)]
fn smallest<F: Float>(values: F) -> f32 {
    let mut lanes = [f32::INFINITY; 16];
    values.store(&mut lanes);
    lanes.iter().fold(f32::INFINITY, |a, b| if *b < a { *b } else { a })
}

#[inline(always)]
fn largest<F: Float>(values: F) -> f32 {
    -smallest(-values)
}
