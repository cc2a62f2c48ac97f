//! Reads one plane, strip by strip or tile by tile: at most one of them is in memory beside the plane itself.

use super::codec;
use super::compression::Compression;
use super::ifd::TiffFile;
use super::page::{Chunk, MAX_CHUNK, Page};
use super::samples::Row;
use crate::error::{Error, Result};
use crate::io::stack::number::ByteOrder;
use crate::store::SamplesMut;

/// Uncompressed strips are read in blocks of about this many bytes.
const BLOCK: u64 = 1 << 20;

/// Buffers of one thread, reused from plane to plane.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    packed: Vec<u8>,
    rows: Vec<u8>,
}

/// One plane of a file: its page, which sample of each pixel, and where the strips or tiles with it lie.
#[derive(Debug)]
pub(crate) struct Plane<'a> {
    pub(crate) file: &'a TiffFile,
    pub(crate) page: Page,
    pub(crate) sample: u16,
    pub(crate) chunks: Vec<Chunk>,
}

impl Plane<'_> {
    /// Decodes the plane into `out`, dense `[y][x]`, of the type and length of the page.
    pub(crate) fn read(&self, scratch: &mut Scratch, out: &mut SamplesMut<'_>) -> Result<()> {
        (0..self.chunks.len()).try_for_each(|index| self.read_chunk(index, scratch, out))
    }

    fn read_chunk(&self, index: usize, scratch: &mut Scratch, out: &mut SamplesMut<'_>) -> Result<()> {
        let page = &self.page;
        let across = page.chunks_across() as usize;
        let x = (index % across) as u64 * u64::from(page.chunk[0]);
        let y = (index / across) as u64 * u64::from(page.chunk[1]);
        // The last strip ends with the image; tiles are padded to their full height.
        let used = (u64::from(page.kind.height) - y).min(u64::from(page.chunk[1]));
        let stored = if page.tiled { u64::from(page.chunk[1]) } else { used };
        if page.compression == Compression::None {
            self.read_stored(index, stored, used, [x, y], scratch, out)
        } else {
            let order = self.unpack(index, stored as u32, scratch)?;
            self.copy_rows(&scratch.rows, order, used, [x, y], out);
            Ok(())
        }
    }

    /// Reads the `used` first rows of an uncompressed strip or tile of `stored` rows, a block at a time.
    fn read_stored(
        &self,
        index: usize,
        stored: u64,
        used: u64,
        at: [u64; 2],
        scratch: &mut Scratch,
        out: &mut SamplesMut<'_>,
    ) -> Result<()> {
        let row_bytes = self.page.row_bytes();
        let needed = stored.saturating_mul(row_bytes);
        let chunk = self.chunk_in_file(index, needed)?;
        if chunk.bytes != 0 && chunk.bytes < needed {
            let listed = chunk.bytes;
            return Err(
                self.error(index, &format!("has {listed} bytes where {needed} are needed: the file is damaged"))
            );
        }
        let block = (BLOCK / row_bytes.max(1)).max(1);
        let mut row = 0;
        while row < used {
            let rows = block.min(used - row);
            scratch.rows.resize((rows * row_bytes) as usize, 0);
            self.file.read_at(chunk.offset + row * row_bytes, &mut scratch.rows)?;
            self.straighten_bits(&mut scratch.rows);
            self.copy_rows(&scratch.rows, self.page.order, rows, [at[0], at[1] + row], out);
            row += rows;
        }
        Ok(())
    }

    /// Unpacks a compressed strip or tile of `stored` rows into `scratch.rows`; returns the byte order of its samples.
    fn unpack(&self, index: usize, stored: u32, scratch: &mut Scratch) -> Result<ByteOrder> {
        let listed = self.chunks[index].bytes;
        if listed == 0 || listed > MAX_CHUNK {
            let limit = MAX_CHUNK >> 20;
            return Err(self.error(index, &format!("has {listed} packed bytes (1 byte to {limit} MiB can be read)")));
        }
        let chunk = self.chunk_in_file(index, listed)?;
        scratch.packed.resize(codec::HEAD + listed as usize, 0);
        let packed = &mut scratch.packed[codec::HEAD..];
        self.file.read_at(chunk.offset, packed)?;
        self.straighten_bits(packed);
        scratch.rows.resize((u64::from(stored) * self.page.row_bytes()) as usize, 0);
        codec::unpack(&self.page, stored, &mut scratch.packed, &mut scratch.rows).map_err(|reason| {
            let method = self.page.compression.name();
            self.error(index, &format!("cannot be unpacked ({method}): {reason}; the file is damaged"))
        })
    }

    /// The place of a strip or tile, when the file reaches `needed` bytes beyond its start.
    fn chunk_in_file(&self, index: usize, needed: u64) -> Result<Chunk> {
        let chunk = self.chunks[index];
        let (offset, len) = (chunk.offset, self.file.len);
        let end = offset.saturating_add(needed);
        if end > len {
            return Err(self.error(
                index,
                &format!("lies at bytes {offset} to {end} but the file ends at {len}: it is truncated or damaged"),
            ));
        }
        Ok(chunk)
    }

    fn straighten_bits(&self, bytes: &mut [u8]) {
        if self.page.reversed_bits {
            for byte in bytes {
                *byte = byte.reverse_bits();
            }
        }
    }

    fn copy_rows(&self, bytes: &[u8], order: ByteOrder, rows: u64, at: [u64; 2], out: &mut SamplesMut<'_>) {
        let page = &self.page;
        let width = u64::from(page.kind.width);
        let count = (width - at[0]).min(u64::from(page.chunk[0])) as usize;
        let step = usize::from(page.interleaved());
        let sample = if page.planar { 0 } else { usize::from(self.sample) };
        for (y, bytes) in (at[1]..at[1] + rows).zip(bytes.chunks_exact(page.row_bytes() as usize)) {
            let row = Row { bytes, kind: page.kind.sample, order, step, sample, count };
            row.copy_to(out, (y * width + at[0]) as usize);
        }
    }

    fn error(&self, index: usize, what: &str) -> Error {
        let name = if self.page.tiled { "tile" } else { "strip" };
        self.file.error(format!("page {}: {name} {} {what}", self.page.number, index + 1))
    }
}
