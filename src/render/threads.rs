//! How many threads work.

/// More threads are of no use to anybody.
const MOST_THREADS: usize = 1024;

/// Does something on `threads` threads, at most 1,024; 0 stands for one for each core. Sessions in it use all of
/// them.
///
/// # Errors
///
/// [`ThreadError`] if there are to be more than 1,024 threads, or if the system gives no more.
pub fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, ThreadError> {
    Ok(thread_pool(threads)?.install(work))
}

/// A pool of `threads` threads; 0 stands for one for each core.
pub fn thread_pool(threads: usize) -> Result<rayon::ThreadPool, ThreadError> {
    check_number(threads, "")?;
    if threads == 0 {
        check_environment()?;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| ThreadError { threads, reason: error.to_string() })
}

/// `asked`: what asks for them, in front of the reason.
fn check_number(threads: usize, asked: &str) -> Result<(), ThreadError> {
    let reason = || format!("{asked}more than {MOST_THREADS} are of no use");
    if threads > MOST_THREADS { Err(ThreadError { threads, reason: reason() }) } else { Ok(()) }
}

/// The same for what the environment asks for where nothing else says how many threads there are to be.
pub fn check_environment() -> Result<(), ThreadError> {
    let wanted = std::env::var("RAYON_NUM_THREADS").ok().and_then(|threads| threads.parse().ok());
    check_number(wanted.unwrap_or(0), "as RAYON_NUM_THREADS says, and ")
}

/// Threads could not be started: there are to be too many, or the system gives no more.
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
