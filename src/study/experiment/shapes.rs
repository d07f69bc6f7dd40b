//! Synthetic meshes of any size, and rays to trace through them.

use std::f64::consts::TAU;

use rand::RngExt;

use crate::math::Vec3;
use crate::query::RayBatch;
use crate::sampling::Stream;
use crate::world::Mesh;

/// A unit ball with bumps, of about this many triangles.
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

/// Exactly this many triangles in a cube from −1 to 1, sized so that a ray hits only a few, however many there are.
pub(super) fn cloud(triangles: u32) -> Mesh {
    let mut mesh = Mesh { name: "cloud".into(), ..Mesh::default() };
    let mut random = Stream::new(0);
    let edge = 1.5 / f64::from(triangles.max(1)).sqrt();
    for i in 0..triangles {
        let center: [f64; 3] = std::array::from_fn(|_| random.random_range(-1.0..1.0));
        let turn: [f64; 6] = random.random();
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

/// Rays in random order from a sphere around the unit ball to points inside it.
pub(super) fn rays(count: u32, seed: u32) -> RayBatch {
    let mut rays = RayBatch::with_capacity(count as usize);
    let mut random = Stream::new(seed.into());
    for _ in 0..count {
        let (height, angle): (f64, f64) = (random.random_range(-1.0..1.0), random.random_range(0.0..TAU));
        let ring = (1.0 - height * height).max(0.0).sqrt();
        let from = [3.0 * ring * libm::cos(angle), 3.0 * height, 3.0 * ring * libm::sin(angle)];
        let to: [f64; 3] = std::array::from_fn(|_| random.random_range(-0.7..0.7));
        let origin = Vec3::from_array(from.map(|c| c as f32));
        let direction = Vec3::from_array([0, 1, 2].map(|axis| (to[axis] - from[axis]) as f32));
        rays.push(origin, direction.normalize(), 0.0, f32::INFINITY);
    }
    rays
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_have_the_requested_number_of_triangles() {
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

    #[test]
    fn clouds_fill_their_cube_and_rays_come_from_all_octants() {
        let (mesh, batch) = (cloud(8000), rays(8000, 1));
        let mut octants = [[0; 8]; 2];
        let octant = |p: Vec3| (0..3).map(|axis| usize::from(p[axis] > 0.0) << axis).sum::<usize>();
        for i in 0..8000 {
            octants[0][octant(mesh.positions[3 * i])] += 1;
            octants[1][octant(Vec3::from_array(batch.rays().origin.map(|column| column[i])))] += 1;
        }
        assert!(octants.as_flattened().iter().all(|count| (850..1150).contains(count)), "{octants:?}");
        let same = |a: &RayBatch, b: &RayBatch| a.rays().origin[0] == b.rays().origin[0];
        assert!(same(&batch, &rays(8000, 1)) && !same(&batch, &rays(8000, 2)));
    }
}
