//! The CPU time of the process, and the name of the machine.

/// Returns the user and system time of all threads in seconds, if /proc provides it.
pub fn cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name in parentheses may contain spaces; fields 14 and 15 are counted from its end.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    Some(ticks / 100.0)
}

/// Returns the CPU time of all threads in seconds, finer than [`cpu_seconds`], if the system provides it.
pub fn process_cpu_seconds() -> Option<f64> {
    clock::seconds(clock::ClockId::ProcessCPUTime)
}

/// Returns the CPU time of the calling thread in seconds, if the system provides it.
pub fn thread_cpu_seconds() -> Option<f64> {
    clock::seconds(clock::ClockId::ThreadCPUTime)
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple", target_os = "freebsd"))]
mod clock {
    pub use rustix::time::ClockId;

    pub fn seconds(of: ClockId) -> Option<f64> {
        let time = rustix::time::clock_gettime(of);
        Some(time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9)
    }
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple", target_os = "freebsd")))]
mod clock {
    pub enum ClockId {
        ProcessCPUTime,
        ThreadCPUTime,
    }

    pub fn seconds(_: ClockId) -> Option<f64> {
        None
    }
}

/// Returns the name of this machine, if the system provides it.
pub fn host() -> Option<String> {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let name = name.or_else(|| std::env::var("COMPUTERNAME").or_else(|_| std::env::var("HOSTNAME")).ok())?;
    Some(name.trim().to_owned()).filter(|name| !name.is_empty())
}
