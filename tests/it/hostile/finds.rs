//! Inputs found by fuzzing and its seeds are read, compiled and rendered, or refused: tests/fuzz/finds and
//! tests/fuzz/seeds, by target. `.ci/fuzz` searches for more.

use std::path::Path;

use crate::fuzz_targets::ALL;

#[test]
fn inputs_found_by_fuzzing_are_handled() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz");
    let mut count = 0;
    for (name, target) in ALL {
        for kind in ["finds", "seeds"] {
            for file in std::fs::read_dir(folder.join(kind).join(name)).into_iter().flatten().flatten() {
                println!("{}", file.path().display());
                target(&std::fs::read(file.path()).expect("a file"));
                count += 1;
            }
        }
    }
    assert!(count > 0, "there are seeds");
}
