//! Every call that can fail fails, one by one: never a panic, never a damaged file, and a matching exit code.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use super::ball;
use crate::program::{Place, ended, folder};

/// The library that makes calls fail; none without a compiler.
static SHIM: LazyLock<Option<PathBuf>> = LazyLock::new(|| {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/hostile/shim.rs");
    let library = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("shim-{}.so", std::process::id()));
    let rustc = std::env::var_os("RUSTC").unwrap_or("rustc".into());
    let mut compile = Command::new(rustc);
    compile.args(["--edition", "2024", "--crate-type", "cdylib", "-O", "-C", "panic=abort", "-o"]);
    let done = compile.arg(&library).arg(source).output().ok()?;
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    Some(library)
});

const EIO: i32 = 5;
const EAGAIN: i32 = 11;
const ENOMEM: i32 = 12;
const ENOSPC: i32 = 28;

/// The number of runs by function and exit code.
#[derive(Default)]
struct Outcomes(BTreeMap<String, BTreeMap<i32, u32>>);

/// hecs 0.11 writes to allocated memory without checking for null: in four of 3,000 allocations, so at most in one of
/// those that fail here.
const SIGSEGV: i32 = 11;
const UNCHECKED: i32 = 128 + SIGSEGV;

/// Makes the calls of a function fail one by one, with a given step.
fn all_calls(name_of_call: &str, errno: i32, step: usize, line: &[&str], outcomes: &mut Outcomes) {
    let name = name_of_call;
    let Some(shim) = &*SHIM else { return };
    let here = folder(&ball(""));
    let render = |fault: Option<usize>| {
        let mut command = here.command(line);
        command.env("LD_PRELOAD", shim);
        if let Some(nth) = fault {
            command.env("RAYFRONT_FAULT", format!("{name}:{nth}:{errno}"));
        }
        command.output().expect("the program runs")
    };
    let read = |file: &str| std::fs::read(here.join(file)).ok();
    let outputs: Vec<&str> = line.windows(2).filter(|pair| pair[0] == "-o").map(|pair| pair[1]).collect();
    let whole = render(None);
    assert_eq!(whole.status.code(), Some(0), "{}", String::from_utf8_lossy(&whole.stderr));
    // Films record their render time.
    let hash = |file: &str| match file.ends_with(".film") {
        true => rayfront::internals::formats::film_file::load(&here.join(file))
            .ok()
            .map(|film| film.film.hash().to_le_bytes().to_vec()),
        false => read(file),
    };
    let right: Vec<_> = outputs.iter().map(|file| hash(file).expect("an output")).collect();
    let calls = calls(&here, name, line, shim);
    assert!(calls > 0, "{name} is never called");
    for nth in (0..calls).step_by(step) {
        outputs.iter().for_each(|file| drop(std::fs::remove_file(here.join(file))));
        let found = render(Some(nth));
        let error = String::from_utf8_lossy(&found.stderr);
        let what = format!("{name} {nth} ({errno})");
        let of_signal = || found.status.signal().filter(|signal| *signal == SIGSEGV && name == "malloc");
        let code = found.status.code().or_else(|| of_signal().map(|_| UNCHECKED));
        let code = code.unwrap_or_else(|| panic!("{what}: {:?}: {error}", found.status));
        assert!(!error.contains("panicked"), "{what}: {error}");
        if code == UNCHECKED {
            let unchecked = outcomes.0.entry(name.into()).or_default().entry(code).or_default();
            *unchecked += 1;
            assert!(*unchecked < 2, "{what}: {:?}", found.status);
            continue;
        }
        assert!(matches!(code, 0 | 1 | 3 | 4), "{what}: {code}: {error}");
        assert!(code == 0 || !error.is_empty() || name == "write", "{what}: {code} without a word");
        let mut missing = 0;
        for (file, right) in outputs.iter().zip(&right) {
            match hash(file) {
                None => {
                    assert!(!here.join(file).exists(), "{what}: {file} is damaged");
                    missing += 1;
                }
                Some(found) => assert!(found == *right, "{what}: {file} is another"),
            }
        }
        assert!(code != 0 || missing == 0, "{what}: {missing} outputs are missing, and nobody says so");
        let left = std::fs::read_dir(&here).expect("a folder").flatten().map(|file| file.path());
        for path in left {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if name.ends_with(".part") {
                // A program that cannot remove files, or is killed, leaves it behind; the next run removes it.
                assert!(code != 0 || name_of_call == "unlink", "{what}: left {name}");
                std::fs::remove_file(path).expect("removed");
            } else if name.contains(".saved") {
                assert!(rayfront::internals::formats::film_file::load(&path).is_ok(), "{what}: {name}");
                std::fs::remove_file(path).expect("removed");
            }
        }
        *outcomes.0.entry(format!("{name} ({errno})")).or_default().entry(code).or_default() += 1;
    }
    println!("{name} ({errno}): {calls} calls");
}

/// Returns the number of calls.
fn calls(here: &Path, name: &str, line: &[&str], shim: &Path) -> usize {
    const MANY: usize = 1_000_000;
    let mut command = here.command(line);
    let text = ended(command.env("LD_PRELOAD", shim).env("RAYFRONT_FAULT", format!("{name}:{MANY}:0"))).err;
    let left = text.lines().find_map(|line| line.strip_prefix("shim: ")?.parse::<usize>().ok());
    MANY - left.unwrap_or_else(|| panic!("no count: {text}"))
}

/// The folder of the outputs is listed once, for leftover files, since it may hold all frames of a film.
#[test]
fn output_folder_is_listed_once() {
    let Some(shim) = &*SHIM else { return };
    let folder = folder(&ball(""));
    for line in [&LINE[..], &["scene.ron", "-q", "-o", "a.png", "--denoise", "-o", "b.exr"]] {
        assert_eq!(calls(&folder, "opendir", line, shim), 1, "{line:?}");
    }
}

const LINE: [&str; 8] = ["scene.ron", "-t", "2", "-q", "-o", "a.png", "-o", "a.film"];

#[test]
fn failing_file_operations_are_reported() {
    let mut outcomes = Outcomes::default();
    for (name, errno) in [
        ("open64", EIO),
        ("read", EIO),
        ("write", ENOSPC),
        ("fsync", EIO),
        ("rename", EIO),
        ("fchmod", EIO),
        ("flock", EIO),
        ("unlink", EIO),
        ("opendir", EIO),
    ] {
        all_calls(name, errno, 1, &LINE, &mut outcomes);
    }
    println!("{:#?}", outcomes.0);
}

#[test]
fn failing_threads_are_reported() {
    let mut outcomes = Outcomes::default();
    all_calls("pthread_create", EAGAIN, 1, &LINE, &mut outcomes);
    println!("{:#?}", outcomes.0);
}

#[test]
fn failing_allocations_are_reported() {
    let mut outcomes = Outcomes::default();
    // There are several thousand calls in total.
    for (name, step) in [("malloc", 83), ("calloc", 11), ("realloc", 17), ("posix_memalign", 1)] {
        all_calls(name, ENOMEM, step, &LINE, &mut outcomes);
    }
    println!("{:#?}", outcomes.0);
}
