//! Balls that flow into each other: a surface of equal density (Blinn 1982), with the density of Wyvill and others, by
//! marching tetrahedra (Doi and Koide 1991).

use std::collections::HashMap;
use std::f64::consts::TAU;

use super::Fineness;
use super::builder::{MeshBuilder, ShapeVertex};
use crate::error::CompileError;
use crate::math::DVec3;
use crate::memory;
use crate::world::Mesh;

/// The density of a ball of radius r at a distance d is (1 − d² / (k r)²)², times what makes it 1 at d = r.
#[derive(Clone, Copy)]
pub(super) struct Metaball {
    pub middle: DVec3,
    pub radius: f64,
}

/// The look of metaballs, but for the balls.
#[derive(Clone, Copy)]
pub(super) struct MetaballStyle {
    /// The reach k of a ball, in radii.
    pub reach: f64,
    pub segments: Option<u32>,
    pub fineness: Fineness,
}

/// The most points of the grid.
const MOST_POINTS: f64 = (1 << 24) as f64;
/// A cell's corners 0 to 7, whose bits are x, y and z, as six tetrahedra about a diagonal, of one orientation: neighbours
/// share their faces.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];
/// Steps towards the surface along an edge.
const STEPS: u32 = 10;

/// The density at a point, and its gradient.
fn density(balls: &[Metaball], reach: f64, point: DVec3) -> (f64, DVec3) {
    let scale = (1.0 - reach.powi(-2)).powi(-2);
    let (mut sum, mut gradient) = (0.0, DVec3::ZERO);
    for ball in balls {
        let square = (reach * ball.radius).powi(2);
        let way = point - ball.middle;
        let left = 1.0 - way.length_squared() / square;
        if left > 0.0 {
            sum += scale * left * left;
            gradient -= way * (4.0 * scale * left / square);
        }
    }
    (sum, gradient)
}

/// A grid of densities around the balls.
struct DensityGrid {
    low: DVec3,
    step: f64,
    counts: [usize; 3],
    densities: Vec<f32>,
}

impl DensityGrid {
    fn point(&self, index: usize) -> DVec3 {
        let [columns, rows, _] = self.counts;
        let place = [index % columns, index / columns % rows, index / (columns * rows)];
        self.low + self.step * DVec3::from(place.map(|number| number as f64))
    }

    fn corner(&self, cell: usize, corner: usize) -> usize {
        let [columns, rows, _] = self.counts;
        cell + (corner & 1) + (corner >> 1 & 1) * columns + (corner >> 2) * columns * rows
    }

    fn is_inside(&self, index: usize) -> bool {
        self.densities[index] >= 1.0
    }
}

/// The mesh of the surface where the density is 1. The image lies in the rectangle around all balls in the XY plane.
pub(super) fn mesh(balls: &[Metaball], style: MetaballStyle) -> Result<Mesh, CompileError> {
    let MetaballStyle { reach, segments, fineness } = style;
    let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
    // Edges are up to √3 steps long.
    let mut step = f64::MAX;
    for ball in balls {
        let radius = DVec3::splat(reach * ball.radius);
        (low, high) = (low.min(ball.middle - radius), high.max(ball.middle + radius));
        let chords = fineness.segments(ball.radius, segments, 12.0) as f64;
        step = step.min(TAU * ball.radius / (3f64.sqrt() * chords));
    }
    let size = high - low;
    let step = step.max((size.element_product() / MOST_POINTS).cbrt());
    let counts = size.to_array().map(|side| (side / step).ceil() as usize + 2);
    let points: usize = counts.iter().product();
    let _claim = memory::reserve("the densities of metaballs", 4 * points as u64)?;
    // Nothing lies at the grid's border.
    let mut grid = DensityGrid { low: low - 0.5 * step, step, counts, densities: vec![0.0; points] };
    fill(&mut grid, balls, reach);

    let cells = cells(&grid);
    // A cell has at most 12 triangles, and about as many new vertices as triangles, halved.
    let mut surface = MetaballSurface {
        balls,
        reach,
        size,
        low,
        grid: &grid,
        known: HashMap::new(),
        builder: MeshBuilder::with_room(8 * cells.len(), 12 * cells.len())?,
    };
    for cell in cells {
        for tetrahedron in TETRAHEDRA {
            surface.cut(tetrahedron.map(|corner| grid.corner(cell, corner)));
        }
    }
    Ok(surface.builder.finish())
}

/// Adds the density of each ball where it reaches.
fn fill(grid: &mut DensityGrid, balls: &[Metaball], reach: f64) {
    let [columns, rows, layers] = grid.counts;
    for ball in balls {
        let radius = DVec3::splat(reach * ball.radius);
        let place = |point: DVec3| ((point - grid.low) / grid.step).to_array();
        let from = place(ball.middle - radius).map(|number| number.floor().max(0.0) as usize);
        let to = place(ball.middle + radius).map(|number| number.ceil() as usize);
        for z in from[2]..=to[2].min(layers - 1) {
            for y in from[1]..=to[1].min(rows - 1) {
                for x in from[0]..=to[0].min(columns - 1) {
                    let index = (z * rows + y) * columns + x;
                    let (own, _) = density(std::slice::from_ref(ball), reach, grid.point(index));
                    grid.densities[index] += own as f32;
                }
            }
        }
    }
}

/// The cells that the surface passes through.
fn cells(grid: &DensityGrid) -> Vec<usize> {
    let [columns, rows, layers] = grid.counts;
    let mut cells = Vec::new();
    for z in 0..layers - 1 {
        for y in 0..rows - 1 {
            for x in 0..columns - 1 {
                let cell = (z * rows + y) * columns + x;
                let inside = (0..8).filter(|corner| grid.is_inside(grid.corner(cell, *corner))).count();
                if inside % 8 != 0 {
                    cells.push(cell);
                }
            }
        }
    }
    cells
}

struct MetaballSurface<'a> {
    balls: &'a [Metaball],
    reach: f64,
    low: DVec3,
    size: DVec3,
    grid: &'a DensityGrid,
    /// The vertices on edges between two points of the grid.
    known: HashMap<[usize; 2], u32>,
    builder: MeshBuilder,
}

impl MetaballSurface<'_> {
    /// Adds the part of the surface in a tetrahedron, counter-clockwise seen from where the density is lower.
    fn cut(&mut self, corners: [usize; 4]) {
        let inside = corners.map(|corner| self.grid.is_inside(corner));
        let count = inside.iter().filter(|inside| **inside).count();
        // One corner stands apart.
        for [a, b, c, d] in [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]] {
            if (count == 1 && inside[a]) || (count == 3 && !inside[a]) {
                let [ab, ac, ad] = [b, c, d].map(|other| self.vertex(corners[a], corners[other]));
                self.builder.triangle(if count == 1 { [ab, ac, ad] } else { [ab, ad, ac] });
            }
        }
        for [a, b, c, d] in
            [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]]
        {
            if count == 2 && inside[a] && inside[b] {
                let edges = [(a, c), (a, d), (b, d), (b, c)];
                let quad = edges.map(|(from, to)| self.vertex(corners[from], corners[to]));
                self.builder.quad(quad);
            }
        }
    }

    /// The vertex on an edge, one end of which is inside.
    fn vertex(&mut self, a: usize, b: usize) -> u32 {
        let edge = [a.min(b), a.max(b)];
        if let Some(known) = self.known.get(&edge) {
            return *known;
        }
        let [mut near, mut far] = edge.map(|end| {
            let point = self.grid.point(end);
            (point, density(self.balls, self.reach, point).0 - 1.0)
        });
        let (mut found, mut side) = (near.0, 0);
        // False position; the weight of an end that stays is halved (Illinois method).
        for _ in 0..STEPS {
            let part = if near.1 == far.1 { 0.5 } else { near.1 / (near.1 - far.1) };
            found = near.0.lerp(far.0, part.clamp(0.0, 1.0));
            let value = density(self.balls, self.reach, found).0 - 1.0;
            if (value >= 0.0) == (far.1 >= 0.0) {
                far = (found, value);
                near.1 *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                near = (found, value);
                far.1 *= if side == 2 { 0.5 } else { 1.0 };
                side = 2;
            }
        }
        let (_, gradient) = density(self.balls, self.reach, found);
        let uv = [(found.x - self.low.x) / self.size.x, 1.0 - (found.y - self.low.y) / self.size.y];
        let vertex = self.builder.vertex(ShapeVertex { position: found, normal: -gradient, uv });
        self.known.insert(edge, vertex);
        vertex
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{area_of, is_closed, made, volume_of};
    use super::*;
    use crate::math::Vec3;
    use crate::world::Shape;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn shape(points: &[Vec3], radius_m: &[f32], reach: f32) -> Shape {
        Shape::Metaballs { points: points.to_vec(), radius_m: radius_m.to_vec(), reach, segments: None }
    }

    #[test]
    fn single_balls_are_spheres_of_their_radius() {
        let two = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(9.0, 2.0, 3.0)];
        let mesh = made(&shape(&two, &[0.5, 2.0], 2.0), Fineness::Relative(1e-3));
        let (area, volume) = (4.0 * PI * 4.25, 4.0 / 3.0 * PI * 8.125);
        assert!(is_closed(&mesh));
        assert!((area_of(&mesh) / area - 1.0).abs() < 4e-3, "{}", area_of(&mesh));
        assert!((volume_of(&mesh) / volume - 1.0).abs() < 4e-3, "{}", volume_of(&mesh));
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            let (middle, radius) = if position.x < 5.0 { (two[0], 0.5) } else { (two[1], 2.0) };
            let way = *position - middle;
            assert!((way.length() - radius).abs() < 2e-5, "{position}");
            assert!((way / radius - *normal).length() < 1e-3, "{position} {normal}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Any balls make closed bodies, whose vertices lie on the surface and whose normals are its own.
        #[test]
        fn surfaces_are_closed_and_have_the_density_1(
            balls in prop::collection::vec((prop::array::uniform3(-1.0f32..1.0), 0.2f32..0.8), 1..7),
            reach in 1.2f32..3.0,
        ) {
            let (points, radii): (Vec<Vec3>, Vec<f32>) = balls.iter().map(|(p, r)| (Vec3::from(*p), *r)).unzip();
            let mesh = made(&shape(&points, &radii, reach), Fineness::Relative(1e-2));
            prop_assert!(is_closed(&mesh) && volume_of(&mesh) > 0.0);
            let balls: Vec<Metaball> = points.iter().zip(&radii)
                .map(|(point, radius)| Metaball { middle: point.as_dvec3(), radius: f64::from(*radius) }).collect();
            for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
                let (value, gradient) = density(&balls, f64::from(reach), position.as_dvec3());
                prop_assert!((value - 1.0).abs() < 1e-3 * (1.0 + gradient.length()), "{}", value);
                prop_assert!(gradient.length() < 1e-2 || normal.as_dvec3().dot(-gradient.normalize()) > 0.999);
            }
        }
    }
}
