//! The command that repeats a mix of light groups.

use std::path::Path;

use crate::files;
use crate::math::Rgb;
use crate::study::explain::Recipe;

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

/// Continues the command that renders a picture: it also saves the film, which a second command mixes by `statements`
/// into the picture.
pub fn command(render: &str, recipe: &Recipe, statements: &[String], is_denoised: bool) -> String {
    // A note may stand behind the command.
    let (render, note) = match render.rfind("  # ").filter(|_| recipe.is_moved) {
        Some(at) => render.split_at(at),
        None => (render, ""),
    };
    let stem = recipe.path.file_stem().unwrap_or_default().to_string_lossy();
    let [film, picture] = ["film", "png"].map(|ending| quoted(&argument(&format!("{stem}.{ending}"))));
    let sets: String = statements.iter().map(|statement| format!(" --set {}", quoted(statement))).collect();
    let denoise = if is_denoised { " --denoise" } else { "" };
    let outside = if is_denoised && files::outside_is_allowed() { " --allow-outside" } else { "" };
    format!("{render} -o {film} && rayfront mix {film}{sets}{denoise}{outside} -o {picture}{note}")
}

/// A file name as an argument: one that begins with a minus would be taken for an option.
fn argument(name: &str) -> String {
    if name.starts_with('-') {
        Path::new(".").join(name).to_string_lossy().into_owned()
    } else {
        name.to_owned()
    }
}

/// A word, quoted for a shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
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
