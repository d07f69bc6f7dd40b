//! A cache of decoded files, for scenes that are read repeatedly: frames of an animation, or a scene that is being
//! edited.

use std::collections::HashMap;
use std::convert::Infallible;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard};

use xxhash_rust::xxh3::xxh3_128;

use super::assets::{Font, Image, Mesh, Strands};
use crate::error::Diagnostic;
use crate::math::Vec4;

/// A cache of images, meshes and tangents. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct AssetCache {
    /// Images, by the content and path of their files.
    pub images: Store<DecodedImage>,
    /// Images computed from files, by their own content.
    pub computed: Store<Arc<Image>>,
    /// Meshes by their own content, except those of [`Self::mesh_files`].
    pub meshes: Store<Arc<Mesh>>,
    /// The contents of files of a single mesh, by their bytes and path.
    pub mesh_files: Store<Arc<MeshFile>>,
    /// Strands with the warnings of reading them, by the content and path of their files.
    pub strands: Store<(Arc<Strands>, Vec<Diagnostic>)>,
    /// Fonts, likewise.
    pub fonts: Store<Arc<Font>>,
    /// Tangents at the corners of meshes, by the inputs that they are computed from.
    pub tangents: Store<Vec<Option<Vec4>>>,
}

/// The content of a file of a single mesh without materials.
#[derive(Clone, Debug)]
pub struct MeshFile {
    /// The mesh.
    pub mesh: Arc<Mesh>,
    /// The names of the images that cover it, as written, and their lines.
    pub images: Vec<(String, usize)>,
    /// The number of the image on each triangle, or empty if the first one is on all.
    pub image_of: Vec<u32>,
    /// The warnings of reading the file, which are due whenever the mesh is used.
    pub warnings: Vec<Diagnostic>,
}

/// Values by 128-bit hashes of all their inputs. Clones share them. A store without a map caches nothing and makes each
/// value anew.
#[derive(Clone, Debug)]
pub struct Store<T>(Option<Arc<Mutex<Entries<T>>>>);

type Entries<T> = HashMap<u128, CacheEntry<T>>;

/// A cached value; `is_used` is true if it was requested since the last [`AssetCache::forget_unused`].
#[derive(Debug)]
struct CacheEntry<T> {
    value: T,
    is_used: bool,
}

/// An image read from a file.
#[derive(Clone, Debug)]
pub struct DecodedImage {
    /// The image.
    pub image: Arc<Image>,
    /// A warning about its values.
    pub warning: Option<Diagnostic>,
}

impl DecodedImage {
    /// Appends the warning to a list and returns the image.
    pub fn report(self, warnings: &mut Vec<Diagnostic>) -> Arc<Image> {
        warnings.extend(self.warning);
        self.image
    }
}

impl From<Image> for DecodedImage {
    fn from(image: Image) -> DecodedImage {
        DecodedImage { image: image.into(), warning: None }
    }
}

impl AssetCache {
    /// Drops the values that were not requested since the last call. Called after each reading of a scene, so that only
    /// values that a frame or an edit shares with the previous one stay cached.
    pub fn forget_unused(&self) {
        self.images.forget_unused();
        self.computed.forget_unused();
        self.meshes.forget_unused();
        self.mesh_files.forget_unused();
        self.strands.forget_unused();
        self.fonts.forget_unused();
        self.tangents.forget_unused();
    }

    /// Returns an empty cache that stores values; the default one stores none.
    pub fn keeping() -> AssetCache {
        AssetCache {
            images: Store::keeping(),
            computed: Store::keeping(),
            meshes: Store::keeping(),
            mesh_files: Store::keeping(),
            strands: Store::keeping(),
            fonts: Store::keeping(),
            tangents: Store::keeping(),
        }
    }
}

impl<T> Store<T> {
    fn forget_unused(&self) {
        if let Some(store) = &self.0 {
            lock(store).retain(|_, entry| std::mem::take(&mut entry.is_used));
        }
    }
}

impl<T> Default for Store<T> {
    /// Returns a store that caches nothing.
    fn default() -> Self {
        Store(None)
    }
}

impl<T: Clone> Store<T> {
    fn keeping() -> Self {
        Store(Some(Arc::default()))
    }

    /// Returns the value for a key; `make` computes it if it is not cached. Errors are not cached: they name their
    /// files and recur.
    pub fn get_or_insert<E>(
        &self,
        key: impl FnOnce() -> u128,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, E> {
        let Some(store) = &self.0 else { return make() };
        let key = key();
        if let Some(found) = lock(store).get_mut(&key) {
            found.is_used = true;
            return Ok(found.value.clone());
        }
        let value = make()?;
        lock(store).insert(key, CacheEntry { value: value.clone(), is_used: true });
        Ok(value)
    }

    /// Returns the value decoded from a file's bytes. The path is part of the key, because it also determines how to
    /// decode them.
    pub fn decoded<E>(
        &self,
        bytes: &[u8],
        path: &Path,
        decode: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, E> {
        let key = || xxh3_128(bytes) ^ xxh3_128(path.as_os_str().as_encoded_bytes()).rotate_left(1);
        self.get_or_insert(key, decode)
    }
}

impl<T> Store<Arc<T>> {
    /// Returns the cached value with the same hash if there is one; otherwise caches and returns this one.
    pub fn same(&self, value: T, hash: impl FnOnce(&T) -> u128) -> Arc<T> {
        let value = Arc::new(value);
        let made: Result<_, Infallible> = self.get_or_insert(|| hash(&value), || Ok(value.clone()));
        made.unwrap_or_else(|never| match never {})
    }
}

/// Locks a mutex; no code panics while it holds the lock.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn store_returns_a_cached_value_only_for_equal_bytes_and_path() {
        let store: Store<u8> = Store::keeping();
        let ask = |store: &Store<u8>, bytes: &[u8], path: &str, value: Option<u8>| {
            store.decoded(bytes, Path::new(path), || value.ok_or("decoded again"))
        };
        assert_eq!(ask(&store, b"a", "x.png", Some(1)), Ok(1));
        assert_eq!(ask(&store.clone(), b"a", "x.png", None), Ok(1));
        assert_eq!(ask(&store, b"b", "x.png", Some(2)), Ok(2), "the file has changed");
        assert_eq!(ask(&store, b"a", "x.tga", Some(3)), Ok(3), "it is read as something else");
        assert!(ask(&store, b"c", "x.png", None).is_err() && ask(&store, b"c", "x.png", Some(4)).is_ok());
        assert!(ask(&Store::default(), b"a", "x.png", None).is_err(), "nothing is kept");
    }

    /// Each frame of a morph animation has its own mesh.
    #[test]
    fn forget_unused_drops_values_not_requested_since_the_last_call() {
        let kept = AssetCache::keeping();
        let count = || kept.tangents.0.as_ref().map_or(0, |store| lock(store).len());
        for frame in 1..100 {
            for key in [0, frame] {
                let made = kept.tangents.get_or_insert(|| key, || Ok::<_, Infallible>(vec![None; 3]));
                assert!(made.is_ok());
            }
            kept.forget_unused();
            assert_eq!(count(), 2, "that of all frames, and that of frame {frame}");
        }
        assert!(kept.tangents.get_or_insert(|| 0, || Err("made again")).is_ok());
    }
}
