//! `rayfront check SCENE`: what is probably not as it was meant.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use super::Failure;
use super::args::{ModelOptions, PictureOptions};
use crate::check::{Finding, check};
use crate::integrator::Frame;
use crate::world::{Settings, Sharing};

/// `rayfront check`.
#[derive(Args, Debug)]
pub struct Check {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj)
    pub scene: PathBuf,
    /// What of a model is shown.
    #[command(flatten)]
    pub model: ModelOptions,
    /// What the image would look like.
    #[command(flatten)]
    pub picture: PictureOptions,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
}

pub(super) fn run(arguments: &Check) -> Result<ExitCode, Failure> {
    let path = &arguments.scene;
    let mut world = crate::formats::load_with(path, &(&arguments.model).into())?;
    arguments.picture.apply(&mut world);
    let scene = crate::compile::compile(&world, arguments.picture.camera.as_deref())
        .map_err(|error| Failure(format!("{}: {error}", path.display())))?;
    let warnings = scene.warnings.clone();
    let frame = Frame::new(scene, &Settings { sharing: Sharing::Off, ..world.settings.clone() });
    let findings = check(&world, &frame, true);
    if arguments.json {
        let findings: Vec<_> = findings
            .iter()
            .map(|Finding { about, what, remedy }| json!({"about": about, "what": what, "remedy": remedy}))
            .collect();
        println!("{}", json!({"scene": path, "warnings": warnings, "findings": findings}));
    } else {
        warnings.iter().for_each(|warning| println!("note: {warning}"));
        findings.iter().for_each(|finding| println!("found: {finding}"));
        if findings.is_empty() {
            println!("nothing is wrong with {}, as far as can be told without rendering it", path.display());
        }
    }
    Ok(if findings.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
