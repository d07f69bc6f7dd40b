//! The beam: the space that the rays of a packet pass through.

use super::rays::{Active, GROUPS, PacketRays, RAYS, SetBits};
use crate::bvh::Root;
use crate::bvh::intersect::triangle::Shear;
use crate::bvh::layout::sidedness::PrimitiveRef;
use crate::bvh::layout::{Node, PADDING, SphereBlock, TriangleBlock};
use crate::simd::{Float, Int, Mask, Sixteen};

/// A beam is not worth it if its slopes differ by more than this.
const WIDEST: f32 = 0.35;

/// The half spaces `coordinate − slope · depth` ≥ and ≤ a bound for each of two axes, and the range of depths, which
/// are measured along the third. All are widened by the possible rounding errors.
pub struct Beam {
    /// The two other axes, and the longest one.
    pub axes: [usize; 3],
    slope: [[f32; 2]; 2],
    bound: [[f32; 2]; 2],
    ends: [f32; 2],
    /// The near planes of a box along each axis: 0 for the low one, 1 for the high one.
    pub sides: [usize; 3],
    /// The point where all of its rays start, if it is only one.
    pub apex: Option<[f32; 3]>,
}

/// The minima and maxima over rays, lane by lane.
#[derive(Clone, Copy)]
struct LaneInterval<F>(F, F);

impl<F: Float> LaneInterval<F> {
    #[inline(always)]
    fn empty() -> Self {
        LaneInterval(F::splat(f32::INFINITY), F::splat(f32::NEG_INFINITY))
    }

    /// Includes the values in the lanes of `mask`.
    #[inline(always)]
    fn with(self, value: F, mask: F::Mask) -> Self {
        LaneInterval(F::select(mask, value.min(self.0), self.0), F::select(mask, value.max(self.1), self.1))
    }

    #[inline(always)]
    fn ends(self) -> [f32; 2] {
        let (mut low, mut high) = ([f32::INFINITY; 16], [f32::NEG_INFINITY; 16]);
        self.0.store(&mut low);
        self.1.store(&mut high);
        // By halves, so that it is done in registers.
        for half in [8, 4, 2, 1] {
            for i in 0..half {
                low[i] = Float::min(low[i], low[i + half]);
                high[i] = Float::max(high[i], high[i + half]);
            }
        }
        [low[0], high[0]]
    }
}

/// The direction of the rays of a pass.
struct Heading {
    axes: [usize; 3],
    /// The sign of the direction along the longest axis.
    sign: f32,
}

impl Beam {
    /// The beam around the active rays within a tree's box; `None` if they spread too far.
    #[inline(always)]
    pub fn around<F: Float>(rays: &PacketRays, active: &Active, root: &Root) -> Option<Beam> {
        let class = rays.class_of::<F>(active);
        let axes = Shear::AXES[(class >> 3) as usize % 4];
        let sides = [class >> 2, class >> 1, class].map(|c| c as usize & 1);
        let forwards = sides[axes[2]] == 0;
        let way = Heading { axes, sign: if forwards { 1.0 } else { -1.0 } };
        let (low, high) = (root.bounds.min.to_array(), root.bounds.max.to_array());
        let (box_start, box_end) =
            if forwards { (low[axes[2]], high[axes[2]]) } else { (-high[axes[2]], -low[axes[2]]) };
        let [start, end] = depths::<F>(rays, active, &way)?;
        let start = start.max(box_start);
        let end = end.min(box_end).max(start);
        let reach = low.iter().chain(&high).fold(0.0f32, |most, c| most.max(c.abs()));
        let margin = (reach + start.abs() + end.abs()) * PADDING;
        let mut beam = Beam {
            axes,
            slope: [[0.0; 2]; 2],
            bound: [[0.0; 2]; 2],
            ends: [start - margin, end + margin],
            sides,
            apex: apex::<F>(rays, active),
        };
        let mut finite = margin.is_finite();
        for (axis, [at_start, at_end]) in extent::<F>(rays, active, &way, [start, end]).iter().enumerate() {
            for side in 0..2 {
                let (first, last) = (at_start[side], at_end[side]);
                let slope = (last - first) / (end - start);
                let slope = if slope.is_finite() { slope } else { 0.0 };
                // The end that is farther out, since the line between the two is not exact.
                let lines = [first - slope * start, last - slope * end];
                let size = reach + first.abs() + last.abs() + slope.abs() * (reach + start.abs() + end.abs());
                let margin = size * (4.0 * PADDING);
                finite &= margin.is_finite();
                beam.slope[axis][side] = slope * way.sign;
                beam.bound[axis][side] = match side {
                    0 => lines[0].min(lines[1]) - margin,
                    _ => lines[0].max(lines[1]) + margin,
                };
            }
        }
        finite.then_some(beam)
    }

    /// The octant: bit i is set if its rays go down along axis i.
    #[inline(always)]
    pub fn octant(&self) -> u32 {
        let [x, y, z] = self.sides;
        (x | y << 1 | z << 2) as u32
    }

    /// The children of a node that the beam meets.
    #[inline(always)]
    pub fn meets<S: Sixteen>(&self, node: &Node) -> u32 {
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
                // The corner of each box that lies farthest on the inner side.
                let corner = if (slope > 0.0) == (side == 0) { shallow } else { deep };
                let inner = S::load(&planes[1 - side]) - corner * S::splat(slope);
                let bound = S::splat(self.bound[axis][side]);
                bits &= if side == 0 { bound.le(inner) } else { inner.le(bound) };
            }
        }
        bits
    }

    /// The spheres of a block that the beam meets.
    #[inline(always)]
    pub fn meets_spheres<F: Float>(&self, block: &SphereBlock) -> u32 {
        let mut met = 0;
        for at in (0..block.words.len()).step_by(F::WIDTH) {
            let depth = F::load(&block.center[self.axes[2] % 3][at..]);
            let radius = F::load(&block.radius[at..]).abs() * F::splat(1.0 + 4.0 * PADDING);
            // On the same scale as the ends.
            let along = if self.sides[self.axes[2] % 3] == 0 { depth } else { -depth };
            let mut mask =
                (along + radius).ge(F::splat(self.ends[0])) & (along - radius).le(F::splat(self.ends[1]));
            for axis in 0..2 {
                let center = F::load(&block.center[self.axes[axis] % 3][at..]);
                for side in 0..2 {
                    let slope = self.slope[axis][side];
                    let inner = center - depth * F::splat(slope);
                    let reach = radius * F::splat((1.0 + slope * slope).sqrt());
                    let bound = F::splat(self.bound[axis][side]);
                    mask =
                        mask & if side == 0 { (inner + reach).ge(bound) } else { (inner - reach).le(bound) };
                }
            }
            // Unused slots have a NaN radius and compare false.
            met |= mask.bits() << at;
        }
        met
    }

    /// The triangles of a block that the beam meets.
    #[inline(always)]
    pub fn meets_triangles<F: Float>(&self, block: &TriangleBlock) -> u32 {
        let mut met = 0;
        for at in (0..block.words.len()).step_by(F::WIDTH) {
            let mut mask = !F::Int::load(&block.words[at..]).eq(F::Int::splat(PrimitiveRef::UNUSED.0));
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

/// The depths where the first of the active rays starts and the last one ends, along their longest axis and in their
/// direction; `None` if they spread too far.
#[inline(always)]
fn depths<F: Float>(rays: &PacketRays, active: &Active, way: &Heading) -> Option<[f32; 2]> {
    let mut depths = LaneInterval::empty();
    let mut slopes = [LaneInterval::empty(); 2];
    for group in SetBits(active.groups) {
        let (at, mask) = (group % GROUPS * F::WIDTH, F::Mask::from_bits(active.lanes[group % GROUPS]));
        let start = F::load(&rays.origin[way.axes[2]].0[at..]) * F::splat(way.sign);
        let along = F::load(&rays.direction[way.axes[2]].0[at..]) * F::splat(way.sign);
        depths = depths.with(start, mask).with(start + along * F::load(&rays.t.0[at..]), mask);
        for (slopes, slope) in slopes.iter_mut().zip(&rays.shear) {
            *slopes = slopes.with(F::load(&slope.0[at..]), mask);
        }
    }
    let [a, b] = [slopes[0].ends(), slopes[1].ends()];
    if a[1] - a[0] <= WIDEST && b[1] - b[0] <= WIDEST { Some(depths.ends()) } else { None }
}

/// The least and the greatest of the other two coordinates of the active rays at each of two depths: by axis, by depth.
#[inline(always)]
fn extent<F: Float>(
    rays: &PacketRays,
    active: &Active,
    way: &Heading,
    depths: [f32; 2],
) -> [[[f32; 2]; 2]; 2] {
    let mut ranges = [[LaneInterval::empty(); 2]; 2];
    for group in SetBits(active.groups) {
        let (at, mask) = (group % GROUPS * F::WIDTH, F::Mask::from_bits(active.lanes[group % GROUPS]));
        let z = F::load(&rays.origin[way.axes[2]].0[at..]);
        for (axis, ranges) in ranges.iter_mut().enumerate() {
            let x = F::load(&rays.origin[way.axes[axis]].0[at..]);
            let slope = F::load(&rays.shear[axis].0[at..]);
            for (range, depth) in ranges.iter_mut().zip(depths) {
                *range = range.with(x + (F::splat(depth * way.sign) - z) * slope, mask);
            }
        }
    }
    [[ranges[0][0].ends(), ranges[0][1].ends()], [ranges[1][0].ends(), ranges[1][1].ends()]]
}

/// The point that all active rays start at, bit for bit.
#[inline(always)]
fn apex<F: Float>(rays: &PacketRays, active: &Active) -> Option<[f32; 3]> {
    let (group, lane) = active.first();
    let apex = [0, 1, 2].map(|axis| rays.origin[axis].0[(group * F::WIDTH + lane) % RAYS]);
    for group in SetBits(active.groups) {
        let (at, mask) = (group % GROUPS * F::WIDTH, F::Mask::from_bits(active.lanes[group % GROUPS]));
        for (origin, apex) in rays.origin.iter().zip(apex) {
            let same = F::load(&origin.0[at..]).to_bits().eq(F::Int::splat(apex.to_bits()));
            if (mask & !same).any() {
                return None;
            }
        }
    }
    Some(apex)
}
