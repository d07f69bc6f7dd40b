//! Checks an OBJ file and normalises it to the simplest form.

use std::borrow::Cow;
use std::collections::HashSet;
use std::fmt::Write;

use smallvec::SmallVec;

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

/// The kinds of indices of a corner.
const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// OBJ text normalised for tobj: finite numbers; a colour for every vertex; all three indices in every corner, absolute
/// and in range; only polygons; one material library.
///
/// Corners without texture coordinates or normals refer to two initial lines: zero texture coordinates, and the zero
/// normal, which means a flat normal. So indices of these two kinds are one more than in the file.
#[derive(Default)]
pub struct Tidied {
    /// The text for tobj.
    pub text: String,
    /// True if any face has texture coordinates.
    pub has_uvs: bool,
    /// True if any face has normals.
    pub has_normals: bool,
    /// True if any vertex has a colour.
    pub has_colors: bool,
    /// The material libraries that the file names, as written.
    pub libraries: Vec<String>,
    /// The materials that the file uses, in order of first use.
    pub material_names: Vec<String>,
    /// Warnings about skipped lines.
    pub warnings: Vec<String>,
    /// The numbers of vertices, texture coordinates and normals read up to now.
    counts: [i64; 3],
    /// For each kind, the largest index that referred to a later line when it was read.
    pending: [Option<Pending>; 3],
    skipped: [usize; 4],
    seen_libraries: HashSet<String>,
    seen_materials: HashSet<String>,
}

/// An index and its line.
#[derive(Clone, Copy)]
struct Pending {
    index: i64,
    line: usize,
}

/// The kinds of skipped lines, in the order of [`Tidied::skipped`].
const SKIPPED: [&str; 4] =
    ["points", "lines", "faces of fewer than three corners", "free-form curves and surfaces"];

impl Tidied {
    /// Checks and normalises a file.
    pub fn new(text: &str) -> Result<Tidied, LineFault> {
        let mut tidied = Tidied::default();
        tidied.text.push_str("mtllib all\nvt 0 0\nvn 0 0 0\n");
        let mut lines = text.lines().enumerate();
        while let Some((number, line)) = lines.next() {
            let mut line = Cow::Borrowed(line);
            while line.trim_end().ends_with('\\') {
                let Some((_, more)) = lines.next() else { break };
                let so_far = line.trim_end().len() - 1;
                let joined = line.to_mut();
                joined.truncate(so_far);
                joined.push(' ');
                joined.push_str(more);
            }
            let read = tidied.read_line(&line, number + 1);
            read.map_err(|(place, reason)| LineFault {
                line: number + 1,
                column: column(&line, place),
                reason,
            })?;
        }
        tidied.check_pending()?;
        for (count, what) in tidied.skipped.iter().zip(SKIPPED) {
            if *count > 0 {
                tidied.warnings.push(format!("{what} skipped: {count} (only polygons are rendered)"));
            }
        }
        Ok(tidied)
    }

    fn read_line(&mut self, line: &str, number: usize) -> Result<(), Complaint> {
        let trimmed = line.trim();
        let (keyword, rest) = trimmed.split_once(char::is_whitespace).unwrap_or((trimmed, ""));
        match keyword {
            "v" => self.vertex(&words(line))?,
            "vt" => self.texture_coordinates(&words(line))?,
            "vn" => self.normal(&words(line))?,
            "f" | "fo" => self.face(&words(line), number)?,
            "p" => self.skipped[0] += 1,
            "l" => self.skipped[1] += 1,
            "curv" | "curv2" | "surf" => self.skipped[3] += 1,
            "mtllib" => {
                let name = rest.trim();
                if self.seen_libraries.insert(name.to_owned()) {
                    self.libraries.push(name.to_owned());
                }
            }
            "usemtl" => self.use_material(rest.trim()),
            _ => {}
        }
        Ok(())
    }

    fn vertex(&mut self, words: &[ObjToken]) -> Result<(), Complaint> {
        let [_, x, y, z, rest @ ..] = words else {
            return Err((0, "a vertex needs three coordinates".into()));
        };
        for word in [x, y, z] {
            if !number(word)?.is_finite() {
                return Err((word.place, format!("the coordinate {} is not finite", word.text)));
            }
        }
        // A single further number is a weight for curves, which polygons ignore.
        let color = match rest {
            [r, g, b, ..] if [r, g, b].iter().all(|c| number(c).is_ok_and(f32::is_finite)) => {
                self.has_colors = true;
                [r.text, g.text, b.text]
            }
            _ => ["1"; 3],
        };
        self.counts[0] += 1;
        self.line(&["v", x.text, y.text, z.text, color[0], color[1], color[2]]);
        Ok(())
    }

    fn texture_coordinates(&mut self, words: &[ObjToken]) -> Result<(), Complaint> {
        let [_, u, rest @ ..] = words else {
            return Err((0, "texture coordinates need at least one number".into()));
        };
        let v = rest.first();
        let values = [number(u)?, v.map_or(Ok(0.0), number)?];
        self.counts[1] += 1;
        if values.iter().all(|value| value.is_finite()) {
            self.line(&["vt", u.text, v.map_or("0", |v| v.text)]);
        } else {
            self.line(&["vt", "0", "0"]);
        }
        Ok(())
    }

    fn normal(&mut self, words: &[ObjToken]) -> Result<(), Complaint> {
        let [_, x, y, z, ..] = words else {
            return Err((0, "a normal needs three coordinates".into()));
        };
        let values = [number(x)?, number(y)?, number(z)?];
        self.counts[2] += 1;
        if values.iter().all(|value| value.is_finite()) {
            self.line(&["vn", x.text, y.text, z.text]);
        } else {
            self.line(&["vn", "0", "0", "0"]);
        }
        Ok(())
    }

    fn face(&mut self, words: &[ObjToken], line: usize) -> Result<(), Complaint> {
        let corners = words.get(1..).unwrap_or_default();
        let start = self.text.len();
        self.text.push('f');
        for corner in corners {
            let mut parts = corner.text.split('/');
            let mut indices = [0; 3];
            for (kind, index) in indices.iter_mut().enumerate() {
                *index = self.index(kind, parts.next().unwrap_or(""), corner.place, line)?;
            }
            if parts.next().is_some() {
                return Err((corner.place, format!("{:?} has more than three indices", corner.text)));
            }
            let [v, vt, vn] = indices;
            self.has_uvs |= vt > 0;
            self.has_normals |= vn > 0;
            write_infallibly(&mut self.text, format_args!(" {v}/{}/{}", vt + 1, vn + 1));
        }
        self.text.push('\n');
        if corners.len() < 3 {
            self.text.truncate(start);
            self.skipped[2] += 1;
        }
        Ok(())
    }

    /// Returns an index counted from 1, or 0 if the file gives none (a vertex is mandatory).
    fn index(&mut self, kind: usize, text: &str, place: usize, line: usize) -> Result<i64, Complaint> {
        let what = KINDS[kind];
        // Some exporters write 0 for "none".
        if kind > 0 && (text.is_empty() || text == "0") {
            return Ok(0);
        }
        let index: i64 =
            text.parse().map_err(|_| (place, format!("{:?} is not a {what} index", short(text))))?;
        let count = self.counts[kind];
        let absolute = if index < 0 { index.saturating_add(count).saturating_add(1) } else { index };
        if absolute < 1 || absolute > i64::from(u32::MAX) - 1 {
            let reason = format!("{what} index {index} is out of range: there are {count} before this line");
            return Err((
                place,
                if index == 0 { format!("{what} index 0: OBJ counts from 1") } else { reason },
            ));
        }
        if absolute > count && self.pending[kind].is_none_or(|pending| absolute > pending.index) {
            self.pending[kind] = Some(Pending { index: absolute, line });
        }
        Ok(absolute)
    }

    /// Checks forward references: faces may precede the data that they refer to, but these must exist in the end.
    fn check_pending(&self) -> Result<(), LineFault> {
        for (kind, pending) in self.pending.iter().enumerate() {
            if let Some(Pending { index, line }) = *pending
                && index > self.counts[kind]
            {
                let what = KINDS[kind];
                let reason = format!("{what} index {index} is out of range: there are {}", self.counts[kind]);
                return Err(LineFault { line, column: 1, reason });
            }
        }
        Ok(())
    }

    fn use_material(&mut self, name: &str) {
        if name.is_empty() {
            return;
        }
        if self.seen_materials.insert(name.to_owned()) {
            self.material_names.push(name.to_owned());
        }
        self.line(&["usemtl", name]);
    }

    fn line(&mut self, words: &[&str]) {
        for (i, word) in words.iter().enumerate() {
            if i > 0 {
                self.text.push(' ');
            }
            self.text.push_str(word);
        }
        self.text.push('\n');
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

/// Parses a number, which may be infinite or NaN.
fn number(word: &ObjToken) -> Result<f32, Complaint> {
    word.text.parse().map_err(|_| (word.place, format!("{:?} is not a number", short(word.text))))
}

/// The part of a word that fits into a message.
pub fn short(text: &str) -> String {
    text.chars().take(40).collect()
}
