//! Both schedules on whole images, and waves of several sizes: rays per second on one thread.

mod common;

use common::{Stage, glass, grey, look, matte};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rayfront::internals::integrator::{RenderSetup, Schedule, Sorting, Worker};
use rayfront::internals::simd::Isa;
use rayfront::math::{Quat, Rgb, Vec3};
use rayfront::world::{Background, BlinnPhong, Camera, Pattern, Shape, Transform};

const SIZE: [u32; 2] = [128, 96];
const SAMPLES: u32 = 4;

fn at(translation: Vec3) -> Transform {
    Transform::Trs { translation: translation.as_dvec3(), rotation: Quat::IDENTITY, scale: Vec3::ONE }
}

fn open_stage() -> Stage {
    let mut stage = Stage::new(SIZE, SAMPLES);
    stage.0.settings.background = Background::Gradient { bottom: Rgb::splat(0.1), top: Rgb::splat(0.6) };
    let checkers = stage.checkers(4.0);
    let floor = stage.material(matte(checkers));
    stage.ground(-1.0, floor);
    stage
}

/// A mesh of 70,000 triangles under three lights.
fn mesh() -> RenderSetup {
    let mut stage = open_stage();
    let shiny = stage.material(BlinnPhong { specular: grey(0.4), ..matte(grey(0.6)) });
    stage.mesh(common::bumpy_sphere(70_000), shiny);
    for x in [-3.0, 0.0, 3.0] {
        stage.point_light(150.0, Vec3::new(x, 4.0, 3.0));
    }
    stage.camera(Vec3::new(1.5, 1.5, 3.5));
    stage.setup()
}

/// 27 glass balls: paths fork at every surface.
fn glass_balls() -> RenderSetup {
    let mut stage = open_stage();
    let glass = stage.material(glass());
    for i in 0..27 {
        let place = |n: i32| (n % 3 - 1) as f32 * 0.65;
        let center = Vec3::new(place(i), place(i / 3), place(i / 9));
        stage.shape(Shape::Sphere { radius_m: 0.3 }, at(center), glass);
    }
    stage.point_light(300.0, Vec3::new(2.0, 4.0, 3.0));
    stage.camera(Vec3::new(1.5, 1.5, 3.5));
    stage.setup()
}

/// Sixteen shadow rays per hit, and a lens.
fn soft_shadows() -> RenderSetup {
    let mut stage = open_stage();
    let plain = stage.material(matte(grey(0.7)));
    stage.mesh(common::bumpy_sphere(5_000), plain);
    stage.light(common::area_light(200.0, 16), look(Vec3::new(1.0, 4.0, 1.0), Vec3::ZERO));
    let camera = Camera::ThinLens {
        vertical_fov: 0.7,
        lens_radius_m: 0.05,
        focus_distance_m: 3.2,
        aperture: None,
        pattern: Pattern::Jittered,
    };
    stage.0.entities.spawn((camera, look(Vec3::new(1.5, 1.5, 3.5), Vec3::ZERO)));
    stage.setup()
}

/// 820 mirror balls.
fn mirror_flake() -> RenderSetup {
    let mut stage = open_stage();
    let mirror = stage.material(BlinnPhong { kr: grey(0.8), specular: grey(0.3), ..matte(grey(0.1)) });
    for (center, radius_m) in common::sphereflake(3) {
        stage.shape(Shape::Sphere { radius_m }, at(center), mirror);
    }
    stage.point_light(200.0, Vec3::new(3.0, 5.0, 4.0));
    stage.camera(Vec3::new(1.0, 1.2, 2.5));
    stage.setup()
}

fn schedules(c: &mut Criterion) {
    let scenes = [
        ("mesh", mesh()),
        ("glass balls", glass_balls()),
        ("soft shadows", soft_shadows()),
        ("mirror flake", mirror_flake()),
    ];
    for (name, setup) in scenes {
        let mut group = c.benchmark_group(format!("schedules/{name}"));
        let mut films = Vec::new();
        for (name, schedule) in [("wavefront", Schedule::Wavefront), ("recursive", Schedule::Recursive)] {
            let mut worker = common::worker(&setup, schedule);
            let (film, rays) = common::render(&setup, &mut worker, Isa::detect(), SAMPLES);
            films.push(film);
            group.throughput(Throughput::Elements(rays));
            group.bench_function(BenchmarkId::from_parameter(name), |b| {
                b.iter(|| common::render(&setup, &mut worker, Isa::detect(), SAMPLES));
            });
        }
        assert!(films[0] == films[1], "what is compared must be the same image");
        group.finish();
    }
}

fn wave_sizes(c: &mut Criterion) {
    let setup = glass_balls();
    let mut group = c.benchmark_group("wave");
    for wave in [256, 4_096, 16_384, 65_536] {
        let mut worker = Worker::new(&setup, Schedule::Wavefront, wave, Sorting::default());
        let (_, rays) = common::render(&setup, &mut worker, Isa::detect(), SAMPLES);
        group.throughput(Throughput::Elements(rays));
        group.bench_function(BenchmarkId::from_parameter(wave), |b| {
            b.iter(|| common::render(&setup, &mut worker, Isa::detect(), SAMPLES));
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = common::criterion(); targets = schedules, wave_sizes }
criterion_main!(benches);
