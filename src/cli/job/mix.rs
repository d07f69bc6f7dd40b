//! Mixing the light groups of a film.

use crate::cli::failure::Failure;
use crate::film::Film;
use crate::formats::film_file::FilmHeader;
use crate::formats::ron::query;
use crate::math::Rgb;

/// Returns the film with its light groups mixed as the header's statements say.
pub fn mixed(header: &FilmHeader, film: &Film) -> Result<Film, Failure> {
    let mut factors = vec![Rgb::WHITE; header.light_groups.len()];
    for statement in &header.note.mix {
        query::mix(statement, &header.light_groups, &mut factors)
            .map_err(|error| Failure::command_line(error.to_string()))?;
    }
    Ok(film.mixed(&factors))
}
