//! The second pass over an OBJ file: faces, and the materials, objects and smoothing groups that they are of.

use std::collections::HashMap;
use std::hash::Hash;

use super::lines::{
    KINDS, NORMAL, ObjToken, UV, VERTEX, short, split_keyword, tell, words, write_infallibly,
};
use super::vertices::VertexLines;
use crate::formats::mended::MendedValues;
use crate::math::Vec3;
use crate::world::normals::{AreaNormals, area_vector};

/// The group of corners whose normals are to be worked out although the face is in no smoothing group.
const MENDED: u32 = u32::MAX;

/// The largest number of objects that stay apart.
const OBJECTS: usize = 1 << 16;

/// Different names, in the order of their first use, with the line of that.
pub struct UsedNames {
    /// The names and their lines.
    pub all: Vec<(String, usize)>,
    numbers: HashMap<String, usize>,
}

impl UsedNames {
    fn new() -> UsedNames {
        UsedNames { all: Vec::new(), numbers: HashMap::new() }
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

/// The reason why a face is invalid.
pub enum FaceFault {
    /// The byte offset in its line, and the reason.
    Here(usize, String),
    /// It uses a vertex whose position is invalid.
    OfVertex(u32),
}

/// The kinds of skipped lines, in the order of [`Faces::skipped`].
const SKIPPED: [&str; 6] = [
    "points skipped",
    "lines skipped",
    "faces of fewer than three corners skipped",
    "free-form curves and surfaces skipped",
    "lines of an unknown keyword skipped",
    "lines that include other files skipped",
];

/// Keywords of lines that are read, or that change nothing in a picture of polygons.
const OTHER_KEYWORDS: [&str; 31] = [
    "", "v", "vt", "vn", "vp", "o", "mg", "mtllib", "bevel", "c_interp", "d_interp", "lod", "cstype", "deg",
    "bmat", "step", "parm", "trim", "hole", "scrv", "sp", "end", "con", "ctech", "stech", "shadow_obj",
    "trace_obj", "maplib", "usemap", "cdc", "cdp",
];

/// The second pass: faces, materials, objects and smoothing groups.
pub struct Faces<'a> {
    vertices: &'a VertexLines,
    /// The keyword of lines that begin an object.
    object_word: &'static str,
    lines: String,
    /// The numbers of vertices, texture coordinates and normals up to the line.
    counts: [i64; 3],
    has: [bool; 3],
    libraries: UsedNames,
    materials: UsedNames,
    objects: Numbering<String>,
    object: String,
    /// The object that the last line written is of.
    written_object: Option<usize>,
    smoothing: u32,
    /// VertexLines whose normals are worked out, each with its group.
    smoothed: Numbering<(u32, u32)>,
    normals: AreaNormals,
    skipped: [MendedValues; SKIPPED.len()],
    /// Texture coordinates and normals that do not exist.
    missing: [MendedValues; 3],
    surplus: MendedValues,
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
    /// The state before the first line; `object_word` begins an object.
    pub fn new(vertices: &'a VertexLines, object_word: &'static str) -> Faces<'a> {
        Faces {
            vertices,
            object_word,
            lines: String::new(),
            counts: [0; 3],
            has: [false; 3],
            libraries: UsedNames::new(),
            materials: UsedNames::new(),
            objects: Numbering(HashMap::new()),
            object: String::new(),
            written_object: None,
            smoothing: 0,
            smoothed: Numbering(HashMap::new()),
            normals: AreaNormals::default(),
            skipped: Default::default(),
            missing: Default::default(),
            surplus: MendedValues::default(),
            corners: Vec::new(),
        }
    }

    /// Reads a line.
    pub fn read_line(&mut self, line: &str, number: usize) -> Result<(), FaceFault> {
        let (keyword, rest) = split_keyword(line);
        match keyword {
            "v" => self.counts[VERTEX] += 1,
            "vt" => self.counts[UV] += 1,
            "vn" => self.counts[NORMAL] += 1,
            "f" | "fo" => self.face(&words(line), number)?,
            "p" => self.skipped[0].note(number),
            "l" => self.skipped[1].note(number),
            "curv" | "curv2" | "surf" => self.skipped[3].note(number),
            "call" | "csh" => self.skipped[5].note(number),
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
    pub fn finish(self) -> FaceLines {
        let mut normals = String::new();
        for normal in self.normals.normals() {
            let Vec3 { x, y, z } = normal;
            write_infallibly(&mut normals, format_args!("vn {x} {y} {z}\n"));
        }
        let mut told = Vec::new();
        for (index, (skipped, what)) in self.skipped.iter().zip(SKIPPED).enumerate() {
            let why = match index {
                0..4 => "only polygons are rendered",
                4 => "OBJ has no such lines",
                _ => "a scene can show several: shape: Mesh(\"file.obj\")",
            };
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

/// The result of the second pass.
pub struct FaceLines {
    /// The normalised lines.
    pub lines: String,
    /// The lines of further normals, after those of the file.
    pub normals: String,
    /// The kinds of indices that any face has.
    pub has: [bool; 3],
    /// The material libraries.
    pub libraries: UsedNames,
    /// The materials.
    pub materials: UsedNames,
    /// The objects that have faces.
    pub objects: Vec<String>,
    /// Messages and their lines.
    pub told: Vec<(usize, String)>,
}
