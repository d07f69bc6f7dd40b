//! A kernel for trees of a few leaves: a ray a lane, every leaf in turn.
//!
//! In a Cornell box a ray meets most of the boxes there are, and getting into and out of a
//! traversal costs more than the traversal. Here nothing is walked: 16 rays meet the boxes of all
//! leaves, then the triangles and spheres in those that one of them enters. Nothing of it is a decision of one
//! ray's.
//!
//! Rays are sorted by the way they go first, so that all of a group meet the same sides of boxes
//! first and rename their axes alike, and leaves come from front to back.

use super::Rays;
use super::answers::Answers;
use super::direction_classes::{DirectionClasses, OCTANTS};
use super::layout::{Bvh, Child, ChildKind};
use super::leaf::{Askers, Best};
use super::presence::{Asker, Candidate, Word};
use super::ray::slab_scales;
use super::sphere;
use super::triangle::{Asked, ExactRays, Shear, TrianglePlane, intersect_rays, seen_from};
use crate::math::NONE;
use crate::simd::{Float, Int, Kernel, Lanes, Mask};

/// More blocks than this are walked. (Measured on cut-down bumpy meshes.)
const MOST_BLOCKS: usize = 12;

/// The leaves of a tree.
pub(super) struct FewLeaves {
    leaves: Vec<Leaf>,
    /// For each octant the leaves from front to back.
    front_to_back: [Vec<u8>; OCTANTS],
    /// Whether rays may have to ask.
    conditional: bool,
}

/// [`Few::trace`].
pub(super) struct FewQuery<'a, 'r, A> {
    pub few: &'a FewLeaves,
    pub rays: &'a Rays<'r>,
    pub classes: &'a mut DirectionClasses,
    pub answers: &'a mut A,
}

impl<A: Answers> Kernel for FewQuery<'_, '_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.few.trace::<L, A>(self.rays, self.classes, self.answers);
    }
}

/// The planes of a leaf's box, lower ones first, and its triangles, for each axis along which a ray
/// may go farthest, or its spheres.
struct Leaf {
    planes: [[f32; 3]; 2],
    triangles: [Vec<Triangle>; 3],
    spheres: Vec<Sphere>,
}

struct Sphere {
    center: [f32; 3],
    radius: f32,
    candidate: Candidate,
}

/// A triangle with renamed axes.
struct Triangle {
    corners: [[f32; 3]; 3],
    /// Axes as they are.
    plane: TrianglePlane,
    candidate: Candidate,
}

/// Rays that go one way.
struct RayGroup<F: Float> {
    origin: [F; 3],
    direction: [F; 3],
    near_scale: [F; 3],
    far_scale: [F; 3],
    /// Which plane of a box they meet first.
    near_side: [usize; 3],
    /// The origins with renamed axes.
    renamed: [F; 3],
    shear: [F; 3],
    t_min: F,
    best: Best<F>,
}

impl FewLeaves {
    /// The leaves of a tree, if they are few and there is no instance.
    pub fn new(bvh: &Bvh) -> Option<Self> {
        let root = bvh.root?;
        if bvh.triangles.len() + bvh.spheres.len() > MOST_BLOCKS || !bvh.instances.is_empty() {
            return None;
        }
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
                        // What is not used lies nowhere.
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
        Some(Self { leaves, front_to_back, conditional: bvh.conditional })
    }

    /// Answers all rays.
    #[inline(always)]
    fn trace<L: Lanes, A: Answers>(&self, rays: &Rays, classes: &mut DirectionClasses, answers: &mut A) {
        let width = L::Queue::WIDTH;
        let ends = classes.sort::<L::Queue>(rays, self.conditional);
        let mut first = 0;
        for (way, end) in ends.into_iter().enumerate() {
            let (octant, axis) = (way % OCTANTS, way / OCTANTS);
            for at in (first..end).step_by(width) {
                let lanes = width.min(end - at);
                let mut group = RayGroup::<L::Queue>::load(classes, at, lanes, octant, axis);
                let askers = Waiting { rays, classes, at };
                self.visit::<L::Queue, A>(octant, axis, &mut group, &askers);
                let Best { t, u, v, primitive } = group.best;
                classes.keep(at, [t, u, v], primitive);
            }
            first = end;
        }
        classes.answer::<L::Queue, A>(rays.len(), answers);
    }

    #[inline(always)]
    fn visit<F: Float, A: Answers>(
        &self,
        octant: usize,
        axis: usize,
        group: &mut RayGroup<F>,
        askers: &Waiting,
    ) {
        for leaf in &self.front_to_back[octant] {
            let leaf = &self.leaves[usize::from(*leaf)];
            let (near, entered) = group.enter(&leaf.planes);
            if !entered.any() {
                continue;
            }
            for triangle in &leaf.triangles[axis] {
                group.test::<A>(triangle, near, entered, askers);
            }
            for sphere in &leaf.spheres {
                group.test_sphere::<A>(sphere, near, entered, askers);
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
            let places = (0..block.words.len()).filter(|place| Word(block.words[*place]).is_used());
            let spheres = places.map(|place| Sphere {
                center: block.center.map(|axis| axis[place]),
                radius: block.radius[place],
                candidate: Candidate::sphere(Word(block.words[place])),
            });
            return Self { planes, triangles: Default::default(), spheres: spheres.collect() };
        }
        let block = &bvh.triangles[child.index()];
        let triangles = std::array::from_fn(|longest| {
            let [x, y, z] = Shear::AXES[longest];
            let places = (0..block.words.len()).filter(|place| Word(block.words[*place]).is_used());
            let renamed = places.map(|place| {
                let corners = block.corners(place);
                Triangle {
                    corners: corners.map(|corner| [corner[x], corner[y], corner[z]]),
                    plane: TrianglePlane::new(corners),
                    candidate: Candidate::triangle(Word(block.words[place])),
                }
            });
            renamed.collect()
        });
        Self { planes, triangles, spheres: Vec::new() }
    }

    /// How far along an octant's diagonal it begins.
    fn depth(&self, octant: usize) -> f32 {
        let [low, high] = &self.planes;
        (0..3).map(|axis| if octant >> axis & 1 == 0 { low[axis] } else { -high[axis] }).sum()
    }
}

/// The rays of a group in their queue.
struct Waiting<'a> {
    rays: &'a Rays<'a>,
    classes: &'a DirectionClasses,
    at: usize,
}

impl Askers for Waiting<'_> {
    fn asker(&self, lane: usize) -> Asker<'_> {
        self.rays.asker(self.classes.number(self.at + lane))
    }
}

/// A triangle's plane and rays.
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
    fn load(classes: &DirectionClasses, at: usize, lanes: usize, octant: usize, axis: usize) -> Self {
        let mask = F::Mask::first(lanes);
        let (origin, direction, t_min, t_max) = classes.rays::<F>(at);
        let (zero, one) = (F::zero(), F::one());
        let (mut near_scale, mut far_scale) = ([zero; 3], [zero; 3]);
        let (mut reciprocal, mut near_side) = ([one; 3], [0; 3]);
        // NaN where something is not finite.
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
        // A NaN stays one, −0 becomes 0.
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

    /// Where the rays enter a box, and which of them do.
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

    /// One triangle against all rays that have entered its leaf.
    #[inline(always)]
    fn test<A: Answers>(&mut self, triangle: &Triangle, near: F, entered: F::Mask, askers: &Waiting) {
        let seen = seen_from(&triangle.corners, &self.renamed);
        let best = self.best.t;
        let asked = Asked { lanes: entered, t_min: self.t_min, t_max: best };
        let exact = OnPlane { plane: &triangle.plane, origin: &self.origin, direction: &self.direction };
        let hits = intersect_rays(seen, &self.shear, &asked, &exact);
        if hits.mask.any() {
            self.best.take::<A>(&hits, triangle.candidate, near, self.t_min, askers);
        }
    }

    /// One sphere against all rays that have entered its leaf.
    #[inline(always)]
    fn test_sphere<A: Answers>(&mut self, sphere: &Sphere, near: F, entered: F::Mask, askers: &Waiting) {
        let placed = (sphere.center, sphere.radius);
        let hits = sphere::intersect_rays(placed, self.origin, self.direction, self.t_min, entered);
        self.best.take::<A>(&hits, sphere.candidate, near, self.t_min, askers);
    }
}
