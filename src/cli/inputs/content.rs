//! The files that an input consists of: itself; the file of its voxels, where it is a header alone; of a folder (a store, slices) all
//! that lie in it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::io::stack::file_of_voxels;

/// All files of an input, by their names in it, in order.
///
/// # Errors
/// When it is not there or cannot be looked at.
pub(crate) fn files_of(input: &Path) -> io::Result<Vec<(PathBuf, PathBuf)>> {
    if fs::metadata(input)?.is_dir() {
        return files_in(input);
    }
    let named = |path: &Path| (path.file_name().map(PathBuf::from).unwrap_or_default(), path.to_path_buf());
    let voxels = file_of_voxels(input).filter(|path| path.is_file());
    Ok(std::iter::once(named(input)).chain(voxels.as_deref().map(named)).collect())
}

/// All files below a folder, by their paths in it, in order.
fn files_in(folder: &Path) -> io::Result<Vec<(PathBuf, PathBuf)>> {
    let (mut found, mut left) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(within) = left.pop() {
        for entry in fs::read_dir(folder.join(&within))? {
            let entry = entry?;
            let name = within.join(entry.file_name());
            // Links to folders are not followed: they may go round.
            if entry.file_type()?.is_dir() {
                left.push(name);
            } else if fs::metadata(entry.path()).is_ok_and(|is| is.is_file()) {
                found.push((name, entry.path()));
            }
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_to_files_count_and_headers_bring_their_voxels() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::create_dir_all(at("slices/deep")).unwrap();
        fs::write(at("one.tif"), "1").unwrap();
        for (to, link) in [("one.tif", "slices/deep/1.tif"), ("slices", "slices/round")] {
            std::os::unix::fs::symlink(at(to), at(link)).unwrap();
        }
        let names = |input: &str| files_of(&at(input)).unwrap().into_iter().map(|(name, _)| name).collect::<Vec<_>>();
        assert_eq!(names("slices"), [Path::new("deep/1.tif")]);
        assert_eq!(names("one.tif"), [Path::new("one.tif")]);
        let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 2\nencoding: raw\ndata file: v.raw\n\n";
        fs::write(at("v.nhdr"), header).unwrap();
        assert_eq!(names("v.nhdr"), [Path::new("v.nhdr")], "its voxels are missing");
        fs::write(at("v.raw"), [1, 2]).unwrap();
        assert_eq!(names("v.nhdr"), [Path::new("v.nhdr"), Path::new("v.raw")]);
        assert!(files_of(&at("nothing")).is_err());
    }
}
