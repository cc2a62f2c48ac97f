//! `MeshBuffer`: a mesh in memory, in single precision.

use strandline::Result;
use strandline::store::MeshSink;

/// A triangle mesh whose positions are kept as files of f32 hold them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct MeshBuffer {
    pub(crate) vertices: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl MeshSink for MeshBuffer {
    fn vertex(&mut self, position: [f64; 3]) -> Result<()> {
        self.vertices.push(position.map(|v| v as f32));
        Ok(())
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        self.triangles.push(corners);
        Ok(())
    }
}
