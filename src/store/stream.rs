//! The traits that join files, bricks and pipelines: read or write any box of voxels, one plane of a stack, or a mesh.

use super::{Element, ElementType, SamplesMut};
use crate::error::Result;
use crate::grid::Box3;

/// Something from which any box of a volume can be read, from any thread.
pub trait BoxSource<T: Element>: Sync {
    /// Voxels along each axis, `[x, y, z]`.
    fn shape(&self) -> [i64; 3];

    /// Fills `out`, dense `[z][y][x]` over `part`; `part` lies inside the shape.
    ///
    /// # Errors
    /// When the data behind it cannot be read.
    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()>;

    /// The one value that all voxels of `part` are known to have, where that can be told without reading them.
    fn constant_in(&self, _part: &Box3) -> Option<T> {
        None
    }
}

/// Something into which any box of a volume can be written, from any thread.
pub trait BoxSink<T: Element>: Sync {
    /// Voxels along each axis, `[x, y, z]`.
    fn shape(&self) -> [i64; 3];

    /// Writes `data`, dense `[z][y][x]` over `part`; `part` lies inside the shape.
    ///
    /// # Errors
    /// When the data cannot be written.
    fn write_box(&self, part: &Box3, data: &[T]) -> Result<()>;
}

/// A stack of planes that can be decoded one at a time, in any order and from any thread.
pub trait PlaneSource: Sync {
    /// Voxels along each axis, `[x, y, z]`.
    fn shape(&self) -> [i64; 3];

    /// The type that samples are handed out in.
    fn element(&self) -> ElementType;

    /// Decodes plane `z` into `out`, dense `[y][x]`, of the type that [`PlaneSource::element`] names.
    ///
    /// # Errors
    /// When the plane cannot be read or decoded: names file, page and reason.
    fn read_plane(&self, z: i64, out: SamplesMut<'_>) -> Result<()>;
}

/// Something that takes a triangle mesh as it is found: a file, a buffer in memory.
pub trait MeshSink {
    /// Takes the next vertex, a world position `[x, y, z]`; vertices are numbered from 0 in the order they come.
    ///
    /// # Errors
    /// When the vertex cannot be written.
    fn vertex(&mut self, position: [f32; 3]) -> Result<()>;

    /// Takes a triangle of vertices that came before it, counter-clockwise as seen from outside.
    ///
    /// # Errors
    /// When the triangle cannot be written.
    fn triangle(&mut self, corners: [u32; 3]) -> Result<()>;

    /// Takes a triangle that separates two labels.
    ///
    /// # Errors
    /// When the triangle cannot be written.
    fn facet(&mut self, corners: [u32; 3], _labels: [u32; 2]) -> Result<()> {
        self.triangle(corners)
    }
}

/// A triangle mesh in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshBuffer {
    /// World positions, `[x, y, z]`.
    pub vertices: Vec<[f32; 3]>,
    /// Places in `vertices`, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl MeshSink for MeshBuffer {
    fn vertex(&mut self, position: [f32; 3]) -> Result<()> {
        self.vertices.push(position);
        Ok(())
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        self.triangles.push(corners);
        Ok(())
    }
}

/// Keeps nothing: for meshes of which only the measures are wanted.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoMesh;

impl MeshSink for NoMesh {
    fn vertex(&mut self, _position: [f32; 3]) -> Result<()> {
        Ok(())
    }

    fn triangle(&mut self, _corners: [u32; 3]) -> Result<()> {
        Ok(())
    }
}
