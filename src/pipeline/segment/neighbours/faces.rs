//! The common faces of all labels, as one mesh: drawn box by box, welded in grid order, each pair measured.

use super::EDGE;
use super::joined::Joined;
use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickId, Geometry};
use crate::kernel::surface::{Contact, Contacts, PARTITION_REACH, Partition, Patch, Welder, cells_of_brick};
use crate::pipeline::output::drawn::{Drawn, STATED, Wave};
use crate::store::{BoxSource, MeshSink};

/// Sends the surfaces between labels, and to what has none, to `sink`; measures what lies between each two.
///
/// # Errors
/// When the sink fails, a field cannot be read or the run is interrupted.
pub fn draw(
    stage: &Stage<'_>,
    geometry: &Geometry,
    joined: &Joined<'_>,
    sink: &mut dyn MeshSink,
) -> Result<Vec<Contact>> {
    let grid = BrickGrid::new(geometry.shape, EDGE);
    let (mut welder, mut contacts) = (Welder::new(geometry), Contacts::new(geometry));
    let workers = Workers::new(|| (Partition::default(), Vec::new()));
    let bricks: Vec<BrickId> = (0..grid.len()).collect();
    let (mut drawn, mut left) = (Drawn::new(stage, STATED), bricks.as_slice());
    while !left.is_empty() {
        let batch;
        (batch, left) = left.split_at(drawn.next().min(left.len()));
        let patches = stage.run(batch, &workers, |(partition, values), &id| {
            patch(partition, values, joined, geometry, &grid.brick_box(id))
        })?;
        for patch in patches.iter().filter(|patch| !patch.triangles.is_empty()) {
            welder.add(patch, sink)?;
            for ((_, positions), &pair) in welder.triangles_of(patch).zip(&patch.pairs) {
                contacts.add(pair, positions);
            }
        }
        drawn.took(&Wave {
            patches: &patches.iter().map(Patch::bytes).collect::<Vec<_>>(),
            buffers: &workers.idle(|(partition, values)| partition.bytes() + 4 * values.capacity() as u64),
            last: welder.bytes_of_last(),
            tables: &welder.tables(),
            left: left.len(),
        })?;
    }
    Ok(contacts.finish())
}

/// The surfaces in the cells of one box; around the image lies what has no label.
fn patch(
    partition: &mut Partition,
    values: &mut Vec<u32>,
    joined: &Joined<'_>,
    geometry: &Geometry,
    brick: &Box3,
) -> Result<Patch> {
    let cells = cells_of_brick(brick, geometry.shape, true);
    let mut patch = Patch { cells, ..Patch::default() };
    let around = Box3::new(cells.lo, cells.hi.map(|v| v + 1)).grow(PARTITION_REACH);
    let inside = around.intersect(&geometry.domain());
    if cells.is_empty() || BoxSource::<u32>::constant_in(joined, &inside) == Some(0) {
        return Ok(patch);
    }
    let mut known = vec![0; inside.len()];
    joined.read_box(&inside, &mut known)?;
    values.clear();
    values.resize(around.len(), 0);
    for (row, (y, z)) in known.chunks_exact(inside.shape()[0] as usize).zip(inside.rows()) {
        values[around.offset_of([inside.lo[0], y, z])..][..row.len()].copy_from_slice(row);
    }
    partition.extract(values, &around, &cells, &mut patch);
    patch.shrink();
    Ok(patch)
}
