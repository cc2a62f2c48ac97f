//! Length units: from the spellings of ImageJ and OME-XML to the names of OME-Zarr (UDUNITS-2).

/// OME-Zarr name, metres, and the spellings that mean it. The two micro signs are U+00B5 and U+03BC.
const UNITS: [(&str, f64, &[&str]); 12] = [
    (
        "micrometer",
        1e-6,
        &[
            "um",
            "uM",
            "Um",
            "UM",
            "\u{b5}m",
            "\u{3bc}m",
            "\u{b5}",
            "\u{3bc}",
            "micron",
            "microns",
            "micrometre",
            "micrometers",
            "micrometres",
        ],
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

/// Metres of a micrometre.
pub(crate) const MICROMETRE: f64 = 1e-6;

/// What a spelling of a unit means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unit {
    /// The OME-Zarr name, and how many metres it has.
    Length(&'static str, f64),
    /// Lengths are counted in pixels: no physical unit.
    Pixel,
    /// A spelling that means nothing here.
    Unknown,
}

/// Finds the unit; upper and lower case count as one except where they tell `mm` from `Mm`.
pub(crate) fn parse(text: &str) -> Unit {
    let text = readable(text);
    let lower = text.to_lowercase();
    let pixels = ["", "pixel", "pixels", "pix", "px", "voxel", "voxels", "none", "null", "reference frame"];
    if pixels.contains(&lower.as_str()) {
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

/// A unit as it was meant: escapes as ImageJ and HTML write them are undone, and UTF-8 that was read as Latin-1, once
/// or several times.
fn readable(text: &str) -> String {
    let mut text = unescaped(text.trim().trim_matches(['\'', '(', ')', '[', ']']).trim());
    for entity in ["&micro;", "&#181;", "&#xB5;", "&#xb5;", "&mu;", "&#956;"] {
        text = text.replace(entity, "\u{b5}");
    }
    for _ in 0..4 {
        let Some(bytes) = text.chars().map(latin).collect::<Option<Vec<u8>>>() else { break };
        match String::from_utf8(bytes) {
            Ok(once) if once != text => text = once,
            _ => break,
        }
    }
    text.trim().to_string()
}

/// Undoes `\u00B5`, the backslash once or several times.
fn unescaped(text: &str) -> String {
    let mut parts = text.split("\\u");
    let mut out = parts.next().unwrap_or_default().trim_end_matches('\\').to_string();
    for part in parts {
        let code = part.get(..4).and_then(|hex| u32::from_str_radix(hex, 16).ok()).and_then(char::from_u32);
        match code {
            Some(letter) => {
                out.push(letter);
                out.push_str(part[4..].trim_end_matches('\\'));
            }
            None => out.push_str(part),
        }
    }
    out
}

/// The byte that Latin-1, or Windows' form of it, shows as a letter.
fn latin(letter: char) -> Option<u8> {
    match letter {
        '\u{201a}' => Some(0x82),
        '\u{192}' => Some(0x83),
        '\u{2026}' => Some(0x85),
        '\u{160}' => Some(0x8a),
        '\u{17d}' => Some(0x8e),
        '\u{152}' => Some(0x8c),
        '\u{17e}' => Some(0x9e),
        '\u{178}' => Some(0x9f),
        _ => u8::try_from(u32::from(letter)).ok(),
    }
}

/// A size as written: with a decimal point, or a comma in its place.
pub(crate) fn size(text: &str) -> Option<f64> {
    let text = text.trim();
    let value =
        text.parse::<f64>().or_else(|e| if text.contains('.') { Err(e) } else { text.replacen(',', ".", 1).parse() });
    value.ok()
}

/// The spacing of voxels in one unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Spacing {
    /// Along x, y, z, where it is known.
    pub(crate) sizes: [Option<f64>; 3],
    /// The unit as OME-Zarr spells it.
    pub(crate) unit: Option<String>,
    /// What could not be kept as it was written.
    pub(crate) notes: Vec<String>,
}

/// Voxels are not so many times as long as wide, or the other way round.
const LONGEST: f64 = 100.0;

/// The unit of a size along z that names none, beside those of x and y in a unit that the tags of a file name: the same,
/// but for a size that only micrometres, in which microscopes count, bring anywhere near them.
pub(crate) fn of_bare_size(z: f64, xy: [Option<f64>; 2], unit: &str) -> &str {
    let (Unit::Length(_, metres), Some(across)) = (parse(unit), xy[0].or(xy[1])) else { return unit };
    let is_near = |one: f64| {
        let ratio = (z * one / (across * metres)).abs();
        (1.0 / LONGEST..=LONGEST).contains(&ratio)
    };
    if !is_near(metres) && is_near(MICROMETRE) { "micrometer" } else { unit }
}

/// What is to be told where [`of_bare_size`] took another unit.
pub(crate) fn bare_note(z: f64, unit: &str, taken: &str) -> Option<String> {
    (taken != unit).then(|| {
        format!(
            "the z size of {z} names no unit, and in {unit} would be nothing like those of x and y: {taken} is taken"
        )
    })
}

/// Sizes along x, y, z with the unit of each, all in the unit of the first that has a physical one. What is in no
/// physical unit, all axes alike, keeps its numbers: their ratios hold.
pub(crate) fn spacing(written: [Option<(f64, &str)>; 3]) -> Spacing {
    let mut spacing = Spacing::default();
    let mut named: Option<(&'static str, f64)> = None;
    let known = written.iter().flatten().map(|(_, unit)| parse(unit)).find(|unit| matches!(unit, Unit::Length(..)));
    let first = written.iter().flatten().map(|&(_, unit)| unit).next().unwrap_or_default();
    for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
        let Some((size, text)) = written[axis] else { continue };
        if !size.is_finite() || size == 0.0 {
            spacing.notes.push(format!("the {letter} size of {size} is no length and was left out"));
            continue;
        }
        if size < 0.0 {
            spacing.notes.push(format!("the {letter} size is {size}; it was taken without its sign"));
        }
        let size = size.abs();
        match (parse(text), known) {
            (Unit::Length(name, metres), _) => {
                let (_, one) = *named.get_or_insert((name, metres));
                // A quotient of equal numbers is exactly 1, so the common case keeps the stored digits.
                spacing.sizes[axis] = Some(size * (metres / one));
            }
            (Unit::Pixel | Unit::Unknown, Some(_)) => spacing.notes.push(format!(
                "the {letter} size is in \"{text}\", which is no length that is known, and was left out"
            )),
            (Unit::Pixel | Unit::Unknown, None) if readable(text) == readable(first) => {
                spacing.sizes[axis] = Some(size);
            }
            (Unit::Pixel | Unit::Unknown, None) => spacing
                .notes
                .push(format!("the {letter} size is in \"{text}\", another unit than \"{first}\", and was left out")),
        }
    }
    if known.is_none() && parse(first) == Unit::Unknown {
        spacing.notes.push(format!("the unit \"{first}\" is not known; lengths keep their numbers"));
    }
    spacing.unit = named.map(|(name, _)| name.to_string());
    spacing
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling_of_the_micrometre_is_one() {
        for text in [
            "um",
            "\u{b5}m",
            "\u{3bc}m",
            "\\u00B5m",
            "\\\\u00b5m",
            "\\u03bcm",
            "micron",
            "Micron",
            " microns ",
            "micrometer",
            "\u{39c}m",
            "\u{c2}\u{b5}m",
            "\u{ce}\u{bc}m",
            "\u{c3}\u{201a}\u{c2}\u{b5}m",
            "&micro;m",
            "(um)",
            "\u{b5}",
            "UM",
            "MICROMETER",
        ] {
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
        assert_eq!(parse("\u{c3}\u{2026}"), Unit::Length("angstrom", 1e-10));
        assert_eq!(parse("furlong"), Unit::Unknown);
        assert_eq!(parse("\\u12"), Unit::Unknown);
    }

    #[test]
    fn a_size_without_a_unit_is_in_that_of_the_others_or_in_micrometres() {
        let half = [Some(0.5e-4), None];
        assert_eq!(of_bare_size(1.5, half, "cm"), "micrometer");
        assert_eq!(of_bare_size(1.5e-4, half, "cm"), "cm");
        // Neither is anything like it.
        assert_eq!(of_bare_size(1e9, half, "cm"), "cm");
        assert_eq!(of_bare_size(1.5, [Some(0.5), None], "cm"), "cm");
        assert_eq!(of_bare_size(1.5, [None, None], "cm"), "cm");
    }

    #[test]
    fn sizes_come_in_one_unit_or_keep_their_ratios() {
        let of = |z: f64, unit, zunit| spacing([Some((0.5, unit)), Some((0.5, unit)), Some((z, zunit))]);
        let found = of(500.0, "um", "nm");
        assert_eq!((found.unit.as_deref(), found.notes.len()), (Some("micrometer"), 0));
        assert!((found.sizes[2].unwrap() - 0.5).abs() < 1e-12);
        let found = of(-2.0, "blob", "blob");
        assert_eq!((found.sizes, found.unit), ([Some(0.5), Some(0.5), Some(2.0)], None));
        assert!(found.notes.len() == 2 && found.notes[1].contains("\"blob\""));
        assert_eq!(of(2.0, "um", "blob").sizes, [Some(0.5), Some(0.5), None]);
        assert_eq!(of(2.0, "blob", "blub").sizes, [Some(0.5), Some(0.5), None]);
        let found = of(2.0, "pixel", "pixel");
        assert_eq!((found.sizes[2], found.unit, found.notes.len()), (Some(2.0), None, 0));
        assert_eq!(of(f64::NAN, "um", "um").sizes[2], None);
        assert_eq!((size("0,5"), size(" 2e-1 "), size("1,000.5"), size("a")), (Some(0.5), Some(0.2), None, None));
    }
}
