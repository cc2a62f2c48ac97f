//! `--init`: a list to begin with, of the stacks in a folder and the points that lie beside them under the same names.

use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::items::stem;
use crate::error::{Error, Result};
use crate::io::stack::formats::format_of;

/// Endings of files of points.
const POINTS: [&str; 6] = ["csv", "xyz", "ply", "roi", "zip", "txt"];
/// Formats of points that may hold anything else: only what is called as a stack is one.
const NAME: &str = "jobs.toml";

/// Writes the list; returns where, and how many items and stacks without points it has.
///
/// # Errors
/// When there is one already, or it cannot be written, or no stack is there.
pub(crate) fn write(folder: &Path) -> Result<(PathBuf, usize, usize)> {
    let fault = |what: &str, error: std::io::Error| Error::from_io(what, &error).at(folder);
    let mut paths: Vec<PathBuf> = fs::read_dir(folder)
        .map_err(|error| {
            Error::input(format!("cannot be read as a folder of stacks: {error}")).caused_by(error).at(folder)
        })?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.file_name().is_some_and(|name| !name.to_string_lossy().starts_with('.')))
        .collect();
    paths.sort();
    let name = |path: &PathBuf| path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let points: Vec<String> = paths.iter().filter(|path| is_points(path)).map(name).collect();
    let stacks: Vec<String> =
        paths.iter().filter(|path| !is_points(path) && format_of(path).is_some()).map(name).collect();
    if stacks.is_empty() {
        let what = "holds no stack (TIFF, OME-Zarr, NRRD, VTI, folders of slices); name the folder that they are in";
        return Err(Error::input(what).at(folder));
    }
    let (text, with) = list(&stacks, &points);
    let path = folder.join(NAME);
    let mut file = match OpenOptions::new().write(true).create_new(true).open(&path) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            return Err(Error::usage("is there already, and stays; move it away for a new one").at(&path));
        }
        opened => opened.map_err(|error| fault("a list cannot be written there", error))?,
    };
    file.write_all(text.as_bytes()).map_err(|error| fault("a list cannot be written there", error))?;
    Ok((path, with, stacks.len() - with))
}

fn is_points(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    path.is_file() && ending.is_some_and(|ending| POINTS.contains(&ending.as_str()))
}

/// The list, and how many of its stacks have points.
fn list(stacks: &[String], points: &[String]) -> (String, usize) {
    let mut text = String::from(
        "# Items of `strandline batch`: strandline batch jobs.toml -o RESULTS\n\
         # Flags of the command go by their names with _ for -, here for all items, below for one.\n\n\
         [defaults]\n\
         command = \"segment\"\n\
         # image_spacing = [0.2, 0.2, 1.0]   # where files do not say it, or say it wrong\n\
         # channel = 0\n",
    );
    let mut with = 0;
    for stack in stacks {
        let stem = stem(stack);
        let own: Vec<&String> = points.iter().filter(|points| self::stem(points) == stem).collect();
        let quoted = |name: &str| serde_json::to_string(name).unwrap_or_default();
        if own.is_empty() {
            let names =
                format!("# [[items]]\n# images = {}\n# points = \"?\"   # none is called {stem}.*", quoted(stack));
            let _ = write!(text, "\n{names}\n");
            continue;
        }
        with += 1;
        let own: Vec<String> = own.iter().map(|name| quoted(name)).collect();
        let own = if let [one] = own.as_slice() { one.clone() } else { format!("[{}]", own.join(", ")) };
        let _ = write!(text, "\n[[items]]\nimages = {}\npoints = {own}\n", quoted(stack));
    }
    (text, with)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stacks_find_their_points() {
        let names = |all: &[&str]| all.iter().map(ToString::to_string).collect::<Vec<_>>();
        let (text, with) =
            list(&names(&["a.ome.tif", "b.tif", "c d.tif"]), &names(&["a.csv", "c d.1.csv", "c d.csv", "c d.zip"]));
        assert_eq!(with, 2);
        assert!(text.contains("images = \"a.ome.tif\"\npoints = \"a.csv\"\n"), "{text}");
        assert!(text.contains("images = \"c d.tif\"\npoints = [\"c d.csv\", \"c d.zip\"]\n"), "{text}");
        assert!(text.contains("# images = \"b.tif\"\n"), "{text}");
    }
}
