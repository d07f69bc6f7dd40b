//! The front of a surface is defined by its winding, not by its normals, its first corner, or mirroring transforms.

use rayfront::math::{Mat4, Quat, Rgb, Vec3};
use rayfront::world::{Background, ColorInput, Mesh, Shape, Transform, Transport, World};

use super::stage::{self, camera, front_lamp, grey, number, place, place_mesh, principled, reversed};
use super::{Relations, Seen};

/// A mesh of some material above a floor, under a sky and a light.
fn scene(transport: Transport, mesh: Mesh, material: usize, from: [f32; 3]) -> World {
    let mut world = stage::world(transport, 16, 64);
    let material = stage::material(&mut world.assets, material);
    camera(&mut world, from, [0.0, 0.3, 0.0], 0.7);
    stage::sky(&mut world);
    place_mesh(&mut world, stage::floor(4.0, -1.3), stage::matte(0.5), Transform::IDENTITY);
    world.entities.spawn((stage::point_light(300.0), stage::at(2.0, 4.0, 2.0)));
    let transform = stage::affine(Mat4::from_rotation_y(0.4));
    place_mesh(&mut world, mesh, material, transform);
    world
}

fn turned_normals(mut mesh: Mesh) -> Mesh {
    mesh.normals.iter_mut().for_each(|n| *n = -*n);
    mesh
}

const ABOVE: [f32; 3] = [1.0, 3.0, 2.5];
const BELOW: [f32; 3] = [1.0, -1.2, 2.5];

/// Vertex normals only affect shading: reversing them has no effect.
#[test]
fn reversed_vertex_normals_have_no_effect() {
    let mut all = Relations::default();
    for (index, name) in stage::names().into_iter().enumerate() {
        for transport in stage::BOTH {
            for from in [ABOVE, BELOW] {
                let meshes = [stage::shell(), stage::ball(2)];
                for (mesh, what) in meshes.into_iter().zip(["shell", "ball"]) {
                    let plain = Seen::of(&scene(transport, mesh.clone(), index, from));
                    let turned = Seen::of(&scene(transport, turned_normals(mesh), index, from));
                    let what = format!("{name}, {what}, {transport:?} from {from:?}");
                    all.same(&turned, &plain, &what);
                }
            }
        }
    }
}

/// The first corner of a triangle does not matter.
#[test]
fn first_corner_of_a_triangle_has_no_effect() {
    let mut all = Relations::default();
    for (index, name) in stage::names().into_iter().enumerate() {
        for transport in stage::BOTH {
            let mut mesh = stage::shell();
            let plain = Seen::of(&scene(transport, mesh.clone(), index, ABOVE));
            mesh.triangles.iter_mut().for_each(|t| t.rotate_left(1));
            let first = Seen::of(&scene(transport, mesh.clone(), index, ABOVE));
            mesh.triangles.iter_mut().step_by(3).for_each(|t| t.rotate_left(1));
            let mixed = Seen::of(&scene(transport, mesh, index, ABOVE));
            all.same(&first, &plain, name);
            all.same(&mixed, &plain, name);
        }
    }
}

/// The back of a single-sided surface is invisible, whatever its normals.
#[test]
fn single_sided_meshes_are_visible_from_the_front_only() {
    let mut all = Relations::default();
    let sheets = [
        ("flat", stage::floor(1.5, 0.0)),
        ("smooth", stage::shell()),
        ("normals turned over", turned_normals(stage::shell())),
    ];
    let red = |mesh: &Mesh, from: [f32; 3]| front(mesh, from).pixels.iter().filter(|p| p.g < 0.25).count();
    for (name, mesh) in sheets {
        let away = reversed(mesh.clone());
        let shown = [red(&mesh, ABOVE), red(&away, BELOW)];
        let hidden = [red(&mesh, BELOW), red(&away, ABOVE)];
        let what = || format!("{name}: fronts in {shown:?} pixels, backs in {hidden:?}");
        all.holds(shown[0] > 40 && shown[1] > 20 && hidden == [0, 0], what);
    }
}

/// A single triangle is like a mesh of one.
#[test]
fn triangle_shapes_have_the_side_of_their_winding() {
    let mut all = Relations::default();
    let vertices = [Vec3::new(-1.0, 0.0, 1.0), Vec3::new(1.0, 0.0, 1.0), Vec3::new(0.0, 0.0, -1.0)];
    for (name, normal) in [("none", None), ("up", Some(Vec3::Y)), ("down", Some(-Vec3::Y))] {
        for (from, visible) in [(ABOVE, true), (BELOW, false)] {
            let mut world = stage::world(Transport::Path, 8, 16);
            camera(&mut world, from, [0.0, 0.0, 0.0], 0.3);
            let shape = Shape::Triangle {
                vertices: vertices.map(|v| v.as_dvec3()),
                normals: normal.map(|n| [n; 3]),
                uvs: None,
            };
            place(&mut world, shape, front_lamp(1.0, |_| ()), Transform::IDENTITY);
            let seen = Seen::of(&world).mean();
            all.holds((seen > 0.1) == visible, || format!("normals {name}, from {from:?}: {seen}"));
        }
    }
}

/// A mesh that shows its colour in any light.
fn front(mesh: &Mesh, from: [f32; 3]) -> Seen {
    let mut world = stage::world(Transport::Path, 16, 16);
    world.settings.background = Background::Constant(Rgb::splat(0.5));
    camera(&mut world, from, [0.0, 0.3, 0.0], 0.7);
    let unlit =
        principled(|m| (m.unlit, m.base_color) = (true, ColorInput::Constant(Rgb::new(1.0, 0.2, 0.1))));
    place_mesh(&mut world, mesh.clone(), unlit, Transform::IDENTITY);
    Seen::of(&world)
}

/// Mirroring transforms, as copies and as instances, keep the front.
#[test]
fn mirrored_meshes_keep_their_front() {
    let mut all = Relations::default();
    let mirrors = [Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, 1.0, -1.0), Vec3::new(-1.0, 1.0, -1.0)];
    let cases = [
        ("shell", stage::shell(), ABOVE, true),
        ("shell", stage::shell(), BELOW, false),
        ("flat", stage::floor(1.0, 0.0), ABOVE, true),
        ("flat", stage::floor(1.0, 0.0), BELOW, false),
        ("turned normals", turned_normals(stage::shell()), ABOVE, true),
        ("turned normals", turned_normals(stage::shell()), BELOW, false),
    ];
    for scale in mirrors {
        for instances in [false, true] {
            for (name, mesh, from, visible) in &cases {
                let mut world = stage::world(Transport::Path, 16, 16);
                camera(&mut world, *from, [0.0, 0.3, 0.0], 0.7);
                let transform = stage::affine(Mat4::from_scale(scale));
                place_mesh(&mut world, mesh.clone(), front_lamp(1.0, |_| ()), transform);
                if instances {
                    stage::as_instances(&mut world);
                }
                let seen = Seen::of(&world).mean();
                let what = || format!("{name} by {scale}, instances {instances}, from {from:?}: {seen}");
                all.holds((seen > 0.1) == *visible, what);
            }
        }
    }
}

/// A floor below an emitter that is out of view.
fn under(mesh: Mesh, scale: Vec3, instances: bool) -> World {
    let mut world = stage::world(Transport::Path, 8, 1024);
    world.settings.max_depth = 1;
    camera(&mut world, [0.0, 1.0, 0.0], [0.0, 0.0, 0.0], 1.0);
    place_mesh(&mut world, stage::floor(4.0, 0.0), stage::matte(0.6), Transform::IDENTITY);
    let turn = Mat4::from_quat(Quat::from_rotation_z(std::f32::consts::PI));
    let down = Mat4::from_translation(Vec3::new(0.0, 2.0, 0.0)) * turn * Mat4::from_scale(scale);
    place_mesh(&mut world, mesh, front_lamp(4.0, |_| ()), stage::affine(down));
    if instances {
        stage::as_instances(&mut world);
    }
    world
}

/// A single-sided emitter lights what its front faces, whatever its normals and mirroring; by light sampling as well as
/// by hits.
#[test]
fn single_sided_emitters_emit_from_their_front() {
    let mut all = Relations::default();
    let (plain, mirror) = (Vec3::ONE, Vec3::new(1.0, 1.0, -1.0));
    let flat = || stage::floor(1.0, 0.0);
    let meshes =
        [("flat", flat()), ("smooth", stage::shell()), ("turned normals", turned_normals(stage::shell()))];
    for instances in [false, true] {
        for (name, mesh) in &meshes {
            let base = if *name == "flat" { flat() } else { stage::shell() };
            for (scale, how) in [(plain, "as it is"), (mirror, "mirrored")] {
                let what = |way: &str| format!("{name}, {how}, instances {instances}, {way}");
                // Modelled in the mirrored position.
                let by_hand = stage::baked(&base, Mat4::from_scale(scale));
                let expected = Seen::found(&under(by_hand, plain, false));
                let world = under(mesh.clone(), scale, instances);
                all.same(&Seen::of(&world), &expected, &what("sampled"));
                all.same(&Seen::found(&world), &expected, &what("found"));
                let away = under(reversed(mesh.clone()), scale, instances);
                all.dark(&Seen::of(&away), &what("away, sampled"));
                all.dark(&Seen::found(&away), &what("away, found"));
            }
        }
    }
}

/// Shapes that emit outwards are dark inside, by light sampling and by hits; spheres as well as meshes.
#[test]
fn shapes_that_emit_outwards_are_dark_inside() {
    let mut all = Relations::default();
    let within = |shape: Option<Transform>, change: fn(&mut rayfront::world::Principled)| {
        let mut world = stage::world(Transport::Path, 8, 64);
        camera(&mut world, [0.0, 1.0, 0.0], [0.0, 0.0, 0.0], 1.0);
        place_mesh(&mut world, stage::floor(1.0, 0.0), stage::matte(0.6), Transform::IDENTITY);
        match shape {
            Some(transform) => {
                place(&mut world, Shape::Sphere { radius_m: 3.0 }, front_lamp(1.0, change), transform)
            }
            None => {
                let transform = stage::affine(Mat4::from_scale(Vec3::splat(3.0)));
                place_mesh(&mut world, stage::ball(2), front_lamp(1.0, change), transform);
            }
        }
        world
    };
    let mirror = stage::affine(Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)));
    let stretched = stage::affine(Mat4::from_scale(Vec3::new(1.0, 1.1, 1.0)));
    // The last one is a mesh.
    let shapes = [Some(Transform::IDENTITY), Some(mirror), Some(stretched), None];
    for (place, shape) in shapes.into_iter().enumerate() {
        all.dark(&Seen::of(&within(shape, |_| ())), &format!("shape {place}, sampled"));
        all.dark(&Seen::found(&within(shape, |_| ())), &format!("shape {place}, found"));
        let bright = within(shape, |m| m.double_sided = true);
        all.is(&Seen::of(&bright), 0.6, &format!("shape {place}, two sides"));
    }
}

/// A plane has no front: it is visible from both sides with any material.
#[test]
fn planes_are_visible_from_both_sides() {
    let mut all = Relations::default();
    let seen = |from: f32, shape: Shape, transport: Transport, double_sided: bool| {
        let mut world = stage::world(transport, 16, 16);
        world.settings.background = Background::Constant(Rgb::splat(0.1));
        camera(&mut world, [0.0, 0.0, from], [0.0, 0.0, 0.0], 0.8);
        let picture = ColorInput::Texture(stage::paint(&mut world.assets));
        let shown = principled(|m| {
            (m.base_color, m.emission, m.double_sided) = (grey(0.0), picture, double_sided);
            m.specular = number(0.0);
        });
        place(&mut world, shape, shown, Transform::IDENTITY);
        Seen::of(&world)
    };
    let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
    for transport in stage::BOTH {
        for from in [2.5, -2.5] {
            let plane = seen(from, Shape::Plane { corners: corners.map(|c| c.as_dvec3()) }, transport, false);
            let both_sides =
                seen(from, Shape::Plane { corners: corners.map(|c| c.as_dvec3()) }, transport, true);
            all.equal(&plane, &both_sides, &format!("{transport:?}, from {from}"));
            all.holds(plane.pixels.iter().any(|p| p.r > 0.2), || "nothing is there".into());
        }
    }
}
