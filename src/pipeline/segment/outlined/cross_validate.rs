//! Leaving out each outline in turn: how far its marks then lie from the shape of the others, and where the next outline
//! would help most.

use super::survey::Outlined;
use crate::error::Result;
use crate::exec::{Engine, Workers};
use crate::grid::Geometry;
use crate::kernel::outline::planar::section::Section;
use crate::kernel::outline::spatial::cross_validation::leave_out;
use crate::kernel::outline::spatial::fitted::LEAST_BESIDE;
use crate::pipeline::segment::object_report::CrossValidation;

/// Leaves out each section of an object; none where fewer than three tell no shape without one.
pub(crate) fn cross_validate(engine: &Engine, object: &Outlined, image: &Geometry) -> Result<Option<CrossValidation>> {
    let sections: Vec<&Section> = object.sections.iter().collect();
    if sections.len() < 3 {
        return Ok(None);
    }
    let least = LEAST_BESIDE * image.min_spacing();
    let stage = engine.stage("cross-validation", sections.len() as u64);
    let all: Vec<usize> = (0..sections.len()).collect();
    let held_out = stage.run(&all, &Workers::none(), |(), &n| Ok(leave_out(&sections, n, least)))?;
    stage.finish();
    let errors: Vec<f64> = held_out.iter().map(|held| mean(held.iter().flatten().map(|h| h.off.abs()))).collect();
    let mut offs: Vec<f64> = held_out.into_iter().flatten().flatten().map(|held| held.off.abs()).collect();
    if offs.is_empty() {
        return Ok(None);
    }
    offs.sort_by(f64::total_cmp);
    let p90 = offs[(offs.len() * 9 / 10).min(offs.len() - 1)];
    let next_slice = next_slice(&sections, &errors, image);
    Ok(Some(CrossValidation { mean: mean(offs.into_iter()), p90, next_slice }))
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), v| (sum + v, count + 1));
    if count == 0 { 0.0 } else { sum / f64::from(count) }
}

/// The slice in the middle of the two neighbouring sections between which a shape is least sure: its error grows with
/// the square of their distance, and is what the sections missed by when they were left out.
fn next_slice(sections: &[&Section], errors: &[f64], image: &Geometry) -> Option<(usize, i64)> {
    let gaps = (1..sections.len()).filter(|&n| sections[n].plane.is_parallel_to(&sections[n - 1].plane));
    let doubt = |n: usize| {
        let gap = sections[n].plane.offset - sections[n - 1].plane.offset;
        (errors[n] + errors[n - 1]) * gap * gap
    };
    let widest = gaps.max_by(|&a, &b| doubt(a).total_cmp(&doubt(b)))?;
    let plane = &sections[widest].plane;
    let axis = (0..3).find(|&a| plane.normal[a] == 1.0)?;
    let middle = 0.5 * (plane.offset + sections[widest - 1].plane.offset);
    let slice = ((middle - image.origin[axis]) / image.spacing[axis]).round() as i64;
    Some((axis, slice))
}
