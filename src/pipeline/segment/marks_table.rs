//! The marks that a segmentation was guided by, as a table in its store: what a viewer shows over the result, and what a later run
//! can be given again.

use std::fmt::Write;

use crate::error::{Error, Result};
use crate::io::ome_zarr::StoreWriter;
use crate::pipeline::marks::ObjectMarks;

/// The table's name in a store.
pub const MARKS: &str = "marks.csv";

/// Writes the marks of all objects, physical coordinates, a row each; none where objects grew from seeds alone.
///
/// # Errors
/// When the file cannot be written.
pub(crate) fn write_marks(store: &StoreWriter, objects: &[ObjectMarks]) -> Result<()> {
    if objects.iter().all(|marks| marks.contours.is_empty()) {
        return Ok(());
    }
    let path = store.file(MARKS)?;
    std::fs::write(&path, table(objects)).map_err(|e| Error::from_io("cannot write the marks", &e).at(&path))
}

fn table(objects: &[ObjectMarks]) -> String {
    let mut text = String::from("object,contour,x,y,z\n");
    for marks in objects {
        for (number, contour) in marks.numbers.iter().zip(&marks.contours) {
            for [x, y, z] in contour {
                // A string takes whatever is written.
                let _ = writeln!(text, "{},{number},{x},{y},{z}", marks.object);
            }
        }
    }
    text
}
