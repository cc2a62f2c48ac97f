//! The triangles of a PLY file that this program wrote, one after the other in little memory, whatever their number.
//!
//! Triangles name vertices that were found shortly before them, so a few blocks of vertices that were read last answer nearly all.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::os::unix::fs::FileExt;
use std::path::Path;

use super::header::{Encoding, Header, Scalar};
use super::vertex_of;
use crate::error::{Error, Result};
use crate::io::text::unreadable;

/// Vertices of a block, and blocks that are kept.
const BLOCK: u64 = 2048;
const BLOCKS: usize = 128;
/// Bytes of the pieces in which triangles are read.
const PIECE: usize = 1 << 18;

/// Bytes that reading takes at most.
pub(crate) const READING: u64 = BLOCK * BLOCKS as u64 * 24 + 2 * PIECE as u64;

/// Gives each triangle of the file to `take`: its corners, world positions, and the two labels that it lies between, 0 where the file
/// has none.
///
/// # Errors
/// When the file cannot be read or is not of the form that this program writes; what `take` refuses.
pub(crate) fn each_triangle(path: &Path, take: &mut dyn FnMut([[f64; 3]; 3], [u32; 2]) -> Result<()>) -> Result<()> {
    read(path, take).map_err(|error| error.at(path))
}

fn read(path: &Path, take: &mut dyn FnMut([[f64; 3]; 3], [u32; 2]) -> Result<()>) -> Result<()> {
    let file = File::open(path).map_err(|e| unreadable(&e))?;
    let mut reader = BufReader::with_capacity(PIECE, file.try_clone().map_err(|e| unreadable(&e))?);
    let header = Header::read(&mut reader)?;
    let mut form = Form::of(&header)?;
    let mut vertices = Vertices::new(file, &form);
    reader.seek(SeekFrom::Start(form.triangles_at())).map_err(|e| unreadable(&e))?;
    let mut row = vec![0; form.row];
    while form.triangles > 0 {
        form.triangles -= 1;
        reader.read_exact(&mut row).map_err(|e| unreadable(&e))?;
        let word = |at: usize| u32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]]);
        if row[0] != 3 {
            return Err(foreign());
        }
        let mut corners = [[0.0; 3]; 3];
        for (n, corner) in corners.iter_mut().enumerate() {
            *corner = vertices.position(u64::from(word(1 + 4 * n)))?;
        }
        take(corners, if row.len() > 13 { [word(13), word(17)] } else { [0; 2] })?;
    }
    Ok(())
}

/// The box around the vertices of the file, lowest and highest corner; none where it has none.
///
/// # Errors
/// As [`each_triangle`].
pub(crate) fn extent(path: &Path) -> Result<Option<[[f64; 3]; 2]>> {
    let read = || {
        let file = File::open(path).map_err(|e| unreadable(&e))?;
        let mut reader = BufReader::with_capacity(PIECE, file);
        let form = Form::of(&Header::read(&mut reader)?)?;
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let (size, mut row) = (form.number.size(), vec![0; form.stride() as usize]);
        for _ in 0..form.vertices {
            reader.read_exact(&mut row).map_err(|e| unreadable(&e))?;
            for (axis, bytes) in row.chunks_exact(size).enumerate() {
                let value = form.number.decode(bytes, Encoding::Little);
                (low[axis], high[axis]) = (low[axis].min(value), high[axis].max(value));
            }
        }
        Ok((form.vertices > 0).then_some([low, high]))
    };
    read().map_err(|error: Error| error.at(path))
}

/// How the file is laid out.
struct Form {
    /// Where the vertices start.
    start: u64,
    vertices: u64,
    /// The type of a coordinate.
    number: Scalar,
    triangles: u64,
    /// Bytes of a triangle.
    row: usize,
}

impl Form {
    fn of(header: &Header) -> Result<Self> {
        let [vertex, face] = header.elements.as_slice() else { return Err(foreign()) };
        let names = |properties: &[super::header::Property]| -> Vec<String> {
            properties.iter().map(|property| property.name.clone()).collect()
        };
        let number = vertex.properties.first().map(|property| property.item).ok_or_else(foreign)?;
        let (places, of_face) = (names(&vertex.properties), names(&face.properties));
        let is_tagged = of_face == ["vertex_indices", "label_low", "label_high"];
        let is_own = vertex_of(header)? == 0
            && header.encoding == Encoding::Little
            && places == ["x", "y", "z"]
            && vertex.properties.iter().all(|p| p.item == number && p.list.is_none())
            && matches!(number, Scalar::F32 | Scalar::F64)
            && (is_tagged || of_face == ["vertex_indices"])
            && face.properties[0].list == Some(Scalar::U8)
            && face.properties.iter().all(|p| p.item.size() == 4);
        let row = if is_tagged { 21 } else { 13 };
        let form = Self { start: header.bytes, vertices: vertex.count, number, triangles: face.count, row };
        if is_own { Ok(form) } else { Err(foreign()) }
    }

    fn stride(&self) -> u64 {
        3 * self.number.size() as u64
    }

    fn triangles_at(&self) -> u64 {
        self.start.saturating_add(self.vertices.saturating_mul(self.stride()))
    }
}

fn foreign() -> Error {
    Error::input("is not laid out as this program writes surfaces; run the command again")
}

/// The blocks of vertices that were read last, each at the place that its number tells.
struct Vertices {
    file: File,
    start: u64,
    count: u64,
    number: Scalar,
    /// The block at each place; `u64::MAX` where there is none yet.
    kept: Vec<u64>,
    bytes: Vec<Vec<u8>>,
}

impl Vertices {
    fn new(file: File, form: &Form) -> Self {
        let Form { start, vertices, number, .. } = *form;
        Self { file, start, count: vertices, number, kept: vec![u64::MAX; BLOCKS], bytes: vec![Vec::new(); BLOCKS] }
    }

    fn position(&mut self, vertex: u64) -> Result<[f64; 3]> {
        if vertex >= self.count {
            return Err(foreign());
        }
        let size = self.number.size();
        let (block, within) = (vertex / BLOCK, (vertex % BLOCK) as usize);
        let place = (block % BLOCKS as u64) as usize;
        if self.kept[place] != block {
            let first = block * BLOCK;
            let count = BLOCK.min(self.count - first);
            self.bytes[place].resize(count as usize * 3 * size, 0);
            let at = self.start + first * 3 * size as u64;
            self.file.read_exact_at(&mut self.bytes[place], at).map_err(|e| unreadable(&e))?;
            self.kept[place] = block;
        }
        let number = |axis: usize| {
            let at = (3 * within + axis) * size;
            self.number.decode(&self.bytes[place][at..at + size], Encoding::Little)
        };
        Ok([number(0), number(1), number(2)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Geometry;
    use crate::io::geometry::write::ply::PlyWriter;
    use crate::store::MeshSink;

    /// Vertices of many more blocks than are kept, named near and far.
    #[test]
    fn triangles_are_those_that_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let count = BLOCK as u32 * BLOCKS as u32 * 3;
        let position = |n: u32| [f64::from(n) * 0.5, f64::from(n % 1000), -f64::from(n)];
        for (origin, is_tagged) in [(0.0, false), (1e9, true)] {
            let path = folder.path().join("m.ply");
            let geometry = Geometry { shape: [9; 3], spacing: [0.5; 3], origin: [origin; 3], unit: None };
            let start = if is_tagged { PlyWriter::tagged_on_grid } else { PlyWriter::on_grid };
            let mut writer = start(&path, &geometry).unwrap();
            (0..count).for_each(|n| writer.vertex(position(n)).unwrap());
            let triangles: Vec<[u32; 3]> =
                (0..3000).map(|n| [n * 7 % count, n * 997 % count, count - 1 - n * 13]).collect();
            for &corners in &triangles {
                writer.facet(corners, [corners[0], 7]).unwrap();
            }
            writer.finish().unwrap();
            let mut read = Vec::new();
            each_triangle(&path, &mut |corners, labels| {
                read.push((corners, labels));
                Ok(())
            })
            .unwrap();
            let expected: Vec<_> =
                triangles.iter().map(|&c| (c.map(position), if is_tagged { [c[0], 7] } else { [0; 2] })).collect();
            assert!(read == expected, "{is_tagged}");
            let last = f64::from(count - 1);
            assert_eq!(extent(&path).unwrap(), Some([[0.0, 0.0, -last], [0.5 * last, 999.0, 0.0]]));
        }
    }

    #[test]
    fn other_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.ply");
        let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 0 0\n";
        std::fs::write(&path, text).unwrap();
        assert!(each_triangle(&path, &mut |_, _| Ok(())).unwrap_err().to_string().contains("m.ply"));
        let binary = text.replace("ascii", "binary_little_endian");
        std::fs::write(&path, &binary[..binary.find("0 0 0").unwrap()]).unwrap();
        assert!(each_triangle(&path, &mut |_, _| Ok(())).is_err(), "cut off");
    }
}
