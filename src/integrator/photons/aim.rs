//! The choice of a photon's target.

use super::targets::MOST;

/// One number for each target.
#[derive(Default)]
pub(in crate::integrator) struct Angles(pub [f32; MOST]);

impl Angles {
    /// The numbers of the first `count` targets.
    pub fn of(&self, count: usize) -> &[f32] {
        &self.0[..count]
    }
}

/// The probabilities of targets: half of the photons by size, so that they are spread evenly, the other half in equal
/// numbers, so that a lake does not take those of a glass beside it.
pub(in crate::integrator) struct Chances<'a> {
    sizes: &'a [f32],
    /// 1 over twice the total size, and over twice the number of targets that have a size.
    by_size: f32,
    each: f32,
}

impl<'a> Chances<'a> {
    pub fn new(sizes: &'a [f32]) -> Self {
        let total: f32 = sizes.iter().sum();
        let count = sizes.iter().filter(|size| **size > 0.0).count();
        Self { sizes, by_size: 0.5 / total.max(f32::MIN_POSITIVE), each: 0.5 / count.max(1) as f32 }
    }

    /// The target that a number in [0, 1) chooses, if any has a size.
    pub fn choose(&self, u: f32) -> Option<usize> {
        let (mut rest, mut chosen) = (u, None);
        for (number, size) in self.sizes.iter().enumerate().filter(|(_, size)| **size > 0.0) {
            chosen = Some(number);
            rest -= size * self.by_size + self.each;
            if rest < 0.0 {
                break;
            }
        }
        chosen
    }

    /// The probability of a target over its size.
    pub fn density(&self, number: usize) -> f32 {
        self.by_size + self.each / self.sizes[number]
    }
}

/// 1 − cosine of half the angle that a ball subtends; 2 from within.
pub(in crate::integrator) fn cone(distance: f32, radius: f32) -> f32 {
    if distance <= radius {
        return 2.0;
    }
    let sine = radius / distance;
    let square = sine * sine;
    square / (1.0 + (1.0 - square).sqrt())
}
