//! `PointFile`: points as they were read from a file, with what its columns and notes say of them.

use super::point_units::LengthUnit;
use crate::grid::PointCloud;

/// How the numbers along an axis count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Lengths.
    Physical,
    /// Indices of voxels, the first one 0.
    Voxels,
    /// Indices of slices, which a file counted from 1; here the first one is 0 all the same.
    Slices,
}

impl Scale {
    /// The number of the first one in a file.
    pub(crate) fn first(self) -> f64 {
        f64::from(u8::from(self == Self::Slices))
    }
}

/// What a file of points holds, and how it is to be understood.
#[derive(Clone, Debug, PartialEq)]
pub struct PointFile {
    /// The points, their numbers as `scales` and `units` say.
    pub cloud: PointCloud,
    /// What the file is, in a few words.
    pub form: String,
    /// How the numbers along x, y and z count.
    pub scales: [Scale; 3],
    /// The units of those that are lengths, where the file tells them.
    pub units: [Option<LengthUnit>; 3],
    /// The time of each point, the first one 0; empty where the file names none.
    pub times: Vec<i64>,
    /// What the user should know about how the file was understood.
    pub notes: Vec<String>,
}

impl PointFile {
    /// Points whose numbers are lengths.
    #[must_use]
    pub fn physical(form: &str, cloud: PointCloud) -> Self {
        Self {
            cloud,
            form: form.into(),
            scales: [Scale::Physical; 3],
            units: [None; 3],
            times: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// The same points with all lengths in one unit, that of the first axis that tells one; which is told.
    pub(crate) fn in_one_unit(mut self) -> Self {
        let Some(to) = self.units.into_iter().flatten().next() else { return self };
        if self.units.into_iter().flatten().all(|unit| unit == to) {
            return self;
        }
        let told = (0..3).filter_map(|a| Some(format!("{} of {}", self.units[a]?.name, ["x", "y", "z"][a])));
        let told = told.collect::<Vec<_>>().join(", ");
        self.notes.push(format!("units differ ({told}); all lengths are told in {}", to.name));
        for (axis, unit) in self.units.iter_mut().enumerate() {
            if let Some(unit) = unit {
                let factor = unit.in_units_of(to);
                *unit = to;
                self.cloud.positions.iter_mut().for_each(|point| point[axis] *= factor);
            }
        }
        self
    }

    /// What is to be told where the points are taken as they are, without an image.
    pub(crate) fn notes_without_image(&self) -> Vec<String> {
        let mut notes = self.notes.clone();
        if self.scales != [Scale::Physical; 3] {
            let axes: Vec<&str> =
                (0..3).filter(|&a| self.scales[a] != Scale::Physical).map(|a| ["x", "y", "z"][a]).collect();
            let axes = axes.join(", ");
            notes.push(format!(
                "its {axes} are voxel indices and no lengths ({}); they are taken as they are",
                self.form
            ));
        }
        let first = self.times.first();
        if self.times.iter().any(|time| Some(time) != first) {
            notes.push("has points of several times; all of them are taken".into());
        }
        notes
    }
}
