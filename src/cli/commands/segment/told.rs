//! What a segmentation leaves beside its fields: the report, and the marks that pictures of it show.

use super::Job;
use crate::cli::report::ranks::RankReport;
use crate::cli::report::run_report::{Found, Ran, Report, crop_xyz};
use crate::cli::report::settings::{Settings, Solver};
use crate::exec::Engine;
use crate::grid::DataSets;
use crate::pipeline::segment::Outcome;

impl Job {
    /// The marks of each object under its label.
    pub(super) fn marks_by_label(&self) -> DataSets {
        let mut objects: Vec<_> = self.objects.fit.iter().filter(|marks| marks.seed.is_none()).collect();
        objects.sort_by_key(|marks| marks.object);
        let mut sets = DataSets::default();
        for marks in objects {
            sets.add_labelled(marks.object, &marks.contours.concat());
        }
        sets
    }

    pub(super) fn report(
        &self,
        engine: &Engine,
        rank_reports: &[RankReport],
        outcome: &Outcome,
    ) -> Report<Settings, Found> {
        let (volume, output) = (&self.args.picture.volume, &self.args.output);
        let settings = Settings {
            image: self.names.image.clone(),
            points: self.names.points.clone(),
            seeds: self.args.seed.iter().map(|s| [s.centre[0], s.centre[1], s.centre[2], s.radius]).collect(),
            output: output.store().map(|path| path.display().to_string()),
            compress: output.compress.name(),
            ome: output.ome.name(),
            channel: volume.channel,
            axes: volume.pages.axes.map(|axes| axes.to_string()),
            image_index: volume.pages.image_index,
            time: self.time,
            level: volume.level,
            crop_xyz: crop_xyz(&self.crop),
            image_type: outcome.element.name(),
            solver: Solver::new(&self.settings, &self.geometry),
            scratch: self.resources.scratch.display().to_string(),
        };
        let ran = Ran {
            command: self.names.command,
            typed: &self.typed,
            resources: &self.resources,
            console: &self.console,
            engine,
            ranks: self.comm.ranks(),
            rank_reports,
            started: self.started,
        };
        Report::new(&ran, settings, &outcome.geometry, Found::new(outcome, &self.marks.origins))
    }
}
