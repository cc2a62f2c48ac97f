//! How what lies in a store or folder comes to be shown: its images, meshes, marks and times, and what is told of those that cannot be.

use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use super::{Drawn, Marks, MeshFile, Series, Shown, root_of};
use crate::error::{Error, Result};
use crate::io::geometry::read::point_file::PointFile;
use crate::io::geometry::read::points::read_points;
use crate::io::geometry::read::source::Source;
use crate::io::geometry::read::sources::read_source;
use crate::io::ome_zarr::{GROWING, LiveState, TIMES, live};
use crate::io::stack::formats::open_stack;
use crate::io::stack::volume::Select;
use crate::pipeline::output::viewer_mesh::{PRECOMPUTED, SIMPLIFIED};
use crate::pipeline::segment::MARKS;
use crate::view::described::{image, multiscale};
use crate::view::documents::{fault, is_array, is_meant_as_store, unshown};
use crate::view::folder::Folder;
use crate::view::listing::{file_name, files, folders, is_mesh};
use crate::view::ready::Ready;

/// Folders below a store that are looked into.
const DEEPEST: usize = 3;
/// Stores, images and meshes that are looked at, at most of each.
const MOST: usize = 4096;
/// Marks that are shown of a store, at most.
const MOST_MARKS: usize = 20_000;

impl Shown {
    /// Adds what lies in a folder that is no store itself: stores, and meshes.
    pub(super) fn add_stores_of(&mut self, path: &Path) -> Result<()> {
        self.beside = Some(Folder::new(path)?);
        let below: Vec<PathBuf> = folders(path).into_iter().filter(|below| is_meant_as_store(below)).collect();
        for store in below.iter().take(MOST) {
            self.add_store_below(store)?;
        }
        if below.len() > MOST {
            self.faults.push(format!("{} stores after the first {MOST} are left out", below.len() - MOST));
        }
        // Images and meshes in folders that are no stores.
        if self.roots.is_empty() {
            let known = self.faults.len();
            self.add_store(path)?;
            self.faults.truncate(known);
            return Ok(());
        }
        files(path).iter().filter(|file| is_mesh(file)).try_for_each(|file| self.add_mesh(file))
    }

    /// Adds a store beside others; of one that cannot be shown, why.
    fn add_store_below(&mut self, path: &Path) -> Result<()> {
        let count = |shown: &Self| [shown.images.len(), shown.meshes.len(), shown.growing.0.len()];
        let (before, faults) = (count(self), self.faults.len());
        self.add_store(path)?;
        if count(self) == before && live(path).is_none() {
            self.roots.pop();
            if self.faults.len() == faults {
                self.faults.push(unshown(path));
            }
        }
        Ok(())
    }

    pub(super) fn add_store(&mut self, path: &Path) -> Result<()> {
        let folder = Folder::new(path)?;
        let (name, known) = (self.free_name(folder.root()), self.faults.len());
        self.add_group(&name, folder.root(), DEEPEST);
        if live(folder.root()).is_some_and(|live| live.state == LiveState::Running) {
            // What is missing there may still come.
            self.faults.truncate(known);
        }
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
        let of = cloud.positions.len();
        let places: Vec<[f64; 3]> = cloud.positions.iter().copied().step_by(every).collect();
        if !places.is_empty() {
            let times = times.into_iter().step_by(every).collect();
            self.marks.push(Marks { root: root.into(), places, times, of });
        }
    }

    pub(super) fn add_mesh(&mut self, path: &Path) -> Result<()> {
        if !is_mesh(path) {
            check_content(path)?;
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

    fn push_growing(&mut self, path: String, file: PathBuf) {
        let (meshes, moved) = &mut self.growing;
        let changed = std::fs::metadata(&file).and_then(|found| found.modified()).ok();
        let since = changed.and_then(|at| at.duration_since(UNIX_EPOCH).ok()).unwrap_or_default();
        *moved = moved.wrapping_mul(31).wrapping_add(since.as_millis() as u64);
        let segment = meshes.len() as u64 + 1;
        let drawn = Drawn::Mesh(file.clone());
        meshes.push(MeshFile { path, file, segment, object: None, name: None, drawn });
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
        self.add_image(path, folder);
        let ready = if folder.ends_with("meshes") { Ready::of(folder) } else { Ready::default() };
        for file in files(folder) {
            let is_mesh = is_mesh(&file);
            if is_mesh && folder.ends_with(GROWING) {
                self.push_growing(format!("{path}/{}", file_name(&file)), file);
            } else if is_mesh && self.meshes.len() < MOST {
                self.push_mesh(format!("{path}/{}", file_name(&file)), file, &ready);
            } else if is_mesh {
                self.tell_once(format!("meshes after the first {MOST} are left out"));
            }
        }
        // Those hold the same meshes once more; fields and surfaces of single times of a series cannot be told from each other.
        let is_series = is_series(folder);
        let is_of_time = |below: &Path| {
            let is_time = time_of(&file_name(below)).is_some();
            (is_series && below.ends_with(TIMES)) || (is_time && folder.ends_with("meshes"))
        };
        let is_again = |below: &Path| below.ends_with(PRECOMPUTED) || below.ends_with(SIMPLIFIED);
        let is_looked_into = |below: &PathBuf| depth > 0 && !is_again(below) && !is_of_time(below) && !is_array(below);
        for below in folders(folder).into_iter().filter(is_looked_into) {
            self.add_group(&format!("{path}/{}", file_name(&below)), &below, depth - 1);
        }
    }

    /// Adds the image that a group is, where it is one.
    fn add_image(&mut self, path: &str, folder: &Path) {
        let Some(found) = multiscale(folder) else {
            // That of a store itself is told where it is clear that nothing else is in it.
            let broken = fault(folder).filter(|_| path.contains('/'));
            self.faults.extend(broken.map(|(document, why)| format!("{path}/{} {why}", file_name(&document))));
            return;
        };
        if self.images.len() >= MOST {
            return self.tell_once(format!("images after the first {MOST} are left out"));
        }
        let root = root_of(path);
        let is_beside_one = path != root && self.images.iter().any(|image| image.path == root);
        match image(path, folder, &found, is_beside_one) {
            Ok(image) => self.images.push(image),
            Err(why) => self.faults.push(format!("{path} {why}")),
        }
    }

    fn tell_once(&mut self, text: String) {
        if !self.faults.contains(&text) {
            self.faults.push(text);
        }
    }
}

/// Whether a file of any name holds a mesh; what it is to be made into where it does not.
fn check_content(path: &Path) -> Result<()> {
    match read_source(path) {
        Ok(Source::Mesh(_)) => Ok(()),
        Ok(Source::Cloud(_)) => {
            let what = "holds points, which have no surface to be shown; strandline reconstruct makes one of them";
            Err(Error::input(what).at(path))
        }
        Err(_) if open_stack(path, Select::default()).is_ok() => {
            let what =
                "is an image that a page cannot read from one file; strandline convert makes an OME-Zarr store of it";
            Err(Error::input(what).at(path))
        }
        Err(_) if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("vtp")) => {
            let what = "is VTP, which ParaView opens and a page does not; --mesh and strandline convert write PLY too";
            Err(Error::input(what).at(path))
        }
        Err(error) => {
            let what = "is no mesh that can be shown (PLY, OBJ, STL, OFF); give an OME-Zarr store, a folder of some, or a mesh";
            Err(Error::input(what).caused_by(error).at(path))
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
