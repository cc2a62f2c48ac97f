//! Fields on their way into multiscale images. A field is visited once, chunk by chunk of its finest level: what is put
//! into a `Pyramid` goes to the disk and, reduced, to the next coarser level, which waits in bricks until all is there of
//! one of its shards; that is then written, and goes on to the next level likewise.

use std::sync::Arc;
use std::sync::atomic::Ordering::{AcqRel, Acquire, Relaxed, Release};
use std::sync::atomic::{AtomicBool, AtomicU64};

use super::saved::{PartlyWritten, in_batches};
use super::share::{Piece, Share, all_threads};
use crate::error::{Error, Result};
use crate::exec::{Engine, Saved, Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickSet, Geometry, Slot};
use crate::io::ome_zarr::{ImageWriter, LevelWriter, joined_bytes, plan_levels, shard_bytes};
use crate::kernel::image::filter::downsample;
use crate::kernel::image::filter::downsample::coarse_box;
use crate::store::checkpoint::{SavedField, SomeBricks};
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
    /// The coarser levels, finest of them first.
    coarser: Vec<Coarser<T>>,
    /// Chunks come a second time: zeros replace what was there.
    again: AtomicBool,
}

/// A coarser level: what is known of it.
struct Coarser<T: Element> {
    waiting: BrickArray<T>,
    /// Voxels of the level below that are still to come, of each of its shards.
    missing: Vec<AtomicU64>,
    shards: Shards,
}

/// The shards of a level by number.
struct Shards {
    boxes: Vec<Box3>,
    counts: [i64; 3],
    shape: [i64; 3],
}

impl Shards {
    fn new(level: &LevelWriter) -> Self {
        let (shape, whole) = (level.shard_shape(), level.geometry().shape);
        let counts = std::array::from_fn(|a| (whole[a] + shape[a] - 1) / shape[a]);
        Self { boxes: level.shards().collect(), counts, shape }
    }

    /// The one that holds a voxel.
    fn of(&self, voxel: [i64; 3]) -> usize {
        Box3::from_shape(self.counts).offset_of(std::array::from_fn(|a| voxel[a] / self.shape[a]))
    }
}

impl<T: Element> Coarser<T> {
    fn new(engine: &Engine, levels: &[LevelWriter], n: usize) -> Result<Self> {
        let set = Arc::new(BrickSet::dense(BrickGrid::new(levels[n].geometry().shape, COARSE_EDGE)));
        let shards = Shards::new(&levels[n]);
        let missing = shards.boxes.iter().map(|shard| AtomicU64::new(voxels_below(levels, n, shard))).collect();
        Ok(Self { waiting: BrickArray::new(engine.scratch(), &set)?, missing, shards })
    }
}

impl<T: Element> Pyramid<T> {
    /// An image none of whose chunks is written.
    ///
    /// # Errors
    /// When scratch runs out.
    pub(crate) fn new(engine: &Engine, image: ImageWriter, reduce: Reduce) -> Result<Self> {
        let levels = image.levels();
        let coarser = (1..levels.len()).map(|n| Coarser::new(engine, levels, n)).collect::<Result<_>>()?;
        Ok(Self { image, reduce, coarser, again: AtomicBool::new(false) })
    }

    /// The finest level.
    pub(crate) fn finest(&self) -> &LevelWriter {
        &self.image.levels()[0]
    }

    /// Takes a chunk of the finest level; `buffer` is scratch. The last one below a shard of a coarser level writes that.
    ///
    /// # Errors
    /// When a shard cannot be written.
    pub(crate) fn put(&self, chunk: &Box3, values: &[T], buffer: &mut Vec<T>) -> Result<()> {
        self.put_finest(chunk, values)?;
        self.put_coarser(chunk, values, buffer)
    }

    /// Takes a chunk of the finest level for that alone.
    ///
    /// # Errors
    /// When its shard cannot be written.
    pub(crate) fn put_finest(&self, chunk: &Box3, values: &[T]) -> Result<()> {
        self.finest().write_chunk(chunk, values).map(|_| ())
    }

    /// Takes a chunk of the finest level for the coarser ones; `buffer` is scratch.
    ///
    /// # Errors
    /// When a shard cannot be written.
    pub(crate) fn put_coarser(&self, chunk: &Box3, values: &[T], buffer: &mut Vec<T>) -> Result<()> {
        let whole = self.reduce_into(1, chunk, values, buffer);
        self.complete(whole, buffer)
    }

    /// Writes a coarser level's shard that has become whole, and what becomes whole by that.
    fn complete(&self, mut whole: Option<(usize, Box3)>, buffer: &mut Vec<T>) -> Result<()> {
        let mut voxels = Vec::new();
        while let Some((n, shard)) = whole.take() {
            let level = &self.image.levels()[n];
            for chunk in shard.tiles(level.chunk_shape()) {
                voxels.resize(chunk.len(), T::default());
                self.coarser[n - 1].waiting.read_box(&chunk, &mut voxels)?;
                level.write_chunk(&chunk, &voxels)?;
                // A shard ends with its last chunk, and with it at most one of the next level.
                whole = self.reduce_into(n + 1, &chunk, &voxels, buffer).or(whole);
            }
        }
        Ok(())
    }

    /// Puts what a chunk of the level below is in level `n`; returns the shard of that level which has become whole.
    fn reduce_into(&self, n: usize, chunk: &Box3, values: &[T], buffer: &mut Vec<T>) -> Option<(usize, Box3)> {
        let (level, coarser) = (self.image.levels().get(n)?, self.coarser.get(n - 1)?);
        let part = coarse_box(chunk, level.factors());
        if self.again.load(Relaxed) || values.iter().any(|&value| value != T::default()) {
            buffer.resize(part.len(), T::default());
            self.reduce.reduce(values, chunk.shape(), level.factors(), buffer);
            coarser.waiting.write_box(&part, buffer);
        }
        coarser.came(n, &part, chunk.volume())
    }

    /// The chunks below level `n` that this rank has put there for others to write, with who does: of its visits, or of the shards
    /// that it has written of the level below.
    fn for_others(&self, n: usize, share: &Share<'_>) -> Vec<(usize, Box3)> {
        let (levels, coarser) = (self.image.levels(), &self.coarser[n - 1]);
        let owner = |level: usize, voxel: [i64; 3]| {
            let factors = levels[1..=level].iter().map(LevelWriter::factors);
            share.owner(factors.fold(voxel, |voxel, factors| std::array::from_fn(|a| voxel[a] * factors[a])))
        };
        let below: Vec<Box3> = if n == 1 {
            share.chunks().to_vec()
        } else {
            let own = self.coarser[n - 2].shards.boxes.iter().filter(|shard| owner(n - 1, shard.lo) == share.rank());
            own.flat_map(|shard| shard.tiles(levels[n - 1].chunk_shape())).collect()
        };
        let to = |chunk: &Box3| {
            let part = coarse_box(chunk, levels[n].factors());
            owner(n, coarser.shards.boxes[coarser.shards.of(part.lo)].lo)
        };
        below.into_iter().map(|chunk| (to(&chunk), chunk)).filter(|(to, _)| *to != share.rank()).collect()
    }

    /// What level `n` has of a chunk of the level below.
    fn piece(&self, n: usize, chunk: &Box3) -> Result<Piece<T>> {
        let part = coarse_box(chunk, self.image.levels()[n].factors());
        let mut values = vec![T::default(); part.len()];
        self.coarser[n - 1].waiting.read_box(&part, &mut values)?;
        if values.iter().all(|&value| value == T::default()) {
            values.clear();
        }
        Ok(Piece { part, below: chunk.volume(), values })
    }

    /// Takes all chunks once more, of a finest level that has changed since.
    pub(crate) fn again(&self) {
        self.again.store(true, Relaxed);
        let levels = self.image.levels();
        levels.iter().for_each(LevelWriter::forget);
        for (n, coarser) in (1..).zip(&self.coarser) {
            for (missing, shard) in coarser.missing.iter().zip(&coarser.shards.boxes) {
                missing.store(voxels_below(levels, n, shard), Release);
            }
        }
    }
}

impl<T: Element> PartlyWritten for Pyramid<T> {
    fn image(&self) -> &ImageWriter {
        &self.image
    }

    fn missing(&self) -> Vec<Vec<u64>> {
        let of = |coarser: &Coarser<T>| coarser.missing.iter().map(|missing| missing.load(Acquire)).collect();
        self.coarser.iter().map(of).collect()
    }

    fn waiting(&self) -> Vec<Box<dyn SavedField + '_>> {
        let waiting = (1..).zip(&self.coarser).map(|(n, coarser)| coarser.half_come(self.image.levels(), n));
        waiting.map(|bricks| Box::new(bricks) as Box<dyn SavedField>).collect()
    }

    fn join(&self, share: &Share<'_>) -> Result<()> {
        let mut buffer = Vec::new();
        for (n, coarser) in (1..).zip(&self.coarser) {
            let take = |piece: Piece<T>| {
                if !piece.values.is_empty() {
                    coarser.waiting.write_box(&piece.part, &piece.values);
                }
                self.complete(coarser.came(n, &piece.part, piece.below), &mut buffer)
            };
            share.exchange(&self.for_others(n, share), |chunk| self.piece(n, chunk), take)?;
        }
        Ok(())
    }

    fn go_on(&self, missing: &[Vec<u64>], saved: &Saved, first: usize) -> Result<()> {
        for (n, (coarser, known)) in self.coarser.iter().zip(missing).enumerate() {
            if known.len() != coarser.missing.len() {
                return Err(Error::failed("the checkpoint is of another image; leave --resume out to begin anew"));
            }
            saved.restore(first + n, &coarser.waiting)?;
            coarser.missing.iter().zip(known).for_each(|(missing, &known)| missing.store(known, Release));
        }
        Ok(())
    }
}

impl<T: Element> Coarser<T> {
    /// A box of level `n` is there, made of so many voxels below: its shard, if nothing of it is missing any more.
    fn came(&self, n: usize, part: &Box3, below: u64) -> Option<(usize, Box3)> {
        let shard = self.shards.of(part.lo);
        // What other threads have put is seen by the one that finds nothing missing.
        let before = self.missing[shard].fetch_sub(below, AcqRel);
        (before == below).then(|| (n, self.shards.boxes[shard]))
    }

    /// The bricks of level `n` that wait: of shards of which something has come and not all.
    fn half_come(&self, levels: &[LevelWriter], n: usize) -> SomeBricks<'_, T> {
        let set = self.waiting.set();
        let shards = self.missing.iter().zip(&self.shards.boxes);
        let half_come = shards.filter(|(missing, shard)| {
            let missing = missing.load(Acquire);
            missing > 0 && missing < voxels_below(levels, n, shard)
        });
        let bricks = half_come.flat_map(|(_, shard)| set.grid().bricks_in(shard));
        let mut slots: Vec<Slot> = bricks.filter_map(|id| set.slot(id)).collect();
        slots.sort_unstable();
        slots.dedup();
        SomeBricks { field: &self.waiting, slots }
    }
}

/// How many voxels of the level below a box of level `n` covers.
fn voxels_below(levels: &[LevelWriter], n: usize, part: &Box3) -> u64 {
    let factors = levels[n].factors();
    let fine = |corner: [i64; 3]| std::array::from_fn(|a| corner[a] * factors[a]);
    Box3::new(fine(part.lo), fine(part.hi)).intersect(&levels[n - 1].geometry().domain()).volume()
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
/// shard, in the finest level and in the coarser one that it makes whole, and of each thread a chunk as voxels, reduced, as bytes and compressed.
pub(crate) fn held(geometry: &Geometry, elements: &[ElementType], threads: u64) -> u64 {
    let chunk = COARSE_EDGE.pow(3) as u64 * 8;
    let levels: Vec<u64> = plan_levels(geometry).iter().take(2).map(|level| level.geometry.domain().volume()).collect();
    let bytes = |element: &ElementType| {
        let (shard, size) = (shard_bytes(geometry.shape, *element), element.size() as u64);
        let of_level = |voxels: &u64| threads.saturating_mul(shard).min(voxels.saturating_mul(size));
        let waiting = levels.iter().map(of_level).fold(0, u64::saturating_add);
        waiting.saturating_add(threads * 4 * chunk * size)
    };
    // A thread completes one shard at a time.
    let joined = elements.iter().map(|&element| threads * joined_bytes(geometry.shape, element)).max();
    elements.iter().map(bytes).fold(joined.unwrap_or(0), u64::saturating_add)
}

/// The boxes of an image that this rank of several writes, where [`write_levels`] does and its finest level has such shards and chunks.
///
/// # Errors
/// When another rank is gone.
pub(crate) fn written_by_this_rank(
    engine: &Engine,
    geometry: &Geometry,
    [shard, chunk]: [[i64; 3]; 2],
) -> Result<Vec<Box3>> {
    let comm = engine.comm();
    let visits = visits_of(geometry.domain(), vec![shard, chunk], all_threads(comm, engine.threads())?);
    Ok(visits[Share::new(comm, &visits, shard).own()].concat())
}

/// Fills all levels of an image from `source`, each rank of several its share of them, which it alone has to be able to read; where
/// the stage is resumable, a run that is ended in it is gone on with.
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
    let comm = engine.comm();
    let visits = visits([pyramid.finest()], all_threads(comm, engine.threads())?);
    let write = |(values, buffer): &mut (Vec<T>, Vec<T>), visit: &Vec<Box3>| {
        visit.iter().try_for_each(|chunk| {
            values.resize(chunk.len(), T::default());
            if source.constant_in(chunk) == Some(T::default()) {
                values.fill(T::default());
            } else {
                source.read_box(chunk, values)?;
            }
            pyramid.put(chunk, values, buffer)
        })
    };
    if comm.ranks() > 1 {
        let share = Share::new(comm, &visits, pyramid.finest().shard_shape());
        stage.expect(share.own().len() as u64);
        stage.run(&visits[share.own()], &workers, |worker, visit| write(worker, visit))?;
        return pyramid.join(&share);
    }
    in_batches(stage, &[&pyramid], &visits, &mut (), |batch, door, ()| {
        let visit =
            |worker: &mut _, &visit: &usize| if door.opens(visit) { write(worker, &visits[visit]) } else { Ok(()) };
        stage.run(batch, &workers, visit).map(drop)
    })
}

#[cfg(test)]
mod written_again;

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
                    &ImageSpec {
                        name: group,
                        geometry: &geometry,
                        element,
                        content: Content::Grey,
                        window: None,
                        extremes: None,
                    },
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
