//! The builder: equal hits at every quality, valid trees of any geometry, the same tree from any number of threads,
//! memory within its bound.

use super::*;
use crate::bvh::build::builder::peak_bytes;

const QUALITIES: [BuildQuality; 3] = [BuildQuality::Fast, BuildQuality::Default, BuildQuality::High];

fn build(soup: &Soup, quality: BuildQuality) -> Bvh {
    soup.build_as(quality)
}

/// Long, oblique triangles, which are worth splitting.
fn needles(random: &mut Stream, count: usize) -> Soup {
    let mut soup = Soup::default();
    for _ in 0..count {
        let mut point = || std::array::from_fn::<f32, 3, _>(|_| random.random_range(-4.0f32..4.0));
        let (a, b) = (point(), point());
        let c = a.map(|c| c + random.random_range(0.0f32..0.2));
        soup.push_triangle([a, b, c]);
    }
    soup.all_in_the_world()
}

/// The number of triangles in all leaves, copies included.
fn held(bvh: &Bvh) -> usize {
    bvh.triangles.iter().flat_map(|block| block.words).filter(|word| PrimitiveRef(*word).is_used()).count()
}

fn same_hits(soup: &Soup, rays: &[Ray<f32>]) {
    let [fast, default, high] = QUALITIES.map(|quality| {
        let bvh = build(soup, quality);
        let (hits, occluded) = trace(Isa::detect(), &bvh, rays);
        for ((hit, occluded), ray) in hits.iter().zip(&occluded).zip(rays) {
            assert_eq!(bits(hit), bits(&oracle(&bvh, ray, 0)), "{quality:?}");
            assert_eq!(*occluded, !hit.is_miss() as u32, "{quality:?}");
        }
        hits
    });
    for ((fast, default), high) in fast.iter().zip(&default).zip(&high) {
        for other in [fast, high] {
            assert_eq!(other.is_miss(), default.is_miss(), "{other:?} and {default:?}");
            // Boxes raise t by rounding errors, so equally distant hits may change places.
            let near = (other.t - default.t).abs() <= 1e-4 * default.t.abs().max(1e-3);
            assert!(default.is_miss() || near, "{other:?} and {default:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn hits_do_not_depend_on_quality(
        seed: u64,
        counts in [0usize..200, 0usize..20, 0usize..40, 0usize..10],
        placed in 0usize..4,
        coarse: bool,
    ) {
        let mut random = Stream::new(seed);
        let soup = random_soup(&mut random, counts, placed, coarse);
        let rays: Vec<_> = (0..100).map(|_| random_ray(&mut random, &soup, 0)).collect();
        same_hits(&soup, &rays);
    }

    /// Rays that graze edges, corners and cuts: the oracle's hit, bit for bit.
    #[test]
    fn split_triangles_are_hit_as_whole_ones(seed: u64, count in 20usize..300) {
        let mut random = Stream::new(seed);
        let soup = needles(&mut random, count);
        let bvh = build(&soup, BuildQuality::High);
        let rays: Vec<_> = (0..8 * KINDS).map(|i| random_ray(&mut random, &soup, i % KINDS)).collect();
        let (hits, _) = trace(Isa::detect(), &bvh, &rays);
        let (whole, _) = trace(Isa::detect(), &build(&soup, BuildQuality::Default), &rays);
        for ((hit, whole), ray) in hits.iter().zip(&whole).zip(&rays) {
            prop_assert_eq!(bits(hit), bits(&oracle(&bvh, ray, 0)));
            prop_assert_eq!(hit.is_miss(), whole.is_miss());
        }
        same_hits(&soup, &rays[..rays.len() / KINDS]);
    }
}

#[test]
fn long_triangles_are_split_within_the_budget() {
    let mut random = Stream::new(21);
    let mut soup = needles(&mut random, 100);
    for _ in 0..2900 {
        let corner: [f32; 3] = std::array::from_fn(|_| random.random_range(-4.0f32..4.0));
        let mut near = || corner.map(|c| c + random.random_range(0.0f32..0.1));
        let corners = [near(), near(), near()];
        soup.push_triangle(corners);
    }
    let soup = soup.all_in_the_world();
    let [fast, default, high] = QUALITIES.map(|quality| build(&soup, quality));
    assert_eq!((held(&fast), held(&default)), (3000, 3000));
    let budget = super::super::build::spatial::budget(3000);
    assert!(held(&high) > 3300 && held(&high) <= 3000 + budget, "{}", held(&high));
    let cost = [&fast, &default, &high].map(Bvh::expected_cost);
    assert!(cost[2] < 0.8 * cost[1] && cost[1] <= 1.02 * cost[0], "{cost:?}");
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
                for quality in QUALITIES {
                    build(&soup, quality);
                }
            }
        }
    }
    for quality in QUALITIES {
        assert!(build(&Soup::default(), quality).root.is_none());
    }
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
        for quality in QUALITIES {
            let bvh = build(&soup, quality);
            assert_eq!(held(&bvh), count, "{quality:?}");
        }
    }
}

#[test]
fn trees_of_all_qualities_do_not_depend_on_the_number_of_threads() {
    let mut random = Stream::new(22);
    let mut soup = random_soup(&mut random, [60_000, 500, 0, 0], 0, false);
    let long = needles(&mut random, 5_000);
    for triangle in 0..long.triangles.len() {
        soup.push_triangle(long.corners(triangle).map(|corner| corner.to_array()));
    }
    let soup = soup.all_in_the_world();
    for quality in QUALITIES {
        let build = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            words(&pool.install(|| build(&soup, quality)))
        };
        let expected = build(1);
        for threads in [2, 3] {
            assert!(build(threads) == expected, "{quality:?}: {threads} threads build another tree");
        }
    }
}

#[test]
fn memory_bound_is_known_and_reported() {
    let mut random = Stream::new(23);
    let soup = needles(&mut random, 2000);
    for quality in QUALITIES {
        let bvh = build(&soup, quality);
        assert_eq!(bvh.statistics.peak_bytes, peak_bytes(2000, false, quality));
        assert!(bvh.statistics.time > std::time::Duration::ZERO);
    }
    for quality in QUALITIES {
        let per_triangle = |count: usize| peak_bytes(count, false, quality) as f64 / count as f64;
        assert!(per_triangle(10_000_000) < 120.0, "{quality:?}: {}", per_triangle(10_000_000));
        assert!(per_triangle(1_000_000) < 125.0, "{quality:?}: {}", per_triangle(1_000_000));
    }
}
