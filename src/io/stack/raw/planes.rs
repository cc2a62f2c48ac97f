//! `RawVolume`: planes read from where they lie in a file; a stream that is packed whole is first unpacked into a temporary
//! file, as nothing in it can be reached without what comes before.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Seek, SeekFrom};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use flate2::bufread::MultiGzDecoder;

use crate::error::{Error, Result};
use crate::io::stack::number::{ByteOrder, Copying, Number};
use crate::io::stack::volume::{Stack, StackInfo};
use crate::store::{ElementType, PlaneSource, SamplesMut, Whereabouts};

/// Where the voxels of a volume are, and how they are stored.
#[derive(Clone, Debug)]
pub(super) struct Stored {
    /// The file that holds them.
    pub(super) file: PathBuf,
    /// The byte at which they begin; none where the file ends with them.
    pub(super) start: Option<u64>,
    pub(super) is_gzip: bool,
    pub(super) number: Number,
    pub(super) order: ByteOrder,
    /// Bytes of other volumes that come first, unpacked.
    pub(super) before: u64,
}

/// A volume whose planes lie one after the other.
#[derive(Debug)]
pub(crate) struct RawVolume {
    path: PathBuf,
    info: StackInfo,
    stored: Stored,
    /// The file that planes are read from, and where the first of them begins, once that is known.
    opened: Mutex<Option<(Arc<File>, u64)>>,
}

impl RawVolume {
    /// A volume whose header at `path` was read.
    pub(super) fn new(path: &Path, info: StackInfo, stored: Stored) -> Result<Self> {
        let volume = Self { path: path.to_path_buf(), info, stored, opened: Mutex::default() };
        if !volume.stored.is_gzip {
            volume.opened()?;
        }
        Ok(volume)
    }

    fn plane_bytes(&self) -> u64 {
        let [width, height, _] = self.info.shape.map(i64::unsigned_abs);
        width * height * u64::from(self.stored.number.bits() / 8)
    }

    fn bytes(&self) -> u64 {
        self.plane_bytes().saturating_mul(self.info.shape[2].unsigned_abs())
    }

    fn opened(&self) -> Result<(Arc<File>, u64)> {
        let mut opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = opened.as_ref() {
            return Ok(known.clone());
        }
        let found = if self.stored.is_gzip { self.unpacked()? } else { self.plain()? };
        Ok(opened.insert(found).clone())
    }

    fn fault(&self, error: &std::io::Error) -> Error {
        Error::input(format!("cannot be read: {error}")).caused_by_io(error).at(&self.stored.file)
    }

    /// The file as it is, when all planes are in it.
    fn plain(&self) -> Result<(Arc<File>, u64)> {
        let file = File::open(&self.stored.file).map_err(|e| self.fault(&e))?;
        let length = file.metadata().map_err(|e| self.fault(&e))?.len();
        let wanted = self.bytes();
        let start = match self.stored.start {
            Some(start) => start.saturating_add(self.stored.before),
            None => length.saturating_sub(wanted),
        };
        let held = length.saturating_sub(start);
        if held < wanted {
            return Err(Error::input(format!(
                "ends early: its header promises {wanted} bytes of voxels from byte {start} on, and {held} are there"
            ))
            .at(&self.stored.file));
        }
        Ok((Arc::new(file), start))
    }

    /// A temporary file with what the stream holds.
    fn unpacked(&self) -> Result<(Arc<File>, u64)> {
        let mut packed = File::open(&self.stored.file).map_err(|e| self.fault(&e))?;
        packed.seek(SeekFrom::Start(self.stored.start.unwrap_or(0))).map_err(|e| self.fault(&e))?;
        let mut file = tempfile::tempfile()
            .map_err(|e| Error::from_io("cannot make a temporary file to unpack it into", &e).at(&self.stored.file))?;
        // Not more than the header promises, whatever the stream turns out to be.
        let wanted = self.bytes().saturating_add(self.stored.before);
        let mut unpacking = std::io::Read::take(MultiGzDecoder::new(BufReader::new(packed)), wanted);
        let held = std::io::copy(&mut unpacking, &mut file).map_err(|error| {
            let what = format!(
                "cannot be unpacked into a temporary file: {error}; save it raw, or name a roomy folder by TMPDIR"
            );
            let is_full = [ErrorKind::StorageFull, ErrorKind::QuotaExceeded].contains(&error.kind());
            let told = if is_full { Error::failed(what) } else { Error::input(what) };
            told.caused_by_io(&error).at(&self.stored.file)
        })?;
        if held < wanted {
            return Err(
                Error::input(format!("ends early: it holds {held} of {wanted} bytes of voxels")).at(&self.stored.file)
            );
        }
        Ok((Arc::new(file), self.stored.before))
    }
}

impl Stack for RawVolume {
    fn info(&self) -> &StackInfo {
        &self.info
    }
}

impl PlaneSource for RawVolume {
    fn shape(&self) -> [i64; 3] {
        self.info.shape
    }

    fn element(&self) -> ElementType {
        self.info.element
    }

    fn read_plane(&self, z: i64, mut out: SamplesMut<'_>) -> Result<()> {
        let [width, height, depth] = self.info.shape.map(i64::unsigned_abs);
        if out.element() != self.info.element || out.len() as u64 != width * height || z.unsigned_abs() >= depth {
            return Err(Error::failed(format!("plane {z} was asked for as {} {}", out.len(), out.element().name()))
                .at(&self.path));
        }
        let (file, start) = self.opened()?;
        let mut bytes = vec![0; self.plane_bytes() as usize];
        file.read_exact_at(&mut bytes, start + z.unsigned_abs() * self.plane_bytes()).map_err(|e| self.fault(&e))?;
        self.stored.number.copy(Row(&bytes), self.stored.order, &mut out, 0);
        Ok(())
    }

    fn path(&self) -> Option<&Path> {
        Some(&self.path)
    }

    fn whereabouts(&self, _z: i64) -> Option<Whereabouts> {
        Some(Whereabouts { file: self.stored.file.clone(), part: String::new() })
    }
}

/// Numbers one after the other.
struct Row<'a>(&'a [u8]);

impl Copying for Row<'_> {
    fn copy<const N: usize, T>(self, out: &mut [T], convert: impl Fn([u8; N]) -> T) {
        out.iter_mut().zip(self.0.as_chunks::<N>().0).for_each(|(out, word)| *out = convert(*word));
    }
}
