//! Label volumes plane by plane, from a stack of images or an OME-Zarr image: whole numbers, 0 for what is no object.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::ome_zarr::{ImageReader, is_store};
use super::stacks::{Stack, format_of};
use crate::error::{Error, Result};
use crate::grid::{Box3, Geometry};
use crate::store::{ElementType, Sample};

/// The group of a store's segmentation, which is taken where the store itself is given.
const SEGMENTATION: &str = "labels/segmentation";

/// Whether what lies at a path is read as a label volume, and no points or mesh: told by its content.
#[must_use]
pub fn is_label_volume(path: &Path) -> bool {
    path.exists() && (is_store(path) || format_of(path).is_some())
}

/// A label volume that was opened.
#[allow(missing_debug_implementations, reason = "decoders have none")]
pub struct LabelVolume {
    path: PathBuf,
    geometry: Geometry,
    voxels: Voxels,
}

enum Voxels {
    Stack(Box<dyn Stack>),
    Image(ImageReader),
}

impl LabelVolume {
    /// Of a stack that lies there.
    #[must_use]
    pub fn of_stack(path: &Path, stack: Box<dyn Stack>, geometry: Geometry) -> Self {
        Self { path: path.to_path_buf(), geometry, voxels: Voxels::Stack(stack) }
    }

    /// Of a store: its segmentation where it has one, else the image of the group itself; the finest level.
    ///
    /// # Errors
    /// When it holds no image that can be read.
    pub fn of_store(path: &Path) -> Result<Self> {
        let segmentation = path.join(SEGMENTATION);
        let group = if is_store(&segmentation) { segmentation } else { path.to_path_buf() };
        let image = ImageReader::open(&group)?;
        let geometry = image.levels()[0].geometry.clone();
        Ok(Self { path: group, geometry, voxels: Voxels::Image(image) })
    }

    /// Puts another spacing in place of the file's, physical, more than 0.
    pub fn set_spacing(&mut self, spacing: [f64; 3]) {
        self.geometry.spacing = spacing;
    }

    /// Where its voxels lie.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Reads the labels of some planes into `out`, dense `[z][y][x]`.
    ///
    /// # Errors
    /// When a plane cannot be read, or holds a number that is no label: names file, voxel and number.
    pub fn read_planes(&self, planes: Range<i64>, out: &mut Vec<u32>) -> Result<()> {
        out.clear();
        let first = planes.start;
        match &self.voxels {
            Voxels::Stack(stack) => planes.into_iter().try_for_each(|z| match stack.element() {
                ElementType::U8 => self.read_plane::<u8>(&**stack, z, first, out),
                ElementType::U16 => self.read_plane::<u16>(&**stack, z, first, out),
                ElementType::U32 => self.read_plane::<u32>(&**stack, z, first, out),
                ElementType::F16 | ElementType::F32 => self.read_plane::<f32>(&**stack, z, first, out),
                ElementType::F64 => self.read_plane::<f64>(&**stack, z, first, out),
            }),
            Voxels::Image(image) => {
                let [width, height, _] = self.geometry.shape;
                let part = Box3::new([0, 0, planes.start], [width, height, planes.end]);
                self.take(first, image.read_box(0, &part)?.into_iter(), out)
            }
        }
    }

    /// Adds the labels of a plane to those of planes from `first` on.
    fn read_plane<T: Sample + Into<f64>>(
        &self,
        stack: &dyn Stack,
        z: i64,
        first: i64,
        out: &mut Vec<u32>,
    ) -> Result<()> {
        let mut plane = vec![T::default(); (self.geometry.shape[0] * self.geometry.shape[1]) as usize];
        stack.read_plane(z, T::buffer(&mut plane))?;
        self.take(first, plane.into_iter().map(Into::into), out)
    }

    /// Takes numbers as labels, planes from `first` on; refuses what is none.
    fn take(&self, first: i64, values: impl Iterator<Item = f64>, out: &mut Vec<u32>) -> Result<()> {
        for value in values {
            if !(value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value)) {
                let [width, height, _] = self.geometry.shape;
                let at = out.len() as i64;
                let (x, y, z) = (at % width, at / width % height, first + at / (width * height));
                return Err(Error::input(format!(
                    "holds {value} at voxel {x}, {y}, {z} (x, y, z); a label volume holds whole numbers, 0 for what is \
                     no object"
                ))
                .at(&self.path));
            }
            out.push(value as u32);
        }
        Ok(())
    }
}
