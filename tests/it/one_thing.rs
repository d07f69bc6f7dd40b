//! One thing written in all formats, in all their encodings, here and far away, is the same surface in albedo,
//! normals, positions, ids and light.

mod files;
mod gltf;
mod packed;
mod scenes;
mod solid;
mod textures;

use std::collections::{BTreeSet, HashMap, HashSet};

use rayfront::formats::{LoadOptions, load_with};
use rayfront::internals::film::Features;
use rayfront::math::{DVec3, Rgb};
use rayfront::render::Options;
use rayfront::world::World;

use crate::program::{Folder, Place, empty_folder};
use crate::support::session;
use files::{Number, Paint, obj, ply, stl};
use gltf::{Encoding, gltf};
use solid::Solid;

fn srgb_decode(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// A scene around a place, each part of which can be another.
#[derive(Clone)]
struct Stage {
    size: [u32; 2],
    transport: &'static str,
    /// The material `paint`.
    paint: String,
    camera: String,
    /// The entities with lights.
    lights: String,
    time_s: Option<f32>,
    options: LoadOptions,
}

impl Stage {
    fn at(center: DVec3) -> Stage {
        let place = |offset: [f64; 3]| at(center, offset);
        Stage {
            size: [24, 24],
            transport: "Path",
            paint: "(diffuse: 1)".to_owned(),
            camera: format!(
                "(camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: {}, to: {})),",
                place([1.6, 1.5, 2.4]),
                place([0.0; 3])
            ),
            lights: format!(
                "(light: Point(power_w: 300), transform: (translate: {})),
                 (light: Directional(irradiance: 1.5), transform: LookAt(from: {}, to: {})),",
                place([-1.0, 1.7, 1.3]),
                place([3.0, 2.0, 0.5]),
                place([0.0; 3])
            ),
            time_s: None,
            options: LoadOptions::default(),
        }
    }

    /// Renders entities.
    fn render(&self, folder: &Folder, entities: &str) -> Seen {
        let Stage { size: [width, height], transport, paint, camera, lights, .. } = self;
        let text = format!(
            r#"(
    settings: (size: ({width}, {height}), samples: 16, transport: {transport}, filter: Box, sharing: Off),
    materials: {{ "white": (diffuse: 1), "paint": {paint} }},
    entities: [ {camera} {entities} {lights} ],
)"#
        );
        folder.write("scene.ron", &text);
        let options = LoadOptions { time_s: self.time_s, ..self.options.clone() };
        let world =
            load_with(folder.join("scene.ron"), &options).unwrap_or_else(|error| panic!("{error}: {text}"));
        Seen::of(&world)
    }
}

/// A place beside another, as scenes write it.
fn at(center: DVec3, offset: [f64; 3]) -> String {
    let [x, y, z] = (center + DVec3::from(offset)).to_array();
    format!("({x}, {y}, {z})")
}

/// The first hits and the light of an image.
struct Seen {
    features: Vec<Features>,
    light: Vec<Rgb>,
}

impl Seen {
    fn of(world: &World) -> Seen {
        let session = session(world, Options::default());
        Seen { features: session.features(), light: session.film().radiance() }
    }

    /// Returns the largest difference, relative to the value or 1, if too many are too large.
    fn differs(&self, other: &Seen, Tolerance { step, pixels }: Tolerance) -> Option<String> {
        let mut worst: Option<(f32, String)> = None;
        let mut apart_at = BTreeSet::new();
        let mut note = |what: &str, pixel: usize, a: &[f32], b: &[f32]| {
            let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs() / b.abs().max(1.0)).fold(0.0, f32::max);
            if apart > step {
                apart_at.insert(pixel);
                if worst.as_ref().is_none_or(|(most, _)| apart > *most) {
                    worst = Some((apart, format!("{what} of pixel {pixel}: {a:?} and {b:?}")));
                }
            }
        };
        // Numbers of entities and materials depend on what else a file has.
        let mut ids = [HashMap::new(), HashMap::new()];
        for (pixel, (a, b)) in self.features.iter().zip(&other.features).enumerate() {
            note("coverage", pixel, &[a.coverage], &[b.coverage]);
            if a.coverage == 1.0 && b.coverage == 1.0 {
                note("depth", pixel, &[a.depth_m], &[b.depth_m]);
                note("normal", pixel, &a.normal, &b.normal);
                note("albedo", pixel, &a.albedo.to_array(), &b.albedo.to_array());
                for (ids, [a, b]) in ids.iter_mut().zip([[a.entity, b.entity], [a.material, b.material]]) {
                    let first = *ids.entry(a).or_insert(b);
                    note("id", pixel, &[first as f32], &[b as f32]);
                }
            }
        }
        let [entities, materials] = ids;
        for ids in [entities, materials] {
            let kinds = ids.values().collect::<HashSet<_>>().len();
            note("ids", 0, &[ids.len() as f32], &[kinds as f32]);
        }
        for (pixel, (a, b)) in self.light.iter().zip(&other.light).enumerate() {
            note("light", pixel, &a.to_array(), &b.to_array());
        }
        let count = apart_at.len();
        worst.filter(|_| count > pixels).map(|(_, text)| format!("{count} pixels, {text}"))
    }

    fn albedo(&self) -> [f64; 3] {
        let on = self.features.iter().filter(|features| features.coverage == 1.0);
        let count = on.clone().count() as f64;
        [0, 1, 2]
            .map(|channel| on.clone().map(|f| f64::from(f.albedo.to_array()[channel])).sum::<f64>() / count)
    }
}

/// Images that must be equal, compared with the first.
#[derive(Default)]
struct Comparison {
    first: Option<(String, Seen)>,
    faults: Vec<String>,
}

impl Comparison {
    fn add(&mut self, name: String, seen: Seen, tolerance: Tolerance) {
        let Some((other, same)) = &self.first else {
            assert!(seen.features.iter().any(|features| features.coverage == 1.0), "{name} shows nothing");
            assert!(seen.light.iter().any(|light| light.luminance() > 0.05), "{name} is dark");
            self.first = Some((name, seen));
            return;
        };
        let fault = seen.differs(same, tolerance);
        self.faults.extend(fault.map(|fault| format!("{name} and {other}: {fault}")));
    }

    /// Returns the first image.
    #[track_caller]
    fn finish(self) -> Seen {
        assert!(self.faults.is_empty(), "{}", self.faults.join("\n"));
        self.first.expect("images").1
    }
}

/// Where things stand: here, and so far away that single precision has steps of a metre.
const PLACES: [DVec3; 2] = [DVec3::ZERO, DVec3::new(450_123.37, 10_000_000.3, -5_412_345.71)];

/// What may differ between two images.
#[derive(Clone, Copy)]
struct Tolerance {
    /// The largest difference of a pixel.
    step: f32,
    /// How many pixels may differ more: where samples meet edges.
    pixels: usize,
}

/// For formats that hold a thing exactly.
const EXACT: Tolerance = Tolerance { step: 2e-4, pixels: 0 };

/// For formats whose rounding may also move edges.
const fn rounded(step: f32) -> Tolerance {
    Tolerance { step, pixels: 6 }
}

/// A file with its contents, the entity that shows it, and what may differ.
struct Written {
    name: String,
    bytes: Vec<u8>,
    entity: String,
    tolerance: Tolerance,
}

/// A solid in all formats that can hold it.
fn written(solid: &Solid, paint: Paint) -> Vec<Written> {
    let is_far = solid.center != DVec3::ZERO;
    let bare = Solid { has_normals: false, ..solid.clone() };
    let white = if paint == Paint::None { ", material: \"white\"" } else { "" };
    let mut files = Vec::new();
    let mut add = |name: String, bytes: Vec<u8>, tolerance: Tolerance| {
        let is_gltf = name.ends_with("gltf") || name.ends_with("glb");
        let entity = if is_gltf {
            format!("(gltf: \"{name}\"),")
        } else {
            format!("(shape: Mesh(\"{name}\"){white}),")
        };
        files.push(Written { name, bytes, entity, tolerance });
    };
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (positions, colors) in
            [(Number::Double, Number::Byte), (Number::Double, Number::Float), (Number::Float, Number::Float)]
        {
            let is_coarse = matches!(positions, Number::Float) && encoding != "ascii";
            if !(is_coarse && is_far) {
                let name = format!("{encoding}_{}_{}.ply", positions.name(), colors.name());
                add(name, ply(solid, encoding, positions, colors, paint), EXACT);
            }
        }
    }
    add("block.obj".to_owned(), obj(solid, paint), EXACT);
    add("bare.obj".to_owned(), obj(&bare, paint), EXACT);
    for encoding in Encoding::ALL {
        add(encoding.file_name(), gltf(solid, encoding, paint), encoding.tolerance());
    }
    if !solid.is_smooth {
        add("bare.ply".to_owned(), ply(&bare, "ascii", Number::Double, Number::Byte, paint), EXACT);
        add("bare.gltf".to_owned(), gltf(&bare, Encoding::Embedded, paint), EXACT);
        if paint == Paint::None {
            add("block.stl".to_owned(), stl(solid, false), EXACT);
            if !is_far {
                add("binary.stl".to_owned(), stl(solid, true), EXACT);
            }
        }
    }
    files
}

#[track_caller]
fn check(solid: impl Fn(DVec3) -> Solid, paint: Paint) -> Seen {
    let folder = &empty_folder();
    squares().save(folder.join("paint.png")).expect("a picture");
    folder.write("block.mtl", "newmtl paint\nKd 1 1 1\nKs 0 0 0\nmap_Kd paint.png\n");
    let mut comparison = Comparison::default();
    for center in PLACES {
        for Written { name, bytes, entity, tolerance } in written(&solid(center), paint) {
            folder.write(&name, bytes);
            comparison.add(
                format!("{name} at {center}"),
                Stage::at(center).render(folder, &entity),
                tolerance,
            );
        }
    }
    comparison.finish()
}

#[test]
fn one_box_looks_the_same_in_all_formats() {
    let seen = check(Solid::block, Paint::None);
    assert_eq!(seen.albedo(), [1.0; 3]);
}

/// Colours of vertices are on the sRGB curve in PLY and OBJ files, and linear in glTF; nothing else darkens them.
#[test]
fn colors_of_vertices_look_the_same_in_all_formats() {
    let seen = check(Solid::block, Paint::Vertices);
    let green = srgb_decode(128.0 / 255.0);
    assert!((seen.albedo()[1] - green).abs() < 1e-4, "{:?}", seen.albedo());
}

/// Four by four squares of distinct colours.
fn squares() -> image::RgbImage {
    let color = |x: u32, y: u32| {
        [40 + 13 * (x / 8 + 4 * (y / 8)) as u8, 255 - 40 * (x / 8) as u8, 90 + 30 * (y / 8) as u8]
    };
    image::RgbImage::from_fn(32, 32, |x, y| image::Rgb(color(x, y)))
}

#[test]
fn textures_look_the_same_in_all_formats() {
    check(Solid::block, Paint::Picture("paint.png"));
}

/// Normals are written out, or follow from a smoothing group.
#[test]
fn one_ball_looks_the_same_in_all_formats() {
    check(Solid::ball, Paint::None);
}

#[test]
fn one_ball_of_flat_faces_looks_the_same_in_all_formats() {
    check(Solid::faceted_ball, Paint::None);
}
