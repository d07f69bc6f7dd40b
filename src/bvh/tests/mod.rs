//! The tree against oracles: all primitives by the canonical tests without any culling, where every bit must agree, and
//! all primitives in double precision.

mod building;
mod kernels;
mod oracle;
mod watertight;

use std::num::Wrapping;

use glam::{DAffine3, DQuat, DVec3};
use proptest::prelude::*;
use rand::RngExt;

use self::oracle::{bracket, oracle, oracle_of};
use crate::bvh::layout::Instance;
use crate::bvh::layout::sidedness::PrimitiveRef;
use crate::bvh::*;
use crate::math::hash::combine;
use crate::math::stream::Stream;
use crate::math::{Hit, NONE, Ray, Vec3, Vector};
use crate::simd::Isa;

/// Geometry, divided between the world and one subtree, and the placements of the subtree.
#[derive(Default)]
struct Soup {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    spheres: Vec<[f32; 4]>,
    /// The numbers of triangles and spheres in the world; the rest is in the subtree.
    world: [usize; 2],
    placed: Vec<DAffine3>,
}

impl Soup {
    fn all_in_the_world(mut self) -> Soup {
        self.world = [self.triangles.len(), self.spheres.len()];
        self
    }

    fn build(&self) -> Bvh {
        let geometry = PrimitiveArrays {
            positions: &self.positions,
            triangles: &self.triangles,
            spheres: &self.spheres,
        };
        let [t, s] = self.world.map(|n| n as u32);
        let mut bvh = Bvh::default();
        let subtree = bvh.add_tree(&geometry, t..self.triangles.len() as u32, s..self.spheres.len() as u32);
        for matrix in &self.placed {
            if let Some(root) = subtree {
                bvh.instances.push(Instance::new(matrix, root));
            }
        }
        bvh.add_root(&geometry, 0..t, 0..s);
        bvh.validate().expect("a sound tree");
        bvh
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| Vec3::from_array(self.positions[v as usize]))
    }

    fn push_triangle(&mut self, corners: [[f32; 3]; 3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.push([first, first + 1, first + 2]);
    }
}

fn ray(origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> Ray<f32> {
    let vector = |v: Vec3| Vector { x: v.x, y: v.y, z: v.z };
    Ray { origin: vector(origin), direction: vector(direction), t_min, t_max }
}

fn towards(from: Vec3, to: Vec3) -> Ray<f32> {
    let way = to.as_dvec3() - from.as_dvec3();
    ray(from, way.try_normalize().unwrap_or(DVec3::X).as_vec3(), 0.0, f32::INFINITY)
}

/// Accepts half of the hits, by a hash.
struct Riddle;

impl HitPredicate for Riddle {
    fn accepts(&self, ray: usize, crossing: &Crossing) -> bool {
        let Hit { primitive, instance, .. } = crossing.hit;
        let numbers = [ray as u32, primitive, instance, crossing.front as u32].map(Wrapping);
        numbers.into_iter().reduce(combine).is_some_and(|hash| hash.0 & 1 == 0)
    }
}

/// Runs all queries with one instruction set.
fn trace(isa: Isa, bvh: &Bvh, rays: &[Ray<f32>]) -> (Vec<Hit>, Vec<u32>) {
    trace_as(
        QueueMode { coherence: Coherence::Unknown, streams: true, sides: FaceCulling::AsBuilt },
        isa,
        bvh,
        rays,
    )
}

/// [`trace`] with the kernels for a kind of queue.
fn trace_as(way: QueueMode, isa: Isa, bvh: &Bvh, rays: &[Ray<f32>]) -> (Vec<Hit>, Vec<u32>) {
    let QueueMode { coherence, streams, sides } = way;
    let (mut stack, mut occluded) = (Stack::new(bvh), vec![7; rays.len()]);
    stack.least_stream = if streams { 1 } else { usize::MAX };
    let hits = in_columns(rays, |view, hits| {
        let view = Rays { filter: view.filter.with_culling(sides), ..view };
        closest(isa, bvh, view, coherence, &mut stack, hits);
        super::any(isa, bvh, view, coherence, &mut stack, &mut occluded);
    });
    (hits, occluded)
}

/// Runs a query on columns of rays and returns what it writes.
fn in_columns(rays: &[Ray<f32>], query: impl FnOnce(Rays, HitsMut)) -> Vec<Hit> {
    let column = |f: fn(&Ray<f32>) -> f32| rays.iter().map(f).collect::<Vec<_>>();
    let columns = [
        column(|r| r.origin.x),
        column(|r| r.origin.y),
        column(|r| r.origin.z),
        column(|r| r.direction.x),
        column(|r| r.direction.y),
        column(|r| r.direction.z),
        column(|r| r.t_min),
        column(|r| r.t_max),
    ];
    let [ox, oy, oz, dx, dy, dz, t_min, t_max] = &columns;
    let filter = AnyHitFilter::new(&Riddle, 0);
    let view = Rays { origin: [ox, oy, oz], direction: [dx, dy, dz], t_min, t_max, filter };
    let n = rays.len();
    let (mut t, mut u, mut v) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let (mut primitive, mut instance) = (vec![0; n], vec![0; n]);
    let hits =
        HitsMut { t: &mut t, u: &mut u, v: &mut v, primitive: &mut primitive, instance: &mut instance };
    query(view, hits);
    (0..n)
        .map(|i| Hit { t: t[i], u: u[i], v: v[i], primitive: primitive[i], instance: instance[i] })
        .collect()
}

fn bits(hit: &Hit) -> [u32; 5] {
    [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.primitive, hit.instance]
}

/// The number of triangles in all leaves, parts of the same one included.
fn held(bvh: &Bvh) -> usize {
    bvh.triangles.iter().flat_map(|block| block.words).filter(|word| PrimitiveRef(*word).is_used()).count()
}

/// Checks that every kernel matches the oracle to the last bit with every instruction set, both if every hit counts and
/// if many are rejected.
fn agree(soup: &Soup, rays: &[Ray<f32>]) {
    agree_in_bundles(soup, rays, &[]);
}

/// [`agree`], with the ends of the bundles among the rays.
fn agree_in_bundles(soup: &Soup, rays: &[Ray<f32>], bundles: &[u32]) {
    let mut bvh = soup.build();
    agree_in(&bvh, FaceCulling::AsBuilt, rays, bundles);
    // Leaves of the wide tree may hold several of the binary one. For rays along a split triangle, whose t is all rounding
    // error, it matters which box raises it.
    let is_whole = held(&bvh) == soup.triangles.len();
    if soup.world[0] > 0 && soup.spheres.is_empty() && soup.placed.is_empty() && is_whole {
        // The binary tree that the wide one is collapsed from. A subtree that is placed nowhere is not part of it.
        let triangles = &soup.triangles[..soup.world[0]];
        let geometry = PrimitiveArrays { positions: &soup.positions, triangles, spheres: &[] };
        let binary = crate::bvh::baseline::binary_traversal::BinaryBvh::new(&geometry);
        let expected: Vec<Hit> = rays.iter().map(|ray| oracle(&bvh, ray, 0)).collect();
        for isa in Isa::available() {
            let found = in_columns(rays, |rays, hits| binary.closest(isa, rays, hits));
            for (found, expected) in found.iter().zip(&expected) {
                assert_eq!(
                    bits(found),
                    bits(expected),
                    "{isa:?}: {found:?}, not {expected:?}, by the binary tree"
                );
            }
        }
    }
    let all = [Sidedness::Always, Sidedness::Front, Sidedness::Back, Sidedness::Filtered];
    let of = |id: u32| all[combine(Wrapping(id), Wrapping(5)).0 as usize % 4];
    let given = |i: usize| [None, Some(Sidedness::Front), Some(Sidedness::Filtered)][i % 3];
    bvh.set_sidedness(of, &(0..soup.placed.len()).map(given).collect::<Vec<_>>());
    for sides in [FaceCulling::AsBuilt, FaceCulling::Opposite, FaceCulling::Off] {
        agree_in(&bvh, sides, rays, bundles);
    }
}

fn agree_in(bvh: &Bvh, sides: FaceCulling, rays: &[Ray<f32>], bundles: &[u32]) {
    let expected: Vec<Hit> = rays.iter().enumerate().map(|(i, ray)| oracle_of(bvh, sides, ray, i)).collect();
    for (isa, way) in all_kernels() {
        let way = QueueMode { sides, ..way };
        let (hits, occluded) = trace_as(way, isa, bvh, rays);
        for (i, (hit, expected)) in hits.iter().zip(&expected).enumerate() {
            let r = &rays[i];
            let of = || {
                let (o, d) = (r.origin, r.direction);
                let ray = format!("{:?} {:?} {} {}", [o.x, o.y, o.z], [d.x, d.y, d.z], r.t_min, r.t_max);
                format!("{isa:?}, {way:?}, ray {i} {ray}")
            };
            assert_eq!(bits(hit), bits(expected), "{hit:?} instead of {expected:?}: {}", of());
            assert_eq!(occluded[i], !expected.is_miss() as u32, "any: {}", of());
        }
    }
    let blocked: Vec<u32> = expected.iter().map(|hit| u32::from(!hit.is_miss())).collect();
    for isa in Isa::available().into_iter().filter(|_| !bundles.is_empty()) {
        let (mut stack, mut occluded) = (Stack::new(bvh), vec![7; rays.len()]);
        in_columns(rays, |view, _| {
            let view = Rays { filter: view.filter.with_culling(sides), ..view };
            any_in_bundles(isa, bvh, view, bundles, &mut stack, &mut occluded);
        });
        assert_eq!(occluded, blocked, "{isa:?}, {sides:?}: in bundles");
    }
}

/// The coherence of a queue, the face culling of its rays, and whether rays that no packet takes are traced in streams
/// or interleaved.
#[derive(Clone, Copy, Debug)]
struct QueueMode {
    coherence: Coherence,
    streams: bool,
    sides: FaceCulling,
}

/// Every instruction set with every kind of queue.
fn all_kernels() -> Vec<(Isa, QueueMode)> {
    let sides = FaceCulling::AsBuilt;
    let kinds = [
        QueueMode { coherence: Coherence::Unknown, streams: false, sides },
        QueueMode { coherence: Coherence::Coherent, streams: true, sides },
        QueueMode { coherence: Coherence::Scattered, streams: false, sides },
        QueueMode { coherence: Coherence::Scattered, streams: true, sides },
    ];
    Isa::available().into_iter().flat_map(|isa| kinds.map(|kind| (isa, kind))).collect()
}

fn within_bracket(soup: &Soup, rays: &[Ray<f32>]) {
    let (hits, _) = trace(Isa::detect(), &soup.build(), rays);
    for (hit, ray) in hits.iter().zip(rays) {
        let (possible, sure) = bracket(soup, ray);
        let t = f64::from(hit.t);
        assert!(t >= possible && t <= sure, "{hit:?} is not in {possible} to {sure}");
    }
}

/// Random geometry. On a coarse grid, much of it is coincident, degenerate and parallel to axes.
fn random_soup(random: &mut Stream, counts: [usize; 4], placed: usize, coarse: bool) -> Soup {
    let coordinate = |random: &mut Stream, size: f32| {
        let c: f32 = random.random_range(-size..size);
        if coarse { (c * 2.0).round() * 0.5 } else { c }
    };
    let mut soup = Soup::default();
    let [world_triangles, world_spheres, triangles, spheres] = counts;
    for _ in 0..world_triangles + triangles {
        let middle: [f32; 3] = std::array::from_fn(|_| coordinate(random, 4.0));
        let corner = |random: &mut Stream| middle.map(|m| m + coordinate(random, 1.5));
        let corners = [corner(random), corner(random), corner(random)];
        soup.push_triangle(corners);
    }
    for _ in 0..world_spheres + spheres {
        let [x, y, z] = std::array::from_fn(|_| coordinate(random, 4.0));
        soup.spheres.push([x, y, z, coordinate(random, 1.0).abs().max(0.25)]);
    }
    soup.world = [world_triangles, world_spheres];
    for _ in 0..placed {
        let mut number = |low: f64, high: f64| random.random_range(low..high);
        let axis = DVec3::new(number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0));
        let rotation = DQuat::from_axis_angle(axis.try_normalize().unwrap_or(DVec3::X), number(0.0, 6.0));
        let scale = DVec3::new(number(0.2, 2.0), number(0.2, 2.0), number(-2.0, -0.2));
        let place = DVec3::new(number(-4.0, 4.0), number(-4.0, 4.0), number(-4.0, 4.0));
        soup.placed.push(DAffine3::from_scale_rotation_translation(scale, rotation, place));
    }
    soup
}

/// A ray of one of the kinds that break careless code.
fn random_ray(random: &mut Stream, soup: &Soup, kind: usize) -> Ray<f32> {
    let point = |random: &mut Stream| -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| random.random_range(-6.0f32..6.0)))
    };
    let (from, to) = (point(random), point(random));
    if soup.triangles.is_empty() {
        return towards(from, to);
    }
    let [a, b, c] = soup.corners(random.random_range(0..soup.triangles.len()));
    let [other, ..] = soup.corners(random.random_range(0..soup.triangles.len()));
    let axis = [Vec3::X, Vec3::NEG_Y, Vec3::Z][kind % 3];
    match kind {
        0 => towards(from, to),
        1 => ray(from.round(), axis, 0.0, f32::INFINITY),
        2 => ray(a, -axis, 0.0, f32::INFINITY),
        3 => towards(from, a),
        4 => towards(from, (a + b) * 0.5),
        5 => towards(a, other),
        6 => towards((a + c) * 0.5, to),
        7 => towards(a + (a - b), b + (c - b) * 0.3),
        8 => towards(a + (b - a) * 3.0, a),
        9 => ray(from, Vec3::new(1.0, 1e-40, -0.0), 0.0, f32::INFINITY),
        10 => ray(a - Vec3::Z * 3.0, Vec3::new(-1e-42, -0.0, 1.0), 0.0, f32::INFINITY),
        11 => ray(Vec3::new(from.x, a.y, from.z), Vec3::new(0.6, 0.0, 0.8), 0.0, f32::INFINITY),
        12 => {
            let near = random.random_range(0.0f32..4.0);
            Ray { t_min: near, t_max: near + random.random_range(0.0f32..4.0), ..towards(from, to) }
        }
        _ => towards(from * 1000.0, (a + b + c) * (1.0 / 3.0)),
    }
}

const KINDS: usize = 14;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// t_min itself is excluded, t_max itself is included.
    #[test]
    fn ends_of_the_t_range_are_exact(seed: u64) {
        let mut random = Stream::new(seed);
        let soup = random_soup(&mut random, [40, 10, 5, 5], 2, false);
        let mut rays: Vec<_> = (0..40).map(|_| random_ray(&mut random, &soup, 0)).collect();
        let (hits, _) = trace(Isa::PORTABLE, &soup.build(), &rays);
        for (ray, hit) in rays.iter_mut().zip(&hits).filter(|(_, hit)| !hit.is_miss()) {
            match random.random_range(0..4) {
                0 => ray.t_max = hit.t,
                1 => ray.t_max = hit.t.next_down(),
                2 => ray.t_min = hit.t,
                _ => ray.t_min = hit.t.next_down(),
            }
        }
        agree(&soup, &rays);
        let (again, _) = trace(Isa::PORTABLE, &soup.build(), &rays);
        for ((ray, hit), before) in rays.iter().zip(&again).zip(&hits).filter(|(_, hit)| !hit.is_miss()) {
            if ray.t_max == before.t || ray.t_min == before.t.next_down() {
                prop_assert_eq!(bits(hit), bits(before));
            } else {
                prop_assert!(hit.is_miss() || (hit.t > ray.t_min && hit.t <= ray.t_max && hit.t != before.t));
            }
        }
    }
}

/// A triangle with collinear corners: by rounding, the ray, which meets their line beside its ends, lay within the
/// triangle for some kernels and missed its box for others.
#[test]
fn rays_through_the_line_of_a_triangle_without_area_miss_it() {
    let mut soup = Soup::default();
    soup.push_triangle([[-1.0, -3.0, -3.0], [0.0, -4.0, -3.0], [-1.5, -2.5, -3.0]]);
    soup.world = [1, 0];
    let way = Vec3::new(0.639_602_1, -0.426_401_44, -0.639_602_1);
    let rays = [ray(Vec3::new(-7.0, 2.0, 0.0), way, 0.0, f32::INFINITY)];
    agree(&soup, &rays);
    assert!(trace(Isa::PORTABLE, &soup.build(), &rays).0[0].is_miss());
    let mut random = Stream::new(11005596259251040305);
    let soup = random_soup(&mut random, [47, 5, 5, 3], 1, true);
    let rays: Vec<_> = (0..8 * KINDS).map(|i| random_ray(&mut random, &soup, i % KINDS)).collect();
    agree(&soup, &rays);
}

#[test]
fn hits_in_a_large_soup_match_the_oracles() {
    let mut random = Stream::new(11);
    let soup = random_soup(&mut random, [3000, 300, 100, 20], 30, false);
    let rays: Vec<_> = (0..50 * KINDS).map(|i| random_ray(&mut random, &soup, i % KINDS)).collect();
    let (hits, _) = trace(Isa::detect(), &soup.build(), &rays);
    let count = |f: fn(&Hit) -> bool| hits.iter().filter(|hit| f(hit)).count();
    assert!(count(|hit| hit.instance != NONE) > 50, "instances are hit");
    assert!(count(|hit| hit.primitive != NONE && hit.primitive & SPHERE != 0) > 50, "spheres are hit");
    assert!(count(Hit::is_miss) > 0, "and sometimes nothing is");
    agree(&soup, &rays);
    within_bracket(&soup, &rays);
}

#[test]
fn first_of_any_number_of_coincident_primitives_is_hit() {
    let straight = towards(Vec3::new(0.2, 0.2, 5.0), Vec3::new(0.2, 0.2, 0.0));
    let beside = towards(Vec3::new(3.0, 0.2, 5.0), Vec3::new(3.0, 0.2, 0.0));
    agree(&Soup::default(), &[straight]);
    let unit = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for copies in [1, 2, 8, 9, 200, 1000] {
        let mut soup = Soup::default();
        (0..copies).for_each(|_| soup.push_triangle(unit));
        let soup = soup.all_in_the_world();
        let (hits, occluded) = trace(Isa::detect(), &soup.build(), &[straight, beside]);
        assert_eq!(hits[0].primitive, 0, "the first of {copies}");
        assert!((hits[0].t - 5.0).abs() < 1e-5);
        assert!(hits[1].is_miss() && occluded == [1, 0]);
        agree(&soup, &[straight, beside]);

        let soup = Soup { spheres: vec![[0.0, 0.0, 0.0, 1.0]; copies], ..Soup::default() }.all_in_the_world();
        let (hits, _) = trace(Isa::detect(), &soup.build(), &[straight, beside]);
        assert_eq!(hits[0].primitive, SPHERE, "the first of {copies}");
        assert!(hits[1].is_miss());
        agree(&soup, &[straight, beside]);
    }
}

/// Unused boxes of a node must stay closed to a ray that is not finite.
#[test]
fn rays_that_are_not_finite_hit_nothing() {
    let mut random = Stream::new(12);
    let soup = random_soup(&mut random, [50, 5, 20, 2], 3, false);
    let good = Vec3::new(0.6, 0.0, 0.8);
    let mut rays = Vec::new();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            let place = Vec3::select(axis.cmpgt(Vec3::ZERO), Vec3::splat(bad), Vec3::ONE);
            rays.push(ray(place, good, 0.0, f32::INFINITY));
            rays.push(ray(Vec3::ONE, place, 0.0, f32::INFINITY));
        }
        rays.push(ray(Vec3::splat(bad), good, 0.0, f32::INFINITY));
        rays.push(ray(Vec3::ONE, Vec3::splat(bad), 0.0, f32::INFINITY));
    }
    for isa in Isa::available() {
        let (hits, occluded) = trace(isa, &soup.build(), &rays);
        assert!(hits.iter().all(Hit::is_miss) && occluded.iter().all(|o| *o == 0), "{isa:?}");
    }
}

#[test]
fn first_of_coincident_instances_is_hit() {
    let mut soup = Soup::default();
    soup.push_triangle([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    soup.placed = vec![DAffine3::IDENTITY; 40];
    let straight = towards(Vec3::new(0.2, 0.2, 5.0), Vec3::new(0.2, 0.2, 0.0));
    let (hits, _) = trace(Isa::detect(), &soup.build(), &[straight]);
    assert_eq!((hits[0].primitive, hits[0].instance), (0, 0));
    agree(&soup, &[straight]);
}

#[test]
fn triangles_without_area_are_never_hit() {
    let mut soup = Soup::default();
    for i in 0..30 {
        let p = [i as f32 * 0.1, 0.0, 0.0];
        soup.push_triangle([p, p, p]);
        soup.push_triangle([p, [1.0, 1.0, 1.0], p]);
        soup.push_triangle([[0.0; 3], [1.0, 2.0, 3.0], [2.0, 4.0, 6.0]]);
    }
    let soup = soup.all_in_the_world();
    let mut random = Stream::new(5);
    let rays: Vec<_> = (0..300).map(|i| random_ray(&mut random, &soup, i % KINDS)).collect();
    agree(&soup, &rays);
    let exact = towards(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO);
    assert!(trace(Isa::detect(), &soup.build(), &[exact]).0[0].is_miss());
}

/// Geometry and rays, scaled alike.
fn scaled(random: &mut Stream, scale: f32) -> (Soup, Vec<Ray<f32>>) {
    let mut soup = random_soup(random, [60, 10, 0, 0], 0, false);
    let mut rays: Vec<_> = (0..10 * KINDS).map(|i| random_ray(random, &soup, i % KINDS)).collect();
    soup.positions.iter_mut().flatten().for_each(|c| *c *= scale);
    soup.spheres.iter_mut().flatten().for_each(|c| *c *= scale);
    for ray in &mut rays {
        ray.origin = ray.origin * scale;
        ray.t_min *= scale;
        ray.t_max *= scale;
    }
    (soup, rays)
}

#[test]
fn hits_in_small_and_large_scenes_match_the_oracle() {
    let mut random = Stream::new(9);
    for scale in [1e-15f32, 1e-9, 1e9, 1e12] {
        let (soup, rays) = scaled(&mut random, scale);
        agree(&soup, &rays);
    }
}

/// Hits may be lost where products under- and overflow, but all instruction sets lose the same ones.
#[test]
fn hits_at_the_limits_of_floats_are_equal_on_all_instruction_sets() {
    let mut random = Stream::new(10);
    for scale in [1e-38f32, 1e-30, 1e-22, 1e-19, 1e19, 1e20, 1e30, 3e37] {
        let (soup, rays) = scaled(&mut random, scale);
        let bvh = soup.build();
        let (expected, blocked) = trace(Isa::PORTABLE, &bvh, &rays);
        for isa in Isa::available() {
            let (hits, occluded) = trace(isa, &bvh, &rays);
            assert!(hits.iter().map(bits).eq(expected.iter().map(bits)), "{isa:?}, scale {scale}");
            assert_eq!(occluded, blocked);
        }
        assert!(expected.iter().all(|hit| !hit.t.is_nan()));
    }
}

/// All numbers of a tree.
fn words(bvh: &Bvh) -> Vec<u32> {
    let mut words = Vec::new();
    for node in &bvh.nodes {
        words.extend(node.planes.as_flattened().as_flattened().iter().map(|c| c.to_bits()));
        words.extend(node.child);
    }
    for block in &bvh.triangles {
        words.extend(block.vertex.as_flattened().as_flattened().iter().map(|c| c.to_bits()));
        words.extend(block.words);
    }
    for block in &bvh.spheres {
        words.extend(block.center.as_flattened().iter().chain(&block.radius).map(|c| c.to_bits()));
        words.extend(block.words);
    }
    words.push(bvh.root.map_or(NONE, |root| root.child.0));
    words
}

#[test]
fn tree_does_not_depend_on_the_number_of_threads() {
    let mut random = Stream::new(6);
    let mut soup = random_soup(&mut random, [200_000, 20_000, 0, 0], 0, false);
    // Zeros of both signs, which compare as equal.
    for (i, position) in soup.positions.iter_mut().enumerate() {
        if i % 3 == 0 {
            position[i % 2] = if i % 5 < 2 { 0.0 } else { -0.0 };
        }
    }
    let build = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        words(&pool.install(|| soup.build()))
    };
    let expected = build(1);
    assert!(expected.len() > 2_000_000);
    for threads in [2, 5] {
        assert!(build(threads) == expected, "{threads} threads build another tree");
    }
}
