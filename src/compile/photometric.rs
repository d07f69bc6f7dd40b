//! Photometric profiles: their mean over all directions, and the beam that holds most of their light.

use std::f64::consts::PI;

use crate::math::Rgb;
use crate::world::Image;

/// The least brightness of a beam, relative to the brightest direction.
const BEAM: f64 = 0.1;
/// Profiles with a wider beam are treated as emitting everywhere.
const WIDEST: f64 = 0.9 * PI;

/// The second of a beam's angles, at most; the rest of its width is spread. At such angles cosines differ clearly.
const FURTHER: f64 = 0.25 * PI;

/// The cone that holds most of a profile's light, relative to its mean over all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BeamCone {
    /// Cosines of two angles whose sum is the angle to the axis within which the beam lies: the spread of directions,
    /// and the angle within which light leaves from each of these, as for surfaces
    /// ([`super::light_tree::LightBounds`]). −1 and 0 if the beam is everywhere.
    pub cosines: [f32; 2],
    /// True if it points backwards along the axis.
    pub backwards: bool,
    /// The mean intensity within it.
    pub intensity: f32,
    /// The mean outside of it, over that within; 0 only if all is dark outside.
    pub outside: f32,
}

/// The mean of a profile over all directions, and its beam; `None` if it is dark.
///
/// Rows lie at equal angles from straight ahead to straight back; values between two of them are interpolated.
pub(super) fn summary(image: &Image) -> Option<(f32, BeamCone)> {
    let (width, height) = (image.width as usize, image.height as usize);
    let value = |at: usize| {
        let [r, g, b, _] = image.texels.stored(at).map(|channel| channel as f32);
        Rgb::new(r, g, b).luminance()
    };
    let row = |row: usize| (row * width..(row + 1) * width).map(|at| f64::from(value(at)));
    let rows: Vec<ProfileRow> = (0..height)
        .map(|at| ProfileRow {
            weight: weight(at, height),
            mean: row(at).sum::<f64>() / width as f64,
            most: row(at).fold(0.0, f64::max),
        })
        .collect();
    let mean = mean_of(&rows);
    if !(mean >= f64::from(f32::MIN_POSITIVE) && mean <= f64::from(f32::MAX)) {
        return None;
    }
    let brightest = rows.iter().map(|row| row.most).fold(0.0, f64::max);
    let is_bright = |row: &ProfileRow| row.most >= BEAM * brightest;
    // Interpolation makes it one row wider.
    let ahead = (rows.iter().rposition(is_bright).unwrap_or(0) + 1).min(height - 1);
    let back = rows.iter().position(is_bright).unwrap_or(0).saturating_sub(1);
    let angle = |row: usize| if height > 1 { PI * row as f64 / (height - 1) as f64 } else { PI };
    let backwards = PI - angle(back) < angle(ahead);
    let (spread, (within, outside)) = if backwards {
        (PI - angle(back), (&rows[back..], &rows[..back]))
    } else {
        (angle(ahead), (&rows[..ahead + 1], &rows[ahead + 1..]))
    };
    if spread > WIDEST {
        let everywhere = BeamCone { cosines: [-1.0, 0.0], backwards: false, intensity: 1.0, outside: 0.0 };
        return Some((mean as f32, everywhere));
    }
    let intensity = mean_of(within);
    let dark = outside.iter().all(|row| row.most <= 0.0);
    // The least value that is still sampled, so that faint light outside is not left out.
    let rest = if dark { 0.0 } else { (mean_of(outside) / intensity).max(1e-3) };
    let beam = BeamCone {
        cosines: [(spread - FURTHER).max(0.0), spread.min(FURTHER)].map(|angle| libm::cos(angle) as f32),
        backwards,
        intensity: (intensity / mean) as f32,
        outside: rest as f32,
    };
    Some((mean as f32, beam))
}

/// All directions at one angle to the axis.
struct ProfileRow {
    weight: f64,
    mean: f64,
    most: f64,
}

fn mean_of(rows: &[ProfileRow]) -> f64 {
    let weights: f64 = rows.iter().map(|row| row.weight).sum();
    rows.iter().map(|row| row.weight * row.mean).sum::<f64>() / weights.max(f64::MIN_POSITIVE)
}

/// The solid angle that a row stands for, up to a factor: ∫ sin θ of a tent that is as wide as a step to either side.
fn weight(row: usize, rows: usize) -> f64 {
    if rows < 2 {
        return 1.0;
    }
    let step = PI / (rows - 1) as f64;
    if row == 0 || row == rows - 1 {
        return 1.0 - libm::sin(step) / step;
    }
    libm::sin(step * row as f64) * 2.0 * (1.0 - libm::cos(step)) / step
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Texels;

    fn profile(height: usize, value: impl Fn(f64) -> f64) -> Image {
        let angle = |row: usize| PI * row as f64 / (height - 1) as f64;
        let texels = (0..height).map(|row| [value(angle(row)) as f32; 3]).collect();
        Image { source: None, width: 1, height: height as u32, texels: Texels::Rgb32(texels) }
    }

    #[test]
    fn profile_mean_is_that_of_interpolated_rows() {
        let (mean, beam) = summary(&profile(181, |_| 3.0)).unwrap();
        assert!((mean - 3.0).abs() < 1e-5 && beam.cosines[0] == -1.0, "{mean} {beam:?}");
        // cos² θ has a mean of 1/3.
        let (mean, _) = summary(&profile(721, |angle| angle.cos().powi(2))).unwrap();
        assert!((mean - 1.0 / 3.0).abs() < 1e-5, "{mean}");
        assert!(summary(&profile(5, |_| 0.0)).is_none());
    }

    #[test]
    fn beam_contains_all_bright_directions() {
        let cone = |angle: f64| if angle < 0.2001 { 1.0 } else { 0.0 };
        let (_, beam) = summary(&profile(1801, cone)).unwrap();
        assert!(
            beam.cosines[0] == 1.0
                && (libm::acosf(beam.cosines[1]) - 0.2).abs() < 0.003
                && !beam.backwards
                && beam.outside == 0.0
        );
        // Its intensity is that of all light in the beam.
        assert!((beam.intensity * (1.0 - libm::cosf(0.2)) / 2.0 - 1.0).abs() < 0.05, "{beam:?}");
        let (_, up) = summary(&profile(1801, |angle| 0.01 + cone(PI - angle))).unwrap();
        assert!(up.backwards && (up.outside - 0.01).abs() < 0.002, "{up:?}");
    }
}
