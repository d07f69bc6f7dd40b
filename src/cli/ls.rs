//! `rayfront ls SCENE QUERY`: the parts of a scene that a query selects.

use std::collections::HashSet;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::{Value, json};

use super::args::ModelOptions;
use super::{Failure, output};
use crate::formats::ron::query::{Query, Selected, nothing_meant, select};
use crate::formats::ron::{Portrait, portrait};

/// `rayfront ls`.
#[derive(Args, Debug)]
pub struct Ls {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj)
    pub scene: PathBuf,
    /// What to select, such as 'Light', 'Mesh & !Material', 'Material["gl*"]' [default: all entities and materials]
    pub query: Option<String>,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// How the scene is read.
    #[command(flatten)]
    pub model: ModelOptions,
}

pub(super) fn run(arguments: &Ls) -> Result<ExitCode, Failure> {
    let world = crate::formats::load_with(&arguments.scene, &(&arguments.model).into())?;
    let query = Query::parse(arguments.query.as_deref().unwrap_or("Entity"))
        .map_err(|error| Failure::command_line(error.to_string()))?;
    let Portrait { materials, entities, .. } = portrait(&world, &arguments.scene);
    let mut found: Vec<(String, Vec<(&str, String)>)> = match select(&world, &query) {
        Selected::Materials(ids) => {
            let of = |id: crate::world::MaterialId| {
                let (name, text) = materials.get((id.0 as usize).checked_sub(1)?)?.clone();
                Some((name, vec![("material", text)]))
            };
            ids.into_iter().filter_map(of).collect()
        }
        Selected::Entities(meant) => {
            let order = world.in_order().into_iter().zip(entities);
            let meant: HashSet<_> = meant.into_iter().collect();
            order.filter(|(entity, _)| meant.contains(entity)).map(|(_, portrait)| portrait).collect()
        }
    };
    if arguments.query.is_none() {
        found.extend(materials.into_iter().map(|(name, text)| (name, vec![("material", text)])));
    }
    if found.is_empty() && arguments.query.is_some() && !arguments.json {
        output::tell(nothing_meant(&world, &query));
    }
    if arguments.json {
        let one = |(name, keys): &(String, Vec<(&str, String)>)| {
            let keys: serde_json::Map<String, Value> =
                keys.iter().map(|(key, value)| ((*key).to_owned(), json!(value))).collect();
            json!({"name": name, "keys": keys})
        };
        let all: Vec<Value> = found.iter().map(one).collect();
        output::say(
            &format!("{}\n", json!({"scene": output::path_json(&arguments.scene), "found": all})),
            false,
        )?;
    } else {
        let line = |(name, keys): &(String, Vec<(&str, String)>)| {
            let keys: Vec<_> = keys.iter().map(|(key, value)| format!("{key}: {value}")).collect();
            format!("{name:?}  {}\n", keys.join(", "))
        };
        output::say(&found.iter().map(line).collect::<String>(), false)?;
    }
    Ok(ExitCode::SUCCESS)
}
