//! The labels of a volume whose voxels touch, in bricks: what smooth walls are told from.

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Engine, Footprint, Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickId, BrickSet, Geometry};
use crate::kernel::surface::{Sides, Walls};
use crate::pipeline::distance::Needs;
use crate::pipeline::distance::seeding::label_borders::Labels;
use crate::store::{BoxSource, BrickArray, Element, ElementType};

/// Edge of the bricks.
const EDGE: i64 = 32;
/// Bytes of the buffers of a thread: smoothed labels of a box that several cross.
pub(super) const WORK_BYTES: u64 = 12 << 20;

/// Labels in bricks of the type in which they are stored.
pub(super) enum Bricks {
    U8(BrickArray<u8>),
    U16(BrickArray<u16>),
    U32(BrickArray<u32>),
}

/// The labels of a volume.
pub(super) struct Touching {
    pub(super) bricks: Bricks,
    domain: Box3,
    reach: [i64; 3],
    /// Whether labels are closed where the volume ends.
    pub(super) is_bounded: bool,
}

impl Touching {
    /// Reads those bricks of a volume that are needed.
    pub(super) fn read_from(
        stage: &Stage<'_>,
        engine: &Engine,
        volume: &dyn Labels,
        (needed, is_bounded): (&dyn Fn(BrickId) -> bool, bool),
    ) -> Result<Self> {
        let geometry = volume.geometry();
        let set = Arc::new(BrickSet::from_fn(BrickGrid::new(geometry.shape, EDGE), needed));
        let bricks = match volume.element() {
            ElementType::U8 => Bricks::U8(read_as(stage, engine, volume, &set)?),
            ElementType::U16 => Bricks::U16(read_as(stage, engine, volume, &set)?),
            _ => Bricks::U32(read_as(stage, engine, volume, &set)?),
        };
        let reach = Walls::reach(geometry.spacing);
        Ok(Self { bricks, domain: geometry.domain(), reach, is_bounded })
    }

    /// The grid of the bricks of a volume on some grid.
    pub(super) fn grid(geometry: &Geometry) -> BrickGrid {
        BrickGrid::new(geometry.shape, EDGE)
    }

    /// How many voxels around a box walls are told from.
    pub(super) fn reach(&self) -> [i64; 3] {
        self.reach
    }

    /// Who makes what tells the walls.
    pub(super) fn sides(&self, spacing: [f64; 3]) -> impl Fn() -> Walls + Send + Sync + 'static {
        let closed = self.is_bounded.then_some(self.domain);
        move || closed.map_or_else(|| Walls::new(spacing), |volume| Walls::closed(spacing, volume))
    }

    /// Whether there is one label, or none, in what was read of a box.
    pub(super) fn is_one(&self, part: &Box3, read: &[u32]) -> bool {
        let is_closed = self.is_bounded && part.intersect(&self.domain) != *part;
        let one = read.first().copied().unwrap_or(0);
        read.iter().all(|label| *label == one) && !(is_closed && one > 0)
    }

    /// The labels of a box that may reach beyond the volume, where they are as at its end.
    pub(super) fn read(&self, part: &Box3, out: &mut Vec<u32>) -> Result<()> {
        out.clear();
        out.resize(part.len(), 0);
        let inside = part.intersect(&self.domain);
        match &self.bricks {
            Bricks::U8(bricks) => place(bricks, &inside, part, out)?,
            Bricks::U16(bricks) => place(bricks, &inside, part, out)?,
            Bricks::U32(bricks) => place(bricks, &inside, part, out)?,
        }
        if inside != *part {
            repeat_ends(&inside, part, out);
        }
        Ok(())
    }

    /// Makes ready the walls in a box.
    pub(super) fn walls(&self, part: &Box3, around: &mut Vec<u32>, walls: &mut Walls) -> Result<()> {
        let (lo, hi) =
            (std::array::from_fn(|a| part.lo[a] - self.reach[a]), std::array::from_fn(|a| part.hi[a] + self.reach[a]));
        let wide = Box3::new(lo, hi);
        self.read(&wide, around)?;
        walls.enter(around, &wide, part);
        Ok(())
    }
}

/// What a middle surface takes where its sources are the labels of a volume, whose voxels may touch, on so many threads.
#[must_use]
pub fn with_touching(needs: Needs, volume: Option<&dyn Labels>, threads: usize) -> Needs {
    let Some(volume) = volume else { return needs };
    let footprint = needs.footprint.and(Footprint::of_thread(WORK_BYTES));
    let (held, scratch) = (footprint.bytes(threads as u64), needs.scratch.saturating_add(touching_bytes(volume)));
    Needs { footprint, held, scratch, ..needs }
}

/// Temporary bytes that the labels of a volume take in bricks.
pub(super) fn touching_bytes(volume: &dyn Labels) -> u64 {
    let element = match volume.element() {
        ElementType::U8 => 1,
        ElementType::U16 => 2,
        _ => 4,
    };
    let grid = BrickGrid::new(volume.geometry().shape, EDGE);
    grid.len().saturating_mul(grid.brick_len() as u64 * element)
}

fn read_as<T: Element>(
    stage: &Stage<'_>,
    engine: &Engine,
    volume: &dyn Labels,
    set: &Arc<BrickSet>,
) -> Result<BrickArray<T>> {
    let bricks = BrickArray::<T>::new(engine.scratch(), set)?;
    let is_needed = |part: &Box3| set.grid().bricks_in(part).any(|id| set.slot(id).is_some());
    let boxes: Vec<Box3> = volume.natural_boxes().filter(is_needed).collect();
    stage.run(&boxes, &Workers::new(|| (Vec::new(), Vec::new())), |(labels, values), part| {
        volume.read_box(part, labels)?;
        values.clear();
        values.extend(labels.iter().map(|&label| T::from_f64(f64::from(label))));
        bricks.write_box(part, values);
        Ok(())
    })?;
    Ok(bricks)
}

/// Puts what lies inside of a box in its place.
fn place<T: Element>(bricks: &BrickArray<T>, inside: &Box3, part: &Box3, out: &mut [u32]) -> Result<()> {
    let mut values = vec![T::default(); inside.len()];
    bricks.read_box(inside, &mut values)?;
    let width = inside.shape()[0] as usize;
    for (row, (y, z)) in values.chunks_exact(width.max(1)).zip(inside.rows()) {
        let out = &mut out[part.offset_of([inside.lo[0], y, z])..][..width];
        out.iter_mut().zip(row).for_each(|(out, value)| *out = value.to_f64() as u32);
    }
    Ok(())
}

/// Gives what lies outside the labels of the nearest voxels inside.
fn repeat_ends(inside: &Box3, part: &Box3, out: &mut [u32]) {
    let nearest = |voxel: i64, axis: usize| voxel.clamp(inside.lo[axis], inside.hi[axis] - 1);
    for (y, z) in part.rows() {
        let from = part.offset_of([part.lo[0], nearest(y, 1), nearest(z, 2)]);
        let to = part.offset_of([part.lo[0], y, z]);
        let width = part.shape()[0] as usize;
        if from != to {
            out.copy_within(from..from + width, to);
        }
        let row = &mut out[to..][..width];
        let (first, last) = ((inside.lo[0] - part.lo[0]) as usize, (inside.hi[0] - 1 - part.lo[0]) as usize);
        let ends = [row[first], row[last]];
        row[..first].fill(ends[0]);
        row[last..].fill(ends[1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn around_the_volume_its_ends_are_repeated() {
        let (inside, part) = (Box3::new([2, 3, 0], [5, 5, 2]), Box3::new([0, 2, 0], [6, 8, 4]));
        let mut out = vec![0; part.len()];
        let label = |[x, y, z]: [i64; 3]| (x + 10 * y + 100 * z) as u32;
        for (y, z) in inside.rows() {
            (2..5).for_each(|x| out[part.offset_of([x, y, z])] = label([x, y, z]));
        }
        repeat_ends(&inside, &part, &mut out);
        for (y, z) in part.rows() {
            for x in 0..6 {
                let nearest = [x.clamp(2, 4), y.clamp(3, 4), z.clamp(0, 1)];
                assert_eq!(out[part.offset_of([x, y, z])], label(nearest), "{x} {y} {z}");
            }
        }
    }
}
