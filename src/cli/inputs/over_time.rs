//! Marks of a series: which time each object's marks are taken from, and where they lie at another time.
//!
//! An object that is marked at the time has those marks. Else it has the marks of the nearest time at which it is marked, of two
//! equally near ones the earlier, moved as far as the image around it has moved since (`crate::pipeline::image::follow`).

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::PathBuf;

use serde::Serialize;

use super::marks::{Marks, Reading, read_marks};
use crate::cli::terminal::console::Console;
use crate::error::{Error, Result};
use crate::exec::Progress;
use crate::grid::{Geometry, PointCloud};
use crate::pipeline::image::follow::Follower;

/// The marks of all objects at all times.
pub(crate) struct MarksOverTime {
    marks: Marks,
    /// The time of each mark.
    times: Vec<u32>,
    /// The times at which each object is marked.
    marked: BTreeMap<u32, BTreeSet<u32>>,
}

/// The time that marks are of, and how far they were moved to where the object is at another time; physical.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Origin {
    pub(crate) marks_from: u32,
    pub(crate) shift_xyz: [f64; 3],
    /// False where the image did not tell how far.
    pub(crate) shift_is_told: bool,
}

/// An object at a time, and where its marks are from as far as that is known; seeds have none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    pub(crate) object: u32,
    pub(crate) origin: KnownOrigin,
}

/// As [`Origin`], where it may not have been looked at how far marks moved.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct KnownOrigin {
    #[serde(skip_serializing_if = "Option::is_none")]
    marks_from: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shift_xyz: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shift_is_told: Option<bool>,
}

/// The marks of one time, and where each object's are from.
pub(crate) struct MarksAt {
    pub(crate) marks: Marks,
    pub(crate) origins: BTreeMap<u32, Origin>,
}

impl MarksOverTime {
    /// Reads all files. Marks without a time are those of the first time that was chosen; `count` is how many times the image has.
    ///
    /// # Errors
    /// When a file cannot be read, or has marks of times that the image has not.
    pub(crate) fn read(
        paths: &[PathBuf],
        reading: &Reading<'_>,
        (chosen, count): (&Range<u32>, u32),
        console: &Console,
    ) -> Result<Self> {
        let marks = read_marks(paths, &Reading { time: None, ..*reading }, console)?;
        let mut times = Vec::with_capacity(marks.times.len());
        let mut without = BTreeSet::new();
        for (time, object) in marks.times.iter().zip(&marks.cloud.objects) {
            let Some(time) = *time else {
                without.insert(*object);
                times.push(chosen.start);
                continue;
            };
            let known = u32::try_from(time).ok().filter(|time| *time < count);
            let missing = || {
                let last = count - 1;
                Error::input(format!(
                    "has marks of time {time}, and the image has the times 0 to {last}, counted from 0"
                ))
                .at(&marks.files[object])
            };
            times.push(known.ok_or_else(missing)?);
        }
        let files: BTreeSet<&PathBuf> = without.iter().map(|object| &marks.files[object]).collect();
        for file in files.into_iter().filter(|_| chosen.len() > 1) {
            console.note(&format!(
                "{}: names no times (column t); its marks are those of time {}, and are moved from there with the image",
                file.display(),
                chosen.start
            ));
        }
        let mut marked: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
        for (time, object) in times.iter().zip(&marks.cloud.objects) {
            marked.entry(*object).or_default().insert(*time);
        }
        Ok(Self { marks, times, marked })
    }

    /// The numbers of all objects, with so many seeds, which are numbered on.
    pub(crate) fn objects(&self, seeds: usize) -> Vec<u32> {
        let last = self.marked.keys().last().copied().unwrap_or(0);
        self.marked.keys().copied().chain((1..=seeds as u32).map(|n| last.saturating_add(n))).collect()
    }

    /// All objects at a time with so many seeds, and where their marks are from; `moved` tells how far, where that was looked at.
    pub(crate) fn asked(&self, time: u32, seeds: usize, moved: Option<&BTreeMap<u32, Origin>>) -> Vec<Asked> {
        let origins = self.origins(time);
        let of = |object: u32| {
            let moved = moved.and_then(|moved| moved.get(&object));
            let origin = KnownOrigin {
                marks_from: origins.get(&object).copied(),
                shift_xyz: moved.map(|origin| origin.shift_xyz),
                shift_is_told: moved.map(|origin| origin.shift_is_told),
            };
            Asked { object, origin }
        };
        self.objects(seeds).into_iter().map(of).collect()
    }

    /// The time that each object's marks are taken from at a time.
    pub(crate) fn origins(&self, time: u32) -> BTreeMap<u32, u32> {
        let nearest = |times: &BTreeSet<u32>| times.iter().copied().min_by_key(|from| (from.abs_diff(time), *from));
        self.marked.iter().filter_map(|(object, times)| Some((*object, nearest(times)?))).collect()
    }

    /// The marks at a time where nothing moved: what a plan is made from.
    pub(crate) fn unmoved(&self, time: u32) -> MarksAt {
        let still = |from: u32| Origin { marks_from: from, shift_xyz: [0.0; 3], shift_is_told: true };
        self.moved(self.origins(time).into_iter().map(|(object, from)| (object, still(from))).collect())
    }

    /// The marks at a time, moved with the image, whose grid is `image`.
    ///
    /// # Errors
    /// When the image cannot be read.
    pub(crate) fn at(
        &self,
        time: u32,
        image: &Geometry,
        follower: &mut Follower<'_>,
        console: &Console,
    ) -> Result<MarksAt> {
        let mut origins = BTreeMap::new();
        for (object, from) in self.origins(time) {
            let bounds = self.bounds(object, from, image);
            let moved = follower.moved(object, bounds, from, time)?;
            if let Some(lost) = moved.lost_at {
                console.note(&format!(
                    "object {object}: the image does not tell where it is at time {lost}, seen from time {from}, where it is \
                     marked; no shift is taken for that step; mark it at time {time}"
                ));
            }
            // No shift is no negative one.
            let shift_xyz = std::array::from_fn(|a| moved.by[a] * image.spacing[a] + 0.0);
            origins.insert(object, Origin { marks_from: from, shift_xyz, shift_is_told: moved.lost_at.is_none() });
        }
        Ok(self.moved(origins))
    }

    /// The corners of the box around an object's marks at a time, in voxels of the image.
    fn bounds(&self, object: u32, time: u32, image: &Geometry) -> [[f64; 3]; 2] {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for n in self.of(object, time) {
            let voxel = image.to_voxels(self.marks.cloud.positions[n]);
            for a in 0..3 {
                bounds[0][a] = bounds[0][a].min(voxel[a]);
                bounds[1][a] = bounds[1][a].max(voxel[a]);
            }
        }
        bounds
    }

    /// The places of an object's marks of a time.
    fn of(&self, object: u32, time: u32) -> impl Iterator<Item = usize> {
        let all = self.times.iter().zip(&self.marks.cloud.objects).enumerate();
        all.filter(move |(_, (own, of))| **own == time && **of == object).map(|(n, _)| n)
    }

    /// Each object's marks of one time, moved.
    fn moved(&self, origins: BTreeMap<u32, Origin>) -> MarksAt {
        let all = &self.marks.cloud;
        let mut cloud = PointCloud::default();
        for (n, (position, object)) in all.positions.iter().zip(&all.objects).enumerate() {
            let Some(origin) = origins.get(object).filter(|origin| origin.marks_from == self.times[n]) else {
                continue;
            };
            cloud.positions.push(std::array::from_fn(|a| position[a] + origin.shift_xyz[a]));
            cloud.objects.push(*object);
            cloud.contours.extend(all.contours.get(n));
        }
        MarksAt { marks: self.marks.with_cloud(cloud), origins }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_those_of_the_nearest_time() {
        let mut marks = Marks::default();
        marks.cloud.positions = vec![[0.0; 3]; 4];
        marks.cloud.objects = vec![1, 1, 1, 2];
        let marked = BTreeMap::from([(1, BTreeSet::from([0, 4, 10])), (2, BTreeSet::from([7]))]);
        let marks = MarksOverTime { marks, times: vec![0, 4, 10, 7], marked };
        let from = |time: u32| marks.origins(time)[&1];
        assert_eq!([0, 2, 3, 4, 6, 7, 8, 20].map(from), [0, 0, 4, 4, 4, 4, 10, 10], "of two the earlier");
        assert!((0..20).all(|time| marks.origins(time)[&2] == 7));
        let at = marks.unmoved(3);
        assert_eq!((at.marks.cloud.objects, at.origins[&1].marks_from), (vec![1, 2], 4));
    }
}
