//! The borders of the labels of a volume as sources: the centres of all voxels with a face neighbour of another label.
//!
//! The volume is read by the boxes in which it is stored, each once. Voxels beside a box that came before it are compared
//! with that box's last layer, which is kept.

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::exec::Cancel;
use crate::grid::{Box3, Geometry, refuse_too_many};
use crate::io::stack::label_volume::LabelVolume;
use crate::kernel::image::labels::{border, labelled};
use crate::store::ElementType;

/// A volume of labels, read by the boxes in which it is stored.
pub trait Labels: Sync {
    /// Where its voxels lie.
    fn geometry(&self) -> &Geometry;

    /// The type that its labels are stored in.
    fn element(&self) -> ElementType {
        ElementType::U32
    }

    /// Bytes that are held while it is read box by box, in each thread that does.
    fn reading_bytes(&self) -> u64 {
        0
    }

    /// The boxes in which it is stored, x fastest, laid on a regular grid.
    fn natural_boxes(&self) -> Box<dyn Iterator<Item = Box3> + '_>;

    /// Reads the labels of a box into `out`, dense `[z][y][x]`; 0 is what has none.
    ///
    /// # Errors
    /// When it cannot be read, or holds what is no label.
    fn read_box(&self, part: &Box3, out: &mut Vec<u32>) -> Result<()>;
}

impl Labels for LabelVolume {
    fn geometry(&self) -> &Geometry {
        self.geometry()
    }

    fn element(&self) -> ElementType {
        self.element()
    }

    fn reading_bytes(&self) -> u64 {
        self.reading_bytes()
    }

    fn natural_boxes(&self) -> Box<dyn Iterator<Item = Box3> + '_> {
        Box::new(self.natural_boxes())
    }

    fn read_box(&self, part: &Box3, out: &mut Vec<u32>) -> Result<()> {
        self.read_box(part, out)
    }
}

/// World positions of the border voxels of each label but 0, in the order of the voxels, z slowest.
///
/// # Errors
/// When a box cannot be read, a voxel holds no label, there are more border voxels than can be numbered, or the run is
/// interrupted.
pub fn label_borders(volume: &dyn Labels, cancel: &Cancel) -> Result<BTreeMap<u32, Vec<[f64; 3]>>> {
    let geometry = volume.geometry();
    let [width, height, _] = geometry.shape;
    let domain = geometry.domain();
    let mut found: BTreeMap<u32, Vec<u64>> = BTreeMap::new();
    let mut add = |label: u32, voxel: [i64; 3]| found.entry(label).or_default().push(domain.offset_of(voxel) as u64);
    let mut count = 0_u64;
    let mut layers = Layers::new(width, height);
    let (mut labels, mut marked) = (Vec::new(), Vec::new());
    for part in volume.natural_boxes() {
        cancel.check()?;
        volume.read_box(&part, &mut labels)?;
        marked.resize(labels.len(), 0);
        // Within a box it is its own surroundings; a box of one label has no border of its own.
        if labels.iter().any(|label| *label != labels[0]) {
            border(&labels, &part, &part, &mut marked);
        } else {
            marked.fill(0);
        }
        for axis in 0..3 {
            layers.compare(axis, &part, &labels, |voxel, before| {
                let at = part.offset_of(voxel);
                marked[at] = labels[at];
                if before > 0 {
                    let mut neighbour = voxel;
                    neighbour[axis] -= 1;
                    add(before, neighbour);
                }
            });
        }
        for (voxel, label) in labelled(&marked, &part) {
            add(label, voxel);
            count += 1;
        }
        layers.keep(&part, &labels);
        refuse_too_many("border voxels", count)?;
    }
    if found.is_empty() {
        return Err(Error::input("holds no border of a label: all of its voxels are the same"));
    }
    let place = |at: u64| {
        let at = at as i64;
        geometry.position([at % width, at / width % height, at / (width * height)])
    };
    let positions = |mut voxels: Vec<u64>| {
        // What is told from two boxes comes twice.
        voxels.sort_unstable();
        voxels.dedup();
        voxels.into_iter().map(place).collect()
    };
    Ok(found.into_iter().map(|(label, voxels)| (label, positions(voxels))).collect())
}

/// The last layers of the boxes before a box: along x of the one before it, along y of the row before it, along z of the
/// slab before it.
struct Layers {
    width: i64,
    last: [Vec<u32>; 3],
}

impl Layers {
    fn new(width: i64, height: i64) -> Self {
        Self { width, last: [Vec::new(), Vec::new(), vec![0; (width * height) as usize]] }
    }

    /// Where a voxel of a layer is kept.
    fn place(&self, axis: usize, [x, y, z]: [i64; 3], part: &Box3) -> usize {
        let place = match axis {
            0 => (z - part.lo[2]) * part.shape()[1] + y - part.lo[1],
            1 => (z - part.lo[2]) * self.width + x,
            _ => y * self.width + x,
        };
        place as usize
    }

    /// Gives each voxel of the first layer of a box whose neighbour before it has another label, with that label.
    fn compare(&self, axis: usize, part: &Box3, labels: &[u32], mut differs: impl FnMut([i64; 3], u32)) {
        if part.lo[axis] == 0 {
            return;
        }
        let mut layer = *part;
        layer.hi[axis] = layer.lo[axis] + 1;
        for (y, z) in layer.rows() {
            for x in layer.lo[0]..layer.hi[0] {
                let before = self.last[axis][self.place(axis, [x, y, z], part)];
                if before != labels[part.offset_of([x, y, z])] {
                    differs([x, y, z], before);
                }
            }
        }
    }

    /// Keeps the last layers of a box for those after it.
    fn keep(&mut self, part: &Box3, labels: &[u32]) {
        let [_, height, depth] = part.shape();
        self.last[0].resize((height * depth) as usize, 0);
        self.last[1].resize((self.width * depth) as usize, 0);
        for axis in 0..3 {
            let mut layer = *part;
            layer.lo[axis] = layer.hi[axis] - 1;
            for (y, z) in layer.rows() {
                for x in layer.lo[0]..layer.hi[0] {
                    let place = self.place(axis, [x, y, z], part);
                    self.last[axis][place] = labels[part.offset_of([x, y, z])];
                }
            }
        }
    }
}
