//! Reads a source for a command that tells notes as it goes.

use std::path::Path;

use crate::error::Result;
use crate::io::geometry::read::points::LengthUnit;
use crate::io::geometry::read::source::Source;
use crate::io::geometry::read::sources::describe;

/// Reads points or a mesh, and tells by `note` what was odd about the file.
pub(crate) fn read_told(path: &Path, note: &dyn Fn(&str)) -> Result<Source> {
    read_in_unit(path, &mut None, note)
}

/// As [`read_told`]; points in a unit of their own are told in `unit`, which is the first one that a file tells.
pub(crate) fn read_in_unit(path: &Path, unit: &mut Option<LengthUnit>, note: &dyn Fn(&str)) -> Result<Source> {
    let (mut source, file, notes) = describe(path)?;
    for text in notes {
        note(&text);
    }
    let own = file.and_then(|file| file.units.into_iter().flatten().next());
    if let (Source::Cloud(cloud), Some(own)) = (&mut source, own) {
        let to = *unit.get_or_insert(own);
        if own != to {
            let factor = own.in_units_of(to);
            cloud.positions.iter_mut().flatten().for_each(|v| *v *= factor);
            note(&format!(
                "{}: its lengths are in {}, those before it in {}: they are multiplied by {factor}",
                path.display(),
                own.name,
                to.name
            ));
        }
    }
    Ok(source)
}
