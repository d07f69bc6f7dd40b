//! Planted faults are found and located.

use std::sync::Arc;

use super::*;
use crate::integrator::Stage;
use crate::integrator::observe::EventKind;
use crate::math::{DVec3, Quat, Rgb, Vec3};
use crate::world::{BlinnPhong, Camera, ColorInput, Falloff, Light, Material, Shape, Transform, World};

/// A mirror ball on a floor.
fn world() -> World {
    let mut world = World::default();
    world.settings.size = [20, 20];
    world.settings.samples = 2;
    let at = |x, y, z| Transform::Trs {
        translation: DVec3::new(x, y, z),
        rotation: Quat::IDENTITY,
        scale: Vec3::ONE,
    };
    world.entities.spawn((Camera::Pinhole { vertical_fov: 0.8 }, at(0.0, 0.5, 5.0)));
    let grey = ColorInput::Constant(Rgb::splat(0.5));
    let mirror = Material::BlinnPhong(BlinnPhong { kr: grey, ..BlinnPhong::default() });
    let mirror = world.assets.add_material(None, mirror);
    world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, Transform::IDENTITY, mirror));
    let corner = |x: f64, z: f64| DVec3::new(4.0 * x, -1.0, 4.0 * z);
    let corners = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    world.entities.spawn((Shape::Plane { corners }, Transform::IDENTITY));
    let lamp = Light::Point { power_w: Rgb::splat(300.0), falloff: Falloff::InverseSquare, radius_m: 0.0 };
    world.entities.spawn((lamp, at(2.0, 3.0, 4.0)));
    world
}

fn setup(change: impl Fn(&mut RenderSetup)) -> Arc<RenderSetup> {
    let world = world();
    let scene = crate::compile::compile(&world, None).unwrap();
    let mut setup = crate::render::setup(scene, &world.settings);
    change(&mut setup);
    Arc::new(setup)
}

fn run(change: impl Fn(&mut RenderSetup), hits: fn(&Way) -> bool) -> Verification {
    let bench = Bench { setup: setup(|_| ()), samples: 2, fault: Some((setup(change), hits)) };
    bench.run(&ways(2), &mut |_| ()).unwrap()
}

#[test]
fn verify_finds_equal_films_in_all_ways() {
    let mut done = Vec::new();
    let found = verify(setup(|_| ()), 2, &ways(3), &mut |n| done.push(n)).unwrap();
    assert_eq!(found.outcomes.len(), 3 * 5 * Isa::available().len());
    assert_eq!((found.mismatches(), done.len()), (0, found.outcomes.len()));
    assert!(found.difference.is_none());
}

/// The change of each fault, and the stage and the bounce that show it first.
#[test]
fn verify_locates_planted_faults_by_stage_and_bounce() {
    type Change = fn(&mut RenderSetup);
    let faults: [(Change, Stage, u32); 6] = [
        (|setup| scene(setup).camera.origin.x += 1e-6, Stage::Generate, 0),
        (
            |setup| {
                let bvh = std::sync::Arc::make_mut(&mut scene(setup).bvh);
                bvh.spheres.iter_mut().for_each(|block| block.radius[0] *= 1.001);
            },
            Stage::Intersect,
            0,
        ),
        (|setup| Arc::make_mut(&mut scene(setup).geometry).spheres[0][0] += 1e-3, Stage::Shade, 0),
        (
            |setup| scene(setup).materials.iter_mut().for_each(|m| m.classic.kr.factor[1] *= 0.75),
            Stage::Shade,
            1,
        ),
        (
            |setup| scene(setup).materials.iter_mut().for_each(|m| m.classic.diffuse.factor[2] *= 0.75),
            Stage::Light,
            0,
        ),
        (|setup| setup.max_depth = 0, Stage::Shade, 0),
    ];
    for (number, (fault, stage, bounce)) in faults.into_iter().enumerate() {
        let found = run(fault, |way| way.schedule == Schedule::Wavefront && way.wave == 7);
        assert_eq!(found.mismatches(), 2 * Isa::available().len(), "fault {number}");
        let difference = found.difference.expect("a difference");
        assert_eq!(difference.sides[0].way.schedule, Schedule::Recursive);
        assert_eq!(difference.sides[1].way.wave, 7);
        assert_ne!(difference.sides[0].sum, difference.sides[1].sum);
        let first = difference.first.expect("something happened");
        assert_eq!((first.stage, first.place.depth), (stage, bounce), "fault {number}: {first:?}");
        assert_eq!(first.place.pixel, (difference.pixel[0], difference.pixel[1]));
    }
}

#[test]
fn verify_reports_a_missing_bounce_with_one_event() {
    let found = run(|setup| setup.max_depth = 0, |way| way.wave == 64);
    let first = found.difference.and_then(|difference| difference.first).expect("something");
    assert!(matches!(first.happened, [None, Some(EventKind::End { .. })]), "{first:?}");
}

/// Returns the setup's scene, to plant faults in.
fn scene(setup: &mut RenderSetup) -> &mut crate::scene::CompiledScene {
    Arc::get_mut(&mut setup.scene).expect("nobody else has it")
}
