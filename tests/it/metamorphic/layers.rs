//! Clear coats, thin films, and glass bodies.

use rayfront::math::{Mat4, Rgb, Vec3};
use rayfront::world::{
    Background, BlinnPhong, Iridescence, Material, Mesh, NormalMap, Principled, Shape, Transform, Transport,
    Volume, World,
};

use super::stage::{self, camera, front_lamp, grey, number, place, place_mesh, principled, reversed};
use super::{Relations, Seen};

type Change = fn(&mut Principled);

/// A sheet under a light and a sky.
fn sheet(material: impl FnOnce(&mut World) -> Material) -> World {
    let mut world = stage::world(Transport::Path, 10, 512);
    stage::sky(&mut world);
    camera(&mut world, [0.0, 1.0, 1.6], [0.0, 0.0, 0.0], 0.6);
    let material = material(&mut world);
    place_mesh(&mut world, stage::floor(1.0, 0.0), material, Transform::IDENTITY);
    place_mesh(&mut world, stage::ceiling(1.0, 1.8), front_lamp(4.0, |_| ()), stage::at(-1.0, 0.0, -1.0));
    world
}

/// The normal map of a black base below a coat has no effect.
#[test]
fn clearcoat_over_black_ignores_the_bases_normal_map() {
    let mut all = Relations::default();
    for roughness in [0.0, 0.3, 0.7] {
        for own in [None, Some([0.3, 0.2, 1.0])] {
            let seen = |below: Option<[f32; 3]>| {
                Seen::of(&sheet(|world| {
                    let mut map = |n| NormalMap { texture: stage::tilted(&mut world.assets, n), scale: 1.0 };
                    let (normal, clearcoat_normal) = (below.map(&mut map), own.map(&mut map));
                    principled(|m| {
                        (m.base_color, m.specular) = (grey(0.0), number(0.0));
                        (m.clearcoat, m.clearcoat_roughness) = (number(1.0), number(roughness));
                        (m.normal, m.clearcoat_normal) = (normal, clearcoat_normal);
                    })
                }))
            };
            let flat = seen(None);
            for below in [[0.8, 0.0, 0.6], [-0.3, 0.9, 0.3], [0.1, -0.95, 0.2]] {
                all.same(&seen(Some(below)), &flat, &format!("coat {roughness} {own:?} over {below:?}"));
            }
        }
    }
}

/// In uniform surroundings a clear body is invisible with any roughness, and with an index near 1.
#[test]
fn clear_bodies_with_index_near_one_are_invisible() {
    let mut all = Relations::default();
    for (roughness, volume) in [
        (0.0, Some(Volume::default())),
        (0.3, Some(Volume::default())),
        (1.0, Some(Volume::default())),
        (0.0, None),
    ] {
        for ior in [0.9999, 1.0, 1.0001] {
            let mut world = stage::world(Transport::Path, 8, 256);
            world.settings.background = Background::Constant(Rgb::splat(0.5));
            world.settings.max_depth = 32;
            camera(&mut world, [0.0, 0.0, 3.0], [0.0, 0.0, 0.0], 0.5);
            let clear = principled(|m| {
                (m.transmission, m.roughness, m.ior, m.volume) =
                    (number(1.0), number(roughness), ior, volume);
            });
            place(&mut world, Shape::Sphere { radius_m: 1.0 }, clear, Transform::IDENTITY);
            let found = Seen::of(&world).mean();
            let what = || format!("ior {ior}, roughness {roughness}: {found} of 0.5");
            all.holds((found / 0.5 - 1.0).abs() < 0.02, what);
        }
    }
}

/// A glass ball in colourful surroundings, with faces of either orientation.
fn glass(transport: Transport, mesh: Mesh, material: Material) -> Seen {
    let mut world = stage::world(transport, 12, 512);
    (world.settings.max_depth, world.settings.min_throughput) = (12, 1e-5);
    stage::sky(&mut world);
    camera(&mut world, [0.0, 0.5, 3.0], [0.0, 0.0, 0.0], 0.8);
    place_mesh(&mut world, stage::floor(2.0, -1.3), stage::matte(0.5), Transform::IDENTITY);
    place_mesh(&mut world, mesh, material, stage::affine(Mat4::from_rotation_y(0.3)));
    Seen::of(&world)
}

/// Glass in air turned inside out is air in glass: the winding decides which side is outside.
#[test]
fn glass_turned_inside_out_has_the_inverse_index() {
    let mut all = Relations::default();
    let flat = || Mesh { normals: Vec::new(), ..stage::ball(2) };
    let rough = |ior: f32, roughness: f32| {
        principled(|m| {
            (m.transmission, m.roughness, m.ior) = (number(1.0), number(roughness), ior);
            m.volume = Some(Volume::default());
        })
    };
    let classic = |ior: f32| Material::BlinnPhong(BlinnPhong { ior: Some(ior), ..BlinnPhong::default() });
    for ior in [1.5, 0.8] {
        for (name, mesh) in [("flat", flat()), ("smooth", stage::ball(2))] {
            for roughness in [0.0, 0.4] {
                let out = glass(Transport::Path, mesh.clone(), rough(ior, roughness));
                let inside_out = glass(Transport::Path, reversed(mesh.clone()), rough(1.0 / ior, roughness));
                all.same(&inside_out, &out, &format!("{name}, ior {ior}, roughness {roughness}"));
            }
            for transport in stage::BOTH {
                let out = glass(transport, mesh.clone(), classic(ior));
                let inside_out = glass(transport, reversed(mesh.clone()), classic(1.0 / ior));
                all.same(&inside_out, &out, &format!("{name}, classic ior {ior}, {transport:?}"));
            }
        }
    }
}

/// The green reflectance of a thin film of some thickness, at an angle.
fn reflected(cosine: f32, thickness: f32, change: &dyn Fn(&mut Principled)) -> f64 {
    let mut world = stage::world(Transport::Path, 1, 512);
    // White above, black below: only reflected light is visible.
    let sine = (1.0 - cosine * cosine).sqrt();
    camera(&mut world, [0.0, 3.0 * cosine, 3.0 * sine], [0.0; 3], 1e-3);
    world.settings.max_depth = 1;
    let film = principled(|m| {
        (m.roughness, m.transmission, m.volume) = (number(0.0), number(1.0), Some(Volume::default()));
        m.iridescence = Iridescence {
            factor: number(1.0),
            ior: 1.5,
            thickness_maximum: thickness,
            ..Iridescence::default()
        };
        change(m);
    });
    place_mesh(&mut world, stage::floor(1.0, 0.0), film, Transform::IDENTITY);
    place_mesh(&mut world, stage::ceiling(90.0, 20.0), stage::lamp(1.0), Transform::IDENTITY);
    Seen::of(&world).pixels[0].g as f64
}

/// The period of a film's fringes in thickness, from the best-fitting wave.
fn fringe(cosine: f32, change: &dyn Fn(&mut Principled)) -> f64 {
    let step = 25.0;
    let curve: Vec<f64> = (0..40).map(|i| reflected(cosine, 50.0 + step as f32 * i as f32, change)).collect();
    let mean = curve.iter().sum::<f64>() / curve.len() as f64;
    let strength = |length: f64| {
        let turns = |i: usize| std::f64::consts::TAU * step * i as f64 / length;
        let part = |of: fn(f64) -> f64| -> f64 {
            curve.iter().enumerate().map(|(i, r)| (r - mean) * of(turns(i))).sum()
        };
        part(libm::cos).hypot(part(libm::sin))
    };
    let lengths = (300..1200).map(|i| i as f64 * 0.5);
    lengths.max_by(|a, b| strength(*a).total_cmp(&strength(*b))).expect("some length")
}

/// Fringes of a film depend on the film and on the angle in air, not on the base.
#[test]
fn thin_film_fringes_do_not_depend_on_the_base() {
    let mut all = Relations::default();
    for cosine in [0.9, 0.6] {
        let metal = fringe(cosine, &|m| {
            (m.metallic, m.transmission, m.base_color) = (number(1.0), number(0.0), grey(0.5));
        });
        for ior in [1.2, 0.9, 0.85] {
            let found = fringe(cosine, &|m| m.ior = ior);
            let what = || format!("ior {ior} at {cosine}: {found} nm, not {metal}");
            all.holds((found / metal - 1.0).abs() < 0.03, what);
        }
    }
}

/// A constant normal map equals a surface with those normals.
#[test]
fn constant_normal_map_equals_a_tilted_normal() {
    let mut all = Relations::default();
    let tilt = Vec3::new(0.3, -0.2, 1.0).normalize();
    let seen = |mapped: bool, change: fn(&mut Principled)| {
        let mut world = stage::world(Transport::Path, 10, 256);
        stage::sky(&mut world);
        camera(&mut world, [0.3, 0.5, 2.0], [0.0, 0.0, 0.0], 0.7);
        let map = NormalMap { texture: stage::tilted(&mut world.assets, tilt.to_array()), scale: 1.0 };
        let material = principled(|m| {
            change(m);
            if mapped {
                m.normal = Some(map);
                m.clearcoat_normal = Some(map);
            }
        });
        let mut mesh = stage::quad([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        if !mapped {
            mesh.normals = vec![tilt; 4];
        }
        place_mesh(&mut world, mesh, material, stage::affine(Mat4::from_rotation_x(-0.4)));
        let lamp = stage::quad([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        let turn = Mat4::from_translation(Vec3::new(1.5, 1.0, 2.0)) * Mat4::from_rotation_y(3.5);
        place_mesh(&mut world, lamp, front_lamp(4.0, |_| ()), stage::affine(turn));
        Seen::of(&world)
    };
    let changes: [(&str, Change); 6] = [
        ("matte", |m| m.base_color = grey(0.7)),
        ("metal", |m| (m.metallic, m.roughness) = (number(1.0), number(0.4))),
        ("brushed", |m| {
            (m.metallic, m.roughness) = (number(1.0), number(0.5));
            (m.anisotropy.strength, m.anisotropy.rotation) = (0.9, 0.5);
        }),
        ("coat", |m| (m.clearcoat, m.clearcoat_roughness) = (number(1.0), number(0.4))),
        ("sheen", |m| (m.sheen_color, m.sheen_roughness) = (grey(0.8), number(0.6))),
        ("both sides", |m| (m.transmission, m.double_sided) = (number(0.5), true)),
    ];
    for (name, change) in changes {
        all.same(&seen(true, change), &seen(false, change), name);
    }
}

/// A thin film without thickness has no effect.
#[test]
fn thin_film_without_thickness_has_no_effect() {
    let mut all = Relations::default();
    for roughness in [0.0, 0.5] {
        for ior in [1.5, 0.8] {
            let seen = |factor: f32| {
                let material = principled(|m| {
                    (m.transmission, m.roughness, m.ior) = (number(1.0), number(roughness), ior);
                    m.volume = Some(Volume::default());
                    m.iridescence.factor = number(factor);
                    (m.iridescence.thickness_minimum, m.iridescence.thickness_maximum) = (0.0, 0.0);
                });
                glass(Transport::Path, stage::ball(2), material)
            };
            all.same(&seen(1.0), &seen(0.0), &format!("ior {ior}, roughness {roughness}"));
        }
    }
}
