//! Rays that find unseen lamps ([`UnseenLamps`]).

use super::emitter::{cone_part, disc_density};
use crate::math::{Color, Vector};
use crate::scene::emitter_rows::{ConeRow, DirectionalRow, EmitterRow, PlanarRow, SphereRow};
use crate::scene::emitters::{Emitters, UnseenLamps, flag, kind};
use crate::scene::light_tree::{LEAF, LightTree, field};
use crate::simd::{Float, Mask};

/// The deepest stack of a walk: the tree has at most 32 levels, and at each one child waits.
const STACK: usize = 34;
/// Boxes are larger by this part of their coordinates than the lamps in them, so that rounding loses no lamp.
const MARGIN: f32 = 1.0 / 262_144.0;

/// The rays of a walk, up to a distance.
#[derive(Clone, Copy)]
pub struct LampRays<F: Float> {
    /// The points where their directions were drawn.
    pub origin: Vector<F>,
    /// Their unit directions.
    pub direction: Vector<F>,
    /// The distance at which they end.
    pub end: F,
}

/// A walk through the lamps whose boxes rays enter. Every ray meets them in the order of the tree.
pub struct LampWalk<'a, F: Float> {
    lamps: &'a UnseenLamps,
    rays: LampRays<F>,
    inverse: Vector<F>,
    stack: [(u32, F::Mask); STACK],
    height: usize,
}

impl<'a, F: Float> LampWalk<'a, F> {
    /// Begins a walk.
    #[inline(always)]
    pub fn new(lamps: &'a UnseenLamps, rays: LampRays<F>, mask: F::Mask) -> Self {
        let d = rays.direction;
        let inverse = Vector::new(inverse(d.x), inverse(d.y), inverse(d.z));
        let nobody = F::Mask::from_bits(0);
        let mut walk = Self { lamps, rays, inverse, stack: [(0, nobody); STACK], height: 0 };
        if !lamps.tree.is_empty() {
            walk.push(0, mask);
        }
        walk
    }

    /// The next emitter, and the lanes whose ray may meet it.
    #[inline(always)]
    pub fn next_lamp(&mut self) -> Option<(u32, F::Mask)> {
        while self.height > 0 {
            self.height -= 1;
            let (node, mask) = self.stack[self.height];
            let enters = mask & self.enters(&self.lamps.tree, node);
            if !enters.any() {
                continue;
            }
            let next = self.lamps.tree.nodes[node as usize][field::NEXT as usize].to_bits();
            if next & LEAF != 0 {
                return Some((self.lamps.placed[(next ^ LEAF) as usize], enters));
            }
            self.push(next + 1, enters);
            self.push(next, enters);
        }
        None
    }

    #[inline(always)]
    fn push(&mut self, node: u32, mask: F::Mask) {
        self.stack[self.height] = (node, mask);
        self.height += 1;
    }

    /// The lanes whose ray enters a node's box.
    #[inline(always)]
    fn enters(&self, tree: &LightTree, node: u32) -> F::Mask {
        let numbers = &tree.nodes[node as usize];
        let LampRays { origin: o, end, .. } = self.rays;
        let (mut near, mut far) = (F::zero(), end);
        let axes = [(o.x, self.inverse.x), (o.y, self.inverse.y), (o.z, self.inverse.z)];
        for (axis, (origin, inverse)) in axes.into_iter().enumerate() {
            let center = F::splat(numbers[field::CENTER as usize + axis]);
            let half = F::splat(numbers[field::HALF as usize + axis]);
            let half = half + (center.abs() + half + origin.abs()) * F::splat(MARGIN);
            let (middle, reach) = ((center - origin) * inverse, half * inverse.abs());
            near = near.max(middle - reach);
            far = far.min(middle + reach);
        }
        // Written so that a NaN enters.
        !near.gt(far)
    }
}

/// 1 over a component of a direction; large instead of infinite.
#[inline(always)]
fn inverse<F: Float>(component: F) -> F {
    let tiny = component.abs().lt(F::splat(1e-18));
    F::one() / F::select(tiny, F::splat(1e-18), component)
}

/// Rays at a lamp.
pub struct LampHit<F: Float> {
    /// The lanes whose ray meets the side that emits.
    pub mask: F::Mask,
    /// The distance.
    pub distance: F,
    /// The radiance that comes back along the ray.
    pub radiance: Color<F>,
}

/// Meets a lamp at a finite place: the points that `emitter::sample` draws, with the radiance that it finds there.
#[inline(always)]
pub fn meet<F: Float>(emitters: &Emitters, lamp: u32, rays: &LampRays<F>) -> LampHit<F> {
    let (what, row) = emitters.row(lamp);
    let flags = emitters.flags[lamp as usize];
    match what {
        kind::SPHERE => ball(row, flags, rays),
        _ => panel(row, flags, rays),
    }
}

/// The outside of a sphere.
#[inline(always)]
fn ball<F: Float>(row: &EmitterRow, flags: u32, rays: &LampRays<F>) -> LampHit<F> {
    let (way, radius) = (SphereRow::center::<F>(row) - rays.origin, SphereRow::radius::<F>(row));
    let along = way.dot(rays.direction);
    let aside = way - rays.direction * along;
    let half_square = radius * radius - aside.dot(aside);
    let is_outside = way.dot(way).gt(radius * radius);
    let mut radiance = SphereRow::light::<F>(row);
    if flags & flag::CONE != 0 {
        radiance = radiance * cone_part(row, -rays.direction.dot(ConeRow::axis(row)));
    }
    LampHit {
        mask: half_square.gt(F::zero()) & along.gt(F::zero()) & is_outside,
        distance: along - half_square.max(F::zero()).sqrt(),
        radiance,
    }
}

/// The front of a parallelogram or a disc.
#[inline(always)]
fn panel<F: Float>(row: &EmitterRow, flags: u32, rays: &LampRays<F>) -> LampHit<F> {
    let PlanarRow { corner, e1, e2, light } = PlanarRow::of(row);
    let cross = e1.cross(e2);
    let scale = 1.0 / cross.length_squared();
    let (normal, to_corner) = (Vector::splat(cross), Vector::splat(corner) - rays.origin);
    let slope = rays.direction.dot(normal);
    let distance = to_corner.dot(normal) / slope;
    let place = rays.direction * distance - to_corner;
    let a = place.dot(Vector::splat(e2.cross(cross) * scale));
    let b = place.dot(Vector::splat(cross.cross(e1) * scale));
    let (zero, one) = (F::zero(), F::one());
    let mut mask = slope.lt(zero) & distance.gt(zero);
    if flags & flag::ROUND != 0 {
        let half = F::splat(0.5);
        let (x, y) = (a - half, b - half);
        mask = mask & (x * x + y * y).le(F::splat(0.25));
    } else {
        mask = mask & a.ge(zero) & a.le(one) & b.ge(zero) & b.le(one);
    }
    LampHit { mask, distance, radiance: Color::splat(light) }
}

/// Meets a disc in the sky.
#[inline(always)]
pub fn meet_distant<F: Float>(emitters: &Emitters, lamp: u32, direction: Vector<F>) -> LampHit<F> {
    let row = emitters.row(lamp).1;
    // 1 − cos of the angle between unit vectors, without the loss of digits of their product.
    let between = direction - DirectionalRow::to_light(row);
    let lift = between.dot(between) * F::splat(0.5);
    let spread = DirectionalRow::spread::<F>(row);
    LampHit {
        mask: lift.le(spread),
        distance: F::splat(f32::INFINITY),
        radiance: DirectionalRow::light(row) * disc_density(spread),
    }
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::compile::light_tree::{LightBounds, build};
    use crate::math::{Aabb, Rgb, Vec3};
    use crate::sampling::Stream;
    use crate::simd::{Isa, Kernel, Lanes, dispatch};

    /// Lamps of all shapes, and their boxes.
    fn lamps(count: usize) -> Emitters {
        let (mut out, mut random) = (Emitters::default(), Stream::new(7));
        let mut boxes = Vec::new();
        for lamp in 0..count {
            let mut number = |least: f32, most: f32| random.random_range(least..most);
            let place = Vec3::new(number(-9.0, 9.0), number(-9.0, 9.0), number(-9.0, 9.0));
            let light = Rgb::new(1.0, 2.0, lamp as f32 + 1.0);
            let mut side = || Vec3::new(number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0));
            let (kind, flags, row, bounds) = if lamp % 3 == 0 {
                let row = SphereRow { center: place, radius: 0.4, light }.row();
                (kind::SPHERE, 0, row, Aabb { min: place - 0.4, max: place + 0.4 })
            } else {
                let (e1, e2) = (side(), side());
                let corners = [place, place + e1, place + e2, place + e1 + e2];
                let row = PlanarRow { corner: place, e1, e2, light }.row();
                (kind::QUAD, if lamp % 3 == 1 { flag::ROUND } else { 0 }, row, Aabb::around(corners))
            };
            out.kinds.push(kind);
            out.flags.push(flags | flag::UNSEEN);
            out.rows.push(row);
            out.unseen.placed.push(lamp as u32);
            boxes.push(LightBounds {
                bounds,
                far: false,
                power: 1.0,
                axis: Vec3::Z,
                cos_spread: -1.0,
                cos_emission: 0.0,
                two_sided: false,
                outside: 0.0,
            });
        }
        out.unseen.tree = build(&boxes);
        out
    }

    /// The radiance of all lamps on each of some rays, by the walk or one lamp after the other.
    struct Sum<'a> {
        emitters: &'a Emitters,
        rays: &'a [[f32; 6]],
        walks: bool,
    }

    impl Kernel for Sum<'_> {
        type Output = Vec<[f32; 3]>;
        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<[f32; 3]> {
            let mut out = Vec::new();
            for chunk in self.rays.chunks(<L::Queue as Float>::WIDTH) {
                let mut columns = [[0.0; 16]; 6];
                for (lane, ray) in chunk.iter().enumerate() {
                    (0..6).for_each(|axis| columns[axis][lane] = ray[axis]);
                }
                let [ox, oy, oz, dx, dy, dz] = columns.map(|column| <L::Queue as Float>::load(&column));
                let end = <L::Queue as Float>::splat(f32::INFINITY);
                let (origin, direction) = (Vector::new(ox, oy, oz), Vector::new(dx, dy, dz));
                let rays = LampRays { origin, direction, end };
                let all = <L::Queue as Float>::Mask::first(chunk.len());
                let mut sum = Color::black();
                if self.walks {
                    let mut walk = LampWalk::new(&self.emitters.unseen, rays, all);
                    while let Some((lamp, near)) = walk.next_lamp() {
                        let hit = meet(self.emitters, lamp, &rays);
                        sum = sum + Color::select(near & hit.mask, hit.radiance, Color::black());
                    }
                } else {
                    for lamp in 0..self.emitters.len() as u32 {
                        let hit = meet(self.emitters, lamp, &rays);
                        sum = sum + Color::select(all & hit.mask, hit.radiance, Color::black());
                    }
                }
                let mut lanes = [[0.0; 16]; 3];
                sum.r.store(&mut lanes[0]);
                sum.g.store(&mut lanes[1]);
                sum.b.store(&mut lanes[2]);
                out.extend((0..chunk.len()).map(|lane| [0, 1, 2].map(|channel: usize| lanes[channel][lane])));
            }
            out
        }
    }

    #[test]
    fn walk_finds_all_lamps_in_any_number_of_lanes() {
        for count in [1, 2, 3, 100] {
            let (emitters, mut random) = (lamps(count), Stream::new(count as u64));
            let rays: Vec<[f32; 6]> = (0..4001)
                .map(|i| {
                    let mut number = || random.random_range(-1.0f32..1.0);
                    let mut direction = Vec3::new(number(), number(), number());
                    // Some rays are parallel to axes.
                    if i % 5 == 0 {
                        direction = [Vec3::X, Vec3::NEG_Y, Vec3::Z][i % 3];
                    }
                    let origin = Vec3::new(number(), number(), number()) * 9.0;
                    let direction = direction.normalize();
                    [origin.x, origin.y, origin.z, direction.x, direction.y, direction.z]
                })
                .collect();
            let all = Isa::available().into_iter().map(|isa| {
                [true, false].map(|walks| dispatch(isa, Sum { emitters: &emitters, rays: &rays, walks }))
            });
            let all: Vec<_> = all.flatten().collect();
            let met = all[0].iter().filter(|sum| sum[0] > 0.0).count();
            assert!(2 * met > count, "{count} lamps: {met} rays");
            // The order of the sums differs between both ways, but these are sums of whole numbers.
            assert!(all.iter().all(|sums| *sums == all[0]), "{count} lamps");
        }
    }
}
