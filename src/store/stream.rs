//! The traits that join files, bricks and pipelines: read or write any box of voxels, a volume as it is stored, or a mesh.

use std::path::{Path, PathBuf};

use super::{Element, ElementType, Sample, SamplesMut};
use crate::error::Result;
use crate::grid::{Box3, Geometry, TriangleMesh};

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

impl<T: Element, S: BoxSource<T> + ?Sized> BoxSource<T> for &S {
    fn shape(&self) -> [i64; 3] {
        (**self).shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        (**self).read_box(part, out)
    }

    fn constant_in(&self, part: &Box3) -> Option<T> {
        (**self).constant_in(part)
    }
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

    /// The file or folder of the stack, for messages; none where that is no file.
    fn path(&self) -> Option<&Path> {
        None
    }

    /// Where plane `z` is stored, for messages; none where that is no file.
    fn whereabouts(&self, _z: i64) -> Option<Whereabouts> {
        None
    }
}

/// Where something is stored, for messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Whereabouts {
    /// The file.
    pub file: PathBuf,
    /// What of it, such as `page 3`; empty where the file holds nothing else.
    pub part: String,
}

/// A volume in a file, of which any box can be read from any thread, and which is stored in boxes of its own: the planes of
/// a stack, the chunks of a Zarr array.
pub trait VolumeSource: Sync {
    /// Voxels along each axis, `[x, y, z]`.
    fn shape(&self) -> [i64; 3];

    /// The type that samples are handed out in.
    fn element(&self) -> ElementType;

    /// The shape of the boxes in which the volume is best read, laid from voxel (0, 0, 0) on and cut where it ends: what
    /// is read by whole boxes is decoded once.
    fn natural_shape(&self) -> [i64; 3];

    /// Bytes that are held while a natural box is read, beside the buffer that it goes into.
    fn decoding_bytes(&self) -> u64;

    /// Fills `out`, dense `[z][y][x]` over `part`, of the type that [`VolumeSource::element`] names; `part` lies inside the
    /// shape.
    ///
    /// # Errors
    /// When a part of the file cannot be read or decoded: names file, place and reason.
    fn read_box(&self, part: &Box3, out: SamplesMut<'_>) -> Result<()>;

    /// The file or folder of the volume, for messages; none where that is no file.
    fn path(&self) -> Option<&Path> {
        None
    }

    /// Where a voxel is stored, for messages; none where that is no file.
    fn whereabouts(&self, _voxel: [i64; 3]) -> Option<Whereabouts> {
        None
    }

    /// The natural boxes that hold voxels of `part`, cut to it, x fastest.
    fn natural_boxes(&self, part: &Box3) -> Vec<Box3> {
        part.tiles(self.natural_shape()).collect()
    }
}

impl<S: PlaneSource> VolumeSource for S {
    fn shape(&self) -> [i64; 3] {
        PlaneSource::shape(self)
    }

    fn element(&self) -> ElementType {
        PlaneSource::element(self)
    }

    fn natural_shape(&self) -> [i64; 3] {
        let [width, height, _] = PlaneSource::shape(self);
        [width, height, 1]
    }

    fn decoding_bytes(&self) -> u64 {
        let [width, height, _] = PlaneSource::shape(self);
        // A part of a plane is cut out of the whole; what is decoded is bounded by the plane too.
        2 * width.unsigned_abs() * height.unsigned_abs() * PlaneSource::element(self).size() as u64
    }

    fn read_box(&self, part: &Box3, out: SamplesMut<'_>) -> Result<()> {
        match out {
            SamplesMut::U8(out) => read_planes(self, part, out),
            SamplesMut::U16(out) => read_planes(self, part, out),
            SamplesMut::U32(out) => read_planes(self, part, out),
            SamplesMut::F32(out) => read_planes(self, part, out),
            SamplesMut::F64(out) => read_planes(self, part, out),
        }
    }

    fn path(&self) -> Option<&Path> {
        PlaneSource::path(self)
    }

    fn whereabouts(&self, [_, _, z]: [i64; 3]) -> Option<Whereabouts> {
        PlaneSource::whereabouts(self, z)
    }
}

/// Reads a box of a stack plane by plane.
fn read_planes<T: Sample>(source: &impl PlaneSource, part: &Box3, out: &mut [T]) -> Result<()> {
    let [width, height, _] = source.shape();
    let [part_width, part_height, _] = part.shape();
    let mut buffer = Vec::new();
    for (z, out) in (part.lo[2]..part.hi[2]).zip(out.chunks_exact_mut((part_width * part_height) as usize)) {
        if [part_width, part_height] == [width, height] {
            source.read_plane(z, T::buffer(out))?;
            continue;
        }
        buffer.resize((width * height) as usize, T::default());
        source.read_plane(z, T::buffer(&mut buffer))?;
        for (y, row) in (part.lo[1]..).zip(out.chunks_exact_mut(part_width as usize)) {
            row.copy_from_slice(&buffer[(y * width + part.lo[0]) as usize..][..part_width as usize]);
        }
    }
    Ok(())
}

/// Something that takes a triangle mesh as it is found: a file, a buffer in memory.
pub trait MeshSink {
    /// Hears on which grid the result is, before the first vertex, where that is found together with the surface.
    ///
    /// # Errors
    /// When the mesh cannot be written on it.
    fn on_grid(&mut self, _grid: &Geometry) -> Result<()> {
        Ok(())
    }

    /// Takes the next vertex, a world position `[x, y, z]`; vertices are numbered from 0 in the order they come.
    ///
    /// # Errors
    /// When the vertex cannot be written.
    fn vertex(&mut self, position: [f64; 3]) -> Result<()>;

    /// Whether it keeps what [`MeshSink::valued_vertex`] tells beside a vertex's place.
    fn keeps_values(&self) -> bool {
        false
    }

    /// Takes the next vertex, and a number that is told of it, such as a thickness.
    ///
    /// # Errors
    /// When the vertex cannot be written.
    fn valued_vertex(&mut self, position: [f64; 3], _value: f64) -> Result<()> {
        self.vertex(position)
    }

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

impl MeshSink for TriangleMesh {
    fn vertex(&mut self, position: [f64; 3]) -> Result<()> {
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
    fn vertex(&mut self, _position: [f64; 3]) -> Result<()> {
        Ok(())
    }

    fn triangle(&mut self, _corners: [u32; 3]) -> Result<()> {
        Ok(())
    }
}
