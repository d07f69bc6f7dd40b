//! Light groups: exact parts of the whole film, equal in all ways to render, mixed without rendering.

use rayfront::film::Film;
use rayfront::internals::integrator::{Schedule, Sorting};
use rayfront::math::Rgb;
use rayfront::render::Options;
use rayfront::world::{Light, Sharing, Transport, World};

use crate::program::{self, Folder, Place};
use crate::support::{self, film, mean};

/// A room with every kind of light: lamps, a window, a sky, shining shapes on their own and in a mesh that is placed
/// twice; with glass that throws caustics, a cut-out, smoke, and a mirror.
const ROOM: &str = r#"(
    settings: (size: (40, 30), samples: 8, max_depth: 8, SETTINGS),
    materials: {
        "wall": (diffuse: 0.7),
        "gloss": Principled(base_color: (0.6, 0.5, 0.3), roughness: 0.3),
        "mirror": (diffuse: 0, kr: 0.9),
        "glass": Principled(roughness: 0, transmission: 1, ior: 1.5, volume: Some(())),
        "smoke": Principled(roughness: 0, transmission: 1, ior: 1, volume: Some((
            attenuation_color: (0.4, 0.5, 0.6), attenuation_distance_m: 0.5, multiscatter_color: 0.7))),
        "glow": Principled(base_color: 0, emission: (4, 2, 1)),
        "ember": (diffuse: 0.2, emission: (1, 0.2, 0.1)),
        "veil": Principled(alpha: 0.5, alpha_mode: Blend),
    },
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 50), transform: (translate: (0, 1.2, 5))),
        (shape: Plane(corners: ((-3, 0, 6), (3, 0, 6), (3, 0, -3), (-3, 0, -3))), material: "wall"),
        (shape: Plane(corners: ((-3, 0, -3), (3, 0, -3), (3, 3, -3), (-3, 3, -3))), material: "gloss"),
        (shape: Plane(corners: ((-3, 0, 6), (-3, 0, -3), (-3, 3, -3), (-3, 3, 6))), material: "mirror"),
        (name: "ball", shape: Sphere(radius_m: 0.4), material: "glass", transform: (translate: (0.3, 0.5, 1))),
        (shape: Sphere(radius_m: 0.4), material: "smoke", transform: (translate: (-1, 0.6, 0.5))),
        (shape: Plane(corners: ((0.8, 0.2, 2), (1.6, 0.2, 2), (1.6, 1, 2), (0.8, 1, 2))), material: "veil"),
        (name: "bulb", light: Point(power_w: (60, 50, 40)), transform: (translate: (1, 2, 2))),
        (name: "panel", light: Area(power_w: (20, 30, 40), size_m: (0.6, 0.6), visible: true, samples: 2),
         transform: (translate: (-1, 2.4, 0), rotate_degrees: (-90, 0, 0))),
        (name: "spot", light: Spot(power_w: 30), transform: LookAt(from: (2, 2.5, 3), to: (0, 0, 0))),
        (name: "moon", light: Directional(irradiance: (0.1, 0.1, 0.3), angle_degrees: 2), transform: (rotate_degrees: (-60, 20, 0))),
        (name: "sky", light: Sky(elevation_degrees: 20, radiance: 0.3)),
        (name: "lantern", shape: Sphere(radius_m: 0.1), material: "glow", transform: (translate: (0.9, 0.7, 0.4))),
        (name: "coals", shape: Torus(radius_m: 0.2, tube_radius_m: 0.05), material: "ember",
         array: [(count: 2, step: (translate: (0.8, 0, 0)))], transform: (translate: (-0.5, 0.1, 2.2))),
    ],
)"#;

fn room(settings: &str) -> World {
    support::world(&ROOM.replace("SETTINGS", settings))
}

/// The ways in which the parts of a film's light may be found.
const WAYS: [&str; 7] = [
    "transport: Whitted",
    "transport: Path, sharing: Off, caustics: Off",
    "transport: Path, sharing: 16, caustics: Off, copied_triangles: 0",
    "transport: Path, sharing: Off, caustics: (photons: 1)",
    "transport: Path, sharing: 8, caustics: (photons: 1), clamp: 4",
    "transport: Whitted, caustics: (photons: 1), background: 0.2",
    "transport: Path, adaptive: On, caustics: Off",
];

/// The largest relative difference between the whole film and the sum of its groups, and the most light of no group.
fn rest_of(film: &Film) -> (f64, f64) {
    let mut sum = vec![[0.0f64; 3]; film.pixels().len()];
    for group in 0..film.light_groups() {
        for (sum, light) in sum.iter_mut().zip(film.group_radiance(group)) {
            (0..3).for_each(|channel| sum[channel] += f64::from(light.to_array()[channel]));
        }
    }
    let whole = film.radiance();
    let worst = whole.iter().zip(&sum).flat_map(|(whole, sum)| {
        (0..3).map(|channel| {
            let whole = f64::from(whole.to_array()[channel]);
            (whole - sum[channel]).abs() / whole.max(0.01)
        })
    });
    (
        worst.fold(0.0, f64::max),
        f64::from(film.ungrouped_radiance().iter().map(|rest| rest.max_component()).fold(0.0, f32::max)),
    )
}

#[test]
fn groups_of_all_lights_are_the_whole_film() {
    for way in WAYS {
        let world = room(&format!("{way}, light_groups: true"));
        let film = film(&world, Options::default());
        assert_eq!(film.light_groups(), 7, "{way}");
        let (worst, rest) = rest_of(&film);
        // Each contribution is rounded to the film's unit for itself.
        assert!(worst < 2e-5 && rest < 2e-5, "{way}: {worst} {rest}");
        let names = ["bulb", "panel", "spot", "moon", "sky", "lantern", "coals"];
        for (group, name) in names.iter().enumerate() {
            // Under the Whitted transport, what shines lights nothing, but is seen.
            assert!(mean(&film.group_radiance(group)) > 1e-5, "{way}: {name} gives light");
        }
        let plain = support::film(&room(way), Options::default());
        assert_eq!(plain.pixels(), film.pixels(), "{way}: groups change nothing");
        assert_eq!(film.mixed(&[Rgb::WHITE; 7]), film, "{way}");
    }
}

/// The light of some bounces is that of paths which end there: the same paths, shorter. Under the Whitted transport these
/// do not see what shines beyond their last bounce, but light from lamps arrives there.
#[test]
fn light_of_bounces_is_that_of_shorter_paths() {
    for transport in [Transport::Path, Transport::Whitted] {
        let rendered = |max_depth: u32, by_bounce: bool| {
            let mut world = room("caustics: Off, sharing: Off, roulette_depth: None, min_throughput: 0");
            let settings = &mut world.settings;
            (settings.transport, settings.max_depth) = (transport, max_depth);
            settings.light_by_bounce = by_bounce;
            film(&world, Options::default())
        };
        let film = rendered(4, true);
        assert_eq!(film.light_groups(), 6);
        let up_to = |last: u32| {
            let factors = (0..6).map(|bounce| Rgb::splat(if bounce <= last { 1.0 } else { 0.0 }));
            film.mixed(&factors.collect::<Vec<_>>()).radiance()
        };
        for depth in 0..4 {
            let (least, most) = (up_to(depth + u32::from(transport == Transport::Path)), up_to(depth + 1));
            for ((least, found), most) in least.iter().zip(rendered(depth, false).radiance()).zip(&most) {
                let [least, found, most] = [*least, found, *most].map(|light| light.to_array());
                for channel in 0..3 {
                    let margin = 1e-4 * found[channel].max(1.0);
                    let range = least[channel] - margin..=most[channel] + margin;
                    assert!(range.contains(&found[channel]), "{transport:?} {depth}: {found:?} {range:?}");
                }
            }
            assert!(mean(&film.group_radiance(depth as usize)) > 0.0, "{transport:?} {depth}");
        }
    }
}

/// Bounces without end have eight groups; those of lamps are not there beside them.
#[test]
fn light_of_all_bounces_is_the_whole_film() {
    for way in WAYS.iter().filter(|way| !way.contains("photons")) {
        let mut world = room(&format!("{way}, light_by_bounce: true"));
        world.settings.max_depth = 30;
        let whole = film(&world, Options::default());
        assert_eq!(whole.light_groups(), 8, "{way}");
        let (worst, rest) = rest_of(&whole);
        assert!(worst < 2e-5 && rest < 2e-5, "{way}: {worst} {rest}");
        world.settings.light_by_bounce = false;
        let plain = film(&world, Options::default());
        assert_eq!(plain.pixels(), whole.pixels(), "{way}: groups change nothing");
    }
    // Light of photons is in the rest: what bounces have is a part of the whole, and not all of it.
    for way in WAYS.iter().filter(|way| way.contains("photons")) {
        let film = film(&room(&format!("{way}, light_by_bounce: true")), Options::default());
        let of_bounces: f64 = (0..film.light_groups()).map(|group| mean(&film.group_radiance(group))).sum();
        let (rest, whole) = (mean(&film.ungrouped_radiance()), mean(&film.radiance()));
        assert!(rest > 1e-4 && (of_bounces + rest - whole).abs() < 1e-4 * whole, "{way}: {rest} of {whole}");
    }
    let here = lamps();
    here.out("scene.ron --light-by-bounce -o scene.film -o scene.exr");
    let listed = here.json("mix scene.film");
    let names = listed["light_groups"].as_array().expect("groups").iter().map(|group| &group["name"]);
    let last: Vec<_> = names.skip(6).collect();
    assert_eq!(last, [&"bounce 6", &"bounce 7 and more", &"(rest)"], "{listed}");
    here.out("mix scene.film --set '\"bounce 1\".radiance *= 0' -o indirect.png");
    assert_eq!(here.json("reproduce indirect.png")["identical"], true);
    let told = here.messages("scene.ron --light-by-bounce --light-groups -o both.exr");
    assert!(told.contains("light_groups does nothing"), "{told}");
    here.write("named.ron", LAMPS.replace("name: \"key\",", "name: \"key\", group: \"warm\","));
    let told = here.messages("named.ron --light-by-bounce -o named.exr");
    assert!(told.contains("the groups of lights do nothing"), "{told}");
}

#[test]
fn light_groups_are_the_same_in_all_ways_to_render() {
    let both = ["light_groups", "light_by_bounce"];
    for (way, kind) in WAYS.iter().flat_map(|way| both.map(|kind| (way, kind))) {
        let world = room(&format!("{way}, {kind}: true"));
        let expected = film(&world, Options::default());
        for (schedule, wave) in
            [(Schedule::Recursive, 64), (Schedule::Wavefront, 50), (Schedule::Wavefront, 1)]
        {
            let options =
                Options { schedule, wave, tile: 16, sorting: Sorting::Unsorted, ..Options::default() };
            assert!(film(&world, options) == expected, "{way}: {schedule:?} {wave}");
        }
    }
}

/// The part of a lamp is what the scene shows with that lamp alone.
#[test]
fn group_of_a_lamp_is_its_own_light() {
    let lamps = [("bulb", 0), ("panel", 1), ("sky", 4), ("lantern", 5), ("coals", 6)];
    let transports = [
        (Transport::Path, Sharing::Off),
        (Transport::Path, Sharing::Groups(16)),
        (Transport::Whitted, Sharing::Off),
    ];
    for (transport, sharing) in transports {
        let rendered = |mut world: World| {
            let settings = &mut world.settings;
            (settings.transport, settings.sharing, settings.samples) = (transport, sharing, 128);
            film(&world, Options::default())
        };
        let film = rendered(room("caustics: Off, light_groups: true"));
        for (name, group) in lamps {
            let mut text = ROOM.replace("SETTINGS", "caustics: Off");
            for (other, emission) in
                [("lantern", "emission: (4, 2, 1)"), ("coals", "emission: (1, 0.2, 0.1)")]
            {
                text = if other == name { text } else { text.replace(emission, "emission: 0") };
            }
            let mut alone = support::world(&text);
            for entity in alone.in_order() {
                if alone.name_of(entity) != name {
                    let _ = alone.entities.remove_one::<Light>(entity);
                }
            }
            let own = mean(&film.group_radiance(group));
            let expected = mean(&rendered(alone).radiance());
            let what = format!("{transport:?} {sharing:?} {name}: {own}, alone {expected}");
            assert!((own / expected - 1.0).abs() < 0.06, "{what}");
        }
    }
}

/// Keys give groups; entities below share them, and what has none is the rest.
#[test]
fn keys_name_groups_of_lights_and_shining_shapes() {
    let world = support::world(
        r#"(settings: (size: (8, 8), samples: 64, transport: Path), entities: [
            (camera: Pinhole(vertical_fov_degrees: 40), transform: (translate: (0, 0, 5))),
            (shape: Sphere(radius_m: 1), material: (diffuse: 0.5)),
            (name: "lamp", group: "warm", transform: (translate: (0, 3, 3))),
            (parent: "lamp", light: Point(power_w: 100), transform: (translate: (0, 1, 0))),
            (parent: "lamp", shape: Sphere(radius_m: 0.1), material: (emission: 3)),
            (light: Point(power_w: 50), transform: (translate: (0, -3, 3)), group: "cold"),
            (light: Point(power_w: 50), transform: (translate: (3, 0, 3))),
        ])"#,
    );
    let film = film(&world, Options::default());
    assert_eq!(film.light_groups(), 2);
    let [warm, cold] = [0, 1].map(|group| mean(&film.group_radiance(group)));
    let (rest, whole) = (mean(&film.ungrouped_radiance()), mean(&film.radiance()));
    assert!(warm > cold && cold > 0.0 && rest > 0.0, "{warm} {cold} {rest}");
    assert!((warm + cold + rest - whole).abs() < 1e-4 * whole, "{warm} + {cold} + {rest} is {whole}");
}

const LAMPS: &str = r#"(
    settings: (size: (32, 24), samples: 16, transport: Path),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 40), transform: (translate: (0, 0, 5))),
        (shape: Sphere(radius_m: 1), material: (diffuse: 0.5)),
        (name: "key", light: Area(power_w: 40, size_m: (1, 1)), transform: LookAt(from: (2, 2, 3), to: (0, 0, 0))),
        (name: "fill light", light: Point(power_w: 20), transform: (translate: (-3, 1, 3))),
    ],
)"#;

fn lamps() -> Folder {
    program::folder(LAMPS)
}

#[test]
fn film_is_mixed_without_rendering() {
    let here = lamps();
    here.out("scene.ron --light-groups -o scene.film -o whole.exr");
    let listed = here.json("mix scene.film");
    assert_eq!(
        (&listed["light_groups"][0]["name"], &listed["light_groups"][1]["name"]),
        (&"key".into(), &"fill light".into())
    );
    // Nothing changed: the same picture.
    here.out("mix scene.film --set '\"key\".power_w *= 1' -o same.exr");
    assert_eq!(here.json("compare same.exr whole.exr")["rmse"], 0.0);
    // A lamp of another power is what a scene with that power shows, up to noise: here light is only chosen anew.
    here.out("mix scene.film --set '\"key\".power_w *= 3' --set '\"fill*\".power_w *= 0' -o mixed.exr -o mixed.png");
    here.out("scene.ron --set '\"key\".light.power_w *= 3' --set '\"fill light\".light.power_w *= 0' -o meant.exr --spp 256");
    let difference = here.json("compare mixed.exr meant.exr");
    assert!(difference["relmse"].as_f64().is_some_and(|error| error < 0.01), "{difference}");
    // The picture says how it was made, and is made again to the bit.
    assert_eq!(here.json("reproduce mixed.png")["identical"], true);
    here.out("mix scene.film --set '\"key\".power_w *= (1, 0.5, 0.2)' --denoise --exposure 1 -o clean.png");
    assert!(here.has("clean.denoised.png"));
    assert_eq!(here.json("reproduce clean.denoised.png")["identical"], true);
    here.fails(2, "mix scene.film --set '\"kea\".power_w *= 2' -o a.png", &["key"]);
    here.fails(2, "mix scene.film --set '\"key\".power_w *= 2'", &["-o"]);
    here.fails(2, "mix scene.film -o other.film", &["holds all of its mixes"]);
    here.out("scene.ron -o plain.film");
    here.fails(1, "mix plain.film", &["--light-groups"]);
}

#[test]
fn parts_with_light_groups_merge_to_the_whole() {
    let here = lamps();
    let whole = here.hash("scene.ron --light-groups -o whole.film");
    for index in 0..3 {
        here.out(&format!("scene.ron --light-groups --shard {index}/3 -o part-{index}.film"));
    }
    assert_eq!(here.json("merge . -o all.film -o all.exr")["film_hash"], whole);
    assert_eq!(here.json("mix all.film"), {
        let mut same = here.json("mix whole.film");
        same["film"] = "all.film".into();
        same
    });
    here.out("scene.ron --shard 0/2 -o other.film");
    here.fails(1, "merge part-0.film other.film -o a.png", &["light_groups"]);
    here.out("resume all.film --spp 20 -o more.exr");
}

/// Lamps that are switched on while the shutter is open: a film has the same groups at all moments.
#[test]
fn groups_stay_the_same_while_the_shutter_is_open() {
    let scene = r#"(
        settings: (size: (24, 18), samples: 8, transport: Path),
        entities: [
            (camera: Pinhole(vertical_fov_degrees: 40), transform: (translate: (0, 0, 5))),
            (shape: Sphere(radius_m: 1), material: (diffuse: 0.5)),
            (name: "bulb", GROUP shape: Sphere(radius_m: 0.3), transform: (translate: (2, 1, 1)),
             material: (emission: Keys([(0, 0), (0.5, 30)], Step))),
        ],
    )"#;
    let here = program::folder(&scene.replace("GROUP", "group: \"bulb\","));
    let line = "scene.ron --fps 1 --shutter 1 --moments 4 --overwrite -o scene.film";
    here.out(&format!("{line} --light-groups"));
    let share = here.json("mix scene.film")["light_groups"][0]["share"].as_f64();
    assert!(share.is_some_and(|share| share > 0.99), "{share:?}");
    here.write("scene.ron", scene.replace("GROUP", ""));
    here.fails(1, &format!("{line} --light-groups"), &["give each that shines a group"]);
}

/// An image file's layers of light add up to the image.
#[test]
fn layers_of_light_groups_add_up_to_the_image() {
    let here = lamps();
    let text = LAMPS.replace("light: Point", "group: \"a.b/c\", light: Point");
    here.write("scene.ron", &text);
    here.out("scene.ron -o image.exr");
    let image =
        exr::prelude::read_first_flat_layer_from_file(here.as_ref().join("image.exr")).expect("an image");
    let channel = |name: &str| -> Vec<f32> {
        let all = &image.layer_data.channel_data.list;
        let found = all.iter().find(|channel| channel.name.to_string() == name);
        let names: Vec<_> = all.iter().map(|channel| channel.name.to_string()).collect();
        found.unwrap_or_else(|| panic!("no {name} among {names:?}")).sample_data.values_as_f32().collect()
    };
    for component in ["R", "G", "B"] {
        let parts =
            [channel(&format!("light_a_b_c.{component}")), channel(&format!("light_rest.{component}"))];
        for (at, whole) in channel(component).into_iter().enumerate() {
            assert!((parts[0][at] + parts[1][at] - whole).abs() < 1e-5 * whole.max(0.1), "{at}: {parts:?}");
        }
        assert!(parts.iter().all(|part| part.iter().any(|value| *value > 0.01)), "{component}");
    }
}
