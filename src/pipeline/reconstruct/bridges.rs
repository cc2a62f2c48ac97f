//! Points over the holes of a cloud that the surface on both sides of them leads across (`kernel/points/bridge`, docs/algorithms.md, "Holes").

use glam::DVec3;
use rstar::RTree;

use super::estimate::spacing_memory;
use super::normals::oriented::AT_ONCE;
use super::normals::sided::Sided;
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers};
use crate::kernel::points::bridge::{Rim, Rims, thinned};
use crate::kernel::points::smoothing::smoothed;

/// Beside a rim that far beyond a point, in edges of the square that a point has of the surface, where no other point is so near, the surface
/// would go on.
pub(super) const BEYOND: f64 = 2.2;
pub(super) const BESIDE: f64 = 1.6;
/// A bridge keeps so far from all points, but for those that it begins and ends at.
const FREE: f64 = 0.7;
/// Where bridges cross, the surface is that of so many points, off by so much, found so many times.
const NEIGHBOURS: usize = 40;
const OFF: f64 = 0.5;
const TIMES: usize = 3;

/// Where the surface would go on from the points of a cloud though none are there: by their numbers.
pub(super) fn rims(stage: &Stage<'_>, points: &[[f64; 3]], sided: &Sided) -> Result<Vec<(usize, DVec3)>> {
    let cloud = &sided.cloud;
    let numbers: Vec<usize> = (0..points.len()).collect();
    let parts: Vec<&[usize]> = numbers.chunks(AT_ONCE).collect();
    let found = stage.run(&parts, &Workers::none(), |(), part| {
        let beyond = |&n: &usize| (n, DVec3::from(points[n]) + cloud.beyond[n] * (BEYOND * cloud.apart));
        Ok(part.iter().map(beyond).filter(|(_, at)| sided.away(*at) > BESIDE * cloud.apart).collect::<Vec<_>>())
    })?;
    Ok(found.concat())
}

/// Points across holes that have rims on opposite sides, on one smooth surface; none where there are none.
///
/// # Errors
/// When the memory is too little, or the run is interrupted.
pub(super) fn bridges(engine: &Engine, points: &[[f64; 3]], sided: &Sided) -> Result<Vec<[f64; 3]>> {
    let stage = engine.stage("bridges", points.len() as u64);
    let step = sided.cloud.apart;
    let rim = |(n, _): &(usize, DVec3)| Rim { surfel: sided.surfels[*n], beyond: sided.cloud.beyond[*n] };
    let rims: Vec<Rim> = rims(&stage, points, sided)?.iter().map(rim).collect();
    let known = Rims::new(&rims, step);
    let numbers: Vec<usize> = (0..rims.len()).collect();
    let parts: Vec<&[usize]> = numbers.chunks(AT_ONCE).collect();
    let opposite = |part: &[usize]| part.iter().map(|&rim| known.opposite(rim)).collect::<Vec<_>>();
    let opposite = stage.run(&parts, &Workers::none(), |(), part| Ok(opposite(part)))?.concat();
    let found = stage.run(&parts, &Workers::none(), |(), part| {
        let from = |&rim: &usize| known.bridge(rim, &opposite, |at| sided.away(at) > FREE * step);
        Ok(part.iter().filter_map(from).flatten().collect::<Vec<_>>())
    })?;
    let mut found = found.concat();
    let _held = engine.hold(spacing_memory(points.len() + found.len()))?;
    for _ in 0..TIMES {
        found = evened(&stage, points, &found, step)?;
    }
    stage.finish();
    Ok(thinned(&found, step).into_iter().map(|at| at.to_array()).collect())
}

/// The points of bridges on the surface that they and the cloud's make.
fn evened(stage: &Stage<'_>, points: &[[f64; 3]], bridges: &[DVec3], step: f64) -> Result<Vec<DVec3>> {
    let all: Vec<[f64; 3]> = points.iter().copied().chain(bridges.iter().map(DVec3::to_array)).collect();
    let tree = RTree::bulk_load(all);
    let parts: Vec<&[DVec3]> = bridges.chunks(AT_ONCE).collect();
    let found = stage.run(&parts, &Workers::none(), |(), part| {
        let even = |at: &DVec3| {
            let near: Vec<DVec3> =
                tree.nearest_neighbor_iter(at.to_array()).take(NEIGHBOURS).map(|&at| DVec3::from(at)).collect();
            smoothed(&near, OFF * step)
        };
        Ok(part.iter().filter_map(even).collect::<Vec<_>>())
    })?;
    Ok(found.concat())
}
