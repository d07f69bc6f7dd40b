//! Thread pools and their size.

/// The largest number of threads; more are of no use.
const MOST_THREADS: usize = 1024;

/// Calls `work` on a pool of `threads` threads, at most 1,024; 0 stands for one per core. Sessions in it use all of
/// them.
///
/// # Errors
///
/// [`ThreadError`] if `threads` is above 1,024, or if the system cannot start that many.
pub fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, ThreadError> {
    Ok(thread_pool(threads)?.install(work))
}

/// Creates a pool of `threads` threads; 0 stands for one per core.
pub fn thread_pool(threads: usize) -> Result<rayon::ThreadPool, ThreadError> {
    check_number(threads, "")?;
    if threads == 0 {
        check_environment()?;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| ThreadError { threads, reason: error.to_string() })
}

/// Checks a number of threads. `asked` names its source and precedes the reason in the error.
fn check_number(threads: usize, asked: &str) -> Result<(), ThreadError> {
    let reason = || format!("{asked}more than {MOST_THREADS} are of no use");
    if threads > MOST_THREADS { Err(ThreadError { threads, reason: reason() }) } else { Ok(()) }
}

/// Checks the number of threads in `RAYON_NUM_THREADS`, which applies if no other is given.
pub fn check_environment() -> Result<(), ThreadError> {
    let wanted = std::env::var("RAYON_NUM_THREADS").ok().and_then(|threads| threads.parse().ok());
    check_number(wanted.unwrap_or(0), "as RAYON_NUM_THREADS says, and ")
}

/// Threads could not be started: too many are requested, or the system has no more.
#[derive(Debug)]
pub struct ThreadError {
    threads: usize,
    reason: String,
}

impl std::error::Error for ThreadError {}

impl std::fmt::Display for ThreadError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "cannot start {} threads: {}: use fewer", self.threads, self.reason)
    }
}
