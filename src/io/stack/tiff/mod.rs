//! TIFF stacks as input: ImageJ hyperstacks, OME-TIFF, BigTIFF, plain pages, folders of slices; read plane by plane.
//!
//! Only offsets are kept in memory. Rests on TIFF 6.0, the BigTIFF design, the OME-TIFF specification and the files
//! that ImageJ and `tifffile` write. Values are handed out as stored: min-is-white and palettes are not applied.

pub mod description;
pub mod folder;
mod images;
mod levels;
pub(crate) mod opened;
pub mod pages;
mod raw;
mod source;

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::volume::Stack;
use crate::error::{Error, Result};
use crate::store::{ElementType, PlaneSource, SamplesMut, Whereabouts};
use opened::{Opened, Source};
use pages::decode::Scratch;

pub use super::volume::{ImageSummary, Select, StackInfo};

/// Whether a file that starts with these bytes is TIFF: classic or big, of either byte order.
#[must_use]
pub fn is_tiff(head: [u8; 4]) -> bool {
    [*b"II*\0", *b"MM\0*", *b"II+\0", *b"MM\0+"].contains(&head)
}

/// One channel at one time of a TIFF file or of a folder of slices.
#[derive(Debug)]
pub struct TiffStack {
    path: PathBuf,
    info: StackInfo,
    images: Vec<ImageSummary>,
    source: Source,
    /// Buffers that wait for the next plane: as many as planes were ever decoded at once.
    pool: Mutex<Vec<Scratch>>,
}

impl TiffStack {
    /// Opens a file, or a folder of slices, and reads what it says of itself; no plane is decoded.
    ///
    /// # Errors
    /// When the file is unreadable, damaged, of a kind that is not supported, or has no such channel or time.
    pub fn open(path: &Path, select: Select) -> Result<Self> {
        let opened =
            if path.is_dir() { folder::slices::open_folder(path, select)? } else { source::open_file(path, select)? };
        let Opened { info, images, source } = opened;
        Ok(Self { path: path.to_path_buf(), info, images, source, pool: Mutex::new(Vec::new()) })
    }

    fn check_request(&self, z: i64, out: &SamplesMut<'_>) -> Result<()> {
        let [width, height, depth] = self.info.shape;
        let (element, len) = match out {
            SamplesMut::U8(o) => (ElementType::U8, o.len()),
            SamplesMut::U16(o) => (ElementType::U16, o.len()),
            SamplesMut::U32(o) => (ElementType::U32, o.len()),
            SamplesMut::F32(o) => (ElementType::F32, o.len()),
            SamplesMut::F64(o) => (ElementType::F64, o.len()),
        };
        if element != self.info.element || len as u64 != width.unsigned_abs() * height.unsigned_abs() {
            let due = self.info.element.name();
            return Err(Error::failed(format!(
                "a plane of {width} x {height} {due} was asked for as {len} {}",
                element.name()
            ))
            .at(&self.path));
        }
        if !(0..depth).contains(&z) {
            return Err(Error::failed(format!("plane {z} was asked for, of {depth}")).at(&self.path));
        }
        Ok(())
    }
}

impl Stack for TiffStack {
    fn info(&self) -> &StackInfo {
        &self.info
    }

    fn images(&self) -> &[ImageSummary] {
        &self.images
    }
}

impl PlaneSource for TiffStack {
    fn shape(&self) -> [i64; 3] {
        self.info.shape
    }

    fn element(&self) -> ElementType {
        self.info.element
    }

    fn read_plane(&self, z: i64, mut out: SamplesMut<'_>) -> Result<()> {
        self.check_request(z, &out)?;
        let free = |pool: &Mutex<Vec<Scratch>>| pool.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut scratch = free(&self.pool).unwrap_or_default();
        let outcome = self.source.read_plane(z as u64, &mut scratch, &mut out);
        self.pool.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
        outcome
    }

    fn path(&self) -> Option<&Path> {
        Some(&self.path)
    }

    fn whereabouts(&self, z: i64) -> Option<Whereabouts> {
        let (file, part) = self.source.whereabouts(z as u64);
        Some(Whereabouts { file: file.unwrap_or(&self.path).to_path_buf(), part })
    }
}
