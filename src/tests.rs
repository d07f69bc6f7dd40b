//! Helpers of unit tests.

use std::path::Path;

/// Compares a file of the repository with its generated contents, or writes it if `UPDATE` is set.
#[track_caller]
pub fn is_up_to_date(file: &str, new: &[u8]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(path, new).expect("a file of ours");
    } else {
        let old = std::fs::read(path).expect("a file of ours");
        assert!(old == new, "{file} is not as the code: UPDATE=1 cargo test --lib as_the_code");
    }
}
