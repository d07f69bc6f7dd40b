//! A quaternion Julia set (Norton 1982; distance estimate after Hart, Sandin and Kauffman 1989), its surface meshed by
//! naive surface nets.

use std::collections::HashMap;

use glam::{DVec3, DVec4};

use crate::mesh::Polygons;

/// The constant of z² + c.
const C: DVec4 = DVec4::new(-0.291, -0.399, 0.339, 0.437);
/// Cells along each side of the cube.
const CELLS: usize = 112;
/// Half the side of the cube that is searched.
const EXTENT: f64 = 1.35;
/// The distance of the surface from the set: hides details that the grid cannot resolve.
const LEVEL: f64 = 0.008;

/// An estimate of the distance to the set, minus the level.
fn field(p: DVec3) -> f64 {
    let mut z = DVec4::new(p.x, p.y, p.z, 0.0);
    let mut derivative = 1.0;
    for _ in 0..9 {
        let squared = z.length_squared();
        if squared > 64.0 {
            break;
        }
        derivative *= 2.0 * libm::sqrt(squared);
        let twice = 2.0 * z.x;
        z = DVec4::new(2.0 * z.x * z.x - squared, twice * z.y, twice * z.z, twice * z.w) + C;
    }
    let length = libm::sqrt(z.length_squared());
    if length <= 1.0 {
        return -LEVEL;
    }
    0.5 * length * libm::log(length) / derivative - LEVEL
}

fn gradient(p: DVec3, step: f64) -> DVec3 {
    let along = |axis: DVec3| field(p + axis * step) - field(p - axis * step);
    DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)) / (2.0 * step)
}

/// The mesh, about 2 m across, centred at the origin.
pub fn julia() -> Polygons {
    let n = CELLS + 1;
    let cell = 2.0 * EXTENT / CELLS as f64;
    let at =
        |i: usize, j: usize, k: usize| DVec3::new(i as f64, j as f64, k as f64) * cell - DVec3::splat(EXTENT);
    let index = |i: usize, j: usize, k: usize| (k * n + j) * n + i;
    let mut values = vec![0.0; n * n * n];
    for k in 0..n {
        for j in 0..n {
            for i in 0..n {
                values[index(i, j, k)] = field(at(i, j, k));
            }
        }
    }
    let mut mesh = Polygons::default();
    let mut vertex_of: HashMap<usize, u32> = HashMap::new();
    for k in 0..CELLS {
        for j in 0..CELLS {
            for i in 0..CELLS {
                let corner = |c: usize| (i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
                let value = |c: usize| {
                    let (i, j, k) = corner(c);
                    values[index(i, j, k)]
                };
                let (mut sum, mut count) = (DVec3::ZERO, 0.0);
                for a in 0..8 {
                    for axis in [1, 2, 4] {
                        let b = a | axis;
                        if b != a && (value(a) < 0.0) != (value(b) < 0.0) {
                            let (p, q) = (corner(a), corner(b));
                            let t = value(a) / (value(a) - value(b));
                            sum += at(p.0, p.1, p.2).lerp(at(q.0, q.1, q.2), t);
                            count += 1.0;
                        }
                    }
                }
                if count > 0.0 {
                    vertex_of.insert(index(i, j, k), mesh.positions.len() as u32);
                    add_vertex(&mut mesh, sum / count, cell);
                }
            }
        }
    }
    // A quad for each grid edge that crosses the surface, between the vertices of the four cells around it.
    for k in 1..CELLS {
        for j in 1..CELLS {
            for i in 1..CELLS {
                let here = values[index(i, j, k)] < 0.0;
                let steps = [index(1, 0, 0), index(0, 1, 0), index(0, 0, 1)];
                for axis in 0..3 {
                    if here == (values[index(i, j, k) + steps[axis]] < 0.0) {
                        continue;
                    }
                    let (u, v) = (steps[(axis + 1) % 3], steps[(axis + 2) % 3]);
                    let base = index(i, j, k);
                    let mut quad = [base - u - v, base - v, base, base - u].map(|c| vertex_of[&c]);
                    if !here {
                        quad.reverse();
                    }
                    mesh.faces.push(quad.to_vec());
                }
            }
        }
    }
    mesh
}

/// Pulls the point onto the surface, but not out of its cell's neighbourhood.
fn add_vertex(mesh: &mut Polygons, start: DVec3, cell: f64) {
    let mut p = start;
    for _ in 0..4 {
        let g = gradient(p, cell * 0.05);
        let step = g * (field(p) / g.length_squared().max(0.05));
        p -= step.clamp_length_max(cell * 0.25);
    }
    if p.distance(start) > cell * 0.7 {
        p = start;
    }
    let normal = gradient(p, cell * 0.35).normalize_or(DVec3::Y);
    mesh.positions.push(p.to_array().map(|c| c as f32));
    mesh.normals.push((normal + DVec3::ZERO).to_array().map(|c| c as f32));
}
