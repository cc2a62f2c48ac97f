//! Units in the headers of tables: lengths by their usual spellings, and the words that mean voxels.

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LengthUnit {
    /// Its name, as OME-Zarr spells it.
    pub name: &'static str,
    /// How many metres it has.
    pub metres: f64,
}

/// Name, metres, and spellings in lower case. The two micro signs are U+00B5 and U+03BC.
const LENGTHS: [(&str, f64, &[&str]); 7] = [
    (
        "micrometer",
        1e-6,
        &["um", "\u{b5}m", "\u{3bc}m", "micron", "microns", "micrometers", "micrometre", "micrometres"],
    ),
    ("nanometer", 1e-9, &["nm", "nanometers", "nanometre", "nanometres"]),
    ("millimeter", 1e-3, &["mm", "millimeters", "millimetre", "millimetres"]),
    ("centimeter", 1e-2, &["cm", "centimeters", "centimetre", "centimetres"]),
    ("angstrom", 1e-10, &["\u{e5}", "angstroms"]),
    ("meter", 1.0, &["m", "meters", "metre", "metres"]),
    ("inch", 0.0254, &["in", "inches"]),
];

const VOXELS: [&str; 12] =
    ["px", "pix", "pixel", "pixels", "vx", "vox", "voxel", "voxels", "voxelindex", "index", "idx", "indices"];

/// What a word in a header says of its column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unit {
    Length(LengthUnit),
    Voxels,
}

impl Unit {
    /// The unit of that spelling, upper and lower case as one; none where it is no unit.
    pub(crate) fn of(text: &str) -> Option<Self> {
        let text = mended(text.trim().trim_matches(['(', ')', '[', ']'])).to_lowercase();
        if VOXELS.contains(&text.as_str()) {
            return Some(Self::Voxels);
        }
        LengthUnit::named(&text).map(Self::Length)
    }
}

impl LengthUnit {
    /// The unit of that name or spelling in lower case.
    #[must_use]
    pub fn named(text: &str) -> Option<Self> {
        let found = LENGTHS.iter().find(|(name, _, spellings)| *name == text || spellings.contains(&text))?;
        Some(Self { name: found.0, metres: found.1 })
    }

    /// How many of another unit this one has.
    #[must_use]
    pub fn in_units_of(self, other: Self) -> f64 {
        // Most units are whole multiples of each other, which their metres are up to rounding.
        let ratio = |large: f64, small: f64| {
            let ratio = large / small;
            if (ratio - ratio.round()).abs() < 1e-9 * ratio { ratio.round() } else { ratio }
        };
        if self.metres < other.metres {
            1.0 / ratio(other.metres, self.metres)
        } else {
            ratio(self.metres, other.metres)
        }
    }
}

/// The micro sign as it was meant: of a text in Latin-1 only a replacement character is left, of UTF-8 that was read as
/// Latin-1 two characters.
pub(crate) fn mended(text: &str) -> String {
    text.replace("\u{fffd}m", "um").replace("\u{c2}\u{b5}", "\u{b5}").replace("\u{ce}\u{bc}", "\u{3bc}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings() {
        for text in ["um", "(\u{b5}m)", "[\u{3bc}m]", "Micron", "(micron)", "\u{c2}\u{b5}m", "\u{fffd}m", "micrometer"]
        {
            let Some(Unit::Length(unit)) = Unit::of(text) else { panic!("{text}") };
            assert_eq!((unit.name, unit.metres), ("micrometer", 1e-6), "{text}");
        }
        assert_eq!(Unit::of(" Pixels "), Some(Unit::Voxels));
        assert_eq!(Unit::of("sec"), None);
    }
}
