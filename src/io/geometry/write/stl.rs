//! STL (3D Systems, 1988), binary: 80 bytes, the number of facets, then for each its normal, its corners and two bytes.
//! Facets are written as they come, the number of them at the end. Positions are f32: of a mesh far from zero those seen
//! from an anchor, which the first 80 bytes name.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use super::body::{BUFFER, Body, Form};
use super::places::Places;

const HEAD: usize = 80;

struct Stl {
    file: BufWriter<File>,
    places: Places,
    is_double: bool,
    anchor: [f64; 3],
    facets: u32,
}

pub(super) fn start(file: File, folder: &Path, form: &Form) -> io::Result<Box<dyn Body>> {
    let mut file = BufWriter::with_capacity(BUFFER, file);
    file.write_all(&[0; HEAD + 4])?;
    let &Form { is_double, anchor, .. } = form;
    Ok(Box::new(Stl { file, places: Places::new(folder), is_double, anchor, facets: 0 }))
}

impl Body for Stl {
    fn anchor(&mut self, anchor: [f64; 3]) {
        self.anchor = anchor;
    }

    fn vertex(&mut self, position: [f64; 3]) -> io::Result<()> {
        // Of a mesh whose positions are those of f32, these are seen from the anchor.
        let position = if self.is_double { position } else { position.map(|v| f64::from(v as f32)) };
        self.places.push(std::array::from_fn(|a| (position[a] - self.anchor[a]) as f32))
    }

    fn facet(&mut self, corners: [u32; 3], _labels: [u32; 2]) -> io::Result<()> {
        let too_many =
            || io::Error::new(io::ErrorKind::InvalidInput, "STL holds fewer than 2^32 triangles; choose PLY");
        self.facets = self.facets.checked_add(1).ok_or_else(too_many)?;
        let mut vectors = [[0.0; 3]; 4];
        for (place, corner) in vectors[1..].iter_mut().zip(corners) {
            *place = self.places.get(corner)?;
        }
        vectors[0] = normal([vectors[1], vectors[2], vectors[3]]);
        let mut bytes = [0; 50];
        for (place, value) in bytes.chunks_exact_mut(4).zip(vectors.as_flattened()) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        self.file.write_all(&bytes)
    }

    fn complete(self: Box<Self>) -> io::Result<()> {
        let mut file = self.file.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.seek(SeekFrom::Start(0))?;
        file.write_all(&head(self.anchor))?;
        file.write_all(&self.facets.to_le_bytes())
    }
}

fn head(anchor: [f64; 3]) -> [u8; HEAD] {
    // Must not begin with "solid", which would make it text.
    let mut head = [b' '; HEAD];
    let [x, y, z] = anchor;
    let text = if anchor == [0.0; 3] { "binary STL surface".into() } else { format!("binary STL from {x},{y},{z}") };
    head.iter_mut().zip(text.bytes()).for_each(|(place, byte)| *place = byte);
    head
}

/// The unit normal, counter-clockwise corners seen from outside; zero for a triangle without area.
fn normal(corners: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let side = |to: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| to[i] - a[i]) };
    let ([ux, uy, uz], [vx, vy, vz]) = (side(b), side(c));
    let normal = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    let length = normal.iter().map(|v| v * v).sum::<f64>().sqrt();
    normal.map(|v| if length > 0.0 { (v / length) as f32 } else { 0.0 })
}
