//! Rays per second of the traversal kernels, by scene, class of ray and instruction set; for the widest set also by the
//! coherence that the caller states for the queue, which selects the kernel.

mod common;

use std::hint::black_box;

use common::{RayClasses, Stage, grey, matte};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rayfront::internals::bvh::{self, Coherence, Stack};
use rayfront::internals::scene::CompiledScene;
use rayfront::internals::simd::Isa;
use rayfront::math::{Quat, Vec3};
use rayfront::query::{HitBatch, RayBatch};
use rayfront::world::{Shape, Transform};

/// Rays along each side of the image.
const SIDE: u32 = 192;
const LAMP: Vec3 = Vec3::new(3.0, 5.0, 4.0);

fn bumpy(triangles: usize) -> CompiledScene {
    let mut stage = Stage::new([SIDE, SIDE], 1);
    let plain = stage.material(matte(grey(0.8)));
    stage.mesh(common::bumpy_sphere(triangles), plain);
    stage.ground(-1.0, plain);
    stage.camera(Vec3::new(1.5, 1.5, 3.5));
    stage.compile()
}

fn flake() -> CompiledScene {
    let mut stage = Stage::new([SIDE, SIDE], 1);
    let plain = stage.material(matte(grey(0.8)));
    for (translation, radius_m) in common::sphereflake(4) {
        let transform = Transform::Trs {
            translation: translation.as_dvec3(),
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
        };
        stage.shape(Shape::Sphere { radius_m }, transform, plain);
    }
    stage.ground(-1.0, plain);
    stage.camera(Vec3::new(1.0, 1.2, 2.5));
    stage.compile()
}

fn traverse(c: &mut Criterion) {
    bench_scene(c, "bumpy 70k", &bumpy(70_000));
    bench_scene(c, "bumpy 1M", &bumpy(1_000_000));
    bench_scene(c, "sphereflake 7k", &flake());
}

fn bench_scene(c: &mut Criterion, name: &str, scene: &CompiledScene) {
    let classes = RayClasses::new(scene, SIDE, LAMP);
    bench_closest(c, name, "primary", scene, &classes.primary);
    bench_any(c, name, "shadow", scene, &classes.shadow);
    bench_any(c, name, "ambient occlusion", scene, &classes.ambient_occlusion);
    bench_closest(c, name, "diffuse bounce", scene, &classes.bounce);
}

/// Every instruction set, and the widest with each coherence of the queue.
fn variants() -> Vec<(&'static str, Isa, Coherence)> {
    let mut variants: Vec<_> =
        Isa::available().into_iter().map(|isa| (isa.name(), isa, Coherence::Unknown)).collect();
    variants.push(("packets", Isa::detect(), Coherence::Coherent));
    variants.push(("scattered", Isa::detect(), Coherence::Scattered));
    variants
}

fn bench_closest(c: &mut Criterion, name: &str, class: &str, scene: &CompiledScene, rays: &RayBatch) {
    let mut group = c.benchmark_group(format!("{name}/{class}/closest"));
    let rays = rays.rays();
    let (mut stack, mut hits) = (Stack::new(&scene.bvh), HitBatch::new(rays.len()));
    group.throughput(Throughput::Elements(rays.len() as u64));
    for (name, isa, kind) in variants() {
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| bvh::closest(isa, &scene.bvh, black_box(rays), kind, &mut stack, hits.hits_mut()));
        });
    }
    group.finish();
}

fn bench_any(c: &mut Criterion, name: &str, class: &str, scene: &CompiledScene, rays: &RayBatch) {
    let mut group = c.benchmark_group(format!("{name}/{class}/any"));
    let rays = rays.rays();
    let (mut stack, mut occluded) = (Stack::new(&scene.bvh), vec![0; rays.len()]);
    group.throughput(Throughput::Elements(rays.len() as u64));
    for (name, isa, kind) in variants() {
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| bvh::any(isa, &scene.bvh, black_box(rays), kind, &mut stack, &mut occluded));
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = common::criterion(); targets = traverse }
criterion_main!(benches);
