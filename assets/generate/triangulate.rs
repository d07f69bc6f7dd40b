//! Splits polygons with holes into triangles by ear clipping (Meisters 1975); holes are first joined to the outer loop
//! by bridges.

use glam::DVec2;

use crate::outline::Outline;

/// Triangles over the points of the outline's loops, which are numbered in their order.
pub fn triangulate(outline: &Outline) -> Vec<[u32; 3]> {
    let points: Vec<DVec2> = outline.loops().flatten().copied().collect();
    let mut ring: Vec<usize> = (0..outline.outer.len()).collect();
    let mut first = outline.outer.len();
    let mut holes: Vec<Vec<usize>> = Vec::new();
    for hole in &outline.holes {
        holes.push((first..first + hole.len()).collect());
        first += hole.len();
    }
    while let Some(hole) = holes.pop() {
        bridge(&points, &mut ring, &hole, &holes);
    }
    cut_ears(&points, ring)
}

fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Inserts the hole into the ring by the shortest bridge that crosses nothing.
fn bridge(points: &[DVec2], ring: &mut Vec<usize>, hole: &[usize], others: &[Vec<usize>]) {
    let mut best: Option<(f64, usize, usize)> = None;
    for (h, &hole_point) in hole.iter().enumerate() {
        for (r, &ring_point) in ring.iter().enumerate() {
            let length = points[hole_point].distance_squared(points[ring_point]);
            let shorter = best.is_none_or(|(shortest, ..)| length < shortest);
            if shorter
                && in_cone(points, ring, r, points[hole_point])
                && !crosses(points, ring, hole_point, ring_point)
                && !crosses(points, hole, hole_point, ring_point)
                && others.iter().all(|other| !crosses(points, other, hole_point, ring_point))
            {
                best = Some((length, h, r));
            }
        }
    }
    let (_, h, r) = best.expect("a hole inside its outline can be reached from it");
    let around = (0..=hole.len()).map(|i| hole[(h + i) % hole.len()]);
    let detour: Vec<usize> = around.chain(std::iter::once(ring[r])).collect();
    ring.splice(r + 1..r + 1, detour);
}

/// Returns true if the way from ring vertex `r` towards `target` starts inside the ring.
fn in_cone(points: &[DVec2], ring: &[usize], r: usize, target: DVec2) -> bool {
    let n = ring.len();
    let before = points[ring[(r + n - 1) % n]];
    let here = points[ring[r]];
    let after = points[ring[(r + 1) % n]];
    let (left_of_in, left_of_out) = (turn(before, here, target) > 0.0, turn(here, after, target) > 0.0);
    if turn(before, here, after) > 0.0 { left_of_in && left_of_out } else { left_of_in || left_of_out }
}

fn crosses(points: &[DVec2], polygon: &[usize], from: usize, to: usize) -> bool {
    let (p, q) = (points[from], points[to]);
    polygon.iter().zip(polygon.iter().cycle().skip(1)).any(|(&i, &j)| {
        if [from, to].contains(&i) || [from, to].contains(&j) {
            return false;
        }
        let (a, b) = (points[i], points[j]);
        turn(p, q, a) * turn(p, q, b) <= 0.0 && turn(a, b, p) * turn(a, b, q) <= 0.0
    })
}

fn cut_ears(points: &[DVec2], mut ring: Vec<usize>) -> Vec<[u32; 3]> {
    let mut triangles = Vec::with_capacity(ring.len());
    let mut at = 0;
    let mut failures = 0;
    while ring.len() > 2 {
        let n = ring.len();
        at %= n;
        let corners = [ring[(at + n - 1) % n], ring[at], ring[(at + 1) % n]];
        // After a whole round without an ear, the rest is degenerate: cut anyway.
        if failures > n || is_ear(points, &ring, corners) {
            triangles.push(corners.map(|c| c as u32));
            ring.remove(at);
            failures = 0;
            // Skips the next corner: ears all around give better triangles than a fan.
            at += 1;
        } else {
            at += 1;
            failures += 1;
        }
    }
    triangles
}

fn is_ear(points: &[DVec2], ring: &[usize], corners: [usize; 3]) -> bool {
    let [a, b, c] = corners.map(|i| points[i]);
    if turn(a, b, c) <= 1e-12 {
        return false;
    }
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    !ring.iter().any(|&i| {
        let p = points[i];
        !corners.contains(&i)
            && p.cmpge(low).all()
            && p.cmple(high).all()
            && p != a
            && p != b
            && p != c
            && turn(a, b, p) >= 0.0
            && turn(b, c, p) >= 0.0
            && turn(c, a, p) >= 0.0
    })
}
