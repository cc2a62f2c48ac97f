//! VTP, VTK's XML `PolyData` (file format 1.0), its arrays appended raw: points as Float32 or Float64, connectivity and offsets as
//! Int64, the two labels of each triangle, where it has any, as `UInt32`, a number of each vertex, where one is told, as Float32;
//! each array preceded by its length in bytes; little-endian. Before the arrays stands where each of them begins, so all of them wait for the end.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use super::body::{BUFFER, Body, Form};
use super::spool::Spool;
use super::temporary::Temporary;

struct Vtp {
    file: File,
    points: BufWriter<Temporary>,
    vertices: u64,
    triangles: Spool,
    /// Numbers of vertices, and their name.
    values: Option<(&'static str, BufWriter<Temporary>)>,
    form: Form,
}

pub(super) fn start(file: File, folder: &Path, form: &Form) -> io::Result<Box<dyn Body>> {
    let points = BufWriter::with_capacity(BUFFER, Temporary::new(folder)?);
    let triangles = Spool::new(folder, form.is_tagged)?;
    Ok(Box::new(Vtp { file, points, vertices: 0, triangles, values: None, form: form.clone() }))
}

impl Body for Vtp {
    fn carry(&mut self, name: &'static str, temporary: &Path) -> io::Result<()> {
        self.values = Some((name, BufWriter::with_capacity(BUFFER, Temporary::new(temporary)?)));
        Ok(())
    }

    fn value(&mut self, value: f64) -> io::Result<()> {
        self.values.as_mut().map_or(Ok(()), |(_, values)| values.write_all(&(value as f32).to_le_bytes()))
    }

    fn vertex(&mut self, position: [f64; 3]) -> io::Result<()> {
        self.vertices += 1;
        if self.form.is_double {
            return self.points.write_all(position.map(f64::to_le_bytes).as_flattened());
        }
        self.points.write_all(position.map(|v| (v as f32).to_le_bytes()).as_flattened())
    }

    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> io::Result<()> {
        self.triangles.push(corners, labels)
    }

    fn complete(self: Box<Self>) -> io::Result<()> {
        let Self { mut file, points, vertices, triangles, values, form } = *self;
        let (mut points, mut triangles) =
            (points.into_inner().map_err(io::IntoInnerError::into_error)?, triangles.finish()?);
        let count = triangles.count;
        let lengths = lengths(&form, vertices, count);
        let name = values.as_ref().map(|(name, _)| *name);
        file.write_all(header(&form, name, vertices, count).as_bytes())?;
        file.write_all(&lengths[0].to_le_bytes())?;
        points.seek(SeekFrom::Start(0))?;
        io::copy(&mut points, &mut file)?;
        let mut out = BufWriter::with_capacity(BUFFER, file);
        out.write_all(&lengths[1].to_le_bytes())?;
        triangles.each(|corners, _| corners.iter().try_for_each(|&v| out.write_all(&i64::from(v).to_le_bytes())))?;
        out.write_all(&lengths[2].to_le_bytes())?;
        (1..=count).try_for_each(|n| out.write_all(&(3 * n).to_le_bytes()))?;
        if form.is_tagged {
            out.write_all(&(8 * count).to_le_bytes())?;
            triangles.each(|_, labels| out.write_all(labels.map(u32::to_le_bytes).as_flattened()))?;
        }
        if let Some((_, values)) = values {
            let mut values = values.into_inner().map_err(io::IntoInnerError::into_error)?;
            values.seek(SeekFrom::Start(0))?;
            out.write_all(&(4 * vertices).to_le_bytes())?;
            io::copy(&mut values, &mut out)?;
        }
        out.write_all(b"\n</AppendedData></VTKFile>\n")?;
        out.flush()
    }
}

/// Bytes of points, connectivity and offsets.
fn lengths(form: &Form, vertices: u64, triangles: u64) -> [u64; 3] {
    [12 * vertices * (1 + u64::from(form.is_double)), 24 * triangles, 8 * triangles]
}

fn header(form: &Form, values: Option<&str>, vertices: u64, triangles: u64) -> String {
    let [points, connectivity, offsets] = lengths(form, vertices, triangles);
    let labels_at = 24 + points + connectivity + offsets;
    let values_at = labels_at + if form.is_tagged { 8 + 8 * triangles } else { 0 };
    let at = [0, 8 + points, 16 + points + connectivity, labels_at];
    let array = |what: &str, at: u64| format!("<DataArray {what} format=\"appended\" offset=\"{at}\"/>");
    let number = if form.is_double { "Float64" } else { "Float32" };
    let labels = if form.is_tagged {
        let labels = array("type=\"UInt32\" Name=\"labels\" NumberOfComponents=\"2\"", at[3]);
        format!("<CellData>{labels}</CellData>")
    } else {
        String::new()
    };
    let values = values.map_or(String::new(), |name| {
        let array = array(&format!("type=\"Float32\" Name=\"{name}\""), values_at);
        format!("<PointData Scalars=\"{name}\">{array}</PointData>")
    });
    let lines = [
        "<?xml version=\"1.0\"?>".into(),
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">".into(),
        "<PolyData>".into(),
        format!("<Piece NumberOfPoints=\"{vertices}\" NumberOfPolys=\"{triangles}\">"),
        values,
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
    lines.join("\n")
}
