//! One self-contained HTML page: images, plots, tables, and the machine.

use base64::prelude::*;

use super::equal_time::EqualTime;
use super::plot::{Curve, Figure, legend};
use crate::formats::study::{Experiment, StudyFile};
use crate::study::html::escaped;
use crate::study::machine;

/// A plot that has been drawn.
pub(super) struct DrawnPlot {
    pub figure: Figure,
    pub svg: String,
    /// Errors at equal time, if the plot shows an error by samples.
    pub equal_time: Option<EqualTime>,
}

/// Images of a scene, as PNG files.
pub(super) struct Pictures {
    pub scene: String,
    pub reference: Vec<u8>,
    /// Series, x, and image.
    pub shown: Vec<(String, u32, Vec<u8>)>,
}

/// The page's section about an experiment.
pub(super) struct Section<'a> {
    pub experiment: &'a Experiment,
    pub plots: Vec<DrawnPlot>,
    pub images: Vec<Pictures>,
}

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:960px;margin:2em auto;padding:0 1em;color:#222}\
svg{max-width:100%;height:auto}table{border-collapse:collapse;margin:1em 0}td,th{padding:.2em .8em;border-bottom:1px solid #ddd;text-align:right}\
td:first-child,th:first-child{text-align:left}.wipe{position:relative;display:inline-block;line-height:0}\
.wipe img{display:block;max-width:100%;image-rendering:pixelated}.wipe .over{position:absolute;inset:0;clip-path:inset(0 50% 0 0)}\
.wipe i{position:absolute;top:0;bottom:0;left:50%;width:1px;background:#fff;mix-blend-mode:difference}input[type=range]{width:100%;max-width:640px}";

/// The slider moves the border between the two images; the list selects the left one.
const SCRIPT: &str = "for(const f of document.querySelectorAll('figure.images')){\
const o=f.querySelector('.over'),l=f.querySelector('i'),r=f.querySelector('input'),s=f.querySelector('select');\
const w=()=>{o.style.clipPath='inset(0 '+(100-r.value)+'% 0 0)';l.style.left=r.value+'%'};\
r.oninput=w;s.onchange=()=>{o.src=s.value};w();s.onchange()}";

/// Returns the whole page.
pub(super) fn html(study: &StudyFile, sections: &[Section]) -> String {
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title><style>{STYLE}</style></head>\n<body>\n<h1>{0}</h1>\n{1}",
        escaped(&study.title),
        paragraphs(&study.text)
    );
    for section in sections {
        out += &section_html(section);
    }
    let rows: String = machine::describe()
        .iter()
        .map(|(name, value)| format!("<tr><td>{name}</td><td>{}</td></tr>", escaped(value)))
        .collect();
    out += &format!("<h2>Machine</h2>\n<table>{rows}</table>\n<script>{SCRIPT}</script>\n</body></html>\n");
    out
}

fn section_html(section: &Section) -> String {
    let Experiment { name, title, text, .. } = section.experiment;
    let title = if title.is_empty() { name } else { title };
    let mut out = format!("<h2 id=\"{name}\">{}</h2>\n{}", escaped(title), paragraphs(text));
    for shown in &section.plots {
        out += &format!("<figure>{}</figure>\n", shown.svg);
        out += &speedups(&shown.figure)
            .iter()
            .map(|line| format!("<p>{}</p>\n", escaped(line)))
            .collect::<String>();
        out += &table(&shown.figure);
        let by_time = shown.equal_time.as_ref().filter(|table| !table.rows.is_empty());
        out += &by_time.map_or(String::new(), |table| time_table(shown.figure.y.label(), table));
    }
    for pictures in section.images.iter().filter(|pictures| !pictures.shown.is_empty()) {
        out += &images(pictures);
    }
    out
}

/// The values of a plot: a row per x, a column per curve.
fn table(figure: &Figure) -> String {
    let heads: String =
        figure.curves.iter().map(|curve| format!("<th>{}</th>", escaped(&legend(curve)))).collect();
    let mut xs: Vec<f64> = figure.curves.iter().flat_map(|curve| curve.points.iter().map(|p| p.0)).collect();
    xs.sort_by(f64::total_cmp);
    xs.dedup();
    let cell = |points: &[(f64, super::Estimate)], x: f64| {
        points.iter().find(|point| point.0 == x).map_or(String::new(), |(_, estimate)| {
            let margin = estimate.margin.map_or(String::new(), |margin| format!(" ± {}", number(margin)));
            format!("{}{margin}", number(estimate.mean))
        })
    };
    let rows: String = xs
        .iter()
        .map(|x| {
            let cells: String =
                figure.curves.iter().map(|curve| format!("<td>{}</td>", cell(&curve.points, *x))).collect();
            format!("<tr><td>{x}</td>{cells}</tr>\n")
        })
        .collect();
    format!(
        "<details><summary>{}</summary><table><tr><th>{}</th>{heads}</tr>\n{rows}</table></details>\n",
        escaped(figure.y.label()),
        escaped(&figure.x_label)
    )
}

/// States how much faster each curve of a scene is than the scene's last one, if the plot shows times or speeds.
fn speedups(figure: &Figure) -> Vec<String> {
    let compare = |(number, curve): (usize, &Curve)| {
        let (other, last) = figure.curves.iter().enumerate().rfind(|(_, last)| last.scene == curve.scene)?;
        let at = |x: f64| last.points.iter().find(|point| point.0 == x).map(|point| point.1.mean);
        let ratios = curve.points.iter().filter_map(|(x, one)| figure.y.speedup(one.mean, at(*x)?));
        let ratios: Vec<f64> = ratios.filter(|ratio| ratio.is_finite()).collect();
        let (least, most) = ratios.iter().fold((f64::MAX, 0.0f64), |(a, b), r| (a.min(*r), b.max(*r)));
        let range = if ratios.len() < 2 { format!("{most:.2}") } else { format!("{least:.2} to {most:.2}") };
        let is_said = number != other && !ratios.is_empty();
        is_said.then(|| format!("{}: {range} times as fast as {}.", curve.label, last.label))
    };
    figure.curves.iter().enumerate().filter_map(compare).collect()
}

/// Errors at equal time: a row per time, a column per curve.
fn time_table(error: &str, table: &EqualTime) -> String {
    let heads: String = table.labels.iter().map(|label| format!("<th>{}</th>", escaped(label))).collect();
    let cell = |error: &Option<f64>| format!("<td>{}</td>", error.map_or(String::new(), number));
    let row = |(time, errors): &(f64, Vec<Option<f64>>)| {
        format!("<tr><td>{}</td>{}</tr>\n", number(*time), errors.iter().map(cell).collect::<String>())
    };
    let rows: String = table.rows.iter().map(row).collect();
    format!(
        "<details open><summary>{} at equal time</summary><table><tr><th>CPU time, s</th>{heads}</tr>\n{rows}</table></details>\n",
        escaped(error)
    )
}

/// Formats with three decimals, or in scientific notation with two.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-2..1e5).contains(&value.abs()) {
        format!("{value:.3}")
    } else {
        format!("{value:.2e}")
    }
}

fn images(pictures: &Pictures) -> String {
    let data = |png: &[u8]| format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png));
    let options: String = pictures
        .shown
        .iter()
        .map(|(series, x, png)| format!("<option value=\"{}\">{}, {x}</option>", data(png), escaped(series)))
        .collect();
    format!(
        "<figure class=\"images\"><div class=\"wipe\"><img alt=\"the reference\" src=\"{}\"><img class=\"over\" alt=\"an image\"><i></i></div>\
<br><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"how much of the image is seen before the reference\">\
<figcaption>{}: <select aria-label=\"which image\">{options}</select> on the left, the reference on the right</figcaption></figure>\n",
        data(&pictures.reference),
        escaped(&pictures.scene)
    )
}

fn paragraphs(text: &str) -> String {
    let parts = text.split("\n\n").map(str::trim).filter(|part| !part.is_empty());
    parts.map(|part| format!("<p>{}</p>\n", escaped(part))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Estimate;
    use super::*;
    use crate::formats::study::Measurement;

    #[test]
    fn speedups_compare_with_the_last_curve_of_the_scene() {
        let curve = |label: &str, scene, values: [f64; 2]| Curve {
            label: label.into(),
            scene,
            points: [1.0, 8.0].into_iter().zip(values.map(|mean| Estimate { mean, margin: None })).collect(),
            fit: None,
        };
        let curves = vec![
            curve("a, wave", 0, [10.0, 2.0]),
            curve("a, recursion", 0, [8.0, 5.0]),
            curve("b, wave", 1, [1.0, 1.0]),
            curve("b, recursion", 1, [2.0, 4.0]),
        ];
        let figure = |y: Measurement| Figure {
            title: "t".into(),
            x_label: "lanes".into(),
            y: y.into(),
            log: [false; 2],
            curves: curves.clone(),
        };
        let lines = speedups(&figure(Measurement::NanosecondsPerRay));
        assert_eq!(
            lines,
            [
                "a, wave: 0.80 to 2.50 times as fast as a, recursion.",
                "b, wave: 2.00 to 4.00 times as fast as b, recursion."
            ]
        );
        assert_eq!(
            speedups(&figure(Measurement::Mrays))[1],
            "b, wave: 0.25 to 0.50 times as fast as b, recursion."
        );
        assert!(speedups(&figure(Measurement::Mse)).is_empty());
    }
}
