//! Statements that mix the light groups of a film: `"ceiling lamp".power_w *= 2`.

use std::path::Path;

use super::set::{Operator, statement};
use super::{QueryError, QueryReader, is_like};
use crate::error::{LoadError, did_you_mean};
use crate::formats::ron::parts::TextPart;
use crate::formats::ron::source::{Raw, SceneText};
use crate::math::Rgb;

/// The fields of lights and materials to which their light is proportional.
const FIELDS: [&str; 4] = ["power_w", "irradiance", "radiance", "emission"];

/// Multiplies or divides the factors of the light groups whose names a statement gives (`*` stands for any text).
pub fn mix(text: &str, names: &[String], factors: &mut [Rgb]) -> Result<(), QueryError> {
    let mut reader = QueryReader::new(text)?;
    let start = reader.rest.trim_start();
    let name = reader.string()?;
    let quoted = &start[..start.len() - reader.rest.len()];
    let statement = statement(text, reader)?;
    let field = *statement.path.last().unwrap_or(&"");
    if !FIELDS.contains(&field) {
        let hint = did_you_mean(field, FIELDS);
        let reason = format!("light is proportional to one of {}{hint}", FIELDS.join(", "));
        return Err(QueryError::new(text, field, reason));
    }
    let of_value = |reason: String| QueryError::new(text, statement.value, reason);
    if !matches!(statement.operator, Operator::Times | Operator::Over) {
        return Err(of_value("a film knows by how much light changes, not what it was: use *= or /=".into()));
    }
    let part = TextPart::new(statement.value, Path::new(""));
    let source = SceneText::new(std::slice::from_ref(&part), 0.0);
    let value = source.color(Raw(statement.value), "a factor", None).map_err(|error| match error {
        LoadError::At { reason, .. } => of_value(reason),
        other => of_value(other.to_string()),
    })?;
    let factor = match statement.operator {
        Operator::Over if value.to_array().contains(&0.0) => {
            return Err(of_value("nothing is divided by 0".into()));
        }
        Operator::Over => value.map(|value| 1.0 / value),
        _ => value,
    };
    let mut is_known = false;
    for (_, known) in names.iter().zip(factors).filter(|(known, _)| **known == name || is_like(known, &name))
    {
        (is_known, *known) = (true, *known * factor);
    }
    if is_known {
        return Ok(());
    }
    let hint = did_you_mean(&name, names.iter().map(String::as_str));
    let all = names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
    Err(QueryError::new(text, quoted, format!("the film has no such light group{hint}: it has {all}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mixed(text: &str) -> Result<[Rgb; 2], String> {
        let names = ["lamp".to_owned(), "window 1".to_owned()];
        let mut factors = [Rgb::WHITE; 2];
        mix(text, &names, &mut factors).map(|()| factors).map_err(|error| error.to_string())
    }

    #[test]
    fn statements_scale_the_groups_that_they_name() {
        assert_eq!(mixed("\"lamp\".power_w *= 2"), Ok([Rgb::splat(2.0), Rgb::WHITE]));
        assert_eq!(mixed("\"w*\".light.radiance /= (2, 4, 1)"), Ok([Rgb::WHITE, Rgb::new(0.5, 0.25, 1.0)]));
        assert_eq!(mixed("\"*\".emission *= \"red\""), Ok([Rgb::new(1.0, 0.0, 0.0); 2]));
        for (text, words) in [
            ("\"lamb\".power_w *= 2", "did you mean \"lamp\""),
            ("\"lamp\".power_w = 2", "use *= or /="),
            ("\"lamp\".power *= 2", "power_w"),
            ("\"lamp\".power_w /= 0", "divided by 0"),
            ("\"lamp\".power_w *= -1", "-1"),
            ("lamp.power_w *= 1", "text in quotes"),
        ] {
            let error = mixed(text).expect_err(text);
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
