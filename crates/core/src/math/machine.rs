//! The processors and the memory of the machine.

use std::{num::NonZero, path::Path, thread};

use crate::error::{Error, Result};

/// The most threads for each processor. More threads would only wait for each other, a thousand of
/// them for seconds.
const THREADS_EACH: usize = 4;

/// Returns the number of threads to start where `asked` threads are asked for: one for each
/// processor if `asked` is 0, and never more than four for each.
pub fn threads(asked: usize) -> usize {
    let processors = thread::available_parallelism().map_or(1, NonZero::get);
    if asked == 0 { processors } else { asked.min(THREADS_EACH * processors) }
}

/// Starts a pool of that many [`threads`]. Error: the threads cannot be started.
pub fn pool(asked: usize) -> Result<rayon::ThreadPool> {
    // for 0, rayon's environment variable may set the number
    let number = if asked == 0 { 0 } else { threads(asked) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(number).build();
    pool.map_err(|e| Error::run("threads", e).remedy("ask for fewer"))
}

/// Returns the bytes of memory that this process may still take, as far as the system tells: what
/// is free, and what the limits on the process (`ulimit -v`) and on its control group leave.
pub fn memory_left() -> u64 {
    #[cfg(target_os = "linux")]
    let left = linux::memory_left();
    #[cfg(not(target_os = "linux"))]
    let left = u64::MAX;
    left
}

/// Returns bytes in GiB.
pub fn gib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 30)
}

/// Returns the bytes that are left on the disk with `folder`, as far as the system tells.
pub fn disk_left(folder: &Path) -> u64 {
    #[cfg(unix)]
    let left = rustix::fs::statvfs(folder)
        .map_or(u64::MAX, |disk| disk.f_bavail.saturating_mul(disk.f_frsize));
    #[cfg(not(unix))]
    let left = {
        let _ = folder;
        u64::MAX
    };
    left
}

#[cfg(target_os = "linux")]
// what the system tells has the form of files
#[allow(clippy::disallowed_methods)]
mod linux {
    use std::fs::read_to_string;

    pub fn memory_left() -> u64 {
        let left = [free(), address_space_left(), group_left()];
        left.into_iter().flatten().min().unwrap_or(u64::MAX)
    }

    /// Returns the first number after `key`, which must be at the beginning of a line.
    pub fn number(text: &str, key: &str) -> Option<u64> {
        let line = text.lines().find_map(|line| line.strip_prefix(key))?;
        line.split_whitespace().next()?.parse().ok()
    }

    fn free() -> Option<u64> {
        let text = read_to_string("/proc/meminfo").ok()?;
        let swap = number(&text, "SwapFree:").unwrap_or(0);
        Some((number(&text, "MemAvailable:")? + swap) << 10)
    }

    fn address_space_left() -> Option<u64> {
        let limit = number(&read_to_string("/proc/self/limits").ok()?, "Max address space")?;
        let taken = number(&read_to_string("/proc/self/status").ok()?, "VmSize:")? << 10;
        Some(limit.saturating_sub(taken))
    }

    fn group_left() -> Option<u64> {
        let limit = read_to_string("/sys/fs/cgroup/memory.max").ok()?.trim().parse::<u64>().ok()?;
        let taken = number(&read_to_string("/sys/fs/cgroup/memory.stat").ok()?, "anon ")?;
        Some(limit.saturating_sub(taken))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_are_at_most_four_for_each_processor() {
        let processors = threads(0);
        assert!(processors >= 1);
        assert_eq!(threads(1), 1);
        assert_eq!(threads(1024), 1024.min(4 * processors));
        let pool = pool(1024).unwrap();
        assert_eq!(pool.current_num_threads(), threads(1024));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_is_read_from_the_system() {
        let text =
            "MemTotal: 5 kB\nMemAvailable:   12 kB\nMax address space   unlimited  7 bytes\n";
        assert_eq!(linux::number(text, "MemAvailable:"), Some(12));
        assert_eq!(linux::number(text, "Max address space"), None);
        assert_eq!(linux::number(text, "SwapFree:"), None);
        // a test needs some memory itself, and no machine has more
        assert!((1 << 20..1 << 50).contains(&memory_left()), "{}", memory_left());
    }
}
