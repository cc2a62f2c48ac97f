//! STL (3D Systems, 1988), binary: 80 bytes, the number of facets, then for each its normal, its corners and two bytes.
//! A facet holds positions, so the vertices are kept in memory: 12 bytes each. They are f32: of a mesh far from zero those
//! seen from an anchor, which the first 80 bytes name.

use std::io::{self, Write};

use super::written::Written;

pub(crate) fn write(mesh: &mut Written, anchor: [f64; 3], out: &mut dyn Write) -> io::Result<()> {
    let count = u32::try_from(mesh.triangles)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidInput, "STL holds fewer than 2^32 triangles; choose PLY"))?;
    let mut positions = Vec::new();
    mesh.each_vertex(|position| {
        positions.push(std::array::from_fn(|a| (position[a] - anchor[a]) as f32));
        Ok(())
    })?;
    // Must not begin with "solid", which would make it text.
    let mut head = [b' '; 80];
    let [x, y, z] = anchor;
    let text = if anchor == [0.0; 3] { "binary STL surface".into() } else { format!("binary STL from {x},{y},{z}") };
    head.iter_mut().zip(text.bytes()).for_each(|(place, byte)| *place = byte);
    out.write_all(&head)?;
    out.write_all(&count.to_le_bytes())?;
    mesh.each_triangle(|corners| {
        let corners = corners.map(|v| positions[v as usize]);
        for vector in [normal(corners)].iter().chain(&corners) {
            vector.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))?;
        }
        out.write_all(&[0; 2])
    })
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
