//! Light sampling: samples points of emitters as seen from a point, and computes their radiance and sampling density.

use super::photometric::profile_towards;
use super::point::{Tables, coverage};
use super::solid_angle::SphericalPolygon;
use super::surface::{HitLanes, normalize_or, sphere_uv};
use super::texture_coordinates::point_coordinates;
use super::texture_lookup::color;
use super::{environment, principled::shading_frame::ShadingFrame};
use crate::bvh::layout::sidedness::SPHERE;
use crate::math::elementary::sin_cos_turns;
use crate::math::{Color, NONE, Vector};
use crate::sampling::warp::concentric_disk;
use crate::scene::CompiledScene;
use crate::scene::emitter_rows::{
    ConeRow, DirectionalRow, GatheredRows, PhotometricRow, PlanarRow, PointRow, RowLanes, SphereRow,
};
use crate::scene::emitters::{flag, kind};
use crate::simd::{Float, Int, Mask};

/// A point of an emitter as seen from another point.
#[derive(Clone, Copy)]
pub struct EmitterSample<F: Float> {
    /// Unit vector towards the point.
    pub direction: Vector<F>,
    /// Distance to the point.
    pub distance: F,
    /// Radiance of the point; irradiance for an emitter without extent.
    pub radiance: Color<F>,
    /// Density per steradian; 1 for an emitter without extent.
    pub pdf: F,
    /// Set if rays can also hit the emitter, so that MIS applies.
    pub can_be_hit: F::Mask,
}

/// Shadow rays end at this fraction of the distance to their light, so that a surface in which the light lies does not
/// block them. (The light's own surface never does: see `integrator::any_hit`.)
pub const SHADOW_END: f32 = 1.0 - 1.0 / 131_072.0;

/// Samples a point of an emitter.
#[inline(always)]
pub fn sample<F: Float>(
    scene: &CompiledScene,
    emitter: F::Int,
    position: Vector<F>,
    u: (F, F),
    mask: F::Mask,
) -> EmitterSample<F> {
    let table = &scene.emitters;
    let what = F::Int::gather(&table.kinds, emitter, mask);
    let flags = F::Int::gather(&table.flags, emitter, mask);
    let up = Vector::new(F::zero(), F::zero(), F::one());
    let mut out = EmitterSample {
        direction: up,
        distance: F::splat(f32::INFINITY),
        radiance: Color::black(),
        pdf: F::one(),
        can_be_hit: has(flags, flag::VISIBLE | flag::UNSEEN),
    };
    let row = GatheredRows::new(&table.rows, emitter, mask);
    let quad = what.eq(F::Int::splat(kind::QUAD)) & mask;
    let triangle = what.eq(F::Int::splat(kind::TRIANGLE)) & mask;
    let round = what.eq(F::Int::splat(kind::SPHERE)) & mask;
    let spot = what.eq(F::Int::splat(kind::SPOT)) & mask;
    let photometric = what.eq(F::Int::splat(kind::PHOTOMETRIC)) & mask;
    let point = spot | photometric | (what.eq(F::Int::splat(kind::POINT)) & mask);
    let parallel = what.eq(F::Int::splat(kind::DIRECTIONAL)) & mask;
    let around = what.eq(F::Int::splat(kind::ENVIRONMENT)) & mask;
    let planar = triangle | quad;
    let patterned = has(flags, flag::TEXTURED) | has(flags, flag::COVERED);
    if planar.any() {
        let (mut sample, (u, v)) =
            planar_sample(&row, triangle, flags, PointMeasure::SolidAngle, position, u);
        let patterned = patterned & planar;
        if patterned.any() {
            let primitive = F::Int::gather(&table.primitive, emitter, patterned);
            let hit = HitLanes { t: F::zero(), u, v, primitive, instance: F::Int::splat(NONE) };
            let emits = sample.radiance.max_component().gt(F::zero()) & patterned;
            let light = patterned_light(scene, emitter, &hit, (u, v), patterned);
            let light = Color::select(emits, light, Color::black());
            sample.radiance = Color::select(patterned, light, sample.radiance);
        }
        out = out.replaced(planar, sample);
    }
    if round.any() {
        let (mut sample, normal) = sphere_sample(&row, flags, position, u);
        let patterned = patterned & round;
        if patterned.any() {
            let primitive = F::Int::gather(&table.primitive, emitter, patterned);
            let uv = sphere_uv(&scene.geometry, primitive ^ F::Int::splat(SPHERE), normal, patterned);
            let hit = HitLanes { t: F::zero(), u: uv.0, v: uv.1, primitive, instance: F::Int::splat(NONE) };
            let emits = sample.radiance.max_component().gt(F::zero()) & patterned;
            let light = patterned_light(scene, emitter, &hit, uv, patterned);
            let light = Color::select(emits, light, Color::black());
            sample.radiance = Color::select(patterned, light, sample.radiance);
        }
        out = out.replaced(round, sample);
    }
    let coned = has(flags, flag::CONE) & round;
    if coned.any() {
        let part = cone_part(&row, -out.direction.dot(ConeRow::axis(&row)));
        out.radiance = out.radiance * F::select(coned, part, F::one());
    }
    if point.any() {
        let mut sample = point_sample(&row, spot, position);
        if photometric.any() {
            let profile = F::Int::gather(&table.profile, emitter, photometric);
            let axes = [PhotometricRow::axis(&row), PhotometricRow::across(&row)];
            let part = profile_towards(&scene.textures, profile, axes, sample.direction, photometric);
            let part = part * PhotometricRow::scale::<F>(&row);
            sample.radiance = Color::select(photometric, sample.radiance * part, sample.radiance);
        }
        out = out.replaced(point, sample);
    }
    if parallel.any() {
        out = out.replaced(parallel, parallel_sample(&row, u));
    }
    if around.any() {
        let (direction, pdf) = environment::sample(&scene.environment, u, mask);
        let sample = EmitterSample {
            direction,
            distance: F::splat(f32::INFINITY),
            radiance: environment::radiance(&scene.environment, direction, mask),
            pdf,
            can_be_hit: out.can_be_hit,
        };
        out = out.replaced(around, sample);
    }
    out
}

/// Samples a point of a light entity, the same light in all lanes. The points of a pattern are uniform by area on the
/// light itself.
#[inline(always)]
pub fn sample_light<F: Float>(
    scene: &CompiledScene,
    emitter: u32,
    position: Vector<F>,
    u: (F, F),
) -> EmitterSample<F> {
    let table = &scene.emitters;
    let row = &table.rows[emitter as usize];
    let flags = F::Int::splat(table.flags[emitter as usize]);
    let (nowhere, everywhere) = (F::Mask::from_bits(0), F::Mask::from_bits(u32::MAX));
    match table.kinds[emitter as usize] {
        kind::QUAD => planar_sample(row, nowhere, flags, PointMeasure::Area, position, u).0,
        kind::POINT => point_sample(row, nowhere, position),
        kind::SPOT => point_sample(row, everywhere, position),
        kind::PHOTOMETRIC => {
            let sample = point_sample(row, nowhere, position);
            let profile = F::Int::splat(table.profile[emitter as usize]);
            let axes = [PhotometricRow::axis(row), PhotometricRow::across(row)];
            let part = profile_towards(&scene.textures, profile, axes, sample.direction, everywhere);
            let part = part * PhotometricRow::scale::<F>(row);
            EmitterSample { radiance: sample.radiance * part, ..sample }
        }
        _ => parallel_sample(row, u),
    }
}

/// The emitter whose surface was hit, or [`NONE`].
#[inline(always)]
pub fn of_hit<F: Float>(scene: &CompiledScene, hit: &HitLanes<F>, mask: F::Mask) -> F::Int {
    let (table, none) = (&scene.emitters, F::Int::splat(NONE));
    if table.of_primitive.is_empty() {
        return none;
    }
    // Spheres follow the triangles.
    let sphere = F::Int::splat(SPHERE);
    let is_sphere = !(hit.primitive & sphere).eq(F::Int::splat(0));
    let behind = (hit.primitive ^ sphere) + F::Int::splat(scene.geometry.world_triangles);
    let mut place = F::Int::select(is_sphere, behind, hit.primitive);
    let mut first = F::Int::splat(0);
    let mut known = mask & hit.instance.eq(none);
    let placed = mask & !known;
    if placed.any() && !table.instance_first.is_empty() {
        let begin = F::Int::gather(&table.instance_first, hit.instance, placed);
        let lit = placed & !begin.eq(none);
        let offset = F::Int::gather(&table.instance_places, hit.instance, lit);
        place = F::Int::select(lit, hit.primitive + offset, place);
        first = F::Int::select(lit, begin, first);
        known = known | lit;
    }
    let entry = F::Int::gather(&table.of_primitive, place, known);
    F::Int::select(known & !entry.eq(none), entry + first, none)
}

/// The density per steradian with which [`sample`] draws the point of an emitter that a ray along `direction` hits at
/// distance `t`; 0 for points that it never draws.
#[inline(always)]
pub fn pdf<F: Float>(
    scene: &CompiledScene,
    emitter: F::Int,
    position: Vector<F>,
    direction: Vector<F>,
    t: F,
    mask: F::Mask,
) -> F {
    let table = &scene.emitters;
    let what = F::Int::gather(&table.kinds, emitter, mask);
    let row = GatheredRows::new(&table.rows, emitter, mask);
    let sphere = what.eq(F::Int::splat(kind::SPHERE)) & mask;
    let triangle = what.eq(F::Int::splat(kind::TRIANGLE));
    let (e1, e2) = (PlanarRow::e1(&row), PlanarRow::e2(&row));
    let disc = has(F::Int::gather(&table.flags, emitter, mask), flag::ROUND);
    let part = part_of(triangle, disc);
    let mut pdf = planar_pdf(e1.cross(e2), part, direction, t);
    // A sphere's centre is where others have a corner.
    let first = PlanarRow::corner(&row) - position;
    let near = is_near(first, e1, e2) & mask & !sphere & !disc;
    if near.any() {
        let angle = SphericalPolygon::new(first, e1, e2, triangle).solid_angle();
        pdf = F::select(near, F::one() / angle.max(F::splat(1e-30)), pdf);
    }
    if sphere.any() {
        let radius = SphereRow::radius(&row);
        let per_steradian = F::splat(0.5 / std::f32::consts::PI) / cone(first, radius);
        // From outside, only the near side of a sphere is sampled.
        let outside = first.dot(first).gt(radius * radius);
        let far_side = outside & t.gt(direction.dot(first));
        pdf = F::select(sphere, F::select(far_side, F::zero(), per_steradian), pdf);
    }
    let distant = what.eq(F::Int::splat(kind::DIRECTIONAL)) & mask;
    if distant.any() {
        pdf = F::select(distant, disc_density(DirectionalRow::spread(&row)), pdf);
    }
    pdf
}

impl<F: Float> EmitterSample<F> {
    #[inline(always)]
    fn replaced(self, mask: F::Mask, by: Self) -> Self {
        Self {
            direction: Vector::select(mask, by.direction, self.direction),
            distance: F::select(mask, by.distance, self.distance),
            radiance: Color::select(mask, by.radiance, self.radiance),
            pdf: F::select(mask, by.pdf, self.pdf),
            can_be_hit: self.can_be_hit,
        }
    }
}

/// The lanes whose flags contain one of the bits.
#[inline(always)]
fn has<I: Int>(flags: I, bits: u32) -> I::Mask {
    !(flags & I::splat(bits)).eq(I::splat(0))
}

/// The fraction of a parallelogram's area that its triangle or its disc covers.
#[inline(always)]
fn part_of<F: Float>(triangle: F::Mask, disc: F::Mask) -> F {
    let rest = F::select(disc, F::splat(std::f32::consts::FRAC_PI_4), F::one());
    F::select(triangle, F::splat(0.5), rest)
}

/// The density per steradian of area sampling: d² / (A |cos|), with A = `part` |e₁ × e₂|.
#[inline(always)]
fn planar_pdf<F: Float>(cross: Vector<F>, part: F, direction: Vector<F>, distance: F) -> F {
    let seen = cross.dot(direction).abs() * part;
    distance * distance / seen.max(F::splat(1e-30))
}

/// Tests if a triangle or a parallelogram, with a `corner` relative to the viewer, is sampled by solid angle: its edges
/// are at least a fifth as long as its distance. Farther ones have a nearly uniform density, and area sampling is
/// cheaper.
#[inline(always)]
fn is_near<F: Float>(corner: Vector<F>, e1: Vector<F>, e2: Vector<F>) -> F::Mask {
    let middle = corner + (e1 + e2) * F::splat(0.5);
    (e1.dot(e1) + e2.dot(e2)).gt(middle.dot(middle) * F::splat(0.04))
}

/// The measure in which sampled points are uniform.
#[derive(Clone, Copy)]
enum PointMeasure {
    Area,
    /// Only for emitters that are near; others are sampled by area.
    SolidAngle,
}

/// The coordinates along both edges, as fractions from the corner, of a point of a triangle, a parallelogram or a disc:
/// uniform by area.
#[inline(always)]
pub(super) fn planar_place<F: Float>(triangle: F::Mask, disc: F::Mask, u: (F, F)) -> (F, F) {
    // Low-distortion map from the square to the triangle (Heitz 2019).
    let half = F::splat(0.5);
    let upper = u.1.gt(u.0);
    let a = F::select(upper, u.0 * half, u.0 - u.1 * half);
    let b = F::select(upper, u.1 - u.0 * half, u.1 * half);
    let (mut a, mut b) = (F::select(triangle, a, u.0), F::select(triangle, b, u.1));
    if disc.any() {
        let (x, y) = concentric_disk(u.0, u.1);
        (a, b) = (F::select(disc, x * half + half, a), F::select(disc, y * half + half, b));
    }
    (a, b)
}

/// Samples a triangle, a parallelogram or a disc; also returns the point's coordinates along the edges.
#[inline(always)]
fn planar_sample<F: Float>(
    row: &impl RowLanes<F>,
    triangle: F::Mask,
    flags: F::Int,
    measure: PointMeasure,
    position: Vector<F>,
    u: (F, F),
) -> (EmitterSample<F>, (F, F)) {
    let disc = has(flags, flag::ROUND);
    let (mut a, mut b) = planar_place(triangle, disc, u);
    let (e1, e2) = (PlanarRow::e1(row), PlanarRow::e2(row));
    let corner = PlanarRow::corner(row) - position;
    let near = match measure {
        PointMeasure::SolidAngle => is_near(corner, e1, e2) & !disc,
        PointMeasure::Area => F::Mask::from_bits(0),
    };
    let mut angle = F::zero();
    if near.any() {
        let fan = SphericalPolygon::new(corner, e1, e2, triangle);
        let of_fan = fan.sample(u);
        (a, b) = (F::select(near, of_fan.0, a), F::select(near, of_fan.1, b));
        angle = fan.solid_angle().max(F::splat(1e-30));
    }
    let way = corner + e1 * a + e2 * b;
    let square = way.dot(way).max(F::splat(1e-30));
    let distance = square.sqrt();
    let direction = way * (F::one() / distance);
    let cross = e1.cross(e2);
    let facing = cross.dot(direction);
    let facing = F::select(has(flags, flag::REVERSED), -facing, facing);
    let emits = has(flags, flag::TWO_SIDED) | facing.lt(F::zero());
    let by_area = planar_pdf(cross, part_of(triangle, disc), direction, distance);
    let sample = EmitterSample {
        direction,
        distance,
        radiance: Color::select(emits, PlanarRow::light(row), Color::black()),
        pdf: F::select(near, F::one() / angle, by_area),
        can_be_hit: F::Mask::from_bits(0),
    };
    (sample, (a, b))
}

/// The radiance at points of surfaces whose emission or coverage has a texture, one material at a time. `uv` are the
/// coordinates of spheres.
#[inline(always)]
pub(super) fn patterned_light<F: Float>(
    scene: &CompiledScene,
    emitter: F::Int,
    hit: &HitLanes<F>,
    uv: (F, F),
    mask: F::Mask,
) -> Color<F> {
    let tables = Tables { geometry: &scene.geometry, textures: &scene.textures };
    let at = point_coordinates(&scene.geometry, hit, uv, mask);
    let material = F::Int::gather(&scene.emitters.material, emitter, mask);
    let mut light = Color::black();
    let mut todo = mask;
    while todo.any() {
        let first = lane(material, todo);
        let same = material.eq(F::Int::splat(first)) & todo;
        let record = &scene.materials[first as usize];
        let there = coverage(record, tables, hit, &at, same);
        light = Color::select(same, color(&record.emission, &scene.textures, &at, same) * there, light);
        todo = todo & !same;
    }
    light
}

/// The value of a mask's first lane.
#[inline(always)]
pub fn lane<I: Int>(values: I, mask: I::Mask) -> u32 {
    let mut lanes = [0; 16];
    values.store(&mut lanes);
    lanes[(mask.bits().trailing_zeros() & 15) as usize]
}

/// 1 − cosine of the half angle that a sphere subtends; 2 (all directions) from inside.
#[inline(always)]
fn cone<F: Float>(way: Vector<F>, radius: F) -> F {
    let square = way.dot(way);
    let ratio = radius / square.sqrt().max(F::splat(1e-30));
    let sin2 = (ratio * ratio).min(F::one());
    let cos = (F::one() - sin2).max(F::zero()).sqrt();
    // 1 − √(1 − s) would lose all digits for small s.
    let part = sin2 / (F::one() + cos);
    let within = square.le(radius * radius);
    F::select(within, F::splat(2.0), part).max(F::splat(1e-30))
}

/// Samples a sphere uniformly over the cone that it subtends (PBRT 4th ed., 6.2.4); also returns the sphere's normal.
///
/// All computations are in the frame about the direction to the centre, where a sphere's size is not lost beside its
/// distance: relative to the centre, the point of the ray nearest to it is d sin θ (cos θ cos φ, cos θ sin φ, −sin θ).
#[inline(always)]
fn sphere_sample<F: Float>(
    row: &impl RowLanes<F>,
    flags: F::Int,
    position: Vector<F>,
    u: (F, F),
) -> (EmitterSample<F>, Vector<F>) {
    let (center, radius) = (SphereRow::center(row), SphereRow::radius(row));
    let way = center - position;
    let part = cone(way, radius);
    let lift = part * u.0;
    let cos = F::one() - lift;
    let sin2 = (lift * (F::splat(2.0) - lift)).max(F::zero());
    let sin = sin2.sqrt();
    let (s, c) = sin_cos_turns(u.1);
    let up = Vector::new(F::zero(), F::zero(), F::one());
    let frame = ShadingFrame::about(normalize_or(way, up));
    let local = Vector::new(sin * c, sin * s, cos);
    let direction = frame.world(local);
    let away = way.dot(way).sqrt();
    let (along, nearest) = (away * cos, Vector::new(cos * c, cos * s, -sin) * (away * sin));
    let half = (radius * radius - nearest.dot(nearest)).max(F::zero()).sqrt();
    let before = (along - half).gt(F::zero());
    let half = F::select(before, -half, half);
    let emits = has(flags, flag::TWO_SIDED) | way.dot(way).gt(radius * radius);
    let sample = EmitterSample {
        direction,
        distance: (along + half).max(F::zero()),
        radiance: Color::select(emits, SphereRow::light(row), Color::black()),
        pdf: F::splat(0.5 / std::f32::consts::PI) / part,
        can_be_hit: F::Mask::from_bits(0),
    };
    (sample, normalize_or(frame.world(nearest + local * half), up))
}

/// The part of a spotlight's light that it emits at an angle to its axis, by the cosine.
#[inline(always)]
pub(super) fn cone_part<F: Float>(row: &impl RowLanes<F>, cos: F) -> F {
    let t = ((cos - ConeRow::cos_outer(row)) * ConeRow::scale(row)).clamp(0.0, 1.0);
    let smoother = F::splat(3.0) - t * F::splat(2.0);
    t * t * F::select(ConeRow::smoothness(row).gt(F::zero()), smoother, F::one())
}

/// Light from a point, restricted to a cone for spotlights.
#[inline(always)]
fn point_sample<F: Float>(row: &impl RowLanes<F>, spot: F::Mask, position: Vector<F>) -> EmitterSample<F> {
    let way = PointRow::position(row) - position;
    let square = way.dot(way).max(F::splat(1e-30));
    let distance = square.sqrt();
    let direction = way * (F::one() / distance);
    let falls = PointRow::falls(row).gt(F::zero());
    let mut light = PointRow::light(row) * F::select(falls, F::one() / square, F::one());
    if spot.any() {
        let part = cone_part(row, -direction.dot(ConeRow::axis(row)));
        light = light * F::select(spot, part, F::one());
    }
    EmitterSample { direction, distance, radiance: light, pdf: F::one(), can_be_hit: F::Mask::from_bits(0) }
}

/// Parallel light, or light from a disk in the sky.
#[inline(always)]
fn parallel_sample<F: Float>(row: &impl RowLanes<F>, u: (F, F)) -> EmitterSample<F> {
    let axis = DirectionalRow::to_light(row);
    let spread = DirectionalRow::spread(row);
    let lift = spread * u.0;
    let (s, c) = sin_cos_turns(u.1);
    let sin = (lift * (F::splat(2.0) - lift)).max(F::zero()).sqrt();
    let direction = ShadingFrame::about(axis).world(Vector::new(sin * c, sin * s, F::one() - lift));
    let pdf = F::select(spread.gt(F::zero()), disc_density(spread), F::one());
    EmitterSample {
        direction,
        distance: F::splat(f32::INFINITY),
        radiance: DirectionalRow::light(row) * pdf,
        pdf,
        can_be_hit: F::Mask::from_bits(0),
    }
}

/// 1 over the solid angle of a disc in the sky, by its spread.
#[inline(always)]
pub(super) fn disc_density<F: Float>(spread: F) -> F {
    F::splat(0.5 / std::f32::consts::PI) / spread.max(F::splat(1e-30))
}
