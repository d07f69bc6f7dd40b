//! White surfaces with random parameters in a white furnace: energy is conserved, reflection is reciprocal, and
//! directions are drawn with the reported density.

use super::bsdf::Bsdf;
use super::measure::{Chance, towards};
use super::parameters::{LobeFlags, Parameters, SheenParams};
use super::tests::{anisotropic, covered, glass, grey, opaque};
use crate::math::Vector;

impl Chance {
    fn happens(&mut self, probability: f32) -> bool {
        self.unit() < probability
    }

    /// 1 in half of all cases, otherwise a random fraction.
    fn part(&mut self) -> f32 {
        if self.happens(0.5) { 1.0 } else { self.unit() }
    }
}

/// A surface that reflects or transmits all incident light.
struct White {
    has: LobeFlags,
    p: Parameters<f32>,
    description: String,
}

impl White {
    fn at_random(seed: u32) -> Self {
        let mut chance = Chance::new(seed);
        let roughness = if chance.happens(0.1) { 0.0 } else { chance.unit() };
        let ior = chance.between(1.0, 3.0);
        let solid = chance.happens(0.3);
        let (mut has, mut p) = if solid {
            let inside = chance.happens(0.5);
            let (mut has, mut p) = glass(roughness, inside);
            let ior = ior.max(1.02);
            p.eta = if inside { ior } else { 1.0 / ior };
            let part = chance.part();
            (p.transmission, p.diffuse) = (grey(part), grey(1.0 - part));
            has.diffuse = part < 1.0;
            if chance.happens(0.2) {
                let metallic = chance.unit();
                (has.metallic, p.metallic, p.metal) = (true, metallic, grey(1.0));
                (p.transmission, p.diffuse) =
                    (p.transmission * (1.0 - metallic), p.diffuse * (1.0 - metallic));
            }
            (has, p)
        } else {
            let metallic = [0.0, chance.unit(), 1.0][(chance.unit() * 3.0) as usize];
            opaque(1.0, metallic, roughness)
        };
        let square = ((ior - 1.0) / (ior + 1.0)).powi(2);
        p.f0 = grey(square);
        if !solid && p.metallic < 1.0 && chance.happens(0.3) {
            has.transmission = true;
            let part = chance.part();
            (p.transmission, p.diffuse) = (grey(part * (1.0 - p.metallic)), p.diffuse * (1.0 - part));
        }
        if has.diffuse && chance.happens(0.2) {
            let part = chance.part();
            has.diffuse_transmission = true;
            (p.diffuse_transmission, p.diffuse) = (p.diffuse * part, p.diffuse * (1.0 - part));
        }
        if chance.happens(0.3) {
            (has, p) = anisotropic((has, p), chance.unit());
        }
        if chance.happens(0.3) {
            let (thickness, ior) = (chance.between(0.0, 1500.0), chance.between(1.0, 2.5));
            (has, p) = covered((has, p), thickness, ior);
            p.film.weight = chance.part();
        }
        if chance.happens(0.3) {
            has.coat = true;
            (p.coat.weight, p.coat.roughness) = (chance.part(), chance.unit());
        }
        if chance.happens(0.2) {
            has.sheen = true;
            p.sheen = SheenParams { color: grey(chance.part()), roughness: chance.unit() };
        }
        let description = format!(
            "roughness {roughness:.3} ior {ior:.2} metallic {:.2} through {:.2} back {:.2} eta {:.3} \
             coat {:.2} {:.2} sheen {:.2} {:.2} film {:.2} {:.0} nm {:.2}",
            p.metallic,
            p.transmission.r,
            p.diffuse_transmission.r,
            p.eta,
            p.coat.weight,
            p.coat.roughness,
            p.sheen.color.r,
            p.sheen.roughness,
            p.film.weight,
            p.film.thickness,
            p.film.ior
        );
        Self { has, p, description }
    }

    /// The mean albedo for viewers over the hemisphere, and its standard deviation.
    fn albedo(&self, seed: u32, count: u32) -> (f64, f64) {
        let mut chance = Chance::new(seed);
        let (mut sum, mut squares) = (0.0f64, 0.0f64);
        for _ in 0..count {
            let cos = chance.unit().sqrt().max(1e-3);
            let wo = towards(cos, chance.unit());
            let bsdf = Bsdf::new(self.has, self.p, wo, true);
            let sampled = bsdf.sample(chance.unit(), 1.0, (chance.unit(), chance.unit()), true);
            let weight = if sampled.valid { f64::from(sampled.weight.g) } else { 0.0 };
            sum += weight;
            squares += weight * weight;
        }
        let mean = sum / f64::from(count);
        (mean, ((squares / f64::from(count) - mean * mean) / f64::from(count)).max(0.0).sqrt())
    }
}

/// The largest error of the mean albedo over all directions, beyond that of chance.
fn allowed(white: &White) -> f64 {
    let LobeFlags { film, anisotropic, solid, diffuse, diffuse_transmission: back, sheen, .. } = white.has;
    match (film, solid && (diffuse || back)) {
        // Smooth fibres are bright only at grazing angles: 4 σ of few samples underestimate the error.
        (false, false) if sheen => 0.01,
        (false, false) => 0.005,
        // The table of the fraction that bodies reflect is a little less sharp than reality near the critical angle.
        (false, true) => 0.01,
        // Two angles represent all angles at which microfacets are seen; anisotropic ones use those of isotropic ones.
        (true, false) if anisotropic => 0.025,
        (true, false) => 0.015,
        (true, true) => 0.035,
    }
}

#[test]
fn random_white_surfaces_conserve_energy() {
    // Losses and gains of different surfaces must not cancel.
    let (mut gained, mut lost, mut count) = (0.0, 0.0, 0.0);
    for seed in 0..3000 {
        let white = White::at_random(seed);
        let (found, deviation) = white.albedo(seed + 77_777, 4096);
        let off = (found - 1.0).abs();
        let most = allowed(&white) + 4.0 * deviation;
        assert!(off < most, "surface {seed}: {found} ± {deviation}, {}", white.description);
        let beyond_chance = (off - 2.0 * deviation).max(0.0);
        if found > 1.0 {
            gained += beyond_chance
        } else {
            lost += beyond_chance
        }
        count += 1.0;
    }
    let (gained, lost) = (gained / count, lost / count);
    assert!(gained < 0.0005 && lost < 0.0005, "gained {gained}, lost {lost}");
}

#[test]
fn random_white_surfaces_are_reciprocal() {
    let mut compared = 0;
    for seed in 0..3000 {
        let White { has, p, description } = White::at_random(seed);
        // These are not reciprocal: light scattered below glass is divided only by the viewing direction, and glass has
        // a factor of its own for it; layers above attenuate only by the viewing direction, too.
        if has.solid || has.coat || has.sheen {
            continue;
        }
        let mut chance = Chance::new(seed + 88_888);
        let (a, b) = (chance.between(0.05, 1.0), chance.between(0.05, 1.0));
        let (wo, wi) = (towards(a, chance.unit()), towards(b, chance.unit()));
        let value = |from, to| Bsdf::new(has, p, from, true).evaluate(to, true).0.g;
        let (there, back) = (value(wo, wi) / b, value(wi, wo) / a);
        let off = (there - back).abs();
        assert!(off <= 2e-3 * there.max(back).max(1e-3), "surface {seed}: {there} {back}, {description}");
        compared += 1;
    }
    assert!(compared > 800, "{compared}");
}

/// Counts directions in the octants and belts of the sphere.
#[test]
fn random_white_surfaces_draw_directions_with_their_density() {
    const CELLS: usize = 16;
    let cell = |d: Vector<f32>| {
        let belt = ((d.z + 1.0) * 2.0).clamp(0.0, 3.0) as usize;
        belt * 4 + usize::from(d.x > 0.0) * 2 + usize::from(d.y > 0.0)
    };
    let mut compared = 0;
    for seed in 0..400 {
        let White { has, p, description } = White::at_random(seed);
        let mut chance = Chance::new(seed + 99_999);
        let wo = towards(chance.between(0.2, 1.0), chance.unit());
        let bsdf = Bsdf::new(has, p, wo, true);
        // Narrow lobes have no density, or are too sharp to be integrated here.
        let hardly_bends = has.solid && (0.7..1.45).contains(&p.eta);
        if p.roughness < 0.35 || (has.coat && p.coat.roughness < 0.35) || hardly_bends {
            continue;
        }
        let count = 8192;
        let (mut drawn, mut expected, mut variance) = ([0.0f64; CELLS], [0.0f64; CELLS], [0.0f64; CELLS]);
        for _ in 0..count {
            let sampled = bsdf.sample(chance.unit(), 1.0, (chance.unit(), chance.unit()), true);
            if sampled.valid {
                drawn[cell(sampled.direction)] += 1.0;
            }
            let d = towards(chance.between(-1.0, 1.0), chance.unit());
            let density = f64::from(bsdf.evaluate(d, true).1) * 4.0 * std::f64::consts::PI;
            expected[cell(d)] += density;
            variance[cell(d)] += density * density;
        }
        for (k, drawn) in drawn.iter().enumerate() {
            let deviation = (variance[k] + expected[k]).sqrt().max(3.0);
            let off = (drawn - expected[k]).abs();
            assert!(
                off < 5.0 * deviation,
                "surface {seed}, cell {k}: {drawn} {}, {description}",
                expected[k]
            );
        }
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
}
