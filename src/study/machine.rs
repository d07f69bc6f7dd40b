//! The machine that a study ran on.

use crate::simd::Isa;

/// Returns names and values for a table.
pub fn describe() -> Vec<(&'static str, String)> {
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
    let levels: Vec<&str> = Isa::available().into_iter().map(Isa::name).collect();
    let mut facts = vec![
        ("program", format!("rayfront {}", env!("CARGO_PKG_VERSION"))),
        ("system", format!("{} on {}", std::env::consts::OS, std::env::consts::ARCH)),
        ("threads", cores.to_string()),
        ("instruction sets", levels.join(", ")),
    ];
    if let Some(model) = value_of("/proc/cpuinfo", "model name") {
        facts.insert(1, ("processor", model));
    }
    if let Some(memory) = value_of("/proc/meminfo", "MemTotal") {
        facts.push(("memory", memory));
    }
    facts
}

/// Returns the text after `name` and its colon in the first line of a file that starts with `name`.
fn value_of(file: &str, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find(|line| line.starts_with(name))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
