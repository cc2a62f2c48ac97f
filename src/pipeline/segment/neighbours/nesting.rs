//! Which objects are nested in which. Neighbours that overlap by accident share a sheet of a few voxels at their common
//! wall; of an object inside another nearly all voxels lie there, but for those that stick out by errors of the solution.
//! Between the two is little: a cell ten voxels wide whose neighbour claims two of these shares a quarter with it at the
//! most, and one that is nested and sticks out by a voxel all around half of its surface still has three quarters inside.
//! So two thirds are asked for; a neighbour that was flooded over by more than that is dug out again as a nested one.

use std::collections::BTreeMap;

use super::survey::Survey;
use crate::pipeline::segment::labels::Placed;

/// The part of the smaller object's voxels that lie in the larger one, of which more make it nested.
const NESTED: [u64; 2] = [2, 3];

/// Objects by their place among all.
pub(super) struct Nesting {
    labels: Vec<u32>,
    /// The objects that each one is nested in, the smallest first.
    containers: Vec<Vec<usize>>,
}

impl Nesting {
    pub(super) fn new(objects: &[Placed<'_>], survey: &Survey) -> Self {
        let labels = objects.iter().map(|object| object.label).collect();
        Self::of(labels, &survey.voxels, &survey.shared)
    }

    fn of(labels: Vec<u32>, voxels: &[u64], shared: &BTreeMap<[usize; 2], u64>) -> Self {
        let mut containers = vec![Vec::new(); labels.len()];
        for (&[a, b], &both) in shared {
            // Of equally large ones the later is taken to be inside.
            let (outer, inner) = if voxels[a] >= voxels[b] { (a, b) } else { (b, a) };
            if both * NESTED[1] > voxels[inner] * NESTED[0] {
                containers[inner].push(outer);
            }
        }
        for outer in &mut containers {
            outer.sort_by_key(|&n| (voxels[n], n));
        }
        Self { labels, containers }
    }

    /// The labels of all objects.
    pub(super) fn labels(&self) -> &[u32] {
        &self.labels
    }

    /// Whether one object is nested in another.
    pub(super) fn holds(&self, outer: usize, inner: usize) -> bool {
        self.containers[inner].contains(&outer)
    }

    /// The label of the outermost object around each label, where it is another.
    pub(super) fn roots(&self) -> BTreeMap<u32, u32> {
        let root = |mut n: usize| {
            // Containers are larger, or as large and earlier: the way ends.
            while let Some(&outer) = self.containers[n].first() {
                n = outer;
            }
            self.labels[n]
        };
        (0..self.labels.len()).map(|n| (self.labels[n], root(n))).filter(|(label, root)| label != root).collect()
    }

    /// The labels of each nested object and of the smallest around it.
    pub(super) fn pairs(&self) -> Vec<[u32; 2]> {
        let outer = |n: usize| self.containers[n].first().map(|&outer| [self.labels[n], self.labels[outer]]);
        (0..self.labels.len()).filter_map(outer).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_of_the_smaller_one_inside_is_nested() {
        let shared = BTreeMap::from([([0, 1], 70), ([0, 2], 66), ([1, 3], 10), ([0, 3], 9)]);
        let nesting = Nesting::of(vec![4, 7, 8, 9], &[1000, 100, 100, 10], &shared);
        assert!(nesting.holds(0, 1) && !nesting.holds(0, 2) && !nesting.holds(1, 0));
        assert_eq!(nesting.pairs(), [[7, 4], [9, 7]]);
        assert_eq!(nesting.roots(), BTreeMap::from([(7, 4), (9, 4)]));
        let twice = Nesting::of(vec![1, 2], &[5, 5], &BTreeMap::from([([0, 1], 5)]));
        assert_eq!(twice.pairs(), [[2, 1]], "one marked twice");
    }
}
