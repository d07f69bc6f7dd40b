//! Light that passes straight through surfaces on its way from lights: through panes, and into fog.

use std::f64::consts::PI;

use rayfront::internals::compile::compile_after;
use rayfront::world::Sharing;

use crate::support::{Picture, mean_rgb, picture, world};

/// The radiance of the floor at the origin, viewed at a low angle, with further `entities`.
fn floor(settings: &str, entities: &str) -> [f64; 3] {
    let text = format!(
        "(settings: (transport: Path, filter: Box, sharing: Off, {settings}),
          entities: [
              (camera: Orthographic(height_m: 0.001), transform: LookAt(from: (1, 0.1, 0), to: (0, 0, 0))),
              (shape: Plane(corners: ((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))), material: (diffuse: 0.8)),
              {entities}
          ])"
    );
    mean_rgb(&picture(&text))
}

fn assert_near(found: [f64; 3], expected: [f64; 3], tolerance: f64, what: &str) {
    for (one, other) in found.iter().zip(expected) {
        assert!((one / other - 1.0).abs() < tolerance, "{what}: {found:?}, not {expected:?}");
    }
}

/// Schlick's approximation for glass of index 1.5.
fn reflected(cosine: f64) -> f64 {
    0.04 + 0.96 * (1.0 - cosine).powi(5)
}

const FEW: &str = "size: (4, 4), samples: 4, max_depth: 1";
const LAMP: &str = "(light: Point(power_w: 100), transform: (translate: (1, 2, 0))),";

#[test]
fn light_passes_straight_through_all_panes_on_its_way() {
    let (square, cosine) = (5.0f64, 2.0 / 5.0f64.sqrt());
    let plain = 0.8 / PI * 100.0 / (4.0 * PI) / square * cosine;
    assert_near(floor(FEW, LAMP), [plain; 3], 1e-4, "nothing between");
    let within = (1.0 - (1.0 - cosine * cosine) / 2.25).sqrt();
    let left = |depth: f64| [0.9f64, 0.5, 0.2].map(|c| c.powf(depth / within) * (1.0 - reflected(cosine)));
    let sheet = "material: Principled(metallic: 0, roughness: 0, transmission: 1, volume: (
                     attenuation_color: (0.9, 0.5, 0.2), attenuation_distance_m: 0.04, thickness_m: 0.02))";
    let meshes = format!(
        "(shape: Mesh(\"square.ply\"), transform: (translate: (0, 0.7, 0), scale: (9, 3, 9)), {sheet}),
         (shape: Mesh(\"square.ply\"), transform: (translate: (0, 0.7, 20), scale: (9, -1, 9)), {sheet}),"
    );
    let plane = format!(
        "(shape: Plane(corners: ((-5, 0.8, -5), (-5, 0.8, 5), (5, 0.8, 5), (5, 0.8, -5))), {sheet}),"
    );
    let panes = [
        ("a sheet of a volume", &plane[..], left(0.5)),
        ("a sheet that its transform makes thicker", &meshes[..], left(1.5)),
        (
            "a pane",
            "(shape: Plane(corners: ((-5, 1, -5), (5, 1, -5), (5, 1, 5), (-5, 1, 5))),
              material: Principled(metallic: 0, roughness: 0, transmission: 1)),",
            [1.0 - reflected(cosine); 3],
        ),
        (
            "a coloured one that scatters a part of the light",
            "(shape: Plane(corners: ((-5, 1.2, -5), (5, 1.2, -5), (5, 1.2, 5), (-5, 1.2, 5))),
              material: Principled(metallic: 0, roughness: 0, transmission: 0.7, base_color: (0.9, 0.5, 0.2))),",
            [0.9, 0.5, 0.2].map(|c| 0.7 * c * (1.0 - reflected(cosine))),
        ),
        (
            "a bubble, met twice",
            "(shape: Sphere(radius_m: 0.3), transform: (translate: (0.75, 1.5, 0)),
              material: Principled(metallic: 0, roughness: 0, transmission: 1, double_sided: true)),",
            [0.96 * 0.96; 3],
        ),
        (
            "a bubble without an inside",
            "(shape: Sphere(radius_m: 0.1), transform: (translate: (0.3, 0.6, 0)),
              material: Principled(metallic: 0, roughness: 0, transmission: 1)),",
            [0.96; 3],
        ),
        (
            "a sheet of which nothing is there",
            "(shape: Plane(corners: ((0.2, 0.2, -1), (0.2, 2, -1), (0.2, 2, 1), (0.2, 0.2, 1))),
              material: Principled(metallic: 0, roughness: 0, transmission: 1, base_color: 0, alpha: 0,
                                   alpha_mode: Blend)),",
            [1.0; 3],
        ),
        (
            "copies of a mesh, one of them mirrored",
            "(shape: Mesh(\"cube.ply\"), transform: (translate: (0.26, 0.5, 0), scale: 0.2),
              material: Principled(metallic: 0, roughness: 0, transmission: 1, specular: 0, base_color: 0.9,
                                   double_sided: true)),
             (shape: Mesh(\"cube.ply\"), transform: (translate: (0.4, 0.8, 0.01), scale: (-0.1, 0.1, 0.1)),
              material: Principled(metallic: 0, roughness: 0, transmission: 1, specular: 0, base_color: 0.9,
                                   double_sided: true)),",
            [0.9f64.powi(4); 3],
        ),
    ];
    let (mut all, mut left) = (LAMP.to_owned(), [plain; 3]);
    for (what, pane, transmitted) in &panes {
        let expected = transmitted.map(|part| plain * part);
        for settings in [FEW.to_owned(), format!("{FEW}, copied_triangles: 0")] {
            assert_near(floor(&settings, &format!("{LAMP}{pane}")), expected, 1e-3, what);
        }
        all += pane;
        left = [0, 1, 2].map(|channel| left[channel] * transmitted[channel]);
    }
    assert_near(floor(FEW, &all), left, 2e-3, "all of them");
}

#[test]
fn refracting_and_rough_glass_block_rays_to_lights() {
    for glass in ["roughness: 0, volume: ()", "roughness: 0.3"] {
        let pane = format!(
            "(shape: Plane(corners: ((-5, 1, -5), (5, 1, -5), (5, 1, 5), (-5, 1, 5))),
              material: Principled(metallic: 0, transmission: 1, {glass})),"
        );
        assert_eq!(
            floor("samples: 1, max_depth: 0, size: (4, 4)", &format!("{LAMP}{pane}")),
            [0.0; 3],
            "{glass}"
        );
    }
}

/// Sampled directions and rays to lights together find all light, with any number of bounces.
#[test]
fn visible_area_lights_behind_panes_match_their_integral() {
    for side in [0.1, 1.0, 6.0] {
        for depth in [0, 1, 5] {
            let entities = format!(
                "(light: Area(power_w: 100, size_m: {side}, visible: true),
                  transform: LookAt(from: (0, 2, 0), to: (0, 0, 0), up: (1, 0, 0))),
                 (shape: Plane(corners: ((-9, 1, -9), (9, 1, -9), (9, 1, 9), (-9, 1, 9))),
                  material: Principled(metallic: 0, roughness: 0, transmission: 1, base_color: (1, 0.6, 0.3))),
                 (shape: Plane(corners: ((-9, 1.5, -9), (9, 1.5, -9), (9, 1.5, 9), (-9, 1.5, 9))),
                  material: Principled(metallic: 0, roughness: 0, transmission: 1, specular: 0)),"
            );
            // Light returns from the panes to the floor only by the floor's own reflection.
            let settings = format!("size: (16, 16), samples: 64, max_depth: {depth}");
            let found = floor(&settings, &entities);
            let steps = 400;
            let (mut sum, cell) = (0.0, side / f64::from(steps));
            let radiance = 100.0 / (PI * side * side);
            let place = |i: i32| (f64::from(i) + 0.5) * cell - side / 2.0;
            for (x, z) in
                (0..steps).flat_map(|i| (0..steps).map(move |k| (i, k))).map(|(i, k)| (place(i), place(k)))
            {
                let square = x * x + z * z + 4.0;
                let cosine = 2.0 / square.sqrt();
                sum += radiance * (1.0 - reflected(cosine)) * cosine * cosine / square * cell * cell;
            }
            let expected = [1.0, 0.6, 0.3].map(|color| 0.8 / PI * sum * color);
            // At a depth of 5 the floor's reflection in the pane contributes.
            let more = if depth < 2 { 0.01 } else { 0.08 };
            for (found, expected) in found.iter().zip(expected) {
                let ratio = found / expected;
                assert!((0.99..1.0 + more).contains(&ratio), "{side} m, {depth} bounces: {ratio}");
            }
        }
    }
}

/// An environment image is sampled, too.
#[test]
fn environment_behind_a_pane_is_attenuated_by_its_colour() {
    let entities = |pane: &str| {
        format!(
            "(light: Environment(image: \"floats.hdr\")),
             (shape: Plane(corners: ((-99, 1, -99), (99, 1, -99), (99, 1, 99), (-99, 1, 99))),
              material: Principled(metallic: 0, roughness: 0, transmission: 1, specular: 0, base_color: {pane})),"
        )
    };
    let settings = "size: (16, 16), samples: 64, max_depth: 1";
    let clear = floor(settings, "(light: Environment(image: \"floats.hdr\")),");
    let dark = floor(settings, &entities("(0.8, 0.5, 0.25)"));
    let expected = [0, 1, 2].map(|channel| clear[channel] * [0.8, 0.5, 0.25][channel]);
    assert_near(dark, expected, 0.02, "the floor's sky");
}

/// A material that does not refract, with this volume.
fn fog(volume: &str) -> String {
    format!("material: Principled(metallic: 0, roughness: 0, ior: 1, transmission: 1, volume: ({volume}))")
}

#[test]
fn fog_absorbs_light_on_its_way_in_and_out() {
    let absorbing = "attenuation_color: (0.9, 0.5, 0.2), attenuation_distance_m: 1";
    let ball = format!(
        "(light: Directional(irradiance: 2), transform: LookAt(from: (0, 3, 4), to: (0, 0, 0))),
         (shape: Sphere(radius_m: 1.5), {}),",
        fog(absorbing)
    );
    // The camera is inside.
    let way_in = 1.5;
    let way_out = (1.0f64 + 0.01).sqrt();
    let expected = [0.9f64, 0.5, 0.2].map(|c| 2.0 * 0.6 * 0.8 / PI * c.powf(way_in + way_out));
    assert_near(floor(FEW, &ball), expected, 2e-3, "from within");
    // A light within, behind a second body that lies inside the first and displaces it.
    let lamp = format!(
        "{LAMP}(shape: Sphere(radius_m: 5), {}),
         (shape: Sphere(radius_m: 0.5), transform: (translate: (0.5, 1, 0)),
          material: Principled(metallic: 0, roughness: 0, ior: 1, transmission: 1, base_color: (0.5, 1, 1),
                               volume: (attenuation_color: 0.3, attenuation_distance_m: 1))),",
        fog(absorbing)
    );
    let (square, cosine) = (5.0f64, 2.0 / 5.0f64.sqrt());
    let plain = 0.8 / PI * 100.0 / (4.0 * PI) / square * cosine;
    let before = 5.0f64.sqrt() - 1.0;
    let expected = [(0.9f64, 0.25), (0.5, 1.0), (0.2, 1.0)]
        .map(|(color, tint)| plain * tint * 0.3 * color.powf(before + way_out));
    assert_near(floor(FEW, &lamp), expected, 2e-3, "a lamp within");
}

/// Single scattering in a thin slab lit by a sun, from the camera's side or from another angle.
#[test]
fn fog_scatters_light_by_its_phase_function() {
    let phase = |g: f64, cosine: f64| (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5));
    // Absorption is so strong that hardly any light is scattered twice.
    let (sigma, color) = (-0.3f64.ln(), 0.0004f64);
    let root = 4.09712 + 4.20863 * color - (9.59217 + 41.6808 * color + 17.7126 * color * color).sqrt();
    let albedo = 1.0 - root * root;
    for anisotropy in [-0.5, 0.0, 0.7] {
        for angle in [0.0f64, 60.0, 120.0, 180.0] {
            let (sine, cosine) = angle.to_radians().sin_cos();
            let text = format!(
                "(settings: (size: (8, 8), samples: 256, transport: Path, filter: Box, sharing: Off),
                  entities: [
                      (camera: Orthographic(height_m: 0.01), transform: LookAt(from: (0, 0, 9), to: (0, 0, 0))),
                      (light: Directional(irradiance: 2),
                       transform: LookAt(from: ({}, 0, {}), to: (0, 0, 0), up: (0, 1, 0))),
                      (shape: Mesh(\"cube.ply\"), transform: (scale: (40, 40, 1)), {}),
                  ])",
                9.0 * sine,
                9.0 * cosine,
                fog(&format!(
                    "attenuation_color: 0.3, attenuation_distance_m: 1, multiscatter_color: {color},
                     scatter_anisotropy: {anisotropy}"
                ))
            );
            let found = mean_rgb(&picture(&text))[1];
            let once: f64 = (0..1000)
                .map(|i| (f64::from(i) + 0.5) / 1000.0)
                .map(|depth| {
                    let way_in = if cosine > 0.0 { depth } else { 1.0 - depth } / cosine.abs();
                    albedo * sigma * (-sigma * (depth + way_in)).exp() / 1000.0
                })
                .sum::<f64>()
                * 2.0
                * phase(anisotropy, -cosine);
            assert!((found / once - 1.0).abs() < 0.03, "g {anisotropy}, {angle}°: {found}, not {once}");
        }
    }
}

/// An emitter that rays can hit is not counted twice in fog, whatever its size.
#[test]
fn light_sampling_and_random_hits_agree_in_fog() {
    let scene = |visible: bool, ior: f32| {
        format!(
            "(settings: (size: (12, 12), samples: 4096, transport: Path, filter: Box, sharing: Off),
              entities: [
                  (camera: Pinhole(vertical_fov_degrees: 30), transform: LookAt(from: (0, 0, 5), to: (0, 0, 0))),
                  (light: Area(power_w: 30, size_m: 4, visible: {visible}),
                   transform: LookAt(from: (0, 2.5, 0), to: (0, 0, 0), up: (1, 0, 0))),
                  (shape: Sphere(radius_m: 1), material: Principled(metallic: 0, roughness: 0, ior: {ior},
                   transmission: 1, volume: (attenuation_color: (0.8, 0.6, 0.4), attenuation_distance_m: 1,
                   multiscatter_color: 0.95, scatter_anisotropy: 0.3))),
              ])"
        )
    };
    let sampled = mean_rgb(&picture(&scene(false, 1.0)));
    // With an index that hardly bends light, rays to lights do not enter: only paths find the emitter.
    let by_chance = mean_rgb(&picture(&scene(true, 1.00001)));
    let both = mean_rgb(&picture(&scene(true, 1.0)));
    assert_near(both, sampled, 0.01, "both ways");
    assert_near(by_chance, sampled, 0.02, "by chance");
}

/// Both sides of a bubble emit, but light samples only lie on the near side.
#[test]
fn emission_behind_transparent_emitters_is_visible() {
    let bubble = "(shape: Sphere(radius_m: 0.5), transform: (translate: (0, 2, 0)),
         material: Principled(metallic: 0, roughness: 0, transmission: 1, specular: 0, emission: 3,
                              double_sided: true)),";
    let found = floor("size: (16, 16), samples: 64, max_depth: 1", bubble);
    assert_near(found, [2.0 * 0.8 * 3.0 * 0.25 / 4.0; 3], 0.01, "a bubble");
    let half = "(shape: Sphere(radius_m: 0.5), transform: (translate: (0, 2, 0)),
         material: Principled(base_color: 0, specular: 0, metallic: 0, alpha: 0.5, alpha_mode: Blend, emission: 3,
                              double_sided: true)),";
    let found = floor("size: (16, 16), samples: 256, max_depth: 1", half);
    // Half of the near side, and half of what is visible of the far side through the other half.
    let expected = 0.75 * 0.8 * 3.0 * 0.25 / 4.0;
    assert_near(found, [expected; 3], 0.02, "a veil");
}

/// Rays to lights and sampled directions see the same part of a pane as smooth, with any texture filter.
#[test]
fn textured_panes_transmit_shadow_rays_and_sampled_rays_alike() {
    let scene = |visible: bool, filter: &str| {
        format!(
            "(light: Area(power_w: 100, size_m: 2, visible: {visible}),
              transform: LookAt(from: (0, 2, 0), to: (0, 0, 0), up: (1, 0, 0))),
             (shape: Plane(corners: ((-9, 1, -9), (9, 1, -9), (9, 1, 9), (-9, 1, 9))),
              material: Principled(metallic: 0, transmission: 1, specular: 0,
                roughness: Texture(image: \"quarters.png\", channel: Red, scale: 20, filter: {filter}))),"
        )
    };
    for filter in ["Nearest", "Trilinear"] {
        let settings = "size: (32, 32), samples: 256, max_depth: 0";
        let [seen, unseen] = [true, false].map(|visible| floor(settings, &scene(visible, filter)));
        assert_near(seen, unseen, 0.02, filter);
    }
}

/// A path's contribution is clamped with the transmittance of panes included.
#[test]
fn clamp_applies_after_the_transmittance_of_panes() {
    let mirror = |clamp: &str| {
        let text = format!(
            "(settings: (size: (4, 4), samples: 4, max_depth: 1, transport: Path, filter: Box {clamp}),
              entities: [
                  (camera: Orthographic(height_m: 0.001), transform: LookAt(from: (0, 1, 3), to: (0, 1, 0))),
                  (shape: Plane(corners: ((-1, 0, 0), (1, 0, 0), (1, 2, 0), (-1, 2, 0))),
                   material: Principled(metallic: 1, roughness: 0, base_color: 1)),
                  (shape: Plane(corners: ((-9, -9, 9), (9, -9, 9), (9, 9, 9), (-9, 9, 9))), material: (diffuse: 0.5)),
                  (light: Directional(irradiance: 1000), transform: LookAt(from: (3, 0, 0), to: (0, 0, 9))),
                  (shape: Plane(corners: ((-9, -9, 8), (9, -9, 8), (9, 9, 8), (-9, 9, 8))),
                   material: Principled(metallic: 0, roughness: 0, transmission: 1, specular: 0, base_color: 0.01)),
              ])"
        );
        mean_rgb(&picture(&text))[0]
    };
    // The sampled ray passes the mirror and the pane once each, and the ray to the sun passes the pane once.
    let whole = 0.01 * 0.01 * 1000.0 * (9.0 / 90.0f64.sqrt()) * 0.5 / PI;
    assert!((mirror("") / whole - 1.0).abs() < 1e-3, "{}", mirror(""));
    assert!((mirror(", clamp: 1") / whole - 1.0).abs() < 1e-3, "less than the limit");
    assert!((mirror(", clamp: 0.01") - 0.01).abs() < 1e-6, "more than the limit");
}

/// With any roughness of the boundary, and any other parameters of it.
#[test]
fn fog_ignores_its_boundarys_parameters() {
    let ball = |more: &str| {
        format!(
            "{LAMP}(shape: Sphere(radius_m: 1.5), material: Principled(metallic: 0, transmission: 1, ior: 1, {more}
               volume: (attenuation_color: 0.5, attenuation_distance_m: 1, multiscatter_color: 0.5))),"
        )
    };
    let smooth = floor("size: (8, 8), samples: 64", &ball("roughness: 0,"));
    for more in ["", "roughness: 0.02,", "dispersion: 1,", "anisotropy: (strength: 0.5),"] {
        assert_eq!(floor("size: (8, 8), samples: 64", &ball(more)), smooth, "{more}");
    }
    // No table is missing.
    floor(FEW, &ball("roughness: 0, anisotropy: (strength: 0.5),").replace("ior: 1,", "ior: 1.5,"));
}

/// The rays of an orthographic camera start side by side, so its position does not decide which body they start in.
#[test]
fn orthographic_rays_do_not_all_start_in_the_cameras_body() {
    let text = format!(
        "(settings: (size: (16, 16), samples: 16, transport: Path, filter: Box, background: 1),
          entities: [
              (camera: Orthographic(height_m: 10), transform: LookAt(from: (0, 0, 0), to: (0, 0, -1))),
              (shape: Sphere(radius_m: 0.1), {}),
          ])",
        fog("attenuation_color: 0.1, attenuation_distance_m: 0.1")
    );
    assert!(mean_rgb(&picture(&text))[0] > 0.98);
}

/// The body around a wide lens is the body around its centre.
#[test]
fn thin_lens_starts_in_the_body_around_its_centre() {
    let around = |x: f32, y: f32| {
        let text = format!(
            "(settings: (size: (4, 4), transport: Path),
              entities: [
                  (camera: ThinLens(lens_radius_m: 1, focus_distance_m: 3)),
                  (shape: Sphere(radius_m: 0.3), transform: (translate: ({x}, {y}, 0)), {}),
              ])",
            fog("attenuation_color: 0.1, attenuation_distance_m: 0.1")
        );
        let world = world(&text);
        let scene = rayfront::compile::compile(&world, None).expect("a scene");
        rayfront::internals::render::setup(scene, &world.settings).around
    };
    assert_ne!(around(0.1, -0.1), 0);
    for (x, y) in [(0.5, 0.5), (0.7, 0.0), (-0.5, 0.5), (0.0, -0.9)] {
        assert_eq!(around(x, y), 0, "{x} {y}");
    }
}

/// Paths that lose light within a body cannot be given to others.
#[test]
fn path_reuse_is_unbiased_within_bodies() {
    let [alone, together] = ["Off", "16"].map(|sharing| {
        let text = format!(
            "(settings: (size: (16, 16), samples: 64, transport: Path, filter: Box, sharing: {sharing}),
              entities: [
                  (camera: Pinhole, transform: LookAt(from: (0, 0.5, 0.9), to: (0, 0, 0))),
                  (shape: Sphere(radius_m: 1.5), {}),
                  (shape: Mesh(\"cube.ply\"), transform: (scale: 2), material: (diffuse: 0.8)),
                  (light: Point(power_w: 10), transform: (translate: (0.3, 0.8, 0.2))),
              ])",
            fog("attenuation_color: (0.5, 0.1, 0.01), attenuation_distance_m: 1")
        );
        mean_rgb(&picture(&text))
    });
    assert_near(together, alone, 0.02, "shared");
}

/// Path reuse changes the noise only.
#[test]
fn path_reuse_is_unbiased_with_windows() {
    let mut world = world(&crate::agreement::windows_in_air());
    world.settings.samples = 256;
    let setup = |world: &rayfront::world::World| {
        let scene = rayfront::compile::compile(world, None).expect("a scene");
        rayfront::internals::render::setup(scene, &world.settings)
    };
    let mut means = [Sharing::Off, Sharing::Groups(16)].map(|sharing| {
        world.settings.sharing = sharing;
        assert_eq!(setup(&world).sharing.is_some(), sharing != Sharing::Off);
        mean_rgb(&Picture::of(&world))
    });
    let [alone, together] = &mut means;
    assert_near(*together, *alone, 0.02, "shared");
}

/// A pane of thin strips at an angle to the axes, which the tree holds in parts: a part that a ray meets twice must not
/// darken it twice.
#[test]
fn strips_of_a_pane_count_once() {
    use glam::DVec3;
    let along = DVec3::new(1.0, 0.4, 0.9).normalize();
    let across = DVec3::new(-0.9, 0.1, 0.9).normalize();
    let pane = |strips: usize| {
        let corner = |u: f64, v: f64| {
            let DVec3 { x, y, z } =
                DVec3::new(0.5, 1.0, 0.0) + along * (u - 0.5) * 6.0 + across * (v - 0.5) * 6.0;
            format!("({x}, {y}, {z})")
        };
        let strip = |i: usize| {
            let [a, b] = [i, i + 1].map(|i| i as f64 / strips as f64);
            let corners = [corner(0.0, a), corner(1.0, a), corner(1.0, b), corner(0.0, b)].join(", ");
            format!("(shape: Plane(corners: ({corners})), material: \"pane\"),")
        };
        let all: String = (0..strips).map(strip).collect();
        let text = format!(
            "(settings: (size: (24, 24), samples: 16, transport: Path, sharing: Off, max_depth: 1),
              materials: {{\"pane\": Principled(base_color: (0.9, 0.5, 0.2), metallic: 0, roughness: 0, transmission: 1)}},
              entities: [
                (camera: Orthographic(height_m: 0.4), transform: LookAt(from: (0, 0.3, 0.05), to: (0, 0, 0))),
                (shape: Plane(corners: ((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))), material: (diffuse: 0.8)),
                {LAMP} {all}])"
        );
        let blocks = compile_after(&world(&text), None, None).expect("a scene").scene.bvh.triangles.len();
        assert!(strips == 1 || blocks > strips / 3, "{blocks} blocks of up to 8 hold whole triangles");
        mean_rgb(&picture(&text))
    };
    assert_near(pane(400), pane(1), 2e-3, "400 strips");
}
