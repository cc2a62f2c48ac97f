//! Where the surfaces of objects go beside a store: to whoever takes them as they are drawn.

use crate::error::Result;
use crate::grid::Geometry;
use crate::io::geometry::write::again::Written;
use crate::io::geometry::write::ply::PlyWriter;
use crate::store::{BothSinks, MeshSink};

/// Takes the surfaces of objects. Several may be drawn at the same time.
pub trait ObjectMeshes: Sync {
    /// Begins the surface of the object with a label, on the grid of the box around it.
    ///
    /// # Errors
    /// When it is not taken.
    fn begin(&self, label: u32, grid: &Geometry) -> Result<Box<dyn ObjectMesh + '_>>;
}

/// A surface that is drawn. Dropped before it is kept it is that of an object that could not be solved: nothing stays of it.
pub trait ObjectMesh: MeshSink {
    /// The surface is whole, and that of its object.
    ///
    /// # Errors
    /// When it cannot be written.
    fn keep(self: Box<Self>) -> Result<()>;
}

/// The surface of an object on its way into a store and to who takes it, as far as these are there.
pub(super) type Surface<'a> = BothSinks<PlyWriter, Box<dyn ObjectMesh + 'a>>;

impl Surface<'_> {
    /// Gives it to all that take it; returns what is in the store.
    pub(super) fn keep(self) -> Result<Option<Written>> {
        let written = self.first.map(PlyWriter::finish).transpose()?;
        self.second.map_or(Ok(()), ObjectMesh::keep)?;
        Ok(written)
    }
}
