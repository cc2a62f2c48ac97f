//! `Welder`: joins the patches of neighbouring bricks into one mesh, in memory that one layer of bricks decides.

use super::growing::Growing;
use super::key_hash::KeyMap;
use super::patch::Patch;
use super::vertex_key::VertexKey;
use crate::error::{Error, Result};
use crate::grid::{Box3, Geometry};
use crate::store::MeshSink;

/// One past the last number a vertex may have: the highest 32-bit number stays free as a mark.
const VERTEX_LIMIT: u64 = u32::MAX as u64;

/// Takes patches in the order of their bricks (x fastest, z slowest) and numbers their vertices across all of them.
///
/// Remembered are only vertices on the faces of the current layer of bricks: those below can have no more company.
#[derive(Clone, Debug)]
pub struct Welder {
    geometry: Geometry,
    /// Whether positions are those of f32: what is measured is then what a file in single precision holds.
    is_single: bool,
    /// Numbers of the vertices that a later patch may share.
    shared: KeyMap<VertexKey, u32>,
    /// How many there were at the same time.
    most_shared: usize,
    /// The z index at which the current layer of cells starts.
    layer: i64,
    vertices: u64,
    triangles: u64,
    /// Number and world position of each vertex of the last patch.
    numbers: Vec<u32>,
    world: Vec<[f64; 3]>,
}

impl Welder {
    /// A welder for patches of one domain.
    #[must_use]
    pub fn new(geometry: &Geometry) -> Self {
        Self {
            geometry: geometry.clone(),
            is_single: geometry.fits_single(),
            shared: KeyMap::default(),
            most_shared: 0,
            layer: i64::MIN,
            vertices: 0,
            triangles: 0,
            numbers: Vec::new(),
            world: Vec::new(),
        }
    }

    /// What it holds in memory whatever patches are next: those of their vertices that later ones may share.
    #[must_use]
    pub fn tables(&self) -> [Growing; 1] {
        [Growing::of_table(&self.shared, self.most_shared)]
    }

    /// Bytes of memory that the last patch's vertices take.
    #[must_use]
    pub fn bytes_of_last(&self) -> u64 {
        (self.numbers.capacity() * size_of::<u32>() + self.world.capacity() * size_of::<[f64; 3]>()) as u64
    }

    /// Adds a patch: its new vertices in world coordinates, then its triangles, outward as the patch has them.
    ///
    /// # Errors
    /// When the sink fails, or the mesh passes the 2^32 vertices that 32-bit indices can name.
    pub fn add(&mut self, patch: &Patch, sink: &mut dyn MeshSink) -> Result<()> {
        self.add_valued(patch, &[], sink)
    }

    /// The same with a number for each vertex of the patch, or none at all.
    ///
    /// # Errors
    /// As [`Welder::add`].
    pub fn add_valued(&mut self, patch: &Patch, values: &[f64], sink: &mut dyn MeshSink) -> Result<()> {
        self.enter_layer(patch);
        self.numbers.clear();
        self.world.clear();
        for (n, (&key, &position)) in patch.keys.iter().zip(&patch.positions).enumerate() {
            let world = self.to_world(position);
            let number = self.number(key, &patch.cells, (world, values.get(n).copied()), sink)?;
            self.numbers.push(number);
            self.world.push(world);
        }
        for (n, triangle) in patch.triangles.iter().enumerate() {
            let corners = triangle.map(|v| self.numbers[v as usize]);
            match patch.pairs.get(n) {
                Some(&pair) => sink.facet(corners, pair)?,
                None => sink.triangle(corners)?,
            }
        }
        self.triangles += patch.triangles.len() as u64;
        Ok(())
    }

    /// The triangles of the patch added last, as vertex numbers of the mesh and world positions.
    pub fn triangles_of<'a>(&'a self, patch: &'a Patch) -> impl Iterator<Item = ([u32; 3], [[f64; 3]; 3])> + 'a {
        patch.triangles.iter().map(|t| (t.map(|v| self.numbers[v as usize]), t.map(|v| self.world[v as usize])))
    }

    /// Forgets what lies below the layer of cells of the next patch, where that is a new one: then the numbers of the vertices so far that
    /// later patches may share are returned, in order.
    pub fn enter_layer(&mut self, patch: &Patch) -> Option<Vec<u32>> {
        let layer = patch.cells.lo[2];
        debug_assert!(layer >= self.layer, "patches must come in the order of their bricks");
        if layer == self.layer {
            return None;
        }
        self.shared.retain(|key, _| key.layer() >= layer);
        self.layer = layer;
        let mut kept: Vec<u32> = self.shared.values().copied().collect();
        kept.sort_unstable();
        Some(kept)
    }

    /// The number of a vertex: the one a former patch gave it, or the next one.
    fn number(
        &mut self,
        key: VertexKey,
        cells: &Box3,
        (world, value): ([f64; 3], Option<f64>),
        sink: &mut dyn MeshSink,
    ) -> Result<u32> {
        let is_shared = touches_border(key, cells);
        if is_shared && let Some(&number) = self.shared.get(&key) {
            return Ok(number);
        }
        if self.vertices >= VERTEX_LIMIT {
            return Err(Error::failed(
                "the surface has more vertices than a mesh with 32-bit indices can hold; use a larger spacing or crop",
            ));
        }
        let number = self.vertices as u32;
        match value {
            Some(value) => sink.valued_vertex(world, value)?,
            None => sink.vertex(world)?,
        }
        self.vertices += 1;
        if is_shared {
            self.shared.insert(key, number);
            self.most_shared = self.most_shared.max(self.shared.len());
        }
        Ok(number)
    }

    fn to_world(&self, position: [f64; 3]) -> [f64; 3] {
        let world = |a: usize| self.geometry.origin[a] + position[a] * self.geometry.spacing[a];
        let rounded = |v: f64| if self.is_single { f64::from(v as f32) } else { v };
        std::array::from_fn(|a| rounded(world(a)))
    }
}

/// True when the vertex lies in a face of the box of cells, so that a cell of another brick has it too.
fn touches_border(key: VertexKey, cells: &Box3) -> bool {
    (0..3).any(|a| key.lies_in(a, cells.lo[a]) || key.lies_in(a, cells.hi[a]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::TriangleMesh;
    use crate::kernel::surface::MarchingCubes;

    /// A slab of cells that all cross the plane z = 0.5, one patch per cell.
    fn patch(cell: [i64; 3], values: [f32; 8]) -> Patch {
        let cells = Box3::new(cell, cell.map(|v| v + 1));
        let mut patch = Patch::default();
        let part = Box3::new(cell, cell.map(|v| v + 2));
        MarchingCubes::new(0.5).extract(&values, &part, &cells, &mut patch);
        patch
    }

    fn geometry() -> Geometry {
        Geometry { shape: [9; 3], spacing: [1.0, 2.0, 0.5], origin: [10.0, 20.0, 30.0], unit: None }
    }

    const BELOW_INSIDE: [f32; 8] = [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0];

    #[test]
    fn neighbours_share_their_vertices() {
        let mut welder = Welder::new(&geometry());
        let mut mesh = TriangleMesh::default();
        for cell in [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]] {
            welder.add(&patch(cell, BELOW_INSIDE), &mut mesh).unwrap();
        }
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (9, 8));
        assert!(mesh.vertices.contains(&[12.0, 24.0, 30.25]) && mesh.vertices.contains(&[10.0, 20.0, 30.25]));
    }

    #[test]
    fn keys_of_passed_layers_are_dropped() {
        let mut welder = Welder::new(&geometry());
        let mut mesh = TriangleMesh::default();
        welder.add(&patch([0, 0, 0], BELOW_INSIDE), &mut mesh).unwrap();
        assert_eq!(welder.shared.len(), 4);
        // The plane's edges start at z = 0: nothing of them is left in the cells that start at z = 1.
        welder.add(&patch([0, 0, 1], [0.0; 8]), &mut mesh).unwrap();
        assert_eq!(welder.shared.len(), 0);
    }

    #[test]
    fn the_last_patch_can_be_walked_in_world_coordinates() {
        let mut welder = Welder::new(&geometry());
        let mut mesh = TriangleMesh::default();
        for cell in [[0, 0, 0], [1, 0, 0]] {
            let patch = patch(cell, BELOW_INSIDE);
            let start = mesh.triangles.len();
            welder.add(&patch, &mut mesh).unwrap();
            let walked: Vec<_> = welder.triangles_of(&patch).collect();
            assert_eq!(walked.iter().map(|w| w.0).collect::<Vec<_>>(), mesh.triangles[start..]);
            assert!(walked.iter().all(|(t, p)| t.map(|v| mesh.vertices[v as usize]) == *p));
        }
    }

    #[test]
    fn too_many_vertices_are_refused() {
        let mut welder = Welder::new(&geometry());
        welder.vertices = VERTEX_LIMIT - 3;
        let error = welder.add(&patch([0; 3], BELOW_INSIDE), &mut TriangleMesh::default()).unwrap_err();
        assert!(error.to_string().contains("32-bit"), "{error}");
        assert_eq!(error.exit_code(), 1);
    }
}
