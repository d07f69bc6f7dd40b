//! Fuzzing of one target, which RAYFRONT_FUZZ names; all other arguments are libFuzzer's.

#![no_main]

mod mutate;
#[path = "../../it/support.rs"]
#[allow(dead_code)]
mod support;
mod targets;

use std::sync::LazyLock;

use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

static TARGET: LazyLock<(&str, targets::Target)> = LazyLock::new(|| {
    let wanted = std::env::var("RAYFRONT_FUZZ").unwrap_or_default();
    let found = targets::ALL.iter().find(|(name, _)| *name == wanted);
    *found.unwrap_or_else(|| {
        let names: Vec<&str> = targets::ALL.iter().map(|(name, _)| *name).collect();
        eprintln!("RAYFRONT_FUZZ={wanted}: use one of {}", names.join(", "));
        std::process::exit(2)
    })
});

fuzz_target!(|bytes: &[u8]| (TARGET.1)(bytes));

// Half of the changes are to what the bytes mean, half to the bytes.
fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    let mut random = mutate::Random::new(seed);
    let changed = if random.below(2) == 0 { mutate::by_meaning(TARGET.0, &data[..size], &mut random) } else { None };
    match changed.filter(|bytes| bytes.len() <= max_size) {
        Some(bytes) => {
            data[..bytes.len()].copy_from_slice(&bytes);
            bytes.len()
        }
        None => fuzzer_mutate(data, size, max_size),
    }
});
