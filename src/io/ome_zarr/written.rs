//! Shards of an image that are written, and how the store of a run that goes on takes them over: under a second name, a hard link,
//! so that nothing is copied, and with the sums of their bytes.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::root::Root;
use super::store::ImageWriter;
use super::sums::FileSum;

impl ImageWriter {
    /// Whether the store stands under its own name while it is written.
    #[must_use]
    pub fn is_live(&self) -> bool {
        self.root().is_some_and(Root::is_live)
    }

    /// A digest of how voxels lie in files and are packed there: shards of another one belong to no such image.
    #[must_use]
    pub fn form(&self) -> u32 {
        let told = self.levels().iter().map(|level| format!("{} {}", level.version().name(), level.document()));
        told.fold(0, |sum, level| crc32c::crc32c_append(sum, level.as_bytes()))
    }

    /// The shards that are written, level by level, by their paths in the store.
    #[must_use]
    pub fn written(&self) -> Vec<(String, FileSum)> {
        let Some(root) = self.root() else { return Vec::new() };
        self.levels().iter().flat_map(|level| root.written_below(level.folder())).collect()
    }

    /// Where a file lies that has such a path in the store.
    #[must_use]
    pub fn file(&self, path: &str) -> PathBuf {
        self.root().map(|root| root.folder().join(path)).unwrap_or_default()
    }

    /// Takes over a shard that another run has written; it stays where it is too.
    ///
    /// # Errors
    /// When it cannot have a second name: it is none of this image, or lies on another disk.
    pub fn take_over(&self, path: &str, from: &Path, sum: FileSum) -> io::Result<()> {
        let target = self.file(path);
        let Some(root) = self.root().filter(|_| self.levels().iter().any(|level| target.starts_with(level.folder())))
        else {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "is of another image"));
        };
        fs::create_dir_all(target.parent().unwrap_or(&target))?;
        fs::hard_link(from, &target)?;
        root.wrote(&target, sum);
        Ok(())
    }

    /// All levels have the same one.
    fn root(&self) -> Option<&Root> {
        self.levels().first()?.root().map(AsRef::as_ref)
    }
}
