//! A square of mountains, eroded by rain: drops run downhill, take up soil where they are fast and leave it where they
//! slow down (after Beyer 2015).

use glam::{DVec2, DVec3};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use crate::mesh::{Face, Solid};
use crate::noise::{fractal2, noise};

/// Heights on a square grid of points.
pub struct Terrain {
    /// Points along a side.
    pub side: usize,
    /// Row by row, in metres on a square of one metre.
    pub heights: Vec<f64>,
}

impl Terrain {
    /// The eroded landscape.
    pub fn new(side: usize) -> Self {
        let mut heights = Vec::with_capacity(side * side);
        for j in 0..side {
            for i in 0..side {
                let p = DVec2::new(i as f64, j as f64) / (side - 1) as f64;
                let bend = DVec2::new(fractal2(p * 2.0, 3), fractal2(p * 2.0 + DVec2::new(9.2, 1.3), 3));
                let ridge = 1.0 - noise((p * 2.3 + bend * 0.35).extend(4.5)).abs() * 1.6;
                let rough = fractal2(p * 5.0 + bend * 0.5, 6);
                heights.push(0.30 * (0.62 * ridge.max(0.0) * ridge + 0.5 * rough + 0.12).max(0.02));
            }
        }
        let mut terrain = Self { side, heights };
        terrain.erode(60_000);
        terrain
    }

    /// Height and slope at a point in grid units.
    fn at(&self, p: DVec2) -> (f64, DVec2) {
        let (i, j) = (p.x as usize, p.y as usize);
        let f = p - DVec2::new(i as f64, j as f64);
        let h = |di: usize, dj: usize| self.heights[(j + dj) * self.side + i + di];
        let slope = DVec2::new(
            (h(1, 0) - h(0, 0)) * (1.0 - f.y) + (h(1, 1) - h(0, 1)) * f.y,
            (h(0, 1) - h(0, 0)) * (1.0 - f.x) + (h(1, 1) - h(1, 0)) * f.x,
        );
        let height = (h(0, 0) * (1.0 - f.x) + h(1, 0) * f.x) * (1.0 - f.y)
            + (h(0, 1) * (1.0 - f.x) + h(1, 1) * f.x) * f.y;
        (height, slope)
    }

    /// Spreads `amount` over the points within two steps.
    fn add(&mut self, p: DVec2, amount: f64) {
        const REACH: f64 = 2.0;
        let last = (self.side - 1) as f64;
        let low = (p - DVec2::splat(REACH)).ceil().max(DVec2::ZERO);
        let high = (p + DVec2::splat(REACH)).floor().min(DVec2::splat(last));
        let mut near = Vec::with_capacity(25);
        for j in low.y as usize..=high.y as usize {
            for i in low.x as usize..=high.x as usize {
                let weight = REACH - p.distance(DVec2::new(i as f64, j as f64));
                if weight > 0.0 {
                    near.push((j * self.side + i, weight));
                }
            }
        }
        let total: f64 = near.iter().map(|n| n.1).sum();
        for (index, weight) in near {
            self.heights[index] += amount * weight / total;
        }
    }

    fn erode(&mut self, drops: usize) {
        let mut random = ChaCha8Rng::seed_from_u64(20);
        let most = (self.side - 2) as f64;
        for _ in 0..drops {
            let mut position = DVec2::new(random.random::<f64>(), random.random::<f64>()) * most;
            let mut direction = DVec2::ZERO;
            let (mut speed, mut water, mut soil) = (1.0, 1.0, 0.0);
            for _ in 0..40 {
                let (height, slope) = self.at(position);
                direction = direction * 0.1 - slope.normalize_or_zero() * 0.9;
                let next = position + direction.normalize_or_zero();
                if next == position || next.min_element() < 0.0 || next.max_element() >= most {
                    break;
                }
                let drop = self.at(next).0 - height;
                let capacity = (-drop).max(0.00002) * speed * water * 2.5;
                if drop > 0.0 || soil > capacity {
                    let left = if drop > 0.0 { drop.min(soil) } else { (soil - capacity) * 0.2 };
                    soil -= left;
                    self.add(position, left);
                } else {
                    let taken = ((capacity - soil) * 0.2).min(-drop);
                    soil += taken;
                    self.add(position, -taken);
                }
                speed = libm::sqrt((speed * speed - drop * 60.0).max(0.0));
                water *= 0.98;
                position = next;
            }
        }
    }

    /// The height at a point in grid units.
    pub fn height(&self, p: DVec2) -> f64 {
        self.at(p.clamp(DVec2::ZERO, DVec2::splat(self.side as f64 - 1.001))).0
    }

    /// The tilt of the ground around a grid point: 0 if flat, towards 1 if steep.
    pub fn steepness(&self, p: DVec2) -> f64 {
        let rise = |step: DVec2| (self.height(p + step) - self.height(p - step)) / 4.0;
        let slope = DVec2::new(rise(DVec2::new(2.0, 0.0)), rise(DVec2::new(0.0, 2.0))).length();
        let slope = slope * (self.side - 1) as f64;
        1.0 - 1.0 / libm::sqrt(1.0 + slope * slope)
    }

    /// A block of land on a square metre about the origin, its cut sides reaching down to y = −0.05.
    pub fn solid(&self) -> Solid {
        let side = self.side;
        let mut solid = Solid::default();
        let place = |k: usize| DVec2::new((k % side) as f64, (k / side) as f64) / (side - 1) as f64;
        for k in 0..side * side {
            let p = place(k);
            solid.vertex(DVec3::new(p.x - 0.5, self.heights[k], p.y - 0.5));
        }
        let uv = |k: u32| {
            let p = place(k as usize);
            DVec2::new(p.x, 1.0 - p.y)
        };
        for j in 0..side - 1 {
            for i in 0..side - 1 {
                let a = (j * side + i) as u32;
                let corners = [a, a + side as u32, a + side as u32 + 1, a + 1];
                solid.faces.push(Face { corners: corners.to_vec(), uvs: corners.map(uv).to_vec(), group: 0 });
            }
        }
        let last = side - 1;
        let mut rim: Vec<usize> = (0..last).map(|j| j * side).collect();
        rim.extend((0..last).map(|i| last * side + i));
        rim.extend((0..last).map(|j| (last - j) * side + last));
        rim.extend((0..last).map(|i| last - i));
        let first = solid.positions.len() as u32;
        for &k in &rim {
            let p = solid.positions[k];
            solid.vertex(DVec3::new(p.x, -0.05, p.z));
        }
        let count = rim.len();
        for k in 0..count {
            let next = (k + 1) % count;
            let corners = vec![first + k as u32, first + next as u32, rim[next] as u32, rim[k] as u32];
            let uvs = vec![uv(rim[k] as u32), uv(rim[next] as u32), uv(rim[next] as u32), uv(rim[k] as u32)];
            solid.faces.push(Face { corners, uvs, group: 1 });
        }
        solid
    }
}
