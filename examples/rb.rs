// throwaway: rb MESHES CLASSES [kernels]
use rayfront::bvh::{self, *};
use rayfront::simd::Level;
fn cpu() -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .unwrap()
        .split(' ')
        .next()
        .unwrap()
        .parse::<f64>()
        .unwrap()
        * 1e-9
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let home = std::env::var("HOME").unwrap();
    let passes: usize = std::env::var("PASSES").ok().map_or(3, |s| s.parse().unwrap());
    let levels: Vec<String> =
        std::env::var("LEVELS").unwrap_or("avx512".into()).split(',').map(|s| s.to_string()).collect();
    for mesh in a[1].split(',') {
        let dir = format!("{home}/.cache/rayfront-peers/rays/{mesh}");
        let mut world =
            rayfront::formats::load(std::path::Path::new(&format!("{dir}/mesh.ply"))).ok().unwrap();
        if let Ok(q) = std::env::var("QUALITY") {
            world.settings.build_quality = match q.as_str() {
                "high" => BuildQuality::High,
                "fast" => BuildQuality::Fast,
                _ => BuildQuality::Default,
            };
        }
        let c = cpu();
        let scene = rayfront::compile::compile(&world, None).ok().unwrap();
        eprintln!(
            "{mesh} compile main-thread cpu {:.3}, build {:?}, nodes {} blocks {}",
            cpu() - c,
            scene.bvh.statistics.time,
            scene.bvh.nodes.len(),
            scene.bvh.triangles.len()
        );
        for class in a[2].split(',') {
            let raw: Vec<f32> = std::fs::read(format!("{dir}/rays_{class}.f32"))
                .unwrap()
                .chunks_exact(4)
                .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
                .collect();
            let refs: Vec<u32> = std::fs::read(format!("{dir}/hits_{class}.bin"))
                .unwrap()
                .chunks_exact(4)
                .map(|b| u32::from_le_bytes(b.try_into().unwrap()))
                .collect();
            let n = raw.len() / 8;
            let col: Vec<Vec<f32>> = (0..8).map(|k| (0..n).map(|i| raw[8 * i + k]).collect()).collect();
            let any = class == "shadow" || class == "ao";
            for lv in &levels {
                let level = Level::from_name(lv).unwrap();
                let coh = match std::env::var("COH").as_deref() {
                    Ok("c") => Coherence::Coherent,
                    Ok("s") => Coherence::Scattered,
                    _ => Coherence::Unknown,
                };
                let mut stack = Stack::new(&scene.bvh);
                let (mut t, mut u, mut v, mut p, mut ins) =
                    (vec![0f32; n], vec![0f32; n], vec![0f32; n], vec![0u32; n], vec![0u32; n]);
                let mut best = f64::MAX;
                for _ in 0..passes {
                    let c = cpu();
                    let mut i = 0;
                    while i < n {
                        let e = (i + 4096).min(n);
                        let rays = Rays {
                            origin: [&col[0][i..e], &col[1][i..e], &col[2][i..e]],
                            direction: [&col[3][i..e], &col[4][i..e], &col[5][i..e]],
                            t_min: &col[6][i..e],
                            t_max: &col[7][i..e],
                        };
                        if any {
                            bvh::any(level, &scene.bvh, rays, coh, &mut stack, &mut p[i..e]);
                        } else {
                            bvh::closest(
                                level,
                                &scene.bvh,
                                rays,
                                coh,
                                &mut stack,
                                HitsMut {
                                    t: &mut t[i..e],
                                    u: &mut u[i..e],
                                    v: &mut v[i..e],
                                    primitive: &mut p[i..e],
                                    instance: &mut ins[i..e],
                                },
                            );
                        }
                        i = e;
                    }
                    best = best.min(cpu() - c);
                }
                let mut bad = 0;
                let mut h = 0u64;
                for i in 0..n {
                    let rh = refs[4 * i + 3] != u32::MAX;
                    if any {
                        if (p[i] != 0) != rh {
                            bad += 1
                        }
                        h = h.wrapping_mul(31).wrapping_add(p[i] as u64);
                    } else {
                        let rt = f32::from_bits(refs[4 * i]);
                        if (p[i] != u32::MAX) != rh || rh && (t[i] - rt).abs() > 1e-4 * rt + 1e-6 {
                            bad += 1
                        }
                        h = h.wrapping_mul(31).wrapping_add(
                            t[i].to_bits() as u64
                                ^ (p[i] as u64) << 32
                                ^ (u[i].to_bits() as u64) << 13
                                ^ (v[i].to_bits() as u64) << 7,
                        );
                    }
                }
                println!("{mesh} {class} {lv} {:.2} Mrays/s bad {bad} hash {h:016x}", n as f64 / best / 1e6);
            }
        }
    }
}
