//! NRRD (format 4, Kindlmann): a header of text lines, then the voxels, raw or as one gzip stream (RFC 1952).
//!
//! Pieces are deflated each for itself, by any thread, to a whole number of bytes; one after the other they are one stream
//! (RFC 1951), as every block says whether it is the last. Nothing in a piece points back at another.

use std::fs::File;
use std::io::{self, BufWriter, Write};

use flate2::{Compress, Compression as Level, Crc, FlushCompress, Status};

use super::body::{Body, Layout, Packed, VolumeSpec};
use crate::io::ome_zarr::Compression;
use crate::store::ElementType;

struct Nrrd {
    file: BufWriter<File>,
    /// None where voxels are stored as they are.
    level: Option<Level>,
    crc: Crc,
}

pub(super) fn start(file: File, spec: &VolumeSpec<'_>, _layout: Layout) -> io::Result<Box<dyn Body>> {
    let mut file = BufWriter::new(file);
    let level = match spec.compression {
        Compression::None => None,
        Compression::Fast => Some(Level::fast()),
        Compression::Small => Some(Level::best()),
    };
    file.write_all(header(spec, level.is_some()).as_bytes())?;
    if level.is_some() {
        // Deflate, no name, no time, no say on how well it was packed or by which system.
        file.write_all(&[0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 0xff])?;
    }
    Ok(Box::new(Nrrd { file, level, crc: Crc::new() }))
}

impl Body for Nrrd {
    fn pack(&self, bytes: Vec<u8>, is_last: bool) -> io::Result<Packed> {
        let Some(level) = self.level else { return Ok(Packed { bytes, crc: Crc::new() }) };
        let mut crc = Crc::new();
        crc.update(&bytes);
        Ok(Packed { bytes: deflated(&bytes, level, is_last)?, crc })
    }

    fn append(&mut self, packed: Packed) -> io::Result<()> {
        self.crc.combine(&packed.crc);
        self.file.write_all(&packed.bytes)
    }

    fn complete(mut self: Box<Self>) -> io::Result<()> {
        if self.level.is_some() {
            // The sum of what was packed, and how many bytes that was, by 2^32.
            self.file.write_all(&self.crc.sum().to_le_bytes())?;
            self.file.write_all(&self.crc.amount().to_le_bytes())?;
        }
        self.file.flush()
    }
}

/// A part of a deflate stream, ended at a whole byte; or its end.
fn deflated(bytes: &[u8], level: Level, is_last: bool) -> io::Result<Vec<u8>> {
    let mut packer = Compress::new(level, false);
    let flush = if is_last { FlushCompress::Finish } else { FlushCompress::Sync };
    let mut out = Vec::with_capacity(bytes.len() / 2 + 64);
    loop {
        let rest = &bytes[packer.total_in() as usize..];
        let status = packer.compress_vec(rest, &mut out, flush).map_err(io::Error::other)?;
        let is_done = if is_last { status == Status::StreamEnd } else { out.len() < out.capacity() };
        if is_done && packer.total_in() as usize == bytes.len() {
            return Ok(out);
        }
        out.reserve(out.capacity().max(64));
    }
}

fn header(spec: &VolumeSpec<'_>, is_packed: bool) -> String {
    let geometry = spec.geometry;
    let ([nx, ny, nz], [hx, hy, hz], [x, y, z]) = (geometry.shape, geometry.spacing, geometry.origin);
    let unit = geometry.unit.as_deref().map(symbol);
    let units = unit.map_or(String::new(), |unit| format!("space units: \"{unit}\" \"{unit}\" \"{unit}\"\n"));
    let endian = if spec.element.size() > 1 { "endian: little\n" } else { "" };
    let content: String = spec.name.chars().filter(|letter| !letter.is_control()).collect();
    format!(
        "NRRD0004\n\
         # written by strandline\n\
         type: {}\n\
         dimension: 3\n\
         space dimension: 3\n\
         sizes: {nx} {ny} {nz}\n\
         space directions: ({hx},0,0) (0,{hy},0) (0,0,{hz})\n\
         kinds: domain domain domain\n\
         {endian}\
         encoding: {}\n\
         {units}\
         space origin: ({x},{y},{z})\n\
         content: {content}\n\
         \n",
        type_name(spec.element),
        if is_packed { "gzip" } else { "raw" },
    )
}

/// The unit as NRRD files have it; what has no short name in its own.
fn symbol(unit: &str) -> &str {
    match unit {
        "micrometer" => "um",
        "nanometer" => "nm",
        "millimeter" => "mm",
        "centimeter" => "cm",
        "meter" => "m",
        other => other,
    }
}

fn type_name(element: ElementType) -> &'static str {
    match element {
        ElementType::F16 | ElementType::F32 => "float",
        ElementType::F64 => "double",
        whole => whole.name(),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    #[test]
    fn pieces_are_one_stream() {
        let pieces: Vec<Vec<u8>> =
            (0..5_u32).map(|n| (0..70_000_u32).map(|i| ((i * (n + 3)) >> 5) as u8).collect()).collect();
        for level in [Level::fast(), Level::best()] {
            let packed: Vec<u8> =
                pieces.iter().enumerate().flat_map(|(n, piece)| deflated(piece, level, n == 4).unwrap()).collect();
            let mut back = Vec::new();
            flate2::read::DeflateDecoder::new(&packed[..]).read_to_end(&mut back).unwrap();
            assert!(back == pieces.concat());
        }
    }
}
