//! The last checkpoint in a folder that is whole: of a run on several ranks what all of them have taken together, and what each has put
//! by for itself since.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;

use super::identity::{Identity, difference};
use super::manifest::{FileOf, Held, Manifest, joined};
use super::names::{manifest_name, manifests};
use super::payload;
use super::record;
use crate::error::{Error, Result};

/// Bytes that are read at a time.
const BUFFER: usize = 1 << 20;

/// What a run goes on from.
#[derive(Debug, Default)]
pub(super) struct Chosen {
    /// The largest number of any manifest.
    pub(super) last: u64,
    /// The names of the manifests, and of all that they need.
    pub(super) manifests: Vec<String>,
    pub(super) needed: BTreeSet<String>,
    /// By stage.
    pub(super) entries: BTreeMap<String, Held>,
    /// What was passed over, and why.
    pub(super) torn: Vec<String>,
}

impl Chosen {
    /// Of these manifests, which fit each other.
    fn of(&mut self, chosen: Vec<(String, Manifest)>) {
        let (names, manifests): (Vec<String>, Vec<Manifest>) = chosen.into_iter().unzip();
        self.needed = manifests.iter().flat_map(Manifest::needed).chain(names.iter().cloned()).collect();
        self.entries = joined(manifests);
        self.manifests = names;
    }
}

/// The last one that is whole, of a run of this identity.
///
/// # Errors
/// When one is of other settings, inputs or another version, which are named.
pub(super) fn last_whole(folder: &Path, identity: &Identity) -> Result<Chosen> {
    let mut chosen = Chosen::default();
    // By when their runs began and how many ranks these had.
    let mut runs: BTreeMap<(u64, usize), Vec<(u64, Manifest)>> = BTreeMap::new();
    for (number, owner) in manifests(folder).into_iter().rev() {
        chosen.last = chosen.last.max(number);
        let path = folder.join(manifest_name(owner, number));
        let manifest = match record::read::<Manifest>(&path) {
            Ok(manifest) => manifest,
            Err(error) => {
                chosen.torn.push(format!("{}: {error}", path.display()));
                continue;
            }
        };
        if let Some(difference) = difference(&manifest.identity, identity) {
            let what = format!(
                "this run is not the one that was ended: {difference}; give what was given then, or leave --resume out and choose another output"
            );
            return Err(Error::usage(what).at(folder));
        }
        runs.entry((manifest.since, manifest.ranks)).or_default().push((number, manifest));
    }
    let mut files = Files { folder, known: HashMap::new() };
    for ((_, ranks), run) in runs.into_iter().rev() {
        if let Some(found) = whole_of(&mut files, ranks, &run, &mut chosen.torn) {
            chosen.of(found);
            break;
        }
    }
    Ok(chosen)
}

/// What another rank has chosen.
///
/// # Errors
/// When it cannot be read.
pub(super) fn read_chosen(folder: &Path, names: &[String]) -> Result<Chosen> {
    let read = |name: &String| {
        let path = folder.join(name);
        let manifest = record::read::<Manifest>(&path).map_err(|error| {
            let what = "a checkpoint that the first rank found cannot be read; give a folder that all ranks see with --checkpoint";
            Error::from_io(what, &error).at(&path)
        })?;
        Ok((name.clone(), manifest))
    };
    let mut chosen = Chosen::default();
    chosen.of(names.iter().map(read).collect::<Result<_>>()?);
    Ok(chosen)
}

/// Of a run's manifests, the last first, those of all ranks that fit each other and are whole.
fn whole_of(
    files: &mut Files<'_>,
    ranks: usize,
    run: &[(u64, Manifest)],
    torn: &mut Vec<String>,
) -> Option<Vec<(String, Manifest)>> {
    let together: BTreeSet<u64> = run.iter().map(|(_, manifest)| manifest.together).collect();
    for together in together.into_iter().rev() {
        let mut found: BTreeMap<usize, (String, Manifest)> = BTreeMap::new();
        for (number, manifest) in run.iter().filter(|(_, manifest)| manifest.together == together) {
            if found.contains_key(&manifest.rank) {
                continue;
            }
            match manifest.files().find_map(|file| files.fault(file)) {
                Some(fault) if !torn.contains(&fault) => torn.push(fault),
                Some(_) => {}
                None => {
                    let name = manifest_name(manifest.owner(), *number);
                    found.insert(manifest.rank, (name, manifest.clone()));
                }
            }
        }
        // What each has put by for itself stands whatever the others have.
        if found.len() == ranks || (together == 0 && !found.is_empty()) {
            return Some(found.into_values().collect());
        }
    }
    None
}

/// Files of bricks that were looked at.
struct Files<'a> {
    folder: &'a Path,
    /// What is wrong with each.
    known: HashMap<String, Option<String>>,
}

impl Files<'_> {
    /// What is wrong with one.
    fn fault(&mut self, file: &FileOf) -> Option<String> {
        let path = self.folder.join(&file.name);
        let look = || Some(format!("{}: {}", path.display(), whole(&path, file.bytes).err()?));
        self.known.entry(file.name.clone()).or_insert_with(look).clone()
    }
}

/// Checks a file of bricks from its beginning to its end.
fn whole(path: &Path, bytes: u64) -> io::Result<()> {
    let opened = File::open(path)?;
    if opened.metadata()?.len() != bytes {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "has not the length that it had"));
    }
    payload::check(&mut BufReader::with_capacity(BUFFER, opened), bytes)
}
