//! `rayfront furnace SCENE MATERIAL`: measures a material in a white furnace.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::{Value, json};

use super::load;
use crate::cli::args::ModelOptions;
use crate::cli::{failure::Failure, output};
use crate::error::in_one_line;
use crate::shading::principled::measure::MeasuredAlbedo;
use crate::study::furnace::{self, FurnacePlan, FurnaceReport, FurnaceRow, FurnaceRun, select};
use crate::world::Transport;

/// `rayfront furnace`.
#[derive(Args, Debug)]
pub struct Furnace {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj, .stl)
    pub scene: PathBuf,
    /// The name of a material, or of an entity with one material, such as "car paint"
    pub material: String,
    /// Sampled directions for each angle and roughness
    #[arg(long, value_name = "N", default_value_t = 16_384,
          value_parser = clap::value_parser!(u32).range(64..=16_777_216))]
    pub directions: u32,
    /// Texture coordinates at which the material is measured, such as 0.25,0.5 [default: the means of textures]
    #[arg(long, value_name = "U,V", allow_negative_numbers = true, value_parser = parse_uv)]
    pub uv: Option<[f32; 2]>,
    /// Look from within the body that the material encloses
    #[arg(long)]
    pub inside: bool,
    /// File for a page with plots (.html)
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// The options for reading the scene.
    #[command(flatten)]
    pub model: ModelOptions,
}

fn parse_uv(text: &str) -> Result<[f32; 2], String> {
    let number = |text: &str| text.trim().parse().ok().filter(|number: &f32| number.abs() <= 1e6);
    let both = text.split_once(',').and_then(|(u, v)| Some([number(u)?, number(v)?]));
    both.ok_or_else(|| "expected two texture coordinates, such as 0.25,0.5".into())
}

pub fn run(arguments: &Furnace) -> Result<ExitCode, Failure> {
    let Furnace { scene, material, directions, uv, inside, model, .. } = arguments;
    // BSDFs are those of the path transport, whatever the scene is rendered with.
    let (world, setup) =
        load(scene, &model.of_size(None), None, |world| world.settings.transport = Transport::Path)?;
    if let Some(path) = &arguments.html {
        super::check_is_not_read(path, &world.assets.files, "--html")?;
    }
    let id = select::material(&world, material).map_err(Failure::command_line)?;
    let plan = FurnacePlan { samples: *directions, inside: *inside, uv: *uv };
    let mut report = furnace::measure(&setup.scene, id.0, &plan).map_err(Failure::command_line)?;
    if world.assets.materials.get(id.0 as usize).is_some_and(|named| named.name.is_none()) {
        // The material of an entity may have no name but a number.
        report.material.clone_from(material);
    }
    if let Some(path) = &arguments.html {
        let page = furnace::page::html(&report, &plan).map_err(Failure::output)?;
        crate::files::replace(path, page.as_bytes())?;
    }
    let text = if arguments.json { format!("{}\n", json(arguments, &report)) } else { text(&report, &plan) };
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

fn text(report: &FurnaceReport, plan: &FurnacePlan) -> String {
    let side = if plan.inside { ", from within" } else { "" };
    let mut lines = vec![
        format!("\"{}\": {}{side}", in_one_line(&report.material), report.lobes.join(", ")),
        format!("{} directions at each angle; light of radiance 1 comes from everywhere\n", plan.samples),
    ];
    for run in &report.runs {
        lines.extend(run_lines(run, report.is_directed));
    }
    lines.extend(furnace::notes(report).into_iter().map(|note| format!("note: {note}")));
    lines.join("\n") + "\n"
}

fn run_lines(run: &FurnaceRun, is_directed: bool) -> Vec<String> {
    let whose = if run.is_own { ", the material's own" } else { "" };
    let mut lines = vec![
        format!("roughness {}{whose}", short(run.roughness)),
        " angle   returned light (R, G, B)     ±        in white    ±        density".into(),
    ];
    lines.extend(run.rows.iter().map(row_line));
    let reciprocity =
        run.reciprocity.map_or("mirror directions have no values to exchange".into(), |found| {
            format!(
                "differences of exchanged directions: mean {:.1e}, largest {:.1e}",
                found.mean, found.largest
            )
        });
    lines.push(format!(" {reciprocity}"));
    let faults = run.faults(is_directed);
    lines.push(match faults.is_empty() {
        true => " no fault found".into(),
        false => faults.iter().map(|fault| format!(" found: {fault}")).collect::<Vec<_>>().join("\n"),
    });
    lines.push(String::new());
    lines
}

fn row_line(row: &FurnaceRow) -> String {
    let FurnaceRow { degrees, own, white, .. } = row;
    let most = |errors: [f64; 3]| errors.into_iter().fold(0.0, f64::max);
    let [r, g, b] = own.mean;
    let number = |white: MeasuredAlbedo| format!("{:.4}      {:.4}", white.mean[1], most(white.error));
    let white = white.map_or(format!("{:6}      {:6}", "-", "-"), number);
    let density = row.density.map_or("mirror".into(), |check| {
        let agrees = if check.agrees() { "agrees" } else { "differs" };
        format!(
            "{agrees} (χ² {:.0} of {} cells, largest {:.1} σ)",
            check.chi_square, check.cells, check.largest
        )
    });
    format!(" {degrees:>4}°   {r:.4}  {g:.4}  {b:.4}       {:.4}   {white}   {density}", most(own.error))
}

/// A number with up to four decimals.
fn short(value: f32) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn json(arguments: &Furnace, report: &FurnaceReport) -> Value {
    let row = |row: &FurnaceRow| {
        let density = row.density.map(|check| {
            json!({
                "chi_square": check.chi_square,
                "cells": check.cells,
                "largest_deviation": check.largest,
                "agrees": check.agrees(),
            })
        });
        json!({
            "angle_degrees": row.degrees,
            "albedo": row.own.mean,
            "albedo_error": row.own.error,
            "white_albedo": row.white.map(|white| white.mean),
            "white_albedo_error": row.white.map(|white| white.error),
            "density": density,
        })
    };
    let run = |run: &FurnaceRun| {
        let reciprocity = run.reciprocity.map(|found| json!({"largest": found.largest, "mean": found.mean}));
        json!({
            "roughness": run.roughness,
            "own": run.is_own,
            "angles": run.rows.iter().map(row).collect::<Vec<_>>(),
            "reciprocity": reciprocity,
            "found": run.faults(report.is_directed),
        })
    };
    json!({
        "scene": output::path_json(&arguments.scene),
        "material": report.material,
        "lobes": report.lobes,
        "directions": arguments.directions,
        "inside": arguments.inside,
        "uv": arguments.uv,
        "runs": report.runs.iter().map(run).collect::<Vec<_>>(),
        "notes": furnace::notes(report),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_coordinates_are_two_numbers() {
        assert_eq!(parse_uv("0.25, -1"), Ok([0.25, -1.0]));
        for wrong in ["", "0.5", "a,b", "nan,0", "1,2,3", "inf,0"] {
            assert!(parse_uv(wrong).is_err(), "{wrong}");
        }
    }
}
