//! VTI, VTK's XML `ImageData` (file format 1.0), its one array appended raw, preceded by its length in bytes as `UInt64`;
//! little-endian. Voxels are points, the first of them at `Origin`.

use std::fs::File;
use std::io::{self, BufWriter, Write};

use flate2::Crc;

use super::body::{Body, Layout, Packed, VolumeSpec};
use crate::store::ElementType;

struct Vti(BufWriter<File>);

pub(super) fn start(file: File, spec: &VolumeSpec<'_>, layout: Layout) -> io::Result<Box<dyn Body>> {
    let mut file = BufWriter::new(file);
    file.write_all(header(spec).as_bytes())?;
    file.write_all(&layout.bytes().to_le_bytes())?;
    Ok(Box::new(Vti(file)))
}

impl Body for Vti {
    fn pack(&self, bytes: Vec<u8>, _is_last: bool) -> io::Result<Packed> {
        Ok(Packed { bytes, crc: Crc::new() })
    }

    fn append(&mut self, packed: Packed) -> io::Result<()> {
        self.0.write_all(&packed.bytes)
    }

    fn complete(mut self: Box<Self>) -> io::Result<()> {
        self.0.write_all(b"\n</AppendedData></VTKFile>\n")?;
        self.0.flush()
    }
}

fn header(spec: &VolumeSpec<'_>) -> String {
    let geometry = spec.geometry;
    let [x, y, z] = geometry.shape.map(|n| n - 1);
    let extent = format!("0 {x} 0 {y} 0 {z}");
    let triple = |[x, y, z]: [f64; 3]| format!("{x} {y} {z}");
    let name = super::ome_xml::escaped(spec.name);
    // A text is the codes of its letters, and a zero.
    let codes = |text: &str| text.bytes().chain([0]).map(|code| code.to_string()).collect::<Vec<_>>().join(" ");
    let unit = geometry.unit.as_deref().map_or(String::new(), |unit| {
        format!(
            "<FieldData><Array type=\"String\" Name=\"LengthUnit\" NumberOfTuples=\"1\" format=\"ascii\">{}</Array></FieldData>\n",
            codes(unit)
        )
    });
    format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <ImageData WholeExtent=\"{extent}\" Origin=\"{}\" Spacing=\"{}\">\n\
         {unit}<Piece Extent=\"{extent}\">\n\
         <PointData Scalars=\"{name}\">\n\
         <DataArray type=\"{}\" Name=\"{name}\" format=\"appended\" offset=\"0\"/>\n\
         </PointData>\n\
         </Piece>\n\
         </ImageData>\n\
         <AppendedData encoding=\"raw\">\n_",
        triple(geometry.origin),
        triple(geometry.spacing),
        type_name(spec.element),
    )
}

fn type_name(element: ElementType) -> &'static str {
    match element {
        ElementType::U8 => "UInt8",
        ElementType::U16 => "UInt16",
        ElementType::U32 => "UInt32",
        ElementType::I8 => "Int8",
        ElementType::I16 => "Int16",
        ElementType::I32 => "Int32",
        ElementType::F16 | ElementType::F32 => "Float32",
        ElementType::F64 => "Float64",
    }
}
