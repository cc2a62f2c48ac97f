//! Sources of a distance: points in the world, with the object and the contour they were marked on, and triangles; the
//! data sets that they belong to.

use std::ops::Range;

use super::TriangleMesh;

/// A point cloud in physical coordinates. A point's index is the source number that distance fields carry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// World positions, `[x, y, z]`, all finite.
    pub positions: Vec<[f64; 3]>,
    /// The object of each point; empty when the file names none (then all belong to object 1).
    pub objects: Vec<u32>,
    /// The contour of each point within its object; empty when the file names none.
    pub contours: Vec<i64>,
}

impl PointCloud {
    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// True when the cloud has no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The smallest box that holds all points, `(lowest, highest)`; none for an empty cloud.
    #[must_use]
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let first = *self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(lo, hi), p| {
            (std::array::from_fn(|a| lo[a].min(p[a])), std::array::from_fn(|a| hi[a].max(p[a])))
        }))
    }
}

/// The sources of a run, points and triangles, numbered through: first all points, then all triangles. Each data set has
/// a label, larger than those before it: the next number, where none was asked for, so that the n-th has label n.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DataSets {
    /// World positions of all points.
    pub positions: Vec<[f64; 3]>,
    /// All triangles.
    pub mesh: TriangleMesh,
    /// The places of each data set's points, and of its triangles; one of the two is empty.
    sets: Vec<[Range<u32>; 2]>,
    /// Their labels, ascending.
    labels: Vec<u32>,
}

impl DataSets {
    /// The label of the last data set; 0 where there is none.
    #[must_use]
    pub fn last_label(&self) -> u32 {
        self.labels.last().copied().unwrap_or(0)
    }

    /// The labels of the data sets, ascending.
    #[must_use]
    pub fn labels(&self) -> &[u32] {
        &self.labels
    }

    /// Adds a cloud.
    pub fn add_cloud(&mut self, positions: &[[f64; 3]]) {
        self.add_labelled(self.last_label() + 1, positions);
    }

    /// Adds a cloud with a label.
    ///
    /// # Panics
    /// When the label is not larger than those before it.
    pub fn add_labelled(&mut self, label: u32, positions: &[[f64; 3]]) {
        assert!(label > self.last_label(), "labels are added in order");
        self.labels.push(label);
        let (points, triangles) = (self.positions.len() as u32, self.mesh.triangles.len() as u32);
        self.positions.extend_from_slice(positions);
        self.sets.push([points..self.positions.len() as u32, triangles..triangles]);
    }

    /// Adds a mesh.
    pub fn add_mesh(&mut self, mesh: &TriangleMesh) {
        let (points, triangles) = (self.positions.len() as u32, self.mesh.triangles.len() as u32);
        let before = self.mesh.vertices.len() as u32;
        self.labels.push(self.last_label() + 1);
        self.mesh.vertices.extend_from_slice(&mesh.vertices);
        self.mesh.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + before)));
        self.sets.push([points..points, triangles..self.mesh.triangles.len() as u32]);
    }

    /// Number of data sets.
    #[must_use]
    pub fn count(&self) -> usize {
        self.sets.len()
    }

    /// Number of sources.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len() + self.mesh.len()
    }

    /// True when there is no source.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The points of each data set; empty for a mesh.
    pub fn clouds(&self) -> impl Iterator<Item = Range<u32>> + '_ {
        self.sets.iter().map(|set| set[0].clone())
    }

    /// The places of each data set's points and of its triangles, one of them empty; triangles counted from 0.
    pub fn places(&self) -> impl Iterator<Item = [Range<u32>; 2]> + '_ {
        self.sets.iter().cloned()
    }

    /// The label of a source: that of its data set; 0 for a number that is no source.
    #[must_use]
    pub fn label(&self, source: u32) -> u32 {
        self.run_of(source).1
    }

    /// The position of a point, the middle of a triangle's corners.
    ///
    /// # Panics
    /// For a number that is no source.
    #[must_use]
    pub fn centre(&self, source: u32) -> [f64; 3] {
        let source = source as usize;
        self.positions.get(source).copied().unwrap_or_else(|| {
            let [a, b, c] = self.mesh.corners(source - self.positions.len());
            std::array::from_fn(|n| (a[n] + b[n] + c[n]) / 3.0)
        })
    }

    /// The numbers of the sources that share a source's label, and the label; 0 for numbers that are no sources.
    #[must_use]
    pub fn run_of(&self, source: u32) -> (Range<u32>, u32) {
        let points = self.positions.len() as u32;
        let (kind, first) = if source < points { (0, 0) } else { (1, points) };
        // Sets are added in order, so that the first one that ends beyond a source holds it.
        let set = self.sets.partition_point(|set| first + set[kind].end <= source);
        let run = self.sets.get(set).map(|set| first + set[kind].start..first + set[kind].end);
        run.map_or((self.len() as u32..u32::MAX, 0), |run| (run, self.labels[set]))
    }

    /// Whether all of these sources have one label.
    #[must_use]
    pub fn share_label(&self, sources: &[u32]) -> bool {
        let most = sources.iter().fold((u32::MAX, 0), |(lo, hi), &source| (lo.min(source), hi.max(source)));
        sources.is_empty() || self.run_of(most.0).0.contains(&most.1)
    }

    /// The smallest box that holds all sources, `(lowest, highest)`.
    #[must_use]
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let points = self.positions.iter().map(|&p| (p, p));
        points.chain(self.mesh.bounds()).reduce(|(lo, hi), (p, q)| {
            (std::array::from_fn(|a| lo[a].min(p[a])), std::array::from_fn(|a| hi[a].max(q[a])))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_have_the_label_of_their_set() {
        let triangle =
            TriangleMesh { vertices: vec![[0.0; 3], [1.0; 3], [5.0, 0.0, 1.0]], triangles: vec![[0, 1, 2]; 2] };
        let mut sets = DataSets::default();
        sets.add_cloud(&[[0.0; 3], [2.0; 3]]);
        sets.add_mesh(&triangle);
        sets.add_labelled(7, &[[-1.0; 3]]);
        sets.add_mesh(&triangle);
        let labels: Vec<u32> = (0..8).map(|source| sets.label(source)).collect();
        assert_eq!(labels, [1, 1, 7, 2, 2, 8, 8, 0]);
        let runs: Vec<Range<u32>> = [0, 1, 2, 3, 6].map(|source| sets.run_of(source).0).into();
        assert_eq!(runs, [0..2, 0..2, 2..3, 3..5, 5..7]);
        assert!(sets.share_label(&[4, 3]) && sets.share_label(&[]) && sets.share_label(&[9, u32::MAX >> 1]));
        assert!(!sets.share_label(&[4, 5]) && !sets.share_label(&[5, u32::MAX >> 1]));
        assert_eq!(sets.labels(), [1, 2, 7, 8]);
        assert_eq!(sets.mesh.triangles[2], [3, 4, 5]);
        assert_eq!(sets.bounds(), Some(([-1.0; 3], [5.0, 2.0, 2.0])));
    }
}
