//! OME-TIFF: a page for each plane, in strips, deflated (TIFF 6.0, Adobe's technical note on deflate) with the differences of
//! neighbouring voxels where these are whole numbers (predictor 2); `BigTIFF` where 4 GiB might not do. Strips come as they
//! are packed, and what says where they lie stands behind them.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};

use flate2::Crc;
use flate2::write::ZlibEncoder;

use super::body::{Body, Layout, Packed, VolumeSpec};
use super::ome_xml;
use crate::io::ome_zarr::Compression;
use crate::store::ElementType;

/// Bytes of a page beside its strips, at most, and of a strip's place.
const PAGE_BYTES: u64 = 512;
const STRIP_BYTES: u64 = 32;

struct Tiff {
    file: BufWriter<File>,
    layout: Layout,
    element: ElementType,
    /// None where voxels are stored as they are.
    level: Option<flate2::Compression>,
    is_big: bool,
    description: String,
    at: u64,
    /// Where each strip lies, and how many bytes it has.
    strips: Vec<[u64; 2]>,
}

pub(super) fn start(file: File, spec: &VolumeSpec<'_>, layout: Layout) -> io::Result<Box<dyn Body>> {
    let level = match spec.compression {
        Compression::None => None,
        Compression::Fast => Some(flate2::Compression::fast()),
        Compression::Small => Some(flate2::Compression::best()),
    };
    let mut file = BufWriter::new(file);
    let is_big = needs_big(layout);
    let header: &[u8] = if is_big { b"II+\0\x08\0\0\0\0\0\0\0\0\0\0\0" } else { b"II*\0\0\0\0\0" };
    file.write_all(header)?;
    Ok(Box::new(Tiff {
        file,
        layout,
        element: spec.element,
        level,
        is_big,
        description: ome_xml::document(spec),
        at: header.len() as u64,
        strips: Vec::new(),
    }))
}

/// Whether a file whose strips cannot be packed at all may reach beyond what 32 bits count.
fn needs_big(layout: Layout) -> bool {
    let pages = layout.shape[2].unsigned_abs();
    let strips = pages * (layout.shape[1].unsigned_abs()).div_ceil(layout.rows.unsigned_abs());
    let most = layout.bytes() + layout.bytes() / 512 + pages * PAGE_BYTES + strips * (STRIP_BYTES + 64) + (1 << 20);
    most > u64::from(u32::MAX)
}

impl Body for Tiff {
    fn pack(&self, mut bytes: Vec<u8>, _is_last: bool) -> io::Result<Packed> {
        let Some(level) = self.level else { return Ok(Packed { bytes, crc: Crc::new() }) };
        if self.is_predicted() {
            let row = self.layout.shape[0] as usize * self.layout.size;
            bytes.chunks_exact_mut(row).for_each(|row| match self.layout.size {
                1 => differences::<1>(row, |[a], [b]| [a.wrapping_sub(b)]),
                2 => differences(row, |a, b| u16::from_le_bytes(a).wrapping_sub(u16::from_le_bytes(b)).to_le_bytes()),
                _ => differences(row, |a, b| u32::from_le_bytes(a).wrapping_sub(u32::from_le_bytes(b)).to_le_bytes()),
            });
        }
        let mut encoder = ZlibEncoder::new(Vec::with_capacity(bytes.len() / 2), level);
        encoder.write_all(&bytes)?;
        Ok(Packed { bytes: encoder.finish()?, crc: Crc::new() })
    }

    fn append(&mut self, packed: Packed) -> io::Result<()> {
        self.strips.push([self.at, packed.bytes.len() as u64]);
        self.write(&packed.bytes)
    }

    fn complete(mut self: Box<Self>) -> io::Result<()> {
        let per_page = self.strips.len() / self.layout.shape[2] as usize;
        let strips = std::mem::take(&mut self.strips);
        let mut link = if self.is_big { 8 } else { 4 };
        for (page, strips) in strips.chunks(per_page).enumerate() {
            link = self.page(strips, page == 0, link)?;
        }
        self.file.flush()
    }
}

/// Puts the difference to the number before it in place of each number of a row but the first.
fn differences<const N: usize>(row: &mut [u8], difference: impl Fn([u8; N], [u8; N]) -> [u8; N]) {
    let words = row.as_chunks_mut::<N>().0;
    for n in (1..words.len()).rev() {
        words[n] = difference(words[n], words[n - 1]);
    }
}

/// What a tag holds.
enum Value<'a> {
    Short(u16),
    Long(u32),
    Text(&'a [u8]),
    Places(Vec<u64>),
}

impl Tiff {
    /// Whether differences are packed: those of floating-point numbers are no shorter.
    fn is_predicted(&self) -> bool {
        let is_float = matches!(self.element, ElementType::F16 | ElementType::F32 | ElementType::F64);
        self.level.is_some() && !is_float
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.at += bytes.len() as u64;
        self.file.write_all(bytes)
    }

    /// Writes a page, tells the one before (at `link`) where it is, and returns where it tells of the next.
    fn page(&mut self, strips: &[[u64; 2]], is_first: bool, link: u64) -> io::Result<u64> {
        let (description, bits) = (std::mem::take(&mut self.description), 8 * self.element.size() as u16);
        let format = match self.element {
            ElementType::U8 | ElementType::U16 | ElementType::U32 => 1,
            ElementType::I8 | ElementType::I16 | ElementType::I32 => 2,
            ElementType::F16 | ElementType::F32 | ElementType::F64 => 3,
        };
        let text = [description.as_bytes(), b"\0"].concat();
        let [width, height, _] = self.layout.shape;
        let mut tags = vec![
            (254, Value::Long(0)),
            (256, Value::Long(width as u32)),
            (257, Value::Long(height as u32)),
            (258, Value::Short(bits)),
            (259, Value::Short(if self.level.is_some() { 8 } else { 1 })),
            // Zero is black.
            (262, Value::Short(1)),
        ];
        if is_first {
            tags.push((270, Value::Text(&text)));
        }
        tags.extend([
            (273, Value::Places(strips.iter().map(|strip| strip[0]).collect())),
            (277, Value::Short(1)),
            (278, Value::Long(self.layout.rows as u32)),
            (279, Value::Places(strips.iter().map(|strip| strip[1]).collect())),
            (317, Value::Short(if self.is_predicted() { 2 } else { 1 })),
            (339, Value::Short(format)),
        ]);
        self.directory(&tags, link)
    }

    /// Writes tags and what does not fit into them.
    fn directory(&mut self, tags: &[(u16, Value<'_>)], link: u64) -> io::Result<u64> {
        let room = if self.is_big { 8 } else { 4 };
        let mut entries = Vec::new();
        for (tag, value) in tags {
            let (kind, count, bytes) = self.encoded(value);
            entries.extend(tag.to_le_bytes());
            entries.extend(u16::to_le_bytes(kind));
            entries.extend(self.word(count));
            if bytes.len() <= room {
                entries.extend(bytes.iter().copied().chain(std::iter::repeat(0)).take(room));
            } else {
                self.align()?;
                entries.extend(self.word(self.at));
                self.write(&bytes)?;
            }
        }
        self.align()?;
        let place = self.word(self.at);
        let end = self.at;
        self.file.seek(SeekFrom::Start(link))?;
        self.file.write_all(&place)?;
        self.file.seek(SeekFrom::Start(end))?;
        let count = tags.len() as u64;
        if self.is_big {
            self.write(&count.to_le_bytes())?;
        } else {
            self.write(&(count as u16).to_le_bytes())?;
        }
        self.write(&entries)?;
        let next = self.at;
        self.write(&vec![0; room])?;
        Ok(next)
    }

    /// The type of a tag's value, how many there are, and their bytes.
    fn encoded(&self, value: &Value<'_>) -> (u16, u64, Vec<u8>) {
        match value {
            Value::Short(value) => (3, 1, value.to_le_bytes().to_vec()),
            Value::Long(value) => (4, 1, value.to_le_bytes().to_vec()),
            Value::Text(text) => (2, text.len() as u64, text.to_vec()),
            Value::Places(places) => {
                let kind = if self.is_big { 16 } else { 4 };
                (kind, places.len() as u64, places.iter().flat_map(|&place| self.word(place)).collect())
            }
        }
    }

    /// A number as places in the file are written.
    fn word(&self, number: u64) -> Vec<u8> {
        if self.is_big { number.to_le_bytes().to_vec() } else { (number as u32).to_le_bytes().to_vec() }
    }

    /// Goes on at an even place, where directories lie.
    fn align(&mut self) -> io::Result<()> {
        if self.at % 2 == 1 { self.write(&[0]) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_files_are_big() {
        let big = |shape, element| needs_big(Layout::new(shape, element));
        assert!(!big([1000, 1000, 1000], ElementType::U16));
        assert!(big([2048, 2048, 1024], ElementType::U8) && big([1000, 1100, 1000], ElementType::F32));
    }

    #[test]
    fn differences_are_those_of_numbers() {
        let mut row = [1, 0, 3, 1, 2, 1];
        differences(&mut row, |a, b| u16::from_le_bytes(a).wrapping_sub(u16::from_le_bytes(b)).to_le_bytes());
        assert_eq!(row, [1, 0, 2, 1, 0xff, 0xff]);
    }
}
