//! The OME-XML of a volume (OME model 2016-06): how large it is, what its voxels are, how far apart and in which unit.

use super::body::VolumeSpec;
use crate::store::ElementType;

/// The document for the first page of a file with one page for each plane.
pub(super) fn document(spec: &VolumeSpec<'_>) -> String {
    let [x, y, z] = spec.geometry.shape;
    let name = escaped(spec.name);
    let size = |axis: usize, letter: char| {
        let (spacing, unit) = (spec.geometry.spacing[axis], symbol(spec.geometry.unit.as_deref()));
        if spec.guessed[axis] {
            return String::new();
        }
        format!(" PhysicalSize{letter}=\"{spacing}\" PhysicalSize{letter}Unit=\"{unit}\"")
    };
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\
         <OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\" \
         xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
         xsi:schemaLocation=\"http://www.openmicroscopy.org/Schemas/OME/2016-06 \
         http://www.openmicroscopy.org/Schemas/OME/2016-06/ome.xsd\" Creator=\"strandline {}\">\
         <Image ID=\"Image:0\" Name=\"{name}\">\
         <Pixels ID=\"Pixels:0\" DimensionOrder=\"XYZCT\" Type=\"{}\" BigEndian=\"false\" \
         SizeX=\"{x}\" SizeY=\"{y}\" SizeZ=\"{z}\" SizeC=\"1\" SizeT=\"1\"{}{}{}>\
         <Channel ID=\"Channel:0:0\" SamplesPerPixel=\"1\"/>\
         <TiffData IFD=\"0\" PlaneCount=\"{z}\"/>\
         </Pixels></Image></OME>",
        env!("CARGO_PKG_VERSION"),
        type_name(spec.element),
        size(0, 'X'),
        size(1, 'Y'),
        size(2, 'Z'),
    )
}

/// A text as it may stand in an attribute.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::new();
    for letter in text.chars().filter(|letter| !letter.is_control()) {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            other => out.push(other),
        }
    }
    out
}

/// The unit as OME-XML spells it. Without one lengths are numbers that only compare: left out, it would be the micrometre.
fn symbol(unit: Option<&str>) -> &str {
    match unit {
        Some("micrometer") => "\u{b5}m",
        Some("nanometer") => "nm",
        Some("millimeter") => "mm",
        Some("centimeter") => "cm",
        Some("decimeter") => "dm",
        Some("meter") => "m",
        Some("kilometer") => "km",
        Some("picometer") => "pm",
        Some("angstrom") => "\u{c5}",
        Some("inch") => "in",
        Some("foot") => "ft",
        Some("yard") => "yd",
        _ => "reference frame",
    }
}

fn type_name(element: ElementType) -> &'static str {
    match element {
        ElementType::F16 | ElementType::F32 => "float",
        ElementType::F64 => "double",
        whole => whole.name(),
    }
}
