//! Where and how other programs open what is shown: of each program what it can open.

use super::choice::{choices, name_in_address};
use super::described::{Image, Kind};
use super::folder::Folder;
use super::listing::quoted;
use super::shown::{MeshFile, Shown, root_of};
use super::state::address;
use super::told;

/// Endings of meshes that `ParaView` reads; the others `MeshLab` does.
const OF_PARAVIEW: [&str; 3] = ["ply", "obj", "stl"];

/// Links and commands for the server at `origin`, such as `http://127.0.0.1:8000`, a line each.
#[must_use]
pub fn links(shown: &Shown, origin: &str) -> String {
    let pages = choices(shown).into_iter();
    let pages = pages.map(|name| format!("page of a store      {origin}/?store={}\n", name_in_address(name)));
    let source = |image: &Image| format!("neuroglancer source  {origin}{}\n", address(image));
    let images = shown.images.iter().map(source);
    let reports = told::reports(shown).into_iter();
    let reports = reports.map(|report| format!("report               {origin}{}\n", report.address));
    let segments = shown.meshes.iter().map(|mesh| {
        let name = mesh.name.as_ref().map_or(String::new(), |name| format!(", {name}"));
        format!("neuroglancer mesh    precomputed://{origin}/mesh  (segment {}: {}{name})\n", mesh.segment, mesh.path)
    });
    let stores = shown.roots.iter().map(|(name, folder)| of_store(shown, name, folder));
    // Parts of one file follow each other.
    let meshes = shown.meshes.chunk_by(|a, b| a.file == b.file).map(|parts| of_mesh(&parts[0]));
    let rest: String = pages.chain(images).chain(reports).chain(segments).chain(stores).chain(meshes).collect();
    format!("page                 {origin}/\n{rest}")
}

/// What opens the images of a store: where its root is none, each picture by itself.
fn of_store(shown: &Shown, name: &str, folder: &Folder) -> String {
    let images = || shown.images.iter().filter(|image| root_of(&image.path) == name);
    let first = images().map(|image| image.kind).min();
    let has_root = images().any(|image| image.path == name);
    let opened = images().filter(|image| {
        let is_picture = Some(image.kind) == first || image.kind == Kind::Labels;
        if has_root { image.path == name } else { is_picture }
    });
    let lines = opened.map(|image| {
        let inside = image.path.strip_prefix(name).unwrap_or_default().trim_start_matches('/');
        let store = if inside.is_empty() { folder.root().to_path_buf() } else { folder.root().join(inside) };
        let store = quoted(&store);
        // Those read version 0.4 alone.
        let fiji = if image.is_version_2 { format!("Fiji (MoBIE, N5)     {store}\n") } else { String::new() };
        format!("napari               napari --plugin napari-ome-zarr {store}\n{fiji}")
    });
    lines.collect()
}

fn of_mesh(mesh: &MeshFile) -> String {
    let ending = mesh.file.extension().map(std::ffi::OsStr::to_ascii_lowercase).unwrap_or_default();
    let file = quoted(&mesh.file);
    if OF_PARAVIEW.iter().any(|of| ending == *of) {
        format!("ParaView             paraview {file}\n")
    } else {
        format!("MeshLab              meshlab {file}\n")
    }
}
