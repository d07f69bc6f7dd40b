//! What building holds in memory, counted: a process of its own, because its allocator counts.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use rayfront::internals::bvh::{Bvh, PrimitiveArrays};

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: the system's allocator does the work; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let held = HELD.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(held, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A rolling sheet of `side`² × 2 triangles; all of them in one place if it is `crowded`.
fn sheet(side: u32, crowded: bool) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let place = |i: u32| if crowded { (i % 2) as f32 } else { i as f32 };
    let corner = |x: u32, y: u32| [place(x), place(y), ((x * 7 + y * 13) % 17) as f32 * 0.05];
    let positions = (0..=side).flat_map(|y| (0..=side).map(move |x| corner(x, y))).collect();
    let triangles = (0..side).flat_map(|y| {
        (0..side).flat_map(move |x| {
            let first = y * (side + 1) + x;
            let above = first + side + 1;
            [[first, first + 1, above], [first + 1, above + 1, above]]
        })
    });
    (positions, triangles.collect())
}

/// Long triangles on a leaning lattice, which are worth splitting.
fn fence(count: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let slat = |i: u32| {
        let (x, y) = ((i % 64) as f32, (i / 64) as f32);
        [[x, y, 0.0], [x + 0.02, y, 0.0], [x + 5.0, y + 4.0, 6.0]]
    };
    ((0..count).flat_map(slat).collect(), (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

#[test]
fn building_stays_within_the_bound_that_it_reports() {
    // Its threads' own memory is not the builder's.
    rayon::join(|| (), || ());
    let meshes = [sheet(5, false), sheet(100, false), sheet(300, false), sheet(100, true), fence(30_000)];
    for (positions, triangles) in meshes {
        for with_spheres in [false, true] {
            let sphere = |i: usize| [i as f32 * 0.7, 1.0, 0.0, 0.5];
            let spheres: Vec<_> = (0..triangles.len() / 50 * with_spheres as usize).map(sphere).collect();
            let geometry =
                PrimitiveArrays { positions: &positions, triangles: &triangles, spheres: &spheres };
            let mut bvh = Bvh::default();
            let before = HELD.load(Ordering::Relaxed);
            PEAK.store(before, Ordering::Relaxed);
            bvh.add_root(&geometry, 0..triangles.len() as u32, 0..spheres.len() as u32);
            let peak = PEAK.load(Ordering::Relaxed) - before;
            // Nodes and blocks are made last, when the references have gone.
            let (bytes, bound) = (bvh.bytes(), bvh.statistics.peak_bytes);
            let what = format!("{} triangles and {bytes} bytes", triangles.len());
            println!("{what}: {peak} held, bound {bound}");
            assert!(peak <= bound.max(bytes + bound * 2 / 3), "{what}: {peak} held, bound {bound}");
            assert!(triangles.len() < 10_000 || bound < 4 * peak, "{what}: {peak} held, bound {bound}");
        }
    }
}
