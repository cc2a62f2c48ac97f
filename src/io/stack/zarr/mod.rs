//! Zarr as input: OME-Zarr 0.1 to 0.5 images and label images, and plain arrays, of Zarr version 2 or 3; read by chunks.
//!
//! Rests on the OME-Zarr specifications 0.4 and 0.5, Zarr 2 and 3, and the `bioformats2raw` layout. `zarrs` reads the
//! arrays' metadata and runs their codecs; which axis is which, where voxels lie, and how much a chunk may cost is told
//! here.

mod array;
mod axes;
mod codecs;
mod describe;
mod find;
mod keys;
mod multiscale;
mod node;
mod samples;
pub(crate) mod shard_index;

use std::path::{Path, PathBuf};

use super::interval::Interval;
use super::volume::{Select, Stack, StackInfo};
use crate::error::{Error, Result};
use crate::grid::Box3;
use crate::io::ome_zarr::{LiveState, live};
use crate::store::{ElementType, SamplesMut, VolumeSource, Whereabouts};
use array::ChunkedArray;
use axes::{Axis, Role};
use find::Found;
use multiscale::Placed;
use node::Node;
use samples::{Place, Values};

pub use describe::{LevelDescription, ZarrDescription, describe, holds_image, label_colors, label_images};

/// Voxels that are asked for at once, at least: smaller chunks are read several together.
const AT_ONCE: i64 = 1 << 16;

/// What is to be said of an array in a live store that is not complete.
fn incomplete(array: &Path) -> Option<String> {
    // A field lies a few folders below the root of its store.
    let state = array.ancestors().take(5).find_map(live)?.state;
    let what = match state {
        LiveState::Complete => return None,
        LiveState::Running => "is still written by another run",
        LiveState::Interrupted => "was left by a run that was interrupted",
    };
    Some(format!("the store {what}; what is missing of it is read as zeros"))
}

/// One channel at one time of a level of an image.
#[derive(Debug)]
pub struct ZarrImage {
    folder: PathBuf,
    info: StackInfo,
    array: ChunkedArray,
    /// The axes of the array that are x, y, z.
    space: [usize; 3],
    /// What is chosen along the others.
    chosen: Vec<(usize, u64)>,
}

impl ZarrImage {
    /// Opens an image: a group, an array in one, or a `bioformats2raw` store; no chunk is decoded.
    ///
    /// # Errors
    /// When there is none, its metadata are damaged or of a kind that is not supported, or it has no such level, channel,
    /// time or image.
    pub fn open(path: &Path, select: Select) -> Result<Self> {
        let found = find::find(path, select.image)?;
        let level = choose_level(&found, select.level)?;
        let opened = open_level(&found, level)?;
        let OpenLevel { folder, array, axes, axes_told, placed } = opened;
        let fault = |reason: String| Error::input(reason).at(&folder);
        let space = axes::places(&axes).map_err(fault)?;
        let chosen = choose(&axes, &array.shape, select).map_err(|error| error.at(&folder))?;
        let mut notes = found.notes.clone();
        if !axes_told {
            notes.push(format!("the axes are not named; {} is taken", axes::names(&axes)));
        }
        notes.extend(array.note());
        notes.extend(incomplete(&folder));
        let lengths = lengths(&axes, space, placed.as_ref(), &mut notes);
        let time = axes.iter().position(|axis| axis.role == Role::Time);
        let interval =
            time.zip(placed.as_ref()).and_then(|(a, placed)| Interval::told(placed.scale[a], axes[a].unit.as_deref()?));
        let along = |role: Role| (0..axes.len()).find(|&a| axes[a].role == role).map_or(1, |a| array.shape[a]);
        let letters: String = axes.iter().filter_map(|axis| axis.name.chars().next()).collect();
        let info = StackInfo {
            shape: space.map(|a| array.shape[a] as i64),
            channels: u32::try_from(along(Role::Channel)).unwrap_or(u32::MAX),
            times: u32::try_from(along(Role::Time)).unwrap_or(u32::MAX),
            file_type: array.type_name.clone(),
            element: array.number.element(),
            spacing: lengths.spacing,
            origin: lengths.origin,
            unit: lengths.unit,
            interval,
            axes: letters.to_uppercase(),
            compression: describe::codecs_of(&folder)?,
            notes,
        };
        Ok(Self { folder, info, array, space, chosen })
    }

    fn check_type(&self, out: &SamplesMut<'_>, part: &Box3) -> Result<()> {
        let (element, len) = (out.element(), out.len());
        if element == self.info.element && len == part.len() {
            return Ok(());
        }
        let (due, asked) = (self.info.element.name(), element.name());
        Err(Error::failed(format!("a box of {} {due} was asked for as {len} {asked}", part.len())).at(&self.folder))
    }

    /// The place among all chunks of the one that lies at a place among the chunks along x, y, z.
    fn chunk_at(&self, place: [i64; 3]) -> Vec<u64> {
        let mut at = vec![0; self.array.shape.len()];
        for (place, axis) in place.into_iter().zip(self.space) {
            at[axis] = place as u64;
        }
        self.chosen.iter().for_each(|&(axis, index)| at[axis] = index / self.array.chunk[axis].get());
        at
    }

    /// Reads the chunk that lies at a place among the chunks along x, y, z, as far as it lies in `part`.
    fn read_chunk(&self, place: [i64; 3], part: &Box3, out: &mut SamplesMut<'_>) -> Result<()> {
        let chunk = |a: usize| self.array.chunk[a].get();
        let at = self.chunk_at(place);
        let lo: [i64; 3] = std::array::from_fn(|a| place[a] * chunk(self.space[a]) as i64);
        let hi: [i64; 3] = std::array::from_fn(|a| lo[a] + chunk(self.space[a]) as i64);
        let shared = Box3::new(lo, hi).intersect(part);
        let [width, height, _] = part.shape().map(|n| n as usize);
        let to = Place { first: part.offset_of(shared.lo), strides: [1, width, width * height] };
        let shape = shared.shape().map(|n| n as usize);
        let Some(bytes) = self.array.read(&at)? else {
            let place = Place { first: 0, strides: [0; 3] };
            Values { bytes: self.array.fill(), number: self.array.number, place }.copy_to(out, to, shape);
            return Ok(());
        };
        let mut strides = vec![1; at.len()];
        for a in (0..at.len().saturating_sub(1)).rev() {
            strides[a] = strides[a + 1] * chunk(a + 1) as usize;
        }
        let mut first: usize = (0..3).map(|a| (shared.lo[a] - lo[a]) as usize * strides[self.space[a]]).sum();
        first += self.chosen.iter().map(|&(axis, index)| (index % chunk(axis)) as usize * strides[axis]).sum::<usize>();
        let place = Place { first, strides: self.space.map(|axis| strides[axis]) };
        Values { bytes: &bytes, number: self.array.number, place }.copy_to(out, to, shape);
        Ok(())
    }
}

impl Stack for ZarrImage {
    fn info(&self) -> &StackInfo {
        &self.info
    }
}

impl VolumeSource for ZarrImage {
    fn shape(&self) -> [i64; 3] {
        self.info.shape
    }

    fn element(&self) -> ElementType {
        self.info.element
    }

    fn path(&self) -> Option<&Path> {
        Some(&self.folder)
    }

    fn natural_shape(&self) -> [i64; 3] {
        let shape = self.info.shape;
        let chunk = self.space.map(|axis| self.array.chunk[axis].get() as i64);
        let mut natural: [i64; 3] = std::array::from_fn(|a| chunk[a].min(shape[a]));
        for a in 0..3 {
            let voxels: i64 = natural.iter().product();
            let several = (AT_ONCE / voxels).clamp(1, (shape[a] - 1) / chunk[a] + 1);
            natural[a] = natural[a].max((several * chunk[a]).min(shape[a]));
        }
        natural
    }

    fn decoding_bytes(&self) -> u64 {
        // As stored, unpacked, and with its axes in order.
        3 * self.array.chunk_bytes()
    }

    fn read_box(&self, part: &Box3, mut out: SamplesMut<'_>) -> Result<()> {
        self.check_type(&out, part)?;
        let edge = self.space.map(|axis| self.array.chunk[axis].get() as i64);
        let lo: [i64; 3] = std::array::from_fn(|a| part.lo[a] / edge[a]);
        let hi: [i64; 3] = std::array::from_fn(|a| (part.hi[a] - 1) / edge[a] + 1);
        let places = Box3::new(lo, hi);
        for (y, z) in places.rows() {
            for x in lo[0]..hi[0] {
                self.read_chunk([x, y, z], part, &mut out)?;
            }
        }
        Ok(())
    }

    fn whereabouts(&self, voxel: [i64; 3]) -> Option<Whereabouts> {
        let place = std::array::from_fn(|a| voxel[a] / self.array.chunk[self.space[a]].get() as i64);
        let at: Vec<String> = self.chunk_at(place).iter().map(u64::to_string).collect();
        Some(Whereabouts { file: self.folder.clone(), part: format!("chunk {}", at.join(", ")) })
    }
}

fn choose_level(found: &Found, wanted: u32) -> Result<usize> {
    if let Some(level) = found.level.filter(|_| wanted == 0) {
        return Ok(level);
    }
    let levels = found.multiscale.levels.len();
    if (wanted as usize) < levels && found.level.is_none() {
        return Ok(wanted as usize);
    }
    let what = if found.level.is_some() { "this path names one".to_owned() } else { format!("there are {levels}") };
    Err(Error::usage(format!("level {wanted} was asked for but {what}, counted from 0")).at(&found.folder))
}

/// A level whose array was opened.
struct OpenLevel {
    folder: PathBuf,
    array: ChunkedArray,
    axes: Vec<Axis>,
    /// Whether the file names the axes.
    axes_told: bool,
    placed: Option<Placed>,
}

fn open_level(found: &Found, number: usize) -> Result<OpenLevel> {
    let level = &found.multiscale.levels[number];
    let folder = if level.path.is_empty() { found.folder.clone() } else { found.folder.join(&level.path) };
    let fault = |reason: String| Error::input(reason).at(&folder);
    let document = Node::read(&folder)?.and_then(|node| node.array);
    let document = document.ok_or_else(|| fault("is named as an array of the image, but there is none".into()))?;
    let array = ChunkedArray::open(&folder, &document)?;
    let count = array.shape.len();
    let told = found.multiscale.axes.clone();
    let axes_told = told.is_some();
    let axes =
        told.or_else(|| axes::usual(count)).ok_or_else(|| fault(format!("has {count} axes; 3 to 5 are read")))?;
    if axes.len() != count {
        return Err(fault(format!("has {count} axes where its image names {} ({})", axes.len(), axes::names(&axes))));
    }
    if let Some(placed) = level.placed.as_ref().filter(|placed| placed.scale.len() != count) {
        let told = placed.scale.len();
        return Err(fault(format!("has {count} axes where its transformations have {told} numbers")));
    }
    Ok(OpenLevel { array, axes, axes_told, placed: level.placed.clone(), folder })
}

/// What is read along the axes that are not x, y, z.
fn choose(axes: &[Axis], shape: &[u64], select: Select) -> Result<Vec<(usize, u64)>> {
    for (what, wanted, role) in [("channel", select.channel, Role::Channel), ("time", select.time, Role::Time)] {
        let held = (0..axes.len()).find(|&a| axes[a].role == role).map_or(1, |a| shape[a]);
        if u64::from(wanted) >= held {
            return Err(Error::usage(format!("{what} {wanted} was asked for but there are {held}, counted from 0")));
        }
    }
    let mut chosen = Vec::new();
    for (a, axis) in axes.iter().enumerate() {
        match axis.role {
            Role::Space(_) => {}
            Role::Channel => chosen.push((a, select.channel.into())),
            Role::Time => chosen.push((a, select.time.into())),
            Role::Other if shape[a] == 1 => chosen.push((a, 0)),
            Role::Other => {
                return Err(Error::input(format!(
                    "has {} entries along the axis {}, which is none of t, c, z, y, x",
                    shape[a], axis.name
                )));
            }
        }
    }
    Ok(chosen)
}

/// Where voxels lie, in one unit.
struct Lengths {
    spacing: [Option<f64>; 3],
    origin: [f64; 3],
    unit: Option<String>,
}

fn lengths(axes: &[Axis], space: [usize; 3], placed: Option<&Placed>, notes: &mut Vec<String>) -> Lengths {
    let Some(placed) = placed else { return Lengths { spacing: [None; 3], origin: [0.0; 3], unit: None } };
    let (unit, factors) = axes::common_unit(space.map(|axis| axes[axis].unit.as_deref()), notes);
    let length = |a: usize, list: &[f64]| list[space[a]] * factors[a][0] / factors[a][1];
    Lengths {
        spacing: std::array::from_fn(|a| Some(length(a, &placed.scale))),
        origin: std::array::from_fn(|a| length(a, &placed.translation)),
        unit,
    }
}
