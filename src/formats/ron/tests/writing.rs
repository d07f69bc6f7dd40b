//! Tests that saved scenes read back as the same world.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use proptest::prelude::*;

use super::shapes::parametric_shape;
use super::{EVERYTHING, Fake, grey, only, read};
use crate::formats::ron::{load, parse, save, write};
use crate::math::{DAffine3, DVec3, Quat, Rgb, Vec2, Vec3};
use crate::world::assets::{ColorSpace, Wrap};
use crate::world::fields::{Forms, Range, Slot};
use crate::world::*;

const SCENE: &str = "scenes/test.ron";

fn there_and_back(world: &World) -> World {
    let text = write(world, Path::new(SCENE)).unwrap();
    read(&text).unwrap_or_else(|error| panic!("{error} in\n{text}"))
}

/// An entity's components as text, with ids replaced by names and values. `Debug` tells 0 from −0.
fn portrait(world: &World, entity: hecs::Entity) -> String {
    let entities = &world.entities;
    let parent = entities.get::<&Parent>(entity).ok().map(|parent| world.name_of(parent.0));
    let material = entities.get::<&MaterialId>(entity).ok().map(|id| {
        let named = &world.assets.materials[id.0 as usize];
        let inputs = match &named.material {
            Material::BlinnPhong(BlinnPhong { diffuse, specular, kr, emission, .. }) => {
                [*diffuse, *specular, *kr, *emission]
            }
            // Textures for numbers are compared only by id.
            Material::Principled(material) => {
                let Principled { base_color, specular_color, sheen_color, emission, .. } = **material;
                [base_color, specular_color, sheen_color, emission]
            }
        };
        let textures: Vec<_> = inputs
            .into_iter()
            .filter_map(|input| match input {
                ColorInput::Texture(id) => Some(world.assets.textures[id.0 as usize]),
                ColorInput::Constant(_) => None,
            })
            .collect();
        format!("{named:?} {textures:?}")
    });
    format!(
        "{:?} {parent:?} {:?} {:?} {material:?} {:?} {:?} {} {:?} {:?} {:?}",
        entities.get::<&Name>(entity).ok().map(|name| name.0.clone()),
        entities.get::<&Transform>(entity).ok().map(|transform| *transform),
        entities.get::<&Shape>(entity).ok().map(|shape| (*shape).clone()),
        entities.get::<&Light>(entity).ok().map(|light| (*light).clone()),
        entities.get::<&Camera>(entity).ok().map(|camera| *camera),
        entities.satisfies::<&WithoutCaustics>(entity),
        entities.get::<&LightGroup>(entity).ok().map(|group| (*group).clone()),
        entities.get::<&Stereo>(entity).ok().map(|stereo| *stereo),
        entities.get::<&FocusOn>(entity).ok().map(|focused| world.name_of(focused.0)),
    )
}

pub(super) fn assert_same(before: &World, after: &World) {
    assert_eq!(format!("{:?}", before.settings), format!("{:?}", after.settings));
    let (orders, others) = (before.in_order(), after.in_order());
    assert_eq!(orders.len(), others.len());
    for (one, other) in orders.into_iter().zip(others) {
        assert_eq!(portrait(before, one), portrait(after, other));
    }
}

#[test]
fn scene_with_every_feature_survives_saving() {
    let world = read(EVERYTHING).unwrap();
    let again = there_and_back(&world);
    assert_same(&world, &again);
    assert_eq!(world.assets.materials, again.assets.materials);
    assert_eq!(world.assets.textures, again.assets.textures);
    let path = Path::new(SCENE);
    assert_eq!(write(&world, path).unwrap(), write(&again, path).unwrap());
}

#[test]
fn written_text_is_compact_and_omits_defaults() {
    let text = write(&read(EVERYTHING).unwrap(), Path::new(SCENE)).unwrap();
    for line in [
        "    settings: (size: (320, 200), samples: 4, max_depth: 3, diffuse_depth: 2, glossy_depth: 5, \
         min_throughput: 0.01, roulette_depth: None, \
         clamp: 20, filter_glossy: 0.5, transport: Whitted, sampler: Independent, sharing: 16, caustics: (photons: 2.5, radius: 1.4), adaptive: On, seed: 7, \
         filter: Gaussian(radius: 2), pixel_pattern: Regular, \
         background: Gradient(bottom: 0.25, top: (0.1, 0.2, 1)), backdrop: 0.75, backplate: Gradient(bottom: 1, top: (0, 0.5, 1)), transparent: true, ambient: 0.01, tonemap: Aces, exposure_ev: -1.5, \
         exposure: Auto, copied_triangles: 1000, light_groups: true, light_by_bounce: true, aov: [Normal, Depth]),",
        "        \"glass\": BlinnPhong(specular: 0.2, shininess: 200, ior: 1.5),",
        "        \"floor\": BlinnPhong(diffuse: Image(\"../assets/checker.png\"), highlight: Phong, kr: 0.2),",
        "        (name: \"child\", parent: \"ball\", shape: Sphere(radius_m: 0.25), material: \"glass\"),",
        "        (name: \"kn\\\"o\\\"t\", shape: Mesh(\"../assets/knot.ply\"), material: (diffuse: (0.8, 0.3, 0.2))),",
        "        (shape: Mesh(\"../assets/knot.ply\"), transform: Matrix(((1, 0, 0, 1), (0, 2, 0, 0), (0, 0, 3, 0)))),",
        "        (light: Spot(power_w: 100, inner_degrees: 20, outer_degrees: 40, radius_m: 0)),",
        "        (camera: Pinhole(vertical_fov_degrees: 60.5)),",
    ] {
        let transform_first = line.replacen("(shape: Mesh(\"../assets/knot.ply\"), transform: Matrix(((1, 0, 0, 1), (0, 2, 0, 0), (0, 0, 3, 0))))",
            "(transform: Matrix(((1, 0, 0, 1), (0, 2, 0, 0), (0, 0, 3, 0))), shape: Mesh(\"../assets/knot.ply\"))", 1);
        assert!(text.lines().any(|l| l == transform_first), "{transform_first}\nis not in\n{text}");
    }
    assert_eq!(write(&World::default(), Path::new("a.ron")).unwrap(), "(\n    entities: [\n    ],\n)\n");
}

#[test]
fn paths_are_relative_to_where_the_scene_is_saved() {
    let world = read("(entities: [(shape: Mesh(\"../assets/knot.ply\"))])").unwrap();
    let written = |path: &str| write(&world, Path::new(path)).unwrap();
    assert!(written("a.ron").contains("Mesh(\"assets/knot.ply\")"), "{}", written("a.ron"));
    assert!(written("assets/a.ron").contains("Mesh(\"knot.ply\")"));
    assert!(written("out/deep/a.ron").contains("Mesh(\"../../assets/knot.ply\")"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("saved.ron");
    save(&world, &path).unwrap();
    let again = load(&path, &mut Fake::default()).unwrap();
    let found = again.assets.meshes[0].source.clone().unwrap();
    assert!(found.starts_with(folder.path()) && found.ends_with("assets/knot.ply"), "{}", found.display());
    assert!(save(&world, &folder.path().join("no/such/folder.ron")).is_err());
}

#[test]
fn worlds_that_a_file_cannot_express_are_refused() {
    let reason = |world: &World| write(world, Path::new(SCENE)).unwrap_err().reason;
    let mut world = read("(entities: [(name: \"knot\", shape: Mesh(\"a.ply\"))])").unwrap();
    let of = |world: &mut World, number: usize, source: Option<PathBuf>| {
        Arc::make_mut(&mut world.assets.meshes[number]).source = source;
    };
    of(&mut world, 0, Some("a.glb".into()));
    assert!(reason(&world).starts_with("knot: mesh number 0 is inside a.glb"));
    of(&mut world, 0, None);
    assert!(reason(&world).contains("has no file to refer to"));
    let mut world = read("(entities: [(shape: Mesh(\"a.obj\")), (shape: Mesh(\"b.obj\"))])").unwrap();
    let first = world.assets.meshes[0].source.clone();
    of(&mut world, 1, first);
    assert!(reason(&world).contains("one of several"));
    let mut world = World::default();
    world.entities.spawn((Camera::Orthographic { height_m: f32::NAN },));
    assert!(reason(&world).contains("finite"));
    let mut world = World::default();
    world.entities.spawn((Name("a".into()),));
    world.entities.spawn((Name("a".into()),));
    assert!(reason(&world).contains("two entities are called \"a\""));
    let mut world = World::default();
    let lost = world.entities.spawn(());
    world.entities.despawn(lost).unwrap();
    world.entities.spawn((Parent(lost),));
    assert!(reason(&world).contains("parent does not exist"));
    let mut world = World::default();
    world.entities.spawn((MaterialId(9),));
    assert!(reason(&world).contains("no material of number 9"));
}

#[test]
fn missing_names_are_made_up_where_a_file_needs_them() {
    let mut world = World::default();
    let parent = world.entities.spawn((Transform::IDENTITY,));
    world.entities.spawn((Transform::IDENTITY, Parent(parent)));
    world.entities.spawn((Transform::IDENTITY, Name("entity 0".into())));
    let again = there_and_back(&world);
    assert_eq!(again.name_of(again.in_order()[0]), "entity 0 (2)");
    assert_eq!(only::<Parent>(&again).0, again.in_order()[0]);

    let shiny = |shininess| Material::BlinnPhong(BlinnPhong { shininess, ..Default::default() });
    let mut world = World::default();
    let shared = world.assets.add_material(None, shiny(1.0));
    let twins = [2.0, 3.0].map(|s| world.assets.add_material(Some("twin".into()), shiny(s)));
    let of_mesh = world.assets.add_material(Some("of mesh".into()), shiny(4.0));
    world.assets.add_mesh(Mesh { triangle_materials: vec![of_mesh], ..Mesh::default() });
    for id in [shared, shared, twins[0], twins[1], MaterialId::DEFAULT, MaterialId::DEFAULT] {
        world.entities.spawn((Transform::IDENTITY, id));
    }
    let again = there_and_back(&world);
    let names: Vec<_> = again.assets.materials.iter().map(|material| material.name.clone()).collect();
    let expected = [None, Some("material 1"), Some("twin"), Some("twin (2)")];
    assert_eq!(names, expected.map(|name| name.map(str::to_owned)));
    let ids: Vec<_> =
        again.in_order().iter().map(|e| *again.entities.get::<&MaterialId>(*e).unwrap()).collect();
    assert_eq!(ids, [1, 1, 2, 3, 0, 0].map(MaterialId));
}

#[test]
fn entity_with_only_an_identity_transform_survives_saving() {
    let mut world = World::default();
    world.entities.spawn((Transform::IDENTITY,));
    assert_same(&world, &there_and_back(&world));
}

/// Finite floats of all magnitudes, including those that print in unusual ways.
fn float() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -1000.0_f32..1000.0,
        2 => any::<f32>().prop_filter("finite", |value| value.is_finite()),
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, f32::MAX, f32::MIN_POSITIVE, 1e-45, 0.1, 16777216.0]),
    ]
}

pub(super) fn positive() -> impl Strategy<Value = f32> {
    float().prop_map(f32::abs).prop_filter("above 0", |value| *value > 0.0)
}

fn color() -> impl Strategy<Value = Rgb> {
    prop_oneof![
        float().prop_map(|v| grey(v.abs())),
        [float(), float(), float()].prop_map(|c| Rgb::from(c.map(f32::abs)))
    ]
}

fn vector() -> impl Strategy<Value = Vec3> {
    [float(), float(), float()].prop_map(Vec3::from)
}

fn pattern() -> impl Strategy<Value = Pattern> {
    prop::sample::select(vec![Pattern::Uniform, Pattern::Jittered, Pattern::Regular])
}

fn falloff() -> impl Strategy<Value = Falloff> {
    prop::sample::select(vec![Falloff::InverseSquare, Falloff::Constant])
}

fn transform() -> impl Strategy<Value = Transform> {
    let rotation = [-1.0_f32..1.0, -1.0..1.0, -1.0..1.0, -1.0..1.0]
        .prop_filter("a direction", |q| q.iter().map(|c| c * c).sum::<f32>() > 0.01)
        .prop_map(|[x, y, z, w]| Quat::from_xyzw(x, y, z, w).normalize());
    let factor = || prop_oneof![0.001_f32..1000.0, -1000.0_f32..-0.001];
    let scale =
        prop_oneof![factor().prop_map(Vec3::splat), [factor(), factor(), factor()].prop_map(Vec3::from)];
    // Single precision, as of other files, or double.
    let translation = prop_oneof![
        vector().prop_map(Vec3::as_dvec3),
        [-1e7_f64..1e7, -1.0..1.0, -1e-7..1e-7].prop_map(DVec3::from)
    ];
    let trs = (translation, rotation, scale).prop_map(|(translation, rotation, scale)| Transform::Trs {
        translation,
        rotation,
        scale,
    });
    let trs = trs.boxed();
    let matrix = (trs.clone(), -0.5_f32..0.5).prop_map(|(transform, shear)| {
        let Transform::Trs { translation, rotation, scale } = transform else { return transform };
        let (scale, rotation) = (scale.signum().as_dvec3(), rotation.as_dquat());
        let mut matrix = DAffine3::from_scale_rotation_translation(scale, rotation, translation);
        matrix.matrix3.y_axis += matrix.matrix3.x_axis * f64::from(shear);
        Transform::Matrix(matrix)
    });
    prop_oneof![Just(Transform::IDENTITY), trs, matrix]
}

fn shape() -> impl Strategy<Value = Shape> {
    let corner = || [-9.0_f64..9.0, -9.0..9.0].prop_map(|[x, y]| DVec3::new(x, y, 0.0));
    let plane = (-9.0_f64..9.0, 0.1_f64..9.0, 0.1_f64..9.0).prop_map(|(x, width, height)| Shape::Plane {
        corners: [
            DVec3::new(x, 0.0, 0.0),
            DVec3::new(x + width, 0.0, 0.0),
            DVec3::new(x + width, height, 0.0),
            DVec3::new(x, height, 0.0),
        ],
    });
    let triangle = (
        [corner(), corner(), corner()],
        prop::option::of([vector(), vector(), vector()]),
        prop::option::of([[float(), float()], [float(), float()], [float(), float()]]),
    )
        .prop_filter("an area", |([a, b, c], ..)| (b - a).cross(c - a).length() > 0.01)
        .prop_map(|(vertices, normals, uvs)| Shape::Triangle {
            vertices,
            normals,
            uvs: uvs.map(|uvs| uvs.map(Vec2::from)),
        });
    let sphere = positive().prop_map(|radius_m| Shape::Sphere { radius_m });
    prop_oneof![sphere, plane, triangle, parametric_shape()]
}

fn light() -> impl Strategy<Value = Light> {
    let right_angle = std::f32::consts::FRAC_PI_2;
    prop_oneof![
        (color(), falloff(), positive()).prop_map(|(power_w, falloff, radius_m)| Light::Point {
            power_w,
            falloff,
            radius_m
        }),
        (color(), [0.0..=right_angle, 0.0..=right_angle], any::<bool>(), falloff(), positive()).prop_map(
            |(power_w, [a, b], smooth, falloff, radius_m)| Light::Spot {
                power_w,
                inner_angle: a.min(b),
                outer_angle: a.max(b),
                edge: if smooth { ConeEdge::Smoothstep } else { ConeEdge::Squared },
                falloff,
                radius_m,
            }
        ),
        (color(), 0.0..=std::f32::consts::PI)
            .prop_map(|(irradiance, angle)| Light::Directional { irradiance, angle }),
        color().prop_map(|radiance| Light::Environment { radiance, image: None }),
        (
            [color(), color()],
            [positive(), positive()],
            1..=1_u32 << 22,
            pattern(),
            [any::<bool>(), any::<bool>()]
        )
            .prop_map(|([power_w, radiance], size, samples, pattern, [visible, disc])| Light::Area {
                power_w,
                radiance,
                size_m: Vec2::from(size),
                outline: if disc { Outline::Disc } else { Outline::Rectangle },
                samples,
                pattern,
                visible
            }),
    ]
}

fn camera() -> impl Strategy<Value = Camera> {
    let fov = || prop_oneof![1e-30_f32..3.1415925, 1e-3_f32..3.0, Just((45.0_f64.to_radians()) as f32)];
    prop_oneof![
        fov().prop_map(|vertical_fov| Camera::Pinhole { vertical_fov }),
        (fov(), float(), positive(), pattern()).prop_map(
            |(vertical_fov, radius, focus_distance_m, pattern)| {
                Camera::ThinLens {
                    vertical_fov,
                    lens_radius_m: radius.abs(),
                    focus_distance_m,
                    aperture: None,
                    pattern,
                }
            }
        ),
        positive().prop_map(|height_m| Camera::Orthographic { height_m }),
    ]
}

fn material() -> impl Strategy<Value = BlinnPhong> {
    let input = || color().prop_map(ColorInput::Constant);
    let highlight = prop::sample::select(vec![Highlight::Blinn, Highlight::Phong]);
    let numbers = (positive(), prop::option::of(positive()), -1000..=1000, prop::bool::ANY);
    let modes = vec![AlphaMode::Opaque, AlphaMode::Blend, AlphaMode::Mask { cutoff: 0.25 }];
    let alpha = (0.0f32..=1.0, prop::sample::select(modes));
    (input(), input(), numbers, highlight, input(), color(), (input(), alpha)).prop_map(
        |(diffuse, specular, (shininess, ior, priority, caustics), highlight, kr, kt, (emission, alpha))| {
            BlinnPhong {
                diffuse,
                specular,
                shininess,
                highlight,
                kr,
                kt,
                ior,
                priority,
                emission,
                caustics,
                alpha: ScalarInput::constant(alpha.0),
                alpha_mode: alpha.1,
            }
        },
    )
}

fn settings() -> impl Strategy<Value = Settings> {
    let filter = prop_oneof![
        Just(PixelFilter::Box),
        positive().prop_map(|radius| PixelFilter::Tent { radius }),
        positive().prop_map(|radius| PixelFilter::Gaussian { radius }),
        positive().prop_map(|radius| PixelFilter::BlackmanHarris { radius }),
    ];
    let background = prop_oneof![
        color().prop_map(Background::Constant),
        (color(), color()).prop_map(|(bottom, top)| Background::Gradient { bottom, top }),
    ];
    let shown = || prop_oneof![Just(Rgb::WHITE), [0.0..=1.0_f32, 0.0..=1.0, 0.0..=1.0].prop_map(Rgb::from)];
    let backplate = prop_oneof![
        shown().prop_map(Backplate::Constant),
        (shown(), shown()).prop_map(|(bottom, top)| Backplate::Gradient { bottom, top }),
    ];
    let tonemap = prop::sample::select(vec![
        Tonemap::Clamp,
        Tonemap::ScaleByMaximum,
        Tonemap::Reinhard,
        Tonemap::Aces,
        Tonemap::Agx,
        Tonemap::PbrNeutral,
    ]);
    let numbers = ([1..=65536_u32, 1..=65536_u32], 1..=1_u32 << 22, 0..=65535_u32, any::<u64>());
    let samplers = vec![Sampler::Sobol, Sampler::Jittered, Sampler::Independent];
    let transports = vec![Transport::Whitted, Transport::Path];
    let aov = prop::sample::subsequence(Aov::ALL.to_vec(), 0..=Aov::ALL.len());
    let sharing = [Sharing::Auto, Sharing::Off].into_iter().chain(Sharing::SIZES.map(Sharing::Groups));
    let sharing = prop::sample::select(sharing.collect::<Vec<_>>());
    let (sampler, transport) = (prop::sample::select(samplers), prop::sample::select(transports));
    let choices = (tonemap, sampler, sharing, transport, aov);
    let depth = || prop::option::of(0..=DepthLimits::MOST);
    let depths = (depth(), depth(), depth());
    let limits = (positive(), prop::option::of(0..=65535_u32), prop::option::of(positive()), depths);
    let exposure = (-64.0..=64.0_f32, any::<bool>());
    let copied = 0..=Settings::MOST_COPIED_TRIANGLES;
    (numbers, limits, filter, pattern(), background, (color(), backplate), choices, (exposure, copied))
        .prop_map(
            |(
                numbers,
                limits,
                filter,
                pixel_pattern,
                background,
                (ambient, backplate),
                choices,
                ((exposure_ev, auto_exposure), copied_triangles),
            )| {
                let (tonemap, sampler, sharing, transport, aov) = choices;
                let (size, samples, max_depth, seed) = numbers;
                let (min_throughput, roulette_depth, clamp, (diffuse, glossy, transmission)) = limits;
                Settings {
                    size,
                    samples,
                    max_depth,
                    depth_limits: DepthLimits { diffuse, glossy, transmission },
                    min_throughput,
                    transport,
                    seed,
                    filter,
                    pixel_pattern,
                    background,
                    backdrop: auto_exposure.then_some(background),
                    backplate: auto_exposure.then_some(backplate),
                    transparent: auto_exposure,
                    ambient,
                    tonemap,
                    exposure_ev,
                    auto_exposure,
                    copied_triangles,
                    light_groups: auto_exposure,
                    light_by_bounce: !auto_exposure,
                    roulette_depth,
                    clamp,
                    filter_glossy: exposure_ev.abs() / 64.0,
                    sampler,
                    sharing,
                    caustics: [
                        Caustics::Auto,
                        Caustics::Off,
                        Caustics::Photons { photons: 0.25, radius: 2.5 },
                    ][(seed / 3) as usize % 3],
                    adaptive: [Adaptive::Off, Adaptive::On, Adaptive::Unbiased][seed as usize % 3],
                    aov,
                }
            },
        )
}

type Parts = (Transform, Option<Shape>, Option<(Option<bool>, BlinnPhong)>, Option<Light>, Option<Camera>);

/// The settings and entities of a world; [`build`] makes every odd entity a child of the previous one.
fn world() -> impl Strategy<Value = (Settings, Vec<(String, Parts)>)> {
    let material = (prop::option::of(any::<bool>()), material());
    let parts = (
        transform(),
        prop::option::of(shape()),
        prop::option::of(material),
        prop::option::of(light()),
        prop::option::of(camera()),
    );
    (settings(), prop::collection::vec((any::<String>(), parts), 0..8))
}

fn build(settings: Settings, entities: Vec<(String, Parts)>) -> World {
    let mut world = World { settings, ..World::default() };
    let mut last = None;
    for (index, (name, (transform, shape, material, light, camera))) in entities.into_iter().enumerate() {
        let entity = world.entities.spawn((transform, Name(format!("{name}{index}"))));
        if let Some(shape) = shape {
            world.entities.insert_one(entity, shape).unwrap();
        }
        if let Some((named, material)) = material {
            let name = named.map(|_| format!("{name}{index}"));
            let id = world.assets.add_material(name, Material::BlinnPhong(material));
            world.entities.insert_one(entity, id).unwrap();
        }
        if let Some(light) = light {
            world.entities.insert_one(entity, light).unwrap();
        }
        if let Some(camera) = camera {
            world.entities.insert_one(entity, camera).unwrap();
        }
        if let Some(parent) = last.filter(|_| index % 2 == 1) {
            world.entities.insert_one(entity, Parent(parent)).unwrap();
        }
        last = Some(entity);
    }
    world
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_world_survives_saving((settings, entities) in world()) {
        let world = build(settings, entities);
        assert_same(&world, &there_and_back(&world));
    }

    #[test]
    fn any_texture_survives_saving(
        numbers in [float(), float(), float(), float()], factor in color(), nearest in any::<bool>(), wraps in 0..9_usize,
        turn in (float(), 0..2_u32),
    ) {
        use crate::world::assets::TextureFilter;
        let mut world = read("(entities: [(material: (kd: Image(\"ä b/c.png\")))])").unwrap();
        let [u, v, x, y] = numbers;
        let wrap = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];
        world.assets.textures[0] = Texture {
            source: TextureSource::Image(ImageId(0)),
            filter: if nearest { TextureFilter::Nearest } else { TextureFilter::Trilinear },
            wrap: [wrap[wraps / 3], wrap[wraps % 3]],
            scale: Vec2::new(u, v),
            offset: Vec2::new(x, y),
            color_space: if nearest { ColorSpace::Srgb } else { ColorSpace::Linear },
            factor,
            rotation: turn.0 % 7.0,
            uv_set: turn.1,
        };
        assert_same(&world, &there_and_back(&world));
    }
}

/// Procedures of all kinds that use textures with numbers below `textures`.
fn procedure(textures: u32) -> impl Strategy<Value = Procedure> {
    let input = move || {
        prop_oneof![
            color().prop_map(ColorInput::Constant),
            (0..textures).prop_map(|id| ColorInput::Texture(TextureId(id))),
        ]
    };
    let stops = || {
        prop::collection::vec((0.0f32..=1.0, color()), 1..5).prop_map(|mut stops| {
            stops.sort_by(|a, b| a.0.total_cmp(&b.0));
            stops
        })
    };
    let pattern = (
        (0..TexturePattern::FORMS.len(), 0..3usize, 1..17u32, 0.0f32..=1.0),
        [vector(), vector(), vector()],
        (input(), input(), prop_oneof![Just(Vec::new()), stops().boxed()]),
    )
        .prop_map(|((form, kind, count, unit), [scale, rotate_degrees, offset], (a, b, stops))| {
            let mut pattern = TexturePattern::Checker;
            pattern.set_form(form);
            for field in pattern.fields() {
                match field.slot {
                    Slot::Number(to, Range::FromTo(1.0, _)) => *to = 1.0 + unit,
                    Slot::Number(to, _) => *to = unit.max(0.1),
                    Slot::Whole(to, ..) => *to = count,
                    Slot::Form(to) => to.set_form(kind),
                    _ => {}
                }
            }
            let space = [TextureSpace::Uv, TextureSpace::Uv1, TextureSpace::Object][kind];
            let wrap = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror][count as usize % 3];
            let placement = PatternPlacement { space, scale, rotate_degrees, offset, a, b, stops, wrap };
            Procedure::Pattern(Box::new(PatternTexture { pattern, placement }))
        });
    let by = (0.0f32..=1.0, 0..textures).prop_map(|(factor, id)| ScalarInput {
        factor: if id == 0 { factor } else { 1.0 },
        texture: (id > 0).then_some((TextureId(id), Channel::Red)),
    });
    let combination = (0..6, input(), input(), by, stops()).prop_map(|(form, a, b, by, stops)| {
        Procedure::Combination(match form {
            0 => Combination::Mix { a, b, by },
            1 => Combination::Curve { of: a, stops },
            2 => Combination::Subtract { a, b },
            5 => Combination::Vertex { channel: [VertexChannel::All, VertexChannel::Alpha][stops.len() % 2] },
            3 => Combination::Multiply { a, b },
            _ => Combination::Max { a, b },
        })
    });
    prop_oneof![pattern, combination]
}

proptest! {
    #[test]
    fn any_procedural_texture_survives_saving(inner in procedure(1), outer in procedure(2), as_number in any::<bool>()) {
        let mut world = read("(entities: [(material: (kd: Image(\"a.png\")))])").unwrap();
        if as_number {
            world.assets.textures[0].color_space = ColorSpace::Linear;
        }
        world.assets.add_procedure(inner);
        let texture = world.assets.add_procedure(outer);
        let id = MaterialId(world.assets.materials.len() as u32 - 1);
        let material = &mut world.assets.materials[id.0 as usize].material;
        *material = Material::BlinnPhong(if as_number {
            BlinnPhong { alpha: ScalarInput { factor: 1.0, texture: Some((texture, Channel::Red)) }, ..Default::default() }
        } else {
            BlinnPhong { diffuse: ColorInput::Texture(texture), ..Default::default() }
        });
        let text = |world: &World| write(world, Path::new(SCENE)).unwrap();
        // Textures that nothing uses are lost, so numbers may differ, but not what is written.
        prop_assert_eq!(text(&world), text(&there_and_back(&world)));
    }
}

#[test]
fn scene_written_for_another_folder_is_read_from_there() {
    let world = read(EVERYTHING).unwrap();
    let text = write(&world, Path::new("/somewhere/else.ron")).unwrap();
    let again = parse(&text, Path::new("/somewhere/else.ron"), &mut Fake::default()).unwrap();
    assert_same(&world, &again);
}
