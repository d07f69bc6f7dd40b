//! The texts that a scene consists of: its file, the files that it includes, and the values of variables that the
//! caller gives. All are read before any value is converted; a value belongs to the text that its slice lies in.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use super::scan;
use super::source::{Raw, SceneText, shorten};
use super::tree::BracketTree;
use super::variables::is_name;
use crate::error::{LoadError, did_you_mean};
use crate::formats::asset_files::identity;
use crate::formats::{AssetFiles, extension};
use crate::memory::{self, Reservation};

/// The memory that reading takes for each byte of text, in bytes.
pub(super) const BYTES_OF_TEXT: u64 = 32;
/// The largest number of texts of a scene.
const MOST_TEXTS: usize = 1000;
/// The largest number of files that include each other in a row.
const DEEPEST: usize = 16;

/// The keys of an entry of `include`; the first one is required.
pub(super) const INCLUDE: [&str; 5] = ["file", "prefix", "parent", "transform", "variables"];

/// A slice of a text, by the number of the text and its bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct TextSpan {
    pub part: usize,
    pub bytes: [usize; 2],
}

/// The values of variables by their names.
pub(super) type Variables = HashMap<String, TextSpan>;

/// The entry of `include` that a text is included by.
#[derive(Debug)]
pub(super) struct Inclusion {
    /// The number of the text that includes this one.
    pub by: usize,
    pub entry: TextSpan,
    /// The variables of the entry.
    pub given: Variables,
}

/// One of the texts of a scene.
#[derive(Debug)]
pub(super) struct TextPart<'t> {
    pub text: Cow<'t, str>,
    /// The file; empty for the value of an option.
    pub path: Arc<Path>,
    /// The name of the variable whose value from the caller this is.
    pub option: Option<String>,
    pub inclusion: Option<Inclusion>,
    /// The text before all names that are given here.
    pub prefix: String,
    /// The variables that are defined here, once they are read.
    pub variables: OnceCell<Variables>,
    /// The byte at which the value begins, once the text is known to be well formed.
    pub root: OnceCell<usize>,
    /// The spans of the values, once they are needed.
    pub tree: OnceCell<BracketTree>,
    /// The byte offset of each line, once it is needed.
    line_starts: OnceCell<Vec<u32>>,
    claim: Option<Reservation<'static>>,
}

impl<'t> TextPart<'t> {
    pub(super) fn new(text: impl Into<Cow<'t, str>>, path: &Path) -> Self {
        Self {
            text: text.into(),
            path: path.into(),
            option: None,
            inclusion: None,
            prefix: String::new(),
            variables: OnceCell::new(),
            root: OnceCell::new(),
            tree: OnceCell::new(),
            line_starts: OnceCell::new(),
            claim: None,
        }
    }

    pub(super) fn tree(&self) -> &BracketTree {
        self.tree.get_or_init(|| BracketTree::new(&self.text))
    }

    /// The line and column of `place`, a slice of the text, both from 1, the column in characters.
    pub(super) fn position(&self, place: &str) -> (usize, usize) {
        let offset = scan::offset_of(&self.text, place).unwrap_or(0);
        let starts = self.line_starts.get_or_init(|| {
            let newlines = self.text.bytes().filter(|byte| *byte == b'\n').count();
            let mut starts = Vec::with_capacity(1 + newlines);
            starts.push(0);
            starts.extend(self.text.match_indices('\n').map(|(newline, _)| newline as u32 + 1));
            starts
        });
        let line = starts.partition_point(|start| *start as usize <= offset);
        (line, self.text[starts[line - 1] as usize..offset].chars().count() + 1)
    }
}

/// Reads the text of a scene file.
pub(super) fn text_of(path: &Path, files: &mut dyn AssetFiles) -> Result<String, LoadError> {
    let bytes = files.read(path)?;
    if u32::try_from(bytes.len()).is_err() {
        return Err(LoadError::too_large(path, "a scene file must be smaller than 4 GiB"));
    }
    String::from_utf8(bytes).map_err(|error| {
        let end = error.utf8_error().valid_up_to();
        let text = String::from_utf8_lossy(&error.as_bytes()[..end]);
        let (line, column) = scan::position(&text, text.len());
        let reason = "this is not UTF-8: save the file in that encoding".to_owned();
        LoadError::At { file: path.to_owned(), line, column, reason }
    })
}

/// Returns all texts of a scene whose own text is `text`: that one first, and each before those that it includes.
pub(super) fn gather<'t>(
    text: &'t str,
    path: &Path,
    files: &mut dyn AssetFiles,
) -> Result<Vec<TextPart<'t>>, LoadError> {
    let mut parts = vec![TextPart::new(text, path)];
    parts.extend(
        files
            .variables()
            .into_iter()
            .map(|(name, value)| TextPart { option: Some(name), ..TextPart::new(value, Path::new("")) }),
    );
    let (mut faults, mut at) = (Vec::new(), 0);
    while at < parts.len() {
        let source = SceneText::new(&parts, 0.0);
        source.collect_faults();
        let read = source.read_part(at, files);
        let (found, bytes) = source.recover(read)?.unwrap_or_default();
        faults.append(&mut source.faults.borrow_mut());
        let claim = memory::reserve("what it says", bytes.saturating_mul(BYTES_OF_TEXT));
        parts[at].claim = Some(claim.map_err(LoadError::shortage(&parts[at].path))?);
        parts.extend(found);
        at += 1;
    }
    let source = SceneText::new(&parts, 0.0);
    source.faults.replace(faults);
    source.check_faults()?;
    source.check_options()?;
    Ok(parts)
}

impl<'a> SceneText<'a> {
    /// Checks the text with a number, and reads its variables and the texts that it includes. Also returns the number
    /// of bytes to be converted beyond those of the scene's own file.
    fn read_part(
        &self,
        at: usize,
        files: &mut dyn AssetFiles,
    ) -> Result<(Vec<TextPart<'static>>, u64), LoadError> {
        let (part, root) = (&self.parts[at], self.root_of(at)?);
        let mut variables = Variables::new();
        if part.option.is_none() {
            let raw = self.member(root, "variables");
            raw.map_or(Ok(()), |raw| self.define(raw, &mut variables))?;
        }
        let _ = part.variables.set(variables);
        let mut bytes = self.check_variables(at)?;
        if at > 0 {
            bytes += part.text.len() as u64;
        }
        let entries = self.member(root, "include").filter(|_| part.option.is_none() && !self.has_faults());
        let entries = entries.map_or(Ok(Vec::new()), |raw| self.list(raw, "the included files"))?;
        let mut found = Vec::new();
        for raw in entries {
            if self.parts.len() + found.len() >= MOST_TEXTS {
                let reason = format!("a scene includes at most {MOST_TEXTS} files");
                return Err(self.error(raw.0, reason));
            }
            found.extend(self.recover(self.included(at, raw, files))?);
        }
        Ok((found, bytes))
    }

    /// The value of a key of the structure `root`, if that is one and has it.
    fn member(&self, root: Raw<'a>, key: &str) -> Option<Raw<'a>> {
        let value = |item| scan::key_and_value(item).filter(|(name, _)| *name == key);
        let found = self.values(root.0).find_map(value);
        found.and_then(|(_, value)| self.optional(Raw(self.resolve(value))))
    }

    /// Adds the variables that `raw` defines, with their values as they are written.
    fn define(&self, raw: Raw<'a>, to: &mut Variables) -> Result<(), LoadError> {
        for (key, value) in self.entries(raw, "the variables")? {
            let name = self.string(key, "the name of a variable")?;
            if !is_name(&name) {
                let reason = "the name of a variable has letters, digits and underscores only";
                return Err(self.error(key.0, reason));
            }
            if to.insert(name, self.span(value.0)).is_some() {
                return Err(self.error(key.0, format!("the variable {} is defined twice", shorten(key.0))));
            }
        }
        Ok(())
    }

    /// Reads the text that an entry of `include` names.
    fn included(
        &self,
        by: usize,
        raw: Raw<'a>,
        files: &mut dyn AssetFiles,
    ) -> Result<TextPart<'static>, LoadError> {
        let [file, prefix, _, _, variables] = self.include_entry(raw)?;
        let file = file.unwrap_or(raw);
        let written = self.string(file, "the path of a scene file")?;
        let path = self.folder(file).join(&written);
        match extension(&path).as_str() {
            "ron" => {}
            "gltf" | "glb" => {
                let reason = "an entity with gltf: \"…\" places a glTF file: include is for .ron files";
                return Err(self.error(file.0, reason));
            }
            other => {
                let hint = did_you_mean(other, ["ron"]);
                return Err(
                    self.error(file.0, format!("included files are .ron files, not \".{other}\"{hint}"))
                );
            }
        }
        let mut above: Vec<usize> = self.including(by).collect();
        let same = identity(&path);
        if let Some(end) = above.iter().position(|number| identity(&self.parts[*number].path) == same) {
            above.truncate(end + 1);
            let names = above.iter().rev().map(|number| self.parts[*number].path.display().to_string());
            let names: Vec<String> = names.chain([path.display().to_string()]).collect();
            return Err(
                self.error(file.0, format!("a file cannot include itself: {}", names.join(" includes ")))
            );
        }
        if above.len() > DEEPEST {
            return Err(self.error(file.0, format!("more than {DEEPEST} files include each other in a row")));
        }
        let mut given = Variables::new();
        variables.map_or(Ok(()), |raw| self.define(raw, &mut given))?;
        let prefix = prefix.map_or(Ok(String::new()), |raw| self.string(raw, "a prefix"))?;
        let prefix = format!("{}{prefix}", self.parts[by].prefix);
        let text = text_of(&path, files).map_err(|error| self.nested(file, error))?;
        let text = text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text);
        let inclusion = Some(Inclusion { by, entry: self.span(raw.0), given });
        Ok(TextPart { inclusion, prefix, ..TextPart::new(text, &path) })
    }

    /// The values of an entry of `include`, which may be a path only.
    pub(super) fn include_entry(&self, raw: Raw<'a>) -> Result<[Option<Raw<'a>>; 5], LoadError> {
        match raw.0.starts_with('(') {
            true => self.keys(raw, "an included file", 1, INCLUDE),
            false if raw.0.starts_with(['"', 'r']) => Ok([Some(raw), None, None, None, None]),
            false => Err(self.expected(raw, "an included file, as \"file.ron\" or (file: \"file.ron\", …)")),
        }
    }

    /// The number of a text, and those of the texts that include it, from the inside.
    pub(super) fn including(&self, part: usize) -> impl Iterator<Item = usize> + use<'a> {
        let parts = self.parts;
        std::iter::successors(Some(part), |part| parts[*part].inclusion.as_ref().map(|it| it.by))
    }

    /// Looks up a name that is written at `place`: with the prefix of its file, then with those of the files that
    /// include it.
    pub(super) fn find_name<T>(&self, place: Raw, name: &str, find: impl Fn(&str) -> Option<T>) -> Option<T> {
        let mut prefixes = self.including(self.part_of(place.0)).map(|part| &self.parts[part].prefix);
        prefixes.find_map(|prefix| match prefix.is_empty() {
            true => find(name),
            false => find(&format!("{prefix}{name}")),
        })
    }

    /// The remedy for a name in the text with a number that another text has, too.
    pub(super) fn keep_apart(&self, number: usize) -> String {
        let part = &self.parts[number];
        let file = part.path.file_name().unwrap_or_default().to_string_lossy();
        let remedy = format!(" (include: [(file: \"{file}\", prefix: \"…\")] keeps names apart)");
        part.inclusion.as_ref().map(|_| remedy).unwrap_or_default()
    }
}
