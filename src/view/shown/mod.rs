//! What lies in a store, in a folder of several, or in another program's OME-Zarr, that can be shown: images, label images and
//! fields by their OME metadata (versions 0.4 and 0.5), and meshes.

mod adding;

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::described::{Axis, Image};
use super::documents::{fault, is_meant_as_store, says_something, unshown};
use super::folder::Folder;
use super::listing::{file_name, files, folders, is_mesh};
use super::present::{Present, present};
use crate::error::{Error, Result};
use crate::io::ome_zarr::{Live, LiveState, live};

/// Faults that an error tells, at most.
const MOST_TOLD: usize = 5;

/// Everything that is shown.
#[derive(Clone, Debug)]
pub struct Shown {
    /// What was given, and what it is called.
    path: PathBuf,
    pub(super) name: String,
    /// The folder that was given, where stores lie in it.
    pub(super) beside: Option<Folder>,
    /// The stores and files by the names that they have on the server.
    pub(super) roots: Vec<(String, Folder)>,
    pub(super) images: Vec<Image>,
    pub(super) meshes: Vec<MeshFile>,
    /// Surfaces that still move, of stores that live, and a number that is another when one has moved.
    pub(super) growing: (Vec<MeshFile>, u64),
    /// Marks of segmentations, of each store that has some.
    pub(super) marks: Vec<Marks>,
    /// The times of segmentations over time.
    pub(super) series: Vec<Series>,
    /// What is wrong with stores and images that cannot be shown, and what there was no room for.
    pub(super) faults: Vec<String>,
}

/// The times of a store that has several.
#[derive(Clone, Debug)]
pub(super) struct Series {
    /// The store's name on the server.
    pub(super) root: String,
    /// Its times, as its groups are numbered.
    pub(super) times: Range<u32>,
    /// Those with surfaces.
    pub(super) with_surfaces: Vec<u32>,
}

/// The marks of a store.
#[derive(Clone, Debug)]
pub(super) struct Marks {
    /// The store's name on the server.
    pub(super) root: String,
    /// Physical coordinates.
    pub(super) places: Vec<[f64; 3]>,
    /// The time of each, counted from 0, where they have times.
    pub(super) times: Vec<i64>,
    /// How many there are, of which some may be left out here.
    pub(super) of: usize,
}

/// A mesh.
#[derive(Clone, Debug)]
pub(super) struct MeshFile {
    /// Its path on the server.
    pub(super) path: String,
    /// Where it lies.
    pub(super) file: PathBuf,
    /// The number that the page knows it by: that of its object, where its name has one and no other store has the same.
    pub(super) segment: u64,
    /// The number of its object, where its name has one.
    pub(super) object: Option<u64>,
    /// What it is called, where it is a part of a surface.
    pub(super) name: Option<String>,
    /// What the page gets of it.
    pub(super) drawn: Drawn,
}

/// What is made of a mesh.
#[derive(Clone, Debug)]
pub(super) enum Drawn {
    /// The bytes of a file as they are.
    Fragment(PathBuf),
    /// A mesh that has to be read.
    Mesh(PathBuf),
}

impl Shown {
    /// Looks at a store, a folder of stores, or a mesh.
    ///
    /// # Errors
    /// When there is nothing that can be shown.
    pub fn of(path: &Path) -> Result<Self> {
        let mut shown = Self {
            path: path.to_path_buf(),
            name: path.canonicalize().map_or_else(|_| file_name(path), |path| file_name(&path)),
            beside: None,
            series: Vec::new(),
            faults: Vec::new(),
            roots: Vec::new(),
            images: Vec::new(),
            meshes: Vec::new(),
            growing: (Vec::new(), 0),
            marks: Vec::new(),
        };
        let found = std::fs::metadata(path)
            .map_err(|e| Error::input(format!("cannot be opened: {e}")).caused_by(e).at(path))?;
        if found.is_file() {
            shown.add_mesh(path)?;
        } else if says_something(path) {
            shown.add_store(path)?;
        } else {
            shown.add_stores_of(path)?;
        }
        shown.images.sort_by_key(|image| image.kind);
        let is_interrupted = shown.live().any(|live| live.state == LiveState::Interrupted);
        if shown.images.is_empty() && shown.meshes.is_empty() && is_interrupted {
            let what = "was left by a run that was interrupted before there was anything to show; run it again";
            return Err(Error::input(what).at(path));
        }
        if shown.images.is_empty() && shown.meshes.is_empty() && !shown.is_live() {
            return Err(shown.nothing());
        }
        Ok(shown)
    }

    /// The error where there is nothing that can be shown.
    fn nothing(&self) -> Error {
        if let Some((document, why)) = fault(&self.path) {
            return Error::input(why).at(&document);
        }
        let why = match self.faults.as_slice() {
            [] if is_meant_as_store(&self.path) => format!(": {}", unshown(&self.path)),
            [] => String::new(),
            few if few.len() <= MOST_TOLD => format!(": {}", few.join("; ")),
            several => format!(": {}; and {} more", several[..MOST_TOLD].join("; "), several.len() - MOST_TOLD),
        };
        let what = "holds nothing that can be shown";
        Error::input(format!("{what}{why}; give an OME-Zarr store, a folder of some, or a mesh")).at(&self.path)
    }

    /// What was given, as it was.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The axes of the world in which a mesh lies at a path: of its store's image, of one beside stores those of the first image.
    pub(super) fn axes_at(&self, path: &str) -> &[Axis] {
        let root = root_of(path);
        let is_in_store = self.roots.iter().any(|(name, _)| name == root);
        let image = self.images.iter().find(|image| !is_in_store || root_of(&image.path) == root);
        image.map_or(&[], |image| &image.axes)
    }

    /// Looks again.
    pub(super) fn again(&self) -> Result<Self> {
        Self::of(&self.path)
    }

    /// Whether a store is still written.
    pub(super) fn is_live(&self) -> bool {
        self.live().any(|live| live.state == LiveState::Running)
    }

    /// The stores that are there, or the mesh that was given.
    pub(super) fn present(&self) -> Vec<Present> {
        if self.roots.is_empty() {
            return present(&self.name, &self.path).into_iter().collect();
        }
        self.roots.iter().filter_map(|(name, folder)| present(name, folder.root())).collect()
    }

    /// What may be stores or meshes in the folder that was given; nothing where a single one was.
    pub(super) fn listed(&self) -> Vec<Present> {
        let Some(beside) = &self.beside else { return Vec::new() };
        let meshes = files(beside.root()).into_iter().filter(|file| is_mesh(file));
        folders(beside.root()).into_iter().chain(meshes).filter_map(|path| present(&file_name(&path), &path)).collect()
    }

    /// What those stores say that are or were live.
    pub(super) fn live(&self) -> impl Iterator<Item = Live> {
        self.roots.iter().filter_map(|(_, folder)| live(folder.root()))
    }
}

/// The store that a path on the server leads into.
pub(in crate::view) fn root_of(path: &str) -> &str {
    path.split('/').next().unwrap_or_default()
}
