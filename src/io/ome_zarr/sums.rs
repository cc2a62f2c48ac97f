//! `checksums.txt`: the CRC-32C (RFC 3720) and the length of every file of a store, so that a changed byte of any of them is told.
//!
//! Zarr has checksums of shard indices alone, and Zarr 2 none at all. A line is the sum in eight hexadecimal digits, the length
//! and the path, in the order of the paths. Sums of shards are made while these are written; all other files are read at the end.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::ops::Bound;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use super::files::{io_error, write_whole};
use crate::error::{Error, Result};

/// The name of the file in a store.
pub const CHECKSUMS: &str = "checksums.txt";
/// Bytes that are read at a time.
const BUFFER: usize = 1 << 18;

/// What is known of a file's bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileSum {
    /// CRC-32C of all bytes.
    pub crc: u32,
    /// Bytes in the file.
    pub length: u64,
}

impl FileSum {
    /// That of a file as it is.
    ///
    /// # Errors
    /// Of the operating system.
    pub fn of(path: &Path) -> io::Result<Self> {
        let (mut file, mut buffer, mut sum) = (File::open(path)?, vec![0; BUFFER], Self::default());
        loop {
            match file.read(&mut buffer) {
                Ok(0) => return Ok(sum),
                Ok(count) => sum.add(&buffer[..count]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn add(&mut self, bytes: &[u8]) {
        self.crc = crc32c::crc32c_append(self.crc, bytes);
        self.length += bytes.len() as u64;
    }

    /// That of a line of the list.
    pub(super) fn of_line(line: &str) -> Option<Self> {
        let mut words = line.split(' ');
        Some(Self { crc: u32::from_str_radix(words.next()?, 16).ok()?, length: words.next()?.parse().ok()? })
    }

    /// The line of a file in the list.
    #[must_use]
    pub fn line(self, path: &str) -> String {
        format!("{:08x} {} {path}", self.crc, self.length)
    }
}

/// Passes bytes on and sums them.
pub(super) struct Summing<'a> {
    sink: &'a mut dyn Write,
    pub(super) sum: FileSum,
}

impl<'a> Summing<'a> {
    pub(super) fn new(sink: &'a mut dyn Write) -> Self {
        Self { sink, sum: FileSum::default() }
    }
}

impl Write for Summing<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.sink.write(bytes)?;
        self.sum.add(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.sink.flush()
    }
}

/// The sums of shards that were written, by their paths in the store.
#[derive(Debug, Default)]
pub(super) struct ShardSums(Mutex<BTreeMap<Box<str>, FileSum>>);

impl ShardSums {
    /// A shard was written; one without a byte is not there.
    pub(super) fn put(&self, path: &str, sum: FileSum) {
        if sum.length == 0 {
            self.all().remove(path);
        } else {
            self.all().insert(path.into(), sum);
        }
    }

    /// Those whose paths begin like this, in their order.
    pub(super) fn beginning(&self, with: &str) -> Vec<(String, FileSum)> {
        let all = self.all();
        let from = all.range::<str, _>((Bound::Included(with), Bound::Unbounded));
        from.take_while(|(path, _)| path.starts_with(with)).map(|(path, sum)| (path.to_string(), *sum)).collect()
    }

    /// Writes the list of all files of a store.
    pub(super) fn write(&self, folder: &Path) -> Result<()> {
        let known = self.all();
        let failed = |error: io::Error| io_error("the checksums cannot be made", &error);
        let mut text = String::new();
        for path in store_files(folder).map_err(failed)? {
            let sum = known.get(path.as_str()).map_or_else(|| FileSum::of(&folder.join(&path)), |sum| Ok(*sum));
            text += &sum.map_err(failed)?.line(&path);
            text.push('\n');
        }
        write_whole(&folder.join(CHECKSUMS), |sink| {
            sink.write_all(text.as_bytes()).map_err(failed)?;
            Ok(text.len() as u64)
        })?;
        Ok(())
    }

    fn all(&self) -> MutexGuard<'_, BTreeMap<Box<str>, FileSum>> {
        // A map of sums is whole whatever thread was lost while holding it.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The paths of all files of a store but the list itself, in their order, with `/` between their parts.
///
/// # Errors
/// Of the operating system.
pub fn store_files(folder: &Path) -> io::Result<Vec<String>> {
    fn walk(folder: &Path, before: &str, found: &mut Vec<String>) -> io::Result<()> {
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let path = format!("{before}{}", entry.file_name().to_string_lossy());
            if entry.file_type()?.is_dir() {
                walk(&entry.path(), &format!("{path}/"), found)?;
            } else if path != CHECKSUMS {
                found.push(path);
            }
        }
        Ok(())
    }
    let mut found = Vec::new();
    walk(folder, "", &mut found)?;
    found.sort_unstable();
    Ok(found)
}

/// The first file of a store's list that is gone or has another length: what is seen without reading any. Nothing where there is
/// no list.
///
/// # Errors
/// When the list cannot be read or a line of it names no file.
pub fn first_misfit(folder: &Path) -> Result<Option<String>> {
    let fits = |(path, line): &(String, String)| {
        let length = fs::metadata(folder.join(path)).ok().map(|found| found.len().to_string());
        length.as_deref() == line.split(' ').nth(1)
    };
    Ok(listed_sums(folder)?.unwrap_or_default().into_iter().find(|file| !fits(file)).map(|(path, _)| path))
}

/// The lines of a store's list by path; nothing where there is no list.
///
/// # Errors
/// When it cannot be read or a line of it names no file.
pub fn listed_sums(folder: &Path) -> Result<Option<BTreeMap<String, String>>> {
    let path = folder.join(CHECKSUMS);
    let text = match fs::read(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        read => read.map_err(|error| Error::input(format!("cannot be read: {error}")).caused_by(error).at(&path))?,
    };
    let damaged = |what: &str| Error::input(format!("is damaged: {what}")).at(&path);
    let text = String::from_utf8(text).map_err(|_| damaged("it is no text"))?;
    let whole = text.strip_suffix('\n').ok_or_else(|| damaged("its last line has no end"))?;
    let mut found = BTreeMap::new();
    for (n, line) in (1..).zip(whole.split('\n')) {
        let name = line.splitn(3, ' ').nth(2).ok_or_else(|| damaged(&format!("line {n} names no file")))?;
        if found.insert(name.to_owned(), line.to_owned()).is_some() {
            return Err(damaged(&format!("line {n} names {name} once more")));
        }
    }
    Ok(Some(found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_is_that_of_the_standard() {
        // RFC 3720, B.4: 32 bytes of zeros, and of ones.
        let folder = tempfile::tempdir().unwrap();
        for (byte, crc) in [(0, 0x8a91_36aa), (0xff, 0x62a8_ab43)] {
            let path = folder.path().join("file");
            fs::write(&path, [byte; 32]).unwrap();
            assert_eq!(FileSum::of(&path).unwrap(), FileSum { crc, length: 32 });
        }
    }
}
