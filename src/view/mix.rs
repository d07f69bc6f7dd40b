//! The statements that repeat a mix of light groups.

use crate::math::Rgb;

/// The statements that multiply the light of groups by these factors; none for a factor of 1, or if there are not as
/// many factors as groups.
pub fn statements(names: &[String], factors: &[Rgb]) -> Vec<String> {
    if names.len() != factors.len() {
        return Vec::new();
    }
    let changed = names.iter().zip(factors).filter(|(_, factor)| **factor != Rgb::WHITE);
    let statement = |(name, Rgb { r, g, b }): (&String, &Rgb)| match r == g && g == b {
        true => format!("{name:?}.power_w *= {r}"),
        false => format!("{name:?}.power_w *= ({r}, {g}, {b})"),
    };
    changed.map(statement).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_are_about_groups_with_another_factor_than_1() {
        let names = ["lamp".to_owned(), "it's \"one\"".to_owned(), "sky".to_owned()];
        let factors = [Rgb::splat(0.25), Rgb::new(1.0, 0.5, 0.0), Rgb::WHITE];
        let expected = [r#""lamp".power_w *= 0.25"#, r#""it's \"one\"".power_w *= (1, 0.5, 0)"#];
        assert_eq!(statements(&names, &factors), expected);
        assert_eq!(statements(&names[..1], &factors), [""; 0]);
    }
}
