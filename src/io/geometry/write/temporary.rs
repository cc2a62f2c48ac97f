//! Temporary files of a mesh in the making: they have no name and go with their handle. They may lie on another disk than the
//! mesh; so what goes wrong with them remembers their folder, for whoever tells it.

use std::fmt;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::error::Error;

/// A temporary file.
#[derive(Debug)]
pub(super) struct Temporary {
    file: File,
    folder: PathBuf,
}

impl Temporary {
    /// An empty one in a folder.
    pub(super) fn new(folder: &Path) -> io::Result<Self> {
        let file = tempfile::tempfile_in(folder).map_err(|error| fault(folder, &error))?;
        Ok(Self { file, folder: folder.to_path_buf() })
    }
}

impl Read for Temporary {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.file.read(buffer).map_err(|error| fault(&self.folder, &error))
    }
}

impl Write for Temporary {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.file.write(buffer).map_err(|error| fault(&self.folder, &error))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush().map_err(|error| fault(&self.folder, &error))
    }
}

impl Seek for Temporary {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to).map_err(|error| fault(&self.folder, &error))
    }
}

/// What went wrong with a temporary file, and where that was.
#[derive(Debug)]
struct Fault {
    folder: PathBuf,
    error: io::Error,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

impl std::error::Error for Fault {}

fn fault(folder: &Path, error: &io::Error) -> io::Error {
    let kept = error.raw_os_error().map_or_else(|| error.kind().into(), io::Error::from_raw_os_error);
    io::Error::new(error.kind(), Fault { folder: folder.to_path_buf(), error: kept })
}

/// The error for the user, of one that came of a temporary file.
pub(super) fn told(error: &io::Error) -> Option<Error> {
    let Fault { folder, error } = error.get_ref()?.downcast_ref::<Fault>()?;
    let what = "the mesh's temporary part cannot be written; free some disk or choose another folder with --scratch";
    Some(Error::from_io(what, error).at(folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn what_goes_wrong_names_the_folder() {
        let error = Temporary::new(Path::new("/proc")).unwrap_err();
        let text = told(&error).unwrap().to_string();
        assert!(text.starts_with("/proc: the mesh's temporary part") && text.contains("--scratch"), "{text}");
        let file = File::options().write(true).open("/dev/full").unwrap();
        let mut full = Temporary { file, folder: PathBuf::from("there") };
        let error = full.write_all(b"more").unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert!(told(&error).unwrap().to_string().starts_with("there: "));
        assert!(told(&io::ErrorKind::StorageFull.into()).is_none());
    }
}
