//! Values of mesh files that are mended instead of refusing the file, and their numbers as other programs write them.

use std::str::FromStr;

/// Counts the mended values of a kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MendedValues {
    /// The number of values.
    pub count: usize,
    /// The place of the first one: a line, or a vertex.
    pub first: usize,
}

impl MendedValues {
    /// Counts a value at a place; the first call gives the first place.
    pub fn note(&mut self, place: usize) {
        if self.count == 0 {
            self.first = place;
        }
        self.count += 1;
    }
}

/// Parses a number, which may be infinite or not a number. Also reads the spellings of Windows' C library (`1.#QNAN`,
/// `-nan(ind)`), Fortran's exponents (`1.5D+03`) and decimal commas.
pub fn number(word: &str) -> Option<f32> {
    parse(word, f32::NAN)
}

/// Parses a number like [`number`], in double precision.
pub fn precise_number(word: &str) -> Option<f64> {
    parse(word, f64::NAN)
}

fn parse<F: FromStr>(word: &str, not_a_number: F) -> Option<F> {
    if let Ok(number) = word.parse() {
        return Some(number);
    }
    let digits = word.trim_start_matches(['+', '-']);
    let after = |start: &str| digits.get(..start.len()).is_some_and(|it| it.eq_ignore_ascii_case(start));
    if after("nan(") || after("1.#") {
        return Some(not_a_number);
    }
    // Only digits may surround the comma or the exponent.
    if !digits.starts_with(|c: char| c.is_ascii_digit() || c == '.' || c == ',') {
        return None;
    }
    word.replace(',', ".").replace(['d', 'D'], "e").parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_other_programs_are_read() {
        let read = [("1.5", 1.5), ("1,5", 1.5), ("-,25", -0.25), ("-1.5D+03", -1500.0), ("2d0", 2.0)];
        for (word, value) in read {
            assert_eq!(number(word), Some(value), "{word}");
        }
        for word in ["nan", "-nan(ind)", "1.#QNAN", "-1.#IND", "NaN(0x1)", "1.#INF00"] {
            assert!(number(word).is_some_and(f32::is_nan), "{word}");
        }
        for word in ["", "x", "d5", "1,2,3", "1.5x", "0x10", "é", "#"] {
            assert_eq!(number(word), None, "{word}");
        }
    }

    #[test]
    fn the_first_place_is_kept() {
        let mut mended = MendedValues::default();
        [7, 3, 9].into_iter().for_each(|line| mended.note(line));
        assert_eq!(mended, MendedValues { count: 3, first: 7 });
    }
}
