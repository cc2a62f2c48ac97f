//! What surfaces between labels take where these are crowded, told of the sources before a run starts: as good as an estimate
//! of what only the surface itself tells.
//!
//! Of a box of n voxels along its edges in which N labels have sources, each label has n^3 / N voxels, so faces between
//! labels cross about 3 n^2 N^(1/3) cells, and lines where three meet n N^(2/3) of them; two labels alone have none. Where voxels of
//! different labels touch, there is a face for each two that do. What a face and a line take is measured, on volumes of 75 to 1000 labels a box, with
//! and without gaps between them; the memory that comes of it was enough for ten other volumes of 40 to 6000 labels.

use crate::grid::{BrickGrid, BrickId, DataSets, Geometry};

/// Bytes of a patch for each cell between two labels, and for each where three meet.
const FACE_BYTES: f64 = 216.0;
const LINE_BYTES: f64 = 3500.0;
/// Cells that faces cross for each n^2 N^(1/3), where labels touch and where they lie apart.
const TOUCHING: f64 = 3.0;
const APART: f64 = 4.0;
/// No cell takes more, not even where each voxel has a label of its own.
const MOST_BYTES: f64 = 2750.0;
/// Bytes of the buffers in which a patch is made, at least; and as a part of those of the patch.
const BUFFER_BYTES: f64 = 6e6;
const BUFFER_PART: f64 = 0.9;
/// Bytes of what is known of the last patch, as a part of those of a patch; of the tables, which forget what lies below the layer of
/// boxes that is drawn, as parts of those of the patches and lines of a layer.
const LAST_PART: f64 = 0.5;
const TABLE_PARTS: [f64; 2] = [0.35, 0.35];
/// Bytes of a triangle in a patch, with its share of the vertices.
const TRIANGLE_BYTES: f64 = 41.0;

/// A box: the layer in which it lies, how many labels have sources in it, how often two of these touch, and its voxels.
pub(super) struct Filled {
    pub(super) layer: i64,
    pub(super) labels: usize,
    pub(super) touching: f64,
    pub(super) voxels: u64,
}

/// How much surface the sources of several labels make, in boxes of `edge` voxels. Bytes of patches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Crowded {
    /// Of the fullest box.
    largest: f64,
    /// Of all boxes.
    all: f64,
    /// Of tables, in the fullest layer.
    tables: f64,
}

impl Crowded {
    /// Looks at the points; triangles are left out.
    pub(super) fn new(geometry: &Geometry, sets: &DataSets, edge: i64) -> Self {
        if sets.count() < 2 {
            return Self::default();
        }
        let voxels = labelled_voxels(geometry, sets);
        let grid = BrickGrid::new(geometry.shape, edge);
        let box_of = |at: u64| grid.brick_of(voxel(geometry, at)).unwrap_or(0);
        let mut labels: Vec<(BrickId, u32)> = voxels.iter().map(|&(at, label)| (box_of(at), label)).collect();
        labels.sort_unstable();
        labels.dedup();
        let mut touching: Vec<BrickId> = touching(geometry, &voxels).map(box_of).collect();
        touching.sort_unstable();
        let mut touching = touching.as_slice();
        let filled = labels.chunk_by(|a, b| a.0 == b.0).map(|one| {
            touching = &touching[touching.partition_point(|id| *id < one[0].0)..];
            let faces = touching.partition_point(|id| *id == one[0].0) as f64;
            let part = grid.brick_box(one[0].0);
            Filled { layer: part.lo[2], labels: one.len(), touching: faces, voxels: part.volume() }
        });
        Self::of(filled)
    }

    /// Of boxes, layer by layer.
    pub(super) fn of(boxes: impl Iterator<Item = Filled>) -> Self {
        let (mut found, mut at, mut tables) = (Self::default(), None, 0.0);
        for Filled { layer, labels, touching, voxels } in boxes.filter(|filled| filled.labels > 1) {
            let (count, side) = (labels as f64, libm::cbrt(voxels as f64));
            let around = side * side * libm::cbrt(count);
            let lines = if labels > 2 { LINE_BYTES * side * libm::cbrt(count * count) } else { 0.0 };
            // Two labels may lie apart, with a plane between them; of more that do not touch the faces are rougher.
            let faces = match touching {
                _ if labels == 2 => touching,
                touching if touching < around => APART * around,
                touching => touching.max(TOUCHING * around),
            };
            let bytes = (FACE_BYTES * faces + lines).min(MOST_BYTES * side.powi(3));
            found.largest = found.largest.max(bytes);
            found.all += bytes;
            if at.replace(layer) != Some(layer) {
                tables = 0.0;
            }
            tables += TABLE_PARTS[0] * bytes + TABLE_PARTS[1] * lines.min(bytes);
            found.tables = found.tables.max(tables);
        }
        found
    }

    /// Bytes that drawing the surface box by box holds on so many threads.
    pub(super) fn drawing(self, threads: usize) -> u64 {
        if self.largest == 0.0 {
            return 0;
        }
        let buffers = threads as f64 * (BUFFER_BYTES + BUFFER_PART * self.largest);
        ((2.0 + LAST_PART) * self.largest + buffers + self.tables) as u64
    }

    /// About how many triangles there are.
    pub(super) fn triangles(self) -> u64 {
        (self.all / TRIANGLE_BYTES) as u64
    }
}

/// The voxels that hold points, by place in the grid, with the labels of these; in their order, each once.
fn labelled_voxels(geometry: &Geometry, sets: &DataSets) -> Vec<(u64, u32)> {
    let domain = geometry.domain();
    let mut found = Vec::new();
    for (points, &label) in sets.clouds().zip(sets.labels()) {
        for point in &sets.positions[points.start as usize..points.end as usize] {
            let voxel = geometry.to_voxels(*point).map(|v| v.round() as i64);
            if domain.contains(voxel) {
                found.push((domain.offset_of(voxel) as u64, label));
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// The lower voxel of each two neighbours along an axis that hold points of different labels.
fn touching<'a>(geometry: &Geometry, voxels: &'a [(u64, u32)]) -> impl Iterator<Item = u64> + 'a {
    let [width, height, _] = geometry.shape.map(i64::unsigned_abs);
    let differs = move |step: u64, last: fn(u64, u64, u64) -> bool| {
        let mut beside = 0;
        voxels.iter().filter_map(move |&(at, label)| {
            while voxels.get(beside).is_some_and(|&(other, _)| other < at + step) {
                beside += 1;
            }
            let &(other, its) = voxels.get(beside)?;
            (other == at + step && its != label && !last(at, width, height)).then_some(at)
        })
    };
    let along_x = differs(1, |at, width, _| at % width == width - 1);
    let along_y = differs(width, |at, width, height| at / width % height == height - 1);
    along_x.chain(along_y).chain(differs(width * height, |_, _, _| false))
}

fn voxel(geometry: &Geometry, at: u64) -> [i64; 3] {
    let ([width, height, _], at) = (geometry.shape, at as i64);
    [at % width, at / width % height, at / (width * height)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_that_touch_are_counted_by_axis_and_not_around_ends() {
        let geometry = Geometry { shape: [4, 3, 2], spacing: [0.5; 3], origin: [1.0; 3], unit: None };
        let mut sets = DataSets::default();
        // Of the second label: beside the first along x, above it along y, and beside its row's end.
        let place = |voxels: &[[i64; 3]]| voxels.iter().map(|v| geometry.position(*v)).collect::<Vec<_>>();
        sets.add_cloud(&place(&[[0, 0, 0], [3, 0, 0], [9, 0, 0]]));
        sets.add_cloud(&place(&[[1, 0, 0], [0, 1, 0], [0, 1, 1]]));
        let voxels = labelled_voxels(&geometry, &sets);
        assert_eq!(voxels.len(), 5, "one lies outside");
        let pairs: Vec<u64> = touching(&geometry, &voxels).collect();
        assert_eq!(pairs, [0, 0]);
        assert_eq!(voxel(&geometry, 17), [1, 1, 1]);
        let crowded = Crowded::new(&geometry, &sets, 32);
        assert!((crowded.largest - 2.0 * FACE_BYTES).abs() < 1.0, "{crowded:?}");
        assert!(crowded.drawing(2) > crowded.drawing(1) && Crowded::default().drawing(9) == 0);
    }
}
