//! Puts the report of a run into its store: the page, and then `report.json`, which tells of a page that could not be made.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::document::{Document, Figures};
use super::evidence::{Evidence, Measure};
use super::slices::slices;
use super::views::{Surface, Viewer};
use crate::cli::outputs::files::write_whole;
use crate::cli::report::run_report::Report;
use crate::error::{Error, Result};
use crate::exec::{Engine, Plan, Progress, Stage};
use crate::io::ome_zarr::StoreWriter;

/// Objects whose surfaces are shown, the largest.
const MOST_SURFACES: usize = 12;

/// What the stage is called, and the seconds that it probably takes.
const STAGE: &str = "report page";
const SECONDS: f64 = 0.5;

/// The stages of a run that writes a report at its end, or none.
pub(crate) fn with_page(mut plan: Plan, writes: bool) -> Plan {
    plan.extend(writes.then(|| (STAGE.to_owned(), SECONDS)));
    plan
}

/// Where a report goes, and who hears of what goes wrong.
pub(crate) struct Written<'a> {
    pub(crate) store: &'a StoreWriter,
    pub(crate) engine: &'a Engine,
    pub(crate) console: &'a dyn Progress,
}

impl Written<'_> {
    /// Writes `report.html` and `report.json`; a page that cannot be made costs a note.
    ///
    /// # Errors
    /// When the report cannot be written or the run is interrupted.
    pub(crate) fn write<S: Serialize, R: Serialize>(
        &self,
        evidence: &Evidence<'_>,
        report: impl Fn() -> Report<S, R>,
    ) -> Result<()> {
        let stage = self.engine.stage(STAGE, 0);
        let made = self.page(&stage, evidence, &report());
        // A stage that a signal has ended is not told as done.
        self.engine.check()?;
        stage.finish();
        if let Err(error) = made {
            self.console.note(&format!("report.html is left out: {error}"));
        }
        report().write(&self.store.file("report.json")?, true)
    }

    fn page<S: Serialize, R: Serialize>(
        &self,
        stage: &Stage<'_>,
        evidence: &Evidence<'_>,
        report: &Report<S, R>,
    ) -> Result<()> {
        let path = self.store.file("report.html")?;
        let told = serde_json::to_value(report)
            .map_err(|error| Error::failed(format!("the report cannot be told: {error}")).caused_by(error))?;
        let figures = self.figures(stage, evidence, &told)?;
        let stages = self.engine.reports();
        let document =
            Document { report: &told, typed: &report.arguments, stages: &stages, evidence, figures: &figures };
        let page = document.page()?;
        write_whole(&path, true, |file| std::io::Write::write_all(file, page.as_bytes()))
            .map_err(|error| Error::from_io("cannot be written", &error))
    }

    fn figures(&self, stage: &Stage<'_>, evidence: &Evidence<'_>, report: &Value) -> Result<Figures> {
        let folder = self.store.folder();
        let slices = slices(stage, folder, evidence)?;
        let all = surfaces(folder, evidence, &report["result"]);
        let mut figures = Figures { slices, surfaces: Vec::new(), more_surfaces: 0, notes: Vec::new() };
        if all.is_empty() {
            return Ok(figures);
        }
        let Ok(_taken) = self.engine.hold(Viewer::bytes(evidence)) else {
            figures.notes.push("The memory of the run is too little to draw the surface; it is in meshes/.".into());
            return Ok(figures);
        };
        let viewer = Viewer::new(folder, evidence, all.len() > 1);
        figures.notes.extend(viewer.note());
        figures.more_surfaces = all.len().saturating_sub(MOST_SURFACES);
        for surface in all.iter().take(MOST_SURFACES) {
            let views = viewer.look(stage, self.engine, surface)?;
            figures.surfaces.extend(views.map(|views| (surface.label, views)));
        }
        Ok(figures)
    }
}

/// The surfaces in the store, the largest first.
fn surfaces(folder: &Path, evidence: &Evidence<'_>, result: &Value) -> Vec<Surface> {
    let single = |label: u32| Surface { file: "meshes/surface.ply".into(), label };
    let mut found: Vec<(f64, Surface)> = match result["objects"].as_array().map(Vec::as_slice) {
        Some(objects) => objects
            .iter()
            .map(|object| {
                let label = object["label"].as_u64().unwrap_or(0) as u32;
                let file = format!("meshes/object-{label}.ply");
                let alone = objects.len() == 1 && !folder.join(&file).exists();
                let surface = if alone { single(label) } else { Surface { file, label } };
                (object["area"].as_f64().unwrap_or(0.0), surface)
            })
            .collect(),
        None => vec![(0.0, single(u32::from(evidence.measure == Measure::ToMarks)))],
    };
    found.retain(|(_, surface)| folder.join(&surface.file).exists());
    found.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    found.into_iter().map(|(_, surface)| surface).collect()
}
