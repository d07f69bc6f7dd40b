//! Hints about memory: they affect time and nothing else.

use std::mem::MaybeUninit;

/// Prefetches `lines` cache lines from an address on. Any address is allowed: nothing is read.
#[inline(always)]
pub fn prefetch(address: usize, lines: usize) {
    for line in 0..lines {
        let address = address + 64 * line;
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            // SAFETY: a hint, which faults at no address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::without_provenance(address)) };
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = address;
    }
}

/// Advises the system to use large pages for memory that is still to be written and will be read in no order: with
/// small pages, finding a page takes as long as reading it. Does nothing if the memory is smaller than such a page, or
/// if the system has none.
pub fn prefer_large_pages<T>(unused: &mut [MaybeUninit<T>]) {
    #[cfg(all(target_os = "linux", not(miri)))]
    if size_of_val(unused) >= 2 << 20 {
        use rustix::mm::{Advice, madvise};
        let range = unused.as_mut_ptr_range();
        // From the start of its first page: other contents of that page are not affected.
        let start = range.start.map_addr(|address| address & !(rustix::param::page_size() - 1));
        let length = range.end.addr() - start.addr();
        // SAFETY: this advice does not change the contents of memory.
        let _ = unsafe { madvise(start.cast(), length, Advice::LinuxHugepage) };
    }
    #[cfg(not(all(target_os = "linux", not(miri))))]
    let _ = unused;
}

/// Returns freed memory to the system if the allocator would keep it for the thread that had it: glibc keeps what lies
/// below anything that is still in use, for each thread separately.
#[cfg(feature = "cli")]
pub fn give_back_freed() {
    #[cfg(all(target_os = "linux", target_env = "gnu", not(miri)))]
    {
        // SAFETY: a function of glibc with this type, which any thread may call at any time.
        unsafe extern "C" {
            safe fn malloc_trim(pad: usize) -> std::ffi::c_int;
        }
        malloc_trim(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefer_large_pages_preserves_contents() {
        let mut numbers: Vec<u64> = Vec::with_capacity(1 << 20);
        numbers.extend(0..1000);
        // Begins in a page that is in use.
        prefer_large_pages(numbers.spare_capacity_mut());
        numbers.extend(1000..1 << 20);
        assert!(numbers.iter().copied().eq(0..1 << 20));
        prefer_large_pages::<u64>(&mut []);
        prefetch(0, 2);
    }

    #[test]
    #[cfg(all(feature = "cli", target_os = "linux", target_env = "gnu", not(miri)))]
    fn give_back_freed_reduces_resident_memory() {
        let resident = || {
            let status = std::fs::read_to_string("/proc/self/status").unwrap();
            let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
            line.trim_end_matches("kB").trim().parse::<u64>().unwrap() >> 10
        };
        // In a thread that has ended, below a block that is in use.
        let begin = || {
            let blocks: Vec<Vec<u8>> = (0..2000).map(|_| vec![1; 100_000]).collect();
            let above = vec![1u8; 100_000];
            drop(blocks);
            above
        };
        let above = std::thread::spawn(begin).join().unwrap();
        let before = resident();
        give_back_freed();
        let after = resident();
        assert!(after + 100 < before, "{before} MB before, {after} MB after");
        drop(above);
    }
}
