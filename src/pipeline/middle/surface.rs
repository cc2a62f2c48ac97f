//! Draws the surfaces between labels brick by brick, welded in grid order, and measures them.

use std::ops::Range;

use super::assembled::{Takes, Whole, send};
use super::crowded::Crowded;
use crate::error::Result;
use crate::exec::{Comm, Footprint, Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickId, DataSets, Geometry};
use crate::kernel::distance::features::labelled_shapes::LabelledShapes;
use crate::kernel::distance::features::source_labels;
use crate::kernel::distance::features::source_trees::SourceTrees;
use crate::kernel::image::labels;
use crate::kernel::surface::{
    Interfaces, Known, MarchingCubes, Measures, Nearby, Pair, Patch, TaggedPatch, cells_of_brick,
};
use crate::pipeline::output::drawn::{Drawn, STATED, Wave};
use crate::store::{BoxSource, MeshSink, Spill};

/// Edge of the boxes that the surface is drawn in, whatever the bricks are: so these do not tell the order of vertices.
const EDGE: i64 = 32;

/// Bytes of what is remembered for each voxel of the layer that is drawn.
const LAYER_BYTES: u64 = 64;

/// A run that is under way makes do with a smaller window than it is started with: so much less needs to be stated.
const SLACK: u64 = 16 << 20;
/// Bytes of a triangle that waits in a temporary file, at most; and how many triangles a plane has for each of its cells.
const WAITING_BYTES: u64 = 20;
const PLANE_TRIANGLES: u64 = 6;

/// What drawing takes of memory and disk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawing {
    /// Bytes that patches are stated with, and what goes with them.
    pub(super) stated: u64,
    /// Bytes of what is remembered of the layer that is drawn.
    layer: u64,
    /// Bytes of triangles that wait in a temporary file, where the surface goes into a mesh file.
    pub(super) waiting: u64,
}

impl Drawing {
    /// Of the surfaces between sources on so many threads. What they take beyond that is held as they are drawn.
    pub(super) fn new(geometry: &Geometry, sets: &DataSets, threads: usize) -> Self {
        let plane = libm::cbrt(geometry.domain().volume() as f64).powi(2) as u64;
        let crowded = Crowded::new(geometry, sets, EDGE);
        let stated = STATED.max(crowded.drawing(threads).saturating_sub(SLACK));
        let triangles = crowded.triangles().max(PLANE_TRIANGLES * plane);
        Self { stated, layer: LAYER_BYTES * plane, waiting: WAITING_BYTES * triangles }
    }

    /// What it holds.
    pub(super) fn footprint(&self) -> Footprint {
        Footprint::of_all(self.stated + self.layer)
    }
}

/// The voxels' nearest sources and what they are.
pub(super) struct Labelled<'a> {
    pub(super) geometry: &'a Geometry,
    pub(super) shapes: &'a LabelledShapes<'a>,
    pub(super) trees: &'a SourceTrees,
    pub(super) sources: &'a dyn BoxSource<u32>,
    /// The first two labels.
    pub(super) first_labels: [u32; 2],
}

/// Work buffers for one brick.
struct Worker {
    interfaces: Interfaces,
    nearby: Nearby,
    cubes: MarchingCubes,
    sources: Vec<u32>,
    labels: Vec<u32>,
}

/// The boxes that the surface is drawn in, and which of them this rank draws: a run of them, so that in order of ranks they are in
/// grid order.
pub(super) struct Boxes {
    grid: BrickGrid,
    own: Range<BrickId>,
}

impl Boxes {
    /// Of one of the ranks of `comm`.
    pub(super) fn new(geometry: &Geometry, comm: &dyn Comm) -> Self {
        let grid = BrickGrid::new(geometry.shape, EDGE);
        let cut = |rank: usize| grid.len() * rank as u64 / comm.ranks() as u64;
        Self { grid, own: cut(comm.rank())..cut(comm.rank() + 1) }
    }

    /// What drawing this rank's boxes reads.
    pub(super) fn reads(&self) -> impl Iterator<Item = Box3> {
        let domain = Box3::from_shape(self.grid.shape());
        self.own.clone().map(move |id| self.grid.brick_box(id).grow(2).intersect(&domain))
    }
}

/// Sends the surfaces between labels to `sink`, where so many bytes were stated for that; measures all of them, and each
/// pair. Of several ranks each draws its boxes, and the first puts the patches of all together, in their order: it alone has
/// something to send and to tell.
pub(super) fn draw(
    stage: &Stage<'_>,
    labelled: &Labelled<'_>,
    boxes: &Boxes,
    (kind, stated): (SurfaceKind, u64),
    sink: &mut dyn MeshSink,
) -> Result<(Measures, Vec<Pair>)> {
    let comm = stage.comm();
    let mut whole = Whole::new(labelled.geometry, sink);
    if comm.rank() == 0 {
        draw_own(stage, labelled, boxes, (kind, stated), &mut whole)?;
        for rank in 1..comm.ranks() {
            whole.take_from(comm, rank)?;
        }
    } else {
        let mut spill = Spill::new(stage.scratch().dir())?;
        draw_own(stage, labelled, boxes, (kind, stated), &mut spill)?;
        send(comm, spill.read_back()?)?;
    }
    Ok((whole.measure.measures(), whole.pairs.finish()))
}

/// Draws this rank's boxes.
fn draw_own(
    stage: &Stage<'_>,
    labelled: &Labelled<'_>,
    boxes: &Boxes,
    (kind, stated): (SurfaceKind, u64),
    to: &mut dyn Takes,
) -> Result<()> {
    let make = || Worker {
        interfaces: Interfaces::default(),
        nearby: Nearby::default(),
        cubes: MarchingCubes::new(0.5),
        sources: Vec::new(),
        labels: Vec::new(),
    };
    let (workers, with_gaps) = (Workers::new(make), to.wants_gaps());
    let bricks: Vec<BrickId> = boxes.own.clone().collect();
    let (mut drawn, mut left) = (Drawn::new(stage, stated), bricks.as_slice());
    while !left.is_empty() {
        let batch;
        (batch, left) = left.split_at(drawn.next().min(left.len()));
        let patches = stage.run(batch, &workers, |worker, &id| {
            let patch = worker.patch(labelled, &boxes.grid.brick_box(id), kind)?;
            let gaps = if with_gaps { labelled.gaps(&patch.patch) } else { Vec::new() };
            Ok((patch, gaps))
        })?;
        patches.iter().filter(|(patch, _)| !patch.patch.triangles.is_empty()).try_for_each(|patch| to.take(patch))?;
        let (last, tables) = to.holds();
        drawn.took(&Wave {
            patches: &patches.iter().map(|(patch, gaps)| patch.bytes() + 8 * gaps.len() as u64).collect::<Vec<_>>(),
            buffers: &workers.idle(Worker::bytes),
            last,
            tables: &tables,
            left: left.len(),
        })?;
    }
    Ok(())
}

impl Labelled<'_> {
    /// How wide the gap is at each vertex: its distances to both sets of a triangle that has it, summed.
    fn gaps(&self, patch: &Patch) -> Vec<f64> {
        let mut pairs = vec![[0; 2]; patch.positions.len()];
        for (corners, pair) in patch.triangles.iter().zip(&patch.pairs) {
            for &vertex in corners {
                pairs[vertex as usize] = *pair;
            }
        }
        let gap = |(position, pair): (&[f64; 3], [u32; 2])| {
            let world = self.world(*position);
            pair.map(|label| self.shapes.distance(world, self.trees.nearest(label, world))).iter().sum()
        };
        patch.positions.iter().zip(pairs).map(gap).collect()
    }

    fn world(&self, position: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| self.geometry.origin[a] + position[a] * self.geometry.spacing[a])
    }
}

impl Worker {
    fn bytes(&self) -> u64 {
        let dense = (self.sources.capacity() + self.labels.capacity()) * size_of::<u32>();
        self.interfaces.bytes() + self.nearby.bytes() + self.cubes.bytes() + dense as u64
    }

    fn patch(&mut self, labelled: &Labelled<'_>, brick: &Box3, kind: SurfaceKind) -> Result<TaggedPatch> {
        let mut patch = TaggedPatch::default();
        let Labelled { geometry, shapes, trees, .. } = *labelled;
        let cells = cells_of_brick(brick, geometry.shape, false);
        if cells.is_empty() {
            return Ok(patch);
        }
        let part = Box3::new(cells.lo, cells.hi.map(|v| v + 1)).grow(1).intersect(&geometry.domain());
        self.sources.resize(part.len(), 0);
        labelled.sources.read_box(&part, &mut self.sources)?;
        source_labels::of_sources(shapes.sets(), &self.sources, &mut self.labels);
        if self.labels.iter().all(|&label| label == self.labels[0]) {
            return Ok(patch);
        }
        match kind {
            SurfaceKind::Exact => {
                let (sources, labels, nearby) = (&mut self.sources, &self.labels, &mut self.nearby);
                nearby.enter(geometry, shapes, trees, &part, labels);
                nearby.settle(geometry, shapes, trees, labels, sources);
                let known = Known { geometry, shapes, nearby, trees, part, sources, labels };
                self.interfaces.extract(&known, &cells, &mut patch);
            }
            SurfaceKind::Labels => {
                let [low, high] = labelled.first_labels;
                self.cubes.extract(&labels::mask(&self.labels, high), &part, &cells, &mut patch.patch);
                patch.patch.pairs = vec![[low, high]; patch.patch.triangles.len()];
                patch.distances = self.distances_of(labelled, &part, &patch);
            }
        }
        patch.shrink();
        Ok(patch)
    }

    /// The distance of each vertex of a staircase: that of the nearest voxel's source.
    fn distances_of(&self, labelled: &Labelled<'_>, part: &Box3, patch: &TaggedPatch) -> Vec<f64> {
        let distance = |position: &[f64; 3]| {
            let world = labelled.world(*position);
            let source = self.sources[part.offset_of(position.map(|v| v.round() as i64))];
            labelled.shapes.distance(world, source)
        };
        patch.patch.positions.iter().map(distance).collect()
    }
}

/// Which surface is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceKind {
    /// Between the voxels, where both distances are equal.
    Exact,
    /// The isosurface 0.5 of the labels of two sets, as the papers draw it.
    Labels,
}
