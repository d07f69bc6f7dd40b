//! Pictures with an opacity: what they show over anything, in all ways to render and in all files.

use rayfront::film::Film;
use rayfront::internals::integrator::Schedule;
use rayfront::math::Rgb;
use rayfront::render::Options;
use rayfront::world::{Aov, World};

use crate::program::{Folder, Place, empty_folder};
use crate::support::{self, film, mean};

/// Things that let light through in every way, under light from all around: a ball of glass, a tinted one, a rough one,
/// fog, a pane, a blended surface, a cut-out, and a mirror.
const THINGS: &str = r#"(
    settings: (size: (32, 18), samples: 8, SETTINGS),
    materials: {
        "floor": (diffuse: (0.5, 0.4, 0.3)),
        "mirror": (diffuse: 0, kr: 0.9),
        "glass": Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5, volume: Some(())),
        "rough": Principled(metallic: 0, roughness: 0.4, transmission: 1, ior: 1.5, volume: Some(())),
        "fog": Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1, volume: Some((
            attenuation_color: 0.5, attenuation_distance_m: 0.5, multiscatter_color: 0.7))),
        "pane": Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5),
        "veil": Principled(metallic: 0, base_color: (0.1, 0.6, 0.1), alpha: 0.4, alpha_mode: Blend),
        "net": Principled(metallic: 0, alpha: Checker(scale: 4, a: 0, b: 1), alpha_mode: Mask(cutoff: 0.5)),
    },
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 40), transform: (translate: (0, 0.4, 6))),
        (light: Environment(radiance: 0.5)),
        (light: Point(power_w: 100), transform: (translate: (1, 4, 3))),
        (shape: Disc(radius_m: 1.5), material: "floor", transform: (translate: (0, -1.5, 0))),
        (shape: Sphere(radius_m: 0.6), material: "glass", transform: (translate: (-2.4, 0.2, 0))),
        (shape: Sphere(radius_m: 0.6), material: "rough", transform: (translate: (-1.1, 0.2, 0))),
        (shape: Sphere(radius_m: 0.6), material: "fog", transform: (translate: (0.2, 0.2, 0))),
        (shape: Sphere(radius_m: 0.4), material: "mirror", transform: (translate: (2.9, -0.7, 0))),
        (shape: Plane(corners: ((0.9, 0, 0), (1.5, 0, 0), (1.5, 1, 0), (0.9, 1, 0))), material: "veil"),
        (shape: Plane(corners: ((1.6, 0, 0), (2.3, 0, 0), (2.3, 1, 0), (1.6, 1, 0))), material: "net"),
        (shape: Plane(corners: ((2.5, 0, 0), (3.1, 0, 0), (3.1, 1, 0), (2.5, 1, 0))), material: "pane"),
    ],
)"#;

const WAYS: [&str; 6] = [
    "transport: Whitted, background: 0.5",
    "transport: Path, sharing: Off, caustics: Off",
    "transport: Path, sharing: 16, caustics: Off, copied_triangles: 0",
    "transport: Path, sharing: 8, caustics: (photons: 1), light_groups: true",
    "transport: Path, adaptive: On, caustics: Off",
    "transport: Path, sharing: Off, caustics: Off, background: 1000000, clamp: 3",
];

fn things(settings: &str) -> World {
    support::world(&THINGS.replace("SETTINGS", settings))
}

fn transparent(way: &str) -> World {
    things(&format!("{way}, transparent: true"))
}

/// A film's colours over a background of one brightness.
fn over(film: &Film, behind: f32) -> Vec<Rgb> {
    let alpha = film.alpha().expect("a film with alpha");
    film.radiance().iter().zip(alpha).map(|(own, alpha)| *own + Rgb::splat(behind * (1.0 - alpha))).collect()
}

/// The samples are those of the opaque image, so this is exact but for rounding, noise or not.
#[test]
fn pictures_over_the_background_are_those_with_it() {
    for way in &WAYS[..4] {
        let (opaque, film) =
            (film(&things(way), Options::default()), film(&transparent(way), Options::default()));
        assert!(opaque.alpha().is_none());
        for (at, (over, whole)) in over(&film, 0.5).iter().zip(opaque.radiance()).enumerate() {
            for (over, whole) in over.to_array().into_iter().zip(whole.to_array()) {
                assert!(
                    (over - whole).abs() < 1e-4 * whole.max(1.0),
                    "{way}, pixel {at}: {over}, not {whole}"
                );
            }
        }
        let alpha = film.alpha().unwrap();
        assert!(alpha.iter().all(|alpha| (0.0..=1.0).contains(alpha)), "{way}");
        assert!(alpha.contains(&0.0) && alpha.contains(&1.0), "{way}: sky and floor");
    }
}

#[test]
fn opacity_has_the_known_values() {
    let of = |material: &str, angle: f32| {
        let scene = format!(
            r#"(
                settings: (size: (16, 16), samples: 256, transport: Path, transparent: true),
                materials: {{ "it": {material} }},
                entities: [
                    (camera: Orthographic(height_m: 1), transform: (translate: (0, 0, 5))),
                    (light: Environment(radiance: 1)),
                    (shape: Plane(corners: ((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0))), material: "it",
                     transform: (rotate_degrees: (0, {angle}, 0))),
                ],
            )"#
        );
        let alpha = film(&support::world(&scene), Options::default()).alpha().unwrap();
        alpha.iter().map(|alpha| f64::from(*alpha)).sum::<f64>() / alpha.len() as f64
    };
    let near =
        |found: f64, expected: f64| assert!((found - expected).abs() < 3e-3, "{found}, not {expected}");
    near(of("Principled(metallic: 0)", 20.0), 1.0);
    near(of("Principled(metallic: 0, alpha: 0.3, alpha_mode: Blend)", 20.0), 0.3);
    near(of("Principled(metallic: 0, roughness: 0.5, transmission: 1)", 20.0), 1.0);
    // Fresnel's reflectance of a thin sheet, seen straight on.
    near(of("Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5)", 0.0), 0.04);
}

#[test]
fn opacity_of_opaque_things_is_their_coverage() {
    let scene = THINGS.replace("SETTINGS", "transport: Path, transparent: true, aov: [Coverage]");
    let world =
        support::world(&scene.replace("transmission: 1", "transmission: 0").replace("Blend", "Opaque"));
    let session = support::session(&world, Options::default());
    let channels = session.channels(&[Aov::Coverage]);
    let rayfront::film::Values::Float(coverage) = &channels[0].values else { panic!("coverage is a float") };
    for (alpha, coverage) in session.film().alpha().unwrap().iter().zip(coverage) {
        assert!((alpha - coverage).abs() < 1e-6, "{alpha}, not {coverage}");
    }
}

#[test]
fn opacity_is_the_same_in_all_ways_to_render() {
    for way in WAYS {
        let world = transparent(way);
        let expected = film(&world, Options::default());
        assert!(mean(&expected.radiance()) > 1e-3);
        for (schedule, wave) in
            [(Schedule::Recursive, 64), (Schedule::Wavefront, 50), (Schedule::Wavefront, 1)]
        {
            let found = film(&world, Options { schedule, wave, ..Options::default() });
            assert_eq!(found, expected, "{way}, {schedule:?}, wave {wave}");
        }
    }
}

/// A ball in a folder, with light from all around.
fn ball() -> Folder {
    let folder = empty_folder();
    folder.write(
        "ball.ron",
        r#"(
            settings: (size: (16, 12), samples: 4),
            entities: [
                (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 0, 4), to: (0, 0, 0))),
                (light: Environment(radiance: (0.5, 1, 2))),
                (shape: Sphere(radius_m: 1), material: (diffuse: 0, emission: (0.8, 0.2, 0.1))),
            ],
        )"#,
    );
    folder
}

#[test]
fn images_hold_the_opacity_in_the_way_of_their_format() {
    let folder = ball();
    folder.out("ball.ron --transparent -q -o a.png -o a.webp -o a.exr -o a.film");
    folder.out("ball.ron --transparent -q --bits 16 -o b.png");
    let pixels = |name: &str| image::open(folder.join(name)).expect(name).to_rgba32f();
    let (png, webp, sixteen) = (pixels("a.png"), pixels("a.webp"), pixels("b.png"));
    assert_eq!(png, webp);
    assert_eq!((png.get_pixel(0, 0).0, png.get_pixel(8, 6).0[3]), ([0.0; 4], 1.0));
    // The ball has its colour wherever there is anything of it, whatever is around it.
    let color = [0.8, 0.2, 0.1].map(rayfront::internals::film::tonemap::srgb_encode);
    let mut edges = 0;
    for (pixel, fine) in png.pixels().zip(sixteen.pixels()) {
        let alpha = pixel.0[3];
        edges += usize::from(alpha > 0.0 && alpha < 1.0);
        let expected = if alpha > 0.0 { color } else { [0.0; 3] };
        for (channel, expected) in expected.into_iter().enumerate() {
            assert!((pixel.0[channel] - expected).abs() < 0.003, "{pixel:?}");
            assert!((fine.0[channel] - expected).abs() < 1e-4, "{fine:?}");
        }
        assert!((alpha - fine.0[3]).abs() < 0.003);
    }
    assert!(edges > 4);
    // Associated with alpha.
    let exr = exr::prelude::read_first_rgba_layer_from_file(
        folder.join("a.exr"),
        |size, _| vec![vec![[0.0f32; 4]; size.width()]; size.height()],
        |pixels, at, (r, g, b, a): (f32, f32, f32, f32)| pixels[at.y()][at.x()] = [r, g, b, a],
    );
    let exr = exr.expect("an image with alpha").layer_data.channel_data.pixels;
    for (at, pixel) in png.pixels().enumerate() {
        let [r, _, _, alpha] = exr[at / 16][at % 16];
        assert!((alpha - pixel.0[3]).abs() < 0.003);
        if alpha > 0.0 {
            let shown = rayfront::internals::film::tonemap::srgb_encode((r / alpha).min(1.0));
            assert!((shown - pixel.0[0]).abs() < 0.003, "{shown}, not {}", pixel.0[0]);
        }
    }
    folder.out("reproduce a.png -q");
    folder.out("reproduce a.exr -q");
}

#[test]
fn films_with_opacity_merge_and_go_on() {
    let folder = ball();
    folder.out("ball.ron --transparent -q -o whole.film");
    folder.out("ball.ron --transparent -q --shard 0/2 -o 0.film");
    folder.out("ball.ron --transparent -q --shard 1/2 -o 1.film");
    folder.out("merge 0.film 1.film -q -o both.film -o both.png");
    let hash =
        |name: &str| rayfront::internals::formats::film_file::load(&folder.join(name)).unwrap().film.hash();
    assert_eq!(hash("whole.film"), hash("both.film"));
    folder.write("set.ron", folder.text("ball.ron").replace("samples: 4", "samples: 2, transparent: true"));
    folder.out("set.ron -q -o set.film");
    folder.out("resume set.film --spp 4 -q");
    assert_eq!(hash("whole.film"), hash("set.film"), "the setting and the option are one");
}

#[test]
fn formats_without_opacity_are_refused_before_rendering() {
    let folder = ball();
    for (name, code) in [("a.jpg", 3), ("a.hdr", 3), ("jpg:-", 2)] {
        folder.fails(
            code,
            &format!("ball.ron --transparent --spp 100000 -o {name}"),
            &["no transparent pixels", ".webp"],
        );
    }
    folder.fails(
        2,
        "ball.ron --transparent --spp 100000 --frames 1-2 -o -",
        &["a video holds no transparent pixels"],
    );
}

/// Browsers blend encoded values: a page must look like a picture on the page's white, shadows, too.
#[test]
fn transparent_images_on_a_white_page_are_those_before_white() {
    let folder = ball();
    // Opacity is one number, so shadows must have no colour.
    let grey = folder.text("ball.ron").replace("(0.5, 1, 2)", "1").replace("(0.8, 0.2, 0.1)", "0.4");
    folder.write("ball.ron", grey);
    let scene = "ball.ron --ground shadow --transport path --orbit 0,30 --zoom 0.5 --spp 64 --size 32x24 -q";
    let pixels = |options: &str| {
        folder.out(&format!("{scene} {options} -o a.png"));
        let name = if options.contains("--denoise") { "a.denoised.png" } else { "a.png" };
        image::open(folder.join(name)).expect("an image").to_rgba32f()
    };
    for denoise in ["", "--denoise"] {
        let shown = pixels(&format!("--transparent {denoise}"));
        let on_white = pixels(&format!("--background white {denoise}"));
        let mut darkest = 1.0f32;
        for (shown, expected) in shown.pixels().zip(on_white.pixels()) {
            let [.., alpha] = shown.0;
            // Edges of things are as usual in linear light: there, an eighth of the range is apart.
            let near = if shown.0[0] > 0.05 && alpha < 1.0 { 0.15 } else { 2.5 / 255.0 };
            for (color, expected) in shown.0.into_iter().zip(expected.0).take(3) {
                let found = color * alpha + 1.0 - alpha;
                assert!((found - expected).abs() < near, "{denoise}: {found}, not {expected}: {shown:?}");
            }
            darkest = if shown.0[0] == 0.0 { darkest.min(expected.0[0]) } else { darkest };
        }
        assert!(darkest < 0.8, "no shadow: {darkest}");
    }
}

/// A filter lets one colour through more than others, and an image has one opacity.
#[test]
fn coloured_glass_and_its_shadow_have_their_colours_on_a_white_page() {
    let folder = empty_folder();
    folder.write(
        "glass.ron",
        r#"(
            settings: (size: (32, 24), samples: 64, transport: Path, caustics: Off),
            entities: [
                (camera: Pinhole(vertical_fov_degrees: 40),
                 transform: LookAt(from: (0, 2.4, 4), to: (0, 0, 0))),
                (light: Environment(radiance: 0.5)),
                (light: Point(power_w: 300, radius_m: 0.3), transform: (translate: (1, 4, -1))),
                (shape: Sphere(radius_m: 1), material: Principled(
                    metallic: 0, roughness: 0, transmission: 1, ior: 1,
                    volume: Some((attenuation_color: (0.15, 1, 0.4), attenuation_distance_m: 1)))),
            ],
        )"#,
    );
    let pixels = |options: &str| {
        folder.out(&format!("glass.ron {options} -q -o a.png"));
        image::open(folder.join("a.png")).expect("an image").to_rgba32f()
    };
    for ground in ["", "--ground shadow"] {
        let [shown, on_white] =
            ["--transparent", "--background white"].map(|behind| pixels(&format!("{ground} {behind}")));
        let (mut greenest, mut far) = (0.0f32, 0.0f32);
        for (shown, expected) in shown.pixels().zip(on_white.pixels()) {
            let ([.., alpha], [red, green, ..]) = (shown.0, expected.0);
            greenest = greenest.max(green - red);
            for (color, expected) in shown.0.into_iter().zip(expected.0).take(3) {
                far = far.max((color * alpha + 1.0 - alpha - expected).abs());
            }
        }
        assert!(greenest > 0.5, "{ground}: {greenest}");
        assert!(far < 4.0 / 255.0, "{ground}: {far}");
    }
}

/// Chance decides if a sample passes a blended surface, so opacity is as noisy there as light, above shadows, too.
#[test]
fn denoising_smooths_the_opacity_of_blended_surfaces() {
    let folder = empty_folder();
    folder.write(
        "veil.ron",
        r#"(
            settings: (size: (48, 27), samples: 8, transport: Path),
            entities: [
                (camera: Pinhole(vertical_fov_degrees: 40), transform: (translate: (0, 0, 6))),
                (light: Environment(radiance: 0.5)),
                (shape: Plane(corners: ((-2, -1, 0), (2, -1, 0), (2, 1, 0), (-2, 1, 0))),
                 material: Principled(metallic: 0, base_color: 0.2, alpha: 0.4, alpha_mode: Blend)),
            ],
        )"#,
    );
    let veil = |name: &str| {
        let image = image::open(folder.join(name)).expect("an image").to_rgba32f();
        let within = (10..17).flat_map(|y| (15..33).map(move |x| (x, y)));
        let alpha: Vec<f32> = within.map(|(x, y)| image.get_pixel(x, y).0[3]).collect();
        let mean = alpha.iter().sum::<f32>() / alpha.len() as f32;
        let squares = alpha.iter().map(|alpha| (alpha - mean).powi(2)).sum::<f32>();
        (mean, (squares / alpha.len() as f32).sqrt())
    };
    for ground in ["", "--ground=shadow"] {
        folder.out(&format!("veil.ron --transparent -q --denoise -o a.png {ground}"));
        let ((mean, spread), (clean_mean, clean_spread)) = (veil("a.png"), veil("a.denoised.png"));
        assert!((mean - clean_mean).abs() < 0.03, "{ground}: {mean}, {clean_mean}");
        assert!(clean_spread < 0.6 * spread, "{ground}: {spread} before, {clean_spread} after");
    }
}
