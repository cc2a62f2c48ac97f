//! The memory budget: what the machine has, what a run may use, and what it did use.

use crate::error::{Error, Result};

/// How the bytes of a run are shared out between what must be in memory and the window of mapped pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// All the bytes the process may have resident.
    pub total: u64,
}

/// The program itself, its threads' stacks and the allocator's slack.
const BASE_BYTES: u64 = 48 << 20;
/// A window smaller than this would thrash.
const SMALLEST_WINDOW: u64 = 64 << 20;
/// A run that is under way goes on with so much where a box grows, before it is refused.
const SMALLEST_UNDER_WAY: u64 = SMALLEST_WINDOW / 2;
const MIB: u64 = 1 << 20;

impl Budget {
    /// That of one of so many ranks that are threads of one process: the program itself is there once.
    #[must_use]
    pub fn share(self, ranks: usize) -> Self {
        let beyond = self.total.saturating_sub(BASE_BYTES) / ranks.max(1) as u64;
        Self { total: self.total.min(beyond + BASE_BYTES) }
    }

    /// What is left for mapped pages when `held` bytes must be in memory at the same time.
    ///
    /// # Errors
    /// When that is too little: names the smallest budget that would do.
    pub fn window(&self, held: u64) -> Result<u64> {
        self.window_of(held, SMALLEST_WINDOW, "")
    }

    /// The same for a run that is under way, where what was to be held turns out to be more.
    ///
    /// # Errors
    /// When that is too little: names the smallest budget that would have done.
    pub(super) fn window_under_way(self, held: u64) -> Result<u64> {
        self.window_of(held, SMALLEST_UNDER_WAY, "")
    }

    /// Lets inputs be read or looked at that take so many bytes, while no field is there yet.
    ///
    /// # Errors
    /// When they alone are too many: names what they take, and that a run takes more, which they have to be read to know.
    pub fn admit(self, held: u64) -> Result<()> {
        self.window_of(held, 0, " to read its input, and more to work on it").map(drop)
    }

    fn window_of(self, held: u64, smallest: u64, what_for: &str) -> Result<u64> {
        let least = Self::least(held);
        if self.total < least - SMALLEST_WINDOW + smallest {
            return Err(Error::usage(format!(
                "a memory budget of {} is too small for this run: give at least --memory {}MiB{what_for}",
                if self.total < 1 << 20 {
                    format!("{} bytes", self.total)
                } else {
                    format!("{} MiB", self.total >> 20)
                },
                least >> 20
            )));
        }
        Ok(self.total - BASE_BYTES - held)
    }

    /// The smallest budget of a run that must hold `held` bytes at the same time, in whole MiB.
    #[must_use]
    pub fn least(held: u64) -> u64 {
        held.saturating_add(BASE_BYTES + SMALLEST_WINDOW).saturating_add(MIB - 1) / MIB * MIB
    }
}

/// Bytes of memory this process may use: the machine's, or its control group's where that is less.
#[must_use]
pub fn machine_memory() -> u64 {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let total = read("/proc/meminfo").and_then(|text| field_kib(&text, "MemTotal:")).map_or(4 << 30, |kib| kib << 10);
    control_group_limits(&read).into_iter().fold(total, u64::min)
}

/// The memory limits of the control groups (v1 and v2) that hold this process.
fn control_group_limits(read: &impl Fn(&str) -> Option<String>) -> Vec<u64> {
    let groups = read("/proc/self/cgroup").unwrap_or_default();
    let mut limits = Vec::new();
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else { continue };
        let path = path.trim_end_matches('/');
        if controllers.is_empty() {
            limits.push(format!("/sys/fs/cgroup{path}/memory.max"));
        } else if controllers.split(',').any(|c| c == "memory") {
            limits.push(format!("/sys/fs/cgroup/memory{path}/memory.limit_in_bytes"));
            limits.push("/sys/fs/cgroup/memory/memory.limit_in_bytes".into());
        }
    }
    limits.iter().filter_map(|path| read(path)?.trim().parse().ok()).collect()
}

/// The most memory this process has had resident so far (`VmHWM`), in bytes; 0 where the system does not tell.
#[must_use]
pub fn peak_resident() -> u64 {
    std::fs::read_to_string("/proc/self/status")
        .ok()
        .and_then(|text| field_kib(&text, "VmHWM:"))
        .map_or(0, |kib| kib << 10)
}

fn field_kib(text: &str, name: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_too_small_names_the_smallest() {
        let error = Budget { total: 64 << 20 }.window(100 << 20).unwrap_err();
        assert!(error.to_string().contains("--memory 212MiB"), "{error}");
        assert_eq!(Budget { total: 212 << 20 }.window(100 << 20).unwrap(), 64 << 20);
    }

    #[test]
    fn this_process_has_memory() {
        assert!(machine_memory() > 1 << 28);
        assert!(peak_resident() > 1 << 20 || !cfg!(target_os = "linux"));
    }
}
