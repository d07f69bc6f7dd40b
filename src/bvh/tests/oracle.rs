//! Hits computed without culling by distance.

use std::collections::HashSet;

use glam::{DAffine3, DVec3};

use super::{Riddle, Soup, ray};
use crate::bvh::Bvh;
use crate::bvh::intersect::sphere::{self, Line};
use crate::bvh::intersect::triangle::{self, AcceptedRange, Shear};
use crate::bvh::layout::sidedness::{Crossing, FaceCulling, HitPredicate, PrimitiveRef, SPHERE, Sidedness};
use crate::bvh::layout::{Child, ChildKind, PADDING};
use crate::math::{Aabb, Hit, NONE, Ray, Vec3};

/// The distance at which a ray enters a box, and whether it does.
fn entry(ray: &Ray<f32>, bounds: &Aabb, before: f32) -> (f32, bool) {
    let origin = [ray.origin.x, ray.origin.y, ray.origin.z];
    let direction = [ray.direction.x, ray.direction.y, ray.direction.z];
    let (mut near, mut far) = (before, f32::INFINITY);
    for axis in 0..3 {
        let reciprocal = 1.0 / direction[axis];
        let mut planes = [bounds.min[axis], bounds.max[axis]];
        if reciprocal.is_sign_negative() {
            planes.reverse();
        }
        let t = (planes[0] - origin[axis]) * (reciprocal * (1.0 - PADDING));
        near = if t > near { t } else { near };
        let t = (planes[1] - origin[axis]) * (reciprocal * (1.0 + PADDING));
        far = if t < far { t } else { far };
    }
    (near, near <= far)
}

/// The documented hit: the least (max(t, entry), primitive, instance) of all primitives of which hits count for ray
/// `number`, in leaves whose boxes it enters. A primitive that it hits is in one of these.
pub(super) fn oracle(bvh: &Bvh, world: &Ray<f32>, number: usize) -> Hit {
    oracle_of(bvh, FaceCulling::AsBuilt, world, number)
}

/// [`oracle`] for a ray with a face culling.
pub(super) fn oracle_of(bvh: &Bvh, sides: FaceCulling, world: &Ray<f32>, number: usize) -> Hit {
    let mut best = Hit::MISS;
    let Some(root) = bvh.root else { return best };
    let everywhere = AcceptedRange::between(f32::NEG_INFINITY, f32::INFINITY);
    let (mut inside, mut outside) = (HashSet::new(), HashSet::new());
    let mut todo = vec![(root.child, entry(world, &root.bounds, world.t_min), NONE)];
    while let Some((child, (near, is_entered), instance)) = todo.pop() {
        let local = match instance {
            NONE => *world,
            placed => {
                let instance = &bvh.instances[placed as usize];
                let (o, d, [x, y, z]) = (world.origin, world.direction, instance.place());
                let rows = &instance.to_local;
                let point = rows.map(|[a, b, c]| a * (o.x - x) + b * (o.y - y) + c * (o.z - z));
                let direction = rows.map(|[a, b, c]| a * d.x + b * d.y + c * d.z);
                ray(Vec3::from_array(point), Vec3::from_array(direction), world.t_min, world.t_max)
            }
        };
        let given = bvh.instances.get(instance as usize).and_then(|instance| instance.sidedness);
        let mut consider = |hits: triangle::BlockHits<f32>, word: u32, flag: u32| {
            let word = PrimitiveRef(word);
            // The entry into a sphere, and the exit from it.
            let twice = hits.side > 0.0 && hits.far > hits.t;
            for (t, front) in [(hits.t, hits.side > 0.0), (if twice { hits.far } else { f32::NAN }, false)] {
                let key = |h: &Hit| (h.primitive, h.instance);
                let raised = if t > near { t } else { near };
                let primitive = word.number() | flag;
                let found = Hit { t: raised, u: hits.u, v: hits.v, primitive, instance };
                // t itself, not its raised value, must be beyond t_min.
                let counts = hits.mask && word.is_used() && t > world.t_min && raised <= world.t_max;
                let there = match given.unwrap_or(word.sidedness()) {
                    Sidedness::Always => true,
                    Sidedness::Front | Sidedness::Back if sides == FaceCulling::Off => true,
                    Sidedness::Front => front != (sides == FaceCulling::Opposite),
                    Sidedness::Back => front == (sides == FaceCulling::Opposite),
                    Sidedness::Filtered => Riddle.accepts(number, &Crossing { hit: found, front }),
                };
                let better =
                    best.is_miss() || raised < best.t || (raised == best.t && key(&found) < key(&best));
                if counts && there {
                    if is_entered { &mut inside } else { &mut outside }.insert(key(&found));
                }
                if counts && there && better && is_entered {
                    best = found;
                }
            }
        };
        match child.kind() {
            ChildKind::Node => {
                let node = &bvh.nodes[child.index()];
                let used = (0..node.child.len()).filter(|slot| !node.bounds(*slot).is_empty());
                todo.extend(used.map(|slot| {
                    (Child(node.child[slot]), entry(&local, &node.bounds(slot), near), instance)
                }));
            }
            ChildKind::Triangles => {
                let block = &bvh.triangles[child.index()];
                for lane in 0..8 {
                    consider(
                        triangle::intersect(block, lane, &local, &Shear::new(&local), &everywhere),
                        block.words[lane],
                        0,
                    );
                }
            }
            ChildKind::Spheres => {
                let block = &bvh.spheres[child.index()];
                for lane in 0..8 {
                    consider(
                        sphere::intersect(block, lane, &Line::new(&local), local.t_min),
                        block.words[lane],
                        SPHERE,
                    );
                }
            }
            ChildKind::Instance => {
                let root = bvh.instances[child.index()].root.child;
                todo.push((root, (near, is_entered), child.index() as u32));
            }
        }
    }
    assert!(outside.is_subset(&inside), "{outside:?} are hit outside their boxes");
    best
}

/// The interval in which the nearest hit must lie, computed in double precision: between the nearest hit that rounding
/// could produce and the nearest that it cannot lose.
pub(super) fn bracket(soup: &Soup, ray: &Ray<f32>) -> (f64, f64) {
    let origin = DVec3::new(ray.origin.x.into(), ray.origin.y.into(), ray.origin.z.into());
    let direction = DVec3::new(ray.direction.x.into(), ray.direction.y.into(), ray.direction.z.into());
    let (mut possible, mut sure) = (f64::INFINITY, f64::INFINITY);
    let mut consider = |low: f64, high: f64, certain: bool| {
        if high > f64::from(ray.t_min) && low <= f64::from(ray.t_max) {
            possible = possible.min(low);
        }
        if certain && low > f64::from(ray.t_min) && high <= f64::from(ray.t_max) {
            sure = sure.min(high);
        }
    };
    let mut place = |matrix: Option<&DAffine3>,
                     triangles: std::ops::Range<usize>,
                     spheres: std::ops::Range<usize>| {
        for id in triangles {
            let corners = soup.corners(id).map(|c| c.as_dvec3());
            let [a, b, c] = matrix.map_or(corners, |m| corners.map(|c| m.transform_point3(c)));
            let reach = [origin, a, b, c].iter().map(|p| p.length()).fold(0.0, f64::max);
            let error = 8.0 * f64::from(f32::EPSILON) * reach * matrix.map_or(1.0, |_| 16.0);
            let (e1, e2) = (b - a, c - a);
            let normal = e1.cross(e2);
            let determinant = -normal.dot(direction);
            // The height of the triangle over its longest edge, as seen along the ray.
            let longest = e1.length().max(e2.length()).max((c - b).length());
            let height = determinant.abs() / longest;
            let margin = error / height;
            let s = origin - a;
            let (u, v) = (direction.dot(e2.cross(s)) / determinant, direction.dot(s.cross(e1)) / determinant);
            let t = s.dot(normal) / determinant;
            let least = u.min(v).min(1.0 - u - v);
            let slack = error * normal.length() / determinant.abs();
            if margin.is_nan() || margin > 0.1 {
                consider(f64::NEG_INFINITY, f64::INFINITY, false);
            } else if least > -margin {
                consider(t - slack, t + slack, least > margin);
            }
        }
        for id in spheres {
            let [x, y, z, radius] = soup.spheres[id].map(f64::from);
            let inverse = matrix.map(|m| m.inverse());
            let o = inverse.map_or(origin, |m| m.transform_point3(origin)) - DVec3::new(x, y, z);
            let d = inverse.map_or(direction, |m| m.transform_vector3(direction));
            let reach = o.length() + radius + DVec3::new(x, y, z).length();
            let error = 32.0 * f64::from(f32::EPSILON) * reach * matrix.map_or(1.0, |_| 16.0);
            let roots = |radius: f64| {
                let (a, b) = (d.dot(d), o.dot(d));
                let discriminant = b * b - a * (o.dot(o) - radius * radius);
                (discriminant >= 0.0).then(|| [-1.0, 1.0].map(|s| (-b + s * discriminant.sqrt()) / a))
            };
            let (small, large) = (roots((radius - error).max(0.0)), roots(radius + error));
            if let Some([near, far]) = large {
                match small {
                    Some([inner_near, inner_far]) => {
                        consider(near, inner_near, true);
                        consider(inner_far, far, true);
                    }
                    None => consider(near, far, false),
                }
            }
        }
    };
    let [t, s] = soup.world;
    place(None, 0..t, 0..s);
    for matrix in &soup.placed {
        place(Some(matrix), t..soup.triangles.len(), s..soup.spheres.len());
    }
    (possible, sure)
}
