//! What the operating system says that the process has used.

/// User and system time of all threads in seconds, where /proc tells.
pub fn cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name in parentheses may hold spaces; fields 14 and 15 are counted from behind it.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    Some(ticks / 100.0)
}

/// CPU time of all threads in seconds, finer than [`cpu_seconds`], where the system tells.
pub fn process_cpu_seconds() -> Option<f64> {
    clock::seconds(clock::Of::Process)
}

/// CPU time of the calling thread in seconds, where the system tells.
pub fn thread_cpu_seconds() -> Option<f64> {
    clock::seconds(clock::Of::Thread)
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple", target_os = "freebsd"))]
mod clock {
    use rustix::time::ClockId;

    pub(super) enum Of {
        Process,
        Thread,
    }

    pub(super) fn seconds(of: Of) -> Option<f64> {
        let time = rustix::time::clock_gettime(match of {
            Of::Process => ClockId::ProcessCPUTime,
            Of::Thread => ClockId::ThreadCPUTime,
        });
        Some(time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9)
    }
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple", target_os = "freebsd")))]
mod clock {
    pub(super) enum Of {
        Process,
        Thread,
    }

    pub(super) fn seconds(_: Of) -> Option<f64> {
        None
    }
}

/// The name of this machine, if the system tells.
pub fn host() -> Option<String> {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let name = name.or_else(|| std::env::var("COMPUTERNAME").or_else(|_| std::env::var("HOSTNAME")).ok())?;
    Some(name.trim().to_owned()).filter(|name| !name.is_empty())
}
