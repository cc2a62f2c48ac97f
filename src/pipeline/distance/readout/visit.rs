//! The one look at all voxels of a solved distance: chunk by chunk the solved state is read, told from which side of
//! meshes it is seen, measured for the report, and handed on to the images that are written.

use std::collections::BTreeMap;

use super::found::DistanceFound;
use super::images::{Buffers, Images, Wanted};
use super::kept::Kept;
use super::tile::Tile;
use crate::error::Result;
use crate::exec::{Engine, Workers};
use crate::grid::{Box3, DataSets, Geometry, NO_SOURCE};
use crate::io::ome_zarr::StoreWriter;
use crate::kernel::distance::features::closest_point::ClosestPoints;
use crate::kernel::distance::features::extent::extent;
use crate::kernel::distance::features::inside::{Flood, Inside};
use crate::kernel::distance::features::source_labels;
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::image::labels;
use crate::pipeline::distance::Solved;
use crate::pipeline::output::pyramid::{visits, visits_of};

/// What is read out, and how.
pub(crate) struct ReadOut<'a, 'b, P: Precision> {
    pub(crate) geometry: &'a Geometry,
    pub(crate) sets: &'a DataSets,
    pub(crate) solved: &'a Solved<'b, P>,
    /// Distances are negative inside meshes.
    pub(crate) is_signed: bool,
    pub(crate) wanted: Wanted,
    /// What stays with who asked for it.
    pub(crate) kept: Option<&'a Kept<P>>,
}

/// What one thread reads into.
#[derive(Default)]
struct Voxels<P> {
    values: Vec<P>,
    sources: Vec<u32>,
    labels: Vec<u32>,
    borders: Vec<u32>,
    /// With the voxels around, where borders are asked for.
    around: (Vec<P>, Vec<u32>, Vec<u32>),
    fixed: Vec<u8>,
    flood: Flood,
    inside: Vec<bool>,
}

/// What the voxels of a chunk hold, for the report.
#[derive(Default)]
struct Measured {
    max: f64,
    unlabelled: u64,
    label_voxels: BTreeMap<u32, u64>,
}

/// Edges of the boxes that voxels are looked at in where nothing is written: as if something was.
const LOOK_EDGES: [[i64; 3]; 2] = [[128; 3], [64; 3]];

impl<P: Precision> ReadOut<'_, '_, P> {
    /// Looks at all voxels; `store` gets the images, none when it is absent.
    ///
    /// # Errors
    /// When the output cannot be written, scratch runs out or the run is interrupted.
    pub(crate) fn run(&self, engine: &Engine, store: Option<&StoreWriter>) -> Result<DistanceFound> {
        let stage = engine.stage("read out", 0);
        stage.voxels(self.geometry.domain().volume());
        let images = store.map(|store| Images::<P>::new(engine, self.geometry, self.sets, self.wanted, store));
        let images = images.transpose()?;
        let inside = self.is_signed.then(|| Inside::new(self.geometry, &self.sets.mesh));
        let closest = ClosestPoints::new(self.geometry, self.sets);
        let visits = match &images {
            Some(images) => visits(images.finest(), engine.threads()),
            None => visits_of(self.geometry.domain(), LOOK_EDGES.to_vec(), engine.threads()),
        };
        let workers = Workers::new(|| (Voxels::default(), Buffers::default()));
        let measured = stage.run(&visits, &workers, |(voxels, buffers), visit| {
            visit.iter().try_fold(Measured::default(), |before, part| {
                let measured = self.measure(part, inside.as_ref(), voxels)?;
                if let Some(kept) = self.kept {
                    kept.put(&voxels.tile(part, &closest));
                }
                if let Some(images) = &images {
                    images.put(&voxels.tile(part, &closest), buffers)?;
                }
                Ok(before.and(measured))
            })
        })?;
        let measured = measured.into_iter().fold(Measured::default(), Measured::and);
        if let Some(images) = images {
            images.finish(&stage, engine, [if self.is_signed { -measured.max } else { 0.0 }, measured.max])?;
        }
        stage.finish();
        Ok(self.found(measured))
    }

    fn measure(&self, part: &Box3, inside: Option<&Inside<'_>>, voxels: &mut Voxels<P>) -> Result<Measured> {
        self.read(part, voxels)?;
        if let Some(inside) = inside {
            voxels.fixed.resize(part.len(), 0);
            self.solved.fixed.read_box(part, &mut voxels.fixed)?;
            inside.classify(part, &voxels.fixed, &mut voxels.flood, &mut voxels.inside);
            for (value, _) in voxels.values.iter_mut().zip(&voxels.inside).filter(|(_, inside)| **inside) {
                *value = P::from_f64(-value.to_f64());
            }
        }
        let (max, unlabelled) = extent(&voxels.values);
        Ok(Measured { max, unlabelled, label_voxels: labels::count(&voxels.labels) })
    }

    /// Reads what is asked for, once.
    fn read(&self, part: &Box3, voxels: &mut Voxels<P>) -> Result<()> {
        let Voxels { values, sources, labels, borders, around, .. } = voxels;
        if self.wanted.borders {
            let grown = part.grow(1).intersect(&self.geometry.domain());
            let (values_around, sources_around, labels_around) = around;
            self.read_both(&grown, values_around, sources_around)?;
            source_labels::of_sources(self.sets, sources_around, labels_around);
            borders.resize(part.len(), 0);
            labels::border(labels_around, &grown, part, borders);
            grown.cut(values_around, part, values);
            grown.cut(sources_around, part, sources);
            grown.cut(labels_around, part, labels);
            return Ok(());
        }
        if self.wanted.labels || self.wanted.closest_point {
            self.read_both(part, values, sources)?;
        } else {
            values.resize(part.len(), P::default());
            self.solved.values.read_box(part, values)?;
        }
        if self.wanted.labels {
            source_labels::of_sources(self.sets, sources, labels);
        }
        Ok(())
    }

    fn read_both(&self, part: &Box3, values: &mut Vec<P>, sources: &mut Vec<u32>) -> Result<()> {
        values.resize(part.len(), P::default());
        sources.resize(part.len(), NO_SOURCE);
        self.solved.read_both(part, values, sources)
    }

    fn found(&self, measured: Measured) -> DistanceFound {
        let mut label_voxels = measured.label_voxels;
        if self.wanted.labels {
            for &label in self.sets.labels() {
                label_voxels.entry(label).or_default();
            }
        }
        DistanceFound {
            max: measured.max,
            fixed_voxels: self.solved.fixed_voxels,
            unlabelled_voxels: measured.unlabelled,
            triangle_distances: (!self.sets.mesh.is_empty()).then_some(self.solved.triangle_distances),
            label_voxels,
        }
    }
}

impl<P> Voxels<P> {
    fn tile<'a>(&'a self, part: &'a Box3, closest: &'a ClosestPoints<'a>) -> Tile<'a, P> {
        let Self { values, sources, labels, borders, .. } = self;
        Tile { part, values, sources, labels, borders, closest }
    }
}

impl Measured {
    fn and(mut self, other: Self) -> Self {
        for (label, n) in other.label_voxels {
            *self.label_voxels.entry(label).or_default() += n;
        }
        Self { max: self.max.max(other.max), unlabelled: self.unlabelled + other.unlabelled, ..self }
    }
}
