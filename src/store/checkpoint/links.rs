//! Files of the output that are whole, under a second name in the folder of checkpoints: a hard link, which copies nothing, and stays
//! when the output in the making goes.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::names::{Owner, link_name};

/// A file of the output that will not change.
#[derive(Clone, Debug)]
pub struct Linked {
    /// Where it lies.
    pub path: PathBuf,
    /// What the stage calls it: no other file of the stage, and this one in every checkpoint.
    pub name: String,
}

/// One that is linked.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct LinkOf {
    /// In the folder.
    pub(super) name: String,
    /// What the stage calls it.
    of: String,
}

/// Gives files names in the folder, with the number of a checkpoint, those that have none yet from the stage's checkpoint
/// `before`, and hands them to the disk. `goes_on` is asked between them.
pub(super) fn link(
    folder: &Path,
    (owner, number): (Owner, u64),
    before: &[LinkOf],
    linked: &[Linked],
    goes_on: &dyn Fn() -> io::Result<()>,
) -> io::Result<Vec<LinkOf>> {
    let before: HashMap<&str, &str> = before.iter().map(|link| (link.of.as_str(), link.name.as_str())).collect();
    let link = |(n, Linked { path, name: of }): (usize, &Linked)| {
        if let Some(&name) = before.get(of.as_str()) {
            return Ok(LinkOf { name: name.to_owned(), of: of.clone() });
        }
        goes_on()?;
        let name = link_name(owner, number, n);
        second_name(path, &folder.join(&name))?;
        Ok(LinkOf { name, of: of.clone() })
    };
    linked.iter().enumerate().map(link).collect()
}

/// Gives a file a second name, in place of what a killed run may have left under it.
fn second_name(file: &Path, name: &Path) -> io::Result<()> {
    match fs::remove_file(name) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    fs::hard_link(file, name).map_err(|error| {
        let what = "files of the output cannot have a second name (hard link) there; name a folder on the disk of the output with --checkpoint";
        io::Error::new(error.kind(), format!("{what}: {error}"))
    })?;
    File::open(name)?.sync_all()
}
