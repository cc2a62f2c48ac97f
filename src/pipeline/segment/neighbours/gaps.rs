//! Gaps between objects are found, and shared out among them.

use std::sync::Arc;

use super::fields::{Roots, near_two};
use super::joined::{FillGaps, Joined, Joining};
use super::nesting::Nesting;
use super::sharing::share;
use super::survey::Survey;
use super::walls::{Brightness, Walls};
use super::widths::width;
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers, one_wave};
use crate::grid::BrickSet;
use crate::kernel::image::morphology::gaps::{GAP, GIVEN, Gaps, OUTSIDE};
use crate::store::{BoxSource, BrickArray};

/// How deep, in smallest spacings, objects give back what they claimed beside others, where an image tells of walls: the
/// crest of a wall three voxels wide is found from two voxels on either side of it.
const GIVEN_DEPTH: f64 = 2.0;

/// Fills the gaps of `joined`, and says there what was found.
pub(super) fn fill(
    engine: &Engine,
    joining: &Joining<'_>,
    fill: FillGaps,
    survey: &Survey,
    nesting: &Nesting,
    joined: &mut Joined<'_>,
) -> Result<()> {
    let geometry = joining.geometry;
    let roots = Roots::new(joined, nesting);
    let labels = nesting.labels();
    let stage = engine.stage("gaps", 0);
    let widest = match fill {
        FillGaps::Width(width) => width,
        FillGaps::Auto => width(&stage, geometry, survey, &roots, labels)?,
    };
    let mut found = joined.found.clone();
    found.gap_width = Some(widest);
    let depth = if joining.image.is_some() { GIVEN_DEPTH } else { 0.0 };
    let halo = Gaps::new(geometry.spacing, widest, depth).halo();
    let set = near_two(survey, &roots, labels, halo);
    stage.voxels((set.len() * set.grid().brick_len()) as u64);
    if set.is_empty() {
        stage.finish();
        joined.found = found;
        return Ok(());
    }
    let (states, brightness) = classify(&stage, engine, joining, &roots, &set, [widest, depth])?;
    stage.finish();
    let walls = Walls::new(joining.image, brightness);
    found.wall = walls.contrast();
    let stage = engine.stage("share gaps", 0);
    stage.voxels((set.len() * set.grid().brick_len()) as u64);
    let shared = share(&stage, engine, geometry, &roots, &states, &walls)?;
    let (settled, [filled, moved]) = settle(&stage, engine, &roots, &states, &shared)?;
    stage.finish();
    (found.filled, found.moved) = (filled, moved);
    joined.settled.push(settled);
    joined.found = found;
    Ok(())
}

/// What each voxel is, and how bright the image is within objects and between them.
fn classify(
    stage: &Stage<'_>,
    engine: &Engine,
    joining: &Joining<'_>,
    roots: &Roots<'_>,
    set: &Arc<BrickSet>,
    [widest, depth]: [f64; 2],
) -> Result<(BrickArray<u8>, Brightness)> {
    let spacing = joining.geometry.spacing;
    let states = BrickArray::new(engine.scratch(), set)?;
    let make = move || (Gaps::new(spacing, widest, depth), Vec::new(), Vec::new());
    let halo = Gaps::new(spacing, widest, depth).halo();
    let found = stage.run(&one_wave(set), &Workers::new(make), |(gaps, labels, out), &slot| {
        let part = set.grid().brick_box(set.id(slot));
        let around = roots.around(&part, halo, labels)?;
        out.resize(part.len(), OUTSIDE);
        gaps.classify(labels, &around, &part, out);
        states.write_box(&part, out);
        match joining.image {
            Some(image) => Brightness::of(image, labels, &around, &part, out),
            None => Ok(Brightness::default()),
        }
    })?;
    Ok((states, found.into_iter().fold(Brightness::default(), Brightness::and)))
}

/// The labels of all bricks: shared ones by their root, but where it is the one that the voxel had. How many voxels of
/// gaps got one, and how many changed it.
fn settle(
    stage: &Stage<'_>,
    engine: &Engine,
    roots: &Roots<'_>,
    states: &BrickArray<u8>,
    shared: &BrickArray<u32>,
) -> Result<(BrickArray<u32>, [u64; 2])> {
    let set = states.set();
    let settled = BrickArray::new(engine.scratch(), set)?;
    let make = || (Vec::new(), Vec::new(), Vec::new());
    let counts = stage.run(&one_wave(set), &Workers::new(make), |(labels, state, share), &slot| {
        let part = set.grid().brick_box(set.id(slot));
        labels.resize(part.len(), 0_u32);
        state.resize(part.len(), 0_u8);
        share.resize(part.len(), 0_u32);
        roots.labels.read_box(&part, labels)?;
        states.read_box(&part, state)?;
        shared.read_box(&part, share)?;
        let (mut filled, mut moved) = (0, 0);
        for ((label, &state), &share) in labels.iter_mut().zip(&*state).zip(&*share) {
            match state {
                GAP => {
                    filled += u64::from(share > 0);
                    *label = share;
                }
                GIVEN if share > 0 && share != roots.of(*label) => {
                    moved += 1;
                    *label = share;
                }
                _ => {}
            }
        }
        settled.write_box(&part, labels);
        Ok([filled, moved])
    })?;
    Ok((settled, counts.into_iter().fold([0; 2], |[a, b], [c, d]| [a + c, b + d])))
}
