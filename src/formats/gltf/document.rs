//! A parsed file: its JSON, its buffers, and errors that name the place in it.

use std::cell::{Cell, OnceCell, RefCell};
use std::collections::HashMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use gltf::json::buffer::View;
use gltf::json::{Index, Root};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::container::{Container, Placement};
use super::mending::{self, Mended, Unmendable};
use super::meshopt::MeshoptView;
use super::uri::{self, Resource};
use crate::error::Diagnostic;
use crate::error::LoadError;
use crate::memory;
use crate::world::SourceFiles;

/// Limit for the bytes made from each byte of the files. Exporters share vertices between a handful of meshes; files
/// designed to exhaust memory share them between thousands.
const LARGEST_EXPANSION: u64 = 64;
/// Limit for the bytes made from each decompressed byte, which itself counts once already.
const LARGEST_SECOND_EXPANSION: u64 = 16;
/// The number of bytes that any file may expand to.
const ALWAYS_ALLOWED: u64 = 16 << 20;

/// The file being read.
pub(super) struct Document<'p> {
    pub path: &'p Path,
    pub root: Root,
    /// By node; see [`Container::placements`].
    pub placements: Vec<Placement>,
    /// The bytes of each buffer, or the reason why they are missing.
    buffers: Vec<Result<Rc<[u8]>, String>>,
    /// The decompressed contents of compressed buffer views.
    decompressed: Vec<OnceCell<Vec<u8>>>,
    /// The number of bytes that may still be made from the file's data.
    budget: Cell<u64>,
    /// The faults that were mended.
    mended: RefCell<Mended>,
}

impl<'p> Document<'p> {
    /// Reads the JSON of `bytes` and the buffers that it names.
    pub(super) fn open(bytes: &[u8], path: &'p Path, sources: &SourceFiles) -> Result<Self, LoadError> {
        let container = Container::open(bytes, path)?;
        let (root, mended) = container.parse(path)?;
        let placements = container.placements();
        let mut files = HashMap::new();
        let mut buffers = Vec::with_capacity(root.buffers.len());
        for (index, buffer) in root.buffers.iter().enumerate() {
            let length = buffer.byte_length.0;
            let found = match &buffer.uri {
                Some(uri) => from_uri(uri, path, &mut files, sources),
                None if index == 0 => container
                    .binary
                    .map(Rc::from)
                    .ok_or_else(|| "it has no uri, and there is no binary chunk".to_owned()),
                None => Err("it has no uri".to_owned()),
            };
            buffers.push(found.and_then(|bytes: Rc<[u8]>| match u64::try_from(bytes.len()) {
                Ok(actual) if actual >= length => Ok(bytes),
                _ => Err(format!("it is to have {length} bytes, but there are {}", bytes.len())),
            }));
        }
        let in_files: u64 = files.values().flatten().map(|bytes| bytes.len() as u64).sum();
        let budget = ALWAYS_ALLOWED + LARGEST_EXPANSION * (bytes.len() as u64 + in_files);
        let decompressed = vec![OnceCell::new(); root.buffer_views.len()];
        let (budget, mended) = (Cell::new(budget), RefCell::new(mended));
        Ok(Self { path, root, placements, buffers, decompressed, budget, mended })
    }

    /// An error at a place in the JSON, such as `/meshes/0/primitives/1`.
    pub(super) fn error(&self, place: impl Display, reason: impl Display) -> LoadError {
        LoadError::invalid(self.path, format!("{place}: {reason}"))
    }

    /// Records a fault that is mended: its place in the JSON, and the problem with its consequence. Faults of one kind
    /// become one warning, and one that is repeated counts once.
    pub(super) fn mend(&self, place: impl Display, what: impl Display) {
        self.mended.borrow_mut().add(place, what);
    }

    /// Returns a warning for each kind of fault that was mended.
    pub(super) fn mends(&self) -> Vec<Diagnostic> {
        self.mended.borrow().lines().map(|line| self.warning(line)).collect()
    }

    /// Returns the array item that the object at `place` refers to; none, which is recorded as `consequence`, if it
    /// does not exist.
    pub(super) fn find<'d, T>(
        &self,
        items: &'d [T],
        index: Index<T>,
        place: impl Display,
        what: &str,
        consequence: &str,
    ) -> Option<&'d T> {
        let found = items.get(index.value());
        if found.is_none() {
            let (index, count) = (index.value(), items.len());
            self.mend(place, format_args!("there is no {what} {index}, the file has {count}: {consequence}"));
        }
        found
    }

    /// True if the file was written by Blender's exporter.
    pub(super) fn is_of_blender(&self) -> bool {
        self.root.asset.generator.as_deref().is_some_and(|generator| generator.contains("Blender"))
    }

    /// A warning for the user, prefixed with the file's path.
    pub(super) fn warning(&self, what: impl Display) -> Diagnostic {
        Diagnostic::in_file("import", self.path, &what.to_string())
    }

    /// Returns the array item that the object at `place` refers to.
    pub(super) fn get<'d, T>(
        &self,
        items: &'d [T],
        index: Index<T>,
        place: impl Display,
        what: &str,
    ) -> Result<&'d T, LoadError> {
        items.get(index.value()).ok_or_else(|| {
            let (index, count) = (index.value(), items.len());
            self.error(place, format!("there is no {what} {index}, the file has {count}"))
        })
    }

    /// Charges the budget with `bytes` about to be made from the file's data.
    pub(super) fn charge(&self, bytes: u64, place: impl Display) -> Result<(), LoadError> {
        let left = self.budget.get().checked_sub(bytes).ok_or_else(|| {
            self.error(&place, "the decoded data are far larger than the file can hold: refused as malformed")
        })?;
        self.budget.set(left);
        memory::reserve(format_args!("what is read at {place}"), bytes)
            .map_err(LoadError::shortage(self.path))?;
        Ok(())
    }

    /// Returns the bytes of a buffer view, decompressed.
    pub(super) fn view(&self, index: Index<View>, place: impl Display) -> Result<&[u8], LoadError> {
        let view = self.get(&self.root.buffer_views, index, &place, "buffer view")?;
        let known = self.decompressed.get(index.value());
        if let Some(bytes) = known.and_then(OnceCell::get) {
            return Ok(bytes);
        }
        let what = format!("buffer view {}", index.value());
        let extensions = view.extensions.as_ref().map(|extensions| &extensions.others);
        for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
            let at = format!("/bufferViews/{}", index.value());
            let Some(compressed) = self.strict_extension::<MeshoptView>(extensions, name, &at)? else {
                continue;
            };
            let at = format!("{at}/extensions/{name}");
            let bytes = self.decompress(&compressed, &at)?;
            if let Some(known) = known {
                return Ok(known.get_or_init(|| bytes));
            }
        }
        let (offset, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        self.range(view.buffer.value(), [offset, length], &what, &place)
    }

    fn decompress(&self, compressed: &MeshoptView, at: &str) -> Result<Vec<u8>, LoadError> {
        let range = [compressed.byte_offset, compressed.byte_length];
        let data = self.range(compressed.buffer, range, "the compressed view", &at)?;
        let length = compressed.decoded_length().unwrap_or(usize::MAX) as u64;
        // Twice, because indices are decoded to words before they become bytes.
        self.charge(length.saturating_mul(2), at)?;
        let bytes = compressed.decode(data).map_err(|reason| self.error(at, reason))?;
        self.allow_for(length);
        Ok(bytes)
    }

    /// The number of bytes that may still be made.
    #[cfg(feature = "draco")]
    pub(super) fn affordable(&self) -> u64 {
        self.budget.get()
    }

    /// Raises the budget in proportion to `bytes` that were decompressed.
    pub(super) fn allow_for(&self, bytes: u64) {
        let more = LARGEST_SECOND_EXPANSION.saturating_mul(bytes);
        self.budget.set(self.budget.get().saturating_add(more));
    }

    /// Returns a part of a buffer, given by offset and length.
    fn range(
        &self,
        number: usize,
        [offset, length]: [u64; 2],
        what: &str,
        place: &dyn Display,
    ) -> Result<&[u8], LoadError> {
        let buffer = self
            .buffers
            .get(number)
            .ok_or_else(|| self.error(place, format!("{what} is of buffer {number}, which is not there")))?;
        let bytes =
            buffer.as_ref().map_err(|reason| self.error(place, format!("buffer {number}: {reason}")))?;
        let range = usize::try_from(offset).ok().zip(usize::try_from(length).ok());
        let view = range.and_then(|(offset, length)| bytes.get(offset..)?.get(..length));
        view.ok_or_else(|| {
            let end = u128::from(offset) + u128::from(length);
            let reason = format!("{what} reaches byte {end} of buffer {number}, which has {}", bytes.len());
            self.error(place, reason)
        })
    }

    /// Parses an extension of the object at `place`. Its members that are not as expected are left out; none if that
    /// is impossible.
    pub(super) fn extension<T: DeserializeOwned>(
        &self,
        extensions: Option<&Map<String, Value>>,
        name: &str,
        place: impl Display,
    ) -> Option<T> {
        self.lenient(extensions?.get(name)?, format_args!("{place}/extensions/{name}"))
    }

    /// Parses a value at `place`. Its members that are not as expected are left out; none if that is impossible.
    pub(super) fn lenient<T: DeserializeOwned>(&self, value: &Value, place: impl Display) -> Option<T> {
        if let Ok(read) = T::deserialize(value) {
            return Some(read);
        }
        let mut value = value.clone();
        let read = mending::read(&mut value, &place.to_string(), &|_| true, &mut self.mended.borrow_mut());
        let left_out = |Unmendable { place, reason }| self.mend(place, format_args!("{reason}: left out"));
        read.map_err(left_out).ok()
    }

    /// Parses an extension of the object at `place` that must be as expected.
    pub(super) fn strict_extension<T: DeserializeOwned>(
        &self,
        extensions: Option<&Map<String, Value>>,
        name: &str,
        place: impl Display,
    ) -> Result<Option<T>, LoadError> {
        let Some(value) = extensions.and_then(|extensions| extensions.get(name)) else { return Ok(None) };
        T::deserialize(value).map(Some).map_err(|error| {
            let reason = error.to_string().escape_debug().to_string().replace("\\\"", "\"");
            self.error(format_args!("{place}/extensions/{name}"), reason)
        })
    }

    /// The folder that relative references start from.
    pub(super) fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }
}

/// Reads the bytes that a buffer's URI refers to; each file is read once.
fn from_uri(
    uri: &str,
    path: &Path,
    files: &mut HashMap<PathBuf, Result<Rc<[u8]>, String>>,
    sources: &SourceFiles,
) -> Result<Rc<[u8]>, String> {
    let found = uri::resolve(uri, path.parent().unwrap_or(Path::new("")));
    // Only the remedy of a warning has marks.
    match found.map_err(|reason| reason.replace('`', ""))? {
        Resource::Data(bytes) => Ok(bytes.into()),
        Resource::File(file) => {
            let read = |file: &PathBuf| match sources.read(file) {
                Ok(bytes) => Ok(bytes.into()),
                Err(error) => Err(format!("cannot read {}: {error}", file.display())),
            };
            files.entry(file).or_insert_with_key(read).clone()
        }
    }
}
