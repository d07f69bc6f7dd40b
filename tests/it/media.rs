//! Scattering within bodies.

use crate::support::{mean_rgb, picture};

/// The radiance of a ball of 1 m with a non-refracting boundary in white surroundings, viewed from the front by `size`
/// × `size` pixels that cover `height` metres.
fn ball(volume: &str, size: u32, samples: u32, height: f32) -> [f64; 3] {
    let text = format!(
        "(settings: (size: ({size}, {size}), samples: {samples}, transport: Path, background: 1, filter: Box,
                     sharing: Off),
          entities: [
              (camera: Orthographic(height_m: {height}), transform: LookAt(from: (0, 0, 5), to: (0, 0, 0))),
              (shape: Sphere(radius_m: 1), material: Principled(metallic: 0, roughness: 0, ior: 1, transmission: 1,
               volume: ({volume}))),
          ])"
    );
    mean(&text)
}

fn mean(text: &str) -> [f64; 3] {
    mean_rgb(&picture(text))
}

/// A medium that scatters all light is invisible in white surroundings, whatever its colours and phase function.
#[test]
fn scattering_without_absorption_conserves_energy() {
    for anisotropy in [-0.6, 0.0, 0.8] {
        let volume = format!(
            "attenuation_color: (0.1, 0.3, 0.8), attenuation_distance_m: 0.2, multiscatter_color: 1,
             scatter_anisotropy: {anisotropy}"
        );
        let found = ball(&volume, 24, 64, 2.4);
        for channel in found {
            assert!((channel - 1.0).abs() < 0.012, "{anisotropy}: {found:?}");
        }
    }
}

/// Chandrasekhar's H function for isotropic scattering, by iteration (Radiative Transfer, 1950, chapter V).
fn h_function(albedo: f64, cosine: f64) -> f64 {
    const NODES: usize = 400;
    let nodes: Vec<f64> = (0..NODES).map(|i| (i as f64 + 0.5) / NODES as f64).collect();
    let rest = (1.0 - albedo).sqrt();
    let inverse = |h: &[f64], mu: f64| {
        let sum: f64 = nodes.iter().zip(h).map(|(x, h)| x * h / (mu + x)).sum();
        rest + albedo / 2.0 * sum / NODES as f64
    };
    let mut h = vec![1.0; NODES];
    for _ in 0..200 {
        h = nodes.iter().map(|mu| 1.0 / inverse(&h, *mu)).collect();
    }
    1.0 / inverse(&h, cosine)
}

/// An infinite half-space with isotropic scattering reflects 1 − H(μ) √(1 − ϖ) of uniform light; its colour by the
/// extension's formula is the mean of that over all directions.
#[test]
fn multiple_scattering_matches_the_multiscatter_colour() {
    let colors: [f64; 3] = [0.9, 0.5, 0.2];
    let volume =
        "attenuation_color: 0.01, attenuation_distance_m: 0.005, multiscatter_color: (0.9, 0.5, 0.2)";
    // Viewed from the front: the central 1/20 of a ball.
    let found = ball(volume, 20, 64, 0.1);
    for (found, color) in found.into_iter().zip(colors) {
        let root = 4.09712 + 4.20863 * color - (9.59217 + 41.6808 * color + 17.7126 * color * color).sqrt();
        let albedo: f64 = 1.0 - root * root;
        let expected = 1.0 - h_function(albedo, 1.0) * (1.0 - albedo).sqrt();
        assert!((found - expected).abs() < 0.012, "{color}: {found}, not {expected}");
        let mean: f64 = (0..200)
            .map(|i| (f64::from(i) + 0.5) / 200.0)
            .map(|mu| 2.0 * mu * (1.0 - h_function(albedo, mu) * (1.0 - albedo).sqrt()) / 200.0)
            .sum();
        assert!((mean - color).abs() < 0.02, "{color}: {mean}");
    }
}

/// Single scattering in a thin body, which scatters σₛ per metre isotropically.
#[test]
fn single_scattering_matches_the_coefficient() {
    // A black square behind the ball, white all around.
    let text = "(settings: (size: (8, 8), samples: 1024, transport: Path, filter: Box, sharing: Off),
          entities: [
              (camera: Orthographic(height_m: 0.01), transform: LookAt(from: (0, 0, 5), to: (0, 0, 0))),
              (light: Environment(radiance: 1)),
              (shape: Plane(corners: ((-0.5, -0.5, -2), (0.5, -0.5, -2), (0.5, 0.5, -2), (-0.5, 0.5, -2))),
               material: (diffuse: 0)),
              (shape: Sphere(radius_m: 1), material: Principled(metallic: 0, roughness: 0, ior: 1, transmission: 1,
               volume: (attenuation_color: 0.99, attenuation_distance_m: 1, multiscatter_color: 1))),
          ])";
    let found = mean(text)[1];
    // Light scattered once comes from all around except from the black square, whose solid angle from each point of the
    // ray is known.
    let sigma = -0.99f64.ln();
    let square = |z: f64| {
        let (a, d) = (0.5f64, 2.0 + z);
        4.0 * (a * a / (d * (d * d + 2.0 * a * a).sqrt())).atan()
    };
    let steps = 1000;
    let once: f64 = (0..steps)
        .map(|i| 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(steps))
        .map(|z| sigma * (-sigma * (1.0 - z)).exp() * (1.0 - square(z) / (4.0 * std::f64::consts::PI)))
        .sum::<f64>()
        * 2.0
        / f64::from(steps);
    assert!((found / once - 1.0).abs() < 0.02, "{found}, not {once}");
}

#[test]
fn volumes_that_scatter_nothing_are_reported() {
    let told = |volume: &str, more: &str| {
        let text = format!(
            "(entities: [(camera: Pinhole), (light: Point(power_w: 1)), (shape: Sphere,
              material: Principled(metallic: 0, {more} volume: ({volume})))])"
        );
        let scene = rayfront::compile::compile(&crate::support::world(&text), None).unwrap();
        scene.warnings.iter().any(|warning| warning.text.contains("multiscatter_color does nothing"))
    };
    let milk = "multiscatter_color: 0.9, attenuation_color: 0.5, attenuation_distance_m: 0.1";
    assert!(!told(milk, "transmission: 1,") && !told(milk, "diffuse_transmission: 1,"));
    assert!(told(milk, ""));
    assert!(told("multiscatter_color: 0.9, attenuation_color: 0.5", "transmission: 1,"));
    assert!(told("multiscatter_color: 0.9, attenuation_distance_m: 0.1", "transmission: 1,"));
    assert!(!told("attenuation_distance_m: 0.1", "transmission: 1,"));
}
