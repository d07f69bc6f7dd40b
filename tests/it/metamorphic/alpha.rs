//! A partly transparent surface transmits the rest, for camera rays, for shadow rays, and for its own emission.

use rayfront::math::{DVec3, Mat4, Quat, Rgb, Vec3};
use rayfront::world::{
    AlphaMode, Background, Channel, Mesh, Principled, ScalarInput, Shape, Transform, Transport, World,
};

use super::stage::{self, at, camera, front_lamp, number, place, place_mesh, veil};
use super::{Relations, Seen};

/// A white background, viewed along −Z.
fn window(samples: u32) -> World {
    let mut world = stage::world(Transport::Path, 8, samples);
    world.settings.background = Background::Constant(Rgb::WHITE);
    world.settings.max_depth = 8;
    camera(&mut world, [0.0, 0.0, 5.0], [0.0, 0.0, 0.0], 0.25);
    world
}

/// Sheets across the view, as copies or instances of one mesh, as separate meshes, or joined in one mesh.
fn sheets(world: &mut World, alpha: f32, count: u32, way: &str, apart: f32) {
    let sheet = |z: f32| stage::quad([-3.0, -3.0, z], [6.0, 0.0, 0.0], [0.0, 6.0, 0.0]);
    let material = stage::add(world, &veil(alpha));
    world.settings.copied_triangles = if way == "instances" { 0 } else { 1 << 18 };
    let depths = (0..count).map(|i| -apart * i as f32);
    match way {
        "instances" | "copies" => {
            let mesh = world.assets.add_mesh(sheet(0.0));
            for z in depths {
                world.entities.spawn((Shape::Mesh(mesh), material, at(0.0, 0.0, z)));
            }
        }
        "apart" => {
            for z in depths {
                let mesh = world.assets.add_mesh(sheet(z));
                world.entities.spawn((Shape::Mesh(mesh), material, Transform::IDENTITY));
            }
        }
        _ => {
            let all = depths.fold(Mesh::default(), |all, z| stage::joined(all, &sheet(z)));
            let mesh = world.assets.add_mesh(all);
            world.entities.spawn((Shape::Mesh(mesh), material, Transform::IDENTITY));
        }
    }
}

/// The transmittances of successive sheets multiply.
#[test]
fn transmittances_of_sheets_multiply_for_any_placement() {
    let mut all = Relations::default();
    for way in ["instances", "copies", "apart", "one mesh"] {
        for (alpha, count) in [(0.5, 4), (0.2, 6)] {
            let mut world = window(1024);
            sheets(&mut world, alpha, count, way, 0.25);
            let expected = (1.0 - alpha as f64).powi(count as i32);
            all.is(&Seen::of(&world), expected, &format!("{way}, {count} of {alpha}"));
        }
    }
}

/// Both walls of a hollow sphere, ellipsoid or mesh attenuate.
#[test]
fn both_walls_of_hollow_shapes_attenuate() {
    let mut all = Relations::default();
    let stretched = Transform::Trs {
        translation: DVec3::ZERO,
        rotation: Quat::IDENTITY,
        scale: Vec3::new(1.0, 1.2, 0.8),
    };
    for (name, transform) in [("sphere", Transform::IDENTITY), ("ellipsoid", stretched)] {
        let mut world = window(1024);
        place(&mut world, Shape::Sphere { radius_m: 2.0 }, veil(0.5), transform);
        all.is(&Seen::of(&world), 0.25, name);
    }
    for copied in [0, 1 << 18] {
        let mut world = window(1024);
        let material = stage::add(&mut world, &veil(0.5));
        let mesh = world.assets.add_mesh(stage::ball(2));
        for radius in [1.0, 2.0] {
            let transform = stage::affine(Mat4::from_scale(Vec3::splat(radius)));
            world.entities.spawn((Shape::Mesh(mesh), material, transform));
        }
        world.settings.copied_triangles = copied;
        all.is(&Seen::of(&world), 0.0625, &format!("two balls, {copied} copied"));
    }
}

/// Sheets attenuate shadow rays as much as camera rays.
#[test]
fn shadow_transmittances_of_sheets_multiply() {
    let mut all = Relations::default();
    let lit = |count: u32, way: &str| {
        let mut world = stage::world(Transport::Path, 4, 1024);
        world.settings.max_depth = 0;
        camera(&mut world, [0.0, 0.0, -3.0], [0.0, 0.0, -5.0], 0.3);
        let wall = stage::quad([-3.0, -3.0, -5.0], [6.0, 0.0, 0.0], [0.0, 6.0, 0.0]);
        place_mesh(&mut world, wall, stage::matte(0.8), Transform::IDENTITY);
        sheets(&mut world, 0.5, count, way, 0.25);
        world.entities.spawn((stage::point_light(1000.0), at(0.0, 0.0, 1.0)));
        Seen::of(&world)
    };
    for way in ["instances", "copies", "apart", "one mesh"] {
        let open = lit(0, way);
        all.is(&lit(4, way), open.mean() / 16.0, way);
    }
}

/// A floor under a square that emits downwards, with a change to its material.
fn under(change: impl FnOnce(&mut Principled)) -> World {
    let mut world = stage::world(Transport::Path, 8, 4096);
    world.settings.max_depth = 1;
    camera(&mut world, [0.0, 1.5, 0.0], [0.0, 0.0, 0.0], 1.0);
    place_mesh(&mut world, stage::floor(4.0, 0.0), stage::matte(0.6), Transform::IDENTITY);
    place_mesh(&mut world, stage::ceiling(1.0, 2.0), front_lamp(4.0, change), Transform::IDENTITY);
    world
}

/// Emitters with alpha 0 emit nothing.
#[test]
fn emitters_with_alpha_zero_emit_nothing() {
    let mut all = Relations::default();
    for mode in [AlphaMode::Blend, AlphaMode::Mask { cutoff: 0.5 }] {
        let world = under(|m| (m.alpha, m.alpha_mode) = (number(0.0), mode));
        all.dark(&Seen::of(&world), &format!("{mode:?}, sampled"));
        all.dark(&Seen::found(&world), &format!("{mode:?}, found"));
    }
}

/// A partly transparent emitter emits that part of its light.
#[test]
fn alpha_scales_the_emission() {
    let mut all = Relations::default();
    let whole = Seen::of(&under(|_| ()));
    for alpha in [0.25, 0.75] {
        let world = under(|m| (m.alpha, m.alpha_mode) = (number(alpha), AlphaMode::Blend));
        all.same(&Seen::of(&world), &whole.times(alpha), &format!("sampled, {alpha}"));
        all.same(&Seen::found(&world), &whole.times(alpha), &format!("found, {alpha}"));
    }
    let masked = |alpha: f32| {
        let mode = AlphaMode::Mask { cutoff: 0.5 };
        Seen::of(&under(|m| (m.alpha, m.alpha_mode, m.double_sided) = (number(alpha), mode, true)))
    };
    all.same(&masked(0.6), &whole, "above the cutoff");
    all.dark(&masked(0.4), "below the cutoff");
}

/// Alpha from a texture, from vertices and from the factor applies to light sampling as to rays that hit the emitter.
#[test]
fn emitters_with_alpha_textures_are_sampled_consistently() {
    let mut all = Relations::default();
    for mode in [AlphaMode::Blend, AlphaMode::Mask { cutoff: 0.5 }] {
        let mut world = under(|_| ());
        let holes = stage::holes(&mut world.assets);
        for named in &mut world.assets.materials {
            if let rayfront::world::Material::Principled(m) = &mut named.material {
                m.alpha = ScalarInput { factor: 0.9, texture: Some((holes, Channel::Red)) };
                m.alpha_mode = mode;
            }
        }
        all.same(&Seen::of(&world), &Seen::found(&world), &format!("holes, {mode:?}"));
    }
    let mut world = under(|m| m.alpha_mode = AlphaMode::Blend);
    let lamp = world.assets.meshes.last_mut().expect("the lamp");
    std::sync::Arc::make_mut(lamp).alphas = vec![0.0, 0.1, 0.3, 1.0];
    all.same(&Seen::of(&world), &Seen::found(&world), "alphas of vertices");
}
