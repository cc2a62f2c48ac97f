//! One surface that goes two ways, such as into a store and into a file that was asked for; or one of them, or none.

use super::MeshSink;
use crate::error::Result;
use crate::grid::Geometry;

/// Gives what comes to each of two sinks that is there.
#[derive(Debug, Default)]
pub struct BothSinks<A, B> {
    /// Gets everything first.
    pub first: Option<A>,
    /// Gets everything after it.
    pub second: Option<B>,
}

impl<A: MeshSink, B: MeshSink> BothSinks<A, B> {
    fn each(
        &mut self,
        first: impl FnOnce(&mut A) -> Result<()>,
        second: impl FnOnce(&mut B) -> Result<()>,
    ) -> Result<()> {
        self.first.as_mut().map_or(Ok(()), first)?;
        self.second.as_mut().map_or(Ok(()), second)
    }
}

impl<A: MeshSink, B: MeshSink> MeshSink for BothSinks<A, B> {
    fn on_grid(&mut self, grid: &Geometry) -> Result<()> {
        self.each(|sink| sink.on_grid(grid), |sink| sink.on_grid(grid))
    }

    fn vertex(&mut self, position: [f64; 3]) -> Result<()> {
        self.each(|sink| sink.vertex(position), |sink| sink.vertex(position))
    }

    fn keeps_values(&self) -> bool {
        self.first.as_ref().is_some_and(MeshSink::keeps_values)
            || self.second.as_ref().is_some_and(MeshSink::keeps_values)
    }

    fn valued_vertex(&mut self, position: [f64; 3], value: f64) -> Result<()> {
        self.each(|sink| sink.valued_vertex(position, value), |sink| sink.valued_vertex(position, value))
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        self.each(|sink| sink.triangle(corners), |sink| sink.triangle(corners))
    }

    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> Result<()> {
        self.each(|sink| sink.facet(corners, labels), |sink| sink.facet(corners, labels))
    }
}

impl<S: MeshSink + ?Sized> MeshSink for Box<S> {
    fn on_grid(&mut self, grid: &Geometry) -> Result<()> {
        (**self).on_grid(grid)
    }

    fn vertex(&mut self, position: [f64; 3]) -> Result<()> {
        (**self).vertex(position)
    }

    fn keeps_values(&self) -> bool {
        (**self).keeps_values()
    }

    fn valued_vertex(&mut self, position: [f64; 3], value: f64) -> Result<()> {
        (**self).valued_vertex(position, value)
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        (**self).triangle(corners)
    }

    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> Result<()> {
        (**self).facet(corners, labels)
    }
}
