//! The things that are written in all formats.

use rayfront::math::DVec3;

use crate::support::icosphere;

/// A triangle mesh around a point.
#[derive(Clone)]
pub struct Solid {
    pub center: DVec3,
    pub positions: Vec<DVec3>,
    pub normals: Vec<[f32; 3]>,
    /// False if files leave the normals out, and say at most that faces are smooth.
    pub has_normals: bool,
    /// True if normals differ within a face.
    pub is_smooth: bool,
    /// (0, 0) is the image's top left.
    pub uvs: Vec<[f32; 2]>,
    /// On the sRGB curve.
    pub colors: Vec<[u8; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Solid {
    fn empty(center: DVec3) -> Solid {
        Solid {
            center,
            positions: Vec::new(),
            normals: Vec::new(),
            has_normals: true,
            is_smooth: false,
            uvs: Vec::new(),
            colors: Vec::new(),
            triangles: Vec::new(),
        }
    }

    /// A box of 2 × 1.2 × 0.8 m with flat faces: four vertices each.
    pub fn block(center: DVec3) -> Solid {
        let mut block = Solid::empty(center);
        let half = DVec3::new(1.0, 0.6, 0.4);
        for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
            let across = |step: usize| {
                let mut unit = DVec3::ZERO;
                unit[(axis + step) % 3] = 1.0;
                unit
            };
            let (normal, right, up) = (across(0) * sign, across(1) * sign, across(2));
            let first = block.positions.len() as u32;
            for (u, v) in [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)] {
                let corner = normal + right * (2.0 * u - 1.0) + up * (1.0 - 2.0 * v);
                block.positions.push(center + corner * half);
                block.normals.push(normal.as_vec3().to_array());
                block.uvs.push([u as f32, v as f32]);
                let number = block.colors.len() as u8;
                block.colors.push([255 - 9 * number, 128, 40 + 8 * number]);
            }
            block.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        block
    }

    /// A ball of 320 faces, smooth by the mean of the faces around a vertex, weighted by area.
    pub fn ball(center: DVec3) -> Solid {
        let mesh = icosphere(2, |_| 0.8);
        let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|index| mesh.positions[index as usize].as_dvec3());
            for index in triangle {
                sums[*index as usize] += (b - a).cross(c - a);
            }
        }
        let mut ball = Solid::empty(center);
        for (position, sum) in mesh.positions.iter().zip(sums) {
            ball.add(center + position.as_dvec3(), sum.normalize());
        }
        Solid { is_smooth: true, triangles: mesh.triangles, ..ball }
    }

    /// The ball with flat faces: three vertices each.
    pub fn faceted_ball(center: DVec3) -> Solid {
        let smooth = Solid::ball(center);
        let mut ball = Solid::empty(center);
        for triangle in &smooth.triangles {
            let corners @ [a, b, c] = triangle.map(|index| smooth.positions[index as usize]);
            let first = ball.positions.len() as u32;
            corners.into_iter().for_each(|corner| ball.add(corner, (b - a).cross(c - a).normalize()));
            ball.triangles.push([first, first + 1, first + 2]);
        }
        ball
    }

    fn add(&mut self, position: DVec3, normal: DVec3) {
        self.positions.push(position);
        self.normals.push(normal.as_vec3().to_array());
        self.uvs.push([0.5; 2]);
        self.colors.push([128; 3]);
    }

    /// The solid of a file whose Z axis points up: a turn of −90° about X makes it this one.
    pub fn with_z_up(&self) -> Solid {
        let turned = |[x, y, z]: [f32; 3]| [x, -z, y];
        Solid {
            positions: self.positions.iter().map(|p| DVec3::new(p.x, -p.z, p.y)).collect(),
            normals: self.normals.iter().map(|normal| turned(*normal)).collect(),
            center: DVec3::new(self.center.x, -self.center.z, self.center.y),
            ..self.clone()
        }
    }

    pub fn rows(&self) -> impl Iterator<Item = (DVec3, [f32; 3], [f32; 2], [u8; 3])> {
        (0..self.positions.len())
            .map(|at| (self.positions[at], self.normals[at], self.uvs[at], self.colors[at]))
    }
}
