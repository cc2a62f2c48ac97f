//! Label volumes box by box, from a stack of images or a Zarr image: whole numbers, 0 for what is no object.

use std::path::{Path, PathBuf};

use super::formats::format_of;
use super::volume::Stack;
use super::zarr::label_images;
use crate::error::{Error, Result};
use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::is_store;
use crate::store::{ElementType, Sample, SampleWork};

/// The group of a store's segmentation, which is taken where the store itself is given.
const SEGMENTATION: &str = "labels/segmentation";

/// Whether what lies at a path is read as a label volume, and no points or mesh: told by its content.
#[must_use]
pub fn is_label_volume(path: &Path) -> bool {
    path.exists() && (is_store(path) || format_of(path).is_some())
}

/// Where the labels of what lies at a path are: of a store its segmentation, else the one label image beside its image;
/// with a note where that was no segmentation of ours.
///
/// # Errors
/// When an image has several label images.
pub fn labels_of(path: &Path) -> Result<(PathBuf, Option<String>)> {
    let segmentation = path.join(SEGMENTATION);
    if is_store(&segmentation) {
        return Ok((segmentation, None));
    }
    let groups = label_images(path);
    match groups.as_slice() {
        [] => Ok((path.to_path_buf(), None)),
        [only] => Ok((only.clone(), Some(format!("{}: its label image is read", only.display())))),
        [first, ..] => {
            let names: Vec<_> =
                groups.iter().filter_map(|group| group.file_name()).map(|name| name.to_string_lossy()).collect();
            let error =
                format!("has several label images ({}); name one, such as {}", names.join(", "), first.display());
            Err(Error::input(error).at(path))
        }
    }
}

/// A label volume that was opened.
#[allow(missing_debug_implementations, reason = "decoders have none")]
pub struct LabelVolume {
    path: PathBuf,
    geometry: Geometry,
    stack: Box<dyn Stack>,
}

impl LabelVolume {
    /// Of a stack that lies there.
    #[must_use]
    pub fn new(path: &Path, stack: Box<dyn Stack>, geometry: Geometry) -> Self {
        Self { path: path.to_path_buf(), geometry, stack }
    }

    /// Where its voxels lie.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The type that its labels are read in.
    #[must_use]
    pub fn element(&self) -> ElementType {
        self.stack.element()
    }

    /// The boxes in which it is stored, x fastest, laid on a regular grid.
    pub fn natural_boxes(&self) -> impl Iterator<Item = Box3> {
        self.geometry.domain().tiles(self.stack.natural_shape())
    }

    /// Bytes that are held while its labels are read box by box.
    #[must_use]
    pub fn reading_bytes(&self) -> u64 {
        let natural = Box3::from_shape(self.stack.natural_shape()).volume();
        let [width, height, _] = self.geometry.shape.map(i64::unsigned_abs);
        // Values, labels and their marks; and the labels of the plane before.
        self.stack.decoding_bytes() + natural * (self.stack.element().size() as u64 + 8) + width * height * 4
    }

    /// Reads the labels of a box into `out`, dense `[z][y][x]`.
    ///
    /// # Errors
    /// When it cannot be read, or holds a number that is no label: names file, voxel and number.
    pub fn read_box(&self, part: &Box3, out: &mut Vec<u32>) -> Result<()> {
        out.clear();
        self.stack.element().with_samples(Reading { volume: self, part, out })
    }

    fn no_label(&self, value: f64, part: &Box3, place: usize) -> Error {
        let ([width, height, _], place) = (part.shape(), place as i64);
        let (x, y, z) = (place % width + part.lo[0], place / width % height + part.lo[1], place / (width * height));
        Error::input(format!(
            "holds {value} at voxel {x}, {y}, {} (x, y, z); a label volume holds whole numbers from 0, for what is no \
             object, to {}",
            z + part.lo[2],
            u32::MAX
        ))
        .at(&self.path)
    }
}

/// Labels made of the samples of a box.
struct Reading<'a> {
    volume: &'a LabelVolume,
    part: &'a Box3,
    out: &'a mut Vec<u32>,
}

impl SampleWork for Reading<'_> {
    type Output = Result<()>;

    fn on<T: Sample>(self) -> Result<()> {
        let Self { volume, part, out } = self;
        let mut values = vec![T::default(); part.len()];
        volume.stack.read_box(part, T::buffer(&mut values))?;
        for value in values {
            let value = value.to_f64();
            if !(value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value)) {
                return Err(volume.no_label(value, part, out.len()));
            }
            out.push(value as u32);
        }
        Ok(())
    }
}
