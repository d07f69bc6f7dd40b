//! The builder: split slivers are hit as whole ones, valid trees of any geometry, the same tree from any number of
//! threads, memory within its bound.

use super::*;
use crate::bvh::build::builder::peak_bytes;
use crate::bvh::build::primitives::Primitives;
use crate::bvh::build::reference::Reference;

/// Long, oblique triangles, which are worth splitting.
fn needles(random: &mut Stream, count: usize) -> Soup {
    let mut soup = Soup::default();
    for _ in 0..count {
        let mut point = || std::array::from_fn::<f32, 3, _>(|_| random.random_range(-4.0f32..4.0));
        let (a, b) = (point(), point());
        let c = a.map(|c| c + random.random_range(0.0f32..0.05));
        soup.push_triangle([a, b, c]);
    }
    soup.all_in_the_world()
}

/// Adds small triangles of all shapes.
fn add_chips(random: &mut Stream, count: usize, soup: &mut Soup) {
    for _ in 0..count {
        let corner: [f32; 3] = std::array::from_fn(|_| random.random_range(-4.0f32..4.0));
        let mut near = || corner.map(|c| c + random.random_range(0.0f32..0.1));
        let corners = [near(), near(), near()];
        soup.push_triangle(corners);
    }
    soup.world[0] += count;
}

/// A tree over whole triangles, all of which are in the world.
fn unsplit(soup: &Soup) -> Bvh {
    let geometry = PrimitiveArrays { positions: &soup.positions, triangles: &soup.triangles, spheres: &[] };
    let mut bvh = Bvh::default();
    let triangles = 0..soup.triangles.len() as u32;
    bvh.root = bvh.add(Primitives::whole(&geometry, triangles, 0..0, Vec::new()));
    bvh
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Rays that graze edges, corners and cuts: the oracle's hit, bit for bit.
    #[test]
    fn split_triangles_are_hit_as_whole_ones(seed: u64, count in 300usize..400) {
        let mut random = Stream::new(seed);
        let soup = needles(&mut random, count);
        let (bvh, whole) = (soup.build(), unsplit(&soup));
        prop_assert_eq!(held(&whole), count);
        prop_assume!(held(&bvh) > count);
        let rays: Vec<_> = (0..8 * KINDS).map(|i| random_ray(&mut random, &soup, i % KINDS)).collect();
        agree(&soup, &rays);
        let (hits, _) = trace(Isa::detect(), &bvh, &rays);
        let (of_whole, _) = trace(Isa::detect(), &whole, &rays);
        for (i, (hit, other)) in hits.iter().zip(&of_whole).enumerate() {
            prop_assert_eq!(hit.is_miss(), other.is_miss());
            // Boxes raise t by rounding errors, which are large for rays along a triangle.
            let near = (hit.t - other.t).abs() <= 1e-4 * other.t.abs().max(1e-3);
            prop_assert!(hit.is_miss() || near || i % KINDS > 0, "{:?} and {:?}", hit, other);
        }
    }
}

#[test]
fn slivers_are_split_where_it_pays() {
    let mut random = Stream::new(21);
    let mut soup = needles(&mut random, 1000);
    add_chips(&mut random, 2000, &mut soup);
    let (bvh, whole) = (soup.build(), unsplit(&soup));
    assert!(held(&bvh) > 3300 && held(&bvh) <= 5000, "{}", held(&bvh));
    let (cost, before) = (bvh.expected_cost(), whole.expected_cost());
    assert!(cost < 0.8 * before, "{cost} and {before}");
    // Slivers along an axis fill their boxes; chips among which there are few slivers are left alone.
    let mut upright = Soup::default();
    for i in 0..3000 {
        let (x, y) = ((i % 60) as f32, (i / 60) as f32);
        upright.push_triangle([[x, y, 0.0], [x + 0.01, y, 0.0], [x, y, 5.0]]);
    }
    let mut chips = Soup::default();
    add_chips(&mut random, 3000, &mut chips);
    for soup in [upright.all_in_the_world(), chips] {
        assert_eq!(words(&soup.build()), words(&unsplit(&soup)));
    }
}

/// Slivers that the sample misses are so vast that each would have hundreds of parts.
#[test]
fn splits_have_a_bound() {
    let mut soup = Soup::default();
    let count = 3 << 14;
    for i in 0..count {
        let size = if i % 3 == 0 { 1.0 } else { 1e3 };
        let at = [(i % 90) as f32, (i / 90 % 90) as f32, 0.0];
        soup.push_triangle([at, [at[0] + 0.01, at[1], 0.0], [at[0] + size, at[1] + size, size]]);
    }
    let soup = soup.all_in_the_world();
    assert!(held(&soup.build()) <= 3 * count);
}

#[test]
fn trees_of_degenerate_and_extreme_triangles_are_valid() {
    let unit = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let line = |i: usize| [[i as f32, 0.0, 0.0], [i as f32 + 3.0, 0.0, 0.0], [i as f32 + 1.0, 0.0, 0.0]];
    let around = |i: usize| {
        let far = 1.0 + i as f32;
        [[-far, -far, 0.0], [far, -far, 0.0], [0.0, 2.0 * far, 0.0]]
    };
    let growing = |i: usize| unit.map(|corner| corner.map(|c| c * 1.05f32.powi(i as i32 % 1500)));
    type Shape<'a> = &'a dyn Fn(usize) -> [[f32; 3]; 3];
    let shapes: [Shape; 5] = [&|_| unit, &|i| [[i as f32; 3]; 3], &line, &around, &growing];
    for shape in shapes {
        for scale in [1e-38f32, 1e-20, 1.0, 1e20, 1e37] {
            for count in [1, 2, 7, 8, 9, 17, 1000] {
                let mut soup = Soup::default();
                for i in 0..count {
                    soup.push_triangle(
                        shape(i)
                            .map(|corner| corner.map(|c| (c.min(1e30) * scale).clamp(f32::MIN, f32::MAX))),
                    );
                }
                let soup = soup.all_in_the_world();
                soup.build();
            }
        }
    }
    assert!(Soup::default().build().root.is_none());
}

/// More primitives than a bucket, all in one place, with the other buckets empty.
#[test]
fn coincident_triangles_are_divided() {
    for count in [9_000, 40_000] {
        let mut soup = Soup::default();
        for i in 0..count {
            let far = if i == 0 { 1e6 } else { 0.0 };
            soup.push_triangle([[far, 0.0, 0.0], [far + 1.0, 0.0, 0.0], [far, 1.0, 0.0]]);
        }
        let soup = soup.all_in_the_world();
        assert_eq!(held(&soup.build()), count);
    }
}

#[test]
fn trees_do_not_depend_on_the_number_of_threads() {
    let mut random = Stream::new(22);
    let even = random_soup(&mut random, [60_000, 500, 0, 0], 0, false);
    let mut split = needles(&mut random, 30_000);
    add_chips(&mut random, 30_000, &mut split);
    for soup in [even, split] {
        let build = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            words(&pool.install(|| soup.build()))
        };
        let expected = build(1);
        for threads in [2, 3] {
            assert!(build(threads) == expected, "{threads} threads build another tree");
        }
    }
}

#[test]
fn memory_bound_is_known_and_reported() {
    let mut random = Stream::new(23);
    let soup = needles(&mut random, 2000);
    let bvh = soup.build();
    let parts = held(&bvh);
    assert_eq!(bvh.statistics.peak_bytes, peak_bytes(parts, false) + parts * size_of::<Reference>());
    assert_eq!(unsplit(&soup).statistics.peak_bytes, peak_bytes(2000, false));
    assert!(bvh.statistics.time > std::time::Duration::ZERO);
    let per_triangle = |count: usize| peak_bytes(count, false) as f64 / count as f64;
    assert!(per_triangle(10_000_000) < 120.0, "{}", per_triangle(10_000_000));
    assert!(per_triangle(1_000_000) < 125.0, "{}", per_triangle(1_000_000));
}
