//! The `ImageDescription` that the Python library `tifffile` writes by default: JSON with the `shape` of the array.
//!
//! One page may stand for all planes, whose data then follow each other without gaps ("truncated" there).

use serde::Deserialize;
use serde_json::{Map, Value};

use super::layout::{Axis, Description, Dimensions};
use crate::io::stack::tiff::pages::page::Page;
use crate::io::stack::units;
use crate::io::stack::units::Unit;

#[derive(Deserialize)]
struct Shaped {
    shape: Vec<u64>,
    axes: Option<String>,
    /// What callers add for z, in the words of `ImageJ`; anything may stand here.
    #[serde(default)]
    spacing: Value,
    #[serde(default)]
    unit: Value,
    /// The words of OME-XML, and units to them, for whoever does not write that.
    #[serde(flatten)]
    others: Map<String, Value>,
}

impl Shaped {
    /// Sizes in the words of OME-XML, each with its unit, which is the micrometre where none is named.
    fn physical_sizes(&self) -> [Option<(f64, &str)>; 3] {
        ["X", "Y", "Z"].map(|axis| {
            let size = number(self.others.get(&format!("PhysicalSize{axis}"))?)?;
            let unit = self.others.get(&format!("PhysicalSize{axis}Unit")).and_then(Value::as_str);
            Some((size, unit.unwrap_or("um")))
        })
    }
}

/// A number, or text that is one.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => number.as_f64(),
        Value::String(text) => units::size(text),
        _ => None,
    }
}

/// Whether a page with this description begins an image of its own.
pub(crate) fn is_shaped(text: &str) -> bool {
    text.trim_start().starts_with('{') && serde_json::from_str::<Shaped>(text).is_ok()
}

/// Reads the description; `None` when it is no such JSON or its shape does not end in that of the page. `xy` is the
/// pixel size from the resolution tags, in the unit `tagged` where these name one.
pub(crate) fn parse(text: &str, page: &Page, xy: [Option<f64>; 2], tagged: Option<&str>) -> Option<Description> {
    let shaped: Shaped = serde_json::from_str(text).ok()?;
    let (w, h, s) = (u64::from(page.kind.width), u64::from(page.kind.height), u64::from(page.kind.samples));
    let tail: &[u64] = match (s > 1, page.planar) {
        (true, true) => &[s, h, w],
        (true, false) => &[h, w, s],
        (false, _) => &[h, w],
    };
    let outer = shaped.shape.strip_suffix(tail)?;
    let letters = shaped.axes.clone().filter(|axes| axes.chars().count() == shaped.shape.len());
    let objection = letters.as_deref().and_then(|letters| objection(letters, outer.len(), s > 1));
    let (dimensions, note) = match dimensions(outer, letters.as_deref()) {
        Some(found) => found,
        // The user has to say what they are.
        None if objection.is_some() => (Dimensions::only_z(outer.iter().copied().fold(1, u64::saturating_mul)), None),
        None => return None,
    };
    let mut description = Description {
        dimensions: Some(dimensions),
        single_page: true,
        objection,
        notes: note.into_iter().collect(),
        ..Description::none()
    };
    add_spacing(&shaped, xy, tagged, &mut description);
    Some(description)
}

/// What the description and the tags say of sizes.
fn add_spacing(shaped: &Shaped, xy: [Option<f64>; 2], tagged: Option<&str>, description: &mut Description) {
    let physical = shaped.physical_sizes();
    let z = number(&shaped.spacing);
    let unit = shaped.unit.as_str().unwrap_or_default();
    let named = tagged.unwrap_or(unit);
    let found = if physical != [None; 3] {
        Some(units::spacing(physical))
    } else if z.is_some() || (tagged.is_none() && units::parse(unit) != Unit::Pixel) {
        // One pixel per nothing is what stands there when nobody said anything.
        let [x, y] = xy.map(|size| size.filter(|&s| s != 1.0 || tagged.is_some()));
        let z = z.map(|z| (z, if unit.is_empty() { units::of_bare_size(z, [x, y], named) } else { unit }));
        let mut spacing = units::spacing([x.map(|s| (s, named)), y.map(|s| (s, named)), z]);
        let note = z.and_then(|(z, taken)| units::bare_note(z, named, taken));
        spacing.notes.extend(note.filter(|_| unit.is_empty()));
        Some(spacing)
    } else {
        // The tags are judged as those of a plain file.
        None
    };
    if let Some(spacing) = found {
        (description.spacing, description.unit) = (spacing.sizes, spacing.unit);
        description.notes.extend(spacing.notes);
    }
}

/// Why pages are no planes of rows: the names of the array's axes end in others than y and x.
fn objection(letters: &str, outer: usize, samples: bool) -> Option<String> {
    let inner: String = letters.chars().skip(outer).filter(|&l| !(samples && l == 'S')).collect();
    let before = letters.chars().take(outer).any(|l| matches!(l, 'X' | 'Y'));
    let apart = inner.chars().any(|l| matches!(l, 'Z' | 'C' | 'T')) || inner == "XY";
    (before || apart).then(|| {
        format!(
            "its axes are {letters}, so that its pages are no planes of rows y and columns x; write the array with y and \
             x last, or give --axes to say what the pages are"
        )
    })
}

/// Places the outer dimensions, slowest first: by their letters, or as time, channel, z where there are none.
fn dimensions(outer: &[u64], letters: Option<&str>) -> Option<(Dimensions, Option<String>)> {
    let mut order: Vec<(Axis, u64)> = Vec::new();
    let unnamed = [Axis::Z, Axis::Time, Axis::Channel];
    let long = outer.iter().filter(|&&n| n != 1).count();
    for (place, &size) in outer.iter().enumerate().filter(|&(_, &n)| n != 1) {
        let from_letter = letters.and_then(|l| l.chars().nth(place)).and_then(Axis::from_letter);
        let axis = from_letter.or_else(|| {
            // Slowest first: three are T, C, Z; two are T, Z; one is Z.
            let guess: &[Axis] = match long {
                1 => &[Axis::Z],
                2 => &[Axis::Time, Axis::Z],
                3 => &[Axis::Time, Axis::Channel, Axis::Z],
                _ => &[],
            };
            guess.get(order.len()).copied()
        })?;
        if order.iter().any(|(a, _)| *a == axis) {
            return None;
        }
        order.push((axis, size));
    }
    order.reverse();
    let guessed = long > 1 && letters.is_none();
    for axis in unnamed {
        if order.iter().all(|(a, _)| *a != axis) {
            order.push((axis, 1));
        }
    }
    let note = guessed.then(|| format!("the axes {outer:?} before y and x have no names; the last was taken for z"));
    Some((Dimensions(order.try_into().ok()?), note))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_are_planes_of_rows() {
        for (letters, outer, samples) in [("ZYX", 1, false), ("QQQ", 1, false), ("ZYXS", 1, true), ("TZCYX", 3, false)]
        {
            assert_eq!(objection(letters, outer, samples), None, "{letters}");
        }
        for (letters, outer, samples) in [("YXZ", 1, false), ("XYZ", 1, false), ("ZXY", 1, false), ("YXC", 1, false)] {
            assert!(objection(letters, outer, samples).is_some(), "{letters}");
        }
    }

    #[test]
    fn axes_by_letter_and_by_place() {
        let order = |outer: &[u64], letters| dimensions(outer, letters).map(|(d, _)| d.0);
        assert_eq!(order(&[5], None).map(|o| o[0]), Some((Axis::Z, 5)));
        assert_eq!(order(&[2, 5], None).map(|o| [o[0], o[1]]), Some([(Axis::Z, 5), (Axis::Time, 2)]));
        assert_eq!(order(&[4, 3, 2], Some("ZCTYX")), Some([(Axis::Time, 2), (Axis::Channel, 3), (Axis::Z, 4)]));
        assert_eq!(order(&[1, 7, 1], Some("TZCYX")).map(|o| o[0]), Some((Axis::Z, 7)));
        assert_eq!(order(&[2, 2, 2, 2], None), None);
        assert_eq!(order(&[2, 2], Some("ZZYX")), None);
    }
}
