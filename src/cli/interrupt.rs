//! Ctrl-C and other signals that request the program's end.

use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, OnceLock};

use crate::view::watched::{POLL_INTERVAL, Watched};
use crate::world::SourceFiles;

/// The state of requests to end the program.
#[derive(Clone, Default)]
pub struct Interrupt {
    stop: Arc<AtomicBool>,
    /// The number of the signal.
    signal: Arc<AtomicU8>,
}

impl Interrupt {
    /// Starts to watch for signals, unless that has begun before. A second Ctrl-C ends the program immediately.
    pub fn watch() -> Self {
        static WATCHED: OnceLock<Interrupt> = OnceLock::new();
        let watched = WATCHED.get_or_init(|| {
            let interrupt = Self::default();
            watch(interrupt.clone());
            interrupt
        });
        watched.clone()
    }

    /// The flag that is set when the current work must end.
    pub fn flag(&self) -> &AtomicBool {
        &self.stop
    }

    /// True if the program has been requested to end.
    pub fn is_set(&self) -> bool {
        self.signal.load(Ordering::Acquire) != 0
    }

    /// Stops the current work, but not the program.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Release);
    }

    /// Begins new work: clears the flag, unless the program must end.
    pub fn begin_anew(&self) {
        self.stop.store(self.is_set(), Ordering::Release);
    }

    /// Returns 128 plus the signal's number, as shells report it; 0 if there was none.
    pub fn exit_code(&self) -> u8 {
        if self.is_set() { 128 + self.signal.load(Ordering::Relaxed) } else { 0 }
    }

    /// Records a signal; returns true if it is the first.
    fn set(&self, signal: u8) -> bool {
        let none_before =
            self.signal.compare_exchange(0, signal, Ordering::AcqRel, Ordering::Relaxed).is_ok();
        self.stop.store(true, Ordering::Release);
        none_before
    }
}

/// The number of Ctrl-C's signal.
const SIGINT: u8 = 2;

/// Handles two signals that would end the program without a message. SIGXFSZ, for a file beyond its size limit
/// (`ulimit -f`), becomes a write error. SIGABRT, sent after the allocator has given up with a message (even within the
/// standard library), becomes the exit code for a limit.
#[cfg(unix)]
pub fn guard() {
    use signal_hook::consts::{SIGABRT, SIGXFSZ};

    use super::failure::Fault;

    let limit = Fault::Limit.number().into();
    let gives_up = Arc::new(AtomicBool::new(true));
    // Without these handlers, the signals act as usual.
    let _ = signal_hook::flag::register_conditional_shutdown(SIGABRT, limit, gives_up.clone());
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        gives_up.store(false, Ordering::Relaxed);
        usual(panic);
    }));
}

#[cfg(not(unix))]
pub fn guard() {}

/// Watches SIGINT, SIGTERM (`timeout`, containers, schedulers) and, except under `nohup`, SIGHUP (a closed terminal).
#[cfg(unix)]
fn watch(interrupt: Interrupt) {
    use signal_hook::consts::{SIGHUP, SIGTERM};
    use std::time::{Duration, Instant};

    /// The time within which repeated signals count once: a launcher may pass a signal on twice, to the program and to
    /// its group.
    const AT_ONCE: Duration = Duration::from_millis(500);

    let last = if ignores_hangup() { None } else { Some(SIGHUP) };
    let watched = [i32::from(SIGINT), SIGTERM].into_iter().chain(last);
    // Without a handler, signals end the program as usual.
    let Ok(mut signals) = signal_hook::iterator::Signals::new(watched) else { return };
    let watch = move || {
        let mut first: Option<Instant> = None;
        for signal in signals.forever() {
            let signal = signal as u8;
            let again = first.is_some_and(|first| first.elapsed() > AT_ONCE);
            if !interrupt.set(signal) && again && signal == SIGINT {
                std::process::exit(128 + i32::from(SIGINT));
            }
            first.get_or_insert_with(Instant::now);
        }
    };
    // If no thread can be started, nothing is saved when a signal ends the program.
    let _ = std::thread::Builder::new().name("signals".into()).spawn(watch);
}

/// True if the program was started with SIGHUP ignored, or if that is unknown.
#[cfg(unix)]
fn ignores_hangup() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_none_or(|mask| mask & 1 == 1)
}

/// Watches Ctrl-C and the closing of the window.
#[cfg(not(unix))]
fn watch(interrupt: Interrupt) {
    let handler = move || {
        if !interrupt.set(SIGINT) {
            std::process::exit(128 + i32::from(SIGINT));
        }
    };
    // Without a handler, Ctrl-C ends the program as usual.
    let _ = ctrlc::set_handler(handler);
}

/// Runs `work`, and stops it when a file changes.
pub fn while_unchanged<T>(files: Option<&SourceFiles>, interrupt: &Interrupt, work: impl FnOnce() -> T) -> T {
    let Some(files) = files else { return work() };
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let look = || {
            let mut files = Watched::new(files);
            while !done.load(Ordering::Acquire) {
                if files.have_changed() {
                    return interrupt.stop();
                }
                std::thread::sleep(POLL_INTERVAL);
            }
        };
        // If no thread can be started, the change is noticed after this image.
        let _ = std::thread::Builder::new().spawn_scoped(scope, look);
        let worked = work();
        done.store(true, Ordering::Release);
        worked
    })
}
