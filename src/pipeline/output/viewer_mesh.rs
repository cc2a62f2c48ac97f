//! What a store has of a surface for those who look at it: a copy with fewer triangles of a large one, and meshes as neuroglancer
//! reads them, of that copy where there is one. Both are made of the PLY file that was just written: read through twice at most,
//! in memory that does not go with its size. Where there is no room for that, there is no copy, and the run goes on.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::exec::Engine;
use crate::grid::Geometry;
use crate::io::geometry::read::points::LengthUnit;
use crate::io::geometry::write::again::Written;
use crate::io::geometry::write::ply::PlyWriter;
use crate::io::geometry::write::precomputed::Precomputed;
use crate::io::ome_zarr::StoreWriter;
use crate::kernel::surface::{Clustered, Clustering};
use crate::store::MeshSink;

/// Surfaces with more triangles get a copy.
const LARGE: u64 = 500_000;
/// Triangles of a copy, at most.
const MOST: usize = 300_000;
/// Triangles of a large surface whose distance from its copy is measured, about.
const MEASURED: u64 = 100_000;
/// More pairs of labels get no meshes of their own: it would be thousands of files.
const MOST_PAIRS: usize = 2048;
/// Triangles between two looks at whether the run was asked to end.
const BETWEEN_LOOKS: u64 = 1 << 16;
/// Metres where nobody says what a unit of length is: viewers take the numbers as they are.
const NO_UNIT: f64 = 1.0;

/// Folders of a store, beside its meshes.
pub const PRECOMPUTED: &str = "meshes/precomputed";
/// That of copies with fewer triangles.
pub const SIMPLIFIED: &str = "meshes/simplified";

/// What numbers the meshes of viewers have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Segments {
    /// The whole surface is that of an object.
    Object(u32),
    /// One mesh for each pair of labels, counted from 1 in their order.
    Pairs,
    /// None are made.
    None,
}

/// A copy with fewer triangles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Simplified {
    /// Number of triangles.
    pub triangles: u64,
    /// Edge of the cubes whose vertices were joined.
    pub cube: f64,
    /// The largest distance from the copy that was measured, at corners and middles of triangles all over the surface.
    pub error: f64,
    /// A vertex of what stays moved by no more than this.
    pub bound: f64,
    /// Share of the measured triangles that belong to pieces smaller than a cube, which are left out.
    pub left_out: f64,
}

/// What the stage is called, each time; it takes about as long as the surface was drawn.
pub(crate) const STAGE: &str = "meshes for viewers";

/// What is said where there is no room.
const NO_ROOM: &str = "the surface has no copy with fewer triangles for viewers: the memory has no room to make one; more --memory gives it";

/// A mesh in memory.
struct Mesh {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    labels: Vec<[u32; 2]>,
}

/// Makes a copy of a large surface of `store`, drawn on a grid, and the meshes of viewers; tells of the copy, if there is one.
///
/// # Errors
/// When a file cannot be read or written, or the run is interrupted.
pub fn for_viewers(
    engine: &Engine,
    store: &StoreWriter,
    (written, geometry): (&Written, &Geometry),
    segments: Segments,
) -> Result<Option<Simplified>> {
    let is_large = written.triangles > LARGE;
    if written.triangles == 0 || (segments == Segments::None && !is_large) {
        return Ok(None);
    }
    let held = if is_large { Clustering::bytes(MOST) } else { Mesh::bytes(written) };
    let Ok(_held) = engine.hold(held + Written::READING) else {
        if is_large {
            engine.note(NO_ROOM);
        }
        return Ok(None);
    };
    let stage = engine.stage(STAGE, 0);
    let mut pairs = BTreeSet::new();
    let (mesh, copy) = if is_large {
        let (mesh, copy) = simplify(engine, written, geometry, &mut pairs)?;
        write_copy(store, written, geometry, &mesh)?;
        (mesh, Some(copy))
    } else {
        (Mesh::read(engine, written, &mut pairs)?, None)
    };
    write_segments(store, geometry, &mesh, segments, &pairs)?;
    stage.finish();
    Ok(copy)
}

/// The triangles of a file one after the other, as long as the run goes on.
fn each(
    engine: &Engine,
    written: &Written,
    mut take: impl FnMut(u64, [u32; 3], [[f64; 3]; 3], [u32; 2]),
) -> Result<()> {
    let mut n = 0;
    written.each(|corners, places, labels| {
        if n % BETWEEN_LOOKS == 0 {
            engine.check()?;
        }
        take(n, corners, places, labels);
        n += 1;
        Ok(())
    })
}

fn simplify(
    engine: &Engine,
    written: &Written,
    geometry: &Geometry,
    pairs: &mut BTreeSet<[u32; 2]>,
) -> Result<(Mesh, Simplified)> {
    let mut clustering = Clustering::new(geometry.origin, geometry.min_spacing(), MOST);
    each(engine, written, |_, _, places, labels| {
        clustering.add(places, labels);
        remember(pairs, labels);
    })?;
    let copy = clustering.finish();
    let every = written.triangles / MEASURED + 1;
    let (mut error, mut measured, mut gone) = (0.0_f64, 0_u64, 0_u64);
    each(engine, written, |n, _, places, _| {
        if n % every == 0 {
            measured += 1;
            match copy.distance(places) {
                Some(distance) => error = error.max(distance),
                None => gone += 1,
            }
        }
    })?;
    let (triangles, left_out) = (copy.triangles.len() as u64, gone as f64 / measured.max(1) as f64);
    let found = Simplified { triangles, cube: copy.edge, error, bound: copy.bound(), left_out };
    let Clustered { vertices, triangles, labels, .. } = copy;
    Ok((Mesh { vertices, triangles, labels }, found))
}

/// Keeps a pair in mind; one more than can have meshes is enough.
fn remember(pairs: &mut BTreeSet<[u32; 2]>, labels: [u32; 2]) {
    if pairs.len() <= MOST_PAIRS {
        pairs.insert(labels);
    }
}

fn write_copy(store: &StoreWriter, written: &Written, geometry: &Geometry, mesh: &Mesh) -> Result<()> {
    let name = written.path.file_name().unwrap_or_default().to_string_lossy();
    let path = store.file(&format!("{SIMPLIFIED}/{name}"))?;
    let create = if written.is_tagged() { PlyWriter::tagged_on_grid } else { PlyWriter::on_grid };
    let mut file = create(&path, geometry)?;
    mesh.vertices.iter().try_for_each(|&vertex| file.vertex(vertex))?;
    mesh.triangles.iter().zip(&mesh.labels).try_for_each(|(&corners, &labels)| file.facet(corners, labels))?;
    file.finish().map(drop)
}

fn write_segments(
    store: &StoreWriter,
    geometry: &Geometry,
    mesh: &Mesh,
    segments: Segments,
    pairs: &BTreeSet<[u32; 2]>,
) -> Result<()> {
    if segments == Segments::None || (segments == Segments::Pairs && pairs.len() > MOST_PAIRS) {
        return Ok(());
    }
    let info = store.file(&format!("{PRECOMPUTED}/info"))?;
    let metres = geometry.unit.as_deref().and_then(LengthUnit::named).map_or(NO_UNIT, |unit| unit.metres);
    let folder = Precomputed::new(info.parent().unwrap_or(&info), metres);
    let mut names = Vec::new();
    if let Segments::Object(number) = segments {
        folder.segment(number.into(), &mesh.vertices, &mesh.triangles)?;
    } else {
        let parts = mesh.parts();
        for (number, pair) in (1..).zip(pairs) {
            // A small one may have left no triangle in the copy.
            if let Ok(at) = parts.binary_search_by_key(pair, |(pair, _)| *pair) {
                let (vertices, triangles) = mesh.only(&parts[at].1);
                folder.segment(number, &vertices, &triangles)?;
            }
            names.push((number, format!("{} | {}", pair[0], pair[1])));
        }
    }
    folder.describe(&names)
}

impl Mesh {
    /// Bytes of memory of the mesh in a file, and of what is made of it: its parts, and the bytes of a file.
    fn bytes(written: &Written) -> u64 {
        written.vertices * (24 + 24 + 12 + 4) + written.triangles * (12 + 8 + 4 + 12 + 12)
    }

    fn read(engine: &Engine, written: &Written, pairs: &mut BTreeSet<[u32; 2]>) -> Result<Self> {
        let (vertices, triangles) = (written.vertices as usize, written.triangles as usize);
        let mut mesh = Self {
            vertices: vec![[0.0; 3]; vertices],
            triangles: Vec::with_capacity(triangles),
            labels: Vec::with_capacity(triangles),
        };
        each(engine, written, |_, corners, places, labels| {
            for (corner, place) in corners.into_iter().zip(places) {
                mesh.vertices[corner as usize] = place;
            }
            mesh.triangles.push(corners);
            mesh.labels.push(labels);
            remember(pairs, labels);
        })?;
        Ok(mesh)
    }

    /// The triangles of each pair of labels, in the order of these.
    fn parts(&self) -> Vec<([u32; 2], Vec<u32>)> {
        let mut order: Vec<u32> = (0..self.triangles.len() as u32).collect();
        let pair = |n: &u32| self.labels[*n as usize];
        order.sort_by_key(pair);
        order.chunk_by(|a, b| pair(a) == pair(b)).map(|part| (pair(&part[0]), part.to_vec())).collect()
    }

    /// Some triangles, with their vertices alone.
    fn only(&self, part: &[u32]) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let corners = || part.iter().map(|&n| self.triangles[n as usize]);
        let mut used: Vec<u32> = corners().flatten().collect();
        used.sort_unstable();
        used.dedup();
        let place = |vertex: u32| used.binary_search(&vertex).map_or(0, |at| at as u32);
        let triangles = corners().map(|triangle| triangle.map(place)).collect();
        (used.iter().map(|&vertex| self.vertices[vertex as usize]).collect(), triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_their_vertices_alone() {
        let mesh = Mesh {
            vertices: (0..6).map(|n| [f64::from(n), 0.0, 0.0]).collect(),
            triangles: vec![[0, 1, 2], [3, 1, 5], [2, 1, 4]],
            labels: vec![[1, 3], [1, 2], [1, 3]],
        };
        let parts = mesh.parts();
        assert_eq!(parts, [([1, 2], vec![1]), ([1, 3], vec![0, 2])]);
        let (vertices, triangles) = mesh.only(&parts[0].1);
        assert_eq!(vertices, [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [5.0, 0.0, 0.0]]);
        assert_eq!(triangles, [[1, 0, 2]]);
        assert_eq!(mesh.only(&parts[1].1).1, [[0, 1, 2], [2, 1, 3]]);
    }
}
