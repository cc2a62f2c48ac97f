//! Reads a source for a command that tells notes as it goes.

use std::path::Path;

use crate::error::Result;
use crate::io::sources::{Source, read_noted};

/// Reads points or a mesh, and tells by `note` what was odd about the file.
pub(super) fn read_told(path: &Path, note: &dyn Fn(&str)) -> Result<Source> {
    let (source, notes) = read_noted(path)?;
    for text in notes {
        note(&text);
    }
    Ok(source)
}
