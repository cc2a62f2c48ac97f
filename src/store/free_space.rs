//! How much room a disk has left, asked before a run fills it (POSIX `statvfs`).
#![allow(unsafe_code)]

use std::ffi::CString;
use std::mem::MaybeUninit;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

/// Bytes that this user may still write to the disk that holds `folder`; none where the system does not tell.
#[must_use]
pub fn free_space(folder: &Path) -> Option<u64> {
    let name = CString::new(folder.as_os_str().as_bytes()).ok()?;
    let mut status = MaybeUninit::<libc::statvfs>::zeroed();
    // SAFETY: `name` ends with a zero byte, and `status` is room for the one structure that the call fills in.
    let code = unsafe { libc::statvfs(name.as_ptr(), status.as_mut_ptr()) };
    // SAFETY: the structure holds integers only, for which the zeros it was made of are valid whatever the call did.
    let status = unsafe { status.assume_init() };
    // The types differ between systems.
    #[allow(clippy::unnecessary_cast)]
    let room = (status.f_bavail as u64).saturating_mul(status.f_frsize as u64);
    // File systems that count no blocks tell nothing of their room.
    (code == 0 && status.f_blocks > 0).then_some(room)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_system_tells_what_df_tells() {
        let told = free_space(Path::new("/")).unwrap();
        let output = std::process::Command::new("df").args(["-P", "-k", "/"]).output().unwrap();
        let table = String::from_utf8(output.stdout).unwrap();
        let available: u64 = table.lines().nth(1).unwrap().split_whitespace().nth(3).unwrap().parse().unwrap();
        // Others write to the disk meanwhile.
        assert!(told.abs_diff(available << 10) < 4 << 30, "{told} and {available} KiB");
        assert_eq!(free_space(Path::new("/no/such/folder")), None);
        #[cfg(target_os = "linux")]
        assert_eq!(free_space(Path::new("/proc")), None);
    }
}
