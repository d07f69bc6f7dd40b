//! Speed at which the acceleration structure is built, in triangles per second, by size, on all cores and on one.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rayfront::internals::bvh::{Bvh, PrimitiveArrays};

/// Builds everything from geometry to finished nodes and blocks.
fn build(c: &mut Criterion) {
    for (name, triangles) in [("10k", 10_000), ("100k", 100_000), ("1M", 1_000_000)] {
        let mesh = common::bumpy_sphere(triangles);
        let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
        let geometry = PrimitiveArrays { positions: &positions, triangles: &mesh.triangles, spheres: &[] };
        let count = mesh.triangles.len() as u32;
        let built = || {
            let mut bvh = Bvh::default();
            bvh.add_root(&geometry, 0..count, 0..0);
            bvh
        };
        let bvh = built();
        println!(
            "{name}: {:.1} bytes a triangle, {:.1} while building, expected cost {:.3}",
            bvh.bytes() as f64 / f64::from(count),
            bvh.statistics.peak_bytes as f64 / f64::from(count),
            bvh.expected_cost()
        );
        let mut group = c.benchmark_group("build");
        group.throughput(Throughput::Elements(u64::from(count)));
        group.bench_function(BenchmarkId::new("all cores", name), |b| b.iter(built));
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        group.bench_function(BenchmarkId::new("one core", name), |b| b.iter(|| one.install(built)));
        group.finish();
    }
}

criterion_group! { name = benches; config = common::criterion(); targets = build }
criterion_main!(benches);
