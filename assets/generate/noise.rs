//! Gradient noise, the same bits on every platform.

use glam::{DVec2, DVec3};

/// A well-mixed hash of a lattice point.
fn hash(x: i64, y: i64, z: i64) -> u32 {
    let mut h = (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f).rotate_left(21)
        ^ (z as u64).wrapping_mul(0x1656_67b1_9e37_79f9).rotate_left(42);
    h ^= h >> 31;
    h = h.wrapping_mul(0xff51_afd7_ed55_8ccd);
    h ^= h >> 33;
    h = h.wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    (h >> 32) as u32
}

/// A number in [0, 1) for a lattice point.
pub fn lattice(x: i64, y: i64) -> f64 {
    f64::from(hash(x, y, 7)) / 4_294_967_296.0
}

/// Smooth noise from about −1 to 1, zero at whole numbers.
pub fn noise(p: DVec3) -> f64 {
    let cell = p.floor();
    let f = p - cell;
    let ease = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (u, v, w) = (ease(f.x), ease(f.y), ease(f.z));
    let corner = |i: i64, j: i64, k: i64| {
        let h = hash(cell.x as i64 + i, cell.y as i64 + j, cell.z as i64 + k);
        // Each component of the gradient takes ten bits.
        let part = |shift: u32| f64::from((h >> shift) & 1023) / 511.5 - 1.0;
        let gradient = DVec3::new(part(0), part(10), part(20));
        gradient.dot(f - DVec3::new(i as f64, j as f64, k as f64))
    };
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let row = |j, k| mix(corner(0, j, k), corner(1, j, k), u);
    mix(mix(row(0, 0), row(1, 0), v), mix(row(0, 1), row(1, 1), v), w) * 1.2
}

/// The sum of octaves of noise, each of twice the frequency and half the height.
pub fn fractal(p: DVec3, octaves: u32) -> f64 {
    let (mut sum, mut height, mut q) = (0.0, 0.5, p);
    for _ in 0..octaves {
        sum += height * noise(q);
        height *= 0.5;
        q = q * 2.0 + DVec3::new(17.1, 5.3, 9.7);
    }
    sum
}

/// The noise of [`fractal`] in the plane.
pub fn fractal2(p: DVec2, octaves: u32) -> f64 {
    fractal(p.extend(0.37), octaves)
}
