//! The roles of hits in path reuse: whether a first vertex takes, and what a second one gives.

use crate::integrator::path::Path;
use crate::integrator::setup::reuse_groups::takes;
use crate::math::{Color, Vector};
use crate::scene::MaterialRecord;
use crate::shading::normals::is_turned;
use crate::shading::principled::albedo;
use crate::shading::principled::bsdf::Bsdf;
use crate::shading::principled::reflectance::UnderMirror;
use crate::shading::principled::sample::BsdfSample;
use crate::shading::principled::tables::MIRROR;
use crate::shading::{ShadingPoint, Surface};
use crate::simd::{Float, Int, Mask};

/// The least probability of the diffuse lobe for a first vertex that takes: below it, neighbours' paths would hardly
/// count.
const LEAST_DIFFUSE: f32 = 0.2;

/// The light that leaves a second vertex by its diffuse lobe, up to a factor: its radiance.
#[derive(Clone, Copy)]
pub struct ReusableVertex<F: Float> {
    position: Vector<F>,
    /// The geometric normal, on the side that gives.
    geometric_normal: Vector<F>,
    /// The shading normal, not turned towards the viewer.
    normal: Vector<F>,
    /// The layer above the lobe.
    above: UnderMirror<F>,
    roughness: F,
    /// The fraction of the lobe that leaves towards the viewer from which the path came.
    left: Color<F>,
    /// The lobe's fraction of what the light sample brings.
    pub light: Color<F>,
    /// The lobe's fraction of what the path finds further on.
    pub onward: Color<F>,
    /// The light of photons that leaves by the lobe.
    pub gathered: Color<F>,
}

/// The number of columns of a [`ReusableVertex`].
pub const COLUMNS: usize = 32;

impl<F: Float> ReusableVertex<F> {
    /// The vertex in columns, one for each number.
    #[inline(always)]
    pub fn columns(&self) -> [F; COLUMNS] {
        let (p, g, n) = (self.position, self.geometric_normal, self.normal);
        let UnderMirror { f0, f90, further } = self.above;
        let (left, light, onward, gathered) = (self.left, self.light, self.onward, self.gathered);
        let vectors = [p.x, p.y, p.z, g.x, g.y, g.z, n.x, n.y, n.z];
        let mut columns = [self.roughness; COLUMNS];
        columns[..9].copy_from_slice(&vectors);
        let colors = [f0, f90, further, left, light, onward, gathered];
        for (to, c) in columns[9..30].chunks_exact_mut(3).zip(colors) {
            to.copy_from_slice(&[c.r, c.g, c.b]);
        }
        columns
    }
}

impl ReusableVertex<f32> {
    /// The inverse of [`ReusableVertex::columns`].
    pub fn new(columns: &[f32; COLUMNS]) -> Self {
        let vector = |at: usize| Vector::new(columns[at], columns[at + 1], columns[at + 2]);
        let color = |at: usize| Color::new(columns[at], columns[at + 1], columns[at + 2]);
        Self {
            position: vector(0),
            geometric_normal: vector(3),
            normal: vector(6),
            above: UnderMirror { f0: color(9), f90: color(12), further: color(15) },
            left: color(18),
            light: color(21),
            onward: color(24),
            gathered: color(27),
            roughness: columns[30],
        }
    }

    /// The connection to the vertex from some points: the unit direction to it, the distance, the fraction of its
    /// radiance towards its own path that arrives there, and cos / d², which turns a density per steradian into one on
    /// its surface. Not visible from behind.
    #[inline(always)]
    pub fn seen_from<F: Float>(&self, origin: Vector<F>, mask: F::Mask) -> Connection<F> {
        let to = splat(self.position) - origin;
        let square = to.dot(to).max(F::splat(1e-30));
        let distance = square.sqrt();
        let direction = to * (F::one() / distance);
        let (geometric_normal, normal) = (splat(self.geometric_normal), splat(self.normal));
        let cos = -geometric_normal.dot(direction);
        let shading = -normal.dot(direction);
        let visible = mask & cos.gt(F::zero()) & !is_turned(normal, geometric_normal, -direction);
        let mut part = Color::new(F::one(), F::one(), F::one());
        if !self.above.is_nothing() {
            let own = albedo::directional(&MIRROR, shading, F::splat(self.roughness), visible);
            let above = self.above.splat::<F>();
            let Color { r, g, b } = self.left;
            let left = Color::new(F::splat(r.max(1e-6)), F::splat(g.max(1e-6)), F::splat(b.max(1e-6)));
            part = above.left(&own).over(left);
        }
        Connection { direction, distance, part, geometry: cos / square, visible }
    }
}

/// A second vertex, as seen from some points.
pub struct Connection<F: Float> {
    /// Unit vector to it.
    pub direction: Vector<F>,
    /// The distance to it.
    pub distance: F,
    /// The fraction that arrives of the radiance that its own path found.
    pub part: Color<F>,
    /// cos / d².
    pub geometry: F,
    /// The lanes that see it, unless something is in between.
    pub visible: F::Mask,
}

/// The roles of hits in path reuse.
pub struct ReuseRoles<F: Float> {
    /// First vertices that take.
    pub takes: F::Mask,
    /// Second vertices that give.
    pub gives: F::Mask,
    /// The light that they give.
    pub reusable: ReusableVertex<F>,
}

/// A vertex with its BSDF and its samples.
pub struct EvaluatedVertex<'a, F: Float> {
    /// The shading point.
    pub point: &'a ShadingPoint<'a, F>,
    /// The BSDF.
    pub bsdf: &'a Bsdf<F>,
    /// The direction to its light sample, and BSDF value · |cos| for it.
    pub light: (Vector<F>, Color<F>),
    /// The direction that was drawn.
    pub drawn: &'a BsdfSample<F>,
}

/// Determines the roles of hits on one material.
#[inline(always)]
pub fn roles<F: Float>(path: &Path<F>, vertex: &EvaluatedVertex<F>, mask: F::Mask) -> ReuseRoles<F> {
    let EvaluatedVertex { point, bsdf, light, drawn } = vertex;
    let (surface, record): (&Surface<F>, &MaterialRecord) = (point.surface, point.material);
    let none = F::Mask::from_bits(0);
    let first = mask & path.depth.eq(F::Int::splat(0));
    let takes = if takes(record) { first & bsdf.diffuse_chance().ge(F::splat(LEAST_DIFFUSE)) } else { none };
    let black = Color::black();
    let mut reusable = ReusableVertex {
        position: surface.position,
        geometric_normal: surface.geometric_normal,
        normal: bsdf.normal(),
        above: UnderMirror::NOTHING.splat(),
        roughness: F::zero(),
        left: black,
        light: black,
        onward: black,
        gathered: black,
    };
    let second = gives_at(path, point, mask);
    if !second.any() {
        return ReuseRoles { takes, gives: none, reusable };
    }
    (reusable.above, reusable.roughness, reusable.left) = bsdf.above_diffuse();
    reusable.light = bsdf.diffuse_part(light.0, light.1, second);
    reusable.onward = bsdf.diffuse_part(drawn.direction, drawn.weight * drawn.pdf, second);
    ReuseRoles { takes, gives: second, reusable }
}

/// The lanes whose vertices give.
#[inline(always)]
pub(in crate::integrator) fn gives_at<F: Float>(
    path: &Path<F>,
    point: &ShadingPoint<F>,
    mask: F::Mask,
) -> F::Mask {
    let second = mask & path.depth.eq(F::Int::splat(1));
    if !gives(point.material) || !second.any() {
        return F::Mask::from_bits(0);
    }
    second & !point.is_turned()
}

/// True if second vertices of a material have a diffuse lobe with nothing but a mirror lobe above it.
fn gives(record: &MaterialRecord) -> bool {
    let bare = record.coat.is_zero() && record.sheen_color.is_black() && record.film.is_none();
    takes(record) && bare && !record.is_anisotropic()
}

/// Broadcasts to all lanes.
#[inline(always)]
pub(in crate::integrator) fn splat<F: Float>(v: Vector<f32>) -> Vector<F> {
    Vector::new(F::splat(v.x), F::splat(v.y), F::splat(v.z))
}
