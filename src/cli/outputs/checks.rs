//! Outputs are checked before anything is read: none that is there without leave, none that is read, none without a
//! folder to lie in.

use std::fs::Metadata;
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::io::geometry::read::sources::is_standard_input;
use crate::io::ome_zarr::{LONGEST_ENDING, is_store, time_name};
use crate::job::resources::folder_of;

/// What a run reads and writes.
pub(crate) struct Outputs<'a> {
    /// Files and folders that are read.
    pub(crate) inputs: Vec<&'a Path>,
    /// The store, where there is to be one.
    pub(crate) store: Option<&'a Path>,
    /// Files beside it.
    pub(crate) files: Vec<&'a Path>,
    /// Whether outputs that are there may be replaced.
    pub(crate) overwrite: bool,
}

impl Outputs<'_> {
    /// Refuses what would be found out only when the work is done, and what would destroy what the run reads.
    ///
    /// # Errors
    /// With the output that cannot be, and why.
    pub(crate) fn check(&self) -> Result<()> {
        let mut seen: Vec<PathBuf> = Vec::new();
        for &path in self.store.iter().chain(&self.files) {
            let folder = folder_of(path);
            if !folder.is_dir() {
                return Err(Error::usage("the folder for the output does not exist; create it first").at(folder));
            }
            let place = place_of(path);
            if seen.contains(&place) {
                return Err(Error::usage("is named for two outputs; give each a name of its own").at(path));
            }
            seen.push(place);
            refuse_long_name(path, self.store == Some(path))?;
            let is_read = |replaces: fn(&Path, &Path) -> bool| {
                let error = || Err(Error::usage("is an input of this run; give the output another name").at(path));
                if self.inputs.iter().any(|input| replaces(path, input)) { error() } else { Ok(()) }
            };
            is_read(is_input)?;
            // A folder that inputs lie in is none of them.
            if self.files.contains(&path) && is_folder(path) {
                return Err(Error::usage("is a folder; give the name of a file").at(path));
            }
            is_read(would_replace)?;
        }
        self.files.iter().try_for_each(|path| self.check_store_of(path))?;
        self.store.iter().chain(&self.files).try_for_each(|path| self.check_store_around(path))?;
        self.files.iter().try_for_each(|path| may_write(path, self.overwrite))
    }

    /// Refuses a file within the store that is written, or in place of one of a store that is read: what describes an image
    /// often lies beside it.
    fn check_store_of(&self, file: &Path) -> Result<()> {
        let place = place_of(file);
        if self.store.is_some_and(|store| place.starts_with(place_of(store))) {
            return Err(Error::usage("lies in the store that this run writes; give a name outside of it").at(file));
        }
        let is_of_input = |input: &&Path| store_around(input).is_some_and(|store| place.starts_with(store));
        if file.exists() && self.inputs.iter().any(is_of_input) {
            return Err(Error::usage("is part of a store that this run reads; give the output another name").at(file));
        }
        Ok(())
    }

    /// Refuses an output within another store, which would no longer be what its own run wrote, without leave.
    fn check_store_around(&self, path: &Path) -> Result<()> {
        let place = place_of(path);
        match place.ancestors().skip(1).find(|folder| is_store(folder)) {
            Some(store) if !self.overwrite => {
                let what = format!(
                    "lies in another store, {}; give a name outside of it, or --overwrite to write into it",
                    store.display()
                );
                Err(Error::usage(what).at(path))
            }
            _ => Ok(()),
        }
    }
}

/// Where a path leads, by whatever name: links of its folder are followed, and its own where something is there.
fn place_of(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| {
        let folder = folder_of(path).canonicalize().unwrap_or_else(|_| folder_of(path).to_path_buf());
        folder.join(path.file_name().unwrap_or_default())
    })
}

fn is_folder(path: &Path) -> bool {
    path.is_dir() || path.as_os_str().as_encoded_bytes().ends_with(b"/")
}

/// Refuses a name that is too long for the disk, or for the hidden one that a store has while it is made.
fn refuse_long_name(path: &Path, is_store: bool) -> Result<()> {
    let mut hidden = path.file_name().unwrap_or_default().to_owned();
    if is_store {
        hidden.push("x".repeat(LONGEST_ENDING));
    }
    match folder_of(path).join(&hidden).symlink_metadata() {
        Err(error) if error.kind() == ErrorKind::InvalidFilename => {
            let bytes = path.file_name().unwrap_or_default().len();
            let what = format!("has a name of {bytes} bytes, which is too long for this disk; give a shorter one");
            Err(Error::usage(what).at(path))
        }
        _ => Ok(()),
    }
}

/// Refuses a file that is there, and what is none.
fn may_write(path: &Path, overwrite: bool) -> Result<()> {
    // A device or a folder would be replaced by a file.
    if path.exists() && !path.is_file() {
        return Err(Error::usage("is no regular file; give another name").at(path));
    }
    // A link that leads nowhere is there, too.
    if path.symlink_metadata().is_ok() && !overwrite {
        let what = "exists already; choose another name, or give --overwrite to replace it";
        return Err(Error::usage(what).at(path));
    }
    Ok(())
}

/// Whether writing an output would replace an input: the same file by any name or link, also as standard input; a file
/// within a folder that is read, or one that a link in it leads to; or a folder in which an input lies.
fn would_replace(output: &Path, input: &Path) -> bool {
    let Some((there, read)) = both(output, input) else { return false };
    if is_one(&there, &read) {
        return true;
    }
    if read.is_dir() && !is_store(input) && slices_of(input).any(|slice| is_one(&there, &slice)) {
        return true;
    }
    let (Ok(output), Ok(input)) = (output.canonicalize(), input.canonicalize()) else { return false };
    input.starts_with(&output) || output.starts_with(&input)
}

/// Whether an output is an input itself, by any name or link.
fn is_input(output: &Path, input: &Path) -> bool {
    both(output, input).is_some_and(|(there, read)| is_one(&there, &read))
}

/// What is known of an output that is there, and of an input.
fn both(output: &Path, input: &Path) -> Option<(Metadata, Metadata)> {
    let input = if is_standard_input(input) { Path::new("/dev/stdin") } else { input };
    Some((output.metadata().ok()?, input.metadata().ok()?))
}

fn is_one(there: &Metadata, read: &Metadata) -> bool {
    (there.dev(), there.ino()) == (read.dev(), read.ino())
}

/// What lies directly in a folder, links followed.
fn slices_of(folder: &Path) -> impl Iterator<Item = Metadata> {
    let entries = folder.read_dir().into_iter().flatten().flatten();
    entries.filter_map(|entry| entry.path().metadata().ok())
}

/// The outermost store that an input is, or lies in.
fn store_around(input: &Path) -> Option<PathBuf> {
    let place = input.canonicalize().ok()?;
    place.ancestors().filter(|folder| is_store(folder)).last().map(Path::to_path_buf)
}

/// The path with a time in its name: `mesh.ply` is `mesh-t0003.ply`.
pub(crate) fn of_time(path: &Path, time: u32) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
    path.with_file_name(format!("{stem}-{}{extension}", time_name(time)))
}

/// The path with a number in its name: `mesh.ply` is `mesh-3.ply`.
pub(crate) fn numbered(path: &Path, number: u32) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
    path.with_file_name(format!("{stem}-{number}{extension}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_meshes_are_numbered() {
        assert_eq!(numbered(Path::new("a/cells.ply"), 3), Path::new("a/cells-3.ply"));
        assert_eq!(numbered(Path::new("cells"), 12), Path::new("cells-12"));
    }

    #[test]
    fn no_output_is_an_input_by_any_name() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(at("slices")).unwrap();
        std::fs::write(at("scan.ply"), "raw").unwrap();
        std::fs::write(at("slices/s1.tif"), "raw").unwrap();
        std::os::unix::fs::symlink(at("scan.ply"), at("link.ply")).unwrap();
        std::fs::hard_link(at("scan.ply"), at("hard.ply")).unwrap();
        std::os::unix::fs::symlink(folder.path(), at("elsewhere")).unwrap();
        let (scan, slices) = (at("scan.ply"), at("slices"));
        let check = |output: &str, overwrite: bool| {
            let path = at(output);
            Outputs { inputs: vec![&scan, &slices], store: None, files: vec![&path], overwrite }.check()
        };
        let spellings = ["scan.ply", "link.ply", "hard.ply", "slices/../scan.ply", "elsewhere/scan.ply"];
        for name in spellings.into_iter().chain(["slices/s1.tif", "slices"]) {
            for overwrite in [true, false] {
                let error = check(name, overwrite).unwrap_err().to_string();
                assert!(error.contains("is an input of this run"), "{name}: {error}");
            }
        }
        assert!(check("new.ply", false).is_ok() && check("slices/new.ply", false).is_ok());
        let error = check("slices/..", true).unwrap_err().to_string();
        assert!(error.contains("is a folder"), "{error}");
        let whole = folder.path();
        assert!(Outputs { inputs: vec![&scan], store: Some(whole), files: vec![], overwrite: true }.check().is_err());
    }

    #[test]
    fn names_are_no_longer_than_the_disk_takes() {
        let folder = tempfile::tempdir().unwrap();
        let at = |bytes: usize| folder.path().join("n".repeat(bytes));
        let file = |path: &Path| Outputs { inputs: vec![], store: None, files: vec![path], overwrite: false }.check();
        let store =
            |path: &Path| Outputs { inputs: vec![], store: Some(path), files: vec![], overwrite: false }.check();
        assert!(file(&at(255)).is_ok() && store(&at(255 - LONGEST_ENDING)).is_ok());
        for error in [file(&at(256)), store(&at(255))] {
            let error = error.unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains("too long for this disk"), "{error}");
        }
    }

    #[test]
    fn no_output_is_a_slice_that_a_folder_links_to() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["raw", "slices"] {
            std::fs::create_dir(at(name)).unwrap();
        }
        std::fs::write(at("raw/s1.tif"), "raw").unwrap();
        std::fs::write(at("raw/old.json"), "report").unwrap();
        std::os::unix::fs::symlink("../raw/s1.tif", at("slices/a.tif")).unwrap();
        let (slices, slice, other) = (at("slices"), at("raw/s1.tif"), at("raw/old.json"));
        let check = |output: &Path| {
            Outputs { inputs: vec![&slices], store: None, files: vec![output], overwrite: true }.check()
        };
        assert!(check(&slice).unwrap_err().to_string().contains("is an input of this run"));
        assert!(check(&other).is_ok());
    }

    #[test]
    fn no_output_is_part_of_a_store_that_is_read_or_written() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["in.zarr/0", "in.zarr/labels/a/0", "old.zarr"] {
            std::fs::create_dir_all(at(name)).unwrap();
        }
        // An array does not say what its voxels are; the group above it does, and lies beside it.
        let documents = ["in.zarr/.zattrs", "in.zarr/.zgroup", "in.zarr/0/.zarray", "in.zarr/labels/a/.zattrs"];
        for name in documents.into_iter().chain(["old.zarr/zarr.json", "in.zarr/labels/a/0/.zarray"]) {
            std::fs::write(at(name), "{}").unwrap();
        }
        let check = |input: &str, store: Option<&str>, file: &str| {
            let (input, store, file) = (at(input), store.map(at), at(file));
            let outputs =
                Outputs { inputs: vec![&input], store: store.as_deref(), files: vec![&file], overwrite: true };
            outputs.check().map_err(|error| error.to_string())
        };
        for file in documents {
            let input = if file.contains("labels") { "in.zarr/labels/a/0" } else { "in.zarr/0" };
            assert!(check(input, None, file).is_err(), "{file}");
        }
        assert!(check("in.zarr/labels/a/0", None, "in.zarr/.zattrs").unwrap_err().contains("part of a store"));
        assert!(check("in.zarr/0", None, "in.zarr/new.json").is_ok());
        for file in ["old.zarr/zarr.json", "old.zarr/new.json", "in.zarr/../old.zarr/zarr.json"] {
            assert!(check("in.zarr/0", Some("old.zarr"), file).unwrap_err().contains("lies in the store"), "{file}");
        }
    }

    #[test]
    fn nothing_is_put_into_another_store_without_leave() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(at("old.zarr/0/c")).unwrap();
        std::fs::write(at("old.zarr/zarr.json"), "{}").unwrap();
        let input = at("scan.tif");
        for name in ["old.zarr/new", "old.zarr/0/new", "old.zarr/0/c/new"] {
            let path = at(name);
            for (store, files) in [(Some(&*path), vec![]), (None, vec![&*path])] {
                let check =
                    |overwrite| Outputs { inputs: vec![&input], store, files: files.clone(), overwrite }.check();
                assert!(check(false).unwrap_err().to_string().contains("lies in another store"), "{name}");
                assert!(check(true).is_ok(), "{name}");
            }
        }
        let beside = at("new.zarr");
        assert!(
            Outputs { inputs: vec![&input], store: Some(&beside), files: vec![], overwrite: false }.check().is_ok()
        );
    }

    #[test]
    fn two_outputs_are_not_one_file_by_two_names() {
        let folder = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink(folder.path(), folder.path().join("elsewhere")).unwrap();
        let at = |name: &str| folder.path().join(name);
        let (first, other) = (at("o.ply"), at("p.ply"));
        for name in ["o.ply", "./o.ply", "elsewhere/o.ply"] {
            let second = at(name);
            let outputs = |a, b| Outputs { inputs: vec![], store: None, files: vec![a, b], overwrite: true }.check();
            assert!(outputs(&first, &second).unwrap_err().to_string().contains("two outputs"), "{name}");
            assert!(outputs(&other, &second).is_ok());
        }
    }
}
