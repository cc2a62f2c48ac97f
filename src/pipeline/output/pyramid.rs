//! Fields on their way into multiscale images. A field is visited once, chunk by chunk of its finest level: what is put
//! into a `Pyramid` goes to the disk and, reduced, to the next coarser level, which waits in bricks until the visit is
//! over and is then visited likewise.

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickSet, Geometry};
use crate::io::ome_zarr::{ImageWriter, LevelWriter, shard_bytes};
use crate::kernel::image::filter::downsample;
use crate::kernel::image::filter::downsample::coarse_box;
use crate::store::{BoxSource, BrickArray, Element, ElementType};

/// How several voxels become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduce {
    /// Their mean: intensities, distances, level sets.
    Mean,
    /// The most frequent one: labels.
    Mode,
}

impl Reduce {
    fn reduce<T: Element>(self, fine: &[T], shape: [i64; 3], factors: [i64; 3], coarse: &mut [T]) {
        match self {
            Self::Mean => downsample::mean(fine, shape, factors, coarse),
            Self::Mode => downsample::mode(fine, shape, factors, coarse),
        }
    }
}

/// Voxels along the edge of the bricks that coarser levels wait in: half of a chunk, so that most chunks fill one.
const COARSE_EDGE: i64 = 32;

/// An image that is being written.
pub(crate) struct Pyramid<T: Element> {
    image: ImageWriter,
    reduce: Reduce,
    /// What is known of the second level.
    coarser: Option<BrickArray<T>>,
}

impl<T: Element> Pyramid<T> {
    /// An image none of whose chunks is written.
    ///
    /// # Errors
    /// When scratch runs out.
    pub(crate) fn new(engine: &Engine, image: ImageWriter, reduce: Reduce) -> Result<Self> {
        let coarser = image.levels().get(1).map(|level| waiting(engine, level)).transpose()?;
        Ok(Self { image, reduce, coarser })
    }

    /// The finest level.
    pub(crate) fn finest(&self) -> &LevelWriter {
        &self.image.levels()[0]
    }

    /// Takes a chunk of the finest level; `buffer` is scratch.
    ///
    /// # Errors
    /// When its shard cannot be written.
    pub(crate) fn put(&self, chunk: &Box3, values: &[T], buffer: &mut Vec<T>) -> Result<()> {
        put(self.image.levels(), self.reduce, self.coarser.as_ref(), chunk, values, buffer)
    }

    /// Writes the coarser levels, when all chunks of the finest were put.
    ///
    /// # Errors
    /// When a shard cannot be written, scratch runs out or the run is interrupted.
    pub(crate) fn finish(self, stage: &Stage<'_>, engine: &Engine) -> Result<()> {
        let Self { image, reduce, mut coarser } = self;
        for n in 1..image.levels().len() {
            let levels = &image.levels()[n..];
            let Some(finer) = coarser.take() else { break };
            coarser = levels.get(1).map(|level| waiting(engine, level)).transpose()?;
            let workers = Workers::new(|| (Vec::new(), Vec::new()));
            stage.run(&visits(&levels[..1], engine.threads()), &workers, |(values, buffer), visit| {
                visit.iter().try_for_each(|chunk| {
                    values.resize(chunk.len(), T::default());
                    finer.read_box(chunk, values)?;
                    put(levels, reduce, coarser.as_ref(), chunk, values, buffer)
                })
            })?;
        }
        Ok(())
    }
}

/// Bricks of zeros for a level that waits for the visit of a finer one to end.
fn waiting<T: Element>(engine: &Engine, level: &LevelWriter) -> Result<BrickArray<T>> {
    let set = Arc::new(BrickSet::dense(BrickGrid::new(level.geometry().shape, COARSE_EDGE)));
    BrickArray::new(engine.scratch(), &set)
}

/// Writes a chunk of the first of some levels, and what it is in the next.
fn put<T: Element>(
    levels: &[LevelWriter],
    reduce: Reduce,
    coarser: Option<&BrickArray<T>>,
    chunk: &Box3,
    values: &[T],
    buffer: &mut Vec<T>,
) -> Result<()> {
    levels[0].write_chunk(chunk, values)?;
    let Some((level, coarser)) = levels.get(1).zip(coarser) else { return Ok(()) };
    if values.iter().all(|&value| value == T::default()) {
        return Ok(());
    }
    let part = coarse_box(chunk, level.factors());
    buffer.resize(part.len(), T::default());
    reduce.reduce(values, chunk.shape(), level.factors(), buffer);
    coarser.write_box(&part, buffer);
    Ok(())
}

/// Visits of the chunks of levels that have the same grid, so that those of a shard come soon one after the other. A visit
/// is for one thread; there are fewer and larger ones, a shard of each level or more, where that leaves enough for all.
pub(crate) fn visits<'a>(levels: impl IntoIterator<Item = &'a LevelWriter>, threads: usize) -> Vec<Vec<Box3>> {
    let mut edges: Vec<[i64; 3]> = Vec::new();
    let mut domain = Box3::from_shape([0; 3]);
    for level in levels {
        domain = level.geometry().domain();
        edges.extend([level.shard_shape(), level.chunk_shape()]);
    }
    visits_of(domain, edges, threads)
}

/// Visits of the tiles of a grid of the smallest of some edges, each a multiple of the smaller ones, likewise.
pub(crate) fn visits_of(domain: Box3, mut edges: Vec<[i64; 3]>, threads: usize) -> Vec<Vec<Box3>> {
    edges.sort_unstable_by_key(|edge| std::cmp::Reverse(edge.iter().product::<i64>()));
    edges.dedup();
    let mut visits = vec![vec![domain]];
    for edge in edges {
        let enough = visits.len() >= VISITS_PER_THREAD * threads;
        let cut = |parts: Vec<Box3>| parts.into_iter().flat_map(|part| part.tiles(edge)).collect::<Vec<Box3>>();
        visits = if enough {
            visits.into_iter().map(cut).collect()
        } else {
            visits.into_iter().flat_map(cut).map(|part| vec![part]).collect()
        };
    }
    visits
}

/// Visits for each thread that keep all of them busy to the end.
const VISITS_PER_THREAD: usize = 8;

/// Bytes that images of these types hold while all of them are written in one visit: chunks that wait for the last of their
/// shard, and of each thread a chunk as voxels, reduced, as bytes and compressed.
pub(crate) fn held(geometry: &Geometry, elements: &[ElementType], threads: u64) -> u64 {
    let chunk = COARSE_EDGE.pow(3) as u64 * 8;
    let bytes = |element: &ElementType| {
        let (shard, size) = (shard_bytes(geometry.shape, *element), element.size() as u64);
        let waiting = threads.saturating_mul(shard).min(geometry.domain().volume().saturating_mul(size));
        waiting.saturating_add(threads * 4 * chunk * size)
    };
    elements.iter().map(bytes).fold(0, u64::saturating_add)
}

/// Fills all levels of an image from `source`.
///
/// # Errors
/// When a shard cannot be written, scratch runs out or the run is interrupted.
pub fn write_levels<T: Element>(
    stage: &Stage<'_>,
    engine: &Engine,
    image: ImageWriter,
    source: &dyn BoxSource<T>,
    reduce: Reduce,
) -> Result<()> {
    let pyramid = Pyramid::new(engine, image, reduce)?;
    let workers = Workers::new(|| (Vec::new(), Vec::new()));
    stage.run(&visits([pyramid.finest()], engine.threads()), &workers, |(values, buffer), visit| {
        visit.iter().try_for_each(|chunk| {
            values.resize(chunk.len(), T::default());
            if source.constant_in(chunk) == Some(T::default()) {
                values.fill(T::default());
            } else {
                source.read_box(chunk, values)?;
            }
            pyramid.put(chunk, values, buffer)
        })
    })?;
    pyramid.finish(stage, engine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::ome_zarr::{Content, ImageSpec, StoreWriter};

    #[test]
    fn visits_take_each_chunk_once_shard_by_shard() {
        let folder = tempfile::tempdir().unwrap();
        let store = StoreWriter::create(&folder.path().join("out.zarr"), false).unwrap();
        let geometry = Geometry { shape: [300, 290, 270], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
        let image = |group, element| {
            store
                .image(
                    group,
                    &ImageSpec { name: group, geometry: &geometry, element, content: Content::Grey, window: None },
                )
                .unwrap()
        };
        let (wide, narrow) = (image("a", ElementType::F32), image("b", ElementType::U8));
        for threads in [1, 2, 64] {
            let visits = visits([&wide.levels()[0], &narrow.levels()[0]], threads);
            assert!(visits.len() >= 8 * threads.min(12), "{threads}: {}", visits.len());
            let chunks: Vec<Box3> = visits.concat();
            for shard in wide.levels()[0].shards().chain(narrow.levels()[0].shards()) {
                let inside = |chunk: &Box3| chunk.intersect(&shard) == *chunk;
                let first = chunks.iter().position(inside).unwrap();
                let together = chunks[first..].iter().take_while(|chunk| inside(chunk));
                assert_eq!(together.map(Box3::len).sum::<usize>(), shard.len(), "{shard:?}");
            }
            assert_eq!(chunks.iter().map(Box3::volume).sum::<u64>(), geometry.domain().volume());
        }
    }
}
