//! Sources on a grid: what every distance method starts from.

use crate::grid::{Box3, BrickId, DataSets, Geometry, PointBins, TriangleBins, TriangleMesh};
use crate::kernel::distance::features::source_trees::SourceTrees;
use crate::kernel::distance::seeding::initialise::Cube;
use crate::kernel::distance::seeding::outside::OutsideSources;
use crate::pipeline::distance::medium::Medium;

/// Points, and triangles where there are any, sorted by the bricks of a grid.
#[derive(Clone, Copy, Debug)]
pub struct Sources<'a> {
    /// The grid that the sources lie on.
    pub geometry: &'a Geometry,
    /// World positions of the points.
    pub positions: &'a [[f64; 3]],
    /// The points by brick.
    pub bins: &'a PointBins,
    /// The voxels that points fix: by the last place of each data set's points, in order; none where all fix their
    /// cell.
    pub cubes: &'a [(u32, Cube)],
    /// Triangles, whose numbers follow those of the points.
    pub mesh: Option<(&'a TriangleMesh, &'a TriangleBins)>,
    /// All of them as data sets; a cloud alone needs none.
    pub sets: Option<&'a DataSets>,
    /// The same, sorted; where labels are asked for.
    pub trees: Option<&'a SourceTrees>,
    /// The same, where some reach out of the grid and count there too.
    pub outside: Option<&'a OutsideSources<'a>>,
    /// What a front goes through, where it is not equally fast everywhere.
    pub medium: Option<&'a Medium>,
}

impl<'a> Sources<'a> {
    /// A cloud whose points fix the corners of their cells; those outside of the grid are left out.
    #[must_use]
    pub fn cloud(geometry: &'a Geometry, positions: &'a [[f64; 3]], bins: &'a PointBins) -> Self {
        Self { geometry, positions, bins, cubes: &[], mesh: None, sets: None, trees: None, outside: None, medium: None }
    }

    /// Points and triangles as data sets, where there are triangles.
    pub(crate) fn shapes(&self) -> Option<&'a DataSets> {
        self.sets.filter(|_| self.mesh.is_some())
    }

    /// Points and triangles as data sets, where these are several.
    pub(crate) fn labelled(&self) -> Option<&'a DataSets> {
        self.sets.filter(|sets| sets.count() > 1)
    }

    fn cube(&self, point: u32) -> Cube {
        let at = self.cubes.partition_point(|(end, _)| *end <= point);
        self.cubes.get(at).map_or(Cube::CELL, |(_, cube)| *cube)
    }

    /// The bricks whose points may fix voxels of a brick, or voxels so many beyond it.
    fn bricks_seeding(&self, id: BrickId, beyond: [i64; 3]) -> impl Iterator<Item = BrickId> + use<'_> {
        let grid = self.bins.grid();
        let part = grid.brick_box(id);
        let margin = self
            .cubes
            .iter()
            .fold([0; 3], |most: [i64; 3], (_, cube)| std::array::from_fn(|a| most[a].max(cube.margin[a])));
        let reach = Box3 {
            lo: std::array::from_fn(|a| part.lo[a] - 1 - margin[a] - beyond[a]),
            hi: std::array::from_fn(|a| part.hi[a] + margin[a] + beyond[a]),
        };
        grid.bricks_in(&reach.intersect(&Box3::from_shape(grid.shape())))
    }

    /// The points that may fix voxels of a brick, with their positions and cubes, these so many voxels larger all
    /// around.
    pub(crate) fn points_seeding(
        &self,
        id: BrickId,
        beyond: [i64; 3],
    ) -> impl Iterator<Item = (u32, [f64; 3], Cube)> + '_ {
        let points = self.bricks_seeding(id, beyond).flat_map(|brick| self.bins.of(brick).iter().copied());
        points.map(move |p| (p, self.positions[p as usize], self.cube(p).grown(beyond)))
    }

    /// Whether any source may fix a voxel of a brick, also through a face of the grid, or a point voxels so many beyond it.
    pub(crate) fn may_seed(&self, id: BrickId, beyond: [i64; 3]) -> bool {
        self.bricks_seeding(id, beyond).any(|brick| !self.bins.of(brick).is_empty())
            || self.mesh.is_some_and(|(_, bins)| !bins.of(id).is_empty())
            || (self.outside.is_some() && self.is_at_a_face(id))
    }

    /// Whether a brick has voxels of the grid's outermost layer.
    fn is_at_a_face(&self, id: BrickId) -> bool {
        let grid = self.bins.grid();
        let (part, shape) = (grid.brick_box(id), grid.shape());
        (0..3).any(|a| part.lo[a] == 0 || part.hi[a] == shape[a])
    }
}
