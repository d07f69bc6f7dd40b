//! Compares the light tree with the actual contributions of lights.

use std::num::Wrapping;

use rand::RngExt;

use super::*;
use crate::compile::light_tree::{LightBounds, build};
use crate::math::{Aabb, NONE, Vec3};
use crate::sampling::Stream;
use crate::shading::packed_normal::packed_normal;
use crate::simd::{Isa, Kernel, Lanes, dispatch};

/// A diffuse rectangle, `corner + u * edges.0 + v * edges.1`.
#[derive(Clone, Copy)]
struct Panel {
    corner: Vec3,
    edges: [Vec3; 2],
    radiance: f32,
    two_sided: bool,
}

impl Panel {
    fn normal(&self) -> Vec3 {
        self.edges[0].cross(self.edges[1]).normalize()
    }

    fn at(&self, u: f32, v: f32) -> Vec3 {
        self.corner + u * self.edges[0] + v * self.edges[1]
    }

    fn area(&self) -> f32 {
        self.edges[0].cross(self.edges[1]).length()
    }

    fn bounds(&self) -> LightBounds {
        LightBounds {
            bounds: Aabb::around(
                [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)].map(|(u, v)| self.at(u, v)),
            ),
            far: false,
            power: self.radiance * self.area(),
            axis: self.normal(),
            cos_spread: 1.0,
            cos_emission: 0.0,
            two_sided: self.two_sided,
            outside: 0.0,
        }
    }

    /// The irradiance from the whole panel, by 16 points on it, at a surface that counts light on both sides or only
    /// its front.
    fn brings(&self, point: Vec3, normal: Vec3, both: bool) -> f32 {
        let mut sum = 0.0;
        for i in 0..16 {
            let way = point - self.at((i % 4) as f32 / 3.0, (i / 4) as f32 / 3.0);
            let direction = way.normalize();
            let cos = direction.dot(self.normal());
            let cos = if self.two_sided { cos.abs() } else { cos.max(0.0) };
            let at_surface = match (normal == Vec3::ZERO, both) {
                (true, _) => 1.0,
                (false, true) => direction.dot(normal).abs(),
                (false, false) => (-direction.dot(normal)).max(0.0),
            };
            sum += self.radiance * self.area() / 16.0 * cos * at_surface / way.length_squared();
        }
        sum
    }
}

fn random(stream: &mut Stream) -> Vec3 {
    Vec3::from_array([0; 3].map(|_| stream.random_range(-1.0..1.0)))
}

/// Random panels in a cube of ±`reach`.
fn panels(count: usize, reach: f32, size: f32, seed: u64) -> Vec<Panel> {
    let mut stream = Stream::new(seed);
    (0..count)
        .map(|i| Panel {
            corner: random(&mut stream) * reach,
            edges: [random(&mut stream) * size, random(&mut stream) * size],
            radiance: stream.random_range(0.1..10.0),
            two_sided: i % 5 == 0,
        })
        .collect()
}

fn tree(panels: &[Panel]) -> LightTree {
    build(&panels.iter().map(Panel::bounds).collect::<Vec<_>>())
}

fn lamp(place: Vec3, power: f32) -> LightBounds {
    let (bounds, axis, far) = (Aabb { min: place, max: place }, Vec3::Z, false);
    LightBounds {
        bounds,
        far,
        power,
        axis,
        cos_spread: -1.0,
        cos_emission: 0.0,
        two_sided: false,
        outside: 0.0,
    }
}

/// A distant light in direction `axis`.
fn sun(axis: Vec3, power: f32) -> LightBounds {
    LightBounds { far: true, axis, cos_spread: 1.0, ..lamp(Vec3::ZERO, power) }
}

/// The facing of a surface that transmits light; of no surface if the normal is zero.
fn both_sides(normal: Vec3) -> Wrapping<u32> {
    if normal == Vec3::ZERO { Wrapping(NONE) } else { packed_normal::<f32>(Vector::splat(normal), true) }
}

/// The facing of a surface that transmits no light.
fn front(normal: Vec3) -> Wrapping<u32> {
    packed_normal::<f32>(Vector::splat(normal), false)
}

fn chance_on(tree: &LightTree, point: Vec3, packed_normal: Wrapping<u32>, light: usize) -> f32 {
    pmf::<f32>(tree, Vector::splat(point), packed_normal, Wrapping(light as u32), true)
}

fn chance(tree: &LightTree, point: Vec3, normal: Vec3, light: usize) -> f32 {
    chance_on(tree, point, both_sides(normal), light)
}

fn choose(tree: &LightTree, point: Vec3, normal: Vec3, u: f32) -> (usize, f32, f32) {
    let (light, pmf, rest) = sample::<f32>(tree, Vector::splat(point), both_sides(normal), u, true);
    (light.0 as usize, pmf, rest)
}

/// A random point within ±`reach`, and a normal or none.
fn place(stream: &mut Stream, reach: f32) -> (Vec3, Vec3) {
    let point = random(stream) * reach;
    let normal = if stream.random_range(0..4) == 0 { Vec3::ZERO } else { random(stream).normalize() };
    (point, normal)
}

#[test]
fn probabilities_of_all_lights_add_up_to_one() {
    let mut stream = Stream::new(1);
    for count in [1, 2, 3, 50, 300] {
        let lights: Vec<_> =
            (0..count).map(|_| lamp(random(&mut stream) * 10.0, stream.random_range(0.01..100.0))).collect();
        let tree = build(&lights);
        let mut with_suns = lights.clone();
        with_suns.extend((0..3).map(|_| sun(random(&mut stream), 1.0)));
        let mixed = build(&with_suns);
        for _ in 0..50 {
            let (point, normal) = place(&mut stream, 20.0);
            for (tree, count) in [(&tree, count), (&mixed, count + 3)] {
                let sum: f64 = (0..count).map(|light| chance(tree, point, normal, light) as f64).sum();
                assert!((sum - 1.0).abs() < 1e-5, "{sum}");
            }
        }
        // At the position of a light, and as far away as possible.
        for point in [lights[0].bounds.min, Vec3::splat(1e18)] {
            let sum: f64 = (0..count).map(|light| chance(&tree, point, Vec3::Y, light) as f64).sum();
            assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        }
    }
}

#[test]
fn sample_draws_lights_with_the_probability_of_pmf() {
    let mut lights: Vec<_> = panels(38, 5.0, 2.0, 2).iter().map(Panel::bounds).collect();
    let mut stream = Stream::new(7);
    lights.extend((0..2).map(|_| sun(random(&mut stream), 0.5)));
    let tree = build(&lights);
    for _ in 0..12 {
        let (point, normal) = place(&mut stream, 6.0);
        let n = 100_000;
        let (mut counts, mut none) = ([0.0f64; 40], 0.0);
        let mut rests = [0.0f64; 16];
        for _ in 0..n {
            let (light, pmf, rest) = choose(&tree, point, normal, stream.random_range(0.0..1.0));
            assert!((0.0..1.0).contains(&rest));
            if pmf > 0.0 {
                counts[light] += 1.0;
                assert_eq!(pmf, chance(&tree, point, normal, light));
                rests[(rest * 16.0) as usize] += 1.0;
            } else {
                none += 1.0;
            }
        }
        let probabilities: Vec<f64> = (0..40).map(|i| chance(&tree, point, normal, i) as f64).collect();
        // The rest are dead ends: no light in that part of the tree reaches the point.
        let dead = 1.0 - probabilities.iter().sum::<f64>();
        let (mut chi2, mut freedom) = (0.0, -1.0);
        let (mut rare, mut rare_count) = (0.0, 0.0);
        for (p, count) in probabilities.iter().chain([&dead]).zip(counts.iter().chain([&none])) {
            let expected = p * n as f64;
            if expected > 10.0 {
                chi2 += (count - expected).powi(2) / expected;
                freedom += 1.0;
            } else {
                (rare, rare_count) = (rare + expected, rare_count + count);
            }
        }
        assert!((rare_count - rare).abs() < 5.0 + 5.0 * rare.abs().sqrt(), "{rare_count} of {rare}");
        let freedom = f64::max(freedom, 1.0);
        let limit = freedom * (1.0f64 - 2.0 / (9.0 * freedom) + 3.7 * (2.0 / (9.0 * freedom)).sqrt()).powi(3);
        assert!(chi2 < limit, "{chi2} of {freedom} degrees of freedom, at most {limit}");
        let expected = rests.iter().sum::<f64>() / 16.0;
        let chi2: f64 = rests.iter().map(|c| (c - expected).powi(2) / expected).sum();
        assert!(chi2 < 44.0, "what is left of u: chi² of 15 degrees of freedom, 0.01 %: {chi2}");
    }
}

#[test]
fn every_contributing_light_can_be_chosen() {
    for (reach, size) in [(5.0, 2.0), (100.0, 0.1), (1.0, 5.0), (1e4, 1.0), (0.0, 1.0)] {
        let panels = panels(60, reach, size, 3);
        let tree = tree(&panels);
        let mut stream = Stream::new(4);
        for round in 0..400 {
            let (mut point, normal) = place(&mut stream, 1.5 * reach + size);
            if round % 4 == 0 {
                // Nearly in a panel's plane, where its cosine is close to zero.
                let panel = &panels[round % 60];
                let place = panel.at(stream.random_range(-3.0..4.0), stream.random_range(-3.0..4.0));
                point = place + panel.normal() * size * 1e-3;
            }
            for (i, panel) in panels.iter().enumerate() {
                for (both, packed_normal) in [(true, both_sides(normal)), (false, front(normal))] {
                    if !both && normal == Vec3::ZERO {
                        continue;
                    }
                    let brings = panel.brings(point, normal, both);
                    let chance = chance_on(&tree, point, packed_normal, i);
                    assert!(
                        brings == 0.0 || chance > 0.0,
                        "light {i} brings {brings}, {reach} {size} {round}"
                    );
                }
            }
        }
    }
}

#[test]
fn spot_lights_are_chosen_only_within_their_outer_angle() {
    let mut stream = Stream::new(5);
    for outer in [0.01f32, 0.3, 1.0, 1.5] {
        let light = |place: Vec3| LightBounds {
            axis: -Vec3::Y,
            cos_spread: 1.0,
            cos_emission: libm::cosf(outer),
            ..lamp(place, 1.0)
        };
        let lights: Vec<_> = (0..50).map(|_| light(random(&mut stream) * 10.0)).collect();
        let tree = build(&lights);
        for _ in 0..200 {
            let (point, normal) = place(&mut stream, 12.0);
            for (i, light) in lights.iter().enumerate() {
                let way = (point - light.bounds.min).normalize();
                let angle = libm::acosf(way.dot(-Vec3::Y).clamp(-1.0, 1.0));
                let chance = chance(&tree, point, normal, i);
                assert!(angle > outer || chance > 0.0);
                assert!(angle < outer + 0.05 || chance == 0.0, "{angle} {outer}");
            }
        }
    }
}

#[test]
fn lights_that_face_away_are_not_chosen() {
    let ceiling = Panel {
        corner: Vec3::new(-1.0, 3.0, -1.0),
        edges: [Vec3::X * 2.0, Vec3::Z * 2.0],
        radiance: 1.0,
        two_sided: false,
    };
    let lights: Vec<_> =
        (0..8).map(|i| Panel { corner: ceiling.corner + Vec3::X * 3.0 * i as f32, ..ceiling }).collect();
    assert_eq!(ceiling.normal(), -Vec3::Y);
    let tree_down = tree(&lights);
    let sum = |tree: &LightTree, point| (0..8).map(|i| chance(tree, point, Vec3::Y, i)).sum::<f32>();
    assert!((sum(&tree_down, Vec3::ZERO) - 1.0).abs() < 1e-5);
    assert_eq!(sum(&tree_down, Vec3::Y * 20.0), 0.0);
    assert_eq!(choose(&tree_down, Vec3::Y * 20.0, Vec3::Y, 0.7).1, 0.0);
    let two = tree(&lights.iter().map(|light| Panel { two_sided: true, ..*light }).collect::<Vec<_>>());
    assert!((sum(&two, Vec3::Y * 20.0) - 1.0).abs() < 1e-5);
    // Without lights, power or mask nothing can be chosen.
    assert_eq!(choose(&build(&[]), Vec3::ZERO, Vec3::Y, 0.5).1, 0.0);
    assert_eq!(choose(&build(&[lamp(Vec3::Y, 0.0); 3]), Vec3::ZERO, Vec3::Y, 0.5).1, 0.0);
    assert_eq!(chance(&tree_down, Vec3::ZERO, Vec3::Y, 8), 0.0);
    assert_eq!(pmf::<f32>(&tree_down, Vector::zero(), Wrapping(NONE), Wrapping(0), false), 0.0);
}

#[test]
fn lights_behind_an_opaque_surface_are_not_chosen() {
    let mut stream = Stream::new(10);
    let behind: Vec<_> = (0..64).map(|_| lamp(random(&mut stream) - Vec3::Y * 1.5, 100.0)).collect();
    let mut lights = behind.clone();
    lights.push(lamp(Vec3::Y * 3.0, 1.0));
    lights.push(sun(-Vec3::Y, 50.0));
    let tree = build(&lights);
    let on = |packed_normal, light| chance_on(&tree, Vec3::Y * 0.01, packed_normal, light);
    assert!((on(front(Vec3::Y), 64) - 1.0).abs() < 1e-6, "{}", on(front(Vec3::Y), 64));
    assert!((0..64).all(|light| on(front(Vec3::Y), light) == 0.0 && on(front(-Vec3::Y), light) > 0.0));
    assert!(on(front(Vec3::Y), 65) == 0.0 && on(front(-Vec3::Y), 65) > 0.0);
    // A leaf (of a plant) transmits light from all of them.
    assert!((0..66).all(|light| on(both_sides(Vec3::Y), light) > 0.0));
}

/// Distant lights are chosen by irradiance, and against local lights by its square root.
#[test]
fn distant_lights_are_chosen_by_irradiance() {
    let up = Vec3::Y;
    let tilted = |cos: f32| Vec3::new((1.0 - cos * cos).sqrt(), cos, 0.0);
    let mut lights = vec![sun(up, 1.0)];
    lights.extend((0..9).map(|_| sun(tilted(0.5), 1e-6)));
    let tree = build(&lights);
    let strong = chance_on(&tree, Vec3::ZERO, front(up), 0);
    assert!(strong > 0.99998, "{strong}");
    let two = build(&[sun(up, 1.0), sun(tilted(0.25), 2.0)]);
    let weak = chance_on(&two, Vec3::ZERO, front(up), 1);
    assert!((weak - 1.0 / 3.0).abs() < 1e-3, "{weak}");
    // A point light of the same irradiance at 3 m, and one of a hundredth of it.
    for (intensity, expected) in [(9.0, 0.5), (0.09, 1.0 / 11.0)] {
        let tree = build(&[sun(up, 1.0), lamp(up * 3.0, intensity)]);
        let lamp = chance_on(&tree, Vec3::ZERO, front(up), 1);
        assert!((lamp - expected).abs() < 1e-3, "{lamp}");
    }
    // The nearest of 400 lights counts, not all of them as a whole.
    let mut town: Vec<_> =
        (0..400).map(|i| lamp(Vec3::new((i % 20) as f32, 0.1, (i / 20) as f32) * 10.0, 9.0)).collect();
    town.push(sun(up, 1.0));
    let tree = build(&town);
    let near = Vec3::new(100.0, -2.0, 100.0);
    let chance = chance_on(&tree, near, front(up), 210);
    assert!(chance > 0.25, "{chance}");
}

/// Compares the variance of the irradiance from one light chosen by the tree with that of choosing by power.
#[test]
fn tree_has_less_than_a_fiftieth_of_the_variance_of_choosing_by_power() {
    let mut stream = Stream::new(6);
    // A town at night: a thousand panels that emit downwards.
    let lamps: Vec<_> = (0..1000)
        .map(|_| Panel {
            corner: random(&mut stream) * Vec3::new(100.0, 1.0, 100.0) + Vec3::Y * 5.0,
            edges: [Vec3::X * 0.3, Vec3::Z * 0.3],
            radiance: stream.random_range(0.5..2.0),
            two_sided: false,
        })
        .collect();
    let tree = tree(&lamps);
    let total: f64 = lamps.iter().map(|lamp| lamp.bounds().power as f64).sum();
    let (mut by_tree, mut by_power) = (0.0, 0.0);
    for _ in 0..100 {
        let point = random(&mut stream) * Vec3::new(100.0, 0.0, 100.0);
        let (mut sum, mut tree_square, mut power_square) = (0.0, 0.0, 0.0);
        for (i, lamp) in lamps.iter().enumerate() {
            let brings = lamp.brings(point, Vec3::Y, true) as f64;
            sum += brings;
            tree_square += brings * brings / chance(&tree, point, Vec3::Y, i) as f64;
            power_square += brings * brings * total / lamp.bounds().power as f64;
        }
        by_tree += tree_square / (sum * sum) - 1.0;
        by_power += power_square / (sum * sum) - 1.0;
    }
    assert!(by_tree * 50.0 < by_power, "{by_tree} against {by_power}");
}

struct Choose<'a>(&'a LightTree, &'a [f32], bool);

impl Kernel for Choose<'_> {
    type Output = Vec<u32>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<u32> {
        let mut out = Vec::new();
        choose_lanes::<L::Queue>(self, &mut out);
        out
    }
}

#[inline(always)]
fn choose_lanes<F: Float>(Choose(tree, numbers, both): Choose, out: &mut Vec<u32>) {
    let mut row = [0; 16];
    let count = numbers.len() / 7;
    for first in (0..count).step_by(F::WIDTH) {
        let column = |k: usize| F::load(&numbers[k * count + first..]);
        let position = Vector::new(column(0), column(1), column(2)) * F::splat(10.0);
        let normal = Vector::new(column(3), column(4), column(5)).normalize();
        let all = F::Mask::first(F::WIDTH);
        let packed_normal = packed_normal(normal, both);
        let (light, chance, rest) = sample(tree, position, packed_normal, column(6).abs(), all);
        let again = pmf(tree, position, packed_normal, light, all);
        for bits in [light, chance.to_bits(), rest.to_bits(), again.to_bits()] {
            bits.store(&mut row);
            out.extend_from_slice(&row[..F::WIDTH]);
        }
    }
}

#[test]
fn every_level_gives_the_same_bits() {
    let mut lights: Vec<_> = panels(200, 8.0, 1.0, 8).iter().map(Panel::bounds).collect();
    let mut stream = Stream::new(9);
    lights.extend((0..5).map(|i| sun(random(&mut stream), 0.1 * i as f32)));
    let tree = build(&lights);
    let numbers: Vec<f32> = (0..7 * 512).map(|_| stream.random_range(-1.0..1.0)).collect();
    // Different lane widths write in a different order.
    let sorted = |isa, both| {
        let mut bits = dispatch(isa, Choose(&tree, &numbers, both));
        bits.sort_unstable();
        bits
    };
    for isa in Isa::available() {
        for both in [true, false] {
            assert!(sorted(isa, both) == sorted(Isa::PORTABLE, both), "{isa:?}");
        }
    }
}
