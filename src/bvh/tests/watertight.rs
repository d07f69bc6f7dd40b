//! Watertightness: rays do not leave a closed surface.

use super::*;

/// A closed star-shaped surface: a subdivided octahedron with bumps.
pub(super) fn bumpy(subdivisions: u32, scale: f32, offset: Vec3) -> Soup {
    let mut points = vec![Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for i in 0..8u32 {
        triangles.push([i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2)]);
    }
    for _ in 0..subdivisions {
        let mut middles = std::collections::HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    points.push((points[i as usize] + points[j as usize]).normalize());
                    points.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    let bumps =
        |p: Vec3| 1.0 + 0.1 * (libm::sinf(17.0 * p.x) + libm::sinf(13.0 * p.y) * libm::cosf(11.0 * p.z));
    let positions = points.iter().map(|p| (*p * bumps(*p) * scale + offset).to_array()).collect();
    Soup { positions, triangles, ..Soup::default() }
}

/// Rays from points inside to vertices, edges and random points.
fn rays_from_within(soup: &Soup, random: &mut Stream, scale: f32, offset: Vec3) -> Vec<Ray<f32>> {
    let mut rays = Vec::new();
    let inside = |random: &mut Stream| {
        let p = Vec3::from_array(std::array::from_fn(|_| random.random_range(-0.25f32..0.25)));
        p * scale + offset
    };
    for i in 0..soup.triangles.len() {
        let [a, b, c] = soup.corners(i);
        let from = inside(random);
        rays.extend([towards(from, a), towards(from, (b + c) * 0.5), towards(offset, b)]);
        let (u, v): (f32, f32) = (random.random(), random.random());
        rays.push(towards(from, a + (b - a) * u + (c - a) * v));
    }
    for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
        rays.push(ray(offset, axis, 0.0, f32::INFINITY));
        rays.push(ray(inside(random), axis, 0.0, f32::INFINITY));
    }
    rays
}

#[test]
fn rays_inside_a_closed_surface_always_hit_it() {
    let mut random = Stream::new(3);
    let far = Vec3::new(1e4, -3e3, 7e3);
    for (scale, offset) in [
        (1.0, Vec3::ZERO),
        (1e-6, Vec3::ZERO),
        (1e6, Vec3::ZERO),
        (1.0, far),
        (1.0, far * 10.0),
        (1e3, -far),
        (1e-2, far * 0.01),
    ] {
        let soup = bumpy(5, scale, offset).all_in_the_world();
        let bvh = soup.build();
        let rays = rays_from_within(&soup, &mut random, scale, offset);
        for (isa, way) in all_kernels() {
            let (hits, occluded) = trace_as(way, isa, &bvh, &rays);
            let out = hits.iter().filter(|hit| hit.is_miss() || !hit.t.is_finite()).count();
            let unblocked = occluded.iter().filter(|o| **o == 0).count();
            assert_eq!((out, unblocked), (0, 0), "{isa:?}, scale {scale}, at {offset}");
        }
    }
}

#[test]
fn rays_inside_a_closed_instance_always_hit_it() {
    let mut random = Stream::new(4);
    let stretch = DVec3::new(3.0, 0.5, -1.0);
    for place in [DVec3::ZERO, DVec3::new(1e3, -300.0, 700.0)] {
        let mut soup = bumpy(4, 1.0, Vec3::ZERO);
        let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.0);
        let matrix = DAffine3::from_scale_rotation_translation(stretch, turn, place);
        let local = rays_from_within(&soup, &mut random, 1.0, Vec3::ZERO);
        soup.placed.push(matrix);
        let bvh = soup.build();
        let rays: Vec<_> = local
            .iter()
            .map(|r| {
                let origin = Vec3::new(r.origin.x, r.origin.y, r.origin.z).as_dvec3();
                let way = Vec3::new(r.direction.x, r.direction.y, r.direction.z).as_dvec3();
                let from = matrix.transform_point3(origin).as_vec3();
                ray(from, matrix.transform_vector3(way).normalize().as_vec3(), 0.0, f32::INFINITY)
            })
            .collect();
        let (hits, occluded) = trace(Isa::detect(), &bvh, &rays);
        assert!(hits.iter().all(|hit| hit.t.is_finite() && hit.instance == 0), "at {place}");
        assert!(occluded.iter().all(|o| *o == 1), "at {place}");
    }
}
