//! Length units: from the spellings of ImageJ and OME-XML to the names of OME-Zarr (UDUNITS-2).

/// OME-Zarr name, metres, and the spellings that mean it. The two micro signs are U+00B5 and U+03BC.
const UNITS: [(&str, f64, &[&str]); 12] = [
    (
        "micrometer",
        1e-6,
        &["um", "\u{b5}m", "\u{3bc}m", "micron", "microns", "micrometre", "micrometers", "micrometres"],
    ),
    ("nanometer", 1e-9, &["nm", "nanometre", "nanometers", "nanometres"]),
    ("millimeter", 1e-3, &["mm", "millimetre", "millimeters", "millimetres"]),
    ("centimeter", 1e-2, &["cm", "centimetre", "centimeters", "centimetres"]),
    ("decimeter", 1e-1, &["dm", "decimetre"]),
    ("meter", 1.0, &["m", "metre", "meters", "metres"]),
    ("kilometer", 1e3, &["km", "kilometre", "kilometers"]),
    ("picometer", 1e-12, &["pm", "picometre", "picometers"]),
    ("angstrom", 1e-10, &["\u{c5}", "\u{212b}", "a", "angstroms"]),
    ("inch", 0.0254, &["in", "inches", "\""]),
    ("foot", 0.3048, &["ft", "feet"]),
    ("yard", 0.9144, &["yd", "yards"]),
];

/// What a spelling of a unit means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::io) enum Unit {
    /// The OME-Zarr name, and how many metres it has.
    Length(&'static str, f64),
    /// Lengths are counted in pixels: no physical unit.
    Pixel,
    /// A spelling that means nothing here.
    Unknown,
}

/// Finds the unit; upper and lower case count as one except where they tell `mm` from `Mm`.
pub(in crate::io) fn parse(text: &str) -> Unit {
    let text = text.trim().replace("\\u00B5", "\u{b5}").replace("\\u00b5", "\u{b5}").replace("\\u03BC", "\u{3bc}");
    let lower = text.to_lowercase();
    if ["", "pixel", "pixels", "pix", "px", "voxel", "voxels", "none", "null"].contains(&lower.as_str()) {
        return Unit::Pixel;
    }
    // Short symbols are told apart by case (mm, Mm); words are not. Lower-casing the Kelvin and Angstrom signs is fine.
    let spelled =
        |s: &str| s == text || (s.chars().count() > 2 && s == lower) || (s == lower && s.len() > s.chars().count());
    UNITS
        .iter()
        .find(|(name, _, spellings)| *name == lower || spellings.iter().any(|s| spelled(s)))
        .map_or(Unit::Unknown, |&(name, metres, _)| Unit::Length(name, metres))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling_of_the_micrometre_is_one() {
        for text in ["um", "\u{b5}m", "\u{3bc}m", "\\u00B5m", "micron", "Micron", " microns ", "micrometer", "\u{39c}m"]
        {
            assert_eq!(parse(text), Unit::Length("micrometer", 1e-6), "{text}");
        }
    }

    #[test]
    fn case_tells_milli_from_mega_and_pixels_are_no_length() {
        assert_eq!(parse("mm"), Unit::Length("millimeter", 1e-3));
        assert_eq!(parse("Mm"), Unit::Unknown);
        assert_eq!(parse("Pixel"), Unit::Pixel);
        assert_eq!(parse(""), Unit::Pixel);
        assert_eq!(parse("\u{c5}"), Unit::Length("angstrom", 1e-10));
        assert_eq!(parse("reference frame"), Unit::Unknown);
    }
}
