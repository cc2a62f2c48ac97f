//! What a format makes of a volume as it passes: pieces, runs of whole rows of one plane, from the first to the last.

use std::fs::File;
use std::io;

use flate2::Crc;

use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::Compression;
use crate::store::ElementType;

/// Bytes of a piece, about: what one thread packs at once.
const PIECE_BYTES: i64 = 1 << 19;

/// What a file says of its volume.
#[derive(Clone, Debug)]
pub struct VolumeSpec<'a> {
    /// The volume's name.
    pub name: &'a str,
    /// Where its voxels lie.
    pub geometry: &'a Geometry,
    /// The axes along which nobody told how far apart voxels are.
    pub guessed: [bool; 3],
    /// The type of a voxel.
    pub element: ElementType,
    /// What is saved where the format packs its voxels.
    pub compression: Compression,
}

/// The shape of a volume and of its pieces, and the bytes of a voxel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub(super) shape: [i64; 3],
    pub(super) rows: i64,
    pub(super) size: usize,
}

impl Layout {
    pub(super) fn new(shape: [i64; 3], element: ElementType) -> Self {
        let row = shape[0] * element.size() as i64;
        Self { shape, rows: (PIECE_BYTES / row).clamp(1, shape[1]), size: element.size() }
    }

    /// The pieces, from the first to the last.
    pub(super) fn pieces(self) -> impl Iterator<Item = Box3> {
        Box3::from_shape(self.shape).tiles([self.shape[0], self.rows, 1])
    }

    /// Bytes of the voxels of the whole volume.
    pub(super) fn bytes(self) -> u64 {
        Box3::from_shape(self.shape).volume() * self.size as u64
    }

    /// Bytes of the voxels of a piece.
    pub(super) fn piece_bytes(self) -> u64 {
        (self.shape[0] * self.rows) as u64 * self.size as u64
    }
}

/// A piece as it lies in the file.
pub struct Packed {
    pub(super) bytes: Vec<u8>,
    /// Of the bytes before they were packed, where the format wants one.
    pub(super) crc: Crc,
}

/// A file in the making.
pub(super) trait Body: Send + Sync {
    /// Packs the voxels of a piece, little-endian; `is_last` says that none follows it.
    fn pack(&self, bytes: Vec<u8>, is_last: bool) -> io::Result<Packed>;

    /// Takes the next piece.
    fn append(&mut self, packed: Packed) -> io::Result<()>;

    /// Writes what is still missing.
    fn complete(self: Box<Self>) -> io::Result<()>;
}

/// Begins a body in an empty file.
pub(super) type Start = fn(File, &VolumeSpec<'_>, Layout) -> io::Result<Box<dyn Body>>;
