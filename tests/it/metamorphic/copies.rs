//! A mesh looks the same as a copy, as an instance, and with transformed vertices.

use rayfront::math::{Mat4, Quat, Vec3};
use rayfront::world::{Mesh, Shape, Transform, Transport, World};

use super::stage::{self, baked, camera, place_mesh, sky};
use super::{Relations, Seen};

/// Ways to place a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Placed {
    Copies,
    Instances,
    Baked,
}

/// Rotated, mirrored, sheared, sheared and mirrored.
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

/// Four placements of a mesh above a floor, viewed from above.
fn scene(transport: Transport, mesh: &Mesh, material: usize, placed: Placed) -> World {
    let mut world = stage::world(transport, 20, 64);
    let material = stage::material(&mut world.assets, material);
    camera(&mut world, [0.3, 6.0, 2.0], [0.0, 0.0, 0.0], 0.8);
    sky(&mut world);
    place_mesh(&mut world, stage::floor(3.0, -0.5), stage::matte(0.5), Transform::IDENTITY);
    world.entities.spawn((stage::point_light(300.0), stage::at(1.5, 4.0, 1.0)));
    let material = stage::add(&mut world, &material);
    let shared = world.assets.add_mesh(mesh.clone());
    for matrix in places() {
        if placed == Placed::Baked {
            let mesh = world.assets.add_mesh(baked(mesh, matrix));
            world.entities.spawn((Shape::Mesh(mesh), material, Transform::IDENTITY));
        } else {
            world.entities.spawn((Shape::Mesh(shared), material, stage::affine(matrix)));
        }
    }
    world.settings.copied_triangles = if placed == Placed::Instances { 0 } else { 1 << 18 };
    world
}

fn seen(transport: Transport, mesh: &Mesh, material: usize, placed: Placed) -> Seen {
    Seen::of(&scene(transport, mesh, material, placed))
}

/// Compares copies and instances with meshes with transformed vertices.
fn check(transport: Transport, mesh: &Mesh, names: &[&str]) {
    let mut all = Relations::default();
    for (index, name) in stage::names().into_iter().enumerate().filter(|(_, name)| names.contains(name)) {
        let by_hand = seen(transport, mesh, index, Placed::Baked);
        for placed in [Placed::Copies, Placed::Instances] {
            let (found, what) = (seen(transport, mesh, index, placed), format!("{name}, {placed:?}"));
            // Under Whitted's transport hardly anything but blending is random.
            if transport == Transport::Path || name == "blended" {
                all.same(&found, &by_hand, &what);
            } else {
                all.equal(&found, &by_hand, &what);
            }
        }
    }
}

#[test]
fn copies_and_instances_equal_transformed_meshes() {
    for transport in stage::BOTH {
        check(transport, &stage::shell(), &stage::names());
    }
}

/// The materials that use tangents.
const WITH_TANGENTS: [&str; 3] = ["bumpy", "brushed", "bumpy coat"];

#[test]
fn given_tangents_are_transformed_with_the_mesh() {
    check(Transport::Path, &stage::shell_with_tangents(), &WITH_TANGENTS);
}

/// Given tangents along growing u equal the derived ones.
#[test]
fn given_tangents_along_u_equal_derived_ones() {
    let mut all = Relations::default();
    for (index, name) in
        stage::names().into_iter().enumerate().filter(|(_, name)| WITH_TANGENTS.contains(name))
    {
        let [given, derived] = [stage::shell_with_tangents(), stage::shell()]
            .map(|mesh| seen(Transport::Path, &mesh, index, Placed::Baked));
        all.same(&given, &derived, name);
    }
}
