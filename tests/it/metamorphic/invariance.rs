//! Invariances of a whole world: under scaling, rotation, brightness, the order of its entities, and the division of
//! work.

use rayfront::compile::compile;
use rayfront::internals::film::{Film, Region};
use rayfront::internals::integrator::Schedule;
use rayfront::math::{DAffine3, DVec3, Mat4, Quat, Rgb, Vec2, Vec3};
use rayfront::render::{Options, Session};
use rayfront::world::{
    Assets, Background, ColorInput, Light, Material, Parent, Shape, Transform, Transport, Volume, World,
};

use super::stage::{self, camera, front_lamp, place, place_mesh};
use super::{Relations, Seen};

/// The entities of a room in some order, one of them with some material.
fn room(transport: Transport, material: usize, order: &[usize]) -> World {
    let mut world = stage::world(transport, 12, 400);
    let material = stage::material(&mut world.assets, material);
    for thing in order {
        spawn(&mut world, *thing, &material);
    }
    world
}

const THINGS: [usize; 9] = [0, 1, 2, 3, 4, 5, 6, 7, 8];

fn spawn(world: &mut World, thing: usize, material: &Material) {
    match thing {
        0 => camera(world, [0.5, 1.6, 3.0], [0.0, 0.2, 0.0], 0.9),
        1 => place_mesh(world, stage::floor(3.0, -0.6), stage::matte(0.5), Transform::IDENTITY),
        2 => place_mesh(world, stage::shell(), material.clone(), stage::at(0.6, 0.3, 0.0)),
        3 => {
            let material = stage::without_tangents(material);
            place(world, Shape::Sphere { radius_m: 0.5 }, material, stage::at(-0.9, 0.1, 0.3));
        }
        4 => place_mesh(world, stage::ceiling(0.7, 2.0), front_lamp(4.0, |_| ()), Transform::IDENTITY),
        5 => place(world, Shape::Sphere { radius_m: 0.3 }, stage::lamp(5.0), stage::at(-1.6, 1.0, 0.4)),
        6 => {
            world.entities.spawn((stage::point_light(80.0), stage::at(1.5, 1.8, 1.0)));
        }
        7 => {
            let (power_w, size_m) = (Rgb::splat(20.0), Vec2::new(1.0, 0.7));
            let light = Light::Area {
                power_w,
                radiance: Rgb::BLACK,
                size_m,
                outline: Default::default(),
                samples: 2,
                pattern: Default::default(),
                visible: true,
            };
            world.entities.spawn((light, stage::looking([1.5, 1.5, -1.5], [0.0, 0.0, 0.0])));
        }
        _ => {
            let light = Light::Directional { irradiance: Rgb::new(0.5, 0.4, 0.3), angle: 0.0 };
            world.entities.spawn((light, stage::looking([-1.0, 2.0, 1.0], [0.0, 0.0, 0.0])));
        }
    }
}

/// Everything below a transform, with the power of lights adapted to the new distances.
fn moved(mut world: World, transform: Transform, scale: f32) -> World {
    let all = world.in_order();
    let root = world.entities.spawn((transform,));
    for entity in all {
        world.entities.insert_one(entity, Parent(root)).expect("it is there");
    }
    world.change_lights(|light| match light {
        Light::Point { power_w, .. } | Light::Spot { power_w, .. } | Light::Area { power_w, .. } => {
            *power_w = *power_w * (scale * scale);
        }
        _ => (),
    });
    for named in &mut world.assets.materials {
        if let Material::Principled(m) = &mut named.material {
            m.volume = m.volume.map(|v| Volume { attenuation_distance: v.attenuation_distance * scale, ..v });
        }
    }
    world
}

/// Scaled by a thousand or a thousandth, or rotated and translated: the same image.
#[test]
fn images_do_not_depend_on_scale_and_rotation() {
    let mut all = Relations::default();
    let turn = Quat::from_rotation_x(0.7) * Quat::from_rotation_y(2.1) * Quat::from_rotation_z(-0.4);
    for (index, name) in stage::names().into_iter().enumerate() {
        for transport in stage::BOTH {
            let world = || room(transport, index, &THINGS);
            let plain = Seen::of(&world());
            for scale in [1000.0, 0.001] {
                let matrix = stage::affine(Mat4::from_scale(Vec3::splat(scale)));
                let what = format!("{name}, {transport:?}, times {scale}");
                all.same(&Seen::of(&moved(world(), matrix, scale)), &plain, &what);
            }
            let shift = Mat4::from_translation(Vec3::new(3.0, -7.0, 1.0));
            let turned = Seen::of(&moved(world(), stage::affine(shift * Mat4::from_quat(turn)), 1.0));
            // The sky stays above.
            all.same(&turned, &plain, &format!("{name}, {transport:?}, turned"));
        }
    }
}

/// Far from the origin of the world, where single precision has steps of half a metre and more: the same image.
#[test]
fn images_do_not_depend_on_the_distance_from_the_origin() {
    let mut all = Relations::default();
    let far = [DVec3::new(450_123.4, 312.7, -5_412_345.6), DVec3::new(1e7, -2e7 / 3.0, 3e6), DVec3::Y * 1e9];
    for (index, name) in stage::names().into_iter().enumerate().step_by(3) {
        for (transport, far) in stage::BOTH.into_iter().flat_map(|transport| far.map(|far| (transport, far)))
        {
            let plain = Seen::of(&room(transport, index, &THINGS));
            let moved = moved(
                room(transport, index, &THINGS),
                Transform::Matrix(DAffine3::from_translation(far)),
                1.0,
            );
            all.same(&Seen::of(&moved), &plain, &format!("{name}, {transport:?}, at {far}"));
        }
    }
}

/// A sphere rotated with everything else keeps its textures, including normal maps and anisotropy.
#[test]
fn spheres_rotate_with_their_normal_maps() {
    let mut all = Relations::default();
    let turn = stage::affine(Mat4::from_quat(Quat::from_rotation_x(0.7) * Quat::from_rotation_z(-0.4)));
    for (index, name) in stage::names().into_iter().enumerate() {
        let world = || {
            let mut world = room(Transport::Path, index, &[0, 1, 4, 7]);
            let material = stage::material(&mut Assets::default(), index);
            place(&mut world, Shape::Sphere { radius_m: 0.6 }, material, stage::at(0.0, 0.3, 0.3));
            world
        };
        all.same(&Seen::of(&moved(world(), turn, 1.0)), &Seen::of(&world()), name);
    }
}

/// The order of entities does not matter.
#[test]
fn order_of_entities_does_not_matter() {
    let mut all = Relations::default();
    for (index, name) in stage::names().into_iter().enumerate() {
        for transport in stage::BOTH {
            let plain = Seen::of(&room(transport, index, &THINGS));
            for order in [[8, 7, 6, 5, 4, 3, 2, 1, 0], [3, 6, 0, 8, 4, 1, 5, 7, 2]] {
                let what = format!("{name}, {transport:?}, {order:?}");
                all.same(&Seen::of(&room(transport, index, &order)), &plain, &what);
            }
        }
    }
}

/// Removed entities have no effect, and new ones come last.
#[test]
fn removed_entities_have_no_effect() {
    let mut all = Relations::default();
    for transport in stage::BOTH {
        let material = stage::matte(0.6);
        let mut plain = room(transport, 0, &THINGS[..7]);
        spawn(&mut plain, 7, &material);
        for gone in 0..4 {
            let mut world = stage::world(transport, 12, 400);
            let classic = stage::material(&mut world.assets, 0);
            let mut away = Vec::new();
            for thing in &THINGS[..7] {
                if *thing % 4 == gone {
                    away.push(world.entities.spawn((stage::at(0.0, 0.0, 0.0),)));
                }
                spawn(&mut world, *thing, &classic);
            }
            for entity in away {
                world.entities.despawn(entity).expect("it is there");
            }
            let before = world.in_order();
            spawn(&mut world, 7, &material);
            let after = world.in_order();
            all.holds(after[..before.len()] == before, || format!("the new one does not come last, {gone}"));
            all.equal(&Seen::of(&world), &Seen::of(&plain), &format!("{transport:?}, {gone}"));
            let exact = Seen::of(&world).pixels == Seen::of(&plain).pixels;
            all.holds(exact, || format!("{transport:?}, {gone}: not to the bit"));
        }
    }
}

/// A sheet in two pieces equals the whole sheet.
#[test]
fn sheet_in_two_pieces_equals_the_whole() {
    let mut all = Relations::default();
    for (index, name) in stage::names().into_iter().enumerate() {
        for transport in stage::BOTH {
            let seen = |pieces: u32| {
                let mut world = room(transport, index, &[0, 1, 4, 6]);
                let material = stage::material(&mut Assets::default(), index);
                let width = 2.0 / pieces as f32;
                for piece in 0..pieces {
                    let left = -1.0 + width * piece as f32;
                    let mut mesh = stage::quad([left, 0.0, 1.0], [width, 0.0, 0.0], [0.0, 0.4, -2.0]);
                    mesh.uvs.iter_mut().for_each(|uv| uv.x = (uv.x * width + left + 1.0) / 2.0);
                    place_mesh(&mut world, mesh, material.clone(), Transform::IDENTITY);
                }
                Seen::of(&world)
            };
            all.same(&seen(2), &seen(1), &format!("{name}, {transport:?}"));
        }
    }
}

/// A distant invisible object does not darken the image: the film scale depends on the surroundings of the lights, not
/// on the extent of the scene.
#[test]
fn distant_objects_do_not_darken_the_image() {
    for transport in stage::BOTH {
        let seen = |far: Option<f32>| {
            // A single light, without an area.
            let mut world = room(transport, 0, &[0, 1, 2, 3, 6]);
            if let Some(far) = far {
                place(
                    &mut world,
                    Shape::Sphere { radius_m: 0.3 },
                    stage::matte(0.5),
                    stage::at(0.0, far, 0.0),
                );
            }
            Seen::of(&world)
        };
        let mut all = Relations::default();
        let plain = seen(None);
        for far in [1e3, 1e5, 1e6] {
            all.same(&plain, &seen(Some(far)), &format!("{transport:?}: a ball {far} m away"));
        }
    }
}

/// Scaling all light by a power of two scales the image, to the last bits.
#[test]
fn images_scale_with_the_light() {
    let mut all = Relations::default();
    for transport in stage::BOTH {
        let lit = |factor: f32| {
            let mut world = room(transport, 0, &THINGS);
            world.settings.background = Background::Constant(Rgb::splat(0.2 * factor));
            world.settings.ambient = Rgb::splat(0.05 * factor);
            world.change_lights(|light| match light {
                Light::Directional { irradiance, .. } => *irradiance = *irradiance * factor,
                Light::Environment { radiance, .. } | Light::Sky { radiance, .. } => {
                    *radiance = *radiance * factor;
                }
                Light::Point { power_w, .. }
                | Light::Spot { power_w, .. }
                | Light::Photometric { power_w, .. }
                | Light::Area { power_w, .. } => {
                    *power_w = *power_w * factor;
                }
            });
            for named in &mut world.assets.materials {
                match &mut named.material {
                    Material::Principled(m) => scale(&mut m.emission, factor),
                    Material::BlinnPhong(m) => scale(&mut m.emission, factor),
                }
            }
            Seen::of(&world)
        };
        let plain = lit(1.0);
        for power in [-40, -10, 10, 40] {
            let factor = 2.0f32.powi(power);
            let scaled = lit(factor).times(1.0 / factor);
            let close = |(a, b): (f32, f32)| (a - b).abs() <= 1e-5 * b.max(0.01);
            let alike = |(a, b): &(&Rgb, &Rgb)| a.to_array().into_iter().zip(b.to_array()).all(close);
            let different = scaled.pixels.iter().zip(&plain.pixels).filter(|pair| !alike(pair)).count();
            let (x, y) = (scaled.mean(), plain.mean());
            all.holds(different == 0, || {
                format!("{transport:?}, 2^{power}: {different} pixels, {x} and {y}")
            });
        }
    }
}

fn scale(input: &mut ColorInput, factor: f32) {
    if let ColorInput::Constant(color) = input {
        *color = *color * factor;
    }
}

fn session(world: &World, schedule: Schedule) -> Session {
    let options = Options { schedule, ..Options::default() };
    Session::new(compile(world, None).expect("a scene"), &world.settings, options)
}

/// Both schedules, and samples split into two films: identical to the bit, for every material.
#[test]
fn films_are_identical_for_schedules_and_merged_parts() {
    for (index, name) in stage::names().into_iter().enumerate() {
        for transport in stage::BOTH {
            let mut world = room(transport, index, &THINGS);
            world.settings.samples = 8;
            // Coincident objects.
            let material = stage::material(&mut Assets::default(), index);
            place_mesh(&mut world, stage::shell(), material, stage::at(0.6, 0.3, 0.0));
            let whole = |schedule: Schedule| {
                let mut session = session(&world, schedule);
                session.advance(u32::MAX);
                session.film().clone()
            };
            let expected = whole(Schedule::Wavefront);
            assert_eq!(whole(Schedule::Recursive), expected, "{name}, {transport:?}");
            let mut merged = Film::new(Region::whole(world.settings.size), expected.unit());
            for samples in [0..3, 3..8] {
                let mut part = session(&world, Schedule::Wavefront).with_samples(samples);
                part.advance(u32::MAX);
                merged.merge(part.film());
            }
            assert_eq!(merged, expected, "{name}, {transport:?}, merged");
        }
    }
}
