//! What deserves a second look when a segmentation is done, and the objects that it refused.

use super::Job;
use crate::cli::report::table;
use crate::cli::terminal::text::number;
use crate::error::Error;
use crate::exec::Progress;
use crate::pipeline::segment::{ImageModel, LARGEST_WHOLE, ObjectReport, Outcome, Refused};

impl Job {
    /// Says what deserves a second look.
    pub(crate) fn note_findings(&self, outcome: &Outcome) {
        self.note_rounded(outcome.extremes);
        for object in outcome.objects.iter().filter(|object| object.marks_off > 0) {
            let verb = if object.marks_off == 1 { "mark lies" } else { "marks lie" };
            let (label, off) = (object.label, object.marks_off);
            self.console.note(&format!("object {label}: {off} {verb} more than a voxel from the surface"));
        }
        for object in &outcome.objects {
            self.note_odd(object, outcome.label_voxels.get(&object.label).copied().unwrap_or(0));
            if self.settings.cross_validate && object.cross_validation.is_none() {
                let label = object.label;
                self.console.note(&format!("object {label}: --cross-validate needs three outlines in parallel planes"));
            }
            let Some(found) = object.cross_validation else { continue };
            let next = found.next_slice.map_or(String::new(), |(axis, slice)| {
                format!("; the next outline helps most on slice {slice} across {}", ["x", "y", "z"][axis])
            });
            let (label, mean, p90) = (object.label, number(found.mean), number(found.p90));
            self.console.say(&format!(
                "object {label}: marks of an outline that is left out lie {mean} off in the mean, nine of ten within \
                 {p90}{next}"
            ));
        }
    }

    /// Says that grey values are not those of the file: 64-bit integers are read as doubles, which do not hold all of them.
    fn note_rounded(&self, extremes: [f64; 2]) {
        let file_type = &self.stack.info().file_type;
        if ["int64", "uint64"].contains(&file_type.as_str()) && extremes.iter().any(|v| v.abs() >= LARGEST_WHOLE) {
            self.console.note(&format!(
                "{}: grey values of type {file_type} reach from {:.0} to {:.0}; those beyond 2^53 are rounded to doubles, which \
                 have 53 bits, in the output too",
                self.args.image.display(),
                extremes[0],
                extremes[1]
            ));
        }
    }

    /// What a good result would not show.
    fn note_odd(&self, object: &ObjectReport, voxels: u64) {
        let (label, pieces) = (object.label, object.measures.components);
        if voxels == 0 {
            self.console.note(&format!("object {label}: all of its voxels went to others that lie where it does"));
        }
        if pieces > 1 {
            self.console.note(&format!("object {label}: its surface is in {pieces} pieces"));
        }
        if self.settings.image == ImageModel::Auto && self.settings.uses_image() && object.image_model == "none" {
            self.console.note(&format!(
                "object {label}: the image shows no border at its outlines, which alone decide; are they where they were \
                 drawn (--image-spacing, --channel, the order of x, y, z)?"
            ));
        }
    }
}

/// A line for each object that could not be solved.
pub(crate) fn refusal(refused: &[Refused], solved: usize, whole_in: &str) -> Error {
    let all = refused.len() + solved;
    let reasons = refused.iter().map(|refused| refused.reason.clone()).collect();
    let reasons = table::cut(reasons, "objects", whole_in);
    Error::partly(format!("{} of {all} objects could not be solved: {}", refused.len(), reasons.join("\n")))
}
