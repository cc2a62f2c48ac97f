//! What a segmentation will take: told with `--dry-run`, and refused where memory or disk do not hold it.

use super::Job;
use crate::cli::print;
use crate::cli::report::table;
use crate::cli::terminal::log;
use crate::cli::terminal::text::{bytes, duration, grouped, number, place, triple};
use crate::error::Result;
use crate::exec::{Budget, Progress};
use crate::job::disk::Disk;
use crate::pipeline::marks::split;
use crate::pipeline::segment::{Estimate, estimate};

impl Job {
    /// What the run will take.
    pub(in crate::cli) fn estimate(&self) -> Estimate {
        let guides = self.guides();
        let threads = self.resources.threads as u64;
        estimate(self.stack.as_ref(), &self.crop, &guides, &self.settings, threads, self.needs_store())
    }

    /// Refuses a run that cannot fit memory or disk. Returns what it takes of the disk at most.
    pub(crate) fn fits(&self, estimate: &Estimate) -> Result<u64> {
        let coarser =
            "a part of the image with --crop; a spacing of the image that is wrong is put right with --image-spacing";
        let disk = Disk::of_image(&self.resources, self.args.output.store(), estimate, coarser)?;
        let disk = if self.args.drawn.mesh.is_some() { disk.with_mesh_near(estimate.near_voxels) } else { disk };
        disk.check(|text| self.console.note(text))
    }

    /// The image and its settings in a few lines.
    pub(crate) fn describe(&self) -> String {
        let (g, s) = (&self.geometry, &self.settings);
        let unit = g.unit.as_deref().map_or(String::new(), |unit| format!(" {unit}"));
        let [x, y, z] = g.shape;
        format!(
            "image {x} x {y} x {z} (x, y, z) {}, spacing {}{unit}, origin {}\n\
             theta {} rho {} delta {} k {} sigma {} beta {} tau {} epsilon {} omega {} brick {} threads {}",
            self.stack.element().name(),
            triple(g.spacing),
            place(g.origin, g.min_spacing()),
            number(s.motion.theta),
            s.rho.map_or("automatic".into(), number),
            number(s.motion.delta_on(g)),
            number(s.k),
            s.sigma.map_or("automatic".into(), number),
            s.beta.map_or("automatic".into(), number),
            number(s.motion.tau_on(g)),
            number(s.motion.epsilon_on(g)),
            number(s.motion.omega),
            s.brick,
            self.resources.threads
        )
    }

    pub(crate) fn print_plan(&self, estimate: &Estimate) -> Result<()> {
        let (mut lines, mut objects) = (vec![self.describe()], Vec::new());
        for object in split(&self.marks.marks.cloud) {
            let points: usize = object.contours.iter().map(Vec::len).sum();
            let file = self.marks.marks.files[&object.object].display();
            let contours = if object.drawn { format!(" on {} contours", object.contours.len()) } else { String::new() };
            objects.push(format!("object {}: {points} marks{contours}, {file}", object.object));
        }
        lines.extend(table::cut(objects, "objects", "(info FILE --json has them all)"));
        for (n, seed) in self.args.seed.iter().enumerate() {
            let at = place(seed.centre, 0.1 * seed.radius);
            lines.push(format!("seed {}: a ball of radius {} at {at}", n + 1, number(seed.radius)));
        }
        let (least, allowed) = (Budget::least(estimate.held), self.resources.memory);
        let window = Budget { total: allowed.max(least) }.window(estimate.held).unwrap_or(0);
        let (scratch, folder) = (bytes(estimate.scratch), self.resources.scratch.display());
        lines.push(format!("{} voxels near the marks", grouped(estimate.near_voxels)));
        lines.push(format!(
            "memory: about {} are used; {} must be allowed at least, {} are (--memory)",
            bytes(estimate.resident(window)),
            bytes(least),
            bytes(allowed)
        ));
        lines.push(format!("temporary fields: about {scratch} in {folder}"));
        if self.needs_store() {
            lines.push(format!("output: up to {} before compression", bytes(estimate.output)));
        }
        lines.push(format!("time: very roughly {}\n", duration(estimate.seconds)));
        let output = if self.needs_store() { estimate.output } else { 0 };
        log::plan(least, estimate.scratch, output, estimate.seconds);
        print(&lines.join("\n"))
    }
}
