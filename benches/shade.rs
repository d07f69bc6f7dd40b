//! The benefit of SIMD lanes: a scene that is mostly shading, and the elementary functions, by instruction set.

mod common;

use std::hint::black_box;

use common::{Stage, grey, matte};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rayfront::internals::integrator::{RenderSetup, Schedule};
use rayfront::internals::math::elementary::{acos_turns, atan2_turns, exp2, log2, pow, sin_cos_turns};
use rayfront::internals::simd::{Float, Isa, Kernel, Lanes, dispatch};
use rayfront::math::{Rgb, Vec3};
use rayfront::world::BlinnPhong;

const SAMPLES: u32 = 4;

/// Textures and highlights under four lights, with little geometry.
fn lit_frame() -> RenderSetup {
    let mut stage = Stage::new([160, 120], SAMPLES);
    let checkers = stage.checkers(8.0);
    let floor = stage.material(BlinnPhong { specular: grey(0.2), shininess: 20.0, ..matte(checkers) });
    let ball = stage.checkers(1.0);
    let ball = stage.material(BlinnPhong { specular: grey(0.5), shininess: 80.0, ..matte(ball) });
    stage.mesh(common::bumpy_sphere(1_000), ball);
    stage.ground(-1.0, floor);
    for (x, z) in [(-3.0, 3.0), (3.0, 3.0), (-3.0, -3.0), (3.0, -3.0)] {
        stage.point_light(100.0, Vec3::new(x, 4.0, z));
    }
    stage.0.settings.ambient = Rgb::splat(0.05);
    stage.camera(Vec3::new(1.0, 2.0, 4.0));
    stage.setup()
}

/// Wavefront rendering on one thread, in rays per second.
fn render(c: &mut Criterion) {
    let setup = lit_frame();
    let mut worker = common::worker(&setup, Schedule::Wavefront);
    let (_, rays) = common::render(&setup, &mut worker, Isa::detect(), SAMPLES);
    let mut group = c.benchmark_group("shade/textured and lit");
    group.throughput(Throughput::Elements(rays));
    for isa in Isa::available() {
        group.bench_function(BenchmarkId::from_parameter(isa.name()), |b| {
            b.iter(|| common::render(&setup, &mut worker, isa, SAMPLES));
        });
    }
    group.finish();
}

/// One of the elementary functions.
#[derive(Clone, Copy)]
enum Function {
    Exp2,
    Log2,
    Pow,
    SinCos,
    Atan2,
    Acos,
}

/// Applies a function to every value of a column.
struct Column<'a> {
    function: Function,
    values: &'a [f32],
    out: &'a mut [f32],
}

impl Kernel for Column<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let width = L::Queue::WIDTH;
        for i in (0..self.values.len()).step_by(width) {
            let x = L::Queue::load(&self.values[i..]);
            let y = match self.function {
                Function::Exp2 => exp2(x),
                Function::Log2 => log2(x),
                Function::Pow => pow(x, L::Queue::splat(20.0)),
                Function::SinCos => {
                    let (sin, cos) = sin_cos_turns(x);
                    sin + cos
                }
                Function::Atan2 => atan2_turns(x, L::Queue::splat(0.7)),
                Function::Acos => acos_turns(x),
            };
            y.store(&mut self.out[i..]);
        }
    }
}

/// Values per second.
fn elementary(c: &mut Criterion) {
    // A multiple of every lane width; fits into the first-level cache.
    const COUNT: usize = 2048;
    let values: Vec<f32> = (0..COUNT).map(|i| (i as f32 + 0.5) / COUNT as f32).collect();
    let mut out = vec![0.0; COUNT];
    let functions = [
        ("exp2", Function::Exp2),
        ("log2", Function::Log2),
        ("pow", Function::Pow),
        ("sin_cos", Function::SinCos),
        ("atan2", Function::Atan2),
        ("acos", Function::Acos),
    ];
    for (name, function) in functions {
        let mut group = c.benchmark_group(format!("elementary/{name}"));
        group.throughput(Throughput::Elements(COUNT as u64));
        for isa in Isa::available() {
            group.bench_function(BenchmarkId::from_parameter(isa.name()), |b| {
                b.iter(|| dispatch(isa, Column { function, values: black_box(&values), out: &mut out }));
            });
        }
        group.finish();
    }
}

criterion_group! { name = benches; config = common::criterion(); targets = render, elementary }
criterion_main!(benches);
