//! The measurements as a page with plots.

use super::{FurnacePlan, FurnaceReport, FurnaceRow, FurnaceRun, notes};
use crate::shading::principled::measure::MeasuredAlbedo;
use crate::study::experiment::fit::Estimate;
use crate::study::experiment::plot::{Curve, Figure, PlottedQuantity, svg};
use crate::study::html::{document, escaped, table};

/// Returns the page; the error says why a plot could not be drawn.
pub fn html(report: &FurnaceReport, plan: &FurnacePlan) -> Result<String, String> {
    let side = if plan.inside { " from within" } else { "" };
    let mut body = format!(
        "<p>Lobes: {}. {} sampled directions at each angle{side}. Light of radiance 1 comes from everywhere: \
a surface that absorbs nothing returns 1.</p>\n",
        escaped(&report.lobes.join(", ")),
        plan.samples
    );
    body += &format!("<figure>{}</figure>\n", svg(&own_figure(report))?);
    if report.runs.iter().all(|run| run.rows.iter().all(|row| row.white.is_some())) {
        body += &format!("<figure>{}</figure>\n", svg(&white_figure(report))?);
    }
    for run in &report.runs {
        body += &section(run, report.is_directed);
    }
    body.extend(notes(report).into_iter().map(|note| format!("<p>Note: {}.</p>\n", escaped(note))));
    Ok(document(&format!("{} in a white furnace", report.material), &body))
}

/// The channels of the material at its own roughness.
fn own_figure(report: &FurnaceReport) -> Figure {
    let run = &report.runs[0];
    // In the order of the colours of plots, so that each is about its own.
    let curves = [("blue", 2), ("red", 0), ("green", 1)]
        .map(|(name, channel)| curve(name.to_owned(), run, |row| Some(row.own), channel));
    figure(format!("{}, as it is", report.material), curves.into())
}

/// The material in white, at each roughness.
fn white_figure(report: &FurnaceReport) -> Figure {
    let label = |run: &FurnaceRun| {
        let whose = if run.is_own { " (its own)" } else { "" };
        format!("roughness {}{whose}", run.roughness)
    };
    let curves = report.runs.iter().map(|run| curve(label(run), run, |row| row.white, 1));
    figure(format!("{}, in white", report.material), curves.collect())
}

fn figure(title: String, curves: Vec<Curve>) -> Figure {
    let x_label = "angle between the normal and the direction to the viewer, degrees".into();
    Figure { title, x_label, y: PlottedQuantity::Albedo, log: [false; 2], curves }
}

fn curve(
    label: String,
    run: &FurnaceRun,
    albedo: impl Fn(&FurnaceRow) -> Option<MeasuredAlbedo>,
    channel: usize,
) -> Curve {
    // Two standard errors: the probability that the true value is within is 95 %.
    let point = |row: &FurnaceRow| {
        let MeasuredAlbedo { mean, error } = albedo(row)?;
        Some((row.degrees, Estimate { mean: mean[channel], margin: Some(2.0 * error[channel]) }))
    };
    Curve { label, scene: 0, points: run.rows.iter().filter_map(point).collect(), fit: None }
}

fn section(run: &FurnaceRun, is_directed: bool) -> String {
    let whose = if run.is_own { ", the material's own" } else { "" };
    let row = |row: &FurnaceRow| {
        let [r, g, b] = row.own.mean.map(|mean| format!("{mean:.4}"));
        let density = row.density.map_or("mirror".into(), |check| {
            format!(
                "{} (χ² {:.0}, {} cells)",
                if check.agrees() { "agrees" } else { "differs" },
                check.chi_square,
                check.cells
            )
        });
        let number = |white: MeasuredAlbedo| format!("{:.4} ± {:.4}", white.mean[1], white.error[1]);
        let white = row.white.map_or("-".into(), number);
        [format!("{}°", row.degrees), r, g, b, white, density]
    };
    let faults = run.faults(is_directed);
    let found = match faults.is_empty() {
        true => "No fault found.".into(),
        false => format!("Found: {}.", faults.join("; ")),
    };
    format!(
        "<h2>Roughness {}{whose}</h2>\n{}<p>{}</p>\n",
        run.roughness,
        table(&["angle", "red", "green", "blue", "in white", "density"], run.rows.iter().map(row)),
        escaped(&found)
    )
}
