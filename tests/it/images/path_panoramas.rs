//! Orientation of panoramas under the path transport, as a background and as a light.

use std::f32::consts::FRAC_PI_2;

use rayfront::math::{Quat, Rgb, Vec3};
use rayfront::world::{Camera, Light, Material, Shape, World};

use super::near;
use super::path_textures::{POINT, UPRIGHT, matte, placed, quad, same, seen, stage, texture};
use crate::support::Picture;

const PANORAMA: [usize; 2] = [8, 4];

/// The direction of a point in a panorama: its centre is at −Z, its top at +Y, its right at +X.
fn direction(u: f64, v: f64) -> Vec3 {
    let (turn, polar) = ((u - 0.5) * std::f64::consts::TAU, v * std::f64::consts::PI);
    let ring = libm::sin(polar);
    Vec3::new((ring * libm::sin(turn)) as f32, libm::cos(polar) as f32, (-ring * libm::cos(turn)) as f32)
}

/// A world within a panorama.
fn surrounded(samples: u32, rotation: Quat, texels: &[[f32; 3]]) -> World {
    let mut world = stage(samples);
    let [width, height] = PANORAMA.map(|side| side as u32);
    let image = texture(&mut world, [width, height], texels.to_vec()).image();
    let light = Light::Environment { radiance: Rgb::splat(2.0), image };
    world.entities.spawn((light, placed(Vec3::ONE, rotation, 1.0)));
    world
}

fn rotations() -> [Quat; 4] {
    let both = Quat::from_rotation_y(2.0) * Quat::from_rotation_x(0.7);
    [Quat::IDENTITY, Quat::from_rotation_y(FRAC_PI_2), Quat::from_rotation_x(-0.5), both]
}

#[test]
fn panoramas_have_the_documented_orientation() {
    let [width, height] = PANORAMA;
    let texels: Vec<_> = (0..width * height).map(|i| [(i % width) as f32, (i / width) as f32, 1.0]).collect();
    for rotation in rotations() {
        for (i, [r, g, b]) in texels.iter().enumerate() {
            let (u, v) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            let towards = rotation * direction(u / width as f64, v / height as f64);
            let mut world = surrounded(1, rotation, &texels);
            let eye = placed(Vec3::ZERO, Quat::from_rotation_arc(-Vec3::Z, towards), 1.0);
            world.entities.spawn((Camera::Pinhole { vertical_fov: 1e-5 }, eye));
            let found = Picture::of(&world).at(0, 0).to_array().map(f64::from);
            same(found, [*r, *g, *b].map(|c| 2.0 * f64::from(c)), 1e-2);
        }
    }
}

#[test]
fn panoramas_emit_from_where_they_are_visible() {
    let [width, height] = PANORAMA;
    let mut texels = vec![[0.02; 3]; width * height];
    texels[width + 5] = [5.0; 3];
    let at = |column: i64, row: i64| {
        let row = row.clamp(0, height as i64 - 1) as usize;
        f64::from(texels[row * width + column.rem_euclid(width as i64) as usize][0])
    };
    // Texels are interpolated.
    let radiance = |u: f64, v: f64| {
        let (x, y) = (u * width as f64 - 0.5, v * height as f64 - 0.5);
        let (column, row) = (x.floor(), y.floor());
        let (wx, wy, column, row) = (x - column, y - row, column as i64, row as i64);
        let line = |row| at(column, row) * (1.0 - wx) + at(column + 1, row) * wx;
        2.0 * (line(row) * (1.0 - wy) + line(row + 1) * wy)
    };
    for rotation in rotations() {
        let (columns, rows) = (512, 256);
        let mut expected = 0.0;
        for i in 0..columns * rows {
            let u = (f64::from(i % columns) + 0.5) / f64::from(columns);
            let v = (f64::from(i / columns) + 0.5) / f64::from(rows);
            let cos = f64::from((rotation * direction(u, v)).z).max(0.0);
            expected += radiance(u, v) * cos * libm::sin(v * std::f64::consts::PI);
        }
        // Each texel has 2π² sin θ steradians, divided by π.
        expected *= 2.0 * std::f64::consts::PI / f64::from(columns * rows);
        let mut world = surrounded(1024, rotation, &texels);
        let material = world.assets.add_material(None, Material::Principled(Box::new(matte())));
        let mesh = world.assets.add_mesh(quad(UPRIGHT));
        world.entities.spawn((Shape::Mesh(mesh), material));
        near(seen(world, [0.0; 2], POINT)[0], expected, 0.02);
    }
}
