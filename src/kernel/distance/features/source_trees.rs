//! The nearest source of each label, exactly, by a tree for each data set (R-trees).

use rstar::primitives::GeomWithData;
use rstar::{AABB, PointDistance, RTree, RTreeObject};

use super::culling::{Around, Candidate};
use crate::grid::DataSets;
use crate::kernel::geometry::triangle::Triangle;

/// The sources of a run, by label.
#[derive(Debug)]
pub struct SourceTrees {
    trees: Vec<Tree>,
    /// The labels of the trees, ascending.
    labels: Vec<u32>,
}

/// The sources of one data set, with their numbers.
#[derive(Debug)]
enum Tree {
    Points(RTree<GeomWithData<[f64; 3], u32>>),
    Triangles(RTree<GeomWithData<Placed, u32>>),
}

/// A triangle and the box around it.
#[derive(Debug)]
pub(crate) struct Placed {
    pub(crate) triangle: Triangle,
    extent: AABB<[f64; 3]>,
}

impl Placed {
    /// The triangle of three corners.
    pub(crate) fn new(corners: [[f64; 3]; 3]) -> Self {
        Self { triangle: Triangle::new(corners), extent: AABB::from_points(&corners) }
    }
}

impl RTreeObject for Placed {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        self.extent
    }
}

impl PointDistance for Placed {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        self.triangle.distance_squared(*point)
    }
}

impl SourceTrees {
    /// Sorts the sources of all data sets.
    #[must_use]
    pub fn new(sets: &DataSets) -> Self {
        let points = sets.positions.len() as u32;
        let tree = |[cloud, mesh]: [std::ops::Range<u32>; 2]| {
            if mesh.is_empty() {
                let point = |n: u32| GeomWithData::new(sets.positions[n as usize], n);
                return Tree::Points(RTree::bulk_load(cloud.map(point).collect()));
            }
            let placed = |n: u32| GeomWithData::new(Placed::new(sets.mesh.corners(n as usize)), points + n);
            Tree::Triangles(RTree::bulk_load(mesh.map(placed).collect()))
        };
        Self { trees: sets.places().map(tree).collect(), labels: sets.labels().to_vec() }
    }

    /// The number of a label's source that is nearest to a world position; `u32::MAX` where the label has none.
    #[must_use]
    pub fn nearest(&self, label: u32, here: [f64; 3]) -> u32 {
        let tree = self.labels.binary_search(&label).ok();
        tree.and_then(|tree| self.trees[tree].nearest(here)).map_or(u32::MAX, |(source, _)| source)
    }

    /// The distance from a world position to the nearest source of a label; none where the label has none.
    #[must_use]
    pub fn distance(&self, label: u32, here: [f64; 3]) -> Option<f64> {
        let tree = self.labels.binary_search(&label).ok()?;
        self.trees[tree].nearest(here).map(|(_, squared)| squared.sqrt())
    }

    /// The sources of a source's label that are nearest to it, itself the first of them; to a triangle's centre.
    #[must_use]
    pub fn beside(&self, sets: &DataSets, source: u32, count: usize) -> Vec<u32> {
        let Ok(n) = self.labels.binary_search(&sets.label(source)) else { return Vec::new() };
        self.trees[n].nearest_few(sets.centre(source), count)
    }

    /// The sources of a label that can be the nearest of them to a place in a box, and more; none where these are more
    /// than `most`.
    #[must_use]
    pub fn near(&self, label: u32, around: &Around, most: usize) -> Option<Vec<Candidate>> {
        let tree = &self.trees[self.labels.binary_search(&label).ok()?];
        let (_, squared) = tree.nearest(around.middle)?;
        let near = tree.within(around.middle, around.limit(squared), label, most.saturating_add(1));
        (near.len() <= most).then_some(near)
    }

    /// The sources of all labels that can be nearest to a place in a box, and more, labels ascending.
    #[must_use]
    pub fn near_all(&self, around: &Around) -> Vec<Candidate> {
        let nearest = self.trees.iter().filter_map(|tree| tree.nearest(around.middle));
        let limit = around.limit(nearest.map(|(_, squared)| squared).fold(f64::INFINITY, f64::min));
        let of_label = |(tree, &label): (&Tree, &u32)| tree.about(around.middle, limit, label);
        self.trees.iter().zip(&self.labels).flat_map(of_label).collect()
    }
}

impl Tree {
    fn nearest(&self, here: [f64; 3]) -> Option<(u32, f64)> {
        match self {
            Self::Points(tree) => tree.nearest_neighbor(here).map(|p| (p.data, p.distance_2(&here))),
            Self::Triangles(tree) => tree.nearest_neighbor(here).map(|t| (t.data, t.distance_2(&here))),
        }
    }

    fn nearest_few(&self, here: [f64; 3], count: usize) -> Vec<u32> {
        match self {
            Self::Points(tree) => tree.nearest_neighbor_iter(here).take(count).map(|p| p.data).collect(),
            Self::Triangles(tree) => tree.nearest_neighbor_iter(here).take(count).map(|t| t.data).collect(),
        }
    }

    /// The sources within a distance, and of triangles those whose boxes are: these are told sooner.
    fn about(&self, here: [f64; 3], squared: f64, label: u32) -> Vec<Candidate> {
        let Self::Triangles(tree) = self else { return self.within(here, squared, label, usize::MAX) };
        let reach = squared.sqrt();
        let cube = AABB::from_corners(here.map(|v| v - reach), here.map(|v| v + reach));
        let near = tree.locate_in_envelope_intersecting(cube);
        near.filter(|t| t.geom().extent.distance_2(&here) <= squared).map(|t| (t.data, label)).collect()
    }

    fn within(&self, here: [f64; 3], squared: f64, label: u32, most: usize) -> Vec<Candidate> {
        match self {
            Self::Points(tree) => {
                tree.locate_within_distance(here, squared).take(most).map(|p| (p.data, label)).collect()
            }
            Self::Triangles(tree) => {
                tree.locate_within_distance(here, squared).take(most).map(|t| (t.data, label)).collect()
            }
        }
    }
}
