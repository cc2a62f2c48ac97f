//! Where and how other programs open what is shown.

use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};

use super::shown::{Image, Shown};

/// Links and commands for the server at `origin`, such as `http://127.0.0.1:8000`, a line each.
#[must_use]
pub fn links(shown: &Shown, origin: &str) -> String {
    let source = |image: &Image| {
        let version = if image.is_version_2 { "zarr2" } else { "zarr3" };
        format!("neuroglancer source  {origin}/data/{}/|{version}:\n", image.path)
    };
    let images: String = shown.images.iter().map(source).collect();
    let has_report = |folder: &super::folder::Folder| folder.root().join("report.html").is_file();
    let reports = shown.roots.iter().filter(|(_, folder)| has_report(folder)).map(|(name, _)| {
        format!("report               {origin}/data/{}/report.html\n", utf8_percent_encode(name, NON_ALPHANUMERIC))
    });
    let segments = shown.meshes.iter().map(|mesh| {
        let name = mesh.name.as_ref().map_or(String::new(), |name| format!(", {name}"));
        format!("neuroglancer mesh    precomputed://{origin}/mesh  (segment {}: {}{name})\n", mesh.segment, mesh.path)
    });
    let stores = shown.roots.iter().map(|(_, folder)| {
        let store = folder.root().display();
        format!("napari               napari --plugin napari-ome-zarr {store}\nFiji (MoBIE, N5)     {store}\n")
    });
    // Parts of one file follow each other.
    let files = shown.meshes.chunk_by(|a, b| a.file == b.file).map(|parts| &parts[0].file);
    let meshes = files.map(|file| format!("ParaView             paraview {}\n", file.display()));
    let rest: String = reports.chain(segments).chain(stores).chain(meshes).collect();
    format!("page                 {origin}/\n{images}{rest}")
}
