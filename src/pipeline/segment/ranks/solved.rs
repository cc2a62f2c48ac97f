//! What each rank has solved, told to all others: reports of objects and their segmentation functions, as if one rank had solved all.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::exec::{Comm, Stage, gather_records, spread_fields};
use crate::grid::{Box3, Geometry};
use crate::pipeline::segment::object_report::{ObjectReport, Refused};
use crate::store::BrickArray;

/// A solved object whose surface is drawn.
pub(in crate::pipeline::segment) struct Solved {
    /// Its box in voxels of the image; may reach past it.
    pub window: Box3,
    /// The grid of its box.
    pub geometry: Geometry,
    /// The segmentation function.
    pub u: BrickArray<f32>,
    /// What is told of it.
    pub report: ObjectReport,
}

/// What is told of all objects, by their numbers, in order of these. All ranks tell theirs at the same time.
///
/// # Errors
/// When another rank is gone.
pub(in crate::pipeline::segment) fn in_order<R: Serialize + DeserializeOwned>(
    comm: &dyn Comm,
    own: Vec<(usize, R)>,
) -> Result<Vec<(usize, R)>> {
    if comm.ranks() == 1 {
        return Ok(own);
    }
    let mut all: Vec<(usize, R)> = gather_records(comm, &own)?.into_iter().flatten().collect();
    all.sort_by_key(|(number, _)| *number);
    Ok(all)
}

/// An object without its segmentation function.
#[derive(Serialize, Deserialize)]
struct Told {
    window: Box3,
    geometry: Geometry,
    report: ObjectReport,
}

/// What became of all objects, in order of their numbers.
///
/// # Errors
/// When scratch runs out or another rank is gone.
pub(in crate::pipeline::segment) fn of_all_ranks(
    stage: &Stage<'_>,
    own: Vec<(usize, std::result::Result<Solved, Refused>)>,
) -> Result<Vec<std::result::Result<Solved, Refused>>> {
    let (mut told, mut fields) = (Vec::new(), Vec::new());
    for (number, object) in own {
        let object = object.map(|Solved { window, geometry, u, report }| {
            fields.push((number, u));
            Told { window, geometry, report }
        });
        told.push((number, object));
    }
    let all = in_order(stage.comm(), told)?;
    let mut fields = spread_fields(stage, fields)?.into_iter();
    all.into_iter()
        .map(|(number, object)| {
            object.map_or_else(|refused| Ok(Err(refused)), |told| joined(number, told, fields.next()).map(Ok))
        })
        .collect()
}

/// An object and its field, which come in the same order.
fn joined(number: usize, told: Told, field: Option<(usize, BrickArray<f32>)>) -> Result<Solved> {
    let Told { window, geometry, report } = told;
    let field = field.filter(|(of, _)| *of == number);
    let (_, u) = field.ok_or_else(|| Error::failed("a rank has told of an object without its field"))?;
    Ok(Solved { window, geometry, u, report })
}
