//! Border marks become a cloud: contours are closed by interpolation, the ends of an object by caps.
//!
//! Neighbouring marks of a contour are joined linearly at no more than one voxel apart (docs/algorithms.md, "Marks as a
//! cloud"). An object that is marked only along its sides is an open tube, so the plane of its first and of its last
//! contour is filled with points. A mark on a slice says that the object is there through the whole slice:
//! caps lie half a slice beyond the outermost contours, and those contours are drawn out to the caps.

use std::collections::BTreeMap;

use crate::grid::{Geometry, PointCloud};

/// A ball that an object starts as, where it has no marks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seed {
    /// Its centre, world coordinates.
    pub centre: [f64; 3],
    /// Its radius, physical.
    pub radius: f64,
}

/// The marks of one object.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectMarks {
    /// The object's number.
    pub object: u32,
    /// Its marks by contour, in the order of the file; one entry when the file names no contours.
    pub contours: Vec<Vec<[f64; 3]>>,
    /// The contours' numbers in the file.
    pub numbers: Vec<i64>,
    /// True when the file names contours: only then are marks joined and ends capped.
    pub drawn: bool,
    /// The ball it starts as; then it has no marks.
    pub seed: Option<Seed>,
}

impl ObjectMarks {
    /// The marks, moved.
    #[must_use]
    pub fn moved(&self, by: [f64; 3]) -> Self {
        let moved = |p: &[f64; 3]| std::array::from_fn(|a| p[a] + by[a]);
        Self {
            contours: self.contours.iter().map(|contour| contour.iter().map(moved).collect()).collect(),
            seed: self.seed.map(|seed| Seed { centre: moved(&seed.centre), ..seed }),
            numbers: self.numbers.clone(),
            ..*self
        }
    }
}

/// Splits a cloud into objects, in order of their numbers, and their contours.
#[must_use]
pub fn split(cloud: &PointCloud) -> Vec<ObjectMarks> {
    let mut objects: BTreeMap<u32, BTreeMap<i64, Vec<[f64; 3]>>> = BTreeMap::new();
    for (n, &position) in cloud.positions.iter().enumerate() {
        let object = cloud.objects.get(n).copied().unwrap_or(1);
        let contour = cloud.contours.get(n).copied().unwrap_or(0);
        objects.entry(object).or_default().entry(contour).or_default().push(position);
    }
    let drawn = !cloud.contours.is_empty();
    objects
        .into_iter()
        .map(|(object, contours)| {
            let (numbers, contours) = contours.into_iter().unzip();
            ObjectMarks { object, contours, numbers, drawn, seed: None }
        })
        .collect()
}

/// The objects of a cloud, and one for each seed, numbered on; with numbers that are free where the last is the largest
/// there is.
#[must_use]
pub fn split_and_seed(cloud: &PointCloud, seeds: &[Seed]) -> Vec<ObjectMarks> {
    let mut objects = split(cloud);
    let taken: Vec<u32> = objects.iter().map(|marks| marks.object).collect();
    let on = taken.last().map_or(0, |&last| last);
    let numbers = (on..=u32::MAX).skip(1).chain(1..on).filter(|number| !taken.contains(number));
    let seeded = |(object, &seed)| ObjectMarks {
        object,
        contours: Vec::new(),
        numbers: Vec::new(),
        drawn: false,
        seed: Some(seed),
    };
    objects.extend(numbers.zip(seeds).map(seeded));
    objects
}

/// The largest distance between neighbouring contours of an object, along the axis it was sliced on.
#[must_use]
pub fn contour_gap(marks: &ObjectMarks, geometry: &Geometry) -> f64 {
    let Some((axis, _)) = slicing(marks, geometry) else { return 0.0 };
    let mut planes: Vec<f64> = marks.contours.iter().map(|c| mean(c, axis)).collect();
    planes.sort_by(f64::total_cmp);
    planes.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max)
}

/// The cloud that an object's marks stand for.
#[must_use]
pub fn cloud_of(marks: &ObjectMarks, geometry: &Geometry, caps: bool) -> Vec<[f64; 3]> {
    if !marks.drawn {
        return marks.contours.concat();
    }
    let mut cloud: Vec<[f64; 3]> = marks.contours.iter().flat_map(|c| joined(c, geometry)).collect();
    let Some((axis, tolerance)) = slicing(marks, geometry).filter(|_| caps) else { return cloud };
    let planes: Vec<f64> = marks.contours.iter().map(|c| mean(c, axis)).collect();
    let lowest = planes.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = planes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    for (plane, side) in [(lowest, -0.5), (highest, 0.5)] {
        let at = plane + side * geometry.spacing[axis];
        let ends = marks.contours.iter().zip(&planes).filter(|(_, p)| (**p - plane).abs() <= tolerance);
        let ends: Vec<Vec<[f64; 3]>> = ends.map(|(c, _)| moved(&joined(c, geometry), axis, at)).collect();
        cloud.extend(filled(&ends, axis, at, geometry));
        cloud.extend(ends.into_iter().flatten());
    }
    cloud
}

/// The axis across which all contours are planar, and how far marks of one plane may be apart; none for other clouds.
fn slicing(marks: &ObjectMarks, geometry: &Geometry) -> Option<(usize, f64)> {
    let contours = || marks.contours.iter().filter(|c| c.len() > 1);
    if !marks.drawn || contours().next().is_none() {
        return None;
    }
    [2, 1, 0].into_iter().find_map(|axis| {
        let tolerance = 0.25 * geometry.spacing[axis];
        contours().all(|c| extent(c, axis) <= tolerance).then_some((axis, tolerance))
    })
}

fn extent(points: &[[f64; 3]], axis: usize) -> f64 {
    let values = || points.iter().map(|p| p[axis]);
    values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
}

fn mean(points: &[[f64; 3]], axis: usize) -> f64 {
    points.iter().map(|p| p[axis]).sum::<f64>() / points.len() as f64
}

/// A contour closed to a polygon, with points no more than a voxel apart.
fn joined(contour: &[[f64; 3]], geometry: &Geometry) -> Vec<[f64; 3]> {
    let mut points = Vec::with_capacity(contour.len());
    for (n, &from) in contour.iter().enumerate() {
        let to = contour[(n + 1) % contour.len()];
        let voxels = (0..3).map(|a| ((to[a] - from[a]) / geometry.spacing[a]).powi(2)).sum::<f64>().sqrt();
        let pieces = voxels.ceil().max(1.0);
        for piece in 0..pieces as usize {
            let t = piece as f64 / pieces;
            points.push(std::array::from_fn(|a| from[a] + t * (to[a] - from[a])));
        }
    }
    points
}

fn moved(points: &[[f64; 3]], axis: usize, at: f64) -> Vec<[f64; 3]> {
    points
        .iter()
        .map(|&p| {
            let mut p = p;
            p[axis] = at;
            p
        })
        .collect()
}

/// The inside of polygons in the plane `axis = at`, sampled at the grid's lines (even-odd rule).
fn filled(polygons: &[Vec<[f64; 3]>], axis: usize, at: f64, geometry: &Geometry) -> Vec<[f64; 3]> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let all = || polygons.iter().flatten();
    let low = all().map(|p| p[v]).fold(f64::INFINITY, f64::min);
    let high = all().map(|p| p[v]).fold(f64::NEG_INFINITY, f64::max);
    let line = |value: f64, axis: usize| ((value - geometry.origin[axis]) / geometry.spacing[axis]).ceil() as i64;
    let place = |n: i64, axis: usize| geometry.origin[axis] + n as f64 * geometry.spacing[axis];
    let mut points = Vec::new();
    for row in line(low, v)..line(high, v) {
        let height = place(row, v);
        let mut crossings: Vec<f64> = polygons.iter().flat_map(|polygon| crossings(polygon, u, v, height)).collect();
        crossings.sort_by(f64::total_cmp);
        for pair in crossings.chunks_exact(2) {
            for column in line(pair[0], u)..line(pair[1], u) {
                let mut point = [0.0; 3];
                (point[axis], point[u], point[v]) = (at, place(column, u), height);
                points.push(point);
            }
        }
    }
    points
}

/// Where a closed polygon crosses the line `v = height`, as values of u.
fn crossings(polygon: &[[f64; 3]], u: usize, v: usize, height: f64) -> Vec<f64> {
    let mut found = Vec::new();
    for (n, from) in polygon.iter().enumerate() {
        let to = polygon[(n + 1) % polygon.len()];
        if (from[v] <= height) != (to[v] <= height) {
            found.push(from[u] + (height - from[v]) / (to[v] - from[v]) * (to[u] - from[u]));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(z: f64) -> Vec<[f64; 3]> {
        vec![[1.0, 1.0, z], [9.0, 1.0, z], [9.0, 9.0, z], [1.0, 9.0, z]]
    }

    fn grid() -> Geometry {
        Geometry { shape: [12, 12, 12], spacing: [0.5, 0.5, 2.0], origin: [0.0; 3], unit: None }
    }

    #[test]
    fn seeds_are_numbered_on_and_never_as_another_object() {
        let cloud = |objects: &[u32]| PointCloud {
            positions: objects.iter().map(|&n| [f64::from(n % 7), 0.0, 0.0]).collect(),
            objects: objects.to_vec(),
            ..PointCloud::default()
        };
        let seed = Seed { centre: [0.0; 3], radius: 1.0 };
        let numbers = |objects: &[u32]| -> Vec<u32> {
            split_and_seed(&cloud(objects), &[seed; 2]).iter().map(|marks| marks.object).collect()
        };
        assert_eq!(numbers(&[2, 5]), [2, 5, 6, 7]);
        assert_eq!(numbers(&[]), [1, 2]);
        assert_eq!(numbers(&[1, u32::MAX - 1]), [1, u32::MAX - 1, u32::MAX, 2]);
    }

    #[test]
    fn marks_are_joined_at_most_a_voxel_apart() {
        let points = joined(&square(4.0), &grid());
        assert_eq!(points.len(), 64);
        for (n, p) in points.iter().enumerate() {
            let q = points[(n + 1) % points.len()];
            assert!((0..3).map(|a| (p[a] - q[a]).abs()).sum::<f64>() <= 0.5 + 1e-12);
        }
    }

    #[test]
    fn caps_lie_half_a_slice_beyond_and_cover_the_area() {
        let marks = ObjectMarks {
            object: 1,
            contours: vec![square(4.0), square(6.0)],
            numbers: vec![0, 1],
            drawn: true,
            seed: None,
        };
        let cloud = cloud_of(&marks, &grid(), true);
        let cap: Vec<_> = cloud.iter().filter(|p| p[2] == 3.0).collect();
        assert!(cap.len() >= 15 * 15 && cap.len() <= 17 * 17 + 64, "{}", cap.len());
        assert!(cloud.contains(&[5.0, 5.0, 7.0]));
        assert!(cloud_of(&marks, &grid(), false).iter().all(|p| p[2] == 4.0 || p[2] == 6.0));
    }

    #[test]
    fn a_cloud_without_contours_stays_as_it_is() {
        let cloud = PointCloud { positions: square(1.0), ..PointCloud::default() };
        let objects = split(&cloud);
        assert_eq!(cloud_of(&objects[0], &grid(), true), cloud.positions);
    }
}
