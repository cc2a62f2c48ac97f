//! Where a surface goes while it is drawn: into the store and into the file that its name was asked for, in the format of that.
//! What goes wrong with a file beside a store is told when the store is complete: it costs a copy, not the result.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use super::checks::numbered;
use super::files::mesh_format;
use crate::error::Result;
use crate::exec::Engine;
use crate::grid::Geometry;
use crate::io::geometry::write::formats::{MeshFile, Values, WholeMesh};
use crate::io::geometry::write::ply::PlyWriter;
use crate::io::ome_zarr::StoreWriter;
use crate::kernel::geometry::nearest_point::NearestPoint;
use crate::pipeline::marks::ObjectMarks;
use crate::pipeline::output::viewer_mesh::{Segments, Simplified, for_viewers};
use crate::pipeline::segment::{ObjectMesh, ObjectMeshes};
use crate::store::{BothSinks, MeshSink};

/// A surface that is being drawn: into a store, and into the file that was asked for.
pub(crate) type Drawing = BothSinks<PlyWriter, Asked>;

/// A mesh file that was asked for.
#[derive(Clone, Copy)]
pub(crate) struct ToFile<'a> {
    pub(crate) path: &'a Path,
    /// The folder of temporary files.
    pub(crate) scratch: &'a Path,
    /// Whether triangles have labels.
    pub(crate) is_tagged: bool,
    /// Whether the surface is in a store too.
    pub(crate) is_copy: bool,
    /// Whether what has its name may be replaced.
    pub(crate) replace: bool,
    /// A number that is told of each vertex.
    pub(crate) values: Option<&'a Values>,
}

/// What the meshes of viewers are made with.
#[derive(Clone, Copy)]
pub(crate) struct ForViewers<'a> {
    pub(crate) engine: &'a Engine,
    pub(crate) store: Option<&'a StoreWriter>,
    pub(crate) geometry: &'a Geometry,
    pub(crate) segments: Segments,
}

/// The file while it is written; what went wrong with a copy.
pub(crate) struct Asked {
    file: Result<MeshFile>,
    is_copy: bool,
    replace: bool,
}

/// A file that was asked for, without its name yet, or what went wrong with a copy; and whether what has its name may be
/// replaced.
pub(crate) struct Finished(Result<WholeMesh>, bool);

impl Drawing {
    /// The surface on a grid, into a store and a file as far as these are there.
    pub(crate) fn new(
        store: Option<&StoreWriter>,
        to: Option<ToFile<'_>>,
        geometry: &Geometry,
        is_tagged: bool,
    ) -> Result<Self> {
        let create = if is_tagged { PlyWriter::tagged_on_grid } else { PlyWriter::on_grid };
        let ply = store.map(|store| create(&store.file("meshes/surface.ply")?, geometry)).transpose()?;
        Ok(Self { first: ply, second: to.map(|to| Asked::new(to, geometry)).transpose()? })
    }

    /// Completes the files, that which was asked for gets its name later; makes what a store has of them for viewers, and tells of
    /// the copy of a large one.
    pub(crate) fn finish(self, to: &ForViewers<'_>) -> Result<(Option<Finished>, Option<Simplified>)> {
        let written = self.first.map(PlyWriter::finish).transpose()?;
        let file = self.second.map(Asked::finish).transpose()?;
        let Some((store, written)) = to.store.zip(written) else { return Ok((file, None)) };
        Ok((file, for_viewers(to.engine, store, (&written, to.geometry), to.segments)?))
    }
}

impl Asked {
    fn new(to: ToFile<'_>, geometry: &Geometry) -> Result<Self> {
        let format = mesh_format(to.path)?;
        let file = MeshFile::create(format, to.path, geometry, to.is_tagged, to.scratch)?;
        let file = match to.values.filter(|_| format.has_values) {
            Some(values) => file.with_values(values.clone(), to.scratch)?,
            None => file,
        };
        Ok(Self { file: Ok(file), is_copy: to.is_copy, replace: to.replace })
    }

    fn take(&mut self, take: impl FnOnce(&mut MeshFile) -> Result<()>) -> Result<()> {
        let Ok(file) = &mut self.file else { return Ok(()) };
        match take(file) {
            Err(error) if self.is_copy => {
                self.file = Err(error);
                Ok(())
            }
            taken => taken,
        }
    }

    fn finish(self) -> Result<Finished> {
        let whole = self.file.and_then(MeshFile::complete);
        Ok(Finished(if self.is_copy { whole } else { Ok(whole?) }, self.replace))
    }
}

impl Finished {
    /// Puts the file under its name.
    pub(crate) fn place(self) -> Result<()> {
        self.0?.place(self.1)
    }
}

impl MeshSink for Asked {
    fn on_grid(&mut self, grid: &Geometry) -> Result<()> {
        self.take(|file| file.on_grid(grid))
    }

    fn vertex(&mut self, position: [f64; 3]) -> Result<()> {
        self.take(|file| file.vertex(position))
    }

    fn keeps_values(&self) -> bool {
        self.file.as_ref().is_ok_and(MeshSink::keeps_values)
    }

    fn valued_vertex(&mut self, position: [f64; 3], value: f64) -> Result<()> {
        self.take(|file| file.valued_vertex(position, value))
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        self.take(|file| file.triangle(corners))
    }

    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> Result<()> {
        self.take(|file| file.facet(corners, labels))
    }
}

/// The distance to the nearest of some points, for a file whose format holds it, unless there are none or the memory has no room
/// for what finds it.
pub(crate) fn distance_to_marks(
    engine: &Engine,
    path: &Path,
    points: impl FnOnce() -> Vec<[f64; 3]>,
) -> Result<Option<Values>> {
    let name = "distance_to_marks";
    if !mesh_format(path)?.has_values {
        return Ok(None);
    }
    let points = points();
    if points.is_empty() {
        return Ok(None);
    }
    let Ok(held) = engine.hold(NearestPoint::BYTES * points.len() as u64) else {
        engine.note(&format!(
            "{}: without {name}: the memory has no room for it; more --memory gives it",
            path.display()
        ));
        return Ok(None);
    };
    let nearest = NearestPoint::new(points);
    // It is held as long as the file is written.
    let at = move |place| (&held, nearest.distance(place)).1;
    Ok(Some(Values { name, at: Some(Arc::new(at)) }))
}

/// The files of several objects, or that of one.
pub(crate) struct ObjectFiles<'a> {
    to: ToFile<'a>,
    several: bool,
    /// The grid of all objects.
    geometry: &'a Geometry,
    /// The engine and the marks of objects, for their distance.
    marks: (&'a Engine, &'a [ObjectMarks]),
    finished: Mutex<Vec<(u32, Finished)>>,
}

/// The file of one object.
struct ObjectFile<'a> {
    of: &'a ObjectFiles<'a>,
    label: u32,
    asked: Asked,
}

impl<'a> ObjectFiles<'a> {
    /// Files by the name that was asked for, numbered where there are several objects.
    pub(crate) fn new(
        to: ToFile<'a>,
        several: bool,
        geometry: &'a Geometry,
        marks: (&'a Engine, &'a [ObjectMarks]),
    ) -> Self {
        Self { to, several, geometry, marks, finished: Mutex::default() }
    }

    /// Puts all files under their names.
    pub(crate) fn place(self) -> Result<()> {
        let mut finished = self.finished.into_inner().unwrap_or_else(PoisonError::into_inner);
        finished.sort_by_key(|(label, _)| *label);
        finished.into_iter().try_for_each(|(_, file)| file.place())
    }
}

impl ObjectMeshes for ObjectFiles<'_> {
    fn begin(&self, label: u32, grid: &Geometry) -> Result<Box<dyn ObjectMesh + '_>> {
        let numbered = numbered(self.to.path, label);
        let path = if self.several { &numbered } else { self.to.path };
        let (engine, marks) = self.marks;
        let points =
            || marks.iter().filter(|marks| marks.object == label).flat_map(|marks| marks.contours.concat()).collect();
        let values = distance_to_marks(engine, path, points)?;
        let mut asked = Asked::new(ToFile { path, values: values.as_ref(), ..self.to }, grid)?;
        // All are seen from one place.
        asked.on_grid(self.geometry)?;
        Ok(Box::new(ObjectFile { of: self, label, asked }))
    }
}

impl MeshSink for ObjectFile<'_> {
    fn vertex(&mut self, position: [f64; 3]) -> Result<()> {
        self.asked.vertex(position)
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        self.asked.triangle(corners)
    }
}

impl ObjectMesh for ObjectFile<'_> {
    fn keep(self: Box<Self>) -> Result<()> {
        let finished = (self.label, self.asked.finish()?);
        self.of.finished.lock().unwrap_or_else(PoisonError::into_inner).push(finished);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// STL cannot be written of a triangle whose vertices are not known.
    #[test]
    fn a_copy_that_fails_costs_no_result() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.stl");
        let geometry = Geometry { shape: [9; 3], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
        let to = |is_copy| ToFile {
            path: &path,
            scratch: folder.path(),
            is_tagged: false,
            is_copy,
            replace: false,
            values: None,
        };
        let mut alone = Drawing::new(None, Some(to(false)), &geometry, false).unwrap();
        assert!(alone.triangle([0, 1, 2]).is_err());
        drop(alone);
        let mut copy = Drawing::new(None, Some(to(true)), &geometry, false).unwrap();
        copy.triangle([0, 1, 2]).unwrap();
        copy.vertex([0.0; 3]).unwrap();
        let finished = copy.second.unwrap().finish().unwrap();
        let error = finished.place().unwrap_err().to_string();
        assert!(error.contains("m.stl: the mesh cannot be written"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing stays of either");
    }
}
