//! Every reader behind one call, with small whole files of its formats to start from.

use std::fs;
use std::path::{Path, PathBuf};

use strandline::error::Result;
use strandline::grid::{Box3, Geometry};
use strandline::io::geometry::read::sources::{describe, read_source};
use strandline::io::stack::formats::open_stack;
use strandline::io::stack::label_volume::{LabelVolume, labels_of};
use strandline::io::stack::tiff::Select;
use strandline::io::stack::volume::Stack;
use strandline::io::stack::zarr;
use strandline::store::{ElementType, Sample};

use super::seeds::{headed, images, in_xml, meshes, pages, rois, slices, tables};
use crate::common::read_cloud;
use crate::common::stores;

/// Files of an input: paths in its folder, and what they hold.
pub(super) type Files = Vec<(String, Vec<u8>)>;

/// What reads an input.
pub(super) struct Reader {
    pub(super) name: &'static str,
    /// Endings of files from elsewhere that it reads.
    pub(super) endings: &'static [&'static str],
    pub(super) seeds_of: fn() -> Vec<Files>,
    /// Reads all of the input in a folder.
    pub(super) read: fn(&Path) -> Result<()>,
    /// Whether whatever is wrong with an input is the input's fault: exit code 2.
    pub(super) blames_input: bool,
}

pub(super) const READERS: &[Reader] = &[
    Reader {
        name: "points",
        endings: &["csv", "tsv", "xyz", "txt"],
        seeds_of: tables,
        read: sources,
        blames_input: true,
    },
    Reader {
        name: "meshes",
        endings: &["ply", "obj", "off", "stl"],
        seeds_of: meshes,
        read: sources,
        blames_input: true,
    },
    Reader { name: "rois", endings: &["roi", "zip"], seeds_of: rois, read: sources, blames_input: true },
    Reader { name: "tiff", endings: &["tif", "tiff"], seeds_of: pages, read: pages_of_file, blames_input: true },
    Reader { name: "slices", endings: &[], seeds_of: slices, read: volume, blames_input: true },
    Reader { name: "nrrd", endings: &["nrrd"], seeds_of: headed, read: pages_of_file, blames_input: true },
    Reader { name: "vti", endings: &["vti"], seeds_of: in_xml, read: pages_of_file, blames_input: true },
    Reader { name: "zarr", endings: &["zarr"], seeds_of: images, read: image, blames_input: true },
];

/// Boxes and voxels that are read of an image at most; each voxel may be a chunk, and each chunk a file.
const MOST_BOXES: usize = 64;
const MOST_VOXELS: u64 = 1 << 18;
/// Images whose chunks or pages take more are refused by whoever reads them in a gigabyte.
const MOST_BYTES: u64 = 1 << 29;
/// Files from elsewhere that are larger, and folders of more, are left out.
const LARGEST: u64 = 1 << 16;
const MOST_FILES: usize = 24;

impl Reader {
    /// Small whole inputs: made here, and those below a folder.
    pub(super) fn seeds(&self, more: Option<&Path>) -> Vec<Files> {
        let mut seeds = (self.seeds_of)();
        if let Some(folder) = more {
            self.add_from(folder, &mut seeds);
        }
        seeds
    }

    fn add_from(&self, folder: &Path, seeds: &mut Vec<Files>) {
        let mut paths: Vec<PathBuf> = fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
        paths.sort();
        for path in paths {
            let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            let is_ours = self.endings.contains(&ending.as_str());
            if path.is_dir() && is_ours {
                let files = stores::contents(&path);
                let is_small =
                    files.len() <= MOST_FILES && files.iter().all(|(_, bytes)| bytes.len() as u64 <= LARGEST);
                seeds.extend(is_small.then_some(files));
            } else if path.is_dir() {
                self.add_from(&path, seeds);
            } else if is_ours && path.metadata().is_ok_and(|m| m.len() <= LARGEST) {
                let bytes = fs::read(&path).expect("a file of the seeds");
                seeds.push(vec![(format!("input.{ending}"), bytes)]);
            }
        }
    }
}

/// The one file of an input.
fn only_file(folder: &Path) -> PathBuf {
    let mut paths = fs::read_dir(folder).expect("the input's folder").map(|entry| entry.expect("an entry").path());
    paths.next().expect("an input of one file")
}

/// Of several ways to read an input, which may all refuse it, the worst end.
fn worst<const N: usize>(ends: [Result<()>; N]) -> Result<()> {
    let is_bad = |end: &Result<()>| end.as_ref().is_err_and(|error| error.exit_code() != 2);
    let mut ends = Vec::from(ends);
    if let Some(bad) = ends.iter().position(is_bad) {
        return ends.swap_remove(bad);
    }
    ends.into_iter().collect()
}

fn sources(folder: &Path) -> Result<()> {
    let path = only_file(folder);
    // All are asked: none may panic where another refuses.
    worst([read_source(&path).map(drop), describe(&path).map(drop), read_cloud(&path).map(drop)])
}

fn pages_of_file(folder: &Path) -> Result<()> {
    volume(&only_file(folder))
}

/// Reads the first channel and time, and the last ones, by natural boxes.
fn volume(path: &Path) -> Result<()> {
    let stack = open_stack(path, Select::default())?;
    let first = boxes(stack.as_ref());
    let last = |count: u32| count.saturating_sub(1);
    let select = Select { channel: last(stack.info().channels), time: last(stack.info().times), ..Select::default() };
    let last =
        if select == Select::default() { Ok(()) } else { open_stack(path, select).and_then(|s| boxes(s.as_ref())) };
    worst([first, last])
}

fn boxes(stack: &dyn Stack) -> Result<()> {
    let natural = Box3::from_shape(stack.shape()).tiles(stack.natural_shape());
    read_of(natural, stack.decoding_bytes()).try_for_each(|part| match stack.element() {
        ElementType::U8 => values::<u8>(stack, &part),
        ElementType::U16 => values::<u16>(stack, &part),
        ElementType::U32 => values::<u32>(stack, &part),
        ElementType::I8 | ElementType::I16 | ElementType::F16 | ElementType::F32 => values::<f32>(stack, &part),
        ElementType::I32 | ElementType::F64 => values::<f64>(stack, &part),
    })
}

/// Which of the boxes are read: none where the budget of memory would forbid it.
fn read_of(boxes: impl Iterator<Item = Box3>, decoding_bytes: u64) -> impl Iterator<Item = Box3> {
    let most = if decoding_bytes < MOST_BYTES { MOST_BOXES } else { 0 };
    let mut left = MOST_VOXELS;
    boxes.map(shortened).take(most).take_while(move |part| {
        let is_read = left > 0;
        left = left.saturating_sub(part.volume());
        is_read
    })
}

/// The first part of a box, of so many voxels as are read at once.
fn shortened(mut part: Box3) -> Box3 {
    for a in [2, 1, 0] {
        if part.volume() > MOST_VOXELS {
            part.hi[a] = part.lo[a] + 1;
        }
    }
    part
}

fn values<T: Sample>(stack: &dyn Stack, part: &Box3) -> Result<()> {
    let mut values = vec![T::default(); part.len()];
    stack.read_box(part, T::buffer(&mut values))
}

/// Reads an image of Zarr as `info`, `segment` and `middle` do.
fn image(folder: &Path) -> Result<()> {
    let described = zarr::describe(folder, None).map(drop);
    worst([described, volume(folder), labels_of(folder).and_then(|(path, _)| labels(&path))])
}

fn labels(folder: &Path) -> Result<()> {
    let stack = open_stack(folder, Select::default())?;
    let geometry = Geometry { shape: stack.shape(), spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    let volume = LabelVolume::new(folder, stack, geometry);
    let mut boxes = read_of(volume.natural_boxes(), volume.reading_bytes());
    boxes.try_for_each(|part| volume.read_box(&part, &mut Vec::new()))
}
