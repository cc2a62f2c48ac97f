//! Where voxels of a label volume touch: there the surface between labels is a wall between voxels, and not where their sources are equally
//! far.

use super::corner::Corner;
use super::known::{Known, TouchingVoxels};
use super::sides::Sides;

/// How close to a voxel centre a wall may come, in parts of the edge: triangles keep an area.
const MARGIN: f64 = 1.0 / 256.0;

/// Whether corners are voxels with labels of their own.
pub(crate) fn do_touch(known: &Known<'_>, corners: &[Corner]) -> bool {
    let is_own = |touching: &TouchingVoxels<'_>, corner: &Corner| {
        // A corner that is no voxel has an odd coordinate.
        let is_voxel = corner.halves.iter().all(|v| v % 2 == 0);
        let own = || touching.own[known.part.offset_of(corner.halves.map(|v| v / 2))];
        is_voxel && corner.label > 0 && own() == corner.label
    };
    known.touching.is_some_and(|touching| corners.iter().all(|corner| is_own(&touching, corner)))
}

/// Where voxels that touch meet, in voxel units: the middle of the places between each two. None where not all of them do.
pub(crate) fn wall(known: &Known<'_>, corners: &[Corner]) -> Option<[f64; 3]> {
    let touching = known.touching.filter(|_| do_touch(known, corners))?;
    let mut weights = [0.0; 4];
    let pairs = (corners.len() * (corners.len() - 1) / 2) as f64;
    for m in 1..corners.len() {
        for n in 0..m {
            let ends = [corners[n], corners[m]];
            let voxels = ends.map(|corner| corner.halves.map(|v| v / 2));
            let at = touching.walls.between(voxels, ends.map(|corner| corner.label)).clamp(MARGIN, 1.0 - MARGIN);
            weights[n] += (1.0 - at) / pairs;
            weights[m] += at / pairs;
        }
    }
    let place = |a: usize| corners.iter().zip(weights).map(|(corner, weight)| weight * corner.place[a]).sum();
    Some(std::array::from_fn(place))
}
