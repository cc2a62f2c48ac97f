//! Sheets: points that no space lies behind, so that a surface would close over them. The voxels that hold them are held
//! inside, as a thin shell (algorithms: section 5, "Sheets").

use std::collections::BTreeSet;

use rstar::RTree;

use crate::grid::{Box3, Geometry, Slot};
use crate::kernel::level_set::start::HELD;
use crate::store::BrickArray;

/// A voxel is held within so many largest spacings of a sheet's point, and of the lines between points beside each other.
const HELD_VOXELS: f64 = 0.9;
/// Points are a sheet where so many others are as near as so many largest spacings; what is fewer is noise.
const NEIGHBOURS: usize = 3;
const NEAR_VOXELS: f64 = 6.0;
/// Lines are drawn to so many nearest points: to those all around, on a sheet.
const LINES: usize = 6;

/// Holds the voxels around those of the `lost` points that form sheets, and between them and their neighbours in the
/// cloud; returns how many points these are.
pub(super) fn hold_sheets(geometry: &Geometry, positions: &[[f64; 3]], lost: &[u32], inside: &BrickArray<u8>) -> u64 {
    let places: Vec<[f64; 3]> = lost.iter().map(|&point| positions[point as usize]).collect();
    let tree = RTree::bulk_load(places.clone());
    let near = (NEAR_VOXELS * geometry.max_spacing()).powi(2);
    let is_sheet = |p: &&[f64; 3]| tree.locate_within_distance(**p, near).take(NEIGHBOURS + 1).count() > NEIGHBOURS;
    let sheet: Vec<[f64; 3]> = places.iter().filter(is_sheet).copied().collect();
    if sheet.is_empty() {
        return 0;
    }
    let all = RTree::bulk_load(positions.to_vec());
    let mut held = Held { geometry, inside, touched: BTreeSet::new() };
    let step = 0.5 * geometry.min_spacing();
    for from in &sheet {
        held.hold(*from);
        for (to, squared) in all.nearest_neighbor_iter_with_distance_2(*from).take(LINES + 1).filter(|n| n.1 <= near) {
            let steps = (squared.sqrt() / step).ceil();
            for n in 1..steps as u32 {
                let part = f64::from(n) / steps;
                held.hold(std::array::from_fn(|a| from[a] + part * (to[a] - from[a])));
            }
        }
    }
    held.touched.into_iter().for_each(|slot| inside.refresh_faces(slot));
    sheet.len() as u64
}

struct Held<'a> {
    geometry: &'a Geometry,
    inside: &'a BrickArray<u8>,
    touched: BTreeSet<Slot>,
}

impl Held<'_> {
    /// Holds the voxels near a place.
    fn hold(&mut self, place: [f64; 3]) {
        let (geometry, set) = (self.geometry, self.inside.set());
        let (domain, edge) = (Box3::from_shape(set.grid().shape()), set.grid().edge());
        let reach = HELD_VOXELS * geometry.max_spacing();
        let (lo, hi) = (geometry.to_voxels(place.map(|v| v - reach)), geometry.to_voxels(place.map(|v| v + reach)));
        let around = Box3::new(lo.map(|v| v.ceil() as i64), hi.map(|v| v.floor() as i64 + 1)).intersect(&domain);
        for voxel in around.rows().flat_map(|(y, z)| (around.lo[0]..around.hi[0]).map(move |x| [x, y, z])) {
            let at = geometry.position(voxel);
            let squared: f64 = (0..3).map(|a| (at[a] - place[a]).powi(2)).sum();
            let slot = set.grid().brick_of(voxel).and_then(|id| set.slot(id)).filter(|_| squared <= reach * reach);
            if let Some(slot) = slot {
                let lo = set.grid().brick_box(set.id(slot)).lo;
                let [x, y, z] = [0, 1, 2].map(|a| voxel[a] - lo[a]);
                self.inside.write(slot, |cell| cell[((z * edge + y) * edge + x) as usize] = HELD);
                self.touched.insert(slot);
            }
        }
    }
}
