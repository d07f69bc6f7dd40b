//! Interposes between the program and libc (LD_PRELOAD) and makes one call fail: RAYFRONT_FAULT=NAME:N:ERRNO is the
//! N-th call of a function, counted from 0. Counting starts when the program has installed its signal handlers.

use std::ffi::{c_char, c_int, c_long, c_uint, c_void};
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicUsize, Ordering};

unsafe extern "C" {
    fn dlsym(handle: *mut c_void, name: *const c_char) -> *mut c_void;
    fn getenv(name: *const c_char) -> *const c_char;
    fn __errno_location() -> *mut c_int;
    fn __libc_malloc(size: usize) -> *mut c_void;
    fn __libc_calloc(count: usize, size: usize) -> *mut c_void;
    fn __libc_realloc(old: *mut c_void, size: usize) -> *mut c_void;
    fn __libc_memalign(align: usize, size: usize) -> *mut c_void;
}

static ARMED: AtomicBool = AtomicBool::new(false);
static LEFT: AtomicI64 = AtomicI64::new(i64::MAX);
static ERRNO: AtomicI64 = AtomicI64::new(0);
/// A hash of the function's name.
static NAME: AtomicUsize = AtomicUsize::new(0);

const fn code(name: &[u8]) -> usize {
    let (mut code, mut i) = (0usize, 0);
    while i < name.len() {
        code = code.wrapping_mul(31).wrapping_add(name[i] as usize);
        i += 1;
    }
    code
}

/// Reads the environment without allocating.
fn arm() {
    unsafe {
        let mut at = getenv(c"RAYFRONT_FAULT".as_ptr()) as *const u8;
        if at.is_null() || ARMED.load(Ordering::Relaxed) {
            return;
        }
        let mut name = 0usize;
        while *at != b':' {
            name = name.wrapping_mul(31).wrapping_add(*at as usize);
            at = at.add(1);
        }
        let mut numbers = [0i64; 2];
        for number in &mut numbers {
            at = at.add(1);
            while (*at).is_ascii_digit() {
                *number = *number * 10 + i64::from(*at - b'0');
                at = at.add(1);
            }
        }
        NAME.store(name, Ordering::Relaxed);
        LEFT.store(numbers[0], Ordering::Relaxed);
        ERRNO.store(numbers[1], Ordering::Relaxed);
        ARMED.store(true, Ordering::SeqCst);
    }
}

/// Counts a call; returns true, with errno set, if it is the one to fail.
fn fails(name: usize) -> bool {
    if !ARMED.load(Ordering::Relaxed) || NAME.load(Ordering::Relaxed) != name {
        return false;
    }
    let fails = LEFT.fetch_sub(1, Ordering::Relaxed) == 0;
    if fails {
        unsafe { *__errno_location() = ERRNO.load(Ordering::Relaxed) as c_int };
    }
    fails
}

macro_rules! next {
    ($name:ident, $kind:ty) => {{
        static NEXT: AtomicUsize = AtomicUsize::new(0);
        let mut next = NEXT.load(Ordering::Relaxed);
        if next == 0 {
            // RTLD_NEXT
            next = unsafe { dlsym(-1isize as *mut c_void, concat!(stringify!($name), "\0").as_ptr().cast()) } as usize;
            NEXT.store(next, Ordering::Relaxed);
        }
        unsafe { std::mem::transmute::<usize, $kind>(next) }
    }};
}

macro_rules! stand_between {
    ($($name:ident($($argument:ident: $kind:ty),*) -> $answer:ty, $failed:expr;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($argument: $kind),*) -> $answer {
            if fails(const { code(stringify!($name).as_bytes()) }) {
                return $failed;
            }
            let next = next!($name, unsafe extern "C" fn($($kind),*) -> $answer);
            unsafe { next($($argument),*) }
        }
    )*};
}

stand_between! {
    read(file: c_int, to: *mut c_void, count: usize) -> isize, -1;
    write(file: c_int, from: *const c_void, count: usize) -> isize, -1;
    fsync(file: c_int) -> c_int, -1;
    fchmod(file: c_int, mode: c_uint) -> c_int, -1;
    flock(file: c_int, what: c_int) -> c_int, -1;
    rename(from: *const c_char, to: *const c_char) -> c_int, -1;
    unlink(name: *const c_char) -> c_int, -1;
    opendir(name: *const c_char) -> *mut c_void, std::ptr::null_mut();
    lseek64(file: c_int, to: c_long, from: c_int) -> c_long, -1;
    open64(name: *const c_char, flags: c_int, mode: c_uint) -> c_int, -1;
    pthread_create(thread: *mut c_void, how: *const c_void, start: *const c_void, with: *mut c_void) -> c_int,
        ERRNO.load(Ordering::Relaxed) as c_int;
}

/// Arms the shim when the program installs its last signal handler.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sigaction(signal: c_int, new: *const c_void, old: *mut c_void) -> c_int {
    let next = next!(sigaction, unsafe extern "C" fn(c_int, *const c_void, *mut c_void) -> c_int);
    let answer = unsafe { next(signal, new, old) };
    const SIGXFSZ: c_int = 25;
    if signal == SIGXFSZ && !new.is_null() {
        arm();
    }
    answer
}

/// If no call has failed, prints the remaining count at the end.
extern "C" fn tell() {
    if !ARMED.load(Ordering::Relaxed) || ERRNO.load(Ordering::Relaxed) != 0 {
        return;
    }
    let (mut digits, mut left) = ([b'\n'; 24], LEFT.load(Ordering::Relaxed));
    let mut at = digits.len() - 1;
    while left > 0 {
        at -= 1;
        digits[at] = b'0' + (left % 10) as u8;
        left /= 10;
    }
    let next = next!(write, unsafe extern "C" fn(c_int, *const c_void, usize) -> isize);
    unsafe {
        next(2, c"shim: ".as_ptr().cast(), 6);
        next(2, digits[at..].as_ptr().cast(), digits.len() - at);
    }
}

#[used]
#[unsafe(link_section = ".fini_array")]
static AT_THE_END: extern "C" fn() = tell;

#[unsafe(no_mangle)]
pub unsafe extern "C" fn malloc(size: usize) -> *mut c_void {
    if fails(const { code(b"malloc") }) { std::ptr::null_mut() } else { unsafe { __libc_malloc(size) } }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn calloc(count: usize, size: usize) -> *mut c_void {
    if fails(const { code(b"calloc") }) { std::ptr::null_mut() } else { unsafe { __libc_calloc(count, size) } }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn realloc(old: *mut c_void, size: usize) -> *mut c_void {
    if fails(const { code(b"realloc") }) { std::ptr::null_mut() } else { unsafe { __libc_realloc(old, size) } }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn posix_memalign(to: *mut *mut c_void, align: usize, size: usize) -> c_int {
    if fails(const { code(b"posix_memalign") }) {
        return ERRNO.load(Ordering::Relaxed) as c_int;
    }
    let got = unsafe { __libc_memalign(align, size) };
    if got.is_null() {
        return 12;
    }
    unsafe { *to = got };
    0
}
