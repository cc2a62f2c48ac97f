//! Whether a run fits the disk, asked before it starts: temporary fields and output, which may lie on the same one.

use std::os::unix::fs::MetadataExt;
use std::path::Path;

use super::resources::{Resources, folder_of};
use crate::error::{Error, Result};
use crate::exec::Budget;
use crate::grid::Geometry;
use crate::grid::digits::{bytes, grouped};
use crate::pipeline::distance::Needs;
use crate::pipeline::{convert, reconstruct, segment};
use crate::store::free_space;

/// What a run puts on disks.
pub(crate) struct Disk<'a> {
    /// What needs it: a grid of so many voxels.
    what: String,
    /// The folder of temporary fields.
    scratch: &'a Path,
    /// Bytes of temporary fields that memory does not hold, and of triangles that wait for the end of a mesh file.
    needed: u64,
    /// Where the output is made: the store that is to be, or the folder of temporary fields.
    output: &'a Path,
    /// Bytes of the output, if nothing of it could be compressed.
    written: u64,
    /// What makes a run smaller, to be given.
    coarser: &'static str,
}

/// Fields are seldom compressed to less than this part.
const LEAST_WRITTEN: u64 = 10;

/// Bytes of triangles that wait in a temporary file, for each voxel near a surface: two triangles of 20 bytes a cell of it,
/// and ten voxels on either side.
const WAITING_BYTES: u64 = 2;

impl<'a> Disk<'a> {
    /// A distance on a grid, with a store of so many bytes where there is one.
    ///
    /// # Errors
    /// When it does not fit the memory.
    pub(crate) fn of_grid(
        resources: &'a Resources,
        store: Option<&'a Path>,
        geometry: &Geometry,
        needs: &Needs,
        written: u64,
    ) -> Result<Self> {
        let what = format!("a grid of {} voxels", grouped(geometry.domain().volume()));
        Self::new(resources, store, what, [needs.held, needs.scratch, written], "a larger --spacing")
    }

    /// The surface of a cloud.
    ///
    /// # Errors
    /// When it does not fit the memory.
    pub(crate) fn of_cloud(
        resources: &'a Resources,
        store: Option<&'a Path>,
        needs: &reconstruct::Estimate,
    ) -> Result<Self> {
        let what = format!("a grid with {} voxels near the points", grouped(needs.near_voxels));
        Self::new(resources, store, what, [needs.held, needs.scratch, needs.output], "a larger --spacing")
    }

    /// Objects in an image; `coarser` says what makes it smaller.
    ///
    /// # Errors
    /// When it does not fit the memory.
    pub(crate) fn of_image(
        resources: &'a Resources,
        store: Option<&'a Path>,
        needs: &segment::Estimate,
        coarser: &'static str,
    ) -> Result<Self> {
        let what = format!("an image with {} voxels near the marks", grouped(needs.near_voxels));
        Self::new(resources, store, what, [needs.held, needs.scratch, needs.output], coarser)
    }

    /// A volume in another format.
    ///
    /// # Errors
    /// When it does not fit the memory.
    pub(crate) fn of_copy(
        resources: &'a Resources,
        output: &'a Path,
        geometry: &Geometry,
        needs: &convert::Needs,
    ) -> Result<Self> {
        let what = format!("a volume of {} voxels", grouped(geometry.domain().volume()));
        let held = needs.footprint.bytes(resources.threads as u64);
        Self::new(resources, Some(output), what, [held, needs.scratch, needs.written], "a coarser --level")
    }

    fn new(
        resources: &'a Resources,
        store: Option<&'a Path>,
        what: String,
        [held, fields, written]: [u64; 3],
        coarser: &'static str,
    ) -> Result<Self> {
        let window = Budget { total: resources.memory }.window(held)?;
        let (scratch, needed) = (resources.scratch.as_path(), fields.saturating_sub(window / 2));
        Ok(Self { what, scratch, needed, output: store.unwrap_or(scratch), written, coarser })
    }

    /// With triangles that wait in a temporary file for the end of a mesh file, so many bytes of them.
    #[must_use]
    pub(crate) fn with_waiting(self, waiting: u64) -> Self {
        Self { needed: self.needed.saturating_add(waiting), ..self }
    }

    /// The same where surfaces have so many voxels near them.
    #[must_use]
    pub(crate) fn with_mesh_near(self, near_voxels: u64) -> Self {
        self.with_waiting(near_voxels.saturating_mul(WAITING_BYTES))
    }

    /// Refuses a run that cannot fit, and says so of one that may not. Returns the bytes that temporary fields and output take at
    /// most.
    ///
    /// # Errors
    /// `Failed`, with what is needed, what is free, and what to do.
    pub(crate) fn check(&self, note: impl FnMut(&str)) -> Result<u64> {
        let output = if self.output == self.scratch { self.scratch } else { folder_of(self.output) };
        let most = self.needed.saturating_add(self.written);
        let (Some(room), Some(room_for_output)) = (free_space(self.scratch), free_space(output)) else {
            return Ok(most);
        };
        self.check_room(output, same_disk(self.scratch, output), [room, room_for_output], note)?;
        Ok(most)
    }

    fn check_room(
        &self,
        output: &Path,
        shared: bool,
        [free, out_free]: [u64; 2],
        mut note: impl FnMut(&str),
    ) -> Result<()> {
        let (least, most) = (self.written / LEAST_WRITTEN, self.written);
        let on_scratch = self.needed.saturating_add(if shared { least } else { 0 });
        // Where all of it is for the output, another disk for temporary fields is no help.
        if on_scratch > free && self.needed > 0 {
            let and = match (shared, least) {
                (true, 1..) => format!(" and at least {} for the output", bytes(least)),
                _ => String::new(),
            };
            return Err(Error::failed(format!(
                "{} needs {} of temporary files that memory does not hold{and}, but {} are free there; name a folder on \
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
            note(&format!(
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

    #[test]
    fn what_cannot_fit_is_refused_and_what_may_not_is_told() {
        let notes = std::cell::RefCell::new(Vec::new());
        let check = |needed: u64, written: u64, shared: bool, free: [u64; 2]| {
            let (scratch, output) = (Path::new("scratch"), Path::new("out"));
            let disk = Disk { what: "a grid".into(), scratch, needed, output, written, coarser: "a larger --spacing" };
            let note = |text: &str| notes.borrow_mut().push(text.to_owned());
            disk.check_room(output, shared, free, note).map_err(|error| (error.exit_code(), error.to_string()))
        };
        let (code, text) = check(182 << 30, 0, true, [68 << 30; 2]).unwrap_err();
        assert_eq!(code, 1);
        for part in ["scratch: ", "a grid needs 182 GiB", "68 GiB", "--scratch", "--spacing"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let resources = Resources { memory: 1 << 30, threads: 1, scratch: "/proc".into() };
        let disk = Disk::new(&resources, None, "a grid".into(), [0; 3], "a larger --spacing").unwrap();
        assert_eq!((disk.needed, disk.with_waiting(7).with_mesh_near(10).needed), (0, 27));
        // Each alone would fit.
        assert!(check(60 << 30, 100 << 30, true, [68 << 30; 2]).is_err());
        let (_, text) = check(0, 1000 << 30, true, [68 << 30; 2]).unwrap_err();
        assert!(text.contains("name an output on another disk") && !text.contains("--scratch"), "{text}");
        let (_, text) = check(60 << 30, 1000 << 30, false, [68 << 30; 2]).unwrap_err();
        assert!(text.starts_with("out: ") && text.contains("another disk"), "{text}");
        assert!(notes.borrow().is_empty());
        check(60 << 30, 100 << 30, false, [68 << 30; 2]).unwrap();
        assert_eq!(notes.borrow().len(), 1, "{notes:?}");
        check(60 << 30, 7 << 30, true, [68 << 30; 2]).unwrap();
        assert_eq!(notes.borrow().len(), 1, "what fits is not worth a word");
    }
}
