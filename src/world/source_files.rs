//! Which files a world was read from, and what was in them.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};

use xxhash_rust::xxh3::{Xxh3, xxh3_128};

use super::assets::{Image, Mesh};
use crate::math::{Vec2, Vec4};

/// A file's length in bytes and the 128-bit hash (XXH3) of its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Content {
    /// In bytes.
    pub length: u64,
    /// XXH3 of all of them.
    pub hash: u128,
}

/// Files that were read, by their paths. Copies are one and the same list: several threads read.
#[derive(Clone, Debug, Default)]
pub struct SourceFiles {
    read: Arc<Mutex<BTreeMap<PathBuf, Content>>>,
    kept: Option<Kept>,
}

/// What files were decoded to, for a scene that is read again and again: frames of an animation. Copies are one
/// and the same store.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    images: Arc<Mutex<HashMap<u128, Image>>>,
    meshes: Arc<Mutex<HashMap<u128, Mesh>>>,
    tangents: Arc<Mutex<HashMap<u128, Vec<Option<Vec4>>>>>,
}

impl SourceFiles {
    /// None yet, with what was decoded before.
    pub fn keeping(kept: &Kept) -> SourceFiles {
        SourceFiles { kept: Some(kept.clone()), ..SourceFiles::default() }
    }

    /// What an encoded picture shows: decoded, or known from before. `path` says what it is where its bytes do not.
    pub fn image<E>(
        &self,
        bytes: &[u8],
        path: &Path,
        decode: impl FnOnce() -> Result<Image, E>,
    ) -> Result<Image, E> {
        known(self.kept.as_ref().map(|kept| &*kept.images), || of_file(bytes, path), decode)
    }

    /// The same of a mesh.
    pub fn mesh<E>(
        &self,
        bytes: &[u8],
        path: &Path,
        decode: impl FnOnce() -> Result<Mesh, E>,
    ) -> Result<Mesh, E> {
        known(self.kept.as_ref().map(|kept| &*kept.meshes), || of_file(bytes, path), decode)
    }

    /// The tangents of a mesh's corners along a set of its texture coordinates, which depend on where these, its
    /// positions and its normals are.
    pub fn tangents<E>(
        &self,
        mesh: &Mesh,
        uvs: &[Vec2],
        make: impl FnOnce() -> Result<Vec<Option<Vec4>>, E>,
    ) -> Result<Vec<Option<Vec4>>, E> {
        let key = || {
            let mut hasher = Xxh3::new();
            let mut add = |numbers: &mut dyn Iterator<Item = u32>| {
                let bytes: Vec<u8> = numbers.flat_map(u32::to_le_bytes).collect();
                hasher.update(&(bytes.len() as u64).to_le_bytes());
                hasher.update(&bytes);
            };
            add(&mut mesh.positions.iter().flat_map(|p| p.to_array()).map(f32::to_bits));
            add(&mut mesh.normals.iter().flat_map(|n| n.to_array()).map(f32::to_bits));
            add(&mut uvs.iter().flat_map(|uv| uv.to_array()).map(f32::to_bits));
            add(&mut mesh.triangles.as_flattened().iter().copied());
            hasher.digest128()
        };
        known(self.kept.as_ref().map(|kept| &*kept.tangents), key, make)
    }

    /// Reads a file and remembers what was in it.
    pub fn read(&self, path: &Path) -> std::io::Result<Vec<u8>> {
        let bytes = std::fs::read(path)?;
        let content = Content { length: bytes.len() as u64, hash: xxh3_128(&bytes) };
        self.lock().insert(path.to_owned(), content);
        Ok(bytes)
    }

    /// Adds those of another list.
    pub fn extend(&self, others: &SourceFiles) {
        let others = others.all();
        self.lock().extend(others);
    }

    /// All that have been read.
    pub fn all(&self) -> BTreeMap<PathBuf, Content> {
        self.lock().clone()
    }

    /// Nothing panics while it holds the lock.
    fn lock(&self) -> MutexGuard<'_, BTreeMap<PathBuf, Content>> {
        self.read.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// What a file's content stands for: its extension, too, says what it is decoded to.
fn of_file(bytes: &[u8], path: &Path) -> u128 {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    xxh3_128(bytes) ^ xxh3_128(extension.as_encoded_bytes()).rotate_left(1)
}

/// What something is made to, once. Mistakes name their files and are found anew.
fn known<T: Clone, E>(
    store: Option<&Mutex<HashMap<u128, T>>>,
    key: impl FnOnce() -> u128,
    make: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    let Some(store) = store else { return make() };
    let lock = || store.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let key = key();
    if let Some(found) = lock().get(&key) {
        return Ok(found.clone());
    }
    let made = make()?;
    lock().insert(key, made.clone());
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Texels;

    #[test]
    fn what_was_decoded_is_known_by_its_bytes() {
        let image =
            |grey: u8| Image { source: None, width: 1, height: 1, texels: Texels::Rgba8(vec![[grey; 4]]) };
        let kept = Kept::default();
        let files = SourceFiles::keeping(&kept);
        let ask = |files: &SourceFiles, bytes: &[u8], path: &str, grey: Option<u8>| {
            files.image(bytes, Path::new(path), || grey.map(image).ok_or("decoded again"))
        };
        assert_eq!(ask(&files, b"a", "x.png", Some(1)), Ok(image(1)));
        assert_eq!(ask(&SourceFiles::keeping(&kept), b"a", "other.PNG", None), Ok(image(1)));
        assert_eq!(ask(&files, b"b", "x.png", Some(2)), Ok(image(2)), "the file has changed");
        assert_eq!(ask(&files, b"a", "x.tga", Some(3)), Ok(image(3)), "it is read as something else");
        assert!(ask(&files, b"c", "x.png", None).is_err() && ask(&files, b"c", "x.png", Some(4)).is_ok());
        assert!(ask(&SourceFiles::default(), b"a", "x.png", None).is_err(), "nothing is kept");
    }
}
