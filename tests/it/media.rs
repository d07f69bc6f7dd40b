//! Light that is scattered within bodies.

use rayfront::math::Rgb;

use crate::support::picture;

/// A ball of 1 m whose boundary does not bend light, in white surroundings, seen straight on by `size` pixels that
/// are `height` metres together.
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
    let pixels = picture(text).pixels;
    let sum = |channel: fn(&Rgb) -> f32| pixels.iter().map(|pixel| f64::from(channel(pixel))).sum::<f64>();
    [sum(|p| p.r), sum(|p| p.g), sum(|p| p.b)].map(|sum| sum / pixels.len() as f64)
}

/// What scatters all light, whatever its colours and wherever it goes, cannot be seen in white surroundings.
#[test]
fn scattering_alone_neither_loses_nor_adds_light() {
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

/// Chandrasekhar's H function of isotropic scattering by iteration (Radiative Transfer, 1950, chapter V).
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

/// A body without end that scatters light evenly sends 1 − H(μ) √(1 − ϖ) back of light that comes from
/// everywhere; its colour by the extension's formula is the mean of that over all directions.
#[test]
fn bodies_of_many_scatterings_have_their_colour() {
    let colors: [f64; 3] = [0.9, 0.5, 0.2];
    let volume =
        "attenuation_color: 0.01, attenuation_distance_m: 0.005, multiscatter_color: (0.9, 0.5, 0.2)";
    // Seen from above: of a ball, 1/20 of whose middle is looked at.
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

/// Once scattered light of a thin body: of each metre σₛ goes everywhere.
#[test]
fn little_scattering_is_as_much_as_the_coefficient_says() {
    // Behind the ball is a black square, all around it is white.
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
    // What is scattered once comes from all around but from the black square, whose solid angle from each point of
    // the ray is known.
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
fn what_is_to_scatter_and_cannot_is_told() {
    let told = |volume: &str, more: &str| {
        let text = format!(
            "(entities: [(camera: Pinhole), (light: Point(power_w: 1)), (shape: Sphere,
              material: Principled(metallic: 0, {more} volume: ({volume})))])"
        );
        let scene = rayfront::compile::compile(&crate::support::world(&text), None).unwrap();
        scene.warnings.iter().any(|warning| warning.contains("scatters nothing"))
    };
    let milk = "multiscatter_color: 0.9, attenuation_color: 0.5, attenuation_distance_m: 0.1";
    assert!(!told(milk, "transmission: 1,") && !told(milk, "diffuse_transmission: 1,"));
    assert!(told(milk, ""));
    assert!(told("multiscatter_color: 0.9, attenuation_color: 0.5", "transmission: 1,"));
    assert!(told("multiscatter_color: 0.9, attenuation_distance_m: 0.1", "transmission: 1,"));
    assert!(!told("attenuation_distance_m: 0.1", "transmission: 1,"));
}
