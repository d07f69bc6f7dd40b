//! How long the acceleration structure takes to build, in triangles a second.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rayfront::bvh::{Bvh, Geometry};

/// Binary tree, collapse and blocks, on all cores.
fn build(c: &mut Criterion) {
    let mut group = c.benchmark_group("build");
    for (name, triangles) in [("10k", 10_000), ("100k", 100_000), ("1M", 1_000_000)] {
        let mesh = common::bumpy_sphere(triangles);
        let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
        let geometry = Geometry { positions: &positions, triangles: &mesh.triangles, spheres: &[] };
        let count = mesh.triangles.len() as u32;
        group.throughput(Throughput::Elements(u64::from(count)));
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                let mut bvh = Bvh::default();
                bvh.add_root(&geometry, 0..count, 0..0, &[]);
                bvh
            });
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = common::criterion(); targets = build }
criterion_main!(benches);
