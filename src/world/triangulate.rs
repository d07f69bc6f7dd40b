//! Splits polygons into triangles. A convex quadrilateral is split along its first diagonal; any larger or concave
//! polygon by ear clipping (Meisters 1975; after Eberly, "Triangulation by Ear Clipping": only reflex corners can
//! invalidate an ear), projected on the coordinate plane in which it is largest.

use crate::math::{DVec3, Vec3};

/// The most point-in-triangle tests for the polygons of one file: seconds of work. Ear clipping is quadratic, so
/// without a limit a file could take days.
const TESTS: u64 = 1 << 28;

/// The polygons of one file exceed the limit of tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("its polygon has too many corners and dents to be triangulated here: triangulate it when exporting")]
pub struct TooComplex;

/// Splits polygons; holds the scratch space and the remaining tests of one file.
pub struct Triangulator {
    tests_left: u64,
    points: Vec<[f64; 2]>,
    next: Vec<usize>,
    previous: Vec<usize>,
    reflex: Vec<usize>,
}

impl Default for Triangulator {
    fn default() -> Self {
        Self {
            tests_left: TESTS,
            points: Vec::new(),
            next: Vec::new(),
            previous: Vec::new(),
            reflex: Vec::new(),
        }
    }
}

impl Triangulator {
    /// Calls `emit` with the corner numbers (0 to n − 1) of the n − 2 triangles that make up the polygon `corners`
    /// (indices into `positions`, in range), in the polygon's own orientation. A remainder without a valid
    /// triangulation (no area, crossing edges) becomes a fan. Fewer than three corners give no triangle.
    pub fn split(
        &mut self,
        positions: &[Vec3],
        corners: &[u32],
        mut emit: impl FnMut([usize; 3]),
    ) -> Result<(), TooComplex> {
        let at = |corner: usize| positions[corners[corner] as usize].as_dvec3();
        match corners.len() {
            0..=2 => {}
            3 => emit([0, 1, 2]),
            4 if second_diagonal([at(0), at(1), at(2), at(3)]) => {
                emit([0, 1, 3]);
                emit([1, 2, 3]);
            }
            4 => {
                emit([0, 1, 2]);
                emit([0, 2, 3]);
            }
            n => {
                if self.project((0..n).map(at)) {
                    return self.clip(emit);
                }
                (2..n).for_each(|i| emit([0, i - 1, i]));
            }
        }
        Ok(())
    }

    /// Fills `points` with the polygon projected on a coordinate plane, counter-clockwise. Returns false if it has no
    /// area.
    fn project(&mut self, polygon: impl Iterator<Item = DVec3> + Clone) -> bool {
        let Some(origin) = polygon.clone().next() else { return false };
        // Twice the area vector (Newell), relative to a corner so that distance from the origin costs no digits.
        let mut normal = DVec3::ZERO;
        let mut before = DVec3::ZERO;
        for corner in polygon.clone().skip(1) {
            normal += before.cross(corner - origin);
            before = corner - origin;
        }
        let size = normal.abs();
        let (u, v, sign) = if size.x >= size.y && size.x >= size.z {
            (DVec3::Y, DVec3::Z, normal.x)
        } else if size.y >= size.z {
            (DVec3::Z, DVec3::X, normal.y)
        } else {
            (DVec3::X, DVec3::Y, normal.z)
        };
        let (u, v) = if sign < 0.0 { (v, u) } else { (u, v) };
        self.points.clear();
        self.points.extend(polygon.map(|corner| {
            let corner = corner - origin;
            [corner.dot(u), corner.dot(v)]
        }));
        sign != 0.0
    }

    /// Clips ears until two corners are left.
    fn clip(&mut self, mut emit: impl FnMut([usize; 3])) -> Result<(), TooComplex> {
        let n = self.points.len();
        self.next.clear();
        self.next.extend((1..n).chain([0]));
        self.previous.clear();
        self.previous.extend([n - 1].into_iter().chain(0..n - 1));
        self.reflex = (0..n).filter(|&i| self.turn(i) < 0.0).collect();
        let mut left = n;
        let mut corner = 1;
        // Corners in a row that were no ears; after a full round, flat ones are accepted.
        let mut refused = 0;
        while left > 3 {
            self.spend(1)?;
            let turn = self.turn(corner);
            let flat_will_do = refused >= left && turn == 0.0;
            if flat_will_do || (turn > 0.0 && !self.is_spoilt(corner)?) {
                let (before, after) = (self.previous[corner], self.next[corner]);
                emit([before, corner, after]);
                self.remove(corner);
                left -= 1;
                refused = 0;
                corner = after;
                continue;
            }
            refused += 1;
            if refused > 2 * left {
                break;
            }
            corner = self.next[corner];
        }
        let first = self.previous[corner];
        for _ in 2..left {
            emit([first, corner, self.next[corner]]);
            corner = self.next[corner];
        }
        Ok(())
    }

    fn spend(&mut self, tests: usize) -> Result<(), TooComplex> {
        self.tests_left = self.tests_left.checked_sub(tests as u64).ok_or(TooComplex)?;
        Ok(())
    }

    /// Removes a corner from the ring.
    fn remove(&mut self, corner: usize) {
        let (before, after) = (self.previous[corner], self.next[corner]);
        self.next[before] = after;
        self.previous[after] = before;
        // Cutting an ear can only turn the corners next to it convex.
        let mut reflex = std::mem::take(&mut self.reflex);
        reflex.retain(|&i| i != corner && (i != before && i != after || self.turn(i) < 0.0));
        self.reflex = reflex;
    }

    /// Positive if the ring turns left at `corner`, negative if it turns right.
    fn turn(&self, corner: usize) -> f64 {
        let (before, after) = (self.previous[corner], self.next[corner]);
        area(self.points[before], self.points[corner], self.points[after])
    }

    /// True if a reflex corner lies in the ear at `corner`.
    fn is_spoilt(&mut self, corner: usize) -> Result<bool, TooComplex> {
        self.spend(self.reflex.len())?;
        let ear = [self.previous[corner], corner, self.next[corner]];
        let [a, b, c] = ear.map(|i| self.points[i]);
        Ok(self.reflex.iter().filter(|i| !ear.contains(i)).any(|&i| {
            let p = self.points[i];
            // A corner visited twice, as by the bridge to a hole, is no obstacle.
            p != a && p != b && p != c && area(a, b, p) >= 0.0 && area(b, c, p) >= 0.0 && area(c, a, p) >= 0.0
        }))
    }
}

/// Twice the area of a triangle, positive if it runs counter-clockwise.
fn area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// True if a quadrilateral splits well only along the diagonal 1-3.
fn second_diagonal([a, b, c, d]: [DVec3; 4]) -> bool {
    let normal = (c - a).cross(d - b);
    let faces = |x: DVec3, y: DVec3, z: DVec3| (y - x).cross(z - x).dot(normal) > 0.0;
    !(faces(a, b, c) && faces(a, c, d)) && faces(a, b, d) && faces(b, c, d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn triangles(points: &[Vec3]) -> Vec<[usize; 3]> {
        let corners: Vec<u32> = (0..points.len() as u32).collect();
        let mut triangles = Vec::new();
        Triangulator::default().split(points, &corners, |t| triangles.push(t)).unwrap();
        triangles
    }

    fn flat(points: &[[f32; 2]]) -> Vec<Vec3> {
        points.iter().map(|p| Vec3::new(p[0], p[1], 0.0)).collect()
    }

    /// Signed areas of the triangles seen along +Z.
    fn areas(points: &[Vec3], triangles: &[[usize; 3]]) -> Vec<f64> {
        let at = |i: usize| [f64::from(points[i].x), f64::from(points[i].y)];
        triangles.iter().map(|t| area(at(t[0]), at(t[1]), at(t[2])) / 2.0).collect()
    }

    fn assert_fills(points: &[Vec3], expected_area: f64) {
        let triangles = triangles(points);
        assert_eq!(triangles.len(), points.len() - 2);
        let areas = areas(points, &triangles);
        // Each triangle has the polygon's orientation, and together they have its area: nothing overlaps.
        assert!(areas.iter().all(|a| a * expected_area >= 0.0), "{areas:?}");
        assert!((areas.iter().sum::<f64>() - expected_area).abs() < 1e-9 * expected_area.abs(), "{areas:?}");
    }

    #[test]
    fn convex_quad_splits_along_its_first_diagonal() {
        let quad = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(triangles(&quad), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn concave_quad_splits_at_its_reflex_corner() {
        for shift in 0..4 {
            let mut dart = flat(&[[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]]);
            dart.rotate_left(shift);
            assert_fills(&dart, 4.0);
        }
    }

    #[test]
    fn concave_polygons_are_filled_whichever_way_they_face() {
        let arrow = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];
        let comb = [
            [0.0, 0.0],
            [7.0, 0.0],
            [7.0, 3.0],
            [6.0, 3.0],
            [6.0, 1.0],
            [4.0, 1.0],
            [4.0, 3.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [0.0, 3.0],
        ];
        for (outline, area) in [(&arrow[..], 10.0), (&comb[..], 13.0)] {
            for shift in 0..outline.len() {
                let mut points = flat(outline);
                points.rotate_left(shift);
                assert_fills(&points, area);
                points.reverse();
                assert_fills(&points, -area);
            }
        }
    }

    #[test]
    fn rotated_polygon_keeps_its_orientation() {
        let arrow = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];
        let turns: [fn(Vec3) -> Vec3; 3] =
            [|p| Vec3::new(p.z, p.x, p.y), |p| Vec3::new(p.y, p.z, p.x), |p| Vec3::new(p.x, -p.z, p.y)];
        let expected = triangles(&flat(&arrow));
        for turn in turns {
            let points: Vec<Vec3> = flat(&arrow).into_iter().map(turn).collect();
            assert_eq!(triangles(&points), expected);
        }
    }

    #[test]
    fn hole_reached_by_a_bridge_stays_open() {
        let ring = flat(&[
            [0.0, 0.0],
            [6.0, 0.0],
            [6.0, 6.0],
            [0.0, 6.0],
            [0.0, 0.0],
            [2.0, 2.0],
            [2.0, 4.0],
            [4.0, 4.0],
            [4.0, 2.0],
            [2.0, 2.0],
        ]);
        assert_fills(&ring, 32.0);
    }

    #[test]
    fn corners_on_a_straight_edge_are_kept() {
        let points = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 2.0], [0.0, 2.0]]);
        assert_fills(&points, 4.0);
    }

    #[test]
    fn polygons_without_area_become_fans() {
        let line = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 0.0]]);
        assert_eq!(triangles(&line), [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
        let point = vec![Vec3::ONE; 6];
        assert_eq!(triangles(&point).len(), 4);
        assert!(triangles(&line[..2]).is_empty());
    }

    #[test]
    fn too_complex_polygon_is_refused() {
        let mut triangulator = Triangulator { tests_left: 1 << 20, ..Triangulator::default() };
        let spiky = (0..200_000).map(|i| {
            let angle = f64::from(i) * std::f64::consts::TAU / 200_000.0;
            let radius = if i % 2 == 0 { 1.0 } else { 0.1 };
            Vec3::new((radius * libm::cos(angle)) as f32, (radius * libm::sin(angle)) as f32, 0.0)
        });
        let points: Vec<Vec3> = spiky.collect();
        let corners: Vec<u32> = (0..points.len() as u32).collect();
        assert_eq!(triangulator.split(&points, &corners, |_| {}), Err(TooComplex));
    }

    proptest! {
        #[test]
        fn any_polygon_gives_n_minus_two_triangles(points in prop::collection::vec((-4i8..4, -4i8..4, -1i8..1), 3..24)) {
            let points: Vec<Vec3> =
                points.iter().map(|&(x, y, z)| Vec3::new(f32::from(x), f32::from(y), f32::from(z))).collect();
            let triangles = triangles(&points);
            prop_assert_eq!(triangles.len(), points.len() - 2);
            prop_assert!(triangles.iter().flatten().all(|&i| i < points.len()));
        }

        #[test]
        fn star_shaped_polygons_are_filled(radii in prop::collection::vec(1u16..1000, 5..40)) {
            let n = radii.len() as f64;
            let points: Vec<Vec3> = radii.iter().enumerate().map(|(i, &r)| {
                let angle = i as f64 * std::f64::consts::TAU / n;
                let r = f64::from(r);
                Vec3::new((r * libm::cos(angle)) as f32, (r * libm::sin(angle)) as f32, 0.0)
            }).collect();
            let at = |i: usize| [f64::from(points[i].x), f64::from(points[i].y)];
            let whole: f64 = (0..points.len()).map(|i| area([0.0, 0.0], at(i), at((i + 1) % points.len())) / 2.0).sum();
            assert_fills(&points, whole);
        }
    }
}
