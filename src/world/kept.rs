//! What files were decoded to, for a scene that is read again and again: frames of an animation.

use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex};

use xxhash_rust::xxh3::xxh3_128;

use super::assets::{Image, Mesh};
use crate::math::Vec4;

/// All that is kept. Copies are one and the same.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    /// Pictures, by what their files hold.
    pub images: Store<Image>,
    /// Meshes that are files of their own, by what these hold.
    pub meshes: Store<Mesh>,
    /// Tangents of meshes' corners, by what they are made of.
    pub tangents: Store<Vec<Option<Vec4>>>,
}

/// Values by 128-bit hashes of all that they depend on. Copies are one and the same; one that keeps nothing makes
/// everything anew.
#[derive(Clone, Debug)]
pub struct Store<T>(Option<Arc<Mutex<HashMap<u128, T>>>>);

impl Kept {
    /// One that keeps what it is given.
    pub fn keeping() -> Kept {
        Kept { images: Store::keeping(), meshes: Store::keeping(), tangents: Store::keeping() }
    }
}

impl<T> Default for Store<T> {
    /// Keeps nothing.
    fn default() -> Self {
        Store(None)
    }
}

impl<T: Clone> Store<T> {
    fn keeping() -> Self {
        Store(Some(Arc::default()))
    }

    /// What something is made to, once. Mistakes are not kept: they name their files and are found anew.
    pub fn known<E>(&self, key: impl FnOnce() -> u128, make: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let Some(store) = &self.0 else { return make() };
        // Nothing panics while it holds the lock.
        let lock = || store.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let key = key();
        if let Some(found) = lock().get(&key) {
            return Ok(found.clone());
        }
        let made = make()?;
        lock().insert(key, made.clone());
        Ok(made)
    }

    /// What a file's bytes are decoded to. Its extension, too, says what that is.
    pub fn decoded<E>(
        &self,
        bytes: &[u8],
        path: &Path,
        decode: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, E> {
        let key = || {
            let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
            xxh3_128(bytes) ^ xxh3_128(extension.as_encoded_bytes()).rotate_left(1)
        };
        self.known(key, decode)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_decoded_is_known_by_its_bytes() {
        let store: Store<u8> = Store::keeping();
        let ask = |store: &Store<u8>, bytes: &[u8], path: &str, value: Option<u8>| {
            store.decoded(bytes, Path::new(path), || value.ok_or("decoded again"))
        };
        assert_eq!(ask(&store, b"a", "x.png", Some(1)), Ok(1));
        assert_eq!(ask(&store.clone(), b"a", "other.PNG", None), Ok(1));
        assert_eq!(ask(&store, b"b", "x.png", Some(2)), Ok(2), "the file has changed");
        assert_eq!(ask(&store, b"a", "x.tga", Some(3)), Ok(3), "it is read as something else");
        assert!(ask(&store, b"c", "x.png", None).is_err() && ask(&store, b"c", "x.png", Some(4)).is_ok());
        assert!(ask(&Store::default(), b"a", "x.png", None).is_err(), "nothing is kept");
    }
}
