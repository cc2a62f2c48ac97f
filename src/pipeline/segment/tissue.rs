//! From solved objects to a tissue: their labels joined, and the faces that they have in common written.

use super::labels::Placed;
use super::neighbours::{Joined, Joining, csv, draw_faces, join};
use super::settings::SegmentSettings;
use crate::error::{Error, Result};
use crate::exec::Engine;
use crate::grid::Geometry;
use crate::io::geometry::write::ply::PlyWriter;
use crate::io::ome_zarr::StoreWriter;
use crate::kernel::surface::Contact;
use crate::pipeline::image::ingest::Image;
use crate::pipeline::image::intensity::Normalised;
use crate::pipeline::output::viewer_mesh::{Segments, for_viewers};
use crate::store::{BoxSource, Element, NoMesh};

/// Joins objects; walls between them are looked for in the image where that has a say in them.
pub(super) fn join_objects<'a, T: Element>(
    engine: &Engine,
    geometry: &Geometry,
    (image, voxels): (&Image<T>, &dyn BoxSource<T>),
    objects: Vec<Placed<'a>>,
    settings: &SegmentSettings,
) -> Result<Joined<'a>> {
    let normalised = Normalised::new(voxels, image.range, geometry.domain());
    let joining = Joining {
        geometry,
        image: settings.uses_image().then_some(&normalised),
        overlap: settings.overlap,
        fill: settings.fill_gaps,
    };
    join(engine, objects, &joining)
}

/// Draws, measures and writes the faces of labels, where gaps were asked to be filled.
pub(super) fn write_faces(
    engine: &Engine,
    geometry: &Geometry,
    labels: &Joined<'_>,
    settings: &SegmentSettings,
    store: Option<&StoreWriter>,
) -> Result<Vec<Contact>> {
    let stage = engine.stage("faces", 0);
    if settings.fill_gaps.is_none() {
        stage.finish();
        return Ok(Vec::new());
    }
    stage.voxels(geometry.domain().volume());
    let contacts = match store {
        Some(store) => {
            let mut mesh = PlyWriter::tagged_on_grid(&store.file("meshes/cells.ply")?, geometry)?;
            let contacts = draw_faces(&stage, geometry, labels, &mut mesh)?;
            let written = mesh.finish()?;
            for_viewers(engine, store, (&written, geometry), Segments::None)?;
            let path = store.file("meshes/contacts.csv")?;
            std::fs::write(&path, csv(&contacts))
                .map_err(|e| Error::from_io("cannot write the table", &e).at(&path))?;
            contacts
        }
        None => draw_faces(&stage, geometry, labels, &mut NoMesh)?,
    };
    stage.finish();
    Ok(contacts)
}
