//! The kernel for trees of a few leaves: a ray a lane, every leaf in turn.
//!
//! In a Cornell box a ray meets most of the boxes, and starting and ending a traversal costs more than the traversal.
//! Here no tree is traversed: 16 rays are tested against the boxes of all leaves, then against the triangles and
//! spheres of those that at least one of them enters. No decision depends on a single ray.
//!
//! Rays are first sorted by direction class, so that all rays of a group meet the same sides of boxes first and permute
//! their axes alike, and leaves come from front to back.

use std::ops::Range;

use super::direction_classes::{DirectionClasses, OCTANTS, class_of, padded};
use super::shaft::{Obstacles, Shaft};
use crate::bvh::Rays;
use crate::bvh::intersect::hit_sink::{HitSink, write_lanes};
use crate::bvh::intersect::leaf::{AnyHitFilters, Best};
use crate::bvh::intersect::ray::slab_scales;
use crate::bvh::intersect::sphere;
use crate::bvh::intersect::triangle::{
    AcceptedRange, ExactRays, Shear, TrianglePlane, intersect_rays, seen_from,
};
use crate::bvh::layout::sidedness::{AnyHitFilter, PrimitiveCandidate, PrimitiveRef};
use crate::bvh::layout::{Bvh, Child, ChildKind};
use crate::math::NONE;
use crate::simd::{Float, Int, Kernel, Lanes, Mask};

/// Trees with more blocks than this are traversed. (Measured on cut-down bumpy meshes.)
const MOST_BLOCKS: usize = 12;

impl Bvh {
    /// True if rays meet all leaves in turn, without a traversal.
    pub fn has_few_leaves(&self) -> bool {
        self.triangles.len() + self.spheres.len() <= MOST_BLOCKS && self.instances.is_empty()
    }
}

/// The leaves of a tree.
pub(in crate::bvh) struct LeafList {
    leaves: Vec<Leaf>,
    /// The primitives in them, one leaf after another.
    obstacles: Obstacles,
    /// For each octant, the leaves from front to back.
    front_to_back: [Vec<u8>; OCTANTS],
    /// True if hits of some primitives may be rejected.
    conditional: bool,
}

/// [`LeafList::trace`] as a kernel.
pub(in crate::bvh) struct LeafListQuery<'a, 'r, A> {
    pub few: &'a LeafList,
    pub rays: &'a Rays<'r>,
    pub classes: &'a mut DirectionClasses,
    pub sink: &'a mut A,
}

impl<A: HitSink> Kernel for LeafListQuery<'_, '_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.few.trace::<L, A>(self.rays, self.classes, self.sink);
    }
}

/// Traces a bundle of rays of a queue. Returns false if it did not: rays without ends have no shaft.
pub(in crate::bvh) struct LeafListBundleQuery<'a, 'r, A> {
    pub few: &'a LeafList,
    pub rays: &'a Rays<'r>,
    pub bundle: Range<usize>,
    pub sink: &'a mut A,
}

impl<A: HitSink> Kernel for LeafListBundleQuery<'_, '_, A> {
    type Output = bool;
    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let Self { few, rays, bundle, sink } = self;
        let Some(shaft) = Shaft::around::<L::Queue>(rays, bundle.clone()) else { return false };
        let obstacles = few.obstacles.within::<L::Queue>(&shaft);
        few.trace_bundle::<L::Queue, A>(rays, bundle, obstacles, sink);
        true
    }
}

/// The planes of a leaf's box, lower ones first, and its triangles for each longest axis that a ray may have, or its
/// spheres.
struct Leaf {
    /// The index of its first obstacle, and a bit for each.
    first: usize,
    all: u32,
    planes: [[f32; 3]; 2],
    triangles: [Vec<ListedTriangle>; 3],
    spheres: Vec<ListedSphere>,
}

struct ListedSphere {
    center: [f32; 3],
    radius: f32,
    candidate: PrimitiveCandidate,
}

/// A triangle with permuted axes.
struct ListedTriangle {
    corners: [[f32; 3]; 3],
    /// The plane with the original axes.
    plane: TrianglePlane,
    candidate: PrimitiveCandidate,
}

/// Rays, a lane each.
struct Lines<F> {
    origin: [F; 3],
    direction: [F; 3],
    t_min: F,
    t_max: F,
}

/// Rays of one direction class.
struct RayGroup<F: Float> {
    origin: [F; 3],
    direction: [F; 3],
    near_scale: [F; 3],
    far_scale: [F; 3],
    /// The near planes of boxes along each axis: 0 for the low ones, 1 for the high ones.
    near_side: [usize; 3],
    /// The origins with permuted axes.
    renamed: [F; 3],
    shear: [F; 3],
    t_min: F,
    best: Best<F>,
}

impl LeafList {
    /// Collects the leaves of a tree, if they are few and there is no instance.
    pub fn new(bvh: &Bvh) -> Option<Self> {
        let root = bvh.root.filter(|_| bvh.has_few_leaves())?;
        let mut leaves = Vec::new();
        let planes = [root.bounds.min.to_array(), root.bounds.max.to_array()];
        let mut todo = vec![(root.child, planes)];
        while let Some((child, planes)) = todo.pop() {
            match child.kind() {
                ChildKind::Triangles | ChildKind::Spheres => leaves.push(Leaf::new(bvh, child, planes)),
                ChildKind::Node => {
                    let node = &bvh.nodes[child.index()];
                    for (slot, child) in node.child.iter().enumerate() {
                        let planes = [0, 1].map(|side| node.planes.map(|axis| axis[side][slot]));
                        // Unused boxes are inverted.
                        if planes[0][0] <= planes[1][0] {
                            todo.push((Child(*child), planes));
                        }
                    }
                }
                ChildKind::Instance => return None,
            }
        }
        let front_to_back = std::array::from_fn(|octant| {
            let mut order: Vec<u8> = (0..leaves.len() as u8).collect();
            order.sort_by(|a, b| {
                let [a, b] = [a, b].map(|leaf| leaves[usize::from(*leaf)].depth(octant));
                a.total_cmp(&b)
            });
            order
        });
        let mut obstacles = Obstacles::default();
        for leaf in &mut leaves {
            leaf.first = obstacles.len();
            leaf.triangles[2].iter().for_each(|triangle| obstacles.push_triangle(triangle.corners));
            leaf.spheres.iter().for_each(|sphere| obstacles.push_sphere(sphere.center, sphere.radius.abs()));
            leaf.all = (1 << (obstacles.len() - leaf.first)) - 1;
        }
        obstacles.finish();
        Some(Self { leaves, obstacles, front_to_back, conditional: bvh.conditional })
    }

    /// Traces all rays.
    #[inline(always)]
    fn trace<L: Lanes, A: HitSink>(&self, rays: &Rays, classes: &mut DirectionClasses, sink: &mut A) {
        let width = L::Queue::WIDTH;
        let ends = classes.sort::<L::Queue>(rays, self.conditional);
        let mut first = 0;
        for (way, end) in ends.into_iter().enumerate() {
            let (octant, axis) = (way % OCTANTS, way / OCTANTS);
            for at in (first..end).step_by(width) {
                let lanes = width.min(end - at);
                let (origin, direction, t_min, t_max) = classes.rays::<L::Queue>(at);
                let lines = Lines { origin, direction, t_min, t_max };
                let mut group = RayGroup::new(&lines, Mask::first(lanes), octant, axis);
                let filters = QueuedGroup { rays, classes, at };
                self.visit::<L::Queue, A>(octant, axis, u128::MAX, &mut group, &filters);
                let Best { t, u, v, primitive } = group.best;
                classes.keep(at, [t, u, v], primitive);
            }
            first = end;
        }
        classes.answer::<L::Queue, A>(rays.len(), sink);
    }

    /// Traces rays that may hit only some of the obstacles, given as bits. They go in much the same direction.
    #[inline(always)]
    fn trace_bundle<F: Float, A: HitSink>(
        &self,
        rays: &Rays,
        bundle: Range<usize>,
        obstacles: u128,
        sink: &mut A,
    ) {
        for at in bundle.clone().step_by(F::WIDTH) {
            let (mut origin, mut direction) = ([F::zero(); 3], [F::zero(); 3]);
            for axis in 0..3 {
                origin[axis] = padded(&rays.origin[axis][at..]);
                direction[axis] = padded(&rays.direction[axis][at..]);
            }
            let (t_min, t_max) = (padded(&rays.t_min[at..]), padded(&rays.t_max[at..]));
            let lines = Lines::<F> { origin, direction, t_min, t_max };
            let lanes = F::WIDTH.min(bundle.end - at);
            let mut primitive = F::Int::splat(NONE);
            let class = class_of(&lines.direction);
            let mut classes = [0; 16];
            class.store(&mut classes);
            let mut left = F::Mask::first(lanes).bits();
            while left != 0 {
                let way = classes[left.trailing_zeros() as usize % 16];
                let mask = class.eq(F::Int::splat(way)) & F::Mask::from_bits(left);
                left &= !mask.bits();
                let (octant, axis) = (way as usize % OCTANTS, way as usize / OCTANTS % 3);
                let mut group = RayGroup::new(&lines, mask, octant, axis);
                let filters = InQueue { rays, at };
                self.visit::<F, A>(octant, axis, obstacles, &mut group, &filters);
                primitive = F::Int::select(mask, group.best.primitive, primitive);
            }
            let nowhere = [F::zero(); 3];
            write_lanes(sink, at, lanes, nowhere, [primitive, F::Int::splat(NONE)]);
        }
    }

    /// Takes rays of one class through the leaves, testing some of the obstacles.
    #[inline(always)]
    fn visit<F: Float, A: HitSink>(
        &self,
        octant: usize,
        axis: usize,
        obstacles: u128,
        group: &mut RayGroup<F>,
        filters: &impl AnyHitFilters,
    ) {
        for leaf in &self.front_to_back[octant] {
            let leaf = &self.leaves[usize::from(*leaf)];
            let mut bits = (obstacles >> (leaf.first % 128)) as u32 & leaf.all;
            if bits == 0 {
                continue;
            }
            let (near, entered) = group.enter(&leaf.planes);
            if !entered.any() {
                continue;
            }
            while bits != 0 {
                let place = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                if let Some(triangle) = leaf.triangles[axis].get(place) {
                    group.test::<A>(triangle, near, entered, filters);
                } else if let Some(sphere) = leaf.spheres.get(place) {
                    group.test_sphere::<A>(sphere, near, entered, filters);
                }
            }
            if A::ANY && !group.best.t.ge(F::zero()).any() {
                return;
            }
        }
    }
}

impl Leaf {
    fn new(bvh: &Bvh, child: Child, planes: [[f32; 3]; 2]) -> Self {
        if child.kind() == ChildKind::Spheres {
            let block = &bvh.spheres[child.index()];
            let places = (0..block.words.len()).filter(|place| PrimitiveRef(block.words[*place]).is_used());
            let spheres = places.map(|place| ListedSphere {
                center: block.center.map(|axis| axis[place]),
                radius: block.radius[place],
                candidate: PrimitiveCandidate::sphere(PrimitiveRef(block.words[place])),
            });
            return Self {
                first: 0,
                all: 0,
                planes,
                triangles: Default::default(),
                spheres: spheres.collect(),
            };
        }
        let block = &bvh.triangles[child.index()];
        let triangles = std::array::from_fn(|longest| {
            let [x, y, z] = Shear::AXES[longest];
            let places = (0..block.words.len()).filter(|place| PrimitiveRef(block.words[*place]).is_used());
            let renamed = places.map(|place| {
                let corners = block.corners(place);
                ListedTriangle {
                    corners: corners.map(|corner| [corner[x], corner[y], corner[z]]),
                    plane: TrianglePlane::new(corners),
                    candidate: PrimitiveCandidate::triangle(PrimitiveRef(block.words[place])),
                }
            });
            renamed.collect()
        });
        Self { first: 0, all: 0, planes, triangles, spheres: Vec::new() }
    }

    /// The position of its nearest corner along an octant's diagonal.
    fn depth(&self, octant: usize) -> f32 {
        let [low, high] = &self.planes;
        (0..3).map(|axis| if octant >> axis & 1 == 0 { low[axis] } else { -high[axis] }).sum()
    }
}

/// The rays of a group in a sorted queue.
struct QueuedGroup<'a> {
    rays: &'a Rays<'a>,
    classes: &'a DirectionClasses,
    at: usize,
}

impl AnyHitFilters for QueuedGroup<'_> {
    fn filter(&self, lane: usize) -> AnyHitFilter<'_> {
        self.rays.filter(self.classes.number(self.at + lane))
    }
}

/// Consecutive rays of a queue.
struct InQueue<'a> {
    rays: &'a Rays<'a>,
    at: usize,
}

impl AnyHitFilters for InQueue<'_> {
    fn filter(&self, lane: usize) -> AnyHitFilter<'_> {
        self.rays.filter(self.at + lane)
    }
}

/// The plane of a triangle, and rays.
struct OnPlane<'a, F> {
    plane: &'a TrianglePlane,
    origin: &'a [F; 3],
    direction: &'a [F; 3],
}

impl<F: Float> ExactRays<F> for OnPlane<'_, F> {
    #[inline(always)]
    fn t(&self, lanes: F::Mask, t: F) -> F {
        self.plane.t_in_lanes(self.origin, self.direction, lanes, t)
    }
}

impl<F: Float> RayGroup<F> {
    #[inline(always)]
    fn new(lines: &Lines<F>, mask: F::Mask, octant: usize, axis: usize) -> Self {
        let Lines { origin, direction, t_min, t_max } = *lines;
        let (zero, one) = (F::zero(), F::one());
        let (mut near_scale, mut far_scale) = ([zero; 3], [zero; 3]);
        let (mut reciprocal, mut near_side) = ([one; 3], [0; 3]);
        // NaN if something is not finite.
        let mut zeros = zero;
        for axis in 0..3 {
            let (o, d) = (origin[axis], direction[axis]);
            let r = one / d;
            (near_scale[axis], far_scale[axis]) = slab_scales(r);
            near_side[axis] = octant >> axis & 1;
            reciprocal[axis] = r;
            zeros = zeros + o * zero + d * zero;
        }
        let [x, y, z] = Shear::AXES[axis];
        let r = reciprocal[z];
        // NaN stays NaN, −0 becomes 0.
        let t_min = zero.max(t_min) + zero;
        let alive = zeros.eq(zero) & t_min.le(t_max) & mask;
        let best = Best {
            t: F::select(alive, t_max, F::splat(-1.0)),
            u: zero,
            v: zero,
            primitive: F::Int::splat(NONE),
        };
        Self {
            origin,
            direction,
            near_scale,
            far_scale,
            near_side,
            renamed: [origin[x], origin[y], origin[z]],
            shear: [direction[x] * r, direction[y] * r, r],
            t_min,
            best,
        }
    }

    /// The distances at which the rays enter a box, and the lanes of those that do.
    #[inline(always)]
    fn enter(&self, planes: &[[f32; 3]; 2]) -> (F, F::Mask) {
        let (mut near, mut far) = (self.t_min, self.best.t);
        for (axis, side) in self.near_side.into_iter().enumerate() {
            let side = side & 1;
            let (near_plane, far_plane) = (F::splat(planes[side][axis]), F::splat(planes[side ^ 1][axis]));
            near = ((self.origin[axis] - near_plane) * self.near_scale[axis]).max(near);
            far = ((self.origin[axis] - far_plane) * self.far_scale[axis]).min(far);
        }
        (near, near.le(far))
    }

    /// Tests one triangle against all rays that have entered its leaf.
    #[inline(always)]
    fn test<A: HitSink>(
        &mut self,
        triangle: &ListedTriangle,
        near: F,
        entered: F::Mask,
        filters: &impl AnyHitFilters,
    ) {
        let seen = seen_from(&triangle.corners, &self.renamed);
        let best = self.best.t;
        let asked = AcceptedRange { lanes: entered, t_min: self.t_min, t_max: best };
        let exact = OnPlane { plane: &triangle.plane, origin: &self.origin, direction: &self.direction };
        let hits = intersect_rays(seen, &self.shear, &asked, &exact);
        if hits.mask.any() {
            self.best.take::<A>(&hits, triangle.candidate, near, self.t_min, filters);
        }
    }

    /// Tests one sphere against all rays that have entered its leaf.
    #[inline(always)]
    fn test_sphere<A: HitSink>(
        &mut self,
        sphere: &ListedSphere,
        near: F,
        entered: F::Mask,
        filters: &impl AnyHitFilters,
    ) {
        let placed = (sphere.center, sphere.radius);
        let hits = sphere::intersect_rays(placed, self.origin, self.direction, self.t_min, entered);
        self.best.take::<A>(&hits, sphere.candidate, near, self.t_min, filters);
    }
}
