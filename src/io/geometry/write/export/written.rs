//! A finished PLY file of ours, read again piece by piece.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

const BUFFER: usize = 1 << 18;

/// Vertices as three f32 or three f64 each, then triangles as a count byte and three indices, and two labels where they have any;
/// little-endian.
pub(crate) struct Written {
    file: BufReader<File>,
    /// Where the vertices begin.
    start: u64,
    pub(crate) vertices: u64,
    pub(crate) triangles: u64,
    pub(crate) is_tagged: bool,
    /// Whether positions are f64.
    pub(crate) is_double: bool,
}

impl Written {
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let mut file = BufReader::with_capacity(BUFFER, File::open(path)?);
        let (mut start, mut counts, mut is_tagged, mut is_double) = (0, [0; 2], false, false);
        loop {
            let mut line = String::new();
            let read = file.read_line(&mut line)?;
            if read == 0 {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "the mesh has no end of its header"));
            }
            start += read as u64;
            for (count, prefix) in counts.iter_mut().zip(["element vertex ", "element face "]) {
                if let Some(number) = line.strip_prefix(prefix) {
                    *count = number.trim().parse().map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e))?;
                }
            }
            is_tagged |= line == "property uint label_low\n";
            is_double |= line == "property double x\n";
            if line == "end_header\n" {
                let [vertices, triangles] = counts;
                return Ok(Self { file, start, vertices, triangles, is_tagged, is_double });
            }
        }
    }

    fn vertex_bytes(&self) -> u64 {
        if self.is_double { 24 } else { 12 }
    }

    pub(crate) fn each_vertex(&mut self, mut f: impl FnMut([f64; 3]) -> io::Result<()>) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.start))?;
        for _ in 0..self.vertices {
            let mut bytes = [0; 24];
            let width = self.vertex_bytes() as usize;
            self.file.read_exact(&mut bytes[..width])?;
            let double = |n: usize| f64::from_le_bytes(std::array::from_fn(|i| bytes[8 * n + i]));
            let single = |n: usize| f64::from(f32::from_le_bytes(std::array::from_fn(|i| bytes[4 * n + i])));
            f(std::array::from_fn(|n| if self.is_double { double(n) } else { single(n) }))?;
        }
        Ok(())
    }

    pub(crate) fn each_triangle(&mut self, mut f: impl FnMut([u32; 3]) -> io::Result<()>) -> io::Result<()> {
        self.each_facet(|corners, _| f(corners))
    }

    /// Each triangle with its two labels, which are 0 where it has none.
    pub(crate) fn each_facet(&mut self, mut f: impl FnMut([u32; 3], [u32; 2]) -> io::Result<()>) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.start + self.vertex_bytes() * self.vertices))?;
        for _ in 0..self.triangles {
            let mut bytes = [0; 21];
            self.file.read_exact(if self.is_tagged { &mut bytes } else { &mut bytes[..13] })?;
            f(words(&bytes[1..]).map(u32::from_le_bytes), words(&bytes[13..]).map(u32::from_le_bytes))?;
        }
        Ok(())
    }

    /// The file as it is.
    pub(crate) fn copy(&mut self, out: &mut dyn Write) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(0))?;
        io::copy(&mut self.file, out).map(|_| ())
    }
}

/// As many words of 4 bytes as are asked for.
fn words<const N: usize>(bytes: &[u8]) -> [[u8; 4]; N] {
    std::array::from_fn(|n| std::array::from_fn(|i| bytes[4 * n + i]))
}
