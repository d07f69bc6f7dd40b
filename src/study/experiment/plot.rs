//! Curves with confidence bands, as SVG and as pixels.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::fit::{Estimate, Fit};
use crate::formats::study::Measurement;

/// Width and height of the area above the legend, in pixels.
const SIZE: (u32, u32) = (900, 520);
/// Height of a row of the legend.
const ROW: u32 = 24;
/// The width of the text of a curve where a row of the legend holds two, in pixels.
const HALF_ROW: u32 = 340;
/// The sizes of titles: the largest, and the smallest, at which they are cut off.
const TITLE: [u32; 2] = [20, 12];
/// Colours of the curves, which most eyes can tell apart (Okabe and Ito, 2008).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
];
const FONT: &str = "sans-serif";
/// A curve with more points is a line without markers.
const MOST_MARKERS: usize = 60;
/// The margin around the plot, in pixels.
const MARGIN: u32 = 12;

/// A curve.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The human-readable label.
    pub label: String,
    /// The number of its scene.
    pub scene: usize,
    /// The points, from left to right.
    pub points: Vec<(f64, Estimate)>,
    /// The power fitted to the points, if requested.
    pub fit: Option<Fit>,
}

/// A quantity along the y axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlottedQuantity {
    /// A measurement of a study.
    Measured(Measurement),
    /// The fraction of light that a material returns.
    Albedo,
    /// The items of a queue.
    Items,
    /// Billions of operations per second.
    Gigaoperations,
}

impl From<Measurement> for PlottedQuantity {
    fn from(measurement: Measurement) -> Self {
        PlottedQuantity::Measured(measurement)
    }
}

impl PlottedQuantity {
    /// Its label, with the unit.
    pub fn label(self) -> &'static str {
        match self {
            PlottedQuantity::Measured(measurement) => measurement.label(),
            PlottedQuantity::Albedo => "returned light (1: all)",
            PlottedQuantity::Items => "items",
            PlottedQuantity::Gigaoperations => "billions of operations per second",
        }
    }

    /// True if the values may be negative.
    pub fn is_signed(self) -> bool {
        matches!(self, PlottedQuantity::Measured(measurement) if measurement.is_signed())
    }

    /// True if the axis begins at 0 unless it is logarithmic: differences of a fraction of a per cent are the point of
    /// plots of returned light.
    fn begins_at_zero(self) -> bool {
        self != PlottedQuantity::Albedo
    }

    /// See [`Measurement::speedup`].
    pub fn speedup(self, one: f64, other: f64) -> Option<f64> {
        match self {
            PlottedQuantity::Measured(measurement) => measurement.speedup(one, other),
            PlottedQuantity::Albedo | PlottedQuantity::Items | PlottedQuantity::Gigaoperations => None,
        }
    }
}

/// Curves over common axes.
#[derive(Clone, Debug)]
pub struct Figure {
    /// The title above the plot.
    pub title: String,
    /// The label of the x axis, with its unit.
    pub x_label: String,
    /// The quantity along the y axis.
    pub y: PlottedQuantity,
    /// True for each axis that is logarithmic.
    pub log: [bool; 2],
    /// The curves, at least one.
    pub curves: Vec<Curve>,
}

impl Figure {
    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        let rows = self.curves.len().div_ceil(self.columns()) as u32;
        (SIZE.0, SIZE.1 + (rows + 1) * ROW + 12)
    }

    /// The number of curves in a row of the legend.
    fn columns(&self) -> usize {
        let is_short = |curve| width(&legend(curve), 14) <= HALF_ROW;
        if self.curves.iter().all(is_short) { 2 } else { 1 }
    }

    /// States what bands and dashes are, as far as there are any.
    fn note(&self) -> String {
        let bands = self.curves.iter().flat_map(|curve| &curve.points).any(|(_, y)| y.margin.is_some());
        let dashes = self.curves.iter().any(|curve| curve.fit.is_some());
        let parts = [(bands, "band: 95 % confidence of the mean"), (dashes, "dashed: fitted power")];
        let parts = parts.into_iter().filter(|(is_drawn, _)| *is_drawn).map(|(_, text)| text);
        parts.collect::<Vec<_>>().join("; ")
    }
}

/// The width of a text in pixels; 0 if the font cannot be read.
fn width(text: &str, size: u32) -> u32 {
    let font = (FONT, size).into_font();
    register_font().ok().and_then(|()| font.box_size(text).ok()).map_or(0, |(width, _)| width)
}

/// The title as it fits above the plot, and its size: a smaller one if need be, and shorter at the smallest.
fn caption(title: &str) -> (String, u32) {
    let fits = |text: &str, size| width(text, size) <= SIZE.0 - 2 * MARGIN;
    if let Some(size) = (TITLE[1]..=TITLE[0]).rev().find(|size| fits(title, *size)) {
        return (title.to_owned(), size);
    }
    let ends = title.char_indices().map(|(at, _)| format!("{}…", &title[..at]));
    (ends.take_while(|text| fits(text, TITLE[1])).last().unwrap_or_default(), TITLE[1])
}

/// Draws the figure as SVG.
pub fn svg(figure: &Figure) -> Result<String, String> {
    register_font()?;
    let mut text = String::new();
    draw(figure, SVGBackend::with_string(&mut text, figure.size()).into_drawing_area())?;
    Ok(text)
}

/// Draws the figure in sRGB, three bytes per pixel, row by row.
pub fn pixels(figure: &Figure) -> Result<Vec<u8>, String> {
    register_font()?;
    let (width, height) = figure.size();
    let mut bytes = vec![255; 3 * width as usize * height as usize];
    draw(figure, BitMapBackend::with_buffer(&mut bytes, (width, height)).into_drawing_area())?;
    Ok(bytes)
}

/// Draws a bar of evenly spaced colours above the texts of its ends, in sRGB, three bytes per pixel, row by row. Where
/// there is no room for both texts, the first is left out.
pub fn color_bar(size: [u32; 2], colors: &[[u8; 3]], [low, high]: [&str; 2]) -> Result<Vec<u8>, String> {
    const TEXT: u32 = 11;
    register_font()?;
    let mut bytes = vec![255; 3 * size[0] as usize * size[1] as usize];
    let area = BitMapBackend::with_buffer(&mut bytes, (size[0], size[1])).into_drawing_area();
    let failed = |error: DrawingAreaErrorKind<_>| error.to_string();
    let bottom = size[1].saturating_sub(TEXT + 5) as i32;
    for x in 0..size[0] {
        let place = x as f32 / size[0].max(2).saturating_sub(1) as f32 * (colors.len() - 1) as f32;
        let (first, part) = (place as usize, place.fract());
        let [a, b] = [first, first + 1].map(|at| colors[at.min(colors.len() - 1)]);
        let mixed = |i: usize| (f32::from(a[i]) * (1.0 - part) + f32::from(b[i]) * part + 0.5) as u8;
        let color = RGBColor(mixed(0), mixed(1), mixed(2));
        let column = Rectangle::new([(x as i32, 2), (x as i32 + 1, bottom)], color.filled());
        area.draw(&column).map_err(failed)?;
    }
    let right = size[0].saturating_sub(width(high, TEXT) + 2);
    let has_room = right > width(low, TEXT) + 2 * MARGIN;
    for (text, x) in [(low, 2), (high, right)].into_iter().skip(usize::from(!has_room)) {
        area.draw(&Text::new(text, (x as i32, bottom + 2), (FONT, TEXT))).map_err(failed)?;
    }
    area.present().map_err(failed)?;
    drop(area);
    Ok(bytes)
}

/// Registers the program's own font, since the machine may have none.
fn register_font() -> Result<(), String> {
    plotters::style::register_font(FONT, FontStyle::Normal, dejavu::sans::regular())
        .map_err(|_| "the font of plots cannot be read".into())
}

/// An axis, in plotted coordinates: the values or their logarithms.
#[derive(Clone)]
struct Scale {
    log: bool,
    from: f64,
    to: f64,
}

impl Scale {
    fn new(log: bool, begins_at_zero: bool, values: impl Iterator<Item = f64>) -> Scale {
        let drawn = values
            .filter(|v| v.is_finite() && (!log || *v > 0.0))
            .map(|v| if log { libm::log10(v) } else { v });
        let (from, to) = drawn.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
        if from > to {
            return Scale { log, from: 0.0, to: 1.0 };
        }
        let from = if log || !begins_at_zero { from } else { from.min(0.0) };
        let least = if begins_at_zero { 0.1 } else { 0.01 };
        let margin = 0.05 * (to - from).max(if log { 0.2 } else { to.abs().max(1e-9) * least });
        Scale { log, from: if log || !begins_at_zero { from - margin } else { from }, to: to + margin }
    }

    /// The plotted coordinate of a value; a logarithmic axis puts values of 0 or less at its lower end.
    fn place(&self, value: f64) -> f64 {
        match self.log {
            true if value > 0.0 => libm::log10(value).clamp(self.from, self.to),
            true => self.from,
            false => value.clamp(self.from, self.to),
        }
    }

    /// The coordinates of labelled grid lines.
    fn marks(&self) -> Vec<f64> {
        let span = self.to - self.from;
        let steps: &[f64] = match self.log {
            // Several marks per power of ten if the axis spans few of them.
            true if span < 1.0 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0],
            true if span < 2.5 => &[1.0, 2.0, 5.0],
            true => &[1.0],
            false => return self.even_marks(),
        };
        let powers = self.from.floor() as i32..=self.to.ceil() as i32;
        let every = if steps.len() == 1 { (span / 8.0).ceil().max(1.0) as i32 } else { 1 };
        let marks = powers
            .filter(|power| power.rem_euclid(every) == 0)
            .flat_map(|power| steps.iter().map(move |step| f64::from(power) + libm::log10(*step)));
        marks.filter(|mark| (self.from..=self.to).contains(mark)).collect()
    }

    fn even_marks(&self) -> Vec<f64> {
        let rough = (self.to - self.from) / 6.0;
        let power = libm::pow(10.0, libm::log10(rough).floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|s| s * power >= rough).unwrap_or(10.0) * power;
        let first = (self.from / step).ceil() as i64;
        let last = (self.to / step).floor() as i64;
        (first..=last).map(|i| i as f64 * step).collect()
    }

    /// The label of a mark.
    fn text(&self, place: f64) -> String {
        let value = if self.log { libm::pow(10.0, place) } else { place };
        if value != 0.0 && !(1e-3..1e5).contains(&value.abs()) {
            return format!("{value:.0e}");
        }
        let text = format!("{value:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}

impl Ranged for Scale {
    type FormatOption = plotters::coord::ranged1d::DefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, (first, last): (i32, i32)) -> i32 {
        let part = (place - self.from) / (self.to - self.from);
        first + (f64::from(last - first) * part).round() as i32
    }

    fn key_points<H: plotters::coord::ranged1d::KeyPointHint>(&self, _: H) -> Vec<f64> {
        self.marks()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.from..self.to
    }
}

fn draw<B: DrawingBackend>(figure: &Figure, area: DrawingArea<B, Shift>) -> Result<(), String> {
    let failed = |error: &dyn std::fmt::Display| format!("{}: cannot plot: {error}", figure.title);
    area.fill(&WHITE).map_err(|error| failed(&error))?;
    let (above, below) = area.split_vertically(SIZE.1);
    let points = || figure.curves.iter().flat_map(|curve| &curve.points);
    let x = Scale::new(figure.log[0], true, points().map(|(x, _)| *x));
    let signed = figure.y.is_signed();
    let y = Scale::new(figure.log[1], figure.y.begins_at_zero(), points().flat_map(|(_, y)| ends(y, signed)));
    let (title, size) = caption(&figure.title);
    let mut chart = ChartBuilder::on(&above)
        .caption(&title, (FONT, size))
        .margin(MARGIN)
        .x_label_area_size(48)
        .y_label_area_size(84)
        .build_cartesian_2d(x.clone(), y.clone())
        .map_err(|error| failed(&error))?;
    chart
        .configure_mesh()
        .x_desc(&figure.x_label)
        .y_desc(figure.y.label())
        .x_label_formatter(&|place| x.text(*place))
        .y_label_formatter(&|place| y.text(*place))
        .label_style((FONT, 14))
        .axis_desc_style((FONT, 16))
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(|error| failed(&error))?;
    for (number, curve) in figure.curves.iter().enumerate() {
        let color = color(number);
        let band = band(curve, &x, &y, signed);
        chart.draw_series([Polygon::new(band, color.mix(0.18))]).map_err(|error| failed(&error))?;
        if let Some(fit) = curve.fit {
            let line = curve.points.iter().map(|(at, _)| (x.place(*at), y.place(fit.at(*at))));
            let dashes = DashedLineSeries::new(line, 6, 5, color.stroke_width(1));
            chart.draw_series(dashes).map_err(|error| failed(&error))?;
        }
        let places: Vec<_> = curve.points.iter().map(|(at, e)| (x.place(*at), y.place(e.mean))).collect();
        chart
            .draw_series(LineSeries::new(places.clone(), color.stroke_width(2)))
            .map_err(|error| failed(&error))?;
        let marked = if places.len() > MOST_MARKERS { 0 } else { places.len() };
        chart
            .draw_series(places.into_iter().take(marked).map(|place| marker(place, number)))
            .map_err(|error| failed(&error))?;
    }
    for (number, curve) in figure.curves.iter().enumerate() {
        let columns = figure.columns();
        let left = 100 + (number % columns) as i32 * 390;
        let middle = (number / columns) as i32 * ROW as i32 + ROW as i32 / 2;
        let line = PathElement::new([(left, middle), (left + 30, middle)], color(number).stroke_width(2));
        below.draw(&line).map_err(|error| failed(&error))?;
        below.draw(&marker((left + 15, middle), number)).map_err(|error| failed(&error))?;
        let text = Text::new(legend(curve), (left + 40, middle - 8), (FONT, 14));
        below.draw(&text).map_err(|error| failed(&error))?;
    }
    let (_, height) = figure.size();
    let note = Text::new(figure.note(), (100, (height - SIZE.1 - ROW) as i32), (FONT, 13));
    below.draw(&note).map_err(|error| failed(&error))?;
    area.present().map_err(|error| failed(&error))
}

fn color(number: usize) -> RGBColor {
    COLORS[number % COLORS.len()]
}

/// The marker of a curve's points: a dot for the first curves, as many as there are colours, then ever wider rings.
fn marker<C>(place: C, number: usize) -> Circle<C, i32> {
    match number / COLORS.len() {
        0 => Circle::new(place, 3, color(number).filled()),
        round => Circle::new(place, 3 + 2 * round as i32, color(number).stroke_width(2)),
    }
}

/// The lower end of the margin, the mean, and the upper end; not below 0 unless `signed`.
fn ends(estimate: &Estimate, signed: bool) -> [f64; 3] {
    let margin = estimate.margin.unwrap_or(0.0);
    let lower = estimate.mean - margin;
    [if signed { lower } else { lower.max(0.0) }, estimate.mean, estimate.mean + margin]
}

/// The outline of the confidence band: along the upper ends and back along the lower ones.
fn band(curve: &Curve, x: &Scale, y: &Scale, signed: bool) -> Vec<(f64, f64)> {
    let end = |which: usize| {
        curve.points.iter().map(move |(at, e)| (x.place(*at), y.place(ends(e, signed)[which])))
    };
    end(2).chain(end(0).collect::<Vec<_>>().into_iter().rev()).collect()
}

/// The curve's label, with the fitted order.
pub fn legend(curve: &Curve) -> String {
    match &curve.fit {
        None => curve.label.clone(),
        Some(Fit { order, .. }) => {
            let margin = order.margin.map_or(String::new(), |margin| format!(" ± {margin:.2}"));
            format!("{}: order {:.2}{margin}", curve.label, order.mean)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(log: bool, values: &[f64]) -> Figure {
        let point = |(i, value): (usize, &f64)| {
            (2f64.powi(i as i32), Estimate { mean: *value, margin: Some(0.3 * value) })
        };
        let points: Vec<_> = values.iter().enumerate().map(point).collect();
        let exact: Vec<_> = points.iter().map(|(x, y)| (*x, y.mean)).collect();
        let curve = Curve { label: "uniform".into(), scene: 0, points, fit: Fit::of(&exact) };
        Figure {
            title: "A plot".into(),
            x_label: "samples".into(),
            y: Measurement::Mse.into(),
            log: [log; 2],
            curves: vec![curve],
        }
    }

    #[test]
    fn plots_contain_titles_labels_legend_and_ink() {
        let figure = figure(true, &[1.0, 0.5, 0.25, 0.125]);
        let svg = svg(&figure).unwrap();
        for wanted in [
            "<svg", "A plot", "samples", "squared error", "uniform: order -1.00", "band: 95 %",
            "dashed: fitted",
        ] {
            assert!(svg.contains(wanted), "{wanted} is missing");
        }
        let pixels = pixels(&figure).unwrap();
        let (width, height) = figure.size();
        assert_eq!(pixels.len() as u32, 3 * width * height);
        assert!(pixels.chunks_exact(3).filter(|p| *p != [255; 3]).count() > 3000);
    }

    #[test]
    fn plots_accept_zeros_nan_and_infinities() {
        for values in [&[0.0][..], &[1.0], &[0.0, 1.0, -1.0], &[f64::NAN, f64::INFINITY], &[1e-300, 1e300]] {
            for log in [true, false] {
                svg(&figure(log, values)).unwrap();
            }
        }
    }

    #[test]
    fn bands_of_times_end_at_zero_and_those_of_squared_bias_do_not() {
        let noisy = Estimate { mean: 1.0, margin: Some(3.0) };
        assert_eq!(ends(&noisy, false), [0.0, 1.0, 4.0]);
        assert_eq!(ends(&noisy, true), [-2.0, 1.0, 4.0]);
        let mut plot = figure(false, &[1.0, 2.0]);
        plot.curves[0].points[0].1.margin = Some(30.0);
        for (y, is_below) in [(Measurement::CpuSeconds, false), (Measurement::SquaredBias, true)] {
            plot.y = y.into();
            assert_eq!(svg(&plot).unwrap().contains("-20"), is_below, "{y:?}");
        }
    }

    #[test]
    fn titles_and_legends_fit_their_plots() {
        let long = "Mean squared error by samples of a pixel, direct light by the path transport, and more of it here";
        assert_eq!(caption("A plot"), ("A plot".into(), 20));
        for title in [format!("{long} and there, as well as elsewhere"), long.repeat(3)] {
            let (text, size) = caption(&title);
            assert!((TITLE[1]..TITLE[0]).contains(&size) && width(&text, size) <= SIZE.0, "{text}");
            assert!(title.starts_with(text.trim_end_matches('…')) && text.len() > 90, "{text}");
        }
        assert!(caption(&long.repeat(3)).0.ends_with('…'));
        let mut plot = figure(true, &[1.0, 2.0]);
        assert_eq!(plot.columns(), 2);
        plot.curves[0].label = "figure_09_area_light_jittered, wavefront, shading with one lane".into();
        assert_eq!(plot.columns(), 1);
    }

    #[test]
    fn marks_are_at_round_numbers() {
        let powers = Scale::new(true, true, [1.0, 1e6].into_iter());
        assert_eq!(
            powers.marks().iter().map(|m| powers.text(*m)).collect::<Vec<_>>()[..3],
            ["1", "10", "100"]
        );
        let even = Scale::new(false, true, [0.0, 6.5].into_iter());
        assert!(
            even.marks().len() > 3
                && even.marks().iter().all(|m| m.fract() == 0.0 || (2.0 * m).fract() == 0.0)
        );
    }
}
