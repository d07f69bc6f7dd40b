//! Flat shapes: outlines with holes, and contours of implicit shapes.

use std::collections::BTreeMap;

use glam::DVec2;

use crate::mesh::polar;

/// A closed polygon.
pub type Loop = Vec<DVec2>;

/// A flat shape with holes.
#[derive(Clone, Debug, Default)]
pub struct Outline {
    /// Counter-clockwise.
    pub outer: Loop,
    /// Clockwise.
    pub holes: Vec<Loop>,
}

impl Outline {
    /// A shape without holes.
    pub fn new(outer: Loop) -> Self {
        Self { outer: oriented(outer, true), holes: Vec::new() }
    }

    /// Adds a hole.
    pub fn with_hole(mut self, hole: Loop) -> Self {
        self.holes.push(oriented(hole, false));
        self
    }

    /// The outer loop, then the holes.
    pub fn loops(&self) -> impl Iterator<Item = &Loop> {
        std::iter::once(&self.outer).chain(&self.holes)
    }
}

/// Twice the signed area, positive if counter-clockwise.
pub fn doubled_area(points: &[DVec2]) -> f64 {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(p, q)| p.perp_dot(*q)).sum()
}

fn oriented(mut points: Loop, counter_clockwise: bool) -> Loop {
    if (doubled_area(&points) > 0.0) != counter_clockwise {
        points.reverse();
    }
    points
}

/// A regular polygon.
pub fn circle(center: DVec2, radius: f64, segments: usize) -> Loop {
    (0..segments).map(|i| center + polar(radius, 360.0 * i as f64 / segments as f64)).collect()
}

/// A rectangle about the origin with rounded corners.
pub fn rounded_rectangle(width: f64, height: f64, radius: f64, corner_segments: usize) -> Loop {
    let (x, y) = (width / 2.0 - radius, height / 2.0 - radius);
    let mut points = Vec::new();
    for (quarter, center) in [(x, y), (-x, y), (-x, -y), (x, -y)].into_iter().enumerate() {
        for i in 0..=corner_segments {
            let degrees = 90.0 * (quarter as f64 + i as f64 / corner_segments as f64);
            points.push(DVec2::from(center) + polar(radius, degrees));
        }
    }
    points
}

/// The loop moved to its left (into the material) by `distance`.
pub fn inset(points: &[DVec2], distance: f64) -> Loop {
    let n = points.len();
    let left = |i: usize| (points[(i + 1) % n] - points[i % n]).normalize_or_zero().perp();
    (0..n)
        .map(|i| {
            let (a, b) = (left(i + n - 1), left(i));
            points[i] + (a + b) * (distance / (1.0 + a.dot(b)).max(0.4))
        })
        .collect()
}

/// Distances from a point to simple shapes, negative inside, to be combined into contours.
pub mod distance {
    use glam::DVec2;

    /// The distance to a disc.
    pub fn disc(p: DVec2, center: DVec2, radius: f64) -> f64 {
        p.distance(center) - radius
    }

    /// The distance to a ring of half width `half_width` about a circle.
    pub fn ring(p: DVec2, center: DVec2, radius: f64, half_width: f64) -> f64 {
        (p.distance(center) - radius).abs() - half_width
    }

    /// The distance to a bar with round ends of radius `ra` at `a` and `rb` at `b`.
    pub fn bar(p: DVec2, a: DVec2, b: DVec2, ra: f64, rb: f64) -> f64 {
        let along = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        p.distance(a.lerp(b, along)) - (ra + (rb - ra) * along)
    }

    /// The distance to a strip along a quadratic curve from `a` by `b` to `c`.
    pub fn curve(p: DVec2, a: DVec2, b: DVec2, c: DVec2, half_width: f64) -> f64 {
        const PIECES: usize = 24;
        let at = |i: usize| {
            let t = i as f64 / PIECES as f64;
            a.lerp(b, t).lerp(b.lerp(c, t), t)
        };
        let pieces = (0..PIECES).map(|i| bar(p, at(i), at(i + 1), half_width, half_width));
        pieces.fold(f64::INFINITY, f64::min)
    }

    /// The distance to the union of two shapes, with a fillet of about `k` where they meet.
    pub fn smooth_union(a: f64, b: f64, k: f64) -> f64 {
        let h = (k - (a - b).abs()).max(0.0) / k;
        a.min(b) - h * h * k * 0.25
    }

    /// The distance to the intersection of two shapes, its corner rounded by about `k`.
    pub fn smooth_intersection(a: f64, b: f64, k: f64) -> f64 {
        -smooth_union(-a, -b, k)
    }
}

/// The shapes where `field` is negative within `[low, high]`, traced on a grid of squares of side `cell` and simplified
/// to within `tolerance`. The field must be positive at the border.
pub fn contours(
    field: impl Fn(DVec2) -> f64,
    low: DVec2,
    high: DVec2,
    cell: f64,
    tolerance: f64,
) -> Vec<Outline> {
    let size = ((high - low) / cell).ceil();
    let (columns, rows) = (size.x as usize + 1, size.y as usize + 1);
    // A shift by a fraction that no drawing uses keeps straight edges off the grid lines.
    let at = |i: usize, j: usize| low + DVec2::new(i as f64 - 0.293, j as f64 - 0.271) * cell;
    let values: Vec<f64> = (0..columns * rows).map(|k| field(at(k % columns, k / columns))).collect();
    let inside = |i: usize, j: usize| values[j * columns + i] < 0.0;
    // Directed steps from grid edge to grid edge with the shape on the left. An edge is (column, row, true if it goes
    // up).
    let mut next: BTreeMap<(usize, usize, bool), (usize, usize, bool)> = BTreeMap::new();
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            let corners = [inside(i, j), inside(i + 1, j), inside(i + 1, j + 1), inside(i, j + 1)];
            let edges = [(i, j, false), (i + 1, j, true), (i, j + 1, false), (i, j, true)];
            let crossing = |k: usize| corners[k] != corners[(k + 1) % 4];
            for k in (0..4).filter(|&k| crossing(k) && corners[k]) {
                // Counter-clockwise around the cell, edge k leaves the shape, so the contour enters the cell there; it
                // exits where the shape was entered before.
                let back = (1..4).map(|step| (k + 4 - step) % 4).find(|&b| crossing(b) && !corners[b]);
                next.insert(edges[k], edges[back.expect("crossings come in pairs")]);
            }
        }
    }
    let point = |&(i, j, up): &(usize, usize, bool)| {
        let (mut a, mut b) = (at(i, j), if up { at(i, j + 1) } else { at(i + 1, j) });
        if field(a) >= 0.0 {
            std::mem::swap(&mut a, &mut b);
        }
        for _ in 0..40 {
            let middle = (a + b) * 0.5;
            if field(middle) < 0.0 { a = middle } else { b = middle }
        }
        (a + b) * 0.5
    };
    let mut loops = Vec::new();
    while let Some((&start, _)) = next.first_key_value() {
        let mut points = Vec::new();
        let mut edge = start;
        while let Some(following) = next.remove(&edge) {
            points.push(point(&edge));
            edge = following;
        }
        loops.push(simplified(&points, tolerance));
    }
    nested(loops)
}

/// Assigns each clockwise loop to the smallest counter-clockwise one around it.
fn nested(loops: Vec<Loop>) -> Vec<Outline> {
    let (outer, holes): (Vec<_>, Vec<_>) = loops.into_iter().partition(|l| doubled_area(l) > 0.0);
    let mut outlines: Vec<_> = outer.into_iter().map(|outer| Outline { outer, holes: Vec::new() }).collect();
    for hole in holes {
        let owner = outlines.iter_mut().filter(|o| contains(&o.outer, hole[0]));
        if let Some(owner) = owner.min_by(|a, b| doubled_area(&a.outer).total_cmp(&doubled_area(&b.outer))) {
            owner.holes.push(hole);
        }
    }
    outlines
}

/// Returns true if the point is inside the polygon (even-odd).
pub fn contains(points: &[DVec2], p: DVec2) -> bool {
    let mut inside = false;
    for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            inside = !inside;
        }
    }
    inside
}

/// Simplifies a closed loop (Douglas and Peucker).
fn simplified(points: &[DVec2], tolerance: f64) -> Loop {
    let n = points.len();
    let farthest = |from: usize| {
        (0..n).max_by(|&a, &b| {
            points[a].distance_squared(points[from]).total_cmp(&points[b].distance_squared(points[from]))
        })
    };
    let (start, end) = (0, farthest(0).unwrap_or(0));
    let mut keep = vec![false; n];
    keep[start] = true;
    keep[end] = true;
    let mut open = vec![(start, end), (end, start + n)];
    while let Some((a, b)) = open.pop() {
        let (p, q) = (points[a % n], points[b % n]);
        let direction = (q - p).normalize_or_zero();
        let off = |i: usize| direction.perp_dot(points[i % n] - p).abs();
        let Some(worst) = (a + 1..b).max_by(|&i, &j| off(i).total_cmp(&off(j))) else { continue };
        if off(worst) > tolerance {
            keep[worst % n] = true;
            open.push((a, worst));
            open.push((worst, b));
        }
    }
    (0..n).filter(|&i| keep[i]).map(|i| points[i]).collect()
}
