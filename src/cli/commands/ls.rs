//! `rayfront ls SCENE QUERY`: lists the parts of a scene that a query selects.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::{Value, json};

use crate::cli::args::ModelOptions;
use crate::cli::{failure::Failure, output};
use crate::formats::ron::WrittenPart;
use crate::formats::ron::query::{Query, list, no_match};

/// `rayfront ls`.
#[derive(Args, Debug)]
pub struct Ls {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj, .stl)
    pub scene: PathBuf,
    /// Selection, such as 'Light', 'Mesh & !Material', 'Material["gl*"]' [default: all entities and materials]
    pub query: Option<String>,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// The options for reading the scene.
    #[command(flatten)]
    pub model: ModelOptions,
}

pub fn run(arguments: &Ls) -> Result<ExitCode, Failure> {
    let world = crate::formats::load_with(&arguments.scene, &arguments.model.of_size(None))?;
    let query = arguments.query.as_deref().map(|text| Query::parse(text, &world)).transpose();
    let query = query.map_err(|error| Failure::command_line(error.to_string()))?;
    let found = list(&world, query.as_ref(), &arguments.scene);
    if let Some(query) = query.filter(|_| found.is_empty() && !arguments.json) {
        output::note(no_match(&world, &query));
    }
    if arguments.json {
        let one = |(name, keys): &WrittenPart| {
            let keys: serde_json::Map<String, Value> =
                keys.iter().map(|(key, value)| ((*key).to_owned(), json!(value))).collect();
            json!({"name": name, "keys": keys})
        };
        let all: Vec<Value> = found.iter().map(one).collect();
        let json = json!({"scene": output::path_json(&arguments.scene), "found": all});
        output::print(&format!("{json}\n"))?;
    } else {
        let line = |(name, keys): &WrittenPart| {
            let keys: Vec<_> = keys.iter().map(|(key, value)| format!("{key}: {value}")).collect();
            format!("{name:?}  {}\n", keys.join(", "))
        };
        output::print(&found.iter().map(line).collect::<String>())?;
    }
    Ok(ExitCode::SUCCESS)
}
