//! Shapes, files and slow plain references that several tests share.

pub(crate) mod around;
pub(crate) mod ball;
pub(crate) mod clouds;
pub(crate) mod damage;
#[cfg(target_os = "linux")]
pub(crate) mod held;
pub(crate) mod lab;
pub(crate) mod mesh_buffer;
pub(crate) mod meshes;
pub(crate) mod npy;
pub(crate) mod patience;
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
pub(crate) mod times;
pub(crate) mod zarr_files;

use std::io::Write;
use std::path::{Path, PathBuf};

use strandline::grid::PointCloud;
use strandline::io::geometry::read::points::read_points;

/// The points of a file, with its numbers as they stand in it.
pub(crate) fn read_cloud(path: &Path) -> strandline::Result<PointCloud> {
    read_points(path).map(|file| file.cloud)
}

/// A file or folder of the test data that is part of the project: see `tests/data/README.md`.
pub(crate) fn shipped(part: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(part)
}

/// A file or folder of the test data that is not part of the project, or `None` after saying that it is left out. With
/// `CI=true` a file that is not there is a failure, unless the whole folder is not.
pub(crate) fn shared_data(part: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let path = folder.join(part);
    if path.exists() {
        return Some(path);
    }
    assert!(!folder.exists() || !is_ci(), "{} is absent", path.display());
    say_skipped(&format!("{} is absent", path.display()));
    None
}

pub(crate) fn is_ci() -> bool {
    std::env::var("CI").as_deref() == Ok("true")
}

/// Says that the running test leaves something out. Straight to stderr: what `println!` says of a test that passes is kept
/// back by the harness.
pub(crate) fn say_skipped(reason: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    writeln!(std::io::stderr(), "skipped in {test}: {reason}").expect("stderr takes a line");
}
