//! VTP, VTK's XML `PolyData` (file format 1.0), its arrays appended raw: points as Float32 or Float64, connectivity and offsets as
//! Int64, the two labels of each triangle, where it has any, as `UInt32`; each array preceded by its length in bytes;
//! little-endian.

use std::io::{self, Write};

use super::written::Written;

pub(crate) fn write(mesh: &mut Written, out: &mut dyn Write) -> io::Result<()> {
    let (vertices, triangles) = (mesh.vertices, mesh.triangles);
    let (points, connectivity, offsets) =
        (12 * vertices * (1 + u64::from(mesh.is_double)), 24 * triangles, 8 * triangles);
    let at = [0, 8 + points, 16 + points + connectivity, 24 + points + connectivity + offsets];
    let array = |what: &str, at: u64| format!("<DataArray {what} format=\"appended\" offset=\"{at}\"/>");
    let (is_double, number) = (mesh.is_double, if mesh.is_double { "Float64" } else { "Float32" });
    let labels = if mesh.is_tagged {
        let labels = array("type=\"UInt32\" Name=\"labels\" NumberOfComponents=\"2\"", at[3]);
        format!("<CellData>{labels}</CellData>")
    } else {
        String::new()
    };
    let header = [
        "<?xml version=\"1.0\"?>".into(),
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">".into(),
        "<PolyData>".into(),
        format!("<Piece NumberOfPoints=\"{vertices}\" NumberOfPolys=\"{triangles}\">"),
        format!("<Points>{}</Points>", array(&format!("type=\"{number}\" NumberOfComponents=\"3\""), at[0])),
        format!(
            "<Polys>{}{}</Polys>",
            array("type=\"Int64\" Name=\"connectivity\"", at[1]),
            array("type=\"Int64\" Name=\"offsets\"", at[2])
        ),
        labels,
        "</Piece></PolyData>".into(),
        "<AppendedData encoding=\"raw\">\n_".into(),
    ];
    out.write_all(header.join("\n").as_bytes())?;
    out.write_all(&points.to_le_bytes())?;
    mesh.each_vertex(|position| {
        if is_double {
            return out.write_all(position.map(f64::to_le_bytes).as_flattened());
        }
        out.write_all(position.map(|v| (v as f32).to_le_bytes()).as_flattened())
    })?;
    out.write_all(&connectivity.to_le_bytes())?;
    mesh.each_triangle(|corners| corners.iter().try_for_each(|&v| out.write_all(&i64::from(v).to_le_bytes())))?;
    out.write_all(&offsets.to_le_bytes())?;
    (1..=triangles).try_for_each(|n| out.write_all(&(3 * n).to_le_bytes()))?;
    if mesh.is_tagged {
        out.write_all(&(8 * triangles).to_le_bytes())?;
        mesh.each_facet(|_, labels| labels.iter().try_for_each(|label| out.write_all(&label.to_le_bytes())))?;
    }
    out.write_all(b"\n</AppendedData></VTKFile>\n")
}
