//! Tests of whether triangles bound a body.

use std::collections::{BTreeSet, HashMap};

use crate::math::{DVec3, Vec3};

/// The largest number of triangles that is tested. Larger surfaces count as closed, since the test keeps all edges in
/// memory.
pub(crate) const MOST_TESTED: usize = 1 << 20;
/// Up to one open edge in this many counts as an invisible crack. Sheets of up to [`MOST_TESTED`] triangles have more
/// open edges at their rims.
const EDGES_FOR_A_CRACK: usize = 1000;

/// The distance up to which vertices count as one, relative to the size of the bounds: the rounding error at a seam.
const SAME: f32 = 1e-6;

/// The edges of triangles. Vertices in the same place count as one, whatever the reason for the split.
pub(crate) struct MeshEdges {
    /// The number of edges.
    pub count: usize,
    /// The edges that are not traversed equally often in both directions.
    pub open: Vec<[Vec3; 2]>,
}

impl MeshEdges {
    /// Finds the edges of indexed triangles. Triangles with two corners in the same place have none.
    pub fn of(positions: &[Vec3], triangles: impl Iterator<Item = [u32; 3]>) -> MeshEdges {
        let bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) = positions.iter().fold(bounds, |(low, high), at| (low.min(*at), high.max(*at)));
        let near = (SAME * (high - low).max_element()).max(f32::MIN_POSITIVE);
        let rounded = |at: &Vec3| ((*at - low) / near).round().to_array().map(|c| c as i32);
        let places: Vec<[i32; 3]> = positions.iter().map(rounded).collect();
        let place = |vertex: u32| places[vertex as usize];
        // Map each vertex to the first one in its place.
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        order.sort_unstable_by_key(|vertex| (place(*vertex), *vertex));
        let mut first = vec![0u32; positions.len()];
        for run in order.chunk_by(|a, b| place(*a) == place(*b)) {
            run.iter().for_each(|vertex| first[*vertex as usize] = run[0]);
        }
        let mut sides: Vec<(u32, u32, bool)> = Vec::new();
        for triangle in triangles {
            let [a, b, c] = triangle.map(|vertex| first[vertex as usize]);
            if a != b && b != c && c != a {
                sides.extend([(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b), a < b)));
            }
        }
        sides.sort_unstable();
        let (mut count, mut open) = (0, Vec::new());
        for edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            count += 1;
            if 2 * edge.iter().filter(|(.., forwards)| *forwards).count() != edge.len() {
                open.push([edge[0].0, edge[0].1].map(|vertex| positions[vertex as usize]));
            }
        }
        MeshEdges { count, open }
    }

    /// True if the triangles bound a body, apart from cracks caused by rounding.
    pub fn are_closed(&self) -> bool {
        is_crack(self.open.len(), self.count)
    }
}

/// True if so few of the edges are open that the gaps are not visible.
pub(crate) fn is_crack(open: usize, edges: usize) -> bool {
    open <= edges / EDGES_FOR_A_CRACK
}

/// Six times the signed volume between a point and triangles: negative if they face inwards. For closed surfaces the
/// choice of the point makes no difference.
pub(crate) fn six_volumes(from: Vec3, triangles: impl Iterator<Item = [Vec3; 3]>) -> f64 {
    let volume = |triangle: [Vec3; 3]| {
        let [a, b, c] = triangle.map(|corner| corner.as_dvec3() - from.as_dvec3());
        a.dot(b.cross(c))
    };
    triangles.map(volume).sum()
}

/// The area of a triangle.
pub(crate) fn area([a, b, c]: [Vec3; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}

/// The winding number of triangles on their inner side, averaged over points on them: 1 for a body, ½ for a flat sheet,
/// and in general the fraction of all directions in which the surface surrounds a point behind it (Jacobson, Kavan and
/// Sorkine-Hornung 2013).
pub(crate) fn inside(triangles: &[[Vec3; 3]]) -> f64 {
    /// The maximum number of points, and of triangles times points.
    const MOST: (usize, usize) = (32, 1 << 21);
    let samples = (MOST.1 / triangles.len().max(1)).clamp(1, MOST.0);
    let whole: f64 = triangles.iter().map(|triangle| area(*triangle)).sum();
    let step = whole / samples as f64;
    let (mut sum, mut taken, mut passed) = (0.0, 0usize, 0.0);
    for (number, triangle) in triangles.iter().enumerate() {
        passed += area(*triangle);
        if passed <= (taken as f64 + 0.5) * step {
            continue;
        }
        // A large triangle counts for several points.
        let times = ((passed / step - 0.5 - taken as f64).ceil().max(1.0) as usize).min(samples - taken);
        let [a, b, c] = triangle.map(|corner| corner.as_dvec3());
        let middle = (a + b + c) / 3.0;
        let others = triangles.iter().enumerate().filter(|(other, _)| *other != number);
        // The point's own triangle covers half of all directions.
        let around: f64 = others.map(|(_, other)| solid_angle(middle, *other)).sum();
        sum += times as f64 * (0.5 + around / (4.0 * std::f64::consts::PI));
        taken += times;
        if taken == samples {
            break;
        }
    }
    sum / taken.max(1) as f64
}

/// The solid angle of a triangle, positive if its back faces the point (Van Oosterom and Strackee 1983).
fn solid_angle(from: DVec3, triangle: [Vec3; 3]) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner.as_dvec3() - from);
    let [x, y, z] = [a.length(), b.length(), c.length()];
    let below = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
    2.0 * libm::atan2(a.dot(b.cross(c)), below)
}

/// A group of surfaces that are joined where their rims meet.
#[derive(Clone, Default)]
pub(crate) struct JoinedSurfaces {
    /// The indices of the surfaces.
    pub members: Vec<usize>,
    /// The open edges that meet no other surface.
    pub rim: Vec<[Vec3; 2]>,
    /// Members with an edge that meets more than one other surface.
    pub crossed: Vec<usize>,
}

/// Groups surfaces whose open edges meet.
pub(crate) fn joined(rims: &[&[[Vec3; 2]]]) -> Vec<JoinedSurfaces> {
    /// The distance up to which rims meet, relative to the size of the bounds.
    const NEAR: f32 = 1e-5;
    let ends = || rims.iter().flat_map(|rim| rim.as_flattened());
    let (low, high) =
        ends().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), end| (low.min(*end), high.max(*end)));
    let near = (NEAR * (high - low).max_element()).max(f32::MIN_POSITIVE);
    let cell = |end: Vec3| ((end - low) / near).to_array().map(|at| at.floor() as i64);
    let mut cells: HashMap<[i64; 3], BTreeSet<usize>> = HashMap::new();
    for (number, rim) in rims.iter().enumerate() {
        rim.as_flattened().iter().for_each(|end| {
            cells.entry(cell(*end)).or_default().insert(number);
        });
    }
    // The other surfaces with a rim near a point.
    let others = |number: usize, end: Vec3| -> BTreeSet<usize> {
        let [x, y, z] = cell(end);
        let steps = || -1..=1i64;
        let around =
            steps().flat_map(|i| steps().flat_map(move |j| steps().map(move |k| [x + i, y + j, z + k])));
        let there = around.filter_map(|cell| cells.get(&cell)).flatten().copied();
        there.filter(|other| *other != number).collect()
    };
    let mut first: Vec<usize> = (0..rims.len()).collect();
    let mut left: Vec<Vec<[Vec3; 2]>> = vec![Vec::new(); rims.len()];
    let mut crossed = vec![false; rims.len()];
    for (number, rim) in rims.iter().enumerate() {
        for edge in *rim {
            let [from, to] = edge.map(|end| others(number, end));
            let met: Vec<usize> = from.intersection(&to).copied().collect();
            if met.is_empty() {
                left[number].push(*edge);
            }
            crossed[number] |= met.len() > 1;
            for other in met {
                let (a, b) = (root(&first, number), root(&first, other));
                first[a.max(b)] = a.min(b);
            }
        }
    }
    let mut groups = vec![JoinedSurfaces::default(); rims.len()];
    for (number, left) in left.into_iter().enumerate() {
        let group = &mut groups[root(&first, number)];
        group.members.push(number);
        group.crossed.extend(crossed[number].then_some(number));
        group.rim.extend(left);
    }
    groups.retain(|group| !group.members.is_empty());
    groups
}

/// The first surface of the group that contains surface `of`.
fn root(first: &[usize], mut of: usize) -> usize {
    while first[of] != of {
        of = first[of];
    }
    of
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A torus of rings and sectors, whose triangles share no vertices.
    pub(crate) fn torus(rings: u32, sectors: u32) -> Vec<[Vec3; 3]> {
        let place = |ring: u32, sector: u32| {
            let turn = |i: u32, of: u32| std::f64::consts::TAU * f64::from(i % of) / f64::from(of);
            let (a, b) = (turn(ring, rings), turn(sector, sectors));
            let out = 2.0 + libm::cos(b);
            Vec3::new((out * libm::cos(a)) as f32, (out * libm::sin(a)) as f32, libm::sin(b) as f32)
        };
        let pairs = (0..rings).flat_map(|i| (0..sectors).map(move |j| (i, j)));
        let quads = pairs.map(|(i, j)| [place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)]);
        quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
    }

    fn edges(triangles: &[[Vec3; 3]]) -> MeshEdges {
        let corners = triangles.as_flattened();
        MeshEdges::of(corners, (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]))
    }

    #[test]
    fn mesh_edges_are_closed_despite_cracks_but_not_holes() {
        let mut all = torus(80, 40);
        let volume = |all: &[[Vec3; 3]]| six_volumes(Vec3::ZERO, all.iter().copied());
        assert!(edges(&all).are_closed() && edges(&all).open.is_empty() && volume(&all) > 0.0);
        all[100][1].z += 1e-7;
        assert!(edges(&all).open.is_empty(), "what rounding does at a seam");
        all[200][0].x += 1e-5;
        assert!(edges(&all).are_closed() && !edges(&all).open.is_empty(), "a crack");
        all.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        assert!(edges(&all).are_closed() && volume(&all) < 0.0);
        all.truncate(80 * 39 * 2);
        assert!(!edges(&all).are_closed(), "a hole");
    }

    #[test]
    fn winding_number_is_1_in_bodies_and_half_behind_sheets() {
        let near = |found: f64, wanted: f64, by: f64| assert!((found - wanted).abs() < by, "{found}");
        let mut all = torus(40, 20);
        near(inside(&all), 1.0, 1e-6);
        all.truncate(40 * 20);
        near(inside(&all), 0.9, 0.1);
        all.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        near(inside(&all), 0.1, 0.1);
        let [a, b, c, d] =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 3.0));
        near(inside(&[[a, b, c], [a, c, d]]), 0.5, 1e-6);
        assert_eq!(edges(&[[a, b, c], [a, c, d]]).open.len(), 4);
        assert_eq!(edges(&[[a, b, c], [a, c, d]]).count, 5);
    }
}
