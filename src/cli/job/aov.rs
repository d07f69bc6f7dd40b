//! `--aov`: output variables in addition to the image, in an OpenEXR file.

use std::collections::HashMap;
use std::path::PathBuf;

use serde_json::{Map, Value};

use super::outputs::Outputs;
use crate::film::{Film, FilmChannel};
use crate::formats::film_file::FilmHeader;
use crate::formats::picture::ImageEncoding;
use crate::render::{light_channels, names_of_ids};
use crate::scene::CompiledScene;
use crate::world::Aov;

/// True if a file of this name can hold output variables.
pub fn holds(path: &std::path::Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"))
}

/// Returns the outputs, with an additional file if none of them can hold the variables.
pub fn with_file(outputs: &[PathBuf], aovs: &[Aov]) -> Vec<PathBuf> {
    let mut outputs = outputs.to_vec();
    if let Some(first) = outputs.first()
        && !aovs.is_empty()
        && !outputs.iter().any(|path| holds(path))
    {
        let beside = first.with_extension("aov.exr");
        outputs.push(beside);
    }
    outputs
}

/// Returns the layers of light groups, if some output can hold them.
pub fn light_layers(film: &Film, header: &FilmHeader, outputs: &Outputs) -> Vec<FilmChannel> {
    let is_held =
        outputs.stdout_image == Some(ImageEncoding::OpenExr) || outputs.images.iter().any(|path| holds(path));
    if is_held { light_channels(film, &header.light_groups) } else { Vec::new() }
}

/// Returns the names of the ids in a file, as JSON in ASCII; `None` if there are no ids.
pub fn manifest(
    channels: &[FilmChannel],
    entities: &HashMap<u32, String>,
    scene: &CompiledScene,
) -> Option<String> {
    let mut tables = Map::new();
    for channel in channels {
        let Some(names) = names_of_ids(channel, entities, scene) else { continue };
        let table: Map<String, Value> =
            names.into_iter().map(|(id, name)| (id.to_string(), name.into())).collect();
        tables.insert(channel.name.clone().into_owned(), table.into());
    }
    (!tables.is_empty()).then(|| ascii(&Value::from(tables).to_string()))
}

/// Returns JSON in ASCII: OpenEXR's strings are bytes without an encoding.
pub fn ascii(json: &str) -> String {
    let mut out = String::with_capacity(json.len());
    for c in json.chars() {
        if c.is_ascii() {
            out.push(c);
        } else {
            let mut units = [0; 2];
            c.encode_utf16(&mut units).iter().for_each(|unit| out.push_str(&format!("\\u{unit:04x}")));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exr_file_is_added_only_if_no_output_holds_aovs() {
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        let (png, exr) = (paths(&["out/a.png", "b.hdr"]), paths(&["a.png", "b.EXR"]));
        assert_eq!(with_file(&png, &[]), png);
        assert_eq!(with_file(&png, &[Aov::Depth]), paths(&["out/a.png", "b.hdr", "out/a.aov.exr"]));
        assert_eq!(with_file(&exr, &[Aov::Depth]), exr);
    }

    #[test]
    fn ascii_json_parses_to_the_same_names() {
        let json = Value::from("\"Zoë\" 球 🎱").to_string();
        assert!(ascii(&json).is_ascii());
        assert_eq!(serde_json::from_str::<Value>(&ascii(&json)).unwrap(), "\"Zoë\" 球 🎱");
    }
}
