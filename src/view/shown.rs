//! What lies in a store, in a folder of several, or in another program's OME-Zarr, that can be shown: images, label images and
//! fields by their OME metadata (versions 0.4 and 0.5), and meshes.

use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use serde_json::Value;

use super::folder::Folder;
use super::listing::{file_name, files, folders, is_mesh};
use super::ready::Ready;
use crate::error::{Error, Result};
use crate::io::geometry::read::point_file::PointFile;
use crate::io::geometry::read::points::{LengthUnit, read_points};
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
/// A file of metadata is shorter than this.
const MOST_BYTES: u64 = 16 << 20;

/// Everything that is shown.
#[derive(Clone, Debug)]
pub struct Shown {
    /// What was given.
    path: PathBuf,
    /// The stores and files by the names that they have on the server.
    pub(super) roots: Vec<(String, Folder)>,
    pub(super) images: Vec<Image>,
    pub(super) meshes: Vec<MeshFile>,
    /// Surfaces that still move, of stores that live, and a number that is another when one has moved.
    pub(super) growing: (Vec<MeshFile>, u64),
    /// Marks of segmentations, physical coordinates.
    pub(super) marks: Vec<[f64; 3]>,
}

/// What an image's values are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// Grey values.
    Picture,
    /// Numbers of objects.
    Labels,
    /// A field beside an image, such as a distance.
    Field,
}

/// A multiscale image.
#[derive(Clone, Debug)]
pub(super) struct Image {
    /// Its path on the server, without a slash at its ends.
    pub(super) path: String,
    pub(super) name: String,
    pub(super) kind: Kind,
    /// Whether it is a Zarr of version 2, as OME-Zarr 0.4 is.
    pub(super) is_version_2: bool,
    /// Whether a voxel has four bytes or more.
    pub(super) is_wide: bool,
    pub(super) axes: Vec<Axis>,
    /// The values from black to white.
    pub(super) window: Option<[f64; 2]>,
    /// Colours of labels: number, red, green, blue.
    pub(super) colors: Vec<(u64, [u8; 3])>,
}

/// An axis of an image.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) name: String,
    /// Metres of a unit; none where the axis has no length.
    pub(super) metres: Option<f64>,
    pub(super) voxels: u64,
    /// In units of the axis.
    pub(super) spacing: f64,
    pub(super) origin: f64,
}

/// A mesh.
#[derive(Clone, Debug)]
pub(super) struct MeshFile {
    /// Its path on the server.
    pub(super) path: String,
    /// Where it lies.
    pub(super) file: PathBuf,
    /// The number that the page knows it by: that of its object, where its name has one.
    pub(super) segment: u64,
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
        let path_given = path.to_path_buf();
        let mut shown = Self {
            path: path_given,
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
                }
            }
            // A store without an image of its own, such as one that was just begun.
            if shown.roots.is_empty() {
                shown.add_store(path)?;
            }
        }
        shown.thin_fields();
        let is_interrupted = shown.live().any(|live| live.state == LiveState::Interrupted);
        if shown.images.is_empty() && shown.meshes.is_empty() && is_interrupted {
            let what = "was left by a run that was interrupted before there was anything to show; run it again";
            return Err(Error::input(what).at(path));
        }
        if shown.images.is_empty() && shown.meshes.is_empty() && !shown.is_live() {
            let what = "holds nothing that can be shown; give an OME-Zarr store, a folder of some, or a PLY mesh";
            return Err(Error::input(what).at(path));
        }
        Ok(shown)
    }

    /// Looks again.
    pub(super) fn again(&self) -> Result<Self> {
        Self::of(&self.path)
    }

    /// Whether a store is still written.
    pub(super) fn is_live(&self) -> bool {
        self.live().any(|live| live.state == LiveState::Running)
    }

    /// What those stores say that are or were live.
    pub(super) fn live(&self) -> impl Iterator<Item = Live> {
        self.roots.iter().filter_map(|(_, folder)| live(folder.root()))
    }

    fn add_store(&mut self, path: &Path) -> Result<()> {
        let folder = Folder::new(path)?;
        let name = self.free_name(folder.root());
        self.add_group(&name, folder.root(), DEEPEST);
        self.add_marks(&folder.root().join(MARKS));
        self.roots.push((name, folder));
        Ok(())
    }

    /// Adds the marks of a store, every n-th where there are more than a page can hold.
    fn add_marks(&mut self, path: &Path) {
        // A store without marks, or with a table of another program, is shown without.
        let Ok(PointFile { cloud, times, .. }) = read_points(path) else { return };
        // Those of other times lie where the objects are then.
        let is_of_first = |n: usize| times.get(n) == times.first();
        let shown: Vec<[f64; 3]> =
            cloud.positions.iter().enumerate().filter(|(n, _)| is_of_first(*n)).map(|(_, place)| *place).collect();
        let every = shown.len().div_ceil(MOST_MARKS).max(1);
        self.marks.extend(shown.iter().step_by(every));
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
            self.meshes.push(MeshFile { path, segment: self.free_segment(own), name: None, drawn, file });
            return;
        }
        for fragment in fragments {
            let segment = self.free_segment(Some(fragment.segment));
            let (name, drawn) = (fragment.name, Drawn::Fragment(fragment.file));
            self.meshes.push(MeshFile { path: path.clone(), file: file.clone(), segment, name, drawn });
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
        meshes.push(MeshFile { path: file_name(&file), file, segment, name: None, drawn });
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
        let is_series = folder.join(TIMES).is_dir() && multiscale(folder).is_some_and(|found| found.has_time());
        let is_of_time = |below: &Path| {
            let name = file_name(below);
            let is_time = name.strip_prefix('t').is_some_and(|digits| digits.parse::<u32>().is_ok());
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

/// Attributes of a multiscale image, and whether its Zarr is of version 2.
struct Multiscale {
    attributes: Value,
    is_version_2: bool,
}

impl Multiscale {
    /// Whether its first axis is one of time.
    fn has_time(&self) -> bool {
        self.attributes["multiscales"][0]["axes"][0]["type"] == "time"
    }
}

fn multiscale(folder: &Path) -> Option<Multiscale> {
    let of = |attributes: Value, is_version_2: bool| {
        attributes["multiscales"][0]["datasets"].is_array().then_some(Multiscale { attributes, is_version_2 })
    };
    match json(&folder.join("zarr.json")) {
        Some(mut group) => of(group["attributes"]["ome"].take(), false),
        None => of(json(&folder.join(".zattrs"))?, true),
    }
}

fn json(path: &Path) -> Option<Value> {
    let is_short = std::fs::metadata(path).ok()?.len() <= MOST_BYTES;
    serde_json::from_slice(&std::fs::read(path).ok().filter(|_| is_short)?).ok()
}

fn image(path: &str, folder: &Path, found: &Multiscale) -> Option<Image> {
    let described = &found.attributes["multiscales"][0];
    let finest = &described["datasets"][0];
    let array = folder.join(finest["path"].as_str()?);
    let array = json(&array.join(if found.is_version_2 { ".zarray" } else { "zarr.json" }))?;
    let transforms = [&finest["coordinateTransformations"], &described["coordinateTransformations"]];
    let vector = |kind: &str, n: usize, neutral: f64, joined: fn(f64, f64) -> f64| {
        let all = transforms.iter().flat_map(|list| list.as_array().into_iter().flatten());
        all.filter_map(|t| t[kind][n].as_f64()).fold(neutral, joined)
    };
    let axis = |(n, axis): (usize, &Value)| {
        // Version 0.3 named axes by words alone.
        let name = axis["name"].as_str().or(axis.as_str())?;
        let unit = axis["unit"].as_str().map(LengthUnit::named);
        let is_space = axis["type"].as_str().map_or(["x", "y", "z"].contains(&name), |kind| kind == "space");
        Some(Axis {
            name: name.to_owned(),
            metres: unit.flatten().map(|unit| unit.metres).filter(|_| is_space),
            voxels: array["shape"][n].as_u64()?,
            spacing: vector("scale", n, 1.0, |a, b| a * b),
            origin: vector("translation", n, 0.0, |a, b| a + b),
        })
    };
    let axes: Vec<Axis> = described["axes"].as_array()?.iter().enumerate().map(axis).collect::<Option<_>>()?;
    let window = &found.attributes["omero"]["channels"][0]["window"];
    let is_labels = found.attributes["image-label"].is_object() || path.contains("/labels/");
    let is_field = path.contains('/');
    Some(Image {
        path: path.to_owned(),
        name: described["name"].as_str().filter(|name| !name.is_empty()).unwrap_or(path).to_owned(),
        kind: if is_labels {
            Kind::Labels
        } else if is_field {
            Kind::Field
        } else {
            Kind::Picture
        },
        is_version_2: found.is_version_2,
        is_wide: is_wide(&array),
        axes,
        window: window["start"].as_f64().zip(window["end"].as_f64()).map(|(low, high)| [low, high]),
        colors: colors(&found.attributes["image-label"]["colors"]),
    })
}

/// Whether an array's voxels have four bytes or more: its type is `float32`, or `<f4` in version 2.
fn is_wide(array: &Value) -> bool {
    let name = array["data_type"].as_str().or(array["dtype"].as_str()).unwrap_or_default();
    let size = name.trim_start_matches(|c: char| !c.is_ascii_digit()).parse().unwrap_or(0);
    if array["dtype"].is_string() { size >= 4 } else { size >= 32 }
}

fn colors(list: &Value) -> Vec<(u64, [u8; 3])> {
    let channel = |color: &Value, n: usize| color["rgba"][n].as_u64().and_then(|v| u8::try_from(v).ok());
    let color = |color: &Value| {
        Some((color["label-value"].as_u64()?, [channel(color, 0)?, channel(color, 1)?, channel(color, 2)?]))
    };
    list.as_array().into_iter().flatten().filter_map(color).collect()
}
