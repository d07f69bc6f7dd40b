//! The memory budget of the process. Large amounts are reserved before they are allocated, so that a shortage ends in
//! an error message, not in the end of the process or of the machine.

use std::fmt::Display;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// The budget of the process, within its own limit and those of the system.
static OURS: Budget = Budget::of(u64::MAX);

/// Bytes that are never granted: for stacks, waves and the allocator itself.
pub const RESERVE: u64 = 48 << 20;
/// Reservations that add up to less than this are granted without a check of the system's limits.
const SMALL: u64 = 4 << 20;

/// Sets the number of bytes that the process may use in total from now on.
pub fn set_limit(bytes: u64) {
    OURS.most.store(bytes, Ordering::Relaxed);
}

/// Returns the number of bytes that the process may use in total, if it has been set.
pub fn limit() -> Option<u64> {
    Some(OURS.most.load(Ordering::Relaxed)).filter(|bytes| *bytes < u64::MAX)
}

/// Reserves memory for something that is about to be made. Keep the reservation until it is made, so that concurrent
/// ones take it into account. Returns an error if there is not enough memory.
pub fn reserve(what: impl Display, bytes: u64) -> Result<Reservation<'static>, Shortage> {
    OURS.reserve(what, bytes)
}

/// Returns the number of bytes that can still be reserved, if the system reports it.
pub fn available() -> Option<u64> {
    OURS.left().map(|left| left.bytes.saturating_sub(RESERVE))
}

/// Returns the peak resident memory in bytes, if /proc reports it.
pub fn peak() -> Option<u64> {
    status("VmHWM:")
}

/// Returns the resident memory in bytes, if /proc reports it.
pub fn resident() -> Option<u64> {
    status("VmRSS:")
}

/// The budget into which all reservations must fit.
struct Budget {
    /// The number of bytes that the process may use in total.
    most: AtomicU64,
    /// Bytes that are reserved.
    claimed: AtomicU64,
    /// Small reservations since the last check, in bytes.
    small: AtomicU64,
}

/// A reservation of memory for something that is being made.
#[derive(Debug)]
pub struct Reservation<'b> {
    claimed: &'b AtomicU64,
    bytes: u64,
}

impl Drop for Reservation<'_> {
    fn drop(&mut self) {
        self.claimed.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// There is not enough memory for something.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what} takes {}, and {} of {bound}: {hint}", in_words(*.needed), Left(*.left))]
pub struct Shortage {
    what: String,
    needed: u64,
    left: u64,
    bound: MemoryLimit,
    hint: String,
}

impl Shortage {
    /// Adds another remedy to the message.
    pub fn or(self, what: &str) -> Shortage {
        Shortage { hint: format!("{what}, or {}", self.hint), ..self }
    }
}

/// The tightest limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MemoryLimit {
    UserLimit,
    Free,
    AddressSpace,
    Group,
}

impl Display for MemoryLimit {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            MemoryLimit::UserLimit => "what --memory allows",
            MemoryLimit::Free => "the machine's memory",
            MemoryLimit::AddressSpace => "the address space (ulimit -v)",
            MemoryLimit::Group => "the control group's memory",
        })
    }
}

struct Left(u64);

impl Display for Left {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.0 {
            0 => f.write_str("nothing is left"),
            bytes => write!(f, "{} are left", in_words(bytes)),
        }
    }
}

struct FreeMemory {
    bytes: u64,
    bound: MemoryLimit,
}

impl Budget {
    const fn of(most: u64) -> Budget {
        Budget { most: AtomicU64::new(most), claimed: AtomicU64::new(0), small: AtomicU64::new(0) }
    }

    fn reserve(&self, what: impl Display, bytes: u64) -> Result<Reservation<'_>, Shortage> {
        let claimed = self.claimed.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
        let reservation = Reservation { claimed: &self.claimed, bytes };
        if bytes < SMALL && self.small.fetch_add(bytes, Ordering::Relaxed) < SMALL {
            return Ok(reservation);
        }
        self.small.store(0, Ordering::Relaxed);
        match self.left() {
            Some(FreeMemory { bytes: room, bound }) if claimed.saturating_add(RESERVE) > room => {
                let left = room.saturating_sub(claimed - bytes).saturating_sub(RESERVE);
                let hint = match bound {
                    MemoryLimit::UserLimit => "allow more",
                    MemoryLimit::Free => "use a machine with more",
                    MemoryLimit::AddressSpace | MemoryLimit::Group => "raise that limit",
                };
                Err(Shortage { what: what.to_string(), needed: bytes, left, bound, hint: hint.into() })
            }
            _ => Ok(reservation),
        }
    }

    /// Returns the memory left under the tightest limit, before the reserve and reservations are subtracted.
    fn left(&self) -> Option<FreeMemory> {
        let most = self.most.load(Ordering::Relaxed);
        let told = (most < u64::MAX).then(|| most.saturating_sub(resident().unwrap_or(0)));
        let bounds = [
            (told, MemoryLimit::UserLimit),
            (field("/proc/meminfo", "MemAvailable:"), MemoryLimit::Free),
            (address_space(), MemoryLimit::AddressSpace),
            (control_group(), MemoryLimit::Group),
        ];
        let rooms = bounds.into_iter().filter_map(|(bytes, bound)| Some(FreeMemory { bytes: bytes?, bound }));
        rooms.min_by_key(|room| room.bytes)
    }
}

/// Formats a number of bytes in MB or GB, human-readable.
pub fn in_words(bytes: u64) -> String {
    match bytes as f64 {
        bytes if bytes >= 999.5e6 => format!("{:.2} GB", bytes / 1e9),
        bytes => format!("{:.1} MB", bytes / 1e6),
    }
}

/// Parses a human-readable number of bytes: 800M, 1.5G, 2GiB.
pub fn parse(text: &str) -> Result<u64, String> {
    let wrong = || format!("{text:?} is not an amount of memory: write it as 800M, 1.5G or 2GiB");
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let number: f64 = text[..end].parse().map_err(|_| wrong())?;
    let factor = match text[end..].trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kb" => 1e3,
        "m" | "mb" => 1e6,
        "g" | "gb" => 1e9,
        "t" | "tb" => 1e12,
        "kib" => 1024.0,
        "mib" => 1024.0 * 1024.0,
        "gib" => 1024.0 * 1024.0 * 1024.0,
        _ => return Err(wrong()),
    };
    let bytes = (number * factor) as u64;
    if bytes < 1 << 20 {
        return Err(format!("{text:?} is less than a megabyte: {}", wrong()));
    }
    Ok(bytes)
}

/// True if the system limits how much the process may map (`ulimit -v` or `-d`).
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub fn addresses_are_limited() -> bool {
    address_limits().iter().any(Option::is_some)
}

/// Returns the limits on the bytes that the process may map in total, and on those of data.
fn address_limits() -> [Option<u64>; 2] {
    let limits = std::fs::read_to_string("/proc/self/limits").unwrap_or_default();
    ["Max address space", "Max data size"].map(|name| {
        let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
        line.split_whitespace().next()?.parse::<u64>().ok()
    })
}

/// Returns the part of the allowed address space that the process has not mapped yet.
fn address_space() -> Option<u64> {
    let used = ["VmSize:", "VmData:"];
    let left = |(limit, used): (Option<u64>, &str)| Some(limit?.saturating_sub(status(used)?));
    address_limits().into_iter().zip(used).filter_map(left).min()
}

/// Returns the bytes that the process's control group and its ancestors may still take, in versions 1 and 2 of control
/// groups.
fn control_group() -> Option<u64> {
    let groups = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let rooms = groups.lines().filter_map(|line| {
        let [_, controllers, path] = line.splitn(3, ':').collect::<Vec<_>>()[..] else { return None };
        let is_memory = controllers.split(',').any(|name| name == "memory");
        let (base, most, used, file) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max", "memory.current", "inactive_file "),
            _ if is_memory => (
                "/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes",
                "total_inactive_file ",
            ),
            _ => return None,
        };
        // Within a container the group's path may be that of the host.
        let path = Path::new(path.trim_start_matches('/'));
        let rooms = path.ancestors().filter_map(|group| {
            let folder = Path::new(base).join(group);
            let number =
                |name: &str| std::fs::read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
            // The kernel reclaims pages of files that have not been used for some time.
            let stat = std::fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
            let files = stat.lines().find_map(|line| line.strip_prefix(file)?.parse::<u64>().ok());
            let used = number(used)?.saturating_sub(files.unwrap_or(0));
            Some(number(most)?.saturating_sub(used))
        });
        rooms.min()
    });
    rooms.min()
}

/// Returns the value of a line of /proc/self/status, in bytes.
fn status(name: &str) -> Option<u64> {
    field("/proc/self/status", name)
}

/// Returns the value of a line of a file of /proc, which states it in kibibytes, in bytes.
fn field(file: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oversized_reservation_is_rejected_with_a_reason() {
        let budget = Budget::of(1 << 40);
        // (No machine has an exabyte.)
        let shortage = budget.reserve("a film", 1 << 60).unwrap_err().or("use --crop").to_string();
        if cfg!(target_os = "linux") {
            assert!(shortage.starts_with("a film takes 1152921504.61 GB, and "), "{shortage}");
            assert!(shortage.contains("use --crop, or "), "{shortage}");
        }
        assert_eq!(budget.claimed.load(Ordering::Relaxed), 0, "what is refused is not kept");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn reservations_count_until_they_are_dropped() {
        let budget = Budget::of(resident().unwrap() + (1 << 30));
        let half = 600 << 20;
        let first = budget.reserve("one", half).unwrap();
        let message = budget.reserve("two", half).unwrap_err().to_string();
        assert!(message.ends_with("of what --memory allows: allow more"), "{message}");
        drop(first);
        drop(budget.reserve("two", half).unwrap());
        // Many small reservations together are checked, too.
        let many: Result<Vec<_>, _> = (0..2000).map(|_| budget.reserve("a small one", 1 << 20)).collect();
        assert!(many.is_err());
    }

    #[test]
    fn amounts_are_parsed_and_formatted() {
        assert_eq!(
            [parse("800M"), parse("1.5g"), parse("2 GiB")],
            [Ok(800_000_000), Ok(1_500_000_000), Ok(2 << 30)]
        );
        for wrong in ["", "M", "1X", "-1G", "1e3G", "12", "nan"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
        assert_eq!([in_words(1_234_567), in_words(2_345_678_901)], ["1.2 MB", "2.35 GB"]);
    }
}
