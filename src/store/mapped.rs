//! How much of mapped files is resident in the process by the system's own account (proc(5), `/proc/PID/status`).

use std::fs;

/// Bytes of mapped files that are resident, on disks or in memory; none where the system does not tell.
pub(super) fn mapped_bytes() -> Option<u64> {
    of_files(&fs::read_to_string("/proc/self/status").ok()?)
}

fn of_files(status: &str) -> Option<u64> {
    let of = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        Some(line.split_whitespace().next()?.parse::<u64>().ok()? << 10)
    };
    Some(of("RssFile:")? + of("RssShmem:")?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_of_mapped_files_are_read() {
        let status = "VmRSS:\t    1828 kB\nRssFile:\t    1724 kB\nRssShmem:\t       4 kB\nThreads:\t1\n";
        assert_eq!(of_files(status), Some(1728 << 10));
        assert_eq!(of_files("Threads:\t1\n"), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn pages_that_are_touched_are_told() {
        let file = tempfile::tempfile().unwrap();
        file.set_len(64 << 20).unwrap();
        let map = memmap2::MmapRaw::map_raw(&file).unwrap();
        let before = mapped_bytes().unwrap();
        map.advise(memmap2::Advice::PopulateRead).unwrap();
        // Tests beside this one let go of maps of theirs; none has as much as this.
        assert!(mapped_bytes().unwrap() >= before + (32 << 20));
    }
}
