//! Whether a run fits the disk, asked before it starts: temporary fields and output, which may lie on the same one.

use std::os::unix::fs::MetadataExt;
use std::path::Path;

use crate::cli::terminal::console::Console;
use crate::cli::terminal::text::bytes;
use crate::error::{Error, Result};
use crate::exec::Progress;
use crate::job::resources::folder_of;
use crate::store::free_space;

/// What a run puts on disks.
pub(crate) struct Disk<'a> {
    /// What needs it: a grid of so many voxels.
    pub(crate) what: String,
    /// The folder of temporary fields.
    pub(crate) scratch: &'a Path,
    /// Bytes of temporary fields that memory does not hold.
    pub(crate) needed: u64,
    /// Where the output is made: the store that is to be, or the folder of temporary fields.
    pub(crate) output: &'a Path,
    /// Bytes of the output, if nothing of it could be compressed.
    pub(crate) written: u64,
    /// What makes a run smaller, to be given.
    pub(crate) coarser: &'static str,
}

/// Fields are seldom compressed to less than this part.
const LEAST_WRITTEN: u64 = 10;

impl Disk<'_> {
    /// Refuses a run that cannot fit, and says so of one that may not.
    ///
    /// # Errors
    /// `Failed`, with what is needed, what is free, and what to do.
    pub(crate) fn check(&self, console: &Console) -> Result<()> {
        let output = if self.output == self.scratch { self.scratch } else { folder_of(self.output) };
        let (Some(room), Some(room_for_output)) = (free_space(self.scratch), free_space(output)) else { return Ok(()) };
        self.check_room(output, same_disk(self.scratch, output), [room, room_for_output], console)
    }

    fn check_room(&self, output: &Path, shared: bool, [free, out_free]: [u64; 2], console: &Console) -> Result<()> {
        let (least, most) = (self.written / LEAST_WRITTEN, self.written);
        let on_scratch = self.needed.saturating_add(if shared { least } else { 0 });
        // Where all of it is for the output, another disk for temporary fields is no help.
        if on_scratch > free && self.needed > 0 {
            let and = match (shared, least) {
                (true, 1..) => format!(" and at least {} for the output", bytes(least)),
                _ => String::new(),
            };
            return Err(Error::failed(format!(
                "{} needs {} of temporary fields that memory does not hold{and}, but {} are free there; name a folder on \
                 another disk with --scratch, or give {}",
                self.what,
                bytes(self.needed),
                bytes(free),
                self.coarser
            ))
            .at(self.scratch));
        }
        if least > out_free {
            return Err(Error::failed(format!(
                "the output of {} needs {} to {} of disk, but {} are free there; name an output on another disk, or give \
                 {}",
                self.what,
                bytes(least),
                bytes(most),
                bytes(out_free),
                self.coarser
            ))
            .at(output));
        }
        let taken = if shared { self.needed } else { 0 };
        if most.saturating_add(taken) > out_free {
            console.note(&format!(
                "{}: {} are free there, but temporary fields and output may take up to {}, if little can be compressed",
                output.display(),
                bytes(out_free),
                bytes(most.saturating_add(taken))
            ));
        }
        Ok(())
    }
}

fn same_disk(a: &Path, b: &Path) -> bool {
    matches!((a.metadata(), b.metadata()), (Ok(a), Ok(b)) if a.dev() == b.dev())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::terminal::console::Voice;

    #[test]
    fn what_cannot_fit_is_refused_and_what_may_not_is_told() {
        let console = Console::new(Voice::Quiet);
        let check = |needed: u64, written: u64, shared: bool, free: [u64; 2]| {
            let (scratch, output) = (Path::new("scratch"), Path::new("out"));
            let disk = Disk { what: "a grid".into(), scratch, needed, output, written, coarser: "a larger --spacing" };
            disk.check_room(output, shared, free, &console).map_err(|error| (error.exit_code(), error.to_string()))
        };
        let (code, text) = check(182 << 30, 0, true, [68 << 30; 2]).unwrap_err();
        assert_eq!(code, 1);
        for part in ["scratch: ", "a grid needs 182 GiB", "68 GiB", "--scratch", "--spacing"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        // Each alone would fit.
        assert!(check(60 << 30, 100 << 30, true, [68 << 30; 2]).is_err());
        let (_, text) = check(0, 1000 << 30, true, [68 << 30; 2]).unwrap_err();
        assert!(text.contains("name an output on another disk") && !text.contains("--scratch"), "{text}");
        let (_, text) = check(60 << 30, 1000 << 30, false, [68 << 30; 2]).unwrap_err();
        assert!(text.starts_with("out: ") && text.contains("another disk"), "{text}");
        assert!(console.notes().is_empty());
        check(60 << 30, 100 << 30, false, [68 << 30; 2]).unwrap();
        assert_eq!(console.notes().len(), 1, "{:?}", console.notes());
        check(60 << 30, 7 << 30, true, [68 << 30; 2]).unwrap();
        assert_eq!(console.notes().len(), 1, "what fits is not worth a word");
    }
}
