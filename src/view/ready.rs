//! Meshes that a store holds for viewers beside its own: fragments as neuroglancer reads them, in `precomputed/`, and copies with
//! fewer triangles, in `simplified/`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;

/// Names of segments are no longer than this, all of them.
const MOST_BYTES: u64 = 16 << 20;

/// What the folder of a store's meshes holds for viewers.
#[derive(Debug, Default)]
pub(super) struct Ready {
    folder: PathBuf,
    /// Fragments by the numbers of their segments.
    fragments: BTreeMap<u64, PathBuf>,
    /// The names of these, where they are parts of one surface.
    names: BTreeMap<u64, String>,
}

/// A fragment that is ready.
#[derive(Clone, Debug)]
pub(super) struct Fragment {
    pub(super) file: PathBuf,
    pub(super) segment: u64,
    /// What the segment is called, where it is not an object.
    pub(super) name: Option<String>,
}

impl Ready {
    /// Looks into the folder of a store's meshes.
    pub(super) fn of(folder: &Path) -> Self {
        let mut found = Self { folder: folder.to_path_buf(), ..Self::default() };
        let precomputed = folder.join("precomputed");
        let Ok(listed) = std::fs::read_dir(&precomputed) else { return found };
        for name in listed.filter_map(|entry| entry.ok()?.file_name().into_string().ok()) {
            // A manifest is written when its fragment is there.
            let Some(number) = name.strip_suffix(":0").and_then(|digits| digits.parse::<u64>().ok()) else { continue };
            let file = precomputed.join(number.to_string());
            if number > 0 && is_file(&file) {
                found.fragments.insert(number, file);
            }
        }
        found.names = names(&precomputed.join("segment_properties/info")).unwrap_or_default();
        found
    }

    /// The fragments of one of the store's meshes; none where it has to be read itself.
    pub(super) fn fragments_of(&self, mesh: &Path) -> Vec<Fragment> {
        let stem = mesh.file_stem().unwrap_or_default().to_string_lossy();
        let number = stem.strip_prefix("object-").and_then(|digits| digits.parse::<u64>().ok());
        let is_of_it = |segment: u64| match number {
            Some(number) => number == segment && self.names.is_empty(),
            None if self.names.is_empty() => stem == "surface" && self.fragments.len() == 1,
            None => stem == "surface",
        };
        let of = |(&segment, file): (&u64, &PathBuf)| {
            let name = self.names.get(&segment).cloned();
            Fragment { file: file.clone(), segment, name }
        };
        self.fragments.iter().filter(|(segment, _)| is_of_it(**segment)).map(of).collect()
    }

    /// The copy of a mesh, or itself where it has none.
    pub(super) fn copy_of(&self, mesh: &Path) -> PathBuf {
        let copy = self.folder.join("simplified").join(mesh.file_name().unwrap_or_default());
        if is_file(&copy) { copy } else { mesh.to_path_buf() }
    }
}

fn is_file(path: &Path) -> bool {
    path.is_file() && !path.is_symlink()
}

/// The names of segments.
fn names(path: &Path) -> Option<BTreeMap<u64, String>> {
    if !is_file(path) || path.metadata().ok()?.len() > MOST_BYTES {
        return None;
    }
    let info: Value = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
    let inline = &info["inline"];
    let values =
        inline["properties"].as_array()?.iter().find(|property| property["type"] == "label")?["values"].as_array()?;
    let named = inline["ids"].as_array()?.iter().zip(values);
    Some(named.filter_map(|(id, name)| Some((id.as_str()?.parse().ok()?, name.as_str()?.to_owned()))).collect())
}
