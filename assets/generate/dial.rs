//! Clock faces, drawn with strokes.

use glam::{DVec2, DVec3};

use crate::mesh::{polar, sin_cos_degrees};

const ENAMEL: DVec3 = DVec3::new(0.955, 0.94, 0.90);
const INK: DVec3 = DVec3::new(0.07, 0.075, 0.12);

/// A bar with square ends, from `a` to `b`.
struct Stroke {
    a: DVec2,
    b: DVec2,
    width: f64,
}

impl Stroke {
    fn distance(&self, p: DVec2) -> f64 {
        let along = (self.b - self.a).normalize();
        let local = p - (self.a + self.b) * 0.5;
        let d = DVec2::new(local.dot(along).abs(), local.perp_dot(along).abs());
        let half = DVec2::new(self.a.distance(self.b) / 2.0, self.width / 2.0);
        (d - half).max_element()
    }
}

/// The strokes of a Roman numeral of height 1 about the origin, thick where a pen's are.
fn numeral(letters: &str) -> Vec<Stroke> {
    const THICK: f64 = 0.17;
    const THIN: f64 = 0.055;
    let advance = |c: char| if c == 'I' { 0.34 } else { 0.66 };
    let total: f64 = letters.chars().map(advance).sum();
    let mut x = -total / 2.0;
    let mut strokes = Vec::new();
    let mut stroke = |ax: f64, ay: f64, bx: f64, by: f64, width| {
        strokes.push(Stroke { a: DVec2::new(ax, ay), b: DVec2::new(bx, by), width });
    };
    for letter in letters.chars() {
        let center = x + advance(letter) / 2.0;
        let (top, bottom, half) = (0.48, -0.48, 0.23);
        let mut serif = |at: f64, y: f64, half: f64| stroke(at - half, y, at + half, y, THIN);
        match letter {
            'I' => {
                serif(center, top, 0.15);
                serif(center, bottom, 0.15);
                stroke(center, bottom, center, top, THICK);
            }
            'V' => {
                serif(center - half, top, 0.14);
                serif(center + half, top, 0.10);
                stroke(center - half, top, center, bottom, THICK);
                stroke(center + half, top, center, bottom, THIN);
            }
            _ => {
                serif(center - half, top, 0.14);
                serif(center + half, top, 0.10);
                serif(center - half, bottom, 0.10);
                serif(center + half, bottom, 0.14);
                stroke(center - half, top, center + half, bottom, THICK);
                stroke(center + half, top, center - half, bottom, THIN);
            }
        }
        x += advance(letter);
    }
    strokes
}

const HOURS: [&str; 12] = ["XII", "I", "II", "III", "IIII", "V", "VI", "VII", "VIII", "IX", "X", "XI"];

/// The place of a point on a dial: radius, hour sector, and offset from the sector's middle line (x to the right, y
/// outwards).
fn sector(p: DVec2) -> (f64, usize, DVec2) {
    let degrees = libm::atan2(p.x, p.y).to_degrees();
    let hour = (degrees / 30.0).round();
    let (sin, cos) = sin_cos_degrees(30.0 * hour);
    let local = DVec2::new(p.x * cos - p.y * sin, p.x * sin + p.y * cos);
    (p.length(), hour.rem_euclid(12.0) as usize, local)
}

/// The depth in a minute mark of half width `half` (same unit as the radius); negative outside.
fn minute_mark(p: DVec2, half: f64) -> f64 {
    let degrees = libm::atan2(p.x, p.y).to_degrees();
    let off = degrees - (degrees / 6.0).round() * 6.0;
    half - (p.length() * sin_cos_degrees(off).0).abs()
}

fn inked(ink: f64, pixel: f64) -> DVec3 {
    ENAMEL.lerp(INK, (ink / pixel + 0.5).clamp(0.0, 1.0))
}

/// The ring of the skeleton clock: the image covers 130 mm, the ring lies between 44 and 64 mm.
pub fn clock(uv: DVec2) -> DVec3 {
    let p = (uv - DVec2::splat(0.5)) * DVec2::new(130.0, -130.0);
    let (radius, hour, local) = sector(p);
    let line = |at: f64, half: f64| half - (radius - at).abs();
    let mut ink = line(59.0, 0.12).max(line(61.2, 0.12)).max(line(46.3, 0.12));
    if (59.0..61.2).contains(&radius) {
        let on_hour = local.x.abs() < 0.9;
        ink = ink.max(minute_mark(p, if on_hour { 0.55 } else { 0.22 }));
    }
    const HEIGHT: f64 = 9.8;
    // The numerals widen with the radius.
    let glyph = DVec2::new(local.x / (1.14 * radius / 52.7).max(0.5), radius - 52.7) / HEIGHT;
    if glyph.y.abs() < 0.6 {
        let strokes = numeral(HOURS[hour]);
        let nearest = strokes.iter().map(|s| s.distance(glyph)).fold(f64::INFINITY, f64::min);
        ink = ink.max(-nearest * HEIGHT);
    }
    inked(ink, 0.07)
}

/// A whole face with painted hands at ten past ten, for the table clock.
pub fn plain(uv: DVec2) -> DVec3 {
    let p = (uv - DVec2::splat(0.5)) * DVec2::new(2.0, -2.0);
    let (radius, hour, local) = sector(p);
    let mut ink = (0.012 - (radius - 0.94).abs()).max(0.006 - (radius - 0.86).abs());
    if (0.86..0.94).contains(&radius) {
        ink = ink.max(minute_mark(p, if local.x.abs() < 0.02 { 0.016 } else { 0.006 }));
    }
    let glyph = DVec2::new(local.x, radius - 0.69) / 0.23;
    if glyph.y.abs() < 0.6 {
        let nearest = numeral(HOURS[hour]).iter().map(|s| s.distance(glyph)).fold(f64::INFINITY, f64::min);
        ink = ink.max(-nearest * 0.23);
    }
    let hand = |hour_angle: f64, length: f64, width: f64| {
        let tip = polar(length, 90.0 - hour_angle);
        let stroke = Stroke { a: tip * -0.15, b: tip, width };
        -stroke.distance(p)
    };
    ink = ink.max(hand(304.0, 0.40, 0.065)).max(hand(48.0, 0.62, 0.04)).max(0.055 - radius);
    inked(ink, 0.004)
}
