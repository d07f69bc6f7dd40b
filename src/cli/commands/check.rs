//! `rayfront check SCENE`: reports probable mistakes in a scene.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use super::load;
use crate::check::{check, not_found};
use crate::cli::args::{ModelOptions, PictureOptions};
use crate::cli::failure::{Failure, Fault};
use crate::cli::output;
use crate::error::{Diagnostic, Severity};
use crate::view::json_of;

/// `rayfront check`.
#[derive(Args, Debug)]
pub struct Check {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj, .stl)
    pub scene: PathBuf,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// The options for reading the scene.
    #[command(flatten)]
    pub model: ModelOptions,
    /// The options of the image.
    #[command(flatten)]
    pub picture: PictureOptions,
}

pub fn run(arguments: &Check) -> Result<ExitCode, Failure> {
    let Check { scene: path, model, picture, .. } = arguments;
    let options = model.of_size(picture.sampling.size);
    let (world, setup) =
        load(path, &options, picture.sampling.camera.as_deref(), |world| picture.apply(world))?;
    let mut findings = check(&world, &setup, true);
    // A rendering reports these as warnings, too.
    let others = not_found(&setup.scene.warnings, &findings).cloned();
    let (more, notes): (Vec<_>, Vec<_>) = others.partition(|other| other.severity == Severity::Warning);
    findings.extend(more);
    if arguments.json {
        let notes: Vec<_> = notes.iter().map(Diagnostic::to_string).collect();
        let findings: Vec<_> = findings.iter().map(json_of).collect();
        let json = json!({"scene": output::path_json(path), "notes": notes, "findings": findings});
        output::print(&format!("{json}\n"))?;
    } else {
        let mut text: String = notes.iter().map(|note| format!("note: {note}\n")).collect();
        text.extend(findings.iter().map(|finding| format!("found: {finding}\n")));
        if findings.is_empty() {
            let path = path.display();
            text += &format!("nothing is wrong with {path}, as far as can be told without rendering it\n");
        }
        output::print(&text)?;
    }
    Ok(if findings.is_empty() { ExitCode::SUCCESS } else { Fault::File.code() })
}
