//! Solid letters from the outlines of a font.

use std::f64::consts::FRAC_PI_2;

use ttf_parser::{Face, GlyphId, OutlineBuilder};

use super::Fineness;
use super::curves::{CubicSpan, CurvePoint, chain};
use super::extrude::{Area, SectionLine, contour, extrude, twice_area};
use crate::error::CompileError;
use crate::math::{DVec2, DVec3};
use crate::world::{Align, Font, Mesh};

/// The look of words, but for the words and their font.
#[derive(Clone, Copy)]
pub(super) struct TextStyle {
    pub size_m: f32,
    pub depth_m: f32,
    pub bevel_m: f32,
    pub align: Align,
    pub segments: Option<u32>,
    pub fineness: Fineness,
}

/// Checks that a file is a font. Errors: the reason why it is none.
pub(crate) fn check_font(font: &Font) -> Result<(), String> {
    face(font).map(|_| ())
}

fn face(font: &Font) -> Result<Face<'_>, String> {
    let face = Face::parse(&font.data, 0).map_err(|error| format!("is no font that can be read: {error}"))?;
    if face.units_per_em() == 0 {
        Err("is no font that can be read: its em is 0".to_owned())
    } else {
        Ok(face)
    }
}

/// The first character for which a font has no glyph; a space and the like need none.
pub(super) fn missing(text: &str, font: &Font) -> Option<char> {
    let face = face(font).ok()?;
    text.chars().find(|c| !c.is_whitespace() && face.glyph_index(*c).is_none())
}

/// Collects contours as cubic spans, in units of the font.
#[derive(Default)]
struct Contours {
    all: Vec<Vec<CubicSpan>>,
    start: DVec3,
    at: DVec3,
}

impl Contours {
    fn span(&mut self, [a, b, c]: [DVec3; 3]) {
        if c != self.at || a != self.at || b != self.at {
            let span = [self.at, a, b, c].map(|point| (point, 0.0));
            self.all.last_mut().into_iter().for_each(|contour| contour.push(span));
        }
        self.at = c;
    }
}

fn point(x: f32, y: f32) -> DVec3 {
    DVec3::new(x.into(), y.into(), 0.0)
}

impl OutlineBuilder for Contours {
    fn move_to(&mut self, x: f32, y: f32) {
        self.all.push(Vec::new());
        (self.start, self.at) = (point(x, y), point(x, y));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let to = point(x, y);
        self.span([self.at.lerp(to, 1.0 / 3.0), self.at.lerp(to, 2.0 / 3.0), to]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (control, to) = (point(x1, y1), point(x, y));
        self.span([self.at.lerp(control, 2.0 / 3.0), to.lerp(control, 2.0 / 3.0), to]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.span([point(x1, y1), point(x2, y2), point(x, y)]);
    }

    fn close(&mut self) {
        if self.at != self.start {
            self.line_to(self.start.x as f32, self.start.y as f32);
        }
    }
}

/// The spans of a text's contours by glyph, in metres.
fn glyphs(text: &str, face: &Face, style: &TextStyle) -> Vec<Vec<Vec<CubicSpan>>> {
    let scale = f64::from(style.size_m) / f64::from(face.units_per_em());
    let line_height = f64::from(face.height()) + f64::from(face.line_gap());
    let mut glyphs = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let (mut pen, mut before) = (0.0, None);
        let mut row: Vec<Vec<Vec<CubicSpan>>> = Vec::new();
        for glyph in line.chars().map(|c| face.glyph_index(c)) {
            let Some(glyph) = glyph else {
                // A blank that the font does not have.
                (pen, before) = (pen + 0.25 * f64::from(face.units_per_em()), None);
                continue;
            };
            pen += before.map_or(0.0, |before| kerning(face, before, glyph));
            let mut contours = Contours::default();
            face.outline_glyph(glyph, &mut contours);
            contours.all.iter_mut().flatten().flatten().for_each(|point| point.0.x += pen);
            row.push(contours.all);
            pen += f64::from(face.glyph_hor_advance(glyph).unwrap_or(0));
            before = Some(glyph);
        }
        let part = match style.align {
            Align::Left => 0.0,
            Align::Center => 0.5,
            Align::Right => 1.0,
        };
        let shift = DVec3::new(-part * pen, -line_height * number as f64, 0.0);
        for point in row.iter_mut().flatten().flatten().flatten() {
            point.0 = scale * (point.0 + shift);
        }
        glyphs.extend(row);
    }
    glyphs
}

/// The distance by which a pair of glyphs is moved apart, by the font's table `kern`.
fn kerning(face: &Face, left: GlyphId, right: GlyphId) -> f64 {
    let tables = face.tables().kern.into_iter().flat_map(|kern| kern.subtables);
    let tables = tables.filter(|table| table.horizontal && !table.variable && !table.has_cross_stream);
    tables.filter_map(|table| table.glyphs_kerning(left, right)).map(f64::from).sum()
}

/// Groups a glyph's contours into areas with their holes: contours that go around as the largest one does are areas.
fn regions(contours: Vec<Vec<Vec<CurvePoint>>>) -> Vec<Vec<Vec<Vec<CurvePoint>>>> {
    let points: Vec<Vec<DVec2>> = contours.iter().map(|parts| contour(parts).collect()).collect();
    let areas: Vec<f64> = points.iter().map(|points| twice_area(points.iter().copied())).collect();
    let largest = areas.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    let is_area = |number: usize| areas[number] * largest > 0.0;
    let mut regions: Vec<(usize, Vec<usize>)> =
        (0..contours.len()).filter(|number| is_area(*number)).map(|number| (number, vec![number])).collect();
    for hole in (0..contours.len()).filter(|number| areas[*number] * largest < 0.0) {
        let around =
            |area: &usize| points[hole].first().is_some_and(|point| is_within(*point, &points[*area]));
        let smallest = |a: &usize, b: &usize| areas[*a].abs().total_cmp(&areas[*b].abs());
        let area = regions.iter().map(|(area, _)| *area).filter(around).min_by(smallest);
        if let Some((_, members)) = regions.iter_mut().find(|(own, _)| Some(*own) == area) {
            members.push(hole);
        }
    }
    let mut contours: Vec<Option<Vec<Vec<CurvePoint>>>> = contours.into_iter().map(Some).collect();
    let mut take = |number: usize| contours[number].take().unwrap_or_default();
    regions.into_iter().map(|(_, members)| members.into_iter().map(&mut take).collect()).collect()
}

/// True if a point is within a contour (Shimrat 1962: a ray crosses it an odd number of times).
fn is_within(point: DVec2, contour: &[DVec2]) -> bool {
    let next = contour.iter().cycle().skip(1);
    let crossings = contour.iter().zip(next).filter(|(a, b)| {
        (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)
    });
    crossings.count() % 2 == 1
}

/// Turns a span around.
fn reversed(spans: &[CubicSpan]) -> Vec<CubicSpan> {
    spans.iter().rev().map(|[a, b, c, d]| [*d, *c, *b, *a]).collect()
}

pub(super) fn mesh(text: &str, font: &Font, style: TextStyle) -> Result<Mesh, CompileError> {
    let invalid = |reason: String| CompileError::Invalid { place: "its font".to_owned(), reason };
    let face = face(font).map_err(invalid)?;
    let mut all = Vec::new();
    for spans in glyphs(text, &face, &style) {
        let chained = |spans: &[CubicSpan]| chain(spans, true, style.segments, style.fineness);
        let area = |spans: &Vec<CubicSpan>| {
            let corners = spans.iter().map(|span| span[0].0.truncate());
            twice_area(corners)
        };
        // The largest contour goes counter-clockwise in OpenType, clockwise in TrueType.
        let largest = spans.iter().map(area).fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        let contours = spans.iter().filter(|spans| !spans.is_empty());
        let contours =
            contours.map(|spans| if largest < 0.0 { chained(&reversed(spans)) } else { chained(spans) });
        all.extend(regions(contours.collect()));
    }
    extrude(&Area { regions: all }, &section(&style), [DVec3::X, DVec3::Y, DVec3::Z])
}

/// The section through the side: a quarter of a circle, straight down, and a quarter of a circle.
fn section(style: &TextStyle) -> Vec<SectionLine> {
    let [half, bevel] = [0.5 * f64::from(style.depth_m), f64::from(style.bevel_m)];
    let steps =
        if bevel > 0.0 { style.fineness.segments(bevel, style.segments, 16.0).div_ceil(4) } else { 0 };
    let length = 2.0 * (half - bevel) + 2.0 * bevel * FRAC_PI_2;
    let line = |step: usize, side: f64| {
        let part = step as f64 / steps.max(1) as f64;
        let (sin, cos) = match step {
            _ if steps == 0 => (1.0, 0.0),
            0 => (0.0, 1.0),
            step if step == steps => (1.0, 0.0),
            _ => libm::sincos(FRAC_PI_2 * part),
        };
        let along = bevel * FRAC_PI_2 * part;
        let v = if side > 0.0 { along / length } else { 1.0 - along / length };
        SectionLine {
            out: if steps == 0 { 0.0 } else { bevel * sin },
            depth: side * (half - bevel + bevel * if steps == 0 { 1.0 } else { cos }),
            normal: DVec2::new(sin, side * cos),
            v,
        }
    };
    (0..=steps).map(|step| line(step, 1.0)).chain((0..=steps).rev().map(|step| line(step, -1.0))).collect()
}

#[cfg(test)]
pub(crate) mod tests;
