//! Radii that shrink from sample to sample, so that the blur that they cause vanishes as noise decreases.

/// The parameter α of Knaus and Zwicker ("Progressive photon mapping: a probabilistic approach", 2011), who also use
/// 2/3.
const ALPHA: f64 = 2.0 / 3.0;

/// The ratio of a sample's radius to that of the first sample: √(Γ(k + α) / (Γ(1 + α) Γ(k + 1))) for the k-th sample,
/// counted from 1.
pub fn shrink(sample: u32) -> f32 {
    let k = f64::from(sample) + 1.0;
    let log = libm::lgamma(k + ALPHA) - libm::lgamma(1.0 + ALPHA) - libm::lgamma(k + 1.0);
    libm::exp(0.5 * log) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrink_satisfies_the_recurrence_of_radii() {
        let mut square = 1.0;
        for sample in 0..1000u32 {
            let found = f64::from(shrink(sample));
            assert!((found * found / square - 1.0).abs() < 1e-5, "{sample}: {found}");
            let k = f64::from(sample) + 1.0;
            square *= (k + ALPHA) / (k + 1.0);
        }
    }
}
