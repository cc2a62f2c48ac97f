//! The `ImageDescription` that the Python library `tifffile` writes by default: JSON with the `shape` of the array.
//!
//! One page may stand for all planes, whose data then follow each other without gaps ("truncated" there).

use serde::Deserialize;

use super::layout::{Axis, Description, Dimensions};
use super::page::Page;

#[derive(Deserialize)]
struct Shaped {
    shape: Vec<u64>,
    axes: Option<String>,
}

/// Reads the description; `None` when it is no such JSON or its shape does not end in that of the page.
pub(super) fn parse(text: &str, page: &Page) -> Option<Description> {
    let shaped: Shaped = serde_json::from_str(text).ok()?;
    let (w, h, s) = (u64::from(page.kind.width), u64::from(page.kind.height), u64::from(page.kind.samples));
    let tail: &[u64] = match (s > 1, page.planar) {
        (true, true) => &[s, h, w],
        (true, false) => &[h, w, s],
        (false, _) => &[h, w],
    };
    let outer = shaped.shape.strip_suffix(tail)?;
    let letters = shaped.axes.filter(|axes| axes.chars().count() == shaped.shape.len());
    let (dimensions, note) = dimensions(outer, letters.as_deref())?;
    Some(Description {
        dimensions: Some(dimensions),
        single_page: true,
        notes: note.into_iter().collect(),
        ..Description::none()
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
