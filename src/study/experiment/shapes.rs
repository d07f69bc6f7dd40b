//! Made-up meshes of any size, and rays to trace through them.

use std::f64::consts::TAU;

use crate::math::Vec3;
use crate::query::RayBatch;
use crate::world::Mesh;

/// A unit ball with bumps, of about as many triangles.
pub(super) fn ball(triangles: u32) -> Mesh {
    let rows = ((f64::from(triangles) / 4.0).sqrt().round() as u32).max(3);
    let columns = 2 * rows;
    let mut mesh = Mesh { name: "ball".into(), ..Mesh::default() };
    for row in 0..=rows {
        for column in 0..=columns {
            let phi = f64::from(column) / f64::from(columns) * TAU;
            let theta = f64::from(row) / f64::from(rows) * TAU / 2.0;
            let radius = 1.0 + 0.04 * libm::sin(24.0 * phi) * libm::sin(24.0 * theta);
            let ring = radius * libm::sin(theta);
            let place = [libm::cos(phi) * ring, libm::cos(theta) * radius, -libm::sin(phi) * ring];
            mesh.positions.push(Vec3::from_array(place.map(|c| c as f32)));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let corner = row * (columns + 1) + column;
            let below = corner + columns + 1;
            mesh.triangles.extend([[corner, below, below + 1], [corner, below + 1, corner + 1]]);
        }
    }
    mesh
}

/// As many triangles in a cube from −1 to 1, so small that a ray meets a few of them however
/// many there are.
pub(super) fn cloud(triangles: u32) -> Mesh {
    let mut mesh = Mesh { name: "cloud".into(), ..Mesh::default() };
    let (places, turns) = (Spread::<3>::new(), Spread::<6>::new());
    let edge = 1.5 / f64::from(triangles.max(1)).sqrt();
    for i in 0..triangles {
        let center = places.at(i).map(|c| 2.0 * c - 1.0);
        let turn = turns.at(i.wrapping_add(triangles));
        for corner in 0..3 {
            let offset =
                |axis: usize| edge * libm::sin(TAU * (turn[axis] + turn[axis + 3] + f64::from(corner) / 3.0));
            let place = [0, 1, 2].map(|axis| (center[axis] + offset(axis)) as f32);
            mesh.positions.push(Vec3::from_array(place));
        }
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

/// Rays from a sphere around the unit ball to places in it, in no order.
pub(super) fn rays(count: u32, seed: u32) -> RayBatch {
    let mut rays = RayBatch::with_capacity(count as usize);
    let places = Spread::<5>::new();
    for i in 0..count {
        let [u, v, x, y, z] = places.at(i.wrapping_add(seed.wrapping_mul(7919)));
        let (height, angle) = (2.0 * u - 1.0, TAU * v);
        let ring = (1.0 - height * height).max(0.0).sqrt();
        let from = [3.0 * ring * libm::cos(angle), 3.0 * height, 3.0 * ring * libm::sin(angle)];
        let to = [x, y, z].map(|c| 1.4 * c - 0.7);
        let origin = Vec3::from_array(from.map(|c| c as f32));
        let direction = Vec3::from_array([0, 1, 2].map(|axis| (to[axis] - from[axis]) as f32));
        rays.push(origin, direction.normalize(), 0.0, f32::INFINITY);
    }
    rays
}

/// Points that fill a cube evenly: Martin Roberts's additive sequence (2018), by the positive
/// root g of g^(N + 1) = g + 1.
struct Spread<const N: usize>([f64; N]);

impl<const N: usize> Spread<N> {
    fn new() -> Self {
        let mut root = 1.5;
        for _ in 0..40 {
            root = libm::pow(1.0 + root, 1.0 / (N as f64 + 1.0));
        }
        let mut step = 1.0;
        Self(std::array::from_fn(|_| {
            step /= root;
            step
        }))
    }

    /// The i-th.
    fn at(&self, i: u32) -> [f64; N] {
        self.0.map(|step| (0.5 + step * f64::from(i)).fract())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_have_about_as_many_triangles() {
        for wanted in [100, 1000, 30_000] {
            assert_eq!(cloud(wanted).triangles.len(), wanted as usize);
            let got = ball(wanted).triangles.len() as f64;
            assert!((got / f64::from(wanted) - 1.0).abs() < 0.2, "{got}, not {wanted}");
        }
        for mesh in [ball(500), cloud(500)] {
            assert!(mesh.positions.iter().all(|p| p.is_finite() && p.abs().max_element() < 1.2));
            assert!(mesh.triangles.iter().flatten().all(|i| (*i as usize) < mesh.positions.len()));
        }
        assert_eq!(rays(100, 1).len(), 100);
    }
}
