//! What lies in a store, in a folder of several, or in another program's OME-Zarr, that can be shown: images, label images and
//! fields by their OME metadata (versions 0.4 and 0.5), and meshes.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use super::described::{Image, Kind, fault, image, multiscale};
use super::folder::Folder;
use super::listing::{file_name, files, folders, is_mesh};
use super::present::{Present, present};
use super::ready::Ready;
use crate::error::{Error, Result};
use crate::io::geometry::read::point_file::PointFile;
use crate::io::geometry::read::points::read_points;
use crate::io::ome_zarr::{GROWING, Live, LiveState, TIMES, live};
use crate::pipeline::output::viewer_mesh::{PRECOMPUTED, SIMPLIFIED};
use crate::pipeline::segment::MARKS;

/// Folders below a store that are looked into.
const DEEPEST: usize = 3;
/// Images and meshes that are looked at, at most, and fields that are shown.
const MOST: usize = 4096;
const MOST_FIELDS: usize = 6;
/// Marks that are shown of a store, at most.
const MOST_MARKS: usize = 20_000;

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
    /// What is wrong with stores that cannot be shown.
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
        } else if multiscale(path).is_some() {
            shown.add_store(path)?;
        } else {
            for below in folders(path) {
                if multiscale(&below).is_some() && shown.roots.len() < MOST {
                    shown.add_store(&below)?;
                } else if let Some((document, why)) = fault(&below) {
                    shown.faults.push(format!("{}/{} {why}", file_name(&below), file_name(&document)));
                }
            }
            // A store without an image of its own, such as one that was just begun.
            if shown.roots.is_empty() {
                shown.add_store(path)?;
            } else {
                shown.beside = Some(Folder::new(path)?);
                files(path).iter().filter(|file| is_mesh(file)).try_for_each(|file| shown.add_mesh(file))?;
            }
        }
        shown.thin_fields();
        let is_interrupted = shown.live().any(|live| live.state == LiveState::Interrupted);
        if shown.images.is_empty() && shown.meshes.is_empty() && is_interrupted {
            let what = "was left by a run that was interrupted before there was anything to show; run it again";
            return Err(Error::input(what).at(path));
        }
        if shown.images.is_empty() && shown.meshes.is_empty() && !shown.is_live() {
            let what = "holds nothing that can be shown; give an OME-Zarr store, a folder of some, or a mesh";
            let refused = || Error::input(what).at(path);
            return Err(fault(path).map_or_else(refused, |(document, why)| Error::input(why).at(&document)));
        }
        Ok(shown)
    }

    /// What was given, as it was.
    pub(super) fn path(&self) -> &Path {
        &self.path
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
    pub(super) fn listed(&self) -> Vec<PathBuf> {
        let Some(beside) = &self.beside else { return Vec::new() };
        let meshes = files(beside.root()).into_iter().filter(|file| is_mesh(file));
        folders(beside.root()).into_iter().chain(meshes).collect()
    }

    /// What those stores say that are or were live.
    pub(super) fn live(&self) -> impl Iterator<Item = Live> {
        self.roots.iter().filter_map(|(_, folder)| live(folder.root()))
    }

    fn add_store(&mut self, path: &Path) -> Result<()> {
        let folder = Folder::new(path)?;
        let name = self.free_name(folder.root());
        self.add_group(&name, folder.root(), DEEPEST);
        self.add_marks(&name, &folder.root().join(MARKS));
        self.add_series(&name, folder.root());
        self.roots.push((name, folder));
        Ok(())
    }

    /// Tells which times of a store have surfaces, where it has several.
    fn add_series(&mut self, root: &str, path: &Path) {
        let axis = || self.images.iter().find(|image| image.path == root)?.axes.iter().find(|axis| axis.name == "t");
        let Some(axis) = axis().filter(|_| is_series(path)) else { return };
        let first = (axis.origin / axis.spacing).round() as u32;
        let number =
            |folder: &PathBuf| time_of(&file_name(folder)).filter(|_| files(folder).iter().any(|f| is_mesh(f)));
        let with_surfaces = folders(&path.join("meshes")).iter().filter_map(number).collect();
        let times = first..first.saturating_add(u32::try_from(axis.voxels).unwrap_or(u32::MAX));
        self.series.push(Series { root: root.into(), times, with_surfaces });
    }

    /// Adds the marks of a store, every n-th where there are more than a page can hold.
    fn add_marks(&mut self, root: &str, path: &Path) {
        // A store without marks, or with a table of another program, is shown without.
        let Ok(PointFile { cloud, times, .. }) = read_points(path) else { return };
        let every = cloud.positions.len().div_ceil(MOST_MARKS).max(1);
        let places: Vec<[f64; 3]> = cloud.positions.iter().copied().step_by(every).collect();
        if !places.is_empty() {
            self.marks.push(Marks { root: root.into(), places, times: times.into_iter().step_by(every).collect() });
        }
    }

    fn add_mesh(&mut self, path: &Path) -> Result<()> {
        if !is_mesh(path) {
            let what =
                "is no mesh by its name (PLY, OBJ, STL, OFF); give an OME-Zarr store, a folder of some, or a mesh";
            return Err(Error::input(what).at(path));
        }
        let true_path =
            path.canonicalize().map_err(|e| Error::input(format!("cannot be opened: {e}")).caused_by(e).at(path))?;
        let name = file_name(&true_path);
        self.push_mesh(name, true_path, &Ready::default());
        Ok(())
    }

    /// Adds a mesh, as what is ready of it.
    fn push_mesh(&mut self, path: String, file: PathBuf, ready: &Ready) {
        let fragments = ready.fragments_of(&file);
        if fragments.is_empty() {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy();
            let own = stem.rsplit_once('-').and_then(|(_, number)| number.parse().ok());
            let drawn = Drawn::Mesh(ready.copy_of(&file));
            let segment = self.free_segment(own);
            self.meshes.push(MeshFile { path, segment, object: own, name: None, drawn, file });
            return;
        }
        for fragment in fragments {
            let (segment, object) = (self.free_segment(Some(fragment.segment)), Some(fragment.segment));
            let (name, drawn) = (fragment.name, Drawn::Fragment(fragment.file));
            self.meshes.push(MeshFile { path: path.clone(), file: file.clone(), segment, object, name, drawn });
        }
    }

    /// The number of a mesh: its own, or another where that is taken.
    fn free_segment(&self, own: Option<u64>) -> u64 {
        let is_free = |segment: &u64| *segment > 0 && self.meshes.iter().all(|mesh| mesh.segment != *segment);
        own.filter(is_free).or_else(|| (1..=u64::MAX).find(is_free)).unwrap_or(1)
    }

    fn push_growing(&mut self, file: PathBuf) {
        let (meshes, moved) = &mut self.growing;
        let changed = std::fs::metadata(&file).and_then(|found| found.modified()).ok();
        let since = changed.and_then(|at| at.duration_since(UNIX_EPOCH).ok()).unwrap_or_default();
        *moved = moved.wrapping_mul(31).wrapping_add(since.as_millis() as u64);
        let segment = meshes.len() as u64 + 1;
        let drawn = Drawn::Mesh(file.clone());
        meshes.push(MeshFile { path: file_name(&file), file, segment, object: None, name: None, drawn });
    }

    /// Leaves out fields where there are more than somebody would look through.
    fn thin_fields(&mut self) {
        let mut fields = 0;
        self.images.retain(|image| {
            fields += usize::from(image.kind == Kind::Field);
            image.kind != Kind::Field || fields <= MOST_FIELDS
        });
        self.images.sort_by_key(|image| image.kind);
    }

    /// The name of a store on the server; another where a store of the same name is there already.
    fn free_name(&self, path: &Path) -> String {
        let name = file_name(path);
        let is_taken = |name: &str| self.roots.iter().any(|(taken, _)| taken == name);
        let others = (2..).map(|n| format!("{n}-{name}"));
        std::iter::once(name.clone()).chain(others).find(|name| !is_taken(name)).unwrap_or(name)
    }

    /// Adds the image of a group, those of the groups below it, and their meshes.
    fn add_group(&mut self, path: &str, folder: &Path, depth: usize) {
        if self.images.len() >= MOST {
            return;
        }
        if let Some(image) = multiscale(folder).and_then(|found| image(path, folder, &found)) {
            self.images.push(image);
        }
        let ready = if folder.ends_with("meshes") { Ready::of(folder) } else { Ready::default() };
        for file in files(folder) {
            let is_mesh = is_mesh(&file);
            if is_mesh && folder.ends_with(GROWING) {
                self.push_growing(file);
            } else if is_mesh && self.meshes.len() < MOST {
                self.push_mesh(format!("{path}/{}", file_name(&file)), file, &ready);
            }
        }
        // Those hold the same meshes once more; fields and surfaces of single times of a series cannot be told from each other.
        let is_series = is_series(folder);
        let is_of_time = |below: &Path| {
            let is_time = time_of(&file_name(below)).is_some();
            (is_series && below.ends_with(TIMES)) || (is_time && folder.ends_with("meshes"))
        };
        let is_looked_into = |below: &PathBuf| {
            depth > 0 && !below.ends_with(PRECOMPUTED) && !below.ends_with(SIMPLIFIED) && !is_of_time(below)
        };
        for below in folders(folder).into_iter().filter(is_looked_into) {
            self.add_group(&format!("{path}/{}", file_name(&below)), &below, depth - 1);
        }
    }
}

/// Whether a store was joined from several times.
fn is_series(folder: &Path) -> bool {
    folder.join(TIMES).is_dir() && multiscale(folder).is_some_and(|found| found.has_time())
}

/// The time of a group of one time.
fn time_of(name: &str) -> Option<u32> {
    name.strip_prefix('t')?.parse().ok()
}
