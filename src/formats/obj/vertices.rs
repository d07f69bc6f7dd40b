//! The first pass over an OBJ file: everything that faces refer to.

use std::borrow::Cow;

use super::lines::{
    Complaint, LineFault, NORMAL, ObjToken, UV, VERTEX, fault_at, logical_lines, short, split_keyword, tell,
    words, write_infallibly,
};
use crate::formats::mended::{self, MendedValues};
use crate::math::{DVec3, Vec3};
use crate::world::origin;

/// The first pass: everything that faces refer to.
pub struct VertexLines {
    /// The point that positions are relative to.
    pub origin: DVec3,
    /// The normalised lines.
    pub lines: String,
    /// The positions; 0 in place of invalid ones.
    pub positions: Vec<Vec3>,
    /// VertexLines whose position is invalid, and their lines, in order.
    pub invalid: Vec<(u32, usize)>,
    /// Invalid normals, in order.
    pub invalid_normals: Vec<u32>,
    /// The numbers of vertices, texture coordinates and normals.
    pub counts: [i64; 3],
    /// True if any vertex has a colour.
    pub has_colors: bool,
    /// True if any line begins an object.
    pub has_objects: bool,
    colors: MendedValues,
    uvs: MendedValues,
    normals: MendedValues,
}

impl VertexLines {
    /// The state before the first line of a file whose positions are relative to `origin`.
    pub fn new(origin: DVec3) -> VertexLines {
        VertexLines {
            origin,
            lines: "mtllib all\nvt 0 0\nvn 0 0 0\n".to_owned(),
            positions: Vec::new(),
            invalid: Vec::new(),
            invalid_normals: Vec::new(),
            counts: [0; 3],
            has_colors: false,
            has_objects: false,
            colors: MendedValues::default(),
            uvs: MendedValues::default(),
            normals: MendedValues::default(),
        }
    }

    /// Reads a line, of which only vertices, texture coordinates, normals and the beginnings of objects matter.
    pub fn read_line(&mut self, line: &str, number: usize) {
        match split_keyword(line).0 {
            "v" => self.vertex(line, number),
            "vt" => {
                self.counts[UV] += 1;
                let words = words(line);
                if texture_coordinates(&words).is_some() {
                    self.write("vt", &words, 2);
                } else {
                    self.uvs.note(number);
                    self.lines.push_str("vt 0 0\n");
                }
            }
            "vn" => {
                let words = words(line);
                if finite(&words).is_some() {
                    self.write("vn", &words, 3);
                } else {
                    self.normals.note(number);
                    // An index counts up to 32 bits, or is refused.
                    self.invalid_normals.push(self.counts[NORMAL] as u32);
                    self.lines.push_str("vn 0 0 0\n");
                }
                self.counts[NORMAL] += 1;
            }
            "o" => self.has_objects = true,
            _ => {}
        }
    }

    fn vertex(&mut self, line: &str, number: usize) {
        let words = words(line);
        // A single further number is a weight for curves, which polygons ignore.
        let rgb = words.get(4..7);
        if !self.has_colors && rgb.is_some_and(|rgb| rgb.iter().any(is_finite)) {
            self.has_colors = true;
            self.add_missing_colors();
        }
        let position = position(&words).ok().map(|position| (position - self.origin).as_vec3());
        if position.is_none() {
            self.invalid.push((self.counts[VERTEX] as u32, number));
        }
        self.counts[VERTEX] += 1;
        self.positions.push(position.unwrap_or(Vec3::ZERO));
        if let Some(Vec3 { x, y, z }) = position {
            match self.origin == DVec3::ZERO {
                true => self.write("v", &words, 3),
                false => write_infallibly(&mut self.lines, format_args!("v {x} {y} {z}\n")),
            }
        } else {
            self.lines.push_str("v 0 0 0\n");
        }
        if self.has_colors {
            // The colour belongs to the line.
            self.lines.pop();
            for at in 0..3 {
                self.lines.push(' ');
                let word = rgb.map(|rgb| &rgb[at]).filter(|word| is_finite(word));
                self.push(word.map_or("NaN", |word| word.text));
            }
            self.lines.push('\n');
        }
        if rgb.is_some_and(|rgb| !rgb.iter().all(is_finite)) {
            self.colors.note(number);
        }
    }

    /// Adds colours that are not finite to the lines of vertices: tobj wants a colour for each or none.
    fn add_missing_colors(&mut self) {
        let lines = std::mem::take(&mut self.lines);
        for line in lines.lines() {
            self.lines.push_str(line);
            self.lines.push_str(if line.starts_with("v ") { " NaN NaN NaN\n" } else { "\n" });
        }
    }

    /// Writes a line of the first finite numbers of one in the file; missing ones are 0.
    fn write(&mut self, keyword: &str, words: &[ObjToken], count: usize) {
        self.lines.push_str(keyword);
        for at in 1..=count {
            self.lines.push(' ');
            self.push(words.get(at).map_or("0", |word| word.text));
        }
        self.lines.push('\n');
    }

    /// Writes a number as it is, if tobj reads it.
    fn push(&mut self, number: &str) {
        if number.contains([',', 'd', 'D'])
            && let Some(value) = mended::number(number)
        {
            write_infallibly(&mut self.lines, format_args!("{value}"));
        } else {
            self.lines.push_str(number);
        }
    }

    /// Messages about mended values. VertexLines without a position are unused: faces that use one are refused.
    pub fn told(&self) -> Vec<(usize, String)> {
        let mut told = Vec::new();
        let count = self.invalid.len();
        let vertices = MendedValues { count, first: self.invalid.first().map_or(0, |(_, line)| *line) };
        let kinds = [
            (vertices, "vertices without a finite position", "no face uses them, so they are left out"),
            (self.uvs, "texture coordinates that are not finite numbers", "(0, 0) instead"),
            (self.normals, "normals that are not finite numbers", "worked out from the faces instead"),
            (self.colors, "colours that are not finite numbers", "1 instead"),
        ];
        for (mended, what, done) in kinds {
            tell(&mut told, mended, what, |count| format!("{count}; {done}"));
        }
        told
    }

    /// The fault of a vertex that a face uses.
    pub fn fault_of(&self, text: &str, vertex: u32) -> LineFault {
        let found = self.invalid.binary_search_by_key(&vertex, |(invalid, _)| *invalid);
        let number = found.map_or(1, |at| self.invalid[at].1);
        let line =
            logical_lines(text).find(|(other, _)| *other == number).map_or(Cow::Borrowed(""), |it| it.1);
        let (place, reason) = position(&words(&line)).err().unwrap_or_default();
        fault_at(&line, number, place, reason)
    }
}

/// The position of a vertex's line.
fn position(words: &[ObjToken]) -> Result<DVec3, Complaint> {
    let [_, x, y, z, ..] = words else {
        return Err((0, "a vertex needs three coordinates".into()));
    };
    let coordinate = |word: &ObjToken| {
        let not_a_number = || (word.place, format!("{:?} is not a number", short(word.text)));
        let number = mended::precise_number(word.text).ok_or_else(not_a_number)?;
        let is_finite = (number as f32).is_finite();
        is_finite.then_some(number).ok_or((word.place, format!("the coordinate {} is not finite", word.text)))
    };
    Ok(DVec3::new(coordinate(x)?, coordinate(y)?, coordinate(z)?))
}

/// The point that a file's positions are best relative to: (0, 0, 0), unless all of them are so far from it that single
/// precision would be coarse.
pub fn origin(text: &str) -> DVec3 {
    let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (_, line) in logical_lines(text) {
        if split_keyword(&line).0 == "v"
            && let Ok(position) = position(&words(&line))
        {
            let is_first = least.x > most.x;
            (least, most) = (least.min(position), most.max(position));
            // Most files end this search with their second vertex.
            if !is_first && !origin::is_coarse(least, most) {
                return DVec3::ZERO;
            }
        }
    }
    origin::between(least, most)
}

fn is_finite(word: &ObjToken) -> bool {
    mended::number(word.text).is_some_and(f32::is_finite)
}

/// Texture coordinates, of which the second may be missing.
fn texture_coordinates(words: &[ObjToken]) -> Option<[f32; 2]> {
    let v = words.get(2).map_or(Some(0.0), |word| mended::number(word.text));
    let numbers = [mended::number(words.get(1)?.text)?, v?];
    numbers.iter().all(|number| number.is_finite()).then_some(numbers)
}

/// The three finite numbers of a line.
fn finite(words: &[ObjToken]) -> Option<[f32; 3]> {
    let number = |at: usize| mended::number(words.get(at)?.text).filter(|number| number.is_finite());
    Some([number(1)?, number(2)?, number(3)?])
}
