//! Images, computed pixel by pixel in the unit square (x to the right, y down).

use std::path::Path;

use glam::{DVec2, DVec3};
use image::{ImageError, RgbImage};

use crate::dial;
use crate::mesh::sin_cos_degrees;
use crate::noise::{fractal, fractal2, lattice};
use crate::terrain::Terrain;

/// Paints and saves every texture.
pub fn save_all(folder: &Path, terrain: &Terrain) -> Result<(), ImageError> {
    paint(512, 512, checker).save(folder.join("checker.png"))?;
    paint(768, 512, julia).save(folder.join("julia.png"))?;
    paint(768, 768, wood).save(folder.join("wood.png"))?;
    paint(512, 512, |p| marble(p, true)).save(folder.join("marble_dark.png"))?;
    paint(512, 512, |p| marble(p, false)).save(folder.join("marble_light.png"))?;
    paint(512, 512, brushed).save(folder.join("brushed.png"))?;
    paint(1024, 512, studio).save(folder.join("studio.png"))?;
    paint(1024, 1024, dial::clock).save(folder.join("dial.png"))?;
    paint(768, 384, cabinet).save(folder.join("cabinet.png"))?;
    paint(384, 384, |p| ground(p, terrain)).save(folder.join("terrain.png"))
}

/// Paints an image: `color` returns sRGB components from 0 to 1, and each pixel is the average of 2 × 2 points.
pub fn paint(width: u32, height: u32, color: impl Fn(DVec2) -> DVec3) -> RgbImage {
    let size = DVec2::new(f64::from(width), f64::from(height));
    RgbImage::from_fn(width, height, |x, y| {
        let mut sum = DVec3::ZERO;
        for (dx, dy) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
            sum += color(DVec2::new(f64::from(x) + dx, f64::from(y) + dy) / size);
        }
        image::Rgb(
            (sum / 4.0 * 255.0 + 0.5).clamp(DVec3::ZERO, DVec3::splat(255.0)).to_array().map(|c| c as u8),
        )
    })
}

fn smooth(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn checker(p: DVec2) -> DVec3 {
    let cell = (p * 8.0).floor();
    if (cell.x + cell.y) % 2.0 == 0.0 { DVec3::new(0.93, 0.91, 0.87) } else { DVec3::new(0.13, 0.14, 0.17) }
}

/// A Julia set of z² + c, coloured by the speed at which points escape.
fn julia(p: DVec2) -> DVec3 {
    let mut z = (p - DVec2::splat(0.5)) * DVec2::new(3.3, 2.2);
    let c = DVec2::new(-0.7969, 0.1564);
    for i in 0..220 {
        let squared = z.length_squared();
        if squared > 4096.0 {
            let smooth_count = f64::from(i) - libm::log2(libm::log2(squared) / 12.0);
            let t = libm::log(1.0 + smooth_count.max(0.0)) * 62.0;
            let wave = |phase: f64| 0.5 + 0.5 * sin_cos_degrees(t * 1.4 + phase).0;
            return DVec3::new(wave(-75.0) * 0.96, wave(-115.0) * 0.86, 0.10 + wave(-165.0) * 0.80);
        }
        z = DVec2::new(z.x * z.x - z.y * z.y, 2.0 * z.x * z.y) + c;
    }
    DVec3::new(0.03, 0.02, 0.05)
}

/// Walnut boards along x; mirrored repetition hides the seams.
fn wood(p: DVec2) -> DVec3 {
    let board = (p.y * 4.0).floor();
    let shift = lattice(board as i64, 3);
    let q = DVec3::new(p.x * 1.1 + shift * 7.0, p.y * 4.0 + shift * 11.0, shift * 5.0);
    let bend = fractal(q * DVec3::new(0.55, 0.5, 1.0), 2);
    let wobble = fractal(q * DVec3::new(1.6, 2.0, 1.0), 2);
    let rings = (q.y * 1.1 + 0.3 * q.x * (shift - 0.5) + bend * 1.5 + wobble * 0.08) * 7.0;
    let ring = rings - rings.floor();
    let late = smooth(0.35, 0.92, ring) * (1.0 - smooth(0.92, 1.0, ring));
    let fibre = fractal(DVec3::new(p.x * 9.0, p.y * 240.0, shift * 3.0), 3);
    let pore = smooth(0.24, 0.5, fractal(DVec3::new(p.x * 22.0, p.y * 330.0, 4.0 + shift), 2));
    let (light, dark) = (DVec3::new(0.60, 0.41, 0.26), DVec3::new(0.36, 0.215, 0.125));
    let tone = (0.34 * late + 0.6 * fibre + 0.34 * (shift - 0.5) + 0.32).clamp(0.0, 1.0);
    let gap = (p.y * 4.0 - board).min(board + 1.0 - p.y * 4.0);
    light.lerp(dark, tone) * (1.0 - 0.28 * pore) * (0.35 + 0.65 * smooth(0.0, 0.008, gap))
}

/// Veined stone; mirrored repetition hides the seams.
fn marble(p: DVec2, dark: bool) -> DVec3 {
    let q = DVec3::new(p.x * 2.2 + p.y * 0.8, p.y * 2.2 - p.x * 0.8, 2.6);
    let bend = DVec3::new(fractal(q, 5), fractal(q + DVec3::splat(31.4), 5), 0.0);
    let vein = |q: DVec3, sharp: f64| {
        let n = fractal(q, 6).abs() * sharp;
        1.0 / (1.0 + n * n)
    };
    let strong = vein(q * 1.3 + bend * 1.1, 42.0);
    let fine = vein(q * 3.1 + bend * 0.9 + DVec3::splat(7.7), 34.0);
    let cloud = fractal(q * 1.6 + bend * 0.6 + DVec3::splat(3.1), 5);
    if dark {
        let stone = DVec3::new(0.055, 0.085, 0.078)
            .lerp(DVec3::new(0.12, 0.175, 0.155), (cloud + 0.45).clamp(0.0, 1.0));
        stone.lerp(DVec3::new(0.78, 0.80, 0.74), (0.75 * strong + 0.25 * fine).min(0.9))
    } else {
        let stone =
            DVec3::new(0.93, 0.92, 0.90).lerp(DVec3::new(0.78, 0.78, 0.79), (cloud + 0.4).clamp(0.0, 1.0));
        stone.lerp(DVec3::new(0.48, 0.47, 0.48), (0.65 * strong + 0.3 * fine).min(0.85))
    }
}

/// Fine scratches along x.
fn brushed(p: DVec2) -> DVec3 {
    let coarse = fractal(DVec3::new(p.x * 3.0, p.y * 90.0, 1.0), 2);
    let fine = fractal(DVec3::new(p.x * 6.0, p.y * 300.0, 2.0), 2);
    DVec3::splat(0.70 + 0.12 * coarse + 0.16 * fine)
}

/// The panorama of a photographer's studio (u around, v down): a dim room, a large soft box at the left, a strip light
/// at the right, a lit ceiling.
fn studio(p: DVec2) -> DVec3 {
    let room = DVec3::new(0.20, 0.21, 0.235).lerp(DVec3::new(0.46, 0.47, 0.50), smooth(0.62, 0.0, p.y));
    let floor = DVec3::new(0.25, 0.20, 0.16);
    let base = room.lerp(floor, smooth(0.50, 0.62, p.y));
    let soft_box = |center: DVec2, half: DVec2, edge: f64| {
        let d = (p - center).abs() - half;
        let outside = d.max(DVec2::ZERO).length() + d.max_element().min(0.0);
        smooth(edge, -edge * 0.2, outside)
    };
    let key = soft_box(DVec2::new(0.20, 0.30), DVec2::new(0.085, 0.13), 0.02);
    let strip = soft_box(DVec2::new(0.60, 0.36), DVec2::new(0.018, 0.20), 0.012);
    let top = soft_box(DVec2::new(0.85, 0.17), DVec2::new(0.10, 0.05), 0.03);
    base.lerp(DVec3::new(1.0, 0.97, 0.92), key)
        .lerp(DVec3::new(0.80, 0.90, 1.0), strip)
        .lerp(DVec3::new(0.98, 0.95, 0.93), top * 0.8)
}

/// The atlas of the crooked table clock: wood at the left, dial at the right.
fn cabinet(p: DVec2) -> DVec3 {
    if p.x >= 0.5 {
        return dial::plain(DVec2::new(p.x * 2.0 - 1.0, p.y));
    }
    let grain = wood(DVec2::new(p.y * 0.8, p.x * 1.4));
    // Inlaid panels and bands, stylised: bright lines at fixed heights.
    let band = [0.075, 0.30, 0.74, 0.80].iter().map(|y| (p.y - y).abs()).fold(1.0, f64::min);
    let painted =
        DVec3::new(0.10, 0.29, 0.30).lerp(DVec3::new(0.16, 0.40, 0.38), 0.5 + fractal2(p * 30.0, 3));
    let body = if p.y > 0.30 && p.y < 0.74 { painted } else { grain * 1.15 };
    body.lerp(DVec3::new(0.86, 0.66, 0.30), smooth(0.009, 0.005, band))
}

/// Grass on flat and low ground, rock where it is steep, snow on top.
fn ground(p: DVec2, terrain: &Terrain) -> DVec3 {
    let grid = p * (terrain.side - 1) as f64;
    let height = terrain.height(grid);
    let steep = terrain.steepness(grid);
    let speckle = fractal2(p * 60.0, 4);
    let grass =
        DVec3::new(0.30, 0.36, 0.17).lerp(DVec3::new(0.47, 0.44, 0.25), (0.5 + speckle).clamp(0.0, 1.0));
    let rock = DVec3::new(0.44, 0.40, 0.37) * (1.0 + 0.5 * speckle);
    let snow = DVec3::new(0.93, 0.95, 0.98);
    let rocky = smooth(0.10, 0.22, steep + 0.1 * speckle + 0.4 * (height - 0.10));
    let snowy = smooth(0.165, 0.20, height + 0.03 * speckle) * smooth(0.42, 0.24, steep);
    grass.lerp(rock, rocky).lerp(snow, snowy)
}
