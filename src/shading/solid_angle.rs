//! Samples triangles and parallelograms uniformly by solid angle.
//!
//! Arvo, "Stratified Sampling of Spherical Triangles" (SIGGRAPH 1995), in the form of half angles (Peters, "BRDF
//! Importance Sampling for Polygonal Lights", SIGGRAPH 2021), which is accurate for small ones. For the same reason,
//! samples are coordinates along the edges, not directions.

use crate::math::Vector;
use crate::math::elementary::{atan2_turns, sin_cos_turns};
use crate::simd::Float;

/// A triangle or a parallelogram seen from a point, the eye: one or two triangles around its first corner, the apex.
pub struct SphericalPolygon<F: Float> {
    apex: Corner<F>,
    /// The other corners, in order. The last two are equal for a triangle.
    around: [Corner<F>; 3],
    /// |apex · (e₁ × e₂)|: six times the volume between the eye and either triangle.
    volume: F,
    /// The solid angles of both triangles in steradians; the second is 0 for a triangle.
    solid_angles: [F; 2],
}

/// A corner relative to the eye.
#[derive(Clone, Copy)]
struct Corner<F: Float> {
    way: Vector<F>,
    distance: F,
    /// Coordinates along the two edges.
    at: (F, F),
}

impl<F: Float> SphericalPolygon<F> {
    /// The polygon with a `corner` relative to the eye and two edges.
    #[inline(always)]
    pub fn new(corner: Vector<F>, e1: Vector<F>, e2: Vector<F>, triangle: F::Mask) -> Self {
        let (zero, one) = (F::zero(), F::one());
        let apex = Corner::new(corner, (zero, zero));
        let last = Corner::new(corner + e2, (zero, one));
        let far = Corner::new(corner + e1 + e2, (one, one));
        let around = [Corner::new(corner + e1, (one, zero)), Corner::select(triangle, last, far), last];
        // Seen edge-on the volume would be 0, and it is a divisor.
        let size = apex.distance * around[0].distance * last.distance;
        let volume = corner.dot(e1.cross(e2)).abs().max(size * F::splat(1e-10) + F::splat(1e-30));
        let first = solid_angle(&apex, &around[0], &around[1], volume);
        let second = solid_angle(&apex, &around[1], &around[2], volume);
        Self { apex, around, volume, solid_angles: [first, F::select(triangle, zero, second)] }
    }

    /// The solid angle in steradians.
    #[inline(always)]
    pub fn solid_angle(&self) -> F {
        self.solid_angles[0] + self.solid_angles[1]
    }

    /// Maps a point of the unit square to a point of the polygon, as coordinates along the two edges.
    #[inline(always)]
    pub fn sample(&self, u: (F, F)) -> (F, F) {
        let (zero, one, two) = (F::zero(), F::one(), F::splat(2.0));
        let part = u.0 * self.solid_angle();
        let beyond = part.gt(self.solid_angles[0]);
        let part = F::select(beyond, part - self.solid_angles[0], part);
        let apex = self.apex;
        let from = Corner::select(beyond, self.around[1], self.around[0]);
        let to = Corner::select(beyond, self.around[2], self.around[1]);
        // The point of the far edge up to which the triangle subtends that fraction: `from` reflected about a half
        // vector h = k₀ from + k₂ to, all of length 1.
        let across = from.way.dot(to.way);
        let (with_from, with_to) = (apex.way.dot(from.way), apex.way.dot(to.way));
        let (sin, cos) = sin_cos_turns(part * F::splat(0.25 / std::f32::consts::PI));
        let sin = sin / self.volume;
        let k0 = cos - (across * apex.distance + with_to * from.distance) * sin;
        let k2 = (apex.distance * from.distance + with_from) * to.distance * sin;
        let [of_apex, of_from, of_to] = [apex, from, to].map(|corner| one / corner.distance);
        let across = across * (of_from * of_to);
        let scale = one / (k0 * k0 + k2 * (k2 + two * k0 * across)).max(F::splat(1e-30));
        let first = (k0 - k2) * (k0 + k2) * scale * of_from;
        let second = two * k2 * (k0 + k2 * across) * scale * of_to;
        // Between the apex and that point, uniform in 1 − cos.
        let sum = apex.way * of_apex + from.way * first + to.way * second;
        let rest = sum.dot(sum) * F::splat(0.5);
        let most = two - rest;
        let lift = u.1 * most;
        let t = (u.1 * (two - lift) / rest.max(F::splat(1e-12))).max(zero).sqrt();
        let apex = ((one - t) - most * (u.1 - t)) * of_apex;
        let [apex, first, second] = [apex, t * first, t * second].map(|weight| weight.max(zero));
        let scale = one / (apex + first + second).max(F::splat(1e-30));
        let of = |a: F, b: F| ((first * a + second * b) * scale).min(one);
        (of(from.at.0, to.at.0), of(from.at.1, to.at.1))
    }
}

impl<F: Float> Corner<F> {
    #[inline(always)]
    fn new(way: Vector<F>, at: (F, F)) -> Self {
        Self { way, distance: way.dot(way).max(F::splat(1e-30)).sqrt(), at }
    }

    #[inline(always)]
    fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        Self {
            way: Vector::select(mask, yes.way, no.way),
            distance: F::select(mask, yes.distance, no.distance),
            at: (F::select(mask, yes.at.0, no.at.0), F::select(mask, yes.at.1, no.at.1)),
        }
    }
}

/// The solid angle of a triangle (Van Oosterom and Strackee 1983); `volume` is |a · (b × c)|.
#[inline(always)]
fn solid_angle<F: Float>(a: &Corner<F>, b: &Corner<F>, c: &Corner<F>, volume: F) -> F {
    let (ab, ac, bc) = (a.way.dot(b.way), a.way.dot(c.way), b.way.dot(c.way));
    let below = (a.distance * b.distance + ab) * c.distance + (ac * b.distance + bc * a.distance);
    atan2_turns(volume, below) * F::splat(4.0 * std::f32::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    const AREAS: [([Vec3; 3], bool); 7] = [
        // An octant; a square above; a slanted polygon at arm's length; a long strip to the side; a distant one; a
        // sliver; one that surrounds the eye almost completely.
        ([Vec3::X, Vec3::new(-1.0, 1.0, 0.0), Vec3::new(-1.0, 0.0, 1.0)], true),
        ([Vec3::new(-1.0, 1.0, -1.0), Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 2.0)], false),
        ([Vec3::new(0.5, 0.2, 0.1), Vec3::new(0.9, 0.0, 0.1), Vec3::new(0.3, 1.0, 0.0)], false),
        ([Vec3::new(0.1, -5.0, 0.0), Vec3::new(0.0, 10.0, 0.0), Vec3::new(3.0, 0.0, 1.0)], true),
        ([Vec3::new(60.0, 3.0, 4.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)], false),
        ([Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 4.0, 0.0), Vec3::new(0.0, 4.0, 0.01)], true),
        ([Vec3::new(-5.0, 0.1, -5.0), Vec3::new(10.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 10.0)], false),
    ];

    fn fan([corner, e1, e2]: [Vec3; 3], triangle: bool) -> SphericalPolygon<f32> {
        let [corner, e1, e2] = [corner, e1, e2].map(|v| Vector::new(v.x, v.y, v.z));
        SphericalPolygon::new(corner, e1, e2, triangle)
    }

    /// Ω and ∫ ω dΩ, by Lambert's formula for polygons: Σ angle · normal of each edge / 2.
    fn expected([corner, e1, e2]: [Vec3; 3], triangle: bool) -> (f64, glam::DVec3) {
        let corners: Vec<_> = if triangle {
            vec![corner, corner + e1, corner + e2]
        } else {
            vec![corner, corner + e1, corner + e1 + e2, corner + e2]
        };
        let corners: Vec<_> = corners.iter().map(|c| c.as_dvec3().normalize()).collect();
        let (mut vector, mut angle) = (glam::DVec3::ZERO, 0.0);
        for (i, a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            vector += a.cross(b).normalize_or_zero() * (a.angle_between(b) / 2.0);
        }
        for pair in corners[1..].windows(2) {
            let (a, [b, c]) = (corners[0], [pair[0], pair[1]]);
            let volume = a.dot(b.cross(c)).abs();
            angle += 2.0 * libm::atan2(volume, 1.0 + a.dot(b) + a.dot(c) + b.dot(c));
        }
        // Flipped towards the polygon, regardless of its orientation.
        let middle: glam::DVec3 = corners.iter().sum();
        (angle, if vector.dot(middle) < 0.0 { -vector } else { vector })
    }

    #[test]
    fn solid_angles_of_an_octant_and_of_a_cubes_side_are_exact() {
        let octant = fan(AREAS[0].0, AREAS[0].1).solid_angle();
        assert!((octant - std::f32::consts::FRAC_PI_2).abs() < 1e-6, "{octant}");
        let square = fan(AREAS[1].0, AREAS[1].1).solid_angle();
        assert!((square - 4.0 * std::f32::consts::PI / 6.0).abs() < 1e-5, "a side of a cube: {square}");
    }

    /// The eye is in the polygon's plane or at a corner: samples are still points of the polygon.
    #[test]
    fn samples_of_a_polygon_seen_edge_on_lie_within_it() {
        for eye in [Vec3::new(0.3, 0.3, 0.0), Vec3::new(3.0, 0.2, 0.0), Vec3::ZERO, Vec3::new(0.5, 0.0, 0.0)]
        {
            for (scale, triangle) in [(1e-6, true), (1.0, false), (1.0, true), (1e6, false)] {
                let fan = fan([-eye * scale, Vec3::X * scale, Vec3::Y * scale], triangle);
                assert!(fan.solid_angle() >= 0.0, "{eye} {triangle}");
                for i in 0..=64 {
                    let (a, b) = fan.sample(((i % 8) as f32 / 8.0, (i / 8) as f32 / 8.0));
                    assert!((0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b), "{eye} {scale}: {a} {b}");
                }
            }
        }
    }

    /// Compares first and second moments of directions: the first with Lambert's formula, the second with points that
    /// are uniform by area.
    #[test]
    fn samples_are_uniform_by_solid_angle() {
        const SIDE: usize = 512;
        for (area, triangle) in AREAS {
            let fan = fan(area, triangle);
            let (angle, vector) = expected(area, triangle);
            assert!((f64::from(fan.solid_angle()) / angle - 1.0).abs() < 1e-4, "{area:?}: {angle}");
            let (mut first, mut second) = (glam::DVec3::ZERO, glam::DVec3::ZERO);
            let mut by_area = (0.0, glam::DVec3::ZERO);
            let [corner, e1, e2] = area.map(Vec3::as_dvec3);
            for i in 0..SIDE * SIDE {
                let u = [(i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5].map(|x| x / SIDE as f32);
                let (a, b) = fan.sample((u[0], u[1]));
                let most = if triangle { 1.0 } else { 2.0 };
                assert!((0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b) && a + b <= most + 1e-6);
                let direction = (corner + e1 * f64::from(a) + e2 * f64::from(b)).normalize();
                first += direction;
                second += direction * direction;
                let (mut a, mut b) = (f64::from(u[0]), f64::from(u[1]));
                if triangle && a + b > 1.0 {
                    (a, b) = (1.0 - a, 1.0 - b);
                }
                let way = corner + e1 * a + e2 * b;
                let weight = way.dot(e1.cross(e2)).abs() / way.length().powi(3);
                by_area.0 += weight;
                by_area.1 += way.normalize().powf(2.0) * weight;
            }
            let count = (SIDE * SIDE) as f64;
            let off = (first / count - vector / angle).length();
            assert!(off < 1e-4, "{area:?}: mean direction off by {off}");
            let off = (second / count - by_area.1 / by_area.0).length();
            assert!(off < 3e-3, "{area:?}: squares off by {off}");
        }
    }
}
