//! Labels of a live store that are written while other objects are still solved: where no object can reach there are none, and where
//! one alone can, they are its own as soon as it has come to rest.
//!
//! How far an object reaches beyond its marks only its solution tells; here it is guessed (`likely_box`). So at the
//! end all labels are looked at, and were some shown that have become others, all are written again.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Mutex, PoisonError};

use super::image::{begin_image, type_for};
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::StoreWriter;
use crate::pipeline::output::pyramid::{Pyramid, Reduce, held, visits};
use crate::pipeline::segment::begun::Solution;
use crate::pipeline::segment::labels::{LabelVolume, Overlap, Placed};
use crate::pipeline::segment::neighbours::Joined;
use crate::pipeline::segment::reach::likely_box;
use crate::pipeline::segment::settings::{Guides, SegmentSettings};
use crate::store::{BoxSource, Element, ElementType};

/// Labels that are written as they come.
pub(crate) trait Early: Sync {
    /// The object of that number, counted in the order in which they were given, has come to rest.
    ///
    /// # Errors
    /// When its labels cannot be written or the run is interrupted.
    fn rest(&self, engine: &Engine, number: usize, label: u32, solution: &Solution) -> Result<()>;

    /// Writes what is left, when all objects have come to rest and are told from their neighbours.
    ///
    /// # Errors
    /// When a shard cannot be written or the run is interrupted.
    fn finish(&self, stage: &Stage<'_>, engine: &Engine, volume: &Joined<'_>) -> Result<()>;
}

/// Begins the labels of objects, and writes those where there are none.
///
/// # Errors
/// When the output cannot be written, scratch runs out or the run is interrupted.
pub(crate) fn begin_early(
    engine: &Engine,
    guides: &Guides<'_>,
    settings: &SegmentSettings,
    store: &StoreWriter,
) -> Result<Box<dyn Early>> {
    let highest = guides.objects.iter().map(|marks| marks.object).max().unwrap_or(0);
    Ok(match type_for(highest) {
        ElementType::U8 => Box::new(EarlyLabels::<u8>::new(engine, guides, settings, store)?),
        ElementType::U16 => Box::new(EarlyLabels::<u16>::new(engine, guides, settings, store)?),
        _ => Box::new(EarlyLabels::<u32>::new(engine, guides, settings, store)?),
    })
}

struct EarlyLabels<T: Element> {
    pyramid: Pyramid<T>,
    geometry: Geometry,
    visits: Vec<Visit>,
    workers: Workers<Buffers<T>>,
}

/// Chunks that are written one after the other.
struct Visit {
    chunks: Vec<Box3>,
    /// The objects that can reach them.
    reached: Reached,
    /// What was written, as a sum; nothing yet at first.
    shown: Mutex<Option<u64>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reached {
    ByNone,
    By(usize),
    BySeveral,
}

#[derive(Default)]
struct Buffers<T> {
    values: Vec<T>,
    reduced: Vec<T>,
}

impl<T: Element> EarlyLabels<T> {
    fn new(engine: &Engine, guides: &Guides<'_>, settings: &SegmentSettings, store: &StoreWriter) -> Result<Self> {
        let geometry = guides.geometry;
        let image = begin_image::<T>(store, geometry, guides.objects.iter().map(|marks| marks.object))?;
        let pyramid = Pyramid::new(engine, image, Reduce::Mode)?;
        let reaches: Vec<Box3> = guides.objects.iter().map(|marks| likely_box(marks, geometry)).collect();
        let visit = |chunks: Vec<Box3>| {
            let mut reaching = (0..reaches.len()).filter(|&n| chunks.iter().any(|chunk| meets(chunk, &reaches[n])));
            let reached = match (reaching.next(), reaching.next()) {
                (None, _) => Reached::ByNone,
                // Gaps between objects are shared out when all are there.
                (Some(n), None) if settings.fill_gaps.is_none() => Reached::By(n),
                _ => Reached::BySeveral,
            };
            Visit { chunks, reached, shown: Mutex::default() }
        };
        let visits = visits([pyramid.finest()], engine.threads()).into_iter().map(visit).collect();
        let early = Self { pyramid, geometry: geometry.clone(), visits, workers: Workers::new(Buffers::default) };
        let quiet = engine.beside();
        let nothing = LabelVolume::new(early.geometry.shape, Vec::new(), Overlap::First);
        early.write(&quiet.stage("early labels", 0), &nothing, |visit| visit.reached == Reached::ByNone)?;
        Ok(early)
    }

    /// Writes those visits that are chosen, from a source.
    fn write(&self, stage: &Stage<'_>, source: &dyn BoxSource<T>, choose: impl Fn(&Visit) -> bool) -> Result<()> {
        let chosen: Vec<&Visit> = self.visits.iter().filter(|visit| choose(visit)).collect();
        stage.run(&chosen, &self.workers, |Buffers { values, reduced }, visit| {
            let mut sum = DefaultHasher::new();
            for chunk in &visit.chunks {
                read(source, chunk, values, &mut sum)?;
                self.pyramid.put(chunk, values, reduced)?;
            }
            *visit.shown() = Some(sum.finish());
            Ok(())
        })?;
        Ok(())
    }

    /// Whether what is shown is what a source holds.
    fn holds(&self, stage: &Stage<'_>, source: &dyn BoxSource<T>) -> Result<bool> {
        let shown: Vec<&Visit> = self.visits.iter().filter(|visit| visit.shown().is_some()).collect();
        let same = stage.run(&shown, &self.workers, |Buffers { values, .. }, visit| {
            let mut sum = DefaultHasher::new();
            visit.chunks.iter().try_for_each(|chunk| read(source, chunk, values, &mut sum))?;
            Ok(*visit.shown() == Some(sum.finish()))
        })?;
        Ok(same.into_iter().all(|same| same))
    }
}

impl<T: Element> Early for EarlyLabels<T> {
    fn rest(&self, engine: &Engine, number: usize, label: u32, solution: &Solution) -> Result<()> {
        // Where there is no room for it beside what is solved, it waits.
        let Ok(_held) = engine.hold(held(&self.geometry, &[T::TYPE], engine.threads() as u64)) else { return Ok(()) };
        let placed = Placed { label, window: solution.window, u: &solution.u, volume: 0.0 };
        let own = LabelVolume::new(self.geometry.shape, vec![placed], Overlap::First);
        let quiet = engine.beside();
        self.write(&quiet.stage("early labels", 0), &own, |visit| visit.reached == Reached::By(number))
    }

    fn finish(&self, stage: &Stage<'_>, engine: &Engine, volume: &Joined<'_>) -> Result<()> {
        if self.holds(stage, volume)? {
            return self.write(stage, volume, |visit| visit.shown().is_none());
        }
        engine.note("labels that were shown while objects were solved have changed since; all are written again");
        self.pyramid.again();
        self.write(stage, volume, |_| true)
    }
}

impl Visit {
    fn shown(&self) -> std::sync::MutexGuard<'_, Option<u64>> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Reads a chunk, and adds its voxels to a sum.
fn read<T: Element>(
    source: &dyn BoxSource<T>,
    chunk: &Box3,
    values: &mut Vec<T>,
    sum: &mut DefaultHasher,
) -> Result<()> {
    values.resize(chunk.len(), T::default());
    match source.constant_in(chunk) {
        Some(value) => values.fill(value),
        None => source.read_box(chunk, values)?,
    }
    // Most chunks hold no label, and a sum of their places would take as long as all the rest.
    if values.iter().any(|&value| value != T::default()) {
        for value in values.iter() {
            (value.to_f64() as u32).hash(sum);
        }
    }
    Ok(())
}

fn meets(a: &Box3, b: &Box3) -> bool {
    !a.intersect(b).is_empty()
}
