//! Where and how other programs open what is shown.

use super::described::Image;
use super::listing::quoted;
use super::shown::Shown;
use super::state::{address, root_of};
use super::told;

/// Links and commands for the server at `origin`, such as `http://127.0.0.1:8000`, a line each.
#[must_use]
pub fn links(shown: &Shown, origin: &str) -> String {
    let source = |image: &Image| format!("neuroglancer source  {origin}{}\n", address(image));
    let images: String = shown.images.iter().map(source).collect();
    let reports =
        told::reports(shown).into_iter().map(|(_, address)| format!("report               {origin}{address}\n"));
    let segments = shown.meshes.iter().map(|mesh| {
        let name = mesh.name.as_ref().map_or(String::new(), |name| format!(", {name}"));
        format!("neuroglancer mesh    precomputed://{origin}/mesh  (segment {}: {}{name})\n", mesh.segment, mesh.path)
    });
    let stores = shown.roots.iter().map(|(name, folder)| {
        let store = quoted(folder.root());
        let of_store = |image: &&Image| root_of(&image.path) == name;
        // Those read version 0.4 alone.
        let is_older = shown.images.iter().find(of_store).is_some_and(|image| image.is_version_2);
        let fiji = if is_older { format!("Fiji (MoBIE, N5)     {store}\n") } else { String::new() };
        format!("napari               napari --plugin napari-ome-zarr {store}\n{fiji}")
    });
    // Parts of one file follow each other.
    let files = shown.meshes.chunk_by(|a, b| a.file == b.file).map(|parts| &parts[0].file);
    let meshes = files.map(|file| format!("ParaView             paraview {}\n", quoted(file)));
    let rest: String = reports.chain(segments).chain(stores).chain(meshes).collect();
    format!("page                 {origin}/\n{images}{rest}")
}
