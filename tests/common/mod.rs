//! Shapes, files and slow plain references that several tests share.

pub(crate) mod around;
pub(crate) mod ball;
pub(crate) mod clouds;
pub(crate) mod damage;
#[cfg(target_os = "linux")]
pub(crate) mod held;
pub(crate) mod lab;
pub(crate) mod meshes;
pub(crate) mod npy;
pub(crate) mod plain_reconstruction;
pub(crate) mod plain_scheme;
pub(crate) mod polyhedra;
pub(crate) mod python;
pub(crate) mod random;
pub(crate) mod samples;
pub(crate) mod solve;
pub(crate) mod stores;
pub(crate) mod textbook;
pub(crate) mod tiff_bytes;
pub(crate) mod tiff_planes;
pub(crate) mod zarr_files;

use std::path::PathBuf;

/// The folder of shared test data, or `None` after saying that the test is skipped.
pub(crate) fn shared_data(part: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(part);
    if folder.exists() {
        return Some(folder);
    }
    println!("skipped: {} is absent", folder.display());
    None
}
