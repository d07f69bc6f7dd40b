//! Path reuse: equal means, less noise, and no effect with settings that disable it.

use rayfront::math::{Rgb, Vec3};
use rayfront::render::Options;
use rayfront::world::{
    AlphaMode, Background, BlinnPhong, Camera, ColorInput, Light, Material, PixelFilter, Principled,
    ScalarInput, Shape, Sharing, Transform, Transport, World,
};

use crate::support::{self, Picture, at, mean_rgb};

fn matte(color: [f32; 3]) -> Material {
    Material::BlinnPhong(BlinnPhong { diffuse: ColorInput::Constant(color.into()), ..BlinnPhong::default() })
}

fn principled(color: [f32; 3], change: impl Fn(&mut Principled)) -> Material {
    let mut material = Principled {
        base_color: ColorInput::Constant(color.into()),
        metallic: ScalarInput::constant(0.0),
        roughness: ScalarInput::constant(0.4),
        ..Principled::default()
    };
    change(&mut material);
    Material::Principled(Box::new(material))
}

/// The corner of a room with a ball in it and a light above, behind the camera.
fn room(size: u32, samples: u32, wall: &Material, ball: Material) -> World {
    let mut world = World::default();
    world.settings.size = [size, size];
    world.settings.samples = samples;
    world.settings.transport = Transport::Path;
    world.settings.filter = PixelFilter::Box;
    world.settings.max_depth = 3;
    world.settings.roulette_depth = None;
    world.entities.spawn((Camera::Pinhole { vertical_fov: 1.0 }, at(0.0, 0.0, 3.0)));
    let mut plane = |corners: [[f32; 3]; 4], material: Material| {
        let material = world.assets.add_material(None, material);
        let corners = corners.map(Vec3::from);
        world.entities.spawn((
            Shape::Plane { corners: corners.map(|c| c.as_dvec3()) },
            material,
            Transform::IDENTITY,
        ));
    };
    plane([[-2., -1., -2.], [-2., -1., 4.], [2., -1., 4.], [2., -1., -2.]], wall.clone());
    plane([[-2., -1., -2.], [2., -1., -2.], [2., 2., -2.], [-2., 2., -2.]], wall.clone());
    plane([[-2., -1., 4.], [-2., -1., -2.], [-2., 2., -2.], [-2., 2., 4.]], matte([0.7, 0.1, 0.1]));
    let ball = world.assets.add_material(None, ball);
    world.entities.spawn((Shape::Sphere { radius_m: 0.6 }, ball, at(-0.6, -0.4, -0.8)));
    let lamp = Light::Point {
        power_w: Rgb::new(60.0, 50.0, 40.0),
        falloff: rayfront::world::Falloff::InverseSquare,
        radius_m: 0.0,
    };
    world.entities.spawn((lamp, at(1.2, 1.5, 0.5)));
    world
}

/// Mean and standard error, over seeds, of the images' means.
fn mean(world: &mut World, sharing: Sharing, seeds: u64) -> [(f64, f64); 3] {
    world.settings.sharing = sharing;
    let mut all = Vec::new();
    for seed in 0..seeds {
        world.settings.seed = seed + if sharing == Sharing::Off { 1000 } else { 0 };
        all.push(mean_rgb(&Picture::of(world)));
    }
    let count = seeds as f64;
    [0, 1, 2].map(|channel| {
        let mean = all.iter().map(|means| means[channel]).sum::<f64>() / count;
        let square = all.iter().map(|means| (means[channel] - mean).powi(2)).sum::<f64>();
        (mean, (square / (count - 1.0) / count).sqrt())
    })
}

fn check(name: &str, mut world: World) {
    let off = mean(&mut world, Sharing::Off, 24);
    for size in [4, 32] {
        let on = mean(&mut world, Sharing::Groups(size), 24);
        for ((on, on_error), (off, off_error)) in on.into_iter().zip(off) {
            let sigma = on_error.hypot(off_error);
            // Values that differ by rounding may not differ by more than noise.
            assert!((on - off).abs() < 4.0 * sigma + 1e-5, "{name}, {size}: {on} and {off} with {sigma}");
            assert!(on_error < 0.06 * on.max(0.01), "{name}: {on_error} is too much to find anything");
        }
    }
}

#[test]
fn path_reuse_does_not_change_the_mean() {
    let white = matte([0.7, 0.7, 0.7]);
    let plastic = principled([0.6, 0.5, 0.4], |_| ());
    let smooth = principled([0.6, 0.5, 0.4], |m| m.roughness = ScalarInput::constant(0.05));
    check("matte", room(24, 4, &white, white.clone()));
    check("plastic", room(24, 4, &plastic, plastic.clone()));
    check("smooth plastic", room(24, 4, &smooth, white.clone()));
    let half = principled([0.9, 0.6, 0.3], |m| m.metallic = ScalarInput::constant(0.5));
    check("half metal", room(24, 4, &plastic, half));
    let coated = principled([0.8, 0.2, 0.1], |m| {
        m.clearcoat = ScalarInput::constant(1.0);
        m.clearcoat_roughness = ScalarInput::constant(0.2);
    });
    check("coat", room(24, 4, &coated, coated.clone()));
    let glass = principled([1.0, 1.0, 1.0], |m| {
        m.transmission = ScalarInput::constant(1.0);
        m.roughness = ScalarInput::constant(0.3);
    });
    check("glass", room(24, 4, &white, glass));
    let blended = principled([0.7, 0.6, 0.5], |m| {
        m.alpha = ScalarInput::constant(0.5);
        m.alpha_mode = AlphaMode::Blend;
    });
    check("blended", room(24, 4, &blended, blended.clone()));
    let shining = principled([0.5, 0.5, 0.5], |m| m.emission = ColorInput::Constant(Rgb::new(2.0, 1.0, 0.5)));
    check("a ball that shines", room(24, 4, &plastic, shining));
    let mut open = room(24, 4, &plastic, white.clone());
    open.settings.background = Background::Gradient { bottom: Rgb::splat(0.2), top: Rgb::new(0.3, 0.6, 1.2) };
    check("sky", open);
}

#[test]
fn path_reuse_reduces_noise_between_matte_walls() {
    let error = |sharing: Sharing| {
        let mut world = room(64, 16, &matte([0.7, 0.7, 0.7]), matte([0.7, 0.7, 0.7]));
        world.settings.sharing = sharing;
        let film = support::film(&world, Options::default());
        world.settings.sharing = Sharing::Groups(32);
        world.settings.seed = 77;
        world.settings.samples = 512;
        let reference = support::film(&world, Options::default()).radiance();
        let squares = film.radiance().into_iter().zip(&reference).map(|(a, b)| {
            let (a, b) = (a.to_array(), b.to_array());
            (0..3).map(|c| f64::from((a[c] - b[c]) * (a[c] - b[c]) / (b[c] * b[c] + 0.01))).sum::<f64>()
        });
        squares.sum::<f64>()
    };
    let (off, some, many) = (error(Sharing::Off), error(Sharing::Groups(4)), error(Sharing::Groups(32)));
    // The point light's direct light is exact, so that all noise except at edges is in reused light.
    assert!(some < 0.6 * off && many < 0.35 * off, "{off} {some} {many}");
    let auto = error(Sharing::Auto);
    assert!(auto < 0.5 * off, "{off} {auto}");
}

#[test]
fn path_reuse_is_disabled_by_depth_limits_and_whitted() {
    let film = |sharing: Sharing, change: &dyn Fn(&mut World)| {
        let mut world = room(20, 2, &matte([0.7, 0.7, 0.7]), matte([0.7, 0.7, 0.7]));
        world.settings.sharing = sharing;
        change(&mut world);
        support::film(&world, Options::default()).hash()
    };
    let limited: &dyn Fn(&mut World) = &|world| world.settings.depth_limits.diffuse = Some(2);
    let whitted: &dyn Fn(&mut World) = &|world| world.settings.transport = Transport::Whitted;
    for change in [limited, whitted] {
        assert_eq!(film(Sharing::Groups(32), change), film(Sharing::Off, change));
    }
    for odd in [0, 1, 3, 1000] {
        let mut world = room(20, 2, &matte([0.7, 0.7, 0.7]), matte([0.7, 0.7, 0.7]));
        world.settings.sharing = Sharing::Groups(odd);
        let refused =
            rayfront::compile::compile(&world, None).expect_err("no group has that size").to_string();
        assert!(refused.contains("sharing"), "{refused}");
    }
    assert_ne!(film(Sharing::Groups(32), &|_| ()), film(Sharing::Off, &|_| ()));
    assert_ne!(film(Sharing::Groups(32), &|_| ()), film(Sharing::Groups(8), &|_| ()));
}

/// A clamp cuts off fireflies of reused paths, too, and nothing of what is darker.
#[test]
fn clamp_limits_what_reused_paths_bring() {
    let film = |sharing: Sharing, clamp: Option<f32>| {
        let mut world = room(20, 16, &matte([0.7, 0.7, 0.7]), matte([0.7, 0.7, 0.7]));
        (world.settings.sharing, world.settings.clamp) = (sharing, clamp);
        support::film(&world, Options::default())
    };
    let mean = |film: &rayfront::internals::film::Film| support::mean(&film.radiance());
    let shared = film(Sharing::Groups(32), None);
    assert_ne!(shared.hash(), film(Sharing::Off, None).hash());
    assert_eq!(shared.hash(), film(Sharing::Groups(32), Some(1e6)).hash(), "nothing is as bright");
    let brightest = shared.radiance().iter().map(|pixel| pixel.max_component()).fold(0.0, f32::max);
    let mut before = mean(&shared);
    for part in [0.1, 0.01, 0.001] {
        let limit = Some(part * brightest);
        let [alone, together] =
            [Sharing::Off, Sharing::Groups(32)].map(|sharing| mean(&film(sharing, limit)));
        assert!(together < before, "{part}: {together} {before}");
        // Where light reaches the first hit, it is not yet weakened by that.
        assert!(together > 0.97 * alone && together < 1.5 * alone, "{part}: {alone} {together}");
        before = together;
    }
}
