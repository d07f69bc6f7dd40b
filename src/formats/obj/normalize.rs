//! Checks an OBJ file and normalises it to the simplest form.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt::Write;
use std::hash::Hash;
use std::io::BufRead;

use smallvec::SmallVec;

use crate::formats::mended::{self, Mended};
use crate::math::Vec3;
use crate::world::area_normals::{AreaNormals, area_vector};

/// An invalid line.
#[derive(Debug)]
pub struct LineFault {
    /// The line number, from 1.
    pub line: usize,
    /// The column, from 1, in characters.
    pub column: usize,
    /// The reason.
    pub reason: String,
}

/// A word and its byte offset in the line.
#[derive(Clone, Copy)]
struct ObjToken<'a> {
    text: &'a str,
    place: usize,
}

/// The byte offset of an error in a line, and its reason.
type Complaint = (usize, String);

/// Vertex, texture coordinates and normal: the kinds of indices of a corner.
const VERTEX: usize = 0;
const UV: usize = 1;
const NORMAL: usize = 2;
const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// The group of corners whose normals are to be worked out although the face is in no smoothing group.
const MENDED: u32 = u32::MAX;

/// The largest number of objects that stay apart.
const OBJECTS: usize = 1 << 16;

/// Different names, in the order of their first use, with the line of that.
pub struct Names {
    /// The names and their lines.
    pub all: Vec<(String, usize)>,
    numbers: HashMap<String, usize>,
}

impl Names {
    fn new() -> Names {
        Names { all: Vec::new(), numbers: HashMap::new() }
    }

    /// The number of a name, which is added if it is new.
    fn number(&mut self, name: &str, line: usize) -> usize {
        if let Some(number) = self.numbers.get(name) {
            return *number;
        }
        self.numbers.insert(name.to_owned(), self.all.len());
        self.all.push((name.to_owned(), line));
        self.all.len() - 1
    }
}

/// OBJ text normalised for tobj: finite numbers; a colour for every vertex; all three indices in every corner, absolute
/// and in range; only polygons; one material library; materials and objects by their numbers; all vertices first.
///
/// Corners without texture coordinates or normals refer to two initial lines: zero texture coordinates, and the zero
/// normal, which means a flat normal. So indices of these two kinds are one more than in the file. Further normals, of
/// the smoothing groups, come last.
pub struct Tidied {
    /// The lines of the vertices.
    vertex_lines: String,
    /// The other lines.
    face_lines: String,
    /// True if any face has texture coordinates.
    pub has_uvs: bool,
    /// True if any face has normals.
    pub has_normals: bool,
    /// True if any vertex has a colour. Colours are as the file has them; missing components are not finite.
    pub has_colors: bool,
    /// The material libraries that the file names, as written.
    pub libraries: Names,
    /// The materials that the file uses.
    pub materials: Names,
    /// The objects that have faces, if they are to stay apart.
    pub objects: Vec<String>,
    /// Warnings about skipped and mended values, with their lines.
    pub warnings: Vec<(usize, String)>,
}

impl Tidied {
    /// Checks and normalises a file. With `apart`, its objects are kept apart: those of its `o` lines or, if there are
    /// none, of its `g` lines.
    pub fn new(text: &str, apart: bool) -> Result<Tidied, LineFault> {
        let mut vertices = Vertices::new();
        for (number, line) in logical_lines(text) {
            vertices.read_line(&line, number);
        }
        let object_word = if !apart {
            ""
        } else if vertices.has_objects {
            "o"
        } else {
            "g"
        };
        let mut faces = Faces::new(&vertices, object_word);
        for (number, line) in logical_lines(text) {
            faces.read_line(&line, number).map_err(|complaint| match complaint {
                FaceFault::Here(place, reason) => fault_at(&line, number, place, reason),
                FaceFault::OfVertex(vertex) => vertices.fault_of(text, vertex),
            })?;
        }
        let FaceLines { lines, normals, has, libraries, materials, objects, mut told } = faces.finish();
        vertices.lines.push_str(&normals);
        told.extend(vertices.told());
        told.sort_unstable_by_key(|(line, _)| *line);
        Ok(Tidied {
            vertex_lines: vertices.lines,
            face_lines: lines,
            has_uvs: has[UV],
            has_normals: has[NORMAL],
            has_colors: vertices.has_colors,
            libraries,
            materials,
            objects,
            warnings: told,
        })
    }

    /// The text for tobj.
    pub fn text(&self) -> impl BufRead + '_ {
        std::io::Read::chain(self.vertex_lines.as_bytes(), self.face_lines.as_bytes())
    }
}

/// The lines of a text with their numbers, joined where they end with a backslash.
fn logical_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (number, line) = lines.next()?;
        let mut line = Cow::Borrowed(line);
        while line.trim_end().ends_with('\\') {
            let Some((_, more)) = lines.next() else { break };
            let so_far = line.trim_end().len() - 1;
            let joined = line.to_mut();
            joined.truncate(so_far);
            joined.push(' ');
            joined.push_str(more);
        }
        Some((number + 1, line))
    })
}

fn fault_at(line: &str, number: usize, place: usize, reason: String) -> LineFault {
    LineFault { line: number, column: column(line, place), reason }
}

/// The first word of a line, and the rest.
fn split_keyword(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).map_or((line, ""), |(word, rest)| (word, rest.trim()))
}

/// The first pass: everything that faces refer to.
struct Vertices {
    lines: String,
    positions: Vec<Vec3>,
    /// Vertices whose position is invalid, and their lines, in order.
    invalid: Vec<(u32, usize)>,
    /// Invalid normals, in order.
    invalid_normals: Vec<u32>,
    /// The numbers of vertices, texture coordinates and normals.
    counts: [i64; 3],
    has_colors: bool,
    has_objects: bool,
    colors: Mended,
    uvs: Mended,
    normals: Mended,
}

impl Vertices {
    fn new() -> Vertices {
        Vertices {
            lines: "mtllib all\nvt 0 0\nvn 0 0 0\n".to_owned(),
            positions: Vec::new(),
            invalid: Vec::new(),
            invalid_normals: Vec::new(),
            counts: [0; 3],
            has_colors: false,
            has_objects: false,
            colors: Mended::default(),
            uvs: Mended::default(),
            normals: Mended::default(),
        }
    }

    fn read_line(&mut self, line: &str, number: usize) {
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
        let position = position(&words).ok();
        if position.is_none() {
            self.invalid.push((self.counts[VERTEX] as u32, number));
        }
        self.counts[VERTEX] += 1;
        self.positions.push(position.unwrap_or(Vec3::ZERO));
        if position.is_some() {
            self.write("v", &words, 3);
        } else {
            self.lines.push_str("v 0 0 0\n");
        }
        // The colour belongs to the line.
        self.lines.pop();
        // A single further number is a weight for curves, which polygons ignore.
        let Some([r, g, b, ..]) = words.get(4..) else {
            return self.lines.push_str(" NaN NaN NaN\n");
        };
        let mut is_whole = true;
        for word in [r, g, b] {
            let is_finite = mended::number(word.text).is_some_and(f32::is_finite);
            self.has_colors |= is_finite;
            is_whole &= is_finite;
            self.lines.push(' ');
            self.push(if is_finite { word.text } else { "NaN" });
        }
        self.lines.push('\n');
        if !is_whole {
            self.colors.note(number);
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
        match mended::number(number).filter(|_| number.contains([',', 'd', 'D'])) {
            Some(value) => write_infallibly(&mut self.lines, format_args!("{value}")),
            None => self.lines.push_str(number),
        }
    }

    /// Messages about mended values. Vertices without a position are unused: faces that use one are refused.
    fn told(&self) -> Vec<(usize, String)> {
        let mut told = Vec::new();
        let count = self.invalid.len();
        let vertices = Mended { count, first: self.invalid.first().map_or(0, |(_, line)| *line) };
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
    fn fault_of(&self, text: &str, vertex: u32) -> LineFault {
        let found = self.invalid.binary_search_by_key(&vertex, |(invalid, _)| *invalid);
        let number = found.map_or(1, |at| self.invalid[at].1);
        let line =
            logical_lines(text).find(|(other, _)| *other == number).map_or(Cow::Borrowed(""), |it| it.1);
        let (place, reason) = position(&words(&line)).err().unwrap_or_default();
        fault_at(&line, number, place, reason)
    }
}

/// The position of a vertex's line.
fn position(words: &[ObjToken]) -> Result<Vec3, Complaint> {
    let [_, x, y, z, ..] = words else {
        return Err((0, "a vertex needs three coordinates".into()));
    };
    let coordinate = |word: &ObjToken| {
        let not_a_number = || (word.place, format!("{:?} is not a number", short(word.text)));
        let number = mended::number(word.text).ok_or_else(not_a_number)?;
        let is_finite = number.is_finite();
        is_finite.then_some(number).ok_or((word.place, format!("the coordinate {} is not finite", word.text)))
    };
    Ok(Vec3::new(coordinate(x)?, coordinate(y)?, coordinate(z)?))
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

/// The reason why a face is invalid.
enum FaceFault {
    /// The byte offset in its line, and the reason.
    Here(usize, String),
    /// It uses a vertex whose position is invalid.
    OfVertex(u32),
}

/// The kinds of skipped lines, in the order of [`Faces::skipped`].
const SKIPPED: [&str; 5] = [
    "points skipped",
    "lines skipped",
    "faces of fewer than three corners skipped",
    "free-form curves and surfaces skipped",
    "lines of an unknown keyword skipped",
];

/// Keywords of lines that are read, or that change nothing in a picture of polygons.
const OTHER_KEYWORDS: [&str; 33] = [
    "", "v", "vt", "vn", "vp", "o", "mg", "mtllib", "bevel", "c_interp", "d_interp", "lod", "cstype", "deg",
    "bmat", "step", "parm", "trim", "hole", "scrv", "sp", "end", "con", "ctech", "stech", "shadow_obj",
    "trace_obj", "maplib", "usemap", "call", "csh", "cdc", "cdp",
];

/// The second pass: faces, materials, objects and smoothing groups.
struct Faces<'a> {
    vertices: &'a Vertices,
    /// The keyword of lines that begin an object.
    object_word: &'static str,
    lines: String,
    /// The numbers of vertices, texture coordinates and normals up to the line.
    counts: [i64; 3],
    has: [bool; 3],
    libraries: Names,
    materials: Names,
    objects: Numbering<String>,
    object: String,
    /// The object that the last line written is of.
    written_object: Option<usize>,
    smoothing: u32,
    /// Vertices whose normals are worked out, each with its group.
    smoothed: Numbering<(u32, u32)>,
    normals: AreaNormals,
    skipped: [Mended; SKIPPED.len()],
    /// Texture coordinates and normals that do not exist.
    missing: [Mended; 3],
    surplus: Mended,
    /// The corners of the face that is being read.
    corners: Vec<[u32; 3]>,
}

/// Numbers for different keys, in the order of their first use.
struct Numbering<K>(HashMap<K, usize>);

impl<K: Eq + Hash> Numbering<K> {
    fn number(&mut self, key: K) -> usize {
        let next = self.0.len();
        *self.0.entry(key).or_insert(next)
    }
}

impl<'a> Faces<'a> {
    fn new(vertices: &'a Vertices, object_word: &'static str) -> Faces<'a> {
        Faces {
            vertices,
            object_word,
            lines: String::new(),
            counts: [0; 3],
            has: [false; 3],
            libraries: Names::new(),
            materials: Names::new(),
            objects: Numbering(HashMap::new()),
            object: String::new(),
            written_object: None,
            smoothing: 0,
            smoothed: Numbering(HashMap::new()),
            normals: AreaNormals::default(),
            skipped: Default::default(),
            missing: Default::default(),
            surplus: Mended::default(),
            corners: Vec::new(),
        }
    }

    fn read_line(&mut self, line: &str, number: usize) -> Result<(), FaceFault> {
        let (keyword, rest) = split_keyword(line);
        match keyword {
            "v" => self.counts[VERTEX] += 1,
            "vt" => self.counts[UV] += 1,
            "vn" => self.counts[NORMAL] += 1,
            "f" | "fo" => self.face(&words(line), number)?,
            "p" => self.skipped[0].note(number),
            "l" => self.skipped[1].note(number),
            "curv" | "curv2" | "surf" => self.skipped[3].note(number),
            "mtllib" if !rest.is_empty() => drop(self.libraries.number(rest, number)),
            "usemtl" if !rest.is_empty() => {
                let material = self.materials.number(rest, number);
                write_infallibly(&mut self.lines, format_args!("usemtl {material}\n"));
            }
            "s" => {
                let group = words(rest);
                let group = group.first().map_or("off", |word| word.text);
                let is_on = group.eq_ignore_ascii_case("on");
                self.smoothing = group.parse().unwrap_or(u32::from(is_on)).min(MENDED - 1);
            }
            _ if keyword == self.object_word => self.object = rest.to_owned(),
            "usemtl" | "g" => {}
            _ if keyword.starts_with('#') || OTHER_KEYWORDS.contains(&keyword) => {}
            _ => self.skipped[4].note(number),
        }
        Ok(())
    }

    fn face(&mut self, words: &[ObjToken], line: usize) -> Result<(), FaceFault> {
        let corners = words.get(1..).unwrap_or_default();
        self.corners.clear();
        for corner in corners {
            let corner = self.corner(corner, line)?;
            self.corners.push(corner);
        }
        if corners.len() < 3 {
            self.skipped[2].note(line);
            return Ok(());
        }
        if !self.object_word.is_empty() {
            self.begin_object();
        }
        let positions = &self.vertices.positions;
        let area = area_vector(self.corners.iter().map(|[v, ..]| positions[*v as usize]));
        self.lines.push('f');
        for [v, vt, vn] in &self.corners {
            let mut normal = u64::from(*vn);
            let group = match (*vn, self.smoothing) {
                (0, 0) => None,
                (MENDED, 0) => Some(MENDED),
                (0 | MENDED, group) => Some(group),
                _ => None,
            };
            if let Some(group) = group {
                let place = self.smoothed.number((*v, group));
                self.normals.add(place, area);
                normal = self.vertices.counts[NORMAL] as u64 + 1 + place as u64;
            }
            self.has[UV] |= *vt > 0;
            self.has[NORMAL] |= normal > 0;
            write_infallibly(&mut self.lines, format_args!(" {}/{}/{}", v + 1, vt + 1, normal + 1));
        }
        self.lines.push('\n');
        Ok(())
    }

    /// Writes the object of the next face, if it is another one than before.
    fn begin_object(&mut self) {
        let fits = self.objects.0.len() < OBJECTS || self.objects.0.contains_key(&self.object);
        let object = if fits { self.objects.number(self.object.clone()) } else { OBJECTS - 1 };
        if self.written_object != Some(object) {
            self.written_object = Some(object);
            write_infallibly(&mut self.lines, format_args!("o {object}\n"));
        }
    }

    /// The indices of a corner: of the vertex, from 0; of texture coordinates and normal, from 1, or 0 if it has none.
    /// An invalid normal is [`MENDED`].
    fn corner(&mut self, corner: &ObjToken, line: usize) -> Result<[u32; 3], FaceFault> {
        let mut parts = corner.text.split('/');
        let vertex = parts.next().unwrap_or("");
        let vertex = self.vertex_index(vertex).map_err(|reason| FaceFault::Here(corner.place, reason))?;
        let invalid = &self.vertices.invalid;
        if !invalid.is_empty() && invalid.binary_search_by_key(&vertex, |(invalid, _)| *invalid).is_ok() {
            return Err(FaceFault::OfVertex(vertex));
        }
        let mut indices = [vertex, 0, 0];
        for kind in [UV, NORMAL] {
            let text = parts.next().unwrap_or("");
            // Some exporters write 0 for "none".
            if text.is_empty() || text == "0" {
                continue;
            }
            let index = text.parse().ok().and_then(|index| self.absolute(kind, index));
            indices[kind] = index.unwrap_or_else(|| {
                self.missing[kind].note(line);
                if kind == NORMAL { MENDED } else { 0 }
            });
            if kind == NORMAL && index.is_some_and(|index| self.is_invalid_normal(index)) {
                indices[kind] = MENDED;
            }
        }
        if parts.next().is_some() {
            self.surplus.note(line);
        }
        Ok(indices)
    }

    fn is_invalid_normal(&self, index: u32) -> bool {
        let invalid = &self.vertices.invalid_normals;
        !invalid.is_empty() && invalid.binary_search(&(index - 1)).is_ok()
    }

    /// The absolute index, from 1, of an index in the file; none if there is nothing. Faces may precede what they refer
    /// to.
    fn absolute(&self, kind: usize, index: i64) -> Option<u32> {
        let before = self.counts[kind];
        let absolute = if index < 0 { index.saturating_add(before).saturating_add(1) } else { index };
        let exists = absolute >= 1 && absolute <= self.vertices.counts[kind];
        u32::try_from(absolute).ok().filter(|index| exists && *index < MENDED - 1)
    }

    /// The index of a vertex, from 0.
    fn vertex_index(&self, text: &str) -> Result<u32, String> {
        let what = KINDS[VERTEX];
        let index: i64 = text.parse().map_err(|_| format!("{:?} is not a {what} index", short(text)))?;
        if index == 0 {
            return Err(format!("{what} index 0: OBJ counts from 1"));
        }
        self.absolute(VERTEX, index).map(|index| index - 1).ok_or_else(|| {
            let count = if index < 0 {
                format!("{} before this line", self.counts[VERTEX])
            } else {
                self.vertices.counts[VERTEX].to_string()
            };
            format!("{what} index {index} is out of range: there are {count}")
        })
    }

    /// The result. The normals of smoothing groups are known only now.
    fn finish(self) -> FaceLines {
        let mut normals = String::new();
        for normal in self.normals.normals() {
            let Vec3 { x, y, z } = normal;
            write_infallibly(&mut normals, format_args!("vn {x} {y} {z}\n"));
        }
        let mut told = Vec::new();
        for (index, (skipped, what)) in self.skipped.iter().zip(SKIPPED).enumerate() {
            let why = if index < 4 { "only polygons are rendered" } else { "OBJ has no such lines" };
            tell(&mut told, *skipped, what, |count| format!("{count} ({why})"));
        }
        let [_, uvs, normals_missing] = self.missing;
        tell(&mut told, uvs, "texture coordinates that faces name, but that do not exist", |count| {
            format!("{count}; (0, 0) instead")
        });
        tell(&mut told, normals_missing, "normals that faces name, but that do not exist", |count| {
            format!("{count}; worked out from the faces instead")
        });
        tell(&mut told, self.surplus, "corners of more than three indices", |count| {
            format!("{count}; the first three count")
        });
        let mut objects = vec![String::new(); self.objects.0.len()];
        for (name, number) in self.objects.0 {
            objects[number] = name;
        }
        let Faces { lines, has, libraries, materials, .. } = self;
        FaceLines { lines, normals, has, libraries, materials, objects, told }
    }
}

/// What the second pass finds.
struct FaceLines {
    lines: String,
    /// The lines of further normals.
    normals: String,
    has: [bool; 3],
    libraries: Names,
    materials: Names,
    objects: Vec<String>,
    told: Vec<(usize, String)>,
}

/// Adds a message about values or lines, if there are any, and the line of the first.
fn tell(told: &mut Vec<(usize, String)>, of: Mended, what: &str, rest: impl Fn(usize) -> String) {
    if of.count > 0 {
        told.push((of.first, format!("{what}: {}", rest(of.count))));
    }
}

/// The column, from 1, of the character at a byte offset.
fn column(line: &str, place: usize) -> usize {
    line.get(..place).map_or(1, |before| before.chars().count() + 1)
}

/// Writing to a string cannot fail.
fn write_infallibly(text: &mut String, arguments: std::fmt::Arguments) {
    let _ = text.write_fmt(arguments);
}

/// The words of a line up to a comment.
fn words(line: &str) -> SmallVec<[ObjToken<'_>; 8]> {
    let mut words = SmallVec::new();
    for text in line.split_whitespace() {
        if text.starts_with('#') {
            break;
        }
        // `text` is a slice of the line.
        words.push(ObjToken { text, place: text.as_ptr() as usize - line.as_ptr() as usize });
    }
    words
}

/// The part of a word that fits into a message.
pub fn short(text: &str) -> String {
    text.chars().take(40).collect()
}
