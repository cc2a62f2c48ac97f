//! Outputs are checked before anything is read: none that is there without leave, none that is read, none without a
//! folder to lie in.

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use super::config::folder_of;
use crate::error::{Error, Result};

/// What a run reads and writes.
pub(super) struct Outputs<'a> {
    /// Files and folders that are read.
    pub(super) inputs: Vec<&'a Path>,
    /// The store, where there is to be one.
    pub(super) store: Option<&'a Path>,
    /// Files beside it.
    pub(super) files: Vec<&'a Path>,
    /// Whether outputs that are there may be replaced.
    pub(super) overwrite: bool,
}

impl Outputs<'_> {
    /// Refuses what would be found out only when the work is done, and what would destroy what the run reads.
    ///
    /// # Errors
    /// With the output that cannot be, and why.
    pub(super) fn check(&self) -> Result<()> {
        let mut seen: Vec<&Path> = Vec::new();
        for &path in self.store.iter().chain(&self.files) {
            if seen.contains(&path) {
                return Err(Error::usage("is named for two outputs; give each a name of its own").at(path));
            }
            seen.push(path);
            if self.inputs.iter().any(|input| would_replace(path, input)) {
                return Err(Error::usage("is an input of this run; give the output another name").at(path));
            }
            let folder = folder_of(path);
            if !folder.is_dir() {
                return Err(Error::usage("the folder for the output does not exist; create it first").at(folder));
            }
        }
        self.files.iter().try_for_each(|path| may_write(path, self.overwrite))
    }
}

/// Refuses a file that is there, and what is none.
fn may_write(path: &Path, overwrite: bool) -> Result<()> {
    // A device or a folder would be replaced by a file.
    if path.exists() && !path.is_file() {
        return Err(Error::usage("is no regular file; give another name").at(path));
    }
    if path.exists() && !overwrite {
        let what = "exists already; choose another name, or give --overwrite to replace it";
        return Err(Error::usage(what).at(path));
    }
    Ok(())
}

/// Whether writing an output would replace an input: the same file by any name or link, a file within a folder that is
/// read, or a folder in which an input lies.
fn would_replace(output: &Path, input: &Path) -> bool {
    let (Ok(there), Ok(read)) = (output.metadata(), input.metadata()) else { return false };
    if (there.dev(), there.ino()) == (read.dev(), read.ino()) {
        return true;
    }
    let (Ok(output), Ok(input)) = (output.canonicalize(), input.canonicalize()) else { return false };
    input.starts_with(&output) || output.starts_with(&input)
}

/// The path with a number in its name: `mesh.ply` is `mesh-3.ply`.
pub(super) fn numbered(path: &Path, number: u32) -> PathBuf {
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
        let whole = folder.path();
        assert!(Outputs { inputs: vec![&scan], store: Some(whole), files: vec![], overwrite: true }.check().is_err());
    }
}
