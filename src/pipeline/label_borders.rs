//! The borders of the labels of a volume as sources: the centres of all voxels with a face neighbour of another label.

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::exec::Cancel;
use crate::grid::{Box3, refuse_too_many};
use crate::io::label_volume::LabelVolume;
use crate::kernel::image::labels::{border, labelled};

/// Voxels that are in memory at a time, about: planes are read in slabs, as stores keep them in bricks.
const SLAB_VOXELS: i64 = 1 << 24;
/// Planes of a slab at most.
const DEEPEST: i64 = 64;

/// World positions of the border voxels of each label but 0, in the order of the voxels, z slowest.
///
/// # Errors
/// When a plane cannot be read, a voxel holds no label, there are more border voxels than can be numbered, or the run is
/// interrupted.
pub fn label_borders(volume: &LabelVolume, cancel: &Cancel) -> Result<BTreeMap<u32, Vec<[f64; 3]>>> {
    let geometry = volume.geometry();
    let [width, height, depth] = geometry.shape;
    let slab = (SLAB_VOXELS / (width * height)).clamp(1, DEEPEST);
    let mut found: BTreeMap<u32, Vec<[f64; 3]>> = BTreeMap::new();
    let mut count = 0_u64;
    let (mut labels, mut marked) = (Vec::new(), Vec::new());
    for lo in (0..depth).step_by(slab as usize) {
        cancel.check()?;
        let part = Box3::new([0, 0, lo], [width, height, (lo + slab).min(depth)]);
        let around = part.grow(1).intersect(&geometry.domain());
        volume.read_planes(around.lo[2]..around.hi[2], &mut labels)?;
        marked.resize(part.len(), 0);
        border(&labels, &around, &part, &mut marked);
        for (voxel, label) in labelled(&marked, &part) {
            found.entry(label).or_default().push(geometry.position(voxel));
            count += 1;
        }
        refuse_too_many("border voxels", count)?;
    }
    if found.is_empty() {
        return Err(Error::input("holds no border of a label: all of its voxels are the same"));
    }
    Ok(found)
}
