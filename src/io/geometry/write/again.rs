//! A PLY file of ours read again, triangle after triangle, in memory that does not go with its size: triangles are in the order in
//! which the surface was drawn, so the vertices of one lie on few pages of the file, and a small number of these is kept.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::body::BUFFER;
use crate::error::{Error, Result};

/// Vertices of a page, and pages that are kept.
const PAGE: u64 = 1 << 9;
const PAGES: u64 = 1 << 8;

/// A PLY file that was written, and where things lie in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// The file.
    pub path: PathBuf,
    /// Bytes before the first vertex.
    pub(super) start: u64,
    /// Number of vertices.
    pub vertices: u64,
    /// Number of triangles.
    pub triangles: u64,
    pub(super) is_double: bool,
    pub(super) is_tagged: bool,
}

/// The places of vertices, read page by page.
struct Pages {
    file: File,
    start: u64,
    vertices: u64,
    is_double: bool,
    /// Each with its number; a page has one place that it may be kept in.
    kept: Vec<Option<(u64, Vec<[f64; 3]>)>>,
}

impl Written {
    /// Bytes of memory that reading takes.
    pub const READING: u64 = PAGE * PAGES * 24 + PAGE * 24 + BUFFER as u64;

    /// Whether each triangle has the two labels that it separates.
    #[must_use]
    pub fn is_tagged(&self) -> bool {
        self.is_tagged
    }

    /// Gives each triangle to `take` in the order of the file: the numbers of its corners, where these lie in the world, and
    /// its two labels, which are 0 where it has none.
    ///
    /// # Errors
    /// When the file cannot be read, and those of `take`.
    pub fn each(&self, mut take: impl FnMut([u32; 3], [[f64; 3]; 3], [u32; 2]) -> Result<()>) -> Result<()> {
        let fault = |error: io::Error| unreadable(&error, &self.path);
        let mut pages = Pages::new(self).map_err(fault)?;
        let mut file = BufReader::with_capacity(BUFFER, File::open(&self.path).map_err(fault)?);
        file.seek(SeekFrom::Start(self.start + self.vertices * bytes_of(self.is_double))).map_err(fault)?;
        let mut bytes = [0; 21];
        for _ in 0..self.triangles {
            file.read_exact(&mut bytes[..if self.is_tagged { 21 } else { 13 }]).map_err(fault)?;
            let mut words = [0; 5];
            for (word, four) in words.iter_mut().zip(bytes[1..].chunks_exact(4)) {
                *word = u32::from_le_bytes([four[0], four[1], four[2], four[3]]);
            }
            let [a, b, c, low, high] = words;
            let mut places = [[0.0; 3]; 3];
            for (place, corner) in places.iter_mut().zip([a, b, c]) {
                *place = pages.get(corner).map_err(fault)?;
            }
            take([a, b, c], places, [low, high])?;
        }
        Ok(())
    }
}

impl Pages {
    fn new(written: &Written) -> io::Result<Self> {
        let &Written { start, vertices, is_double, .. } = written;
        let file = File::open(&written.path)?;
        Ok(Self { file, start, vertices, is_double, kept: vec![None; PAGES as usize] })
    }

    fn get(&mut self, vertex: u32) -> io::Result<[f64; 3]> {
        let (page, at) = (u64::from(vertex) / PAGE, (u64::from(vertex) % PAGE) as usize);
        let slot = (page % PAGES) as usize;
        if self.kept[slot].as_ref().is_none_or(|(number, _)| *number != page) {
            self.kept[slot] = Some((page, self.read(page)?));
        }
        let place = self.kept[slot].as_ref().and_then(|(_, places)| places.get(at));
        place.copied().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "a triangle names a missing vertex"))
    }

    fn read(&mut self, page: u64) -> io::Result<Vec<[f64; 3]>> {
        let each = bytes_of(self.is_double);
        let count = PAGE.min(self.vertices.saturating_sub(page * PAGE));
        let mut bytes = vec![0; (count * each) as usize];
        self.file.seek(SeekFrom::Start(self.start + page * PAGE * each))?;
        self.file.read_exact(&mut bytes)?;
        let number = |bytes: &[u8]| match *bytes {
            [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
            [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
            _ => 0.0,
        };
        let wide = (each / 3) as usize;
        let place = |bytes: &[u8]| std::array::from_fn(|a| number(&bytes[a * wide..(a + 1) * wide]));
        Ok(bytes.chunks_exact(each as usize).map(place).collect())
    }
}

/// Bytes of a vertex.
fn bytes_of(is_double: bool) -> u64 {
    if is_double { 24 } else { 12 }
}

fn unreadable(error: &io::Error, path: &Path) -> Error {
    Error::from_io("the mesh cannot be read again", error).at(path)
}

#[cfg(test)]
mod tests {
    use crate::grid::Geometry;
    use crate::io::geometry::write::ply::PlyWriter;
    use crate::store::MeshSink;

    /// Triangles with vertices near and far, in both precisions, with and without labels.
    #[test]
    fn what_was_written_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.ply");
        for (origin, is_tagged) in [(0.0, false), (0.0, true), (4_000_000.0, true)] {
            let geometry = Geometry { shape: [9; 3], spacing: [0.25; 3], origin: [origin; 3], unit: None };
            let create = if is_tagged { PlyWriter::tagged_on_grid } else { PlyWriter::on_grid };
            let mut file = create(&path, &geometry).unwrap();
            let place = |n: u32| [origin + f64::from(n) / 8.0, origin, origin - f64::from(n)];
            let facet = |n: u32| ([n, n * 7 % 300_000, n / 5], [n % 3, 3 + n]);
            (0..300_000).try_for_each(|n| file.vertex(place(n))).unwrap();
            for (corners, labels) in (0..300_000).map(facet) {
                if is_tagged { file.facet(corners, labels) } else { file.triangle(corners) }.unwrap();
            }
            let written = file.finish().unwrap();
            let mut n = 0;
            let expect = |corners: [u32; 3], places: [[f64; 3]; 3], labels: [u32; 2]| {
                let (expected, pair) = facet(n);
                assert_eq!((corners, labels), (expected, if is_tagged { pair } else { [0; 2] }));
                assert_eq!(places, corners.map(place));
                n += 1;
                Ok(())
            };
            written.each(expect).unwrap();
            assert_eq!((n, written.vertices), (300_000, 300_000));
        }
    }
}
