//! The order of planes in a file: from (channel, time, z) to the number of a plane.

use crate::error::Result;
use crate::io::stack::interval::Interval;
pub(crate) use crate::io::stack::page_axes::Axis;
use crate::io::stack::tiff::pages::ifd::TiffFile;
use crate::io::stack::tiff::pages::page::Page;

/// The number of planes along each axis, fastest axis first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Dimensions(pub(crate) [(Axis, u64); 3]);

impl Dimensions {
    /// A stack with nothing but z.
    pub(crate) fn only_z(planes: u64) -> Self {
        Self([(Axis::Channel, 1), (Axis::Z, planes), (Axis::Time, 1)])
    }

    /// Planes along one axis.
    pub(crate) fn size(&self, axis: Axis) -> u64 {
        self.0.iter().find(|(a, _)| *a == axis).map_or(1, |&(_, n)| n)
    }

    /// Planes in all; `None` past 64 bits.
    pub(crate) fn count(&self) -> Option<u64> {
        self.0.iter().try_fold(1_u64, |product, &(_, n)| product.checked_mul(n))
    }

    /// The axes of more than one plane, slowest first.
    pub(crate) fn long(&self) -> Vec<(Axis, u64)> {
        self.0.iter().rev().copied().filter(|&(_, n)| n > 1).collect()
    }

    /// The number of the plane, counted from 0, in the order of the file.
    pub(crate) fn plane(&self, channel: u64, time: u64, z: u64) -> u64 {
        self.0.iter().rev().fold(0_u64, |number, &(axis, n)| {
            let index = match axis {
                Axis::Channel => channel,
                Axis::Z => z,
                Axis::Time => time,
            };
            number.saturating_mul(n).saturating_add(index)
        })
    }

    /// The axes as letters, slowest first: `TZCYX`, with `S` for samples inside a pixel.
    pub(crate) fn letters(&self, page: &Page) -> String {
        let mut letters: String =
            self.0.iter().rev().filter(|&&(a, n)| n > 1 || a == Axis::Z).map(|(a, _)| a.letter()).collect();
        letters.push_str(match (page.kind.samples > 1, page.planar) {
            (true, true) => "SYX",
            (true, false) => "YXS",
            (false, _) => "YX",
        });
        letters
    }
}

/// A run of planes that lie in consecutive pages (a `TiffData` element).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) plane: u64,
    pub(crate) page: u64,
    pub(crate) count: u64,
}

/// What the description of a file says about its planes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Description {
    /// Absent where the file says nothing: then every page is a plane along z.
    pub(crate) dimensions: Option<Dimensions>,
    /// The pages of the planes, where they do not simply follow each other.
    pub(crate) runs: Option<Vec<Run>>,
    /// Distance between voxel centres along x, y, z, where it is known.
    pub(crate) spacing: [Option<f64>; 3],
    /// The unit of `spacing` as OME-Zarr spells it.
    pub(crate) unit: Option<String>,
    /// The time from one volume to the next, where it is known.
    pub(crate) interval: Option<Interval>,
    /// True when the planes may follow the first one without pages of their own.
    pub(crate) single_page: bool,
    /// Why pages cannot be taken for planes of rows, unless the user says what they are.
    pub(crate) objection: Option<String>,
    /// What the user should know about the choice that was made.
    pub(crate) notes: Vec<String>,
}

impl Description {
    /// A file that says nothing about its planes.
    pub(crate) fn none() -> Self {
        Self {
            dimensions: None,
            runs: None,
            spacing: [None; 3],
            unit: None,
            interval: None,
            single_page: false,
            objection: None,
            notes: Vec::new(),
        }
    }

    /// The page of every wanted plane, counted from 0, of `total` planes and `available` pages.
    pub(crate) fn pages(&self, file: &TiffFile, planes: &[u64], total: u64, available: u64) -> Result<Vec<u64>> {
        let pages: Vec<Option<u64>> = match &self.runs {
            None => planes.iter().copied().map(Some).collect(),
            Some(runs) => pages_of_runs(runs, planes),
        };
        let found = pages.iter().map(|page| page.filter(|&page| page < available)).collect::<Option<Vec<u64>>>();
        found.ok_or_else(|| {
            let lost = planes.iter().zip(&pages).find(|(_, page)| page.is_none_or(|page| page >= available));
            let (plane, page) = lost.map_or((0, None), |(&plane, &page)| (plane, page));
            let place = match page {
                Some(page) => format!("places plane {} on page {}", plane + 1, page.saturating_add(1)),
                None => format!("names no page for plane {}", plane + 1),
            };
            let promise = if total > available { format!("promises {total} planes but the file holds {available} pages, and ") } else { String::new() };
            file.error(format!(
                "the description {promise}{place}: the file is truncated or was edited; give --axes zyx to read the pages that \
                 are there as slices"
            ))
        })
    }
}

/// The pages that hold `planes`, none where no run does; where runs overlap the later one counts.
fn pages_of_runs(runs: &[Run], planes: &[u64]) -> Vec<Option<u64>> {
    let mut sorted: Vec<(usize, Run)> = runs.iter().copied().enumerate().collect();
    sorted.sort_by_key(|(place, run)| (run.plane, *place));
    let page_of = |&plane: &u64| {
        // The last run that begins at or before the plane; runs that overlap otherwise are no valid OME-TIFF.
        let after = sorted.partition_point(|(_, run)| run.plane <= plane);
        let holder = sorted[..after].last().filter(|(_, run)| plane - run.plane < run.count);
        holder.map(|(_, run)| run.page.saturating_add(plane - run.plane))
    };
    planes.iter().map(page_of).collect()
}
