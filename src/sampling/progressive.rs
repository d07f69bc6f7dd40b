//! Radii that shrink from sample to sample, so that what is blurred by them becomes sharp as noise becomes less.

/// α: of Knaus and Zwicker ("Progressive photon mapping: a probabilistic approach", 2011), who take 2/3, too.
const ALPHA: f64 = 2.0 / 3.0;

/// By how much the radius of a sample is smaller than that of the first one: √(Γ(k + α) / (Γ(1 + α) Γ(k + 1))) for the
/// k-th sample, counted from 1.
pub fn shrink(sample: u32) -> f32 {
    let k = f64::from(sample) + 1.0;
    let log = libm::lgamma(k + ALPHA) - libm::lgamma(1.0 + ALPHA) - libm::lgamma(k + 1.0);
    libm::exp(0.5 * log) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_shrink_as_the_recurrence_says() {
        let mut square = 1.0;
        for sample in 0..1000u32 {
            let found = f64::from(shrink(sample));
            assert!((found * found / square - 1.0).abs() < 1e-5, "{sample}: {found}");
            let k = f64::from(sample) + 1.0;
            square *= (k + ALPHA) / (k + 1.0);
        }
    }
}
