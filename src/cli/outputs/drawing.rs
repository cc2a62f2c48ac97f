//! Where a surface goes while it is drawn: into the store, or a passing file if only a mesh is asked for; from there in the
//! format that its name asks for.

use std::path::{Path, PathBuf};

use super::files::export_mesh;
use crate::error::Result;
use crate::grid::Geometry;
use crate::io::geometry::write::ply::PlyWriter;
use crate::io::ome_zarr::StoreWriter;
use crate::store::{MeshSink, NoMesh};

/// The files of a surface.
pub(crate) struct Drawing<'a> {
    ply: Option<PathBuf>,
    asked: Option<&'a Path>,
}

/// A surface that is being drawn.
pub(crate) struct Started(Option<PlyWriter>, NoMesh);

impl<'a> Drawing<'a> {
    /// The surface of a store, and in the file that was `asked` for; in the folder `passing` where there is no store.
    pub(crate) fn new(store: Option<&StoreWriter>, asked: Option<&'a Path>, passing: &Path) -> Result<Self> {
        let ply = match store {
            Some(store) => Some(store.file("meshes/surface.ply")?),
            None => asked.map(|_| passing.join("surface.ply")),
        };
        Ok(Self { ply, asked })
    }

    /// Begins the file that is drawn into, where one is needed.
    pub(crate) fn start(&self, create: impl FnOnce(&Path) -> Result<PlyWriter>) -> Result<Started> {
        Ok(Started(self.ply.as_deref().map(create).transpose()?, NoMesh))
    }

    /// Writes the file that was asked for. `store` is where the store lies by now.
    pub(crate) fn export(&self, store: Option<&Path>, geometry: &Geometry) -> Result<()> {
        let (Some(ply), Some(asked)) = (&self.ply, self.asked) else { return Ok(()) };
        match store {
            Some(store) => export_mesh(&store.join("meshes/surface.ply"), geometry, asked),
            None => export_mesh(ply, geometry, asked),
        }
    }
}

impl Started {
    /// What takes the surface.
    pub(crate) fn sink(&mut self) -> &mut dyn MeshSink {
        match &mut self.0 {
            Some(ply) => ply,
            None => &mut self.1,
        }
    }

    /// Completes the file.
    pub(crate) fn finish(self) -> Result<()> {
        self.0.map_or(Ok(()), PlyWriter::finish)
    }
}
