//! Volumes in files of any format, written from the first plane to the last: [`VolumeFile`] takes pieces, packed by any
//! number of threads, and nothing stands under the file's name before all of it is there.
//!
//! [`FORMATS`] is the one table of what is written.

use std::path::{Path, PathBuf};

use super::body::{Body, Layout, Packed, Start};
use super::{nrrd, tiff, vti};
use crate::error::{Error, Result};
use crate::grid::Box3;
use crate::store::{ElementType, HiddenFile};

pub use super::body::VolumeSpec;

/// A file format of volumes.
#[derive(Debug)]
pub struct Format {
    /// Its usual name.
    pub name: &'static str,
    /// How names of such files end, without the dot; the first is the usual one, and it decides.
    pub extensions: &'static [&'static str],
    /// Whether it says where the first voxel lies.
    pub has_origin: bool,
    /// Whether it packs voxels, or has them as they are.
    pub is_packed: bool,
    start: Start,
}

/// The formats.
pub const FORMATS: &[Format] = &[
    Format { name: "OME-TIFF", extensions: &["tif", "tiff"], has_origin: false, is_packed: true, start: tiff::start },
    Format { name: "VTI", extensions: &["vti"], has_origin: true, is_packed: false, start: vti::start },
    Format { name: "NRRD", extensions: &["nrrd"], has_origin: true, is_packed: true, start: nrrd::start },
];

impl Format {
    /// The format that a file's name asks for.
    #[must_use]
    pub fn of(path: &Path) -> Option<&'static Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        FORMATS.iter().find(|format| format.extensions.contains(&extension.as_str()))
    }

    /// The type in which it holds voxels of a type without loss: none of the formats has half precision.
    #[must_use]
    pub fn element(&self, element: ElementType) -> ElementType {
        if element == ElementType::F16 { ElementType::F32 } else { element }
    }
}

/// A file of any format in the making; dropped unfinished it is gone.
pub struct VolumeFile {
    body: Box<dyn Body>,
    path: PathBuf,
    hidden: HiddenFile,
    layout: Layout,
    last: Box3,
}

impl VolumeFile {
    /// Begins the file that will stand at `path`.
    ///
    /// # Errors
    /// When no file can be made beside `path`.
    pub fn create(format: &Format, path: &Path, spec: &VolumeSpec<'_>) -> Result<Self> {
        let layout = Layout::new(spec.geometry.shape, spec.element);
        let begin = || {
            let (hidden, file) = HiddenFile::create(path, &format!(".{}", format.extensions[0]))?;
            let body = (format.start)(file, spec, layout)?;
            let [width, height, depth] = layout.shape;
            let last = Box3::new([0, (height - 1) / layout.rows * layout.rows, depth - 1], [width, height, depth]);
            Ok(Self { body, path: path.to_path_buf(), hidden, layout, last })
        };
        begin().map_err(|error| unwritable(&error, path))
    }

    /// The boxes in which voxels are taken, from the first to the last.
    pub fn pieces(&self) -> impl Iterator<Item = Box3> + use<> {
        self.layout.pieces()
    }

    /// Packs the voxels of a piece, dense `[z][y][x]` and little-endian; pieces are packed by any thread in any order.
    ///
    /// # Errors
    /// When they cannot be packed.
    pub fn pack(&self, piece: &Box3, bytes: Vec<u8>) -> Result<Packed> {
        self.body.pack(bytes, *piece == self.last).map_err(|error| unwritable(&error, &self.path))
    }

    /// Takes a packed piece; they come from the first to the last.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn append(&mut self, packed: Packed) -> Result<()> {
        self.body.append(packed).map_err(|error| unwritable(&error, &self.path))
    }

    /// Completes the file and puts it under its name, in place of any that was there if it may `replace` that.
    ///
    /// # Errors
    /// When it cannot be written or renamed, or something is there that it may not replace.
    pub fn finish(self, replace: bool) -> Result<()> {
        let Self { body, path, hidden, .. } = self;
        body.complete().and_then(|()| hidden.place(replace)).map_err(|error| unwritable(&error, &path))
    }
}

/// Bytes that a thread holds of a piece of such a volume: as voxels, as bytes, and packed.
#[must_use]
pub fn piece_bytes(shape: [i64; 3], element: ElementType) -> u64 {
    4 * Layout::new(shape, element).piece_bytes()
}

fn unwritable(error: &std::io::Error, path: &Path) -> Error {
    Error::from_io("the volume cannot be written", error).at(path)
}
