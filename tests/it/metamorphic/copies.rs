//! A mesh looks the same however it is placed: as copies, as instances, or moved by its author.

use rayfront::math::{Mat4, Quat, Rgb, Vec3};
use rayfront::world::{Assets, Falloff, Light, Mesh, Shape, Transform, Transport, World};

use super::stage::{self, baked, camera, place_mesh, sky};
use super::{Relations, Seen};

/// How a mesh gets to its places.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Placed {
    Copies,
    Instances,
    Baked,
}

/// Turned, mirrored, sheared, sheared and mirrored.
fn places() -> [Mat4; 4] {
    let turn = |x: f32, y: f32| Mat4::from_quat(Quat::from_rotation_x(x) * Quat::from_rotation_y(y));
    let to = |x: f32, y: f32, z: f32| Mat4::from_translation(Vec3::new(x, y, z));
    let scale = |x: f32, y: f32, z: f32| Mat4::from_scale(Vec3::new(x, y, z));
    let mut shear = Mat4::IDENTITY;
    (shear.x_axis.y, shear.z_axis.x) = (0.3, 0.5);
    [
        to(-1.1, 0.9, -0.9) * turn(0.5, 2.0),
        to(1.1, 0.8, -0.9) * turn(0.3, 0.4) * scale(-1.0, 1.0, 1.0),
        to(-1.1, 0.5, 1.1) * turn(0.2, 1.0) * shear * scale(0.8, 0.9, 0.8),
        to(1.1, 0.5, 1.1) * shear * turn(0.3, -0.7) * scale(0.8, 0.8, -0.9),
    ]
}

/// Four of a mesh above a floor, seen from above.
fn scene(transport: Transport, mesh: &Mesh, material: usize, placed: Placed) -> World {
    let mut world = stage::world(transport, 20, 64);
    let material = stage::materials(&mut world.assets).swap_remove(material).1;
    camera(&mut world, [0.3, 6.0, 2.0], [0.0, 0.0, 0.0], 0.8);
    sky(&mut world);
    place_mesh(&mut world, stage::floor(3.0, -0.5), stage::matte(0.5), Transform::IDENTITY);
    let light = Light::Point { power_w: Rgb::splat(300.0), falloff: Falloff::InverseSquare };
    world.entities.spawn((light, stage::at(1.5, 4.0, 1.0)));
    let material = stage::add(&mut world, &material);
    let shared = world.assets.add_mesh(mesh.clone());
    for matrix in places() {
        if placed == Placed::Baked {
            let mesh = world.assets.add_mesh(baked(mesh, matrix));
            world.entities.spawn((Shape::Mesh(mesh), material, Transform::IDENTITY));
        } else {
            world.entities.spawn((Shape::Mesh(shared), material, Transform::Matrix(matrix)));
        }
    }
    world.settings.copied_triangles = if placed == Placed::Instances { 0 } else { 1 << 18 };
    world
}

fn seen(transport: Transport, mesh: &Mesh, material: usize, placed: Placed) -> Seen {
    Seen::of(&scene(transport, mesh, material, placed))
}

fn names() -> Vec<&'static str> {
    stage::materials(&mut Assets::default()).into_iter().map(|(name, _)| name).collect()
}

/// Copies, instances and meshes that their author has moved, for every material.
#[test]
fn copies_and_instances_look_as_if_moved_by_hand() {
    let mut all = Relations::default();
    let mesh = stage::shell();
    for (index, name) in names().into_iter().enumerate() {
        let by_hand = seen(Transport::Path, &mesh, index, Placed::Baked);
        for placed in [Placed::Copies, Placed::Instances] {
            all.same(&seen(Transport::Path, &mesh, index, placed), &by_hand, &format!("{name}, {placed:?}"));
        }
    }
}

/// The same with their own tangents, for materials that need them.
#[test]
fn given_tangents_are_placed_with_the_mesh() {
    let mut all = Relations::default();
    let mesh = stage::shell_with_tangents();
    for (index, name) in names().into_iter().enumerate() {
        if !["bumpy", "brushed", "bumpy coat"].contains(&name) {
            continue;
        }
        let by_hand = seen(Transport::Path, &mesh, index, Placed::Baked);
        for placed in [Placed::Copies, Placed::Instances] {
            all.same(&seen(Transport::Path, &mesh, index, placed), &by_hand, &format!("{name}, {placed:?}"));
        }
    }
}

/// Tangents that go along growing u change nothing: they are what is derived without them.
#[test]
fn tangents_along_u_are_those_of_the_coordinates() {
    let mut all = Relations::default();
    let (given, derived) = (stage::shell_with_tangents(), stage::shell());
    for (index, name) in names().into_iter().enumerate() {
        if ["bumpy", "brushed", "bumpy coat"].contains(&name) {
            let a = seen(Transport::Path, &given, index, Placed::Baked);
            all.same(&a, &seen(Transport::Path, &derived, index, Placed::Baked), name);
        }
    }
}

/// Under Whitted's transport, where little is random but what is blended.
#[test]
fn classic_copies_and_instances_look_as_if_moved_by_hand() {
    let mut all = Relations::default();
    let mesh = stage::shell();
    for (index, name) in names().into_iter().enumerate() {
        let by_hand = seen(Transport::Whitted, &mesh, index, Placed::Baked);
        for placed in [Placed::Copies, Placed::Instances] {
            let (found, what) =
                (seen(Transport::Whitted, &mesh, index, placed), format!("{name}, {placed:?}"));
            if name == "blended" {
                all.same(&found, &by_hand, &what);
            } else {
                all.equal(&found, &by_hand, &what);
            }
        }
    }
}
