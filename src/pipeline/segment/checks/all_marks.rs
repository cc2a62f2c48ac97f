//! A look at the marks of all objects before anything is solved: which fit the image, and what is odd about them.

use super::doubts::{doubts, open_outlines, spans_slices};
use super::lengths::{Grids, check_marks};
use crate::error::Error;
use crate::pipeline::marks::ObjectMarks;
use crate::pipeline::segment::object_report::Refused;
use crate::pipeline::segment::outlined::outlines::crossed;

/// What was seen.
#[derive(Debug, Default)]
pub struct CheckedMarks {
    /// The objects whose marks can be those of the image.
    pub fit: Vec<ObjectMarks>,
    /// Those whose marks cannot.
    pub refused: Vec<Refused>,
    /// The first of these, and why.
    pub first_error: Option<(u32, Error)>,
}

/// Outlines that a note names, at most.
const MOST_NAMED: usize = 8;

/// Checks the marks of each object; `note` hears what is odd about them. Of those numbered in `unsure` nobody said whether
/// their marks count voxels.
#[must_use]
pub fn check_all_marks(marked: &[ObjectMarks], grids: &Grids<'_>, unsure: &[u32], note: &dyn Fn(&str)) -> CheckedMarks {
    let mut checked = CheckedMarks::default();
    for object in marked {
        let label = object.object;
        match check_marks(object, grids) {
            Ok(notes) => {
                let doubts = if unsure.contains(&label) { doubts(object, grids.whole) } else { Vec::new() };
                notes.iter().chain(&doubts).for_each(|text| note(text));
                checked.fit.push(object.clone());
            }
            Err(error) => {
                checked.refused.push(Refused { label, reason: error.to_string() });
                checked.first_error.get_or_insert((label, error));
            }
        }
        note_outlines(object, grids, note);
    }
    checked
}

/// Says what is odd about the outlines of an object.
fn note_outlines(object: &ObjectMarks, grids: &Grids<'_>, note: &dyn Fn(&str)) {
    let label = object.object;
    for number in crossed(object, grids.part) {
        note(&format!("outline {number} of object {label} crosses itself: are its marks in order?"));
    }
    if object.drawn && object.contours.len() == 1 {
        note(&format!(
            "object {label} has one outline: how far it goes on beyond it is guessed; mark it on more slices"
        ));
    }
    let open = open_outlines(object);
    if !open.is_empty() {
        let numbers: Vec<String> = open.iter().take(MOST_NAMED).map(i64::to_string).collect();
        let more = if open.len() > MOST_NAMED { ", ..." } else { "" };
        note(&format!(
            "outlines of object {label} are open ({}{more}): their ends, far from each other, are joined by a straight line",
            numbers.join(", ")
        ));
    }
    for (number, slices) in spans_slices(object, grids.whole) {
        note(&format!(
            "outline {number} of object {label} has marks on {slices} slices: give each slice's outline a number of its own"
        ));
    }
}
