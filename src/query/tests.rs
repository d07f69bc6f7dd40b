//! Tests of queries against brute force in double precision, of input checks and of ids.

use proptest::prelude::*;
use rand::RngExt;

use super::*;
use crate::math::stream::Stream;
use crate::math::{DAffine3, DQuat, DVec3, Hit, NONE, Vec3};
use crate::simd::Isa;

/// A shape that is added to a builder.
#[derive(Clone, Debug)]
enum Handed {
    Mesh(Vec<[f32; 3]>, Vec<[u32; 3]>),
    Spheres(Vec<[f32; 4]>),
}

#[derive(Clone, Debug, Default)]
struct Input {
    shapes: Vec<Handed>,
    placed: Vec<(u32, DAffine3)>,
}

impl Input {
    fn build(&self) -> Scene {
        let mut builder = SceneBuilder::new();
        for (number, shape) in self.shapes.iter().enumerate() {
            let id = match shape {
                Handed::Mesh(positions, triangles) => builder.add_mesh(positions, triangles),
                Handed::Spheres(spheres) => builder.add_spheres(spheres),
            };
            assert_eq!(id, Ok(ShapeId(number as u32)));
        }
        for (number, (shape, matrix)) in self.placed.iter().enumerate() {
            assert_eq!(builder.place(ShapeId(*shape), matrix), Ok(InstanceId(number as u32)));
        }
        builder.build().expect("a scene")
    }

    /// Returns every primitive that the ray hits, or may hit within rounding: its ids, t, and true if the hit is
    /// certain. All in double precision and without a tree.
    fn meets(&self, ray: &RayParts) -> Vec<(HitPrimitive, f64, bool)> {
        let mut out = Vec::new();
        for (instance, (shape, matrix)) in self.placed.iter().enumerate() {
            let mut add = |primitive: usize, t: f64, is_certain: bool| {
                let instance = InstanceId(instance as u32);
                let place = HitPrimitive { instance, shape: ShapeId(*shape), primitive: primitive as u32 };
                let (low, high) = (f64::from(ray.t_min.max(0.0)), f64::from(ray.t_max));
                // An uncertain hit may be where the ray grazes the primitive, far from here.
                let slack = if is_certain { TOLERANCE } else { 10.0 } / ray.direction.length();
                if t > low - slack && t <= high + slack {
                    out.push((place, t, is_certain && t > low + slack && t <= high - slack));
                }
            };
            match &self.shapes[*shape as usize] {
                Handed::Mesh(positions, triangles) => {
                    for (i, corners) in triangles.iter().enumerate() {
                        let corners = corners.map(|v| matrix.transform_point3(double(positions[v as usize])));
                        meets_triangle(ray, corners, |t, is_certain| add(i, t, is_certain));
                    }
                }
                Handed::Spheres(spheres) => {
                    for (i, sphere) in spheres.iter().enumerate() {
                        meets_sphere(ray, sphere, matrix, |t, is_certain| add(i, t, is_certain));
                    }
                }
            }
        }
        out
    }

    /// The point in the world with the hit's barycentric coordinates on a triangle.
    fn point(&self, place: &HitPrimitive, hit: &Hit) -> Option<DVec3> {
        let (shape, matrix) = &self.placed[place.instance.0 as usize];
        assert_eq!(place.shape, ShapeId(*shape));
        let Handed::Mesh(positions, triangles) = &self.shapes[*shape as usize] else { return None };
        let [a, b, c] = triangles[place.primitive as usize].map(|v| double(positions[v as usize]));
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        Some(matrix.transform_point3(a * (1.0 - u - v) + b * u + c * v))
    }
}

/// Rounding in single precision moves points of these scenes, which are some tens wide, by less than this.
const TOLERANCE: f64 = 2e-4;

struct RayParts {
    origin: DVec3,
    direction: DVec3,
    t_min: f32,
    t_max: f32,
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

fn meets_triangle(ray: &RayParts, [a, b, c]: [DVec3; 3], mut add: impl FnMut(f64, bool)) {
    let normal = (b - a).cross(c - a);
    let across = normal.dot(ray.direction);
    let t = normal.dot(a - ray.origin) / across;
    let point = ray.origin + ray.direction * t;
    // Distances from the three edges, inwards.
    let inside = |a: DVec3, b: DVec3| normal.cross(b - a).normalize().dot(point - a);
    let least = inside(a, b).min(inside(b, c)).min(inside(c, a));
    let slope = across.abs() / (normal.length() * ray.direction.length());
    if slope < 0.02 || normal.length() < 0.02 {
        // Ill-conditioned: any t near it is accepted.
        let t = (a - ray.origin).dot(ray.direction) / ray.direction.length_squared();
        add(t, false);
    } else if least > -TOLERANCE / slope {
        add(t, least > TOLERANCE / slope);
    }
}

fn meets_sphere(ray: &RayParts, sphere: &[f32; 4], matrix: &DAffine3, mut add: impl FnMut(f64, bool)) {
    let inverse = matrix.inverse();
    let center = double([sphere[0], sphere[1], sphere[2]]);
    let o = inverse.transform_point3(ray.origin) - center;
    let d = inverse.transform_vector3(ray.direction);
    let (a, b, r) = (d.dot(d), o.dot(d), f64::from(sphere[3]));
    let closest = (o - d * (b / a)).length();
    let t_middle = -b / a;
    if closest > r * 0.99 && closest < r * 1.01 {
        let half = 0.15 * r / a.sqrt();
        [t_middle - half, t_middle, t_middle + half].into_iter().for_each(|t| add(t, false));
    } else if closest < r {
        let half = ((r * r - closest * closest) / a).sqrt();
        [t_middle - half, t_middle + half].into_iter().for_each(|t| add(t, true));
    }
}

fn random_input(random: &mut Stream) -> Input {
    let mut input = Input::default();
    for _ in 0..random.random_range(1..5) {
        let count = random.random_range(0..25);
        let mut point = |size: f32| -> [f32; 3] { std::array::from_fn(|_| random.random_range(-size..size)) };
        let shape = match count % 3 {
            0 => {
                Handed::Spheres((0..count / 3).map(|_| point(3.0)).map(|[x, y, z]| [x, y, z, 0.5]).collect())
            }
            _ => {
                let mut positions = Vec::new();
                for _ in 0..count {
                    let middle = point(3.0);
                    positions.extend((0..3).map(|_| {
                        let corner = point(1.5);
                        std::array::from_fn(|axis| middle[axis] + corner[axis])
                    }));
                }
                let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
                Handed::Mesh(positions, triangles)
            }
        };
        input.shapes.push(shape);
    }
    for _ in 0..random.random_range(0..9) {
        let shape = random.random_range(0..input.shapes.len()) as u32;
        let mut number = |low: f64, high: f64| random.random_range(low..high);
        let translation = DVec3::new(number(-6.0, 6.0), number(-6.0, 6.0), number(-6.0, 6.0));
        let axis = DVec3::new(number(-1.0, 1.0), number(-1.0, 1.0), number(0.1, 1.0)).normalize();
        let scale = DVec3::new(number(0.5, 2.0), number(0.5, 2.0), number(-2.0, -0.5));
        let rotation = DQuat::from_axis_angle(axis, number(0.0, 6.0));
        input.placed.push(match random.random_range(0..3) {
            0 => (shape, DAffine3::IDENTITY),
            1 => (shape, DAffine3::from_translation(translation)),
            _ => (shape, DAffine3::from_scale_rotation_translation(scale, rotation, translation)),
        });
    }
    input
}

fn random_rays(random: &mut Stream, count: usize) -> (RayBatch, Vec<RayParts>) {
    let (mut batch, mut parts) = (RayBatch::with_capacity(count), Vec::new());
    for i in 0..count {
        let mut point = || Vec3::from_array(std::array::from_fn(|_| random.random_range(-8.0f32..8.0)));
        let (origin, target) = (point(), point() * 0.5);
        let length = [1.0, 1e-4, 3e3][i % 3];
        let direction = (target - origin).normalize() * length;
        let (t_min, t_max) = match i % 4 {
            0 => (2.0 / length, 9.0 / length),
            1 => (-1.0, 20.0 / length),
            _ => (0.0, f32::INFINITY),
        };
        batch.push(origin, direction, t_min, t_max);
        parts.push(RayParts { origin: origin.as_dvec3(), direction: direction.as_dvec3(), t_min, t_max });
    }
    (batch, parts)
}

fn trace(scene: &Scene, isa: Isa, rays: &RayBatch) -> (HitBatch, Vec<u32>) {
    let (mut hits, mut blocked) = (HitBatch::new(rays.len()), vec![7; rays.len()]);
    let mut tracer = scene.tracer_at(isa);
    tracer.closest(rays.rays(), Coherence::Unknown, hits.hits_mut()).expect("equal lengths");
    tracer.any(rays.rays(), Coherence::Unknown, &mut blocked).expect("equal lengths");
    // Rays by themselves hit the same.
    let bits = |h: Hit| (h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.primitive, h.instance);
    for (i, (hit, blocked)) in hits.iter().zip(&blocked).enumerate() {
        let ray = rays.rays().ray(i);
        let (origin, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
        let alone = tracer.closest_one(origin, direction, ray.t_min, ray.t_max);
        assert_eq!(bits(alone), bits(hit), "ray {i} with {isa:?}: {alone:?} and {hit:?}");
        let alone = tracer.any_one(origin, direction, ray.t_min, ray.t_max);
        assert_eq!(u32::from(alone), *blocked, "ray {i} with {isa:?}");
    }
    (hits, blocked)
}

/// Panics if the results differ. Returns the number of rays that hit an instance of the tree, and of those that hit a
/// primitive in the world's own tree.
fn compare_with_brute_force(seed: u64) -> [usize; 2] {
    let mut random = Stream::new(seed);
    let input = random_input(&mut random);
    let scene = input.build();
    let (rays, parts) = random_rays(&mut random, 150);
    let (hits, blocked) = trace(&scene, Isa::detect(), &rays);
    let mut counts = [0; 2];
    for (i, (hit, ray)) in hits.iter().zip(&parts).enumerate() {
        let slack = 4.0 * TOLERANCE / ray.direction.length();
        let t = f64::from(hit.t);
        let meets = input.meets(ray);
        let sure = meets.iter().filter(|m| m.2).map(|m| m.1).fold(f64::INFINITY, f64::min);
        assert!(t <= sure + slack, "ray {i}: {hit:?} instead of {sure}");
        assert_eq!(blocked[i], !hit.is_miss() as u32, "ray {i}");
        let place = scene.locate(&hit);
        assert_eq!(place.is_none(), hit.is_miss(), "ray {i}");
        let Some(place) = place else { continue };
        assert!(hit.t > ray.t_min.max(0.0) && hit.t <= ray.t_max, "ray {i}: {hit:?}");
        let same: Vec<_> = meets.iter().filter(|m| m.0 == place).collect();
        let loose = 10.0 / ray.direction.length();
        let is_near = |m: &&(HitPrimitive, f64, bool)| (m.1 - t).abs() < if m.2 { slack } else { loose };
        assert!(same.iter().any(is_near), "ray {i}: {place:?} {t} {meets:?}");
        if let Some(point) = input.point(&place, &hit)
            && same.iter().all(|m| m.2)
        {
            let distance = (point - (ray.origin + ray.direction * t)).length();
            assert!(distance < 50.0 * TOLERANCE, "ray {i}: {distance}");
        }
        counts[(hit.instance == NONE) as usize] += 1;
    }
    counts
}

#[test]
fn random_scenes_hit_instances_and_world_tree() {
    let counts = (0..80).map(compare_with_brute_force);
    let [placed, world] = counts.fold([0; 2], |sum, count| [sum[0] + count[0], sum[1] + count[1]]);
    assert!(placed > 300 && world > 200, "{placed}, {world}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn hits_match_brute_force(seed: u64) {
        compare_with_brute_force(seed);
    }

    #[test]
    fn hits_are_independent_of_isa_coherence_and_batch_size(seed: u64, size in 1usize..70) {
        let mut random = Stream::new(seed);
        let scene = random_input(&mut random).build();
        let (rays, _) = random_rays(&mut random, 150);
        let (expected, any) = trace(&scene, Isa::detect(), &rays);
        let bits = |hits: &HitBatch| -> Vec<_> {
            hits.iter().map(|h| (h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.primitive, h.instance)).collect()
        };
        for isa in Isa::available() {
            for coherence in [Coherence::Unknown, Coherence::Coherent, Coherence::Scattered] {
                let (mut hits, mut blocked) = (HitBatch::new(rays.len()), vec![7; rays.len()]);
                let mut tracer = scene.tracer_at(isa);
                for (rays, hits) in rays.chunks(size).zip(hits.chunks_mut(size)) {
                    tracer.closest(rays, coherence, hits).expect("equal lengths");
                }
                for (rays, blocked) in rays.chunks(size).zip(blocked.chunks_mut(size)) {
                    tracer.any(rays, coherence, blocked).expect("equal lengths");
                }
                prop_assert!(bits(&hits) == bits(&expected), "{:?} {:?} {}", isa, coherence, size);
                prop_assert!(blocked == any, "{:?} {:?} {}", isa, coherence, size);
            }
        }
    }
}

const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
const HALVES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn down(x: f32, y: f32) -> RayBatch {
    let mut rays = RayBatch::default();
    rays.push(Vec3::new(x, y, 5.0), Vec3::NEG_Z, 0.0, f32::INFINITY);
    rays
}

fn place_at(scene: &Scene, x: f32, y: f32) -> Option<(u32, u32, u32)> {
    let hit = trace(scene, Isa::detect(), &down(x, y)).0.get(0)?;
    scene.locate(&hit).map(|p| (p.instance.0, p.shape.0, p.primitive))
}

#[test]
fn locate_returns_ids_of_the_caller() {
    let right = |x: f64| DAffine3::from_translation(DVec3::X * x);
    let mut builder = SceneBuilder::new();
    let unused = builder.add_mesh(&SQUARE, &HALVES).expect("a mesh");
    let twice = builder.add_mesh(&SQUARE, &HALVES).expect("a mesh");
    let empty = builder.add_mesh(&[], &[]).expect("a mesh");
    let balls = builder.add_spheres(&[[0.5, 0.5, 0.0, 0.1], [0.5, 2.5, 0.0, 0.4]]).expect("spheres");
    let once = builder.add_mesh(&SQUARE, &HALVES).expect("a mesh");
    for (shape, x) in [(twice, 10.0), (once, 0.0), (empty, 0.0), (balls, 20.0), (twice, 30.0)] {
        builder.place(shape, &right(x)).expect("an instance");
    }
    // An ellipsoid cannot lie in the world's tree.
    let egg = builder.add_spheres(&[[0.0, 0.0, 0.0, 1.0]]).expect("spheres");
    let stretch = right(40.0) * DAffine3::from_scale(DVec3::new(3.0, 0.5, 1.0));
    builder.place(egg, &stretch).expect("an instance");
    let scene = builder.build().expect("a scene");
    assert_eq!(unused, ShapeId(0));
    for (x, y, expected) in [
        (0.75, 0.25, Some((1, 4, 0))),
        (0.25, 0.75, Some((1, 4, 1))),
        (10.75, 0.25, Some((0, 1, 0))),
        (30.25, 0.75, Some((4, 1, 1))),
        (20.5, 0.5, Some((3, 3, 0))),
        (20.5, 2.5, Some((3, 3, 1))),
        (42.9, 0.0, Some((5, 5, 0))),
        (40.0, 0.6, None),
        (-3.0, 0.5, None),
    ] {
        assert_eq!(place_at(&scene, x, y), expected, "{x}, {y}");
    }
    let Statistics { shapes, instances, triangles, spheres, .. } = *scene.statistics();
    assert_eq!((shapes, instances, triangles, spheres), (6, 6, 4, 3));
    assert!(scene.memory_bytes() > 4 * 36);
    let bounds = scene.bounds().expect("something");
    assert!((bounds.min - Vec3::new(0.0, -0.5, -1.0)).abs().max_element() < 1e-3, "{bounds:?}");
    assert!((bounds.max - Vec3::new(43.0, 2.9, 1.0)).abs().max_element() < 1e-3, "{bounds:?}");
}

#[test]
fn locate_returns_none_for_ids_of_another_scene() {
    let mut builder = SceneBuilder::default();
    let mesh = builder.add_mesh(&SQUARE, &HALVES).expect("a mesh");
    builder.place(mesh, &DAffine3::IDENTITY).expect("an instance");
    let scene = builder.build().expect("a scene");
    for primitive in [0, 1, 2, 1000, crate::bvh::SPHERE, crate::bvh::SPHERE + 5, NONE - 1, NONE] {
        for instance in [NONE, 0, 1, 1000] {
            let place = scene.locate(&Hit { primitive, instance, ..Hit::MISS });
            assert_eq!(place.is_some(), primitive < 2 && instance == NONE, "{primitive} {instance}");
        }
    }
}

#[test]
fn empty_scenes_and_empty_batches_have_no_hits() {
    for scene in [
        Input::default().build(),
        Input { shapes: vec![Handed::Spheres(vec![])], placed: vec![(0, DAffine3::IDENTITY); 2] }.build(),
    ] {
        assert!(scene.bounds().is_none());
        assert_eq!(place_at(&scene, 0.5, 0.5), None);
        let (hits, blocked) = trace(&scene, Isa::PORTABLE, &RayBatch::default());
        assert!(hits.is_empty() && blocked.is_empty());
    }
}

#[test]
fn degenerate_rays_miss() {
    let mut builder = SceneBuilder::default();
    let mesh = builder.add_mesh(&SQUARE, &HALVES).expect("a mesh");
    let ball = builder.add_spheres(&[[0.5, 0.5, 2.0, 0.5]]).expect("spheres");
    for shape in [mesh, ball, ball] {
        builder.place(shape, &DAffine3::IDENTITY).expect("an instance");
    }
    let scene = builder.build().expect("a scene");
    let (o, d, far) = (Vec3::new(0.5, 0.5, 5.0), Vec3::NEG_Z, f32::INFINITY);
    let mut rays = RayBatch::default();
    rays.push(o, Vec3::ZERO, 0.0, far);
    rays.push(o, d, 4.0, 3.0);
    rays.push(o, d, f32::NAN, far);
    rays.push(o, d, 0.0, f32::NAN);
    rays.push(o, d, 0.0, -1.0);
    rays.push(o, d, far, far);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        rays.push(o.with_x(bad), d, 0.0, far);
        rays.push(o.with_z(bad), d, 0.0, far);
        rays.push(o, d.with_y(bad), 0.0, far);
        rays.push(o, d.with_z(bad), 0.0, far);
    }
    for isa in Isa::available() {
        let (hits, blocked) = trace(&scene, isa, &rays);
        for (i, (hit, blocked)) in hits.iter().zip(blocked).enumerate() {
            assert_eq!((hit, blocked), (Hit::MISS, 0), "ray {i} with {isa:?}");
        }
    }
}

/// Scenes of the largest and the smallest size, with the longest and the shortest directions.
#[test]
fn scenes_at_the_size_limits_are_hit() {
    for size in [MAX_COORDINATE, 1e-12] {
        let mut builder = SceneBuilder::default();
        let mesh = builder.add_mesh(&SQUARE.map(|p| p.map(|c| c * size)), &HALVES).expect("a mesh");
        let ball = builder.add_spheres(&[[-0.5 * size, 0.0, 0.0, 0.25 * size]]).expect("spheres");
        for shape in [mesh, ball] {
            builder.place(shape, &DAffine3::IDENTITY).expect("an instance");
        }
        let scene = builder.build().expect("a scene");
        for length in [1e-6, 1.0, 1e6] {
            let mut rays = RayBatch::default();
            for x in [0.75, -0.5] {
                let origin = Vec3::new(x * size, 0.125 * size, 0.75 * size);
                rays.push(origin, Vec3::NEG_Z * length, 0.0, f32::INFINITY);
            }
            let (hits, _) = trace(&scene, Isa::detect(), &rays);
            for (hit, expected) in hits.iter().zip([0.75, 0.75 - 0.046_875f32.sqrt()]) {
                let distance = hit.t * length / size;
                assert!((distance - expected).abs() < 1e-4, "{size} {length}: {distance}, not {expected}");
            }
        }
    }
}

#[test]
fn invalid_input_is_rejected_with_its_index() {
    let mut builder = SceneBuilder::default();
    let mesh = builder.add_mesh(&SQUARE, &HALVES).expect("a mesh");
    let mut bent = SQUARE;
    for bad in [f32::NAN, f32::INFINITY, 2e18] {
        bent[2][1] = bad;
        let error = builder.add_mesh(&bent, &HALVES).expect_err("nowhere");
        assert!(error.to_string().starts_with("shape 1: vertex 2 is at [1.0, "), "{error}");
    }
    let error = builder.add_mesh(&SQUARE, &[[0, 1, 2], [0, 4, 1]]).expect_err("no such vertex");
    assert_eq!(error, BuildError::Index { shape: 1, triangle: 1, index: 4, vertices: 4 });
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let error =
            builder.add_spheres(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, bad]]).expect_err("no sphere");
        assert!(error.to_string().starts_with("shape 1: sphere 1 is at [0.0, 0.0, 0.0]"), "{error}");
    }
    assert!(builder.add_spheres(&[[f32::NAN, 0.0, 0.0, 1.0]]).is_err());
    let error = builder.place(ShapeId(1), &DAffine3::IDENTITY).expect_err("no such shape");
    assert_eq!(error, BuildError::UnknownShape { instance: 0, shape: 1, shapes: 1 });
    for scale in [DVec3::new(1.0, 0.0, 1.0), DVec3::NAN, DVec3::splat(1e-30), DVec3::splat(1e30)] {
        let error = builder.place(mesh, &DAffine3::from_scale(scale)).expect_err("no inverse");
        assert!(matches!(error, BuildError::Transform { instance: 0, .. }), "{error}");
    }
    // The rejected input has left nothing behind.
    builder.place(mesh, &DAffine3::IDENTITY).expect("an instance");
    assert_eq!(place_at(&builder.clone().build().expect("a scene"), 0.75, 0.25), Some((0, 0, 0)));

    // Each is in range, but their product is not.
    let far = builder.add_mesh(&SQUARE.map(|p| p.map(|c| c * 1e10)), &HALVES).expect("a mesh");
    for times in 1..3 {
        let mut builder = builder.clone();
        (0..times).for_each(|_| drop(builder.place(far, &DAffine3::from_scale(DVec3::splat(1e10)))));
        let error = builder.build().expect_err("too far");
        assert_eq!(error, BuildError::OutOfReach { instance: 1, shape: 1 }, "{error}");
    }
}

#[test]
fn columns_of_different_lengths_are_rejected() {
    let scene = Input::default().build();
    let mut tracer = scene.tracer();
    let rays = down(0.0, 0.0);
    let mut hits = HitBatch::new(2);
    let error = tracer.closest(rays.rays(), Coherence::Unknown, hits.hits_mut()).expect_err("two for one");
    assert_eq!(error, LengthMismatch { column: "t", length: 2, rays: 1 });
    let error = tracer.any(rays.rays(), Coherence::Unknown, &mut []).expect_err("none for one");
    assert_eq!(error.to_string(), "blocked has 0 entries, and there are 1 rays (entries of t_max)");
    let mut short = rays.rays();
    short.direction[1] = &[];
    let error = tracer.any(short, Coherence::Unknown, &mut [0]).expect_err("no direction");
    assert_eq!(error.column, "direction y");
}

#[test]
fn batches_store_rays_and_split_into_chunks() {
    let mut rays = RayBatch::with_capacity(3);
    for i in 0..3 {
        let i = i as f32;
        rays.push(Vec3::new(i, 10.0 + i, 20.0 + i), Vec3::new(-i, 1.0, 2.0), 0.5 * i, 100.0 + i);
    }
    let chunks: Vec<Rays> = rays.chunks(2).collect();
    assert_eq!(chunks.iter().map(Rays::len).collect::<Vec<_>>(), [2, 1]);
    assert_eq!(chunks[1].origin.map(|column| column[0]), [2.0, 12.0, 22.0]);
    assert_eq!(chunks[1].direction.map(|column| column[0]), [-2.0, 1.0, 2.0]);
    assert_eq!((chunks[1].t_min, chunks[1].t_max), (&[1.0][..], &[102.0][..]));
    assert_eq!(rays.chunks(0).count(), 3);
    assert_eq!(rays.chunks(usize::MAX).count(), 1);
    rays.clear();
    assert!(rays.is_empty() && rays.chunks(4).count() == 0);

    let mut hits = HitBatch::new(2);
    hits.resize(5);
    assert_eq!(hits.iter().len(), 5);
    assert!(hits.iter().all(|hit| hit == Hit::MISS) && hits.get(5).is_none());
    assert_eq!(hits.chunks_mut(2).map(|part| part.t.len()).collect::<Vec<_>>(), [2, 2, 1]);
}

#[test]
fn scene_types_are_send_and_sync() {
    fn check<T: Send + Sync>() {}
    check::<Scene>();
    check::<SceneBuilder>();
    check::<Tracer>();
}
