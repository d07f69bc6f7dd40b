//! A light contributes equally by light sampling, by sampled directions that hit it, and by both.

use rayfront::math::{Mat4, Quat, Rgb, Vec2, Vec3};
use rayfront::world::{
    Background, BlinnPhong, ColorInput, Light, Material, Mesh, Principled, Shape, Transform, Transport,
    Volume, World,
};

use super::stage::{self, camera, front_lamp, lamp, number, place, place_mesh, principled};
use super::{Relations, Seen};

/// An object on a floor, close below a light that is out of view.
fn scene(subject: Mesh, material: Material, size: u32, samples: u32) -> World {
    let mut world = stage::world(Transport::Path, size, samples);
    world.settings.max_depth = 2;
    camera(&mut world, [0.5, 1.2, 2.2], [0.0, 0.1, 0.0], 0.9);
    place_mesh(&mut world, stage::floor(3.0, -0.5), stage::matte(0.5), Transform::IDENTITY);
    place_mesh(&mut world, subject, material, Transform::IDENTITY);
    world
}

/// Every material under a single-sided emitter and an emissive sphere.
#[test]
fn materials_are_lit_alike_by_light_sampling_and_hits() {
    let mut all = Relations::default();
    for (index, name) in stage::names().into_iter().enumerate() {
        let mut world = scene(Mesh::default(), stage::matte(0.0), 12, 3072);
        let material = stage::material(&mut world.assets, index);
        place_mesh(&mut world, stage::shell(), material, Transform::IDENTITY);
        let above = stage::affine(Mat4::from_translation(Vec3::new(0.2, 0.0, -0.2)));
        place_mesh(&mut world, stage::ceiling(1.2, 1.6), front_lamp(3.0, |_| ()), above);
        place(&mut world, Shape::Sphere { radius_m: 0.5 }, lamp(4.0), stage::at(-1.8, 0.6, 0.0));
        all.same(&Seen::of(&world), &Seen::found(&world), name);
    }
}

/// Emitters of all shapes, placed once and as instances, single-sided and double-sided.
#[test]
fn emitters_of_all_shapes_are_sampled_consistently() {
    let mut all = Relations::default();
    let (one, two) = (|_: &mut Principled| (), |m: &mut Principled| m.double_sided = true);
    let turn = Quat::from_rotation_x(2.8) * Quat::from_rotation_z(0.3);
    let above = Mat4::from_translation(Vec3::new(0.1, 1.8, 0.2)) * Mat4::from_quat(turn);
    let mirrored = above * Mat4::from_scale(Vec3::new(-1.2, 1.0, 0.8));
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| Vec3::new(x, 0.0, z));
    let vertices = [Vec3::new(-1.9, 0.0, 1.9), Vec3::new(1.9, 0.0, 1.9), Vec3::new(0.0, 0.0, -1.9)];
    let flat = stage::floor(1.0, 0.0);
    for (side, material) in [("one", front_lamp(5.0, one)), ("two", front_lamp(5.0, two))] {
        for (how, matrix) in [("turned", above), ("mirrored", mirrored)] {
            for instances in [false, true] {
                for name in ["quad", "shell", "sphere", "plane", "triangle"] {
                    let mut world = scene(stage::shell(), stage::matte(0.7), 8, 2048);
                    let shape = match name {
                        "quad" => Shape::Mesh(world.assets.add_mesh(flat.clone())),
                        "shell" => Shape::Mesh(world.assets.add_mesh(stage::shell())),
                        "sphere" => Shape::Sphere { radius_m: 0.7 },
                        "plane" => Shape::Plane { corners: corners.map(|c| c.as_dvec3()) },
                        _ => Shape::Triangle {
                            vertices: vertices.map(|v| v.as_dvec3()),
                            normals: None,
                            uvs: None,
                        },
                    };
                    // Something visible where the emitter faces away.
                    world.settings.background = Background::Constant(Rgb::splat(0.15));
                    place(&mut world, shape, material.clone(), stage::affine(matrix));
                    if instances {
                        stage::as_instances(&mut world);
                    }
                    let what = format!("{name}, {side} side, {how}, instances {instances}");
                    all.same(&Seen::of(&world), &Seen::found(&world), &what);
                }
            }
        }
    }
}

/// An area light without a surface, one with a surface, and a sheet with the same emission.
#[test]
fn area_light_equals_an_emissive_sheet() {
    let mut all = Relations::default();
    let (radiance, side) = (3.0, 1.6);
    // A third of the light is given as radiance.
    let under = |visible: Option<bool>| {
        let mut world = scene(stage::shell(), principled(|m| m.roughness = number(0.4)), 12, 1024);
        if let Some(visible) = visible {
            let power_w = Rgb::splat(std::f32::consts::PI * side * side * radiance * 2.0 / 3.0);
            let size_m = Vec2::splat(side);
            let light = Light::Area {
                power_w,
                radiance: Rgb::splat(radiance / 3.0),
                size_m,
                outline: Default::default(),
                samples: 1,
                pattern: Default::default(),
                visible,
            };
            world.entities.spawn((light, stage::looking([0.1, 1.7, 0.0], [0.1, 0.0, 0.0])));
        } else {
            let place = stage::at(0.1, 0.0, 0.0);
            place_mesh(&mut world, stage::ceiling(side / 2.0, 1.7), front_lamp(radiance, |_| ()), place);
        }
        world
    };
    // Rays cannot hit a light without a surface, so it is compared by direct light only.
    let sheet = Seen::of(&under(None));
    all.same(&Seen::of(&under(Some(true))), &sheet, "visible");
    all.same(&Seen::found(&under(None)), &sheet, "found");
    let direct = |mut world: World| {
        world.settings.max_depth = 0;
        Seen::of(&world)
    };
    all.same(&direct(under(Some(false))), &direct(under(None)), "without a surface");
}

/// An absorbing body around a floor and an emitter.
fn within(ior: f32, roughness: f32, volume: Option<Volume>, sphere_lamp: bool) -> World {
    let mut world = stage::world(Transport::Path, 8, 1024);
    world.settings.max_depth = 6;
    camera(&mut world, [0.0, 0.8, 6.0], [0.0, 0.0, 0.0], 0.25);
    let body = principled(|m| {
        (m.transmission, m.roughness, m.ior, m.volume) = (number(1.0), number(roughness), ior, volume);
    });
    place(&mut world, Shape::Sphere { radius_m: 3.0 }, body, Transform::IDENTITY);
    place_mesh(&mut world, stage::floor(1.8, -0.6), stage::matte(0.7), Transform::IDENTITY);
    if sphere_lamp {
        place(&mut world, Shape::Sphere { radius_m: 0.7 }, lamp(4.0), stage::at(0.0, 1.4, 0.0));
    } else {
        place_mesh(&mut world, stage::ceiling(1.0, 1.4), front_lamp(4.0, |_| ()), Transform::IDENTITY);
    }
    world
}

/// Light is absorbed on its way through a body, however it is found.
#[test]
fn absorption_within_bodies_applies_to_sampled_and_hit_lights() {
    let mut all = Relations::default();
    let half =
        Volume { attenuation_color: Rgb::new(0.5, 0.4, 0.6), attenuation_distance: 1.0, ..Volume::default() };
    for sphere_lamp in [false, true] {
        for ior in [1.0, 1.2] {
            let mut world = within(ior, 0.0, Some(half), sphere_lamp);
            world.settings.samples *= 4;
            let what = format!("ior {ior}, ball {sphere_lamp}");
            all.same(&Seen::of(&world), &Seen::found(&world), &what);
        }
    }
}

/// The transmittance of a metre is the square of that of half a metre.
#[test]
fn absorption_depends_on_distance_only() {
    let mut all = Relations::default();
    let whole = Volume {
        attenuation_color: Rgb::new(0.25, 0.16, 0.36),
        attenuation_distance: 2.0,
        ..Volume::default()
    };
    let half =
        Volume { attenuation_color: Rgb::new(0.5, 0.4, 0.6), attenuation_distance: 1.0, ..Volume::default() };
    let [a, b] = [whole, half].map(|volume| Seen::of(&within(1.1, 0.0, Some(volume), false)));
    all.same(&a, &b, "the same body");
    let clear = Volume { attenuation_color: Rgb::WHITE, attenuation_distance: 1.0, ..Volume::default() };
    let never = Volume {
        attenuation_color: Rgb::splat(0.1),
        attenuation_distance: f32::INFINITY,
        ..Volume::default()
    };
    let [a, b] = [clear, never].map(|volume| Seen::of(&within(1.1, 0.0, Some(volume), true)));
    all.same(&a, &b, "clear bodies");
}

/// Textured emission counts where it is: textured emitters of both material models.
#[test]
fn textured_emitters_are_sampled_consistently() {
    let mut all = Relations::default();
    for classic in [false, true] {
        for sphere in [false, true] {
            let mut world = scene(stage::shell(), stage::matte(0.7), 10, 1024);
            let paint = ColorInput::Texture(stage::paint(&mut world.assets));
            let material = if classic {
                let dark = ColorInput::default();
                Material::BlinnPhong(BlinnPhong { diffuse: dark, emission: paint, ..BlinnPhong::default() })
            } else {
                front_lamp(1.0, |m| m.emission = paint)
            };
            if sphere {
                place(&mut world, Shape::Sphere { radius_m: 0.8 }, material, stage::at(0.2, 1.8, 0.0));
            } else {
                place_mesh(&mut world, stage::ceiling(1.2, 1.6), material, Transform::IDENTITY);
            }
            all.same(&Seen::of(&world), &Seen::found(&world), &format!("classic {classic}, sphere {sphere}"));
        }
    }
}
