//! The kernels for queues (packets, interleaved rays, single rays) against the oracle.

use super::*;

/// The arrangement of the rays of a queue.
#[derive(Clone, Copy, Debug)]
enum Arrangement {
    /// Rays of all kinds that break careless code.
    Mixed,
    FromOnePoint,
    ToOnePoint,
    Parallel,
    /// Between two small squares, as from a lens or to a light.
    BetweenSquares,
    /// In bundles from neighbouring points to one point each, some of them wide, and a few rays behind the last.
    Bundles,
    /// In all directions, behind some that are coherent.
    Scattered,
}

const ARRANGEMENTS: [Arrangement; 7] = [
    Arrangement::Mixed,
    Arrangement::FromOnePoint,
    Arrangement::ToOnePoint,
    Arrangement::Parallel,
    Arrangement::BetweenSquares,
    Arrangement::Bundles,
    Arrangement::Scattered,
];

fn point(random: &mut Stream, size: f32) -> Vec3 {
    Vec3::from_array(std::array::from_fn(|_| random.random_range(-size..size)))
}

/// A queue of rays, a few of which are `odd`: incoherent or invalid; and the ends of its bundles.
fn queue(
    random: &mut Stream,
    soup: &Soup,
    kind: Arrangement,
    count: usize,
    odd: bool,
) -> (Vec<Ray<f32>>, Vec<u32>) {
    let (from, to) = (point(random, 7.0), point(random, 3.0));
    let end = if random.random() { random.random_range(2.0..20.0) } else { f32::INFINITY };
    let (mut rays, mut bundles) = (Vec::new(), Vec::new());
    if let Arrangement::Bundles = kind {
        while rays.len() < count {
            let (from, to) = (point(random, 5.0), point(random, 5.0));
            let wide = [0.0, 0.05, 0.5, 4.0][random.random_range(0..4)];
            for _ in 0..random.random_range(0..70) {
                let origin = if wide > 0.0 { from + point(random, wide) } else { from };
                let way = to - origin;
                rays.push(ray(origin, way.normalize_or(Vec3::Y), 0.0, way.length() * 0.999));
            }
            bundles.push(rays.len() as u32);
        }
        rays.extend((0..5).map(|_| towards(point(random, 6.0), point(random, 6.0))));
        return (rays, bundles);
    }
    for i in 0..count {
        let (a, b) = (point(random, 0.4), point(random, 0.4));
        let ray = match kind {
            Arrangement::Mixed => random_ray(random, soup, i % KINDS),
            Arrangement::FromOnePoint => towards(from, to + a),
            Arrangement::ToOnePoint => towards(from + a, to),
            Arrangement::Scattered if i > count / 4 => towards(point(random, 6.0), point(random, 4.0)),
            Arrangement::Parallel | Arrangement::Scattered => towards(from + a, to + a),
            Arrangement::BetweenSquares | Arrangement::Bundles => towards(from + a, to + b),
        };
        let ray = Ray { t_max: ray.t_max.min(end), ..ray };
        rays.push(if odd && i % 17 == 3 { random_odd(random, ray, i / 17) } else { ray });
    }
    (rays, bundles)
}

fn random_odd(random: &mut Stream, ray: Ray<f32>, kind: usize) -> Ray<f32> {
    let other = towards(point(random, 6.0), point(random, 6.0));
    match kind % 6 {
        0 => Ray { t_max: -1.0, ..ray },
        1 => Ray { t_max: f32::NAN, ..ray },
        2 => Ray { direction: Vector { x: 0.0, y: 0.0, z: 0.0 }, ..ray },
        3 => Ray { origin: Vector { x: f32::NAN, ..ray.origin }, ..ray },
        4 => Ray { t_min: 3.0, ..ray },
        _ => other,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(160))]

    /// Every arrangement of rays, with every kernel.
    #[test]
    fn hits_match_the_oracles_in_every_kernel(
        seed: u64,
        counts in [1usize..400, 0usize..12, 0usize..20, 0usize..10],
        placed in 0usize..4,
        few: bool,
        kind in prop::sample::select(ARRANGEMENTS.to_vec()),
        length in 1usize..300,
        coarse: bool,
        odd: bool,
    ) {
        let mut random = Stream::new(seed);
        // Trees of a few leaves are not traversed, and have their own kernel for bundles.
        let (counts, placed) = if few { ([counts[0] % 60, counts[1], 0, 0], 0) } else { (counts, placed) };
        let soup = random_soup(&mut random, counts, placed, coarse);
        let (rays, bundles) = queue(&mut random, &soup, kind, length, odd);
        agree_in_bundles(&soup, &rays, &bundles);
        if !odd {
            within_bracket(&soup, &rays);
        }
    }
}

/// Rays of a packet that run along an axis, an edge or a plane of a box.
#[test]
fn hits_of_packets_along_axes_match_the_oracle() {
    let mut random = Stream::new(21);
    let soup = random_soup(&mut random, [500, 0, 0, 0], 0, true);
    for axis in [Vec3::X, Vec3::NEG_Y, Vec3::Z] {
        for turn in [0.0, 1e-40, 1e-8, 1e-3] {
            let side = Vec3::new(axis.y, axis.z, axis.x);
            let rays: Vec<_> = (0..256)
                .map(|i| {
                    let (u, v) = ((i % 16) as f32 * 0.125, (i / 16) as f32 * 0.125);
                    let origin = axis * -8.0 + side * (u - 1.0) + side.cross(axis) * (v - 1.0);
                    let across = side * turn * (i as f32 - 100.0);
                    ray(origin, axis + across, 0.0, f32::INFINITY)
                })
                .collect();
            agree(&soup, &rays);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Enough rays that streams stay dense down to the leaves, and more than fit one stream.
    #[test]
    fn hits_of_many_scattered_rays_match_the_oracle(
        seed: u64, counts in [1usize..200, 0usize..12, 0usize..20, 0usize..10], placed in 0usize..3,
        odd: bool, coarse: bool, length in 1000usize..18_000,
    ) {
        let mut random = Stream::new(seed);
        let soup = random_soup(&mut random, counts, placed, coarse);
        let (rays, _) = queue(&mut random, &soup, Arrangement::Scattered, length, odd);
        agree(&soup, &rays);
    }
}

/// A closed surface, seen from inside by packets through every pixel of a cube's faces.
#[test]
fn packets_inside_a_closed_surface_always_hit_it() {
    for (scale, offset) in [(1.0, Vec3::ZERO), (1e-6, Vec3::ZERO), (1e6, Vec3::ZERO), (1.0, Vec3::splat(1e4))]
    {
        let soup = super::watertight::bumpy(5, scale, offset).all_in_the_world();
        let bvh = soup.build();
        let mut rays = Vec::new();
        for face in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
            let side = Vec3::new(face.y, face.z, face.x);
            for i in 0..64 * 64 {
                let (u, v) = ((i % 64) as f32 / 32.0 - 1.0, (i / 64) as f32 / 32.0 - 1.0);
                let direction = (face + side * u + side.cross(face) * v).normalize();
                rays.push(ray(
                    offset + point(&mut Stream::new(i), 0.1 * scale),
                    direction,
                    0.0,
                    f32::INFINITY,
                ));
            }
        }
        for (isa, way) in all_kernels() {
            let (hits, occluded) = trace_as(way, isa, &bvh, &rays);
            let out = hits.iter().filter(|hit| hit.is_miss() || !hit.t.is_finite()).count();
            let unblocked = occluded.iter().filter(|o| **o == 0).count();
            assert_eq!((out, unblocked), (0, 0), "{isa:?}, {way:?}, scale {scale}, at {offset}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The front of a triangle is where its corners are counter-clockwise, in any space.
    #[test]
    fn front_of_a_triangle_is_where_its_corners_are_counter_clockwise(seed: u64, mirrored: bool) {
        let mut random = Stream::new(seed);
        let corners = [(); 3].map(|()| point(&mut random, 2.0));
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let ray = towards(point(&mut random, 6.0), (corners[0] + corners[1] + corners[2]) / 3.0);
        let direction = Vec3::new(ray.direction.x, ray.direction.y, ray.direction.z);
        prop_assume!(normal.normalize().dot(direction).abs() > 1e-3);
        let mut soup = Soup::default();
        soup.push_triangle(corners.map(|corner| corner.to_array()));
        if mirrored {
            // The same triangle, placed by a mirror.
            soup.positions.iter_mut().for_each(|position| position[0] = -position[0]);
            soup.placed = vec![DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))];
        } else {
            soup.world = [1, 0];
        }
        let mut bvh = soup.build();
        // A mirror reverses the order of corners, but not the sides of what they bound.
        let front = (normal.dot(direction) < 0.0) != mirrored;
        for (sidedness, met) in [(Sidedness::Front, front), (Sidedness::Back, !front), (Sidedness::Always, true)] {
            bvh.set_sidedness(|_| sidedness, &[]);
            for (isa, way) in all_kernels() {
                let (hits, occluded) = trace_as(way, isa, &bvh, &[ray]);
                prop_assert_eq!((!hits[0].is_miss(), occluded[0] == 1), (met, met));
            }
        }
    }
}

/// A surface 600 m from the world's origin and 2 mm from the ray's origin is hit at 2 mm: rotating the ray's origin
/// before translating it would be off by some 0.04 mm.
#[test]
fn distance_to_an_instance_far_from_the_origin_is_exact() {
    let mut random = Stream::new(31);
    let mut soup =
        Soup { positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]], ..Soup::default() };
    soup.triangles = vec![[0, 1, 2]];
    let turned = DQuat::from_euler(glam::EulerRot::XYZ, 0.7, -1.1, 0.4);
    let place = DVec3::new(312.0625, -41.5, 507.25);
    soup.placed = vec![DAffine3::from_rotation_translation(turned, place)];
    let bvh = soup.build();
    let normal = turned * DVec3::Z;
    for _ in 0..200 {
        let inside = turned * DVec3::new(random.random_range(-0.2..0.2), random.random_range(-0.2..0.2), 0.0);
        let from = (place + inside + normal * 0.002).as_vec3();
        let to = (-normal + turned * DVec3::X * 0.2).normalize().as_vec3();
        // The distance at which the ray as stored meets the plane.
        let exact = (place - from.as_dvec3()).dot(normal) / to.as_dvec3().dot(normal);
        let ray = ray(from, to, 0.0, f32::INFINITY);
        let mut stack = Stack::new(&bvh);
        let hit = closest_ray(Isa::PORTABLE, &bvh, &ray, AnyHitFilter::ACCEPT_ALL, &mut stack);
        assert!((f64::from(hit.t) - exact).abs() < 1e-6, "{} for {exact}", hit.t);
    }
}
