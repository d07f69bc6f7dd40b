//! Coincident surfaces: each is hit, in any order.

use rayfront::compile::compile;
use rayfront::internals::film::Values;
use rayfront::math::{Mat4, Quat, Rgb, Vec3};
use rayfront::render::{Options, Session};
use rayfront::world::{AlphaMode, Aov, Background, Material, Mesh, Shape, Transform, Transport, World};

use super::stage::{self, camera, grey, number, place, place_mesh, principled, reversed, veil};
use super::{Relations, Seen};

/// Ways to add two meshes to a world.
const WAYS: [&str; 3] = ["one mesh", "two meshes", "instances"];

/// Adds two coincident meshes of one material.
fn both(world: &mut World, first: Mesh, second: Mesh, material: &Material, matrix: Mat4, way: &str) {
    let (material, transform) = (stage::add(world, material), stage::affine(matrix));
    if way == "one mesh" {
        let mesh = world.assets.add_mesh(stage::joined(first, &second));
        world.entities.spawn((Shape::Mesh(mesh), material, transform));
        return;
    }
    for mesh in [first, second] {
        let mesh = world.assets.add_mesh(mesh);
        world.entities.spawn((Shape::Mesh(mesh), material, transform));
    }
    if way == "instances" {
        stage::as_instances(world);
    }
}

/// A rotation and translation without special angles.
fn aslant() -> Mat4 {
    let turn = Quat::from_rotation_y(0.4) * Quat::from_rotation_x(-0.3) * Quat::from_rotation_z(0.7);
    Mat4::from_translation(Vec3::new(0.13, -0.07, 0.29)) * Mat4::from_quat(turn)
}

fn sheet() -> Mesh {
    stage::quad([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0])
}

/// A sheet viewed from one side, in front of a wall that receives its shadow.
fn scene(transport: Transport, from: f32) -> World {
    let mut world = stage::world(transport, 24, 64);
    camera(&mut world, [0.4, 0.3, from], [0.0, 0.0, 0.0], 0.9);
    world.settings.background = Background::Constant(Rgb::splat(0.3));
    for z in [-4.0, 4.0] {
        let wall = stage::quad([-6.0, -6.0, z], [12.0, 0.0, 0.0], [0.0, 12.0, 0.0]);
        place_mesh(&mut world, wall, stage::matte(0.5), Transform::IDENTITY);
    }
    for z in [-3.0, 3.0] {
        world.entities.spawn((stage::point_light(150.0), stage::at(1.0, 0.5, z)));
    }
    world
}

fn one_sided(red: f32) -> Material {
    principled(|m| m.base_color = rayfront::world::ColorInput::Constant(Rgb::new(red, 0.3, 0.2)))
}

fn two_sided(red: f32) -> Material {
    let Material::Principled(mut m) = one_sided(red) else { unreachable!() };
    m.double_sided = true;
    Material::Principled(m)
}

/// A sheet modelled twice, once for each side, equals the double-sided sheet, for camera and shadow rays.
#[test]
fn two_single_sided_sheets_equal_a_double_sided_one() {
    let mut all = Relations::default();
    for from in [-2.5, 2.5] {
        let mut once = scene(Transport::Path, from);
        place_mesh(&mut once, sheet(), two_sided(0.8), stage::affine(aslant()));
        let once = Seen::of(&once);
        for way in WAYS {
            for (a, b) in [(sheet(), reversed(sheet())), (reversed(sheet()), sheet())] {
                let mut twice = scene(Transport::Path, from);
                both(&mut twice, a, b, &one_sided(0.8), aslant(), way);
                all.same(&Seen::of(&twice), &once, &format!("from {from}, {way}"));
            }
        }
    }
}

/// First-hit features lie behind surfaces that the camera ray passes, too.
#[test]
fn features_of_two_single_sided_sheets_equal_a_double_sided_one() {
    let mut all = Relations::default();
    let known = [Aov::Depth, Aov::Coverage, Aov::Albedo, Aov::Normal, Aov::Position];
    let columns = |world: &World| {
        let mut session =
            Session::new(compile(world, None).expect("a scene"), &world.settings, Options::default());
        session.advance(u32::MAX);
        session.channels(&known)
    };
    for from in [-2.5, 2.5] {
        let mut once = scene(Transport::Path, from);
        place_mesh(&mut once, sheet(), two_sided(0.8), stage::affine(aslant()));
        let once = columns(&once);
        for way in WAYS {
            let mut twice = scene(Transport::Path, from);
            both(&mut twice, sheet(), reversed(sheet()), &one_sided(0.8), aslant(), way);
            for (a, b) in once.iter().zip(columns(&twice)) {
                let (Values::Float(x), Values::Float(y)) = (&a.values, &b.values) else { continue };
                let far = x.iter().zip(y).filter(|(x, y)| (*x - *y).abs() > 1e-3 * x.abs().max(1.0)).count();
                all.holds(far <= x.len() / 64, || {
                    format!("{} from {from}, {way}: {far} pixels differ", a.name)
                });
            }
        }
    }
}

/// A ball of single-sided faces, each modelled for both sides.
#[test]
fn two_single_sided_balls_equal_a_double_sided_one() {
    let mut all = Relations::default();
    for inside in [false, true] {
        let scene = || {
            let mut world = scene(Transport::Path, if inside { 0.2 } else { 3.0 });
            world.entities.spawn((stage::point_light(20.0), stage::at(0.3, 0.5, -0.3)));
            world
        };
        let mut once = scene();
        place_mesh(&mut once, stage::ball(2), two_sided(0.6), stage::affine(aslant()));
        let once = Seen::of(&once);
        for way in WAYS {
            let mut twice = scene();
            both(&mut twice, stage::ball(2), reversed(stage::ball(2)), &one_sided(0.6), aslant(), way);
            all.same(&Seen::of(&twice), &once, &format!("inside {inside}, {way}"));
        }
    }
}

/// An opaque surface modelled twice counts once, under both transports.
#[test]
fn coincident_opaque_sheets_equal_one() {
    let mut all = Relations::default();
    for transport in stage::BOTH {
        let mut once = scene(transport, 2.5);
        place_mesh(&mut once, sheet(), two_sided(0.7), stage::affine(aslant()));
        let once = Seen::of(&once);
        for way in WAYS {
            let mut twice = scene(transport, 2.5);
            both(&mut twice, sheet(), sheet(), &two_sided(0.7), aslant(), way);
            let twice = Seen::of(&twice);
            all.same(&twice, &once, &format!("{transport:?}, {way}"));
            if transport == Transport::Whitted {
                all.equal(&twice, &once, way);
            }
        }
    }
}

/// White seen through coincident black veils: the product of their transmittances.
#[test]
fn coincident_veils_multiply() {
    let mut all = Relations::default();
    let window = || {
        let mut world = stage::world(Transport::Path, 8, 1024);
        world.settings.background = Background::Constant(Rgb::WHITE);
        camera(&mut world, [0.0, 0.0, 5.0], [0.0, 0.0, 0.0], 0.1);
        world
    };
    for way in WAYS {
        let mut world = window();
        both(&mut world, sheet(), sheet(), &veil(0.5), aslant(), way);
        all.is(&Seen::of(&world), 0.25, way);
        let mut world = window();
        both(&mut world, sheet(), reversed(sheet()), &veil(0.5), aslant(), way);
        all.is(&Seen::of(&world), 0.25, &format!("reversed, {way}"));
    }
    let mut world = window();
    for _ in 0..2 {
        place(&mut world, Shape::Sphere { radius_m: 1.0 }, veil(0.5), Transform::IDENTITY);
    }
    all.is(&Seen::of(&world), 0.0625, "two balls");
}

/// Light passes two coincident veils with the product of their transmittances.
#[test]
fn shadows_of_coincident_veils_multiply() {
    let mut all = Relations::default();
    let lit = |layers: Option<&str>| {
        let mut world = stage::world(Transport::Path, 8, 1024);
        world.settings.max_depth = 0;
        camera(&mut world, [0.0, 0.0, -2.0], [0.0, 0.0, -4.0], 0.3);
        let wall = stage::quad([-6.0, -6.0, -4.0], [12.0, 0.0, 0.0], [0.0, 12.0, 0.0]);
        place_mesh(&mut world, wall, stage::matte(0.5), Transform::IDENTITY);
        world.entities.spawn((stage::point_light(500.0), stage::at(0.1, 0.1, 1.0)));
        if let Some(way) = layers {
            both(&mut world, sheet(), sheet(), &veil(0.5), aslant(), way);
        }
        Seen::of(&world)
    };
    let open = lit(None);
    for way in WAYS {
        all.is(&lit(Some(way)), open.mean() / 4.0, way);
    }
}

/// An object that coincides with a fully transparent one is visible, and casts its shadow.
#[test]
fn fully_transparent_surfaces_hide_no_coincident_one() {
    let mut all = Relations::default();
    let gone = |mode: AlphaMode| {
        principled(|m| {
            (m.alpha, m.alpha_mode, m.double_sided) = (number(0.0), mode, true);
            m.emission = grey(3.0);
        })
    };
    let mut alone = scene(Transport::Path, 2.5);
    place_mesh(&mut alone, sheet(), two_sided(0.7), stage::affine(aslant()));
    let alone = Seen::of(&alone);
    for mode in [AlphaMode::Blend, AlphaMode::Mask { cutoff: 0.5 }] {
        for first in [false, true] {
            let mut world = scene(Transport::Path, 2.5);
            let mut layers = [two_sided(0.7), gone(mode)];
            if first {
                layers.reverse();
            }
            for layer in layers {
                place_mesh(&mut world, sheet(), layer, stage::affine(aslant()));
            }
            all.same(&Seen::of(&world), &alone, &format!("{mode:?}, first {first}"));
        }
    }
}

/// A floor below emitters that are out of view.
fn under(lamps: &[(Mesh, Material)]) -> World {
    let mut world = stage::world(Transport::Path, 8, 2048);
    world.settings.max_depth = 1;
    camera(&mut world, [0.0, 1.5, 0.0], [0.0, 0.0, 0.0], 1.0);
    place_mesh(&mut world, stage::floor(4.0, 0.0), stage::matte(0.6), Transform::IDENTITY);
    for (mesh, material) in lamps {
        place_mesh(&mut world, mesh.clone(), material.clone(), stage::affine(aslant_lamp()));
    }
    world
}

fn aslant_lamp() -> Mat4 {
    let turn = Quat::from_rotation_x(0.3) * Quat::from_rotation_z(-0.2);
    Mat4::from_translation(Vec3::new(0.1, 0.2, 0.0)) * Mat4::from_quat(turn)
}

/// Two emitters, one for each side, equal a double-sided one.
#[test]
fn two_single_sided_emitters_equal_a_double_sided_one() {
    let mut all = Relations::default();
    let lamp = |two: bool| stage::front_lamp(4.0, |m| m.double_sided = two);
    let (down, up) = (stage::ceiling(1.0, 2.0), reversed(stage::ceiling(1.0, 2.0)));
    let once = Seen::of(&under(&[(down.clone(), lamp(true))]));
    for (name, pair) in [("front first", [&down, &up]), ("back first", [&up, &down])] {
        let twice = under(&pair.map(|mesh| (mesh.clone(), lamp(false))));
        all.same(&Seen::of(&twice), &once, &format!("{name}, sampled"));
        all.same(&Seen::found(&twice), &once, &format!("{name}, found"));
    }
}
