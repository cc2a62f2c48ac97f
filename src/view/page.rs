//! The page as `scripts/build_viewer` bundled it, packed with gzip: neuroglancer (Apache-2.0, see viewer/dist/LICENSES) and the lines
//! of viewer/page.

/// Files of the page: name, type, content.
const FILES: &[(&str, &str, &[u8])] = &[
    ("index.html", "text/html; charset=utf-8", include_bytes!("../../viewer/dist/index.html.gz")),
    ("main.js", "text/javascript", include_bytes!("../../viewer/dist/main.js.gz")),
    ("main.css", "text/css", include_bytes!("../../viewer/dist/main.css.gz")),
    ("chunk_worker.bundle.js", "text/javascript", include_bytes!("../../viewer/dist/chunk_worker.bundle.js.gz")),
    (
        "async_computation.bundle.js",
        "text/javascript",
        include_bytes!("../../viewer/dist/async_computation.bundle.js.gz"),
    ),
    ("compresso.wasm", "application/wasm", include_bytes!("../../viewer/dist/compresso.wasm.gz")),
    ("libpng.wasm", "application/wasm", include_bytes!("../../viewer/dist/libpng.wasm.gz")),
    ("neuroglancer_draco.wasm", "application/wasm", include_bytes!("../../viewer/dist/neuroglancer_draco.wasm.gz")),
];

/// A file of the page.
#[derive(Clone, Copy, Debug)]
pub(super) struct PageFile {
    /// Its media type.
    pub(super) media_type: &'static str,
    /// Its bytes, packed with gzip.
    pub(super) packed: &'static [u8],
}

/// The file of that name.
pub(super) fn file(name: &str) -> Option<PageFile> {
    let name = if name.is_empty() { "index.html" } else { name };
    FILES.iter().find(|file| file.0 == name).map(|&(_, media_type, packed)| PageFile { media_type, packed })
}
