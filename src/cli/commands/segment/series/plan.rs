//! What a series will take: told with `--dry-run`, and refused where memory or disk do not hold it.

use super::Series;
use crate::cli::commands::segment::Job;
use crate::cli::print;
use crate::cli::report::table;
use crate::cli::terminal::log;
use crate::cli::terminal::text::{bytes, duration};
use crate::error::Result;
use crate::exec::{Budget, Progress};
use crate::job::disk::Disk;
use crate::pipeline::segment::Estimate;

impl Series<'_> {
    /// Refuses a series of which a time does not fit memory, or whose times together do not fit the disk.
    pub(super) fn fits(&self, plans: &[(Job, u32)]) -> Result<()> {
        let mut largest: Option<(&Job, Estimate)> = None;
        let mut output = 0_u64;
        for (job, count) in plans {
            let estimate = job.estimate();
            output = output.saturating_add(estimate.output.saturating_mul(u64::from(*count)));
            if largest.as_ref().is_none_or(|(_, most)| estimate.held > most.held) {
                largest = Some((job, estimate));
            }
        }
        let Some((job, estimate)) = largest else { return Ok(()) };
        job.fits(&estimate)?;
        let all = Estimate { output, ..estimate };
        let fewer = "fewer times with --time A:B, or a part of the image with --crop";
        Disk::of_image(&job.resources, self.args.output.store(), &all, fewer)?
            .check(|text| self.console.note(text))
            .map(drop)
    }

    /// Prints the plan of all times.
    pub(super) fn print_plan(&self) -> Result<()> {
        let plans = self.plans()?;
        let (mut least, mut scratch, mut output, mut seconds) = (0, 0, 0_u64, 0.0);
        let mut lines = Vec::new();
        for (job, count) in &plans {
            let estimate = job.estimate();
            if lines.is_empty() {
                lines.push(job.describe());
            }
            lines.extend(told(job, *count));
            least = least.max(Budget::least(estimate.held));
            scratch = scratch.max(estimate.scratch);
            output = output.saturating_add(estimate.output.saturating_mul(u64::from(*count)));
            seconds += estimate.seconds * f64::from(*count);
        }
        let Some((job, _)) = plans.first() else { return Ok(()) };
        let (allowed, folder) = (bytes(job.resources.memory), job.resources.scratch.display().to_string());
        lines.push(format!("times {} to {}, one after the other", self.times.start, self.times.end - 1));
        lines.push(format!("memory: {} must be allowed at least, {allowed} are (--memory)", bytes(least)));
        lines.push(format!("temporary fields: about {} in {folder}", bytes(scratch)));
        let kept = if self.args.output.store().is_some() { output } else { 0 };
        if kept > 0 {
            lines.push(format!("output: up to {} before compression", bytes(kept)));
        }
        lines.push(format!("time: very roughly {}\n", duration(seconds)));
        log::plan(least, scratch, kept, seconds);
        print(&lines.join("\n"))?;
        self.fits(&plans)
    }
}

/// The marks of times that have the same.
fn told(job: &Job, count: u32) -> Vec<String> {
    let times = if count == 1 {
        format!("time {}", job.time)
    } else {
        format!("times {} to {}", job.time, job.time + count - 1)
    };
    let origins = &job.marks.origins;
    let of = |object: &u32, from: u32| {
        let marks = job.marks.marks.cloud.objects.iter().filter(|other| *other == object).count();
        format!("{times}: object {object} from its {marks} marks of time {from}")
    };
    table::cut(
        origins.iter().map(|(object, origin)| of(object, origin.marks_from)).collect(),
        "objects",
        "(info FILE --json has them all)",
    )
}
