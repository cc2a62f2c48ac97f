//! `Spill`: records that wait on the disk, in a file without a name that goes with whoever has it open.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Records in the order in which they come.
pub struct Spill {
    folder: PathBuf,
    file: BufWriter<File>,
    records: u64,
}

/// The same, read back from the first one on.
pub struct Spilled {
    folder: PathBuf,
    file: BufReader<File>,
    left: u64,
}

impl Spill {
    /// None yet, in a folder.
    ///
    /// # Errors
    /// When no file can be made there.
    pub fn new(folder: &Path) -> Result<Self> {
        let file = tempfile::tempfile_in(folder).map_err(|error| fault(folder, &error))?;
        Ok(Self { folder: folder.to_path_buf(), file: BufWriter::new(file), records: 0 })
    }

    /// Puts one more.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn put(&mut self, record: &[u8]) -> Result<()> {
        self.records += 1;
        let length = (record.len() as u64).to_le_bytes();
        self.file
            .write_all(&length)
            .and_then(|()| self.file.write_all(record))
            .map_err(|error| fault(&self.folder, &error))
    }

    /// Reads them back.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn read_back(self) -> Result<Spilled> {
        let Self { folder, file, records } = self;
        let mut file = file.into_inner().map_err(|error| fault(&folder, error.error()))?;
        file.rewind().map_err(|error| fault(&folder, &error))?;
        Ok(Spilled { folder, file: BufReader::new(file), left: records })
    }
}

impl Spilled {
    /// The next record, or none behind the last one.
    ///
    /// # Errors
    /// When the disk cannot be read.
    pub fn take(&mut self) -> Result<Option<Vec<u8>>> {
        let Some(left) = self.left.checked_sub(1) else { return Ok(None) };
        let mut length = [0; 8];
        let read = self.file.read_exact(&mut length).and_then(|()| {
            let mut record = vec![0; u64::from_le_bytes(length) as usize];
            self.file.read_exact(&mut record).map(|()| record)
        });
        self.left = left;
        read.map(Some).map_err(|error| fault(&self.folder, &error))
    }
}

fn fault(folder: &Path, error: &std::io::Error) -> Error {
    Error::from_io("what waits on the disk cannot be kept in the folder of --scratch", error).at(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_come_back_as_they_were_put_and_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let records: Vec<Vec<u8>> = (0..100_usize).map(|n| vec![n as u8; n * n % 1013]).collect();
        let mut spill = Spill::new(folder.path()).unwrap();
        for record in &records {
            spill.put(record).unwrap();
        }
        let mut spilled = spill.read_back().unwrap();
        for record in &records {
            assert_eq!(spilled.take().unwrap().as_ref(), Some(record));
        }
        assert_eq!(spilled.take().unwrap(), None);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        assert!(Spill::new(Path::new("/nowhere")).err().unwrap().to_string().contains("--scratch"));
    }
}
