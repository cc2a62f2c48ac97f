//! Meshes on their way out: into memory, into a store, to whoever takes them.

use std::path::Path;

use crate::error::Result;
use crate::exec::Engine;
use crate::grid::{Geometry, TriangleMesh};
use crate::io::geometry::write::ply::PlyWriter;
use crate::io::ome_zarr::StoreWriter;
use crate::pipeline::output::viewer_mesh::{Segments, for_viewers};
use crate::store::MeshSink;

/// A triangle mesh whose triangles separate two labels each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelledMesh {
    /// Vertices and triangles; a triangle is counterclockwise when seen from the side of its larger label.
    pub mesh: TriangleMesh,
    /// The two labels that each triangle separates, the smaller first.
    pub labels: Vec<[u32; 2]>,
}

impl MeshSink for LabelledMesh {
    fn vertex(&mut self, position: [f64; 3]) -> Result<()> {
        self.mesh.vertex(position)
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        self.facet(corners, [0; 2])
    }

    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> Result<()> {
        self.labels.push(labels);
        self.mesh.triangle(corners)
    }
}

/// Hands a mesh to who asked for it, and to the file of a store where there is one.
pub(super) struct Drawing<'a> {
    to: &'a mut dyn MeshSink,
    file: Option<PlyWriter>,
}

impl<'a> Drawing<'a> {
    /// Begins a mesh on a grid; one with labels if it `is_labelled`.
    pub(super) fn new(
        to: &'a mut dyn MeshSink,
        file: Option<&Path>,
        geometry: &Geometry,
        is_labelled: bool,
    ) -> Result<Self> {
        let create = if is_labelled { PlyWriter::tagged_on_grid } else { PlyWriter::on_grid };
        Ok(Self { to, file: file.map(|path| create(path, geometry)).transpose()? })
    }

    /// Completes the file; a store gets what viewers read of it.
    pub(super) fn finish(
        self,
        engine: &Engine,
        store: Option<&StoreWriter>,
        geometry: &Geometry,
        segments: Segments,
    ) -> Result<()> {
        let Some((store, file)) = store.zip(self.file) else { return Ok(()) };
        for_viewers(engine, store, (&file.finish()?, geometry), segments).map(drop)
    }
}

impl MeshSink for Drawing<'_> {
    fn on_grid(&mut self, grid: &Geometry) -> Result<()> {
        self.to.on_grid(grid)
    }

    fn vertex(&mut self, position: [f64; 3]) -> Result<()> {
        self.to.vertex(position)?;
        self.file.as_mut().map_or(Ok(()), |file| file.vertex(position))
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        self.to.triangle(corners)?;
        self.file.as_mut().map_or(Ok(()), |file| file.triangle(corners))
    }

    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> Result<()> {
        self.to.facet(corners, labels)?;
        self.file.as_mut().map_or(Ok(()), |file| file.facet(corners, labels))
    }
}
