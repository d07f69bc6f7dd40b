//! Curves through points, as chords.

use super::Fineness;
use crate::math::DVec3;
use crate::world::Spline;

/// A point of a curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct CurvePoint {
    pub at: DVec3,
    /// A radius, or another number that goes along.
    pub radius: f64,
    /// The direction of the curve, of length 1.
    pub tangent: DVec3,
    /// The change of the radius per metre along the curve.
    pub slope: f64,
    /// The length of the chords up to here.
    pub along: f64,
}

/// A cubic span by its Bézier points, each with its radius.
pub(super) type CubicSpan = [(DVec3, f64); 4];

/// The most chords of a span that are chosen.
const MOST_CHOSEN: f64 = 256.0;
/// The cosine of the angle below which two spans meet smoothly.
const SMOOTH: f64 = 0.9998;

/// Returns a curve as chords, in parts that are smooth. Consecutive points of a closed curve, whose last point is not the
/// first one again, and of others must differ.
pub(super) fn sample(
    points: &[(DVec3, f64)],
    curve: Spline,
    closed: bool,
    segments: Option<u32>,
    fineness: Fineness,
) -> Vec<Vec<CurvePoint>> {
    chain(&spans(points, curve, closed), closed, segments, fineness)
}

/// Returns spans, each of which begins where the last one ended, as chords, in parts that are smooth.
pub(super) fn chain(
    spans: &[CubicSpan],
    closed: bool,
    segments: Option<u32>,
    fineness: Fineness,
) -> Vec<Vec<CurvePoint>> {
    let mut parts: Vec<Vec<CurvePoint>> = Vec::new();
    let mut along = 0.0;
    for span in spans {
        let chords = chords(span, segments, fineness);
        let mut part = Vec::with_capacity(chords + 1);
        for chord in 0..=chords {
            let mut point = evaluate(span, chord as f64 / chords as f64);
            let last: Option<&CurvePoint> = part.last();
            along += last.map_or(0.0, |last| (point.at - last.at).length());
            point.along = along;
            part.push(point);
        }
        match parts.last_mut() {
            Some(last) if is_smooth(last, &part) => last.extend(part.into_iter().skip(1)),
            _ => parts.push(part),
        }
    }
    // A closed curve that is smooth at its first point begins there with one direction.
    if closed
        && let [first, .., last] = &mut parts[..]
        && is_smooth(last, first)
    {
        let mut whole = std::mem::take(last);
        let length = along;
        let begin = whole.first().map_or(0.0, |point| point.along);
        whole.extend(first.iter().skip(1).map(|point| CurvePoint { along: point.along + length, ..*point }));
        whole.iter_mut().for_each(|point| point.along -= begin);
        for part in &mut parts[1..] {
            part.iter_mut().for_each(|point| point.along += length - begin);
        }
        parts[0] = whole;
        parts.pop();
    }
    parts
}

fn is_smooth(before: &[CurvePoint], after: &[CurvePoint]) -> bool {
    match (before.last(), after.first()) {
        (Some(before), Some(after)) => before.tangent.dot(after.tangent) > SMOOTH,
        _ => false,
    }
}

/// The cubic spans of a curve.
fn spans(points: &[(DVec3, f64)], curve: Spline, closed: bool) -> Vec<CubicSpan> {
    let count = points.len();
    let at = |index: usize| points[index % count];
    let blend = |a: (DVec3, f64), b: (DVec3, f64), t: f64| (a.0.lerp(b.0, t), a.1 + (b.1 - a.1) * t);
    let ends = if closed { count } else { count - 1 };
    match curve {
        Spline::Linear => {
            let line = |a, b| [a, blend(a, b, 1.0 / 3.0), blend(a, b, 2.0 / 3.0), b];
            (0..ends).map(|index| line(at(index), at(index + 1))).collect()
        }
        Spline::Bezier => {
            let span = |index: usize| [0, 1, 2, 3].map(|k| at(3 * index + k));
            (0..ends / 3).map(span).collect()
        }
        Spline::CatmullRom => {
            let mirrored = |a: (DVec3, f64), b: (DVec3, f64)| (2.0 * a.0 - b.0, 2.0 * a.1 - b.1);
            let span = |index: usize| {
                let (b, c) = (at(index), at(index + 1));
                let a = if closed || index > 0 { at(index + count - 1) } else { mirrored(b, c) };
                let d = if closed || index + 2 < count { at(index + 2) } else { mirrored(c, b) };
                catmull_rom([a, b, c, d])
            };
            (0..ends).map(span).collect()
        }
    }
}

/// The centripetal Catmull-Rom span between the second and the third of four points (Yuksel, Schaefer and Keyser, "On the
/// parameterization of Catmull-Rom curves", 2009): without loops and cusps.
fn catmull_rom([a, b, c, d]: [(DVec3, f64); 4]) -> CubicSpan {
    let [x, y, z] = [(a, b), (b, c), (c, d)].map(|(p, q)| (q.0 - p.0).length().max(1e-300));
    let inner = |far: (DVec3, f64), near: (DVec3, f64), other: (DVec3, f64), x: f64| {
        let root = (x * y).sqrt();
        let below = 3.0 * (x + root);
        let mixed = |far: f64, near: f64, other: f64| {
            (x * other - y * far + (2.0 * x + 3.0 * root + y) * near) / below
        };
        let place = DVec3::new(
            mixed(far.0.x, near.0.x, other.0.x),
            mixed(far.0.y, near.0.y, other.0.y),
            mixed(far.0.z, near.0.z, other.0.z),
        );
        (place, mixed(far.1, near.1, other.1))
    };
    [b, inner(a, b, c, x), inner(d, c, b, z), c]
}

/// The number of chords of a span: with n of them, equal in the parameter, the error is below max |B″| / 8 n².
fn chords(span: &CubicSpan, segments: Option<u32>, fineness: Fineness) -> usize {
    let [a, b, c, d] = *span;
    let bend = |a: (DVec3, f64), b: (DVec3, f64), c: (DVec3, f64)| {
        (a.0 - 2.0 * b.0 + c.0).length().max((a.1 - 2.0 * b.1 + c.1).abs())
    };
    let length = (b.0 - a.0).length() + (c.0 - b.0).length() + (d.0 - c.0).length();
    let second = 6.0 * bend(a, b, c).max(bend(b, c, d));
    if second <= 1e-6 * length {
        return 1;
    }
    if let Some(segments) = segments {
        return (segments as usize).div_ceil(4);
    }
    let exact = (second / (8.0 * fineness.error_m(length).max(1e-30))).sqrt();
    exact.ceil().clamp(1.0, MOST_CHOSEN) as usize
}

fn evaluate(span: &CubicSpan, t: f64) -> CurvePoint {
    let s = 1.0 - t;
    let weights = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
    let sum = |weights: &[f64], of: &[(DVec3, f64)]| {
        let pairs = weights.iter().zip(of);
        pairs.fold((DVec3::ZERO, 0.0), |sum, (weight, of)| (sum.0 + *weight * of.0, sum.1 + weight * of.1))
    };
    // Ends are exact.
    let (at, radius) = match t {
        0.0 => span[0],
        1.0 => span[3],
        _ => sum(&weights, span),
    };
    let steps: Vec<(DVec3, f64)> =
        span.windows(2).map(|pair| (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1)).collect();
    let mut step = sum(&[s * s, 2.0 * s * t, t * t], &steps);
    if step.0.length() <= 1e-12 * (span[3].0 - span[0].0).length() {
        // Where control points coincide, the direction is that to the next one.
        let next = steps.iter().find(|step| step.0.length() > 0.0);
        let last = steps.iter().rfind(|step| step.0.length() > 0.0);
        step = (if t < 0.5 { next } else { last }).copied().unwrap_or((DVec3::X, 0.0));
    }
    let speed = step.0.length();
    CurvePoint { at, radius, tangent: step.0 / speed, slope: step.1 / speed, along: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(points: &[[f64; 2]]) -> Vec<(DVec3, f64)> {
        points.iter().map(|[x, y]| (DVec3::new(*x, *y, 0.0), 0.0)).collect()
    }

    #[test]
    fn curves_pass_through_their_points_and_keep_to_the_error() {
        let points = flat(&[[0.0, 0.0], [1.0, 2.0], [3.0, 2.0], [3.5, -1.0]]);
        let fine = sample(&points, Spline::CatmullRom, false, None, Fineness::Metres(1e-6));
        let coarse = sample(&points, Spline::CatmullRom, false, None, Fineness::Metres(1e-3));
        let ([fine], [coarse]) = (&fine[..], &coarse[..]) else { panic!("it is smooth") };
        assert!(coarse.len() < fine.len());
        for (point, _) in &points {
            assert!(coarse.iter().any(|of| of.at == *point), "{point}");
        }
        for of in fine {
            let distance = |pair: &[CurvePoint]| {
                let along = pair[1].at - pair[0].at;
                let t = ((of.at - pair[0].at).dot(along) / along.length_squared()).clamp(0.0, 1.0);
                (of.at - pair[0].at - t * along).length()
            };
            let nearest = coarse.windows(2).map(distance).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1.001e-3, "{nearest}");
        }
        // Tangents are those of the curve.
        for pair in fine.windows(2) {
            let chord = (pair[1].at - pair[0].at).normalize();
            assert!(chord.dot(pair[0].tangent) > 0.9999 && chord.dot(pair[1].tangent) > 0.9999);
        }
    }

    /// A quarter of a circle as Bézier curves: no farther than 2.8·10⁻⁴ from the true one.
    #[test]
    fn bezier_spans_are_smooth_where_their_tangents_agree() {
        let k = 0.552_284_75;
        let circle = flat(&[
            [1.0, 0.0],
            [1.0, k],
            [k, 1.0],
            [0.0, 1.0],
            [-k, 1.0],
            [-1.0, k],
            [-1.0, 0.0],
            [-1.0, -k],
            [-k, -1.0],
            [0.0, -1.0],
            [k, -1.0],
            [1.0, -k],
        ]);
        let parts = sample(&circle, Spline::Bezier, true, None, Fineness::Metres(1e-4));
        let [whole] = &parts[..] else { panic!("{} parts", parts.len()) };
        assert!(whole.iter().all(|point| (point.at.length() - 1.0).abs() < 2.8e-4));
        assert_eq!(whole[0].at, whole[whole.len() - 1].at);
        assert!((whole[whole.len() - 1].along - std::f64::consts::TAU).abs() < 1e-3);
        let square = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        let parts = sample(&square, Spline::Linear, true, None, Fineness::DEFAULT);
        assert_eq!(parts.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2, 2, 2]);
        assert_eq!(parts[3][1].along, 4.0);
        // Smooth at its first point, with one corner elsewhere.
        let drop = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [-0.5, 0.5], [-1.0, 0.0]]);
        let parts = sample(&drop, Spline::Bezier, true, None, Fineness::Metres(1e-3));
        assert_eq!(parts.len(), 1);
        assert_eq!(parts[0][0].at, DVec3::new(0.0, 1.0, 0.0), "it begins at the corner");
        assert_eq!(parts[0][0].along, 0.0);
    }

    #[test]
    fn linear_and_straight_curves_have_constant_directions_and_slopes() {
        let points = [(DVec3::ZERO, 1.0), (DVec3::new(0.0, 3.0, 4.0), 2.0)];
        for curve in [Spline::Linear, Spline::CatmullRom] {
            for point in &sample(&points, curve, false, Some(16), Fineness::DEFAULT)[0] {
                assert!((point.tangent - DVec3::new(0.0, 0.6, 0.8)).length() < 1e-12);
                assert!((point.slope - 0.2).abs() < 1e-12);
            }
        }
    }
}
