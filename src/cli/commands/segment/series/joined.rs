//! The stores of all times as one: images with an axis of time, what belongs to single times in groups of theirs, one report.
//!
//! `times/tNNNN` has the fields of a time, each object's in a box of its own, which is another at another time, its marks and its
//! report; `meshes/tNNNN` its surfaces.

use std::fmt::Write;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Series;
use super::work::Work;
use crate::cli::inputs::settings;
use crate::cli::outputs::files::write_whole;
use crate::cli::report::page::series::{Slices, page, slices_of};
use crate::cli::report::series::{TimeReport, Whole};
use crate::cli::terminal::console::{Console, Voice};
use crate::error::{Error, Result};
use crate::exec::Progress;
use crate::grid::DataSets;
use crate::io::geometry::read::point_file::PointFile;
use crate::io::geometry::read::points::read_points;
use crate::io::ome_zarr::{LiveState, StoreWriter, TIMES, time_name};

/// What of a time's store goes into its group.
const OF_TIME: [&str; 5] = ["levelset", "distance", "marks.csv", "report.json", "report.html"];
/// The images that get an axis of time.
const IMAGES: [&str; 2] = ["", "labels/segmentation"];

impl Series<'_> {
    /// Joins a time that is done: its images, and what belongs to it alone. A live store shows it from now on.
    ///
    /// # Errors
    /// When files cannot be written.
    pub(super) fn join(
        &self,
        work: &Work,
        store: &StoreWriter,
        TimeReport { time, report, .. }: &TimeReport,
    ) -> Result<()> {
        let Some(from) = work.store_there(*time) else { return Ok(()) };
        let (n, count) = ((time - self.times.start) as usize, self.times.len());
        if report.is_some() {
            let group = format!("{TIMES}/{}", time_name(*time));
            store.group(&group)?;
            for part in OF_TIME {
                store.take_over(&from, part, &format!("{group}/{part}"))?;
            }
            store.take_over(&from, "meshes", &format!("meshes/{}", time_name(*time)))?;
        }
        for image in IMAGES {
            store.join_time(image, (n, count), &from, &self.axis)?;
        }
        let done = (n + 1) as f64 / count as f64;
        store.live().map_or(Ok(()), |root| root.tell(LiveState::Running, done))
    }

    /// Tells of all times, which are joined.
    ///
    /// # Errors
    /// When files cannot be written.
    pub(super) fn finish(&self, work: &Work, store: Option<StoreWriter>, times: &[TimeReport]) -> Result<()> {
        let output = &self.args.output;
        if let Some(store) = &store {
            let stores: Vec<Option<PathBuf>> = times.iter().map(|time| work.store_there(time.time)).collect();
            if let Some(marks) = all_marks(&stores, times)? {
                write(&store.file("marks.csv")?, true, &marks)?;
            }
        }
        let mut notes = self.console.notes();
        for note in times.iter().filter_map(|time| time.report.as_ref()).flat_map(|report| {
            report["notes"].as_array().into_iter().flatten().filter_map(|note| note.as_str().map(ToOwned::to_owned))
        }) {
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
        let whole = Whole {
            times,
            chosen: &self.times,
            axis: &self.axis,
            output: output.store().map(|path| path.display().to_string()),
            notes,
            seconds: self.started.elapsed().as_secs_f64(),
        };
        if let Some(store) = store {
            self.write_report(&store, &whole, &self.slices(work, times)?)?;
            store.finish()?;
        }
        if let Some(path) = &output.report {
            write(path, output.overwrite, &json(&whole)?)?;
        }
        self.print(&whole.told(&self.whole_in()))
    }

    /// Slices through the first, the middle and the last time that were solved; where there is no memory for them, a note.
    fn slices(&self, work: &Work, times: &[TimeReport]) -> Result<Vec<Slices>> {
        let solved: Vec<u32> = times.iter().filter(|time| time.report.is_some()).map(|time| time.time).collect();
        let mut chosen: Vec<u32> = [0, solved.len() / 2, solved.len().saturating_sub(1)]
            .iter()
            .filter_map(|&n| solved.get(n).copied())
            .collect();
        chosen.dedup();
        let engine = settings::resources(&self.args.resources, self.args.output.store())?
            .engine(&self.cancel, Arc::new(Console::new(Voice::Quiet)))?;
        let stage = engine.stage("slices", 0);
        let of = |time: u32| -> Result<Option<Slices>> {
            let Some(store) = work.store_there(time) else { return Ok(None) };
            let mut marks = DataSets::default();
            if let Ok(PointFile { cloud, .. }) = read_points(&store.join("marks.csv")) {
                marks.add_cloud(&cloud.positions);
            }
            Ok(Some(Slices { time, pictures: slices_of(&stage, &store, &marks, &self.geometry)? }))
        };
        let made: Result<Vec<Option<Slices>>> = chosen.into_iter().map(of).collect();
        self.cancel.check()?;
        Ok(made
            .unwrap_or_else(|error| {
                self.console.note(&format!("report.html has no slices: {error}"));
                Vec::new()
            })
            .into_iter()
            .flatten()
            .collect())
    }

    fn write_report(&self, store: &StoreWriter, whole: &Whole<'_>, slices: &[Slices]) -> Result<()> {
        write(&store.file("volumes.csv")?, true, &whole.table())?;
        let path = store.file("report.html")?;
        let folder = store.folder();
        let of = |time: u32| {
            Some(format!("{TIMES}/{}/report.html", time_name(time))).filter(|page| folder.join(page).exists())
        };
        match page(whole, self.typed, slices, &of).and_then(|page| write(&path, true, &page)) {
            Ok(()) => {}
            Err(error) => self.console.note(&format!("report.html is left out: {error}")),
        }
        write(&store.file("report.json")?, true, &json(whole)?)
    }
}

fn json(whole: &Whole<'_>) -> Result<String> {
    let text = serde_json::to_string_pretty(&whole.report())
        .map_err(|error| Error::failed(format!("the report cannot be told: {error}")).caused_by(error))?;
    Ok(text + "\n")
}

/// The marks of all times, moved as they were, with their times; none where objects grew from seeds alone.
fn all_marks(stores: &[Option<PathBuf>], times: &[TimeReport]) -> Result<Option<String>> {
    let mut all = String::from("object,contour,t,x,y,z\n");
    let empty = all.len();
    for (store, time) in stores.iter().zip(times) {
        let Some(path) = store.as_ref().map(|store| store.join("marks.csv")).filter(|path| path.exists()) else {
            continue;
        };
        let text = std::fs::read_to_string(&path).map_err(|e| Error::from_io("cannot read marks", &e).at(&path))?;
        for line in text.lines().skip(1) {
            let mut cells = line.splitn(3, ',');
            if let (Some(object), Some(contour), Some(place)) = (cells.next(), cells.next(), cells.next()) {
                // A string takes whatever is written.
                let _ = writeln!(all, "{object},{contour},{},{place}", time.time);
            }
        }
    }
    Ok((all.len() > empty).then_some(all))
}

fn write(path: &Path, replace: bool, text: &str) -> Result<()> {
    write_whole(path, replace, |file| io::Write::write_all(file, text.as_bytes()))
        .map_err(|error| Error::from_io("cannot be written", &error).at(path))
}
