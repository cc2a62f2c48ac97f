//! The surfaces equally far from labelled sources, in one box: what they are drawn from, and what that takes.

use super::crowded::Crowded;
use super::draw::{Draws, EDGE};
use super::touching::Touching;
use crate::error::Result;
use crate::exec::Footprint;
use crate::grid::{Box3, DataSets, Geometry};
use crate::kernel::distance::features::labelled_shapes::LabelledShapes;
use crate::kernel::distance::features::source_labels;
use crate::kernel::distance::features::source_trees::SourceTrees;
use crate::kernel::image::labels;
use crate::kernel::surface::{
    Interfaces, Known, MarchingCubes, Nearby, Sides, TaggedPatch, TouchingVoxels, Walls, cells_of_brick,
};
use crate::pipeline::output::drawn::STATED;
use crate::store::BoxSource;

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
    /// Which surface is drawn.
    pub(super) kind: SurfaceKind,
    /// The volume that all sources are from, whose labels touch in places.
    pub(super) touching: Option<&'a Touching>,
}

/// Work buffers for one brick.
pub(super) struct Worker {
    interfaces: Interfaces,
    nearby: Nearby,
    cubes: MarchingCubes,
    sources: Vec<u32>,
    labels: Vec<u32>,
    /// The walls between labels that touch, the labels that these are told from, and those of the voxels of the box.
    walls: Walls,
    around: Vec<u32>,
    own: Vec<u32>,
}

impl Draws for Labelled<'_> {
    type Work = Worker;

    fn geometry(&self) -> &Geometry {
        self.geometry
    }

    fn work(&self) -> Box<dyn Fn() -> Worker + Send + Sync> {
        let spacing = self.geometry.spacing;
        Box::new(move || Worker {
            interfaces: Interfaces::default(),
            nearby: Nearby::default(),
            cubes: MarchingCubes::new(0.5),
            sources: Vec::new(),
            labels: Vec::new(),
            walls: Walls::new(spacing),
            around: Vec::new(),
            own: Vec::new(),
        })
    }

    fn work_bytes(work: &Worker) -> u64 {
        work.bytes()
    }

    fn patch(&self, work: &mut Worker, part: &Box3) -> Result<TaggedPatch> {
        work.patch(self, part)
    }

    /// Its distances to both sets of a triangle that has it, summed; none where these touch.
    fn gaps(&self, TaggedPatch { patch, distances }: &TaggedPatch) -> Vec<f64> {
        let mut pairs = vec![[0; 2]; patch.positions.len()];
        for (corners, pair) in patch.triangles.iter().zip(&patch.pairs) {
            for &vertex in corners {
                pairs[vertex as usize] = *pair;
            }
        }
        let gap = |((position, &distance), pair): ((&[f64; 3], &f64), [u32; 2])| {
            if distance == 0.0 {
                return 0.0;
            }
            let world = self.world(*position);
            pair.map(|label| self.shapes.distance(world, self.trees.nearest(label, world))).iter().sum()
        };
        patch.positions.iter().zip(distances).zip(pairs).map(gap).collect()
    }
}

impl Labelled<'_> {
    fn world(&self, position: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| self.geometry.origin[a] + position[a] * self.geometry.spacing[a])
    }
}

impl Worker {
    fn bytes(&self) -> u64 {
        let dense = [&self.sources, &self.labels, &self.around, &self.own].map(Vec::capacity);
        let dense = (dense.iter().sum::<usize>() * size_of::<u32>()) as u64;
        self.interfaces.bytes() + self.nearby.bytes() + self.cubes.bytes() + self.walls.bytes() + dense
    }

    fn patch(&mut self, labelled: &Labelled<'_>, brick: &Box3) -> Result<TaggedPatch> {
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
        match labelled.kind {
            SurfaceKind::Exact => {
                let (sources, labels, nearby) = (&mut self.sources, &self.labels, &mut self.nearby);
                nearby.enter(geometry, shapes, trees, &part, labels);
                nearby.settle(geometry, shapes, trees, labels, sources);
                if let Some(volume) = labelled.touching {
                    volume.read(&part, &mut self.own)?;
                    volume.walls(&part, &mut self.around, &mut self.walls)?;
                }
                let touching = TouchingVoxels { own: &self.own, walls: &self.walls };
                let touching = labelled.touching.map(|_| touching);
                let known = Known { geometry, shapes, nearby, trees, part, sources, labels, touching };
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
