//! Procedural textures: patterns at many points, filtered over the rays' footprints.

mod noise;
mod ramp;

use self::noise::{noise, octaves_of, voronoi};
use super::texture_lookup::{Coordinates, Texel, texel};
use crate::math::{Color, Vector};
use crate::scene::Textures;
use crate::scene::procedures::{DEEPEST, NoiseKind, Operation, PatternFunction, PatternStep, TextureStep};
use crate::scene::textures::SampledTexture;
use crate::simd::Float;

/// Patterns are cut where a surface lies in a plane between two cells, in which rounding would choose: the cut is moved
/// by this part of a cell.
const ASIDE: f32 = 1e-4;
/// The least footprint that is filtered, in cells.
const NARROW: f32 = 1e-3;

#[inline(always)]
fn opaque<F: Float>(color: Color<F>) -> Texel<F> {
    Texel { color, alpha: F::one() }
}

/// Evaluates a program.
#[inline(always)]
pub(super) fn evaluate<F: Float>(
    textures: &Textures,
    sampled: &SampledTexture,
    at: &Coordinates<F>,
    mask: F::Mask,
) -> Texel<F> {
    let [first, end] = sampled.program;
    let mut stack = [opaque(Color::black()); DEEPEST];
    let mut top = 0;
    for step in &textures.steps[first as usize..end as usize] {
        match step {
            TextureStep::Constant(color) => {
                stack[top] = opaque(Color::splat((*color).into()));
                top += 1;
            }
            TextureStep::Image(texture) => {
                let sampled = &textures.sampled[*texture as usize];
                let image = texel(textures, sampled, at, mask);
                let factor = Color::splat(sampled.factor.into());
                stack[top] = Texel { color: image.color * factor, ..image };
                top += 1;
            }
            TextureStep::Vertex => {
                stack[top] = at.vertex;
                top += 1;
            }
            TextureStep::VertexChannel(channel) => {
                let number = at.vertex.channel(*channel);
                stack[top] = opaque(Color::new(number, number, number));
                top += 1;
            }
            TextureStep::Pattern(step) => {
                let (value, width) = pattern(step, at, mask);
                let stops = &textures.stops[step.ramp.first as usize..][..step.ramp.count as usize];
                stack[top] = opaque(ramp::mean(stops, step.ramp.wrap, value, width, mask));
                top += 1;
            }
            TextureStep::Ramp(ramp) => {
                let stops = &textures.stops[ramp.first as usize..][..ramp.count as usize];
                let value = stack[top - 1].color.r;
                stack[top - 1] = opaque(ramp::mean(stops, ramp.wrap, value, F::zero(), mask));
            }
            TextureStep::Mix { channel, factor } => {
                let weight = stack[top - 1].channel(*channel) * F::splat(*factor);
                top -= 2;
                stack[top - 1] = stack[top - 1].mix(stack[top], weight.clamp(0.0, 1.0));
            }
            TextureStep::Combine(operation) => {
                top -= 1;
                stack[top - 1] = combined(*operation, stack[top - 1], stack[top]);
            }
        }
    }
    stack[0]
}

#[inline(always)]
fn combined<F: Float>(operation: Operation, a: Texel<F>, b: Texel<F>) -> Texel<F> {
    let (x, y) = (a.color, b.color);
    let color = match operation {
        Operation::Add => x + y,
        // No material takes negative values.
        Operation::Subtract => maxima(x - y, Color::black()),
        Operation::Multiply => x * y,
        Operation::Min => Color::new(x.r.min(y.r), x.g.min(y.g), x.b.min(y.b)),
        Operation::Max => maxima(x, y),
    };
    Texel { color, alpha: a.alpha }
}

#[inline(always)]
fn maxima<F: Float>(x: Color<F>, y: Color<F>) -> Color<F> {
    Color::new(x.r.max(y.r), x.g.max(y.g), x.b.max(y.b))
}

#[inline(always)]
fn along<F: Float>(row: [f32; 4], v: Vector<F>) -> F {
    v.x * F::splat(row[0]) + v.y * F::splat(row[1]) + v.z * F::splat(row[2])
}

/// A coordinate of a pattern. Beyond a million cells a float has no bits left for the place within one.
#[inline(always)]
fn coordinate<F: Float>(row: [f32; 4], place: Vector<F>) -> F {
    (along(row, place) + F::splat(row[3])).clamp(-1e6, 1e6)
}

/// The extent of a footprint along a coordinate.
#[inline(always)]
fn extent<F: Float>(row: [f32; 4], diameters: [Vector<F>; 2]) -> F {
    let (a, b) = (along(row, diameters[0]), along(row, diameters[1]));
    (a * a + b * b).min(F::splat(1e12)).sqrt()
}

#[inline(always)]
fn flat<F: Float>((u, v): (F, F)) -> Vector<F> {
    Vector::new(u, v, F::zero())
}

/// The value of a pattern, and the width of the range of its values in the footprint.
#[inline(always)]
fn pattern<F: Float>(step: &PatternStep, at: &Coordinates<F>, mask: F::Mask) -> (F, F) {
    let is_flat = step.space < 2;
    let (mut place, mut diameters) = (at.object, at.object_footprint);
    if is_flat {
        let set = step.space as usize;
        let [a, b] = at.footprint[set].axes;
        (place, diameters) = (flat(at.uv[set]), [flat(a), flat(b)]);
    }
    let [x, y, z] = step.matrix;
    let p = Vector::new(coordinate(x, place), coordinate(y, place), coordinate(z, place));
    let size = Vector::new(extent(x, diameters), extent(y, diameters), extent(z, diameters));
    let widest = size.x.max(size.y).max(size.z);
    let aside = F::splat(if is_flat { 0.0 } else { ASIDE });
    match step.pattern {
        PatternFunction::Checker => {
            let mut sign = alternating(p.x + aside, size.x) * alternating(p.y + aside, size.y);
            if !is_flat {
                sign = sign * alternating(p.z + aside, size.z);
            }
            (F::splat(0.5) - sign * F::splat(0.5), F::zero())
        }
        PatternFunction::Gradient => (p.x, size.x),
        PatternFunction::Bricks { length, mortar } => {
            let row = (p.y + aside).floor();
            let odd = row - (row * F::splat(0.5)).floor() * F::splat(2.0);
            let x = p.x + aside + odd * F::splat(0.5 * length);
            let across = pulses(p.y + aside, size.y, 1.0, mortar);
            (across * pulses(x, size.x, length, mortar), F::zero())
        }
        PatternFunction::Noise(kind, octaves) => {
            let (value, width) = noise(p, widest, kind, octaves, mask);
            (value.clamp(0.0, 1.0), width)
        }
        PatternFunction::Voronoi(kind, randomness) => voronoi(p, widest, kind, randomness, is_flat),
        PatternFunction::Wood(turbulence, octaves) => {
            let (moved, lost) = octaves_of(p, widest, NoiseKind::Fractal, octaves, mask);
            let ring = (p.x * p.x + p.y * p.y).sqrt();
            let width = size.x.max(size.y) + lost * F::splat(turbulence);
            (ring + moved * F::splat(turbulence), width)
        }
        PatternFunction::Marble(turbulence, octaves) => {
            let (moved, lost) = octaves_of(p, widest, NoiseKind::Fractal, octaves, mask);
            let two = F::splat(2.0);
            ((p.x + moved * F::splat(turbulence)) * two, (size.x + lost * F::splat(turbulence)) * two)
        }
    }
}

/// 1 and −1 in turn on intervals of length 1, averaged over a width.
#[inline(always)]
fn alternating<F: Float>(x: F, width: F) -> F {
    let half = width * F::splat(0.5);
    let mean =
        (alternating_integral(x + half) - alternating_integral(x - half)) / width.max(F::splat(NARROW));
    let point = F::select(within_two(x).lt(F::one()), F::one(), -F::one());
    F::select(width.gt(F::splat(NARROW)), mean, point)
}

#[inline(always)]
fn alternating_integral<F: Float>(x: F) -> F {
    let place = within_two(x);
    place.min(F::splat(2.0) - place)
}

/// The place within a period of 2.
#[inline(always)]
fn within_two<F: Float>(x: F) -> F {
    x - (x * F::splat(0.5)).floor() * F::splat(2.0)
}

/// 1 on intervals of a period, 0 on the gaps between them, averaged over a width.
#[inline(always)]
fn pulses<F: Float>(x: F, width: F, period: f32, gap: f32) -> F {
    let half = width * F::splat(0.5);
    // Whole periods cancel out, so that few bits are lost.
    let near = x - (x * F::splat(1.0 / period)).floor() * F::splat(period);
    let (from, to) = (pulses_integral(near - half, period, gap), pulses_integral(near + half, period, gap));
    let mean = (to - from) / width.max(F::splat(NARROW));
    let (start, end) = (F::splat(0.5 * gap), F::splat(period - 0.5 * gap));
    let point = F::select(near.ge(start) & near.lt(end), F::one(), F::zero());
    F::select(width.gt(F::splat(NARROW)), mean, point)
}

#[inline(always)]
fn pulses_integral<F: Float>(x: F, period: f32, gap: f32) -> F {
    let whole = (x * F::splat(1.0 / period)).floor();
    let place = x - whole * F::splat(period) - F::splat(0.5 * gap);
    whole * F::splat(period - gap) + place.clamp(0.0, period - gap)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::procedures::{Octaves, Ramp, VoronoiKind};
    use crate::shading::footprint::Footprint;

    const UNIT: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

    fn in_space(pattern: PatternFunction, space: u32) -> PatternStep {
        PatternStep { pattern, matrix: UNIT, space, ramp: Ramp { first: 0, count: 0, wrap: 1 } }
    }

    /// The value at (u, v) with a footprint of width `du` and `dv`.
    fn flat(pattern: PatternFunction, (u, v): (f32, f32), (du, dv): (f32, f32)) -> f32 {
        let footprint = Footprint { axes: [(du, 0.0), (0.0, dv)] };
        let at = Coordinates { footprint: [footprint; 2], ..Coordinates::point([(u, v); 2]) };
        super::pattern(&in_space(pattern, 0), &at, true).0
    }

    fn solid(pattern: PatternFunction, at: [f32; 3]) -> f32 {
        let at =
            Coordinates { object: Vector::new(at[0], at[1], at[2]), ..Coordinates::point([(0.0, 0.0); 2]) };
        super::pattern(&in_space(pattern, 2), &at, true).0
    }

    #[test]
    fn checkers_alternate_in_squares_and_cubes() {
        for (u, v, expected) in [(0.5, 0.5, 0.0), (1.5, 0.5, 1.0), (1.5, -0.5, 0.0), (-0.5, 0.5, 1.0)] {
            assert_eq!(flat(PatternFunction::Checker, (u, v), (0.0, 0.0)), expected, "{u} {v}");
            assert_eq!(solid(PatternFunction::Checker, [u, v, 0.5]), expected);
            assert_eq!(solid(PatternFunction::Checker, [u, v, 1.5]), 1.0 - expected);
        }
        // A surface in the plane between two layers of cubes belongs to one of them, whatever rounding does.
        for noise in [-1e-6, 0.0, 1e-6] {
            assert_eq!(solid(PatternFunction::Checker, [0.5, noise, 0.5]), 0.0);
        }
    }

    #[test]
    fn bricks_lie_in_mortar_every_other_course_shifted_by_half() {
        let bricks = PatternFunction::Bricks { length: 2.0, mortar: 0.1 };
        for (u, v, expected) in [
            (1.0, 0.5, 1.0),
            (0.02, 0.5, 0.0),
            (1.0, 0.02, 0.0),
            (1.02, 1.5, 0.0),
            (0.02, 1.5, 1.0),
            (-1.0, -3.5, 1.0),
        ] {
            assert_eq!(flat(bricks, (u, v), (0.0, 0.0)), expected, "{u} {v}");
        }
    }

    /// Footprints average as many points within them do.
    #[test]
    fn sharp_patterns_are_averaged_over_their_footprint() {
        let bricks = PatternFunction::Bricks { length: 2.0, mortar: 0.3 };
        for pattern in [PatternFunction::Checker, bricks] {
            for (at, width) in [
                ((0.3, 0.5), (0.4, 0.01)),
                ((7.9, -3.2), (1.5, 0.5)),
                ((0.1, 0.45), (3.0, 0.05)),
                ((2.0, 0.5), (9.0, 0.02)),
            ] {
                let mut sum = 0.0;
                for k in 0..100 * 100 {
                    let part = |k: i32| (k as f32 + 0.5) / 100.0 - 0.5;
                    let (u, v) = (at.0 + width.0 * part(k % 100), at.1 + width.1 * part(k / 100));
                    sum += flat(pattern, (u, v), (0.0, 0.0));
                }
                let found = flat(pattern, at, width);
                assert!(
                    (found - sum / 10_000.0).abs() < 0.03,
                    "{pattern:?} {at:?} {width:?}: {found} {}",
                    sum / 1e4
                );
            }
            // Nothing is left of the pattern far away.
            let expected = if pattern == PatternFunction::Checker { 0.5 } else { 0.7 * 1.7 / 2.0 };
            assert!((flat(pattern, (0.3, 0.3), (1000.0, 1000.0)) - expected).abs() < 0.02, "{pattern:?}");
        }
    }

    #[test]
    fn patterns_are_finite_wherever_they_are_evaluated() {
        let octaves = Octaves { count: 16, roughness: 1.0, lacunarity: 8.0 };
        let patterns = [
            PatternFunction::Checker,
            PatternFunction::Gradient,
            PatternFunction::Bricks { length: 1e-3, mortar: 1e-3 },
            PatternFunction::Noise(NoiseKind::Ridged, octaves),
            PatternFunction::Voronoi(VoronoiKind::Edges, 1.0),
            PatternFunction::Wood(100.0, octaves),
            PatternFunction::Marble(100.0, octaves),
        ];
        for pattern in patterns {
            for number in [0.0, -1.0, 1e9, -1e30, f32::INFINITY, f32::NAN] {
                assert!(solid(pattern, [number, 0.5, 2.0]).is_finite(), "{pattern:?} {number}");
                assert!(
                    flat(pattern, (number, 0.5), (number.abs(), number.abs())).is_finite(),
                    "{pattern:?} {number}"
                );
            }
        }
    }
}
