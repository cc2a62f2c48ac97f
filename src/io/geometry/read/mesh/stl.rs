//! STL (stereolithography, 3D Systems 1989): triangles with corners of their own, binary or text.
//!
//! Binary: 80 bytes of anything, a count, then 50 bytes a triangle: normal and corners as little-endian f32, and two
//! more bytes. Many binary files start with the `solid` of the text form, and numbers may look like anything, so a file
//! is binary when its length is what its count asks for; looks decide only where lengths do not agree (bytes after the
//! last triangle, a count that was never filled in, pipes). Normals are left aside: the order of the corners says what is
//! outside.

use std::io::{ErrorKind, Read};

use super::{first_line, stl_text};
use crate::error::{Error, Result};
use crate::grid::{MOST_SOURCES, TriangleMesh, refuse_too_many};
use crate::io::geometry::read::input::{HEAD, Input};
use crate::io::geometry::read::source::Source;
use crate::io::text::{first_binary_byte, unreadable};

/// Bytes before the first triangle.
const HEADER: usize = 84;

/// Bytes of a triangle.
const RECORD: usize = 50;

/// How other binary files start: TIFF, PNG, NumPy, HDF5, zip, ROIs of ImageJ; gzip is looked for beside them.
const OTHERS: [&[u8]; 8] = [b"II*\0", b"II+\0", b"MM\0", b"\x89PNG", b"\x93NUMPY", b"\x89HDF", b"PK\x03\x04", b"Iout"];

/// True for what starts like an STL file.
pub(crate) fn is_stl(head: &[u8]) -> bool {
    if is_text(head) {
        let Some(line) = first_line(head) else { return first_binary_byte(head).is_some() };
        return line.split_whitespace().next().is_some_and(|word| word.eq_ignore_ascii_case("solid"));
    }
    let is_other = OTHERS.iter().any(|magic| head.starts_with(magic)) || head.starts_with(b"\x1f\x8b");
    let whole = (head.len() < HEAD as usize - 3).then_some(head.len() as u64);
    head.len() >= HEADER && !is_other && (has_binary_length(head, whole) || starts_with_triangle(head))
}

/// True for a file of this length whose length is what the count of a binary file asks for.
///
/// Four bytes of text are a count that asks for more than 20 GB, so that no text is taken for binary.
pub(crate) fn has_binary_length(head: &[u8], length: Option<u64>) -> bool {
    head.len() >= HEADER && length == Some(length_for(declared(head)))
}

/// True for the text form, also with odd bytes in the name of its solid.
fn is_text(head: &[u8]) -> bool {
    let has = |word: &[u8]| head.windows(word.len()).any(|bytes| bytes.eq_ignore_ascii_case(word));
    first_binary_byte(head).is_none()
        || (head.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
            && has(b"outer loop")
            && has(b"vertex"))
}

/// True when the numbers of the first triangle, as far as they are there, look like lengths: none is huge beyond any
/// unit, and some are not tiny. Noise of any size stands for zero in many files.
fn starts_with_triangle(head: &[u8]) -> bool {
    // A normal may be anything, also no number.
    let numbers = head[HEADER..].chunks_exact(4).skip(3).take(9).map(float);
    numbers.clone().all(|x| x.abs() < 1e20) && numbers.clone().any(|x| x.abs() > 1e-20)
}

fn declared(head: &[u8]) -> u32 {
    u32::from_le_bytes([head[80], head[81], head[82], head[83]])
}

fn length_for(count: u32) -> u64 {
    HEADER as u64 + RECORD as u64 * u64::from(count)
}

fn float(bytes: &[u8]) -> f32 {
    f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// Reads a mesh, three vertices of its own for each triangle.
pub(crate) fn read(input: &mut Input) -> Result<Source> {
    let length = input.length;
    let head = input.head()?;
    let corners =
        if !has_binary_length(head, length) && is_text(head) { stl_text::read(input)? } else { read_binary(input)? };
    if corners.is_empty() {
        return Err(Error::input("is STL without a triangle; give a mesh that has some"));
    }
    refuse_too_many("corners", corners.len() as u64)?;
    let triangles = (0..corners.len() as u32).step_by(3).map(|v| [v, v + 1, v + 2]).collect();
    Ok(Source::Mesh(TriangleMesh::new(corners, triangles)?))
}

fn read_binary(input: &mut Input) -> Result<Vec<[f64; 3]>> {
    let mut header = [0; HEADER];
    input.reader.read_exact(&mut header).map_err(|e| cut_off(&e, 0))?;
    let count = counted(declared(&header), input)?;
    if 3 * u64::from(count) > MOST_SOURCES as u64 {
        return Err(Error::input(format!("declares {count} triangles, too many to be numbered; divide the mesh")));
    }
    let mut corners = Vec::new();
    if input.length.is_some() {
        corners.reserve_exact(3 * count as usize);
    }
    let mut record = [0; RECORD];
    for n in 0..count {
        input.reader.read_exact(&mut record).map_err(|e| cut_off(&e, n))?;
        // Three numbers of the normal come first.
        for corner in record[12..48].chunks_exact(12) {
            let position = [0, 4, 8].map(|at| f64::from(float(&corner[at..])));
            if !position.iter().all(|x| x.is_finite()) {
                return Err(Error::input(format!(
                    "triangle {n} (counted from 0, byte {}) has a coordinate that is not finite; delete the triangle",
                    length_for(n)
                )));
            }
            corners.push(position);
        }
    }
    input.note_rest(&format!("the {count} triangles that it declares"))?;
    Ok(corners)
}

/// The number of triangles: that which is declared, or what the length holds where a program never filled it in.
fn counted(declared: u32, input: &mut Input) -> Result<u32> {
    let Some(length) = input.length.filter(|&length| length < length_for(declared) || declared == 0) else {
        return Ok(declared);
    };
    let held = length.saturating_sub(HEADER as u64);
    if matches!(declared, 0 | u32::MAX) && held > 0 && held % RECORD as u64 == 0 {
        let count = held / RECORD as u64;
        input.notes.push(format!("declares {declared} triangles, but has the length of {count}, which are read"));
        return Ok(u32::try_from(count).unwrap_or(u32::MAX));
    }
    if declared == 0 {
        return Ok(0);
    }
    Err(Error::input(format!(
        "is binary STL that declares {declared} triangles, which take {} bytes, but has {length}; the file is cut off, \
         damaged or holds something else",
        length_for(declared)
    )))
}

fn cut_off(error: &std::io::Error, read: u32) -> Error {
    if error.kind() == ErrorKind::UnexpectedEof {
        return Error::input(format!("is binary STL that ends after {read} triangles; the file is cut off or damaged"));
    }
    unreadable(error)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A binary file that declares `count` triangles and goes on with `rest`.
    fn binary(count: u32, rest: &[f32]) -> Vec<u8> {
        let numbers: Vec<u8> = rest.iter().flat_map(|x| x.to_le_bytes()).collect();
        [&[b's'; 80][..], &count.to_le_bytes(), &numbers].concat()
    }

    #[test]
    fn what_starts_an_stl_file() {
        assert!(is_stl(b"solid\n") && is_stl(b"\n SOLID a b\r\nfacet") && is_stl(&binary(0, &[])));
        assert!(is_stl(&binary(1_000_000_000, &[0.0, 0.0, 1.0, 5.0])));
        assert!(is_stl(b"solid a\0\x01\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"));
        assert!(
            !is_stl(&binary(7, &[0.0; 40]))
                && !is_stl(&binary(7, &[1e-39; 40]))
                && !is_stl(&binary(7, &[f32::NAN; 40]))
        );
        // Normals that could not be computed, and corners where noise stands for zero.
        let noisy = [&[f32::NAN; 3][..], &[-6e-33, 1.0, 0.0], &[1e-41; 6]].concat();
        assert!(is_stl(&binary(7, &noisy)));
        let large = [binary(2000, &vec![0.0; 25_000]), vec![7; 16]].concat();
        assert!(has_binary_length(&large, Some(84 + 50 * 2000)) && !has_binary_length(&large, None));
        assert!(!has_binary_length(&large, Some(84 + 50 * 2000 + 1)) && !has_binary_length(b"solid", Some(5)));
        assert!(!is_stl(b"solidus\n") && !is_stl(b"facet\n") && !is_stl(b"\0\0\0") && !is_stl(b""));
        let tiff = [&b"II*\0"[..], &binary(0, &[])].concat();
        assert!(!is_stl(&tiff));
    }
}
