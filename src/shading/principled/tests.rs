//! Tests of energy conservation, sampling densities and reciprocity of the lobes.

use super::bsdf::Bsdf;
use super::dispersion::Spectrum;
use super::ggx::Ggx;
use super::measure::{self, towards};
use super::parameters::{Coat, LobeFlags, Parameters, SheenParams};
use super::shading_frame::ShadingFrame;
use super::thin_film::ThinFilm;
use crate::math::{Color, Rgb, Vector};

pub(super) fn grey(value: f32) -> Color<f32> {
    Color::splat(Rgb::splat(value))
}

fn vector(x: f32, y: f32, z: f32) -> Vector<f32> {
    Vector { x, y, z }
}

/// An opaque surface of base colour `base` and ior 1.5.
pub(super) fn opaque(base: f32, metallic: f32, roughness: f32) -> (LobeFlags, Parameters<f32>) {
    let up = vector(0.0, 0.0, 1.0);
    let frame = ShadingFrame::about(up);
    let alpha = (roughness * roughness).max(1e-4);
    let parameters = Parameters {
        frame,
        geometric_normal: up,
        diffuse: grey(base * (1.0 - metallic)),
        diffuse_transmission: grey(0.0),
        f0: grey(0.04),
        f90: grey(1.0),
        metal: grey(base),
        edge: grey(0.0),
        metallic,
        ggx: Ggx { x: alpha, y: alpha },
        roughness,
        transmission: grey(0.0),
        eta: 1.0,
        inside: false,
        spectrum: Spectrum::none(),
        coat: Coat { weight: 0.0, roughness: 0.0, frame, f0: grey(0.04), f90: grey(1.0) },
        sheen: SheenParams { color: grey(0.0), roughness: 0.5 },
        film: ThinFilm { weight: 0.0, thickness: 0.0, ior: 1.0 },
    };
    (
        LobeFlags {
            diffuse: metallic < 1.0,
            metallic: metallic > 0.0,
            specular: true,
            ..LobeFlags::default()
        },
        parameters,
    )
}

/// Glass of ior 1.5, seen from outside or from `inside`.
pub(super) fn glass(roughness: f32, inside: bool) -> (LobeFlags, Parameters<f32>) {
    let (_, mut parameters) = opaque(1.0, 0.0, roughness);
    parameters.transmission = grey(1.0);
    parameters.diffuse = grey(0.0);
    parameters.eta = if inside { 1.5 } else { 1.0 / 1.5 };
    parameters.inside = inside;
    (LobeFlags { specular: true, transmission: true, solid: true, ..LobeFlags::default() }, parameters)
}

/// Adds a film to a surface.
pub(super) fn covered(
    (mut has, mut p): (LobeFlags, Parameters<f32>),
    thickness: f32,
    ior: f32,
) -> (LobeFlags, Parameters<f32>) {
    has.film = true;
    p.film = ThinFilm { weight: 1.0, thickness, ior };
    (has, p)
}

/// The albedo: the mean of the weights of sampled directions.
fn albedo(has: LobeFlags, p: Parameters<f32>, cos: f32) -> f32 {
    colored_albedo(has, p, cos, 1 << 15)[0]
}

fn colored_albedo(has: LobeFlags, p: Parameters<f32>, cos: f32, count: u32) -> [f32; 3] {
    albedo_towards(has, p, towards(cos, 0.1), count)
}

fn albedo_towards(has: LobeFlags, p: Parameters<f32>, wo: Vector<f32>, count: u32) -> [f32; 3] {
    let bsdf = Bsdf::new(has, p, wo, true);
    let found = measure::albedo(count, |which, u| bsdf.sample(which, 1.0, u, true));
    found.mean.map(|mean| mean as f32)
}

#[test]
fn opaque_white_surfaces_pass_the_furnace_test() {
    for metallic in [0.0, 0.5, 1.0] {
        for roughness in [0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 1.0] {
            for cos in [0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0] {
                let (has, p) = opaque(1.0, metallic, roughness);
                let found = albedo(has, p, cos);
                assert!(
                    (found - 1.0).abs() < 0.005,
                    "metallic {metallic} roughness {roughness} cos {cos}: {found}"
                );
            }
        }
    }
}

/// A metal with a tint of its edge reflects that part of Schlick's approximation at a cosine of 1/7, nearly all of it
/// elsewhere, and its lobe of all bounces about what the albedos say by which lobes are chosen.
#[test]
fn metals_reflect_their_edge_tint_at_the_edge() {
    let tinted = |base: f32, tint: f32, roughness: f32| {
        let (mut has, mut p) = opaque(base, 1.0, roughness);
        has.edge = true;
        p.edge = super::reflectance::edge(p.metal, grey(tint));
        (has, p)
    };
    for (base, tint) in [(0.53, 0.77), (0.9, 0.9), (0.04, 0.5), (1.0, 0.0)] {
        let schlick = |cos: f32| base + (1.0 - base) * (1.0 - cos).powi(5);
        for (cos, part) in [(1.0 / 7.0, tint), (1.0, 1.0)] {
            let (has, p) = tinted(base, tint, 0.0);
            let found = albedo(has, p, cos);
            assert!(
                (found / (part * schlick(cos)).max(1e-3) - 1.0).abs() < 2e-3 || found < 1e-3,
                "{base} {cos}: {found}"
            );
        }
        for roughness in [0.1, 0.3, 0.6, 1.0] {
            for cos in [0.1, 0.3, 0.6, 1.0] {
                let (has, p) = tinted(base, tint, roughness);
                let found = albedo(has, p, cos);
                let (plain_has, plain) = opaque(base, 1.0, roughness);
                assert!(found <= albedo(plain_has, plain, cos) + 1e-3, "{base} {roughness} {cos}: {found}");
                let bsdf = Bsdf::new(has, p, towards(cos, 0.1), true);
                let expected = bsdf.once.metal.r + bsdf.multiple.r * (1.0 - bsdf.own.albedo.whole());
                assert!(
                    tint < 0.7 || (found - expected).abs() < 0.06,
                    "{base} {tint} {roughness} {cos}: {found} {expected}"
                );
            }
        }
    }
}

/// Makes the microfacets of a surface anisotropic.
pub(super) fn anisotropic(
    (mut has, mut p): (LobeFlags, Parameters<f32>),
    strength: f32,
) -> (LobeFlags, Parameters<f32>) {
    has.anisotropic = true;
    p.ggx.x = p.ggx.y + (1.0 - p.ggx.y) * strength * strength;
    p.roughness = (p.ggx.x * p.ggx.y).sqrt().sqrt();
    (has, p)
}

#[test]
fn anisotropic_white_surfaces_pass_the_furnace_test() {
    for metallic in [0.0, 0.5, 1.0] {
        for roughness in [0.05, 0.1, 0.25, 0.45, 0.7, 0.95] {
            for strength in [0.1, 0.45, 0.8, 1.0] {
                let (mut sum, mut count) = (0.0, 0.0);
                for cos in [0.1, 0.3, 0.55, 0.8, 1.0f32] {
                    for turn in [0.0, 0.1, 0.2, 0.25] {
                        let (has, p) = anisotropic(opaque(1.0, metallic, roughness), strength);
                        let [found, ..] = albedo_towards(has, p, towards(cos, turn), 1 << 13);
                        let what = format!("{metallic} {roughness} {strength} {cos} {turn}");
                        let most = if cos < 0.2 { 0.02 } else { 0.006 };
                        assert!((found - 1.0).abs() < most, "{what}: {found}");
                        (sum, count) = (sum + cos * found, count + cos);
                    }
                }
                let mean = sum / count;
                assert!((mean - 1.0).abs() < 0.003, "{metallic} {roughness} {strength}: {mean}");
            }
        }
    }
}

#[test]
fn clear_coat_conserves_energy() {
    for roughness in [0.0, 0.3, 1.0] {
        for cos in [0.1, 0.5, 1.0] {
            let (mut has, mut p) = opaque(1.0, 0.0, 0.5);
            has.coat = true;
            (p.coat.weight, p.coat.roughness) = (1.0, roughness);
            let found = albedo(has, p, cos);
            // Light lost between the coat's own microfacets is left to the base.
            assert!((found - 1.0).abs() < 0.01, "roughness {roughness} cos {cos}: {found}");
        }
    }
}

#[test]
fn sheen_on_a_white_surface_adds_no_light() {
    for roughness in [0.1, 0.5, 1.0] {
        for cos in [0.1, 0.5, 1.0] {
            let (mut has, mut p) = opaque(1.0, 0.0, 0.5);
            has.sheen = true;
            p.sheen = SheenParams { color: grey(1.0), roughness };
            let found = albedo(has, p, cos);
            assert!((0.93..1.03).contains(&found), "roughness {roughness} cos {cos}: {found}");
        }
    }
}

#[test]
fn thin_glass_conserves_energy() {
    for roughness in [0.0, 0.1, 0.25, 0.5, 0.75, 1.0] {
        for (part, cos) in
            [1.0, 0.4].into_iter().flat_map(|part| [0.05, 0.2, 0.5, 1.0].map(|cos| (part, cos)))
        {
            let (mut has, mut p) = opaque(1.0, 0.0, roughness);
            has.transmission = true;
            (p.transmission, p.diffuse) = (grey(part), grey(1.0 - part));
            let found = albedo(has, p, cos);
            assert!((found - 1.0).abs() < 0.005, "roughness {roughness} part {part} cos {cos}: {found}");
        }
    }
}

#[test]
fn glass_conserves_energy() {
    for roughness in [0.0, 0.1, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0] {
        for (inside, cosines) in [(false, [0.05, 0.2, 0.5, 1.0]), (true, [0.05, 0.3, 0.75, 1.0])] {
            for (ior, cos) in [1.1, 1.33, 1.5, 1.8, 2.5].into_iter().flat_map(|n| cosines.map(|cos| (n, cos)))
            {
                let (has, mut p) = glass(roughness, inside);
                p.eta = if inside { ior } else { 1.0 / ior };
                let found = albedo(has, p, cos);
                let most = if cos < 0.1 { 0.025 } else { 0.02 };
                assert!(
                    (found - 1.0).abs() < most,
                    "roughness {roughness} {inside} ior {ior} cos {cos}: {found}"
                );
            }
        }
    }
}

/// A body that transmits light through half of its surface; the other half scatters the light that is neither reflected
/// nor transmitted.
#[test]
fn partly_transmissive_bodies_conserve_energy() {
    for inside in [false, true] {
        for (roughness, ior) in [(0.0, 1.5), (0.3, 1.5), (0.3, 1.2), (0.6, 1.5), (0.6, 2.2), (1.0, 1.5)] {
            let (mut sum, mut count) = (0.0, 0.0);
            for step in 1..=20 {
                let cos = step as f32 / 20.0;
                let (mut has, mut p) = glass(roughness, inside);
                (has.diffuse, p.diffuse, p.transmission) = (true, grey(0.5), grey(0.5));
                p.eta = if inside { ior } else { 1.0 / ior };
                let [found, ..] = albedo_towards(has, p, towards(cos, 0.1), 1 << 13);
                // The table's edge near the critical angle is less sharp than the actual one.
                let most = if inside && roughness == 0.3 { 0.07 } else { 0.015 };
                assert!((found - 1.0).abs() < most, "{inside} {roughness} {ior} cos {cos}: {found}");
                (sum, count) = (sum + cos * found, count + cos);
            }
            let mean = sum / count;
            assert!((mean - 1.0).abs() < 0.004, "{inside} {roughness} {ior}: {mean}");
        }
    }
}

/// Films on white surfaces of all kinds, in a white furnace.
#[test]
fn thin_films_conserve_energy() {
    let mut all = Vec::new();
    for roughness in [0.0, 0.1, 0.3, 0.6, 1.0] {
        for metallic in [0.0, 0.5, 1.0] {
            let name = format!("metallic {metallic}");
            all.push((name, roughness, opaque(1.0, metallic, roughness)));
        }
        for inside in [false, true] {
            all.push((format!("glass, inside {inside}"), roughness, glass(roughness, inside)));
        }
    }
    for (name, roughness, surface) in all {
        for (thickness, ior) in [(0.0, 1.3), (150.0, 1.33), (300.0, 1.8), (500.0, 1.3), (2000.0, 2.0)] {
            for cos in [0.1, 0.3, 0.6, 0.8, 1.0] {
                let (has, p) = covered(surface, thickness, ior);
                for found in colored_albedo(has, p, cos, 1 << 12) {
                    // The mean over rough microfacets is approximated by the mean microfacet.
                    let allowed = match roughness {
                        r if r > 0.6 => 0.07,
                        r if r > 0.2 => 0.035,
                        _ => 0.015,
                    };
                    assert!(
                        (found - 1.0).abs() < allowed,
                        "{name} roughness {roughness}, {thickness} nm of {ior}, cos {cos}: {found}"
                    );
                }
            }
        }
    }
}

#[test]
fn film_of_zero_thickness_changes_nothing() {
    for (plain, ior) in [(opaque(0.7, 0.5, 0.4), 1.8), (glass(0.3, false), 1.3), (glass(0.3, true), 1.3)] {
        for (a, b) in [(0.9, 0.5), (0.4, 0.7), (0.6, -0.8)] {
            let (has, p) = covered(plain, 0.0, ior);
            let film = Bsdf::new(has, p, towards(a, 0.0), true).evaluate(towards(b, 0.4), true).0;
            let (has, p) = plain;
            let without = Bsdf::new(has, p, towards(a, 0.0), true).evaluate(towards(b, 0.4), true).0;
            assert!(
                (film.g - without.g).abs() < 2e-3 * without.g.max(0.01),
                "{a} {b}: {} {}",
                film.g,
                without.g
            );
        }
    }
}

#[test]
fn opaque_surfaces_are_reciprocal() {
    for (metallic, roughness) in [(0.0, 0.3), (0.0, 1.0), (0.5, 0.5), (1.0, 0.2), (1.0, 0.9)] {
        for (a, b) in [(0.2, 0.9), (0.5, 0.6), (0.1, 0.3)] {
            let (wo, wi) = (towards(a, 0.0), towards(b, 0.3));
            for film in [0.0, 350.0] {
                let (mut has, mut p) = covered(opaque(0.7, metallic, roughness), film, 1.7);
                (has.film, p.film.weight) = (film > 0.0, 0.8);
                let there = Bsdf::new(has, p, wo, true).evaluate(wi, true).0.r / b;
                let back = Bsdf::new(has, p, wi, true).evaluate(wo, true).0.r / a;
                assert!((there / back - 1.0).abs() < 1e-3, "{metallic} {roughness} {a} {b}: {there} {back}");
            }
        }
    }
}

#[test]
fn sampled_directions_follow_the_reported_density() {
    let mut all: Vec<(String, (LobeFlags, Parameters<f32>))> = Vec::new();
    for roughness in [0.3, 0.6, 1.0] {
        for metallic in [0.0, 1.0] {
            all.push((
                format!("metallic {metallic} roughness {roughness}"),
                opaque(0.8, metallic, roughness),
            ));
        }
        all.push((format!("glass {roughness}"), glass(roughness, false)));
        all.push((format!("glass from within {roughness}"), glass(roughness, true)));
    }
    let (mut has, mut p) = opaque(0.8, 0.5, 0.4);
    (has.transmission, p.transmission) = (true, grey(0.5));
    all.push(("thin".into(), (has, p)));
    all.push(("film".into(), covered(opaque(0.8, 0.3, 0.4), 300.0, 1.5)));
    all.push(("film on glass".into(), covered(glass(0.4, true), 300.0, 1.8)));
    let (mut has, mut p) = opaque(0.8, 0.0, 0.4);
    (has.diffuse_transmission, p.diffuse_transmission) = (true, grey(0.5));
    (has.coat, p.coat.weight, p.coat.roughness) = (true, 1.0, 0.3);
    p.ggx = Ggx { x: 0.5, y: 0.1 };
    all.push(("back, coat, anisotropic".into(), (has, p)));
    for (name, (has, p)) in all {
        for cos in [0.3, 0.95] {
            let bsdf = Bsdf::new(has, p, towards(cos, 0.1), true);
            let sample = |which, u| bsdf.sample(which, 1.0, u, true);
            let check = measure::density(1 << 14, sample, |d| bsdf.evaluate(d, true).1);
            let check = check.expect("a density");
            assert!(check.agrees(), "{name}, cos {cos}: {check:?}");
        }
    }
}
