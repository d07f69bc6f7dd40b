//! Slips that make a text no RON: a forgotten comma, a decimal comma, a unit, curly quotes.

use ron::Error;

use super::scan;

/// The units that people write behind numbers.
const UNITS: [&str; 14] = ["m", "cm", "mm", "km", "kg", "s", "ms", "W", "w", "lm", "cd", "lx", "K", "deg"];

/// True for the digits of a colour, as in "#ff8000".
pub(super) fn is_hexadecimal_color(digits: &str) -> bool {
    [3, 6].contains(&digits.len()) && digits.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// The advice for the place where reading stopped, if an error is one of these slips: `before` and `stop` are the text
/// before that place and from there on.
pub(super) fn advice(code: &Error, before: &str, stop: &str) -> Option<String> {
    let before = before.trim_end();
    let (name, rest) = scan::split_identifier(stop);
    let first = stop.chars().next()?;
    let word =
        stop.strip_prefix('#').and_then(|rest| rest.split(|c: char| !c.is_ascii_alphanumeric()).next());
    if let Some(digits) = word.filter(|word| is_hexadecimal_color(word)) {
        return Some(format!("a colour stands in quotes: \"#{digits}\""));
    }
    match code {
        Error::ExpectedComma if before.ends_with(|c: char| c.is_ascii_digit()) && is_unit(name, first) => {
            Some("numbers stand without a unit, which the name of the field says".to_owned())
        }
        Error::ExpectedComma if !name.is_empty() && scan::skip_blank(rest).starts_with(':') => {
            Some(format!("a comma is missing before \"{name}\""))
        }
        Error::ExpectedComma if first == '(' && before.ends_with(')') => {
            Some("a comma is missing between the brackets".to_owned())
        }
        Error::ExpectedIdentifier | Error::SuggestRawIdentifier(_) => {
            let whole = before.strip_suffix(',')?;
            let digits = |text: &str| text.chars().take_while(char::is_ascii_digit).collect::<String>();
            let reversed: String = digits(&whole.chars().rev().collect::<String>());
            let (whole, part) = (reversed.chars().rev().collect::<String>(), digits(stop));
            // Numbers that have a point are two.
            let have_points =
                before.trim_end_matches(',').trim_end_matches(|c: char| c.is_ascii_digit()).ends_with('.')
                    || stop[part.len()..].starts_with('.');
            let is_number = !whole.is_empty() && !part.is_empty() && !have_points;
            is_number.then(|| format!("decimals follow a point: {whole}.{part}"))
        }
        Error::UnexpectedChar('“' | '”' | '„' | '‘' | '’' | '«' | '»') => {
            Some("strings stand in straight quotes: \"…\"".to_owned())
        }
        _ => None,
    }
}

fn is_unit(name: &str, first: char) -> bool {
    UNITS.contains(&name) || first == '°'
}
