//! The rate of frames, and the names of their files.

use std::path::{Path, PathBuf};

use crate::cli::failure::Failure;
use crate::cli::job::Outputs;

/// Returns frames per second as a fraction: a whole number, a rate of television (24000/1001 and the like), or
/// thousandths.
pub fn rate(fps: f32) -> [u32; 2] {
    let whole = f64::from(fps).round();
    let television = (f64::from(fps) * 1.001).round();
    match f64::from(fps) {
        fps if (fps - whole).abs() < 1e-6 => [whole as u32, 1],
        fps if (fps * 1.001 - television).abs() < 0.001 && television > 0.0 => {
            [1000 * television as u32, 1001]
        }
        fps => [(fps * 1000.0).round() as u32, 1000],
    }
}

/// Returns the outputs with a frame's number in their names.
pub fn named(outputs: &Outputs, frame: u32, several: bool) -> Result<Outputs, Failure> {
    let name = |path: &PathBuf| with_number(path, frame, several);
    Ok(Outputs {
        images: outputs.images.iter().map(name).collect::<Result<_, _>>()?,
        film: outputs.film.as_ref().map(name).transpose()?,
        ..outputs.clone()
    })
}

/// Replaces the last run of # in the file's name by the number, with as many digits. Several frames need such a run.
fn with_number(path: &Path, frame: u32, several: bool) -> Result<PathBuf, Failure> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    is_unicode(path, '#')?;
    let Some(last) = name.rfind('#') else {
        if !several {
            return Ok(path.to_owned());
        }
        let path = path.display();
        return Err(Failure::command_line(format!(
            "{path}: for several frames the name needs #### where their numbers go, such as shot.####.png"
        )));
    };
    let start = name[..=last].trim_end_matches('#').len();
    let width = last + 1 - start;
    Ok(path.with_file_name(format!("{}{frame:0width$}{}", &name[..start], &name[last + 1..])))
}

/// Refuses names with a placeholder that are not Unicode: filling it in would change other parts of them.
pub fn is_unicode(path: &Path, placeholder: char) -> Result<(), Failure> {
    let text = path.to_string_lossy();
    if path.to_str().is_none() && text.contains(placeholder) {
        let text = crate::error::in_one_line(&text);
        return Err(Failure::command_line(format!(
            "{text}: names in which something is filled in must be in UTF-8: name it otherwise"
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_rates_become_fractions() {
        assert_eq!(
            [24.0, 23.976, 29.97, 59.94].map(rate),
            [[24, 1], [24000, 1001], [30000, 1001], [60000, 1001]]
        );
        assert_eq!([12.5, 0.25].map(rate), [[12500, 1000], [250, 1000]]);
    }

    #[test]
    fn frame_number_replaces_the_last_run_of_hash_signs() {
        let name = |path: &str, several| with_number(Path::new(path), 7, several).ok();
        assert_eq!(name("out#/shot.####.png", true), Some("out#/shot.0007.png".into()));
        assert_eq!(name("é#.png", true), Some("é7.png".into()));
        assert_eq!((name("a.png", false), name("a.png", true)), (Some("a.png".into()), None));
    }
}
