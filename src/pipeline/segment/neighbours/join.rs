//! The labels of all objects together: what is joined, how, and what was found on the way.

use super::gaps::fill;
use super::joined::{Found, Joined, Joining};
use super::nesting::Nesting;
use super::overlaps::settle;
use super::survey::survey;
use crate::error::Result;
use crate::exec::Engine;
use crate::pipeline::segment::labels::{LabelVolume, Overlap, Placed};

/// Joins objects on the grid of the image.
///
/// # Errors
/// When the image cannot be read, scratch runs out or the run is interrupted.
pub fn join<'a>(engine: &Engine, mut objects: Vec<Placed<'a>>, joining: &Joining<'_>) -> Result<Joined<'a>> {
    let geometry = joining.geometry;
    objects.sort_by_key(|object| object.label);
    let stage = engine.stage("neighbours", 0);
    stage.voxels(geometry.domain().volume());
    let survey = survey(&stage, geometry, &objects)?;
    let nesting = Nesting::new(&objects, &survey);
    let contested = match joining.overlap {
        Overlap::Smaller => settle(&stage, engine, geometry, &objects, &survey, &nesting)?,
        _ => None,
    };
    stage.finish();
    let mut joined = Joined {
        painted: LabelVolume::new(geometry.shape, objects, joining.overlap),
        settled: Vec::new(),
        found: Found { nested: nesting.pairs(), ..Found::default() },
    };
    if let Some((labels, voxels)) = contested {
        joined.settled.push(labels);
        joined.found.contested = voxels;
    }
    if let Some(width) = joining.fill {
        fill(engine, joining, width, &survey, &nesting, &mut joined)?;
    }
    Ok(joined)
}
