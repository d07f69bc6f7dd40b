use super::*;
use crate::film::sums::QUANTUM;
use crate::integrator::path::bounces::LobeKind;
use crate::math::{DVec3, Quat, Rgb, Vec3};
use crate::world::{BlinnPhong, Camera, ColorInput, Falloff, Light, Material, Name, Shape, Transform};

/// A glass ball in front of a wall with the default material.
fn world() -> World {
    let mut world = World::default();
    world.settings.size = [9, 9];
    world.settings.samples = 3;
    world.settings.max_depth = 2;
    let at = |x, y, z| Transform::Trs {
        translation: DVec3::new(x, y, z),
        rotation: Quat::IDENTITY,
        scale: Vec3::ONE,
    };
    world.entities.spawn((Camera::Pinhole { vertical_fov: 0.5 }, at(0.0, 0.0, 5.0)));
    let glass = BlinnPhong { ior: Some(1.5), kr: ColorInput::Constant(Rgb::WHITE), ..BlinnPhong::default() };
    let glass = world.assets.add_material(Some("glass".into()), Material::BlinnPhong(glass));
    world.entities.spawn((Name("ball".into()), Shape::Sphere { radius_m: 0.3 }, Transform::IDENTITY, glass));
    let corner = |x: f64, y: f64| DVec3::new(4.0 * x, 4.0 * y, -2.0);
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    world.entities.spawn((Name("wall".into()), Shape::Plane { corners }, Transform::IDENTITY));
    let lamp = Light::Point { power_w: Rgb::splat(300.0), falloff: Falloff::InverseSquare, radius_m: 0.0 };
    world.entities.spawn((Name("lamp".into()), lamp, at(2.0, 3.0, 4.0)));
    world
}

fn explained(pixel: [u32; 2]) -> (Vec<SampleTrace>, Film) {
    explained_of(&world(), pixel)
}

fn explained_of(world: &World, pixel: [u32; 2]) -> (Vec<SampleTrace>, Film) {
    let scene = crate::compile::compile(world, None).unwrap();
    let setup = Arc::new(crate::render::setup(scene, &world.settings));
    explain(setup, &GivenNames::new(world), pixel, 0..3)
}

#[test]
fn wall_is_lit_by_the_light_and_ends_the_path() {
    let (lives, _) = explained([0, 4]);
    assert_eq!(lives.iter().map(|life| life.sample).collect::<Vec<_>>(), [0, 1, 2]);
    for life in &lives {
        let [path] = &life.paths[..] else { panic!("{life:?}") };
        assert_eq!((path.branch, path.from, path.why), (0, None, Why::Surface));
        let [step] = &path.steps[..] else { panic!("{path:?}") };
        let vertex = step.vertex.as_ref().expect("the wall");
        assert_eq!((step.queue, vertex.entity.as_str()), ("camera", "wall"));
        assert_eq!((vertex.lights.len(), vertex.lights[0].light.as_str()), (1, "lamp"));
        assert!((vertex.position[2] + 2.0).abs() < 1e-4 && vertex.normal == [0.0, 0.0, 1.0]);
    }
}

#[test]
fn paths_forked_at_glass_add_up_to_the_pixel() {
    let (lives, film) = explained([4, 4]);
    let life = &lives[0];
    assert!(life.paths.len() >= 3, "{life:?}");
    assert_eq!(life.paths[0].steps[0].vertex.as_ref().map(|v| v.material.as_str()), Some("glass"));
    assert!(
        life.paths[1..].iter().all(|path| path.from.is_some_and(|(parent, _)| parent < life.paths.len()))
    );
    assert!(life.paths[1..].iter().all(|path| path.steps[0].queue == "refract"));
    assert!(life.paths.iter().any(|path| path.why == Why::Bounces));
    let sum: f64 = lives.iter().map(|life| f64::from(life.radiance()[1])).sum();
    let pixel = film.pixels()[0];
    let film_sum = (pixel.sum[0][1] + pixel.sum[1][1]) as f64 * QUANTUM;
    assert!((sum - film_sum).abs() < 1e-4 * film_sum, "{sum} {film_sum}");
}

fn path_traced(change: impl Fn(&mut World)) -> World {
    let mut world = world();
    world.settings.transport = Transport::Path;
    // Both emissive triangles become instances.
    world.settings.copied_triangles = 0;
    let emission = ColorInput::Constant(Rgb::splat(5.0));
    let glow = Material::BlinnPhong(BlinnPhong { emission, ..BlinnPhong::default() });
    let glow = world.assets.add_material(None, glow);
    let mesh = crate::world::Mesh {
        positions: vec![Vec3::new(-1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0), Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Default::default()
    };
    let mesh = world.assets.add_mesh(mesh);
    for (name, x) in [("left", -3.0), ("right", 3.0)] {
        let translation = Vec3::new(x, 0.0, 0.0);
        let place = Transform::Trs {
            translation: translation.as_dvec3(),
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
        };
        world.entities.spawn((Name(name.into()), Shape::Mesh(mesh), place, glow));
    }
    change(&mut world);
    world
}

fn sums(lives: &[SampleTrace], film: &Film) -> (f64, f64) {
    let sum = lives.iter().map(|life| f64::from(life.radiance()[1])).sum();
    let pixel = film.pixels()[0];
    (sum, (pixel.sum[0][1] + pixel.sum[1][1]) as f64 * QUANTUM)
}

/// Each emitter has its entity's name; emitters with a weight below 1 can also be hit by sampled directions.
#[test]
fn path_transport_records_normals_lobes_and_lights() {
    let mut seen = std::collections::BTreeSet::new();
    for pixel in (0..9).flat_map(|x| [[x, 0], [x, 8]]) {
        let (lives, film) = explained_of(&path_traced(|_| ()), pixel);
        let (sum, film) = sums(&lives, &film);
        assert!((sum - film).abs() < 1e-4 * film.max(1e-3), "{sum} {film}");
        for life in &lives {
            let [path] = &life.paths[..] else { panic!("{life:?}") };
            assert!(!matches!(path.why, Why::Surface | Why::Weak), "{path:?}");
            let wall = path.steps[0].vertex.as_ref().expect("the wall");
            assert_eq!((wall.entity.as_str(), wall.normal), ("wall", [0.0, 0.0, 1.0]));
            let drawn = PathEvent::Drawn { kind: LobeKind::Diffuse, through: false, exact: false };
            assert_eq!(wall.fate, Some(drawn));
            for lit in &wall.lights {
                seen.insert(lit.light.clone());
                assert_eq!(lit.share == 1.0, lit.light == "lamp", "{lit:?}");
                assert!(
                    lit.share > 0.0 && lit.arrived == if lit.blocked { [0.0; 3] } else { lit.contribution }
                );
            }
        }
    }
    assert_eq!(seen.into_iter().collect::<Vec<_>>(), ["lamp", "left", "right"]);
}

#[test]
fn path_transport_records_why_paths_end() {
    let why = |pixel, change: fn(&mut World)| {
        let (lives, _) = explained_of(&path_traced(change), pixel);
        // At glass a path may fork, and its reflection escape.
        let why = |life: &SampleTrace| {
            let all = life.paths.iter().map(|path| path.why);
            all.reduce(|first, other| if first == Why::Escaped { other } else { first })
        };
        lives.iter().filter_map(why).collect::<Vec<_>>()
    };
    let within = |change: fn(&mut World)| why([4, 4], change);
    let ends = within(|world| world.settings.depth_limits.transmission = Some(0));
    assert_eq!(ends, [Why::Limit(LobeKind::Transmission); 3]);
    assert_eq!(ends[0].name(), "transmission limit");
    assert_eq!(within(|world| world.settings.max_depth = 0), [Why::Bounces; 3]);
    let limits = |world: &mut World| world.settings.depth_limits.diffuse = Some(0);
    let ends = why([0, 0], limits);
    assert!(ends.iter().all(|why| matches!(why, Why::Escaped | Why::Limit(LobeKind::Diffuse))), "{ends:?}");
    let black = |world: &mut World| {
        let dark = BlinnPhong { diffuse: ColorInput::Constant(Rgb::BLACK), ..BlinnPhong::default() };
        let dark = world.assets.add_material(None, Material::BlinnPhong(dark));
        let wall = world.in_order()[2];
        world.entities.insert_one(wall, dark).unwrap();
    };
    assert!(why([0, 0], black).iter().all(|why| matches!(why, Why::Absorbed | Why::Black)));
    let unlit = |world: &mut World| {
        let flat = crate::world::Principled { unlit: true, ..Default::default() };
        let flat = world.assets.add_material(None, Material::Principled(Box::new(flat)));
        let wall = world.in_order()[2];
        world.entities.insert_one(wall, flat).unwrap();
    };
    assert_eq!(why([0, 0], unlit), [Why::Unlit; 3]);
}
