//! The stages of the wavefront as boxes and arrows, with the items that flow between them.

use std::fmt::Write as _;

use super::milliseconds;
use crate::integrator::Stage;
use crate::study::profile::report::{ProfileReport, percent};

/// The size of a box, the gap between two, and the place of the first row, in pixels.
const BOX: [u32; 2] = [118, 64];
const GAP: u32 = 66;
const TOP: u32 = 60;

/// Draws the diagram: the darker a box, the more of the time its stage takes.
pub(super) fn svg(report: &ProfileReport) -> String {
    let runs: Vec<Stage> = report.stages_in_use().collect();
    let is_in_row = |stage: &Stage| match stage {
        Stage::Generate | Stage::Intersect | Stage::Retire | Stage::Shade => true,
        Stage::Advance | Stage::Photons => false,
        Stage::Light | Stage::Shadow | Stage::Connect => runs.contains(stage),
    };
    let row: Vec<Stage> = Stage::ALL.into_iter().filter(is_in_row).collect();
    let left = |place: usize| 10 + place as u32 * (BOX[0] + GAP);
    let width = left(row.len()) - GAP + 10;
    let below = TOP + BOX[1] + 70;
    let mut out = format!(
        "<svg class=\"drawn\" viewBox=\"0 0 {width} {}\" role=\"img\" aria-label=\"the stages of the wavefront\">\n\
<defs><marker id=\"tip\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"8\" markerHeight=\"8\" orient=\"auto\">\
<path d=\"M0 0L8 4L0 8z\" fill=\"var(--ink)\"/></marker></defs>\n",
        below + BOX[1] + 10
    );
    for (place, stage) in row.iter().enumerate() {
        draw_box(&mut out, report, *stage, [left(place), TOP]);
        if let Some(next) = row.get(place + 1) {
            let y = TOP + BOX[1] / 2;
            arrow(&mut out, &[[left(place) + BOX[0], y], [left(place + 1), y]]);
            let entering = report.flows.stages[*next as usize].entering;
            // New paths come from here; those that go on, from below.
            let count = if *stage == Stage::Generate { leaving(report, *stage) } else { entering };
            label(&mut out, [left(place) + BOX[0] + GAP / 2, y - 8], &short(count));
        }
    }
    let place = |wanted: Stage| row.iter().position(|stage| *stage == wanted).map_or(0, left);
    let (shade, intersect) = (place(Stage::Shade), place(Stage::Intersect));
    draw_box(&mut out, report, Stage::Advance, [shade, below]);
    let middle = |left: u32| left + BOX[0] / 2;
    arrow(&mut out, &[[middle(shade), TOP + BOX[1]], [middle(shade), below]]);
    let onward = leaving(report, Stage::Advance);
    let turn = below + BOX[1] / 2;
    arrow(&mut out, &[[shade, turn], [middle(intersect), turn], [middle(intersect), TOP + BOX[1]]]);
    label(&mut out, [(middle(intersect) + shade) / 2, turn - 8], &format!("{} go on", short(onward)));
    let retire = place(Stage::Retire);
    let missed = report.flows.stages[Stage::Retire as usize].entering - leaving(report, Stage::Retire);
    if missed > 0 {
        arrow(&mut out, &[[middle(retire), TOP], [middle(retire), TOP - 26]]);
        label(&mut out, [middle(retire), TOP - 34], &format!("{} hit nothing", short(missed)));
    }
    if let Some(last) = row.last().filter(|stage| matches!(stage, Stage::Shadow | Stage::Connect)) {
        let x = middle(left(row.len() - 1));
        arrow(&mut out, &[[x, TOP], [x, TOP - 26]]);
        label(&mut out, [x, TOP - 34], &format!("{} unblocked", short(leaving(report, *last))));
    }
    if runs.contains(&Stage::Photons) {
        draw_box(&mut out, report, Stage::Photons, [place(Stage::Generate), below]);
    }
    out + "</svg>\n"
}

/// Formats small numbers in full, larger ones in thousands or millions.
fn short(n: u64) -> String {
    match n {
        0..10_000 => n.to_string(),
        10_000..1_000_000 => format!("{:.0} k", n as f64 / 1e3),
        _ => format!("{:.2} M", n as f64 / 1e6),
    }
}

fn leaving(report: &ProfileReport, stage: Stage) -> u64 {
    report.flows.stages[stage as usize].leaving
}

fn draw_box(out: &mut String, report: &ProfileReport, stage: Stage, [x, y]: [u32; 2]) {
    let total: f64 = report.stages.seconds.iter().sum();
    let seconds = report.stages.seconds[stage as usize];
    let part = seconds / total.max(1e-12);
    let [width, height] = BOX;
    _ = writeln!(
        out,
        "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"6\" fill=\"var(--b)\" fill-opacity=\"{:.2}\" stroke=\"var(--ink)\"/>",
        0.9 * part
    );
    let middle = x + width / 2;
    label(out, [middle, y + 26], &format!("<tspan font-weight=\"bold\">{}</tspan>", stage.name()));
    label(out, [middle, y + 48], &format!("{}, {}", milliseconds(seconds), percent(part)));
}

/// A line with a tip at its end.
fn arrow(out: &mut String, points: &[[u32; 2]]) {
    let points: Vec<String> = points.iter().map(|[x, y]| format!("{x},{y}")).collect();
    _ = writeln!(
        out,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"var(--ink)\" marker-end=\"url(#tip)\"/>",
        points.join(" ")
    );
}

/// A text around a point; `text` is markup.
fn label(out: &mut String, [x, y]: [u32; 2], text: &str) {
    _ = writeln!(out, "<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\">{text}</text>");
}
