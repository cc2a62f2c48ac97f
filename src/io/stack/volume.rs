//! What a stack is, whatever its file: shape, sample type, spacing, channels, and which part of it is read.

use super::interval::Interval;
use super::page_axes::PageAxes;
use crate::store::{ElementType, VolumeSource};

/// What a stack is, told without decoding a plane of it.
#[derive(Clone, Debug, PartialEq)]
pub struct StackInfo {
    /// Voxels along x, y, z of the chosen channel and time.
    pub shape: [i64; 3],
    /// Number of channels, those inside a pixel (RGB) included.
    pub channels: u32,
    /// Number of time points.
    pub times: u32,
    /// The sample type in the file: `uint8`, `uint16`, `int16`, `float32`, `uint12`, ...
    pub file_type: String,
    /// The type that planes are handed out in.
    pub element: ElementType,
    /// Distance between voxel centres along x, y, z, each where the file tells it.
    pub spacing: [Option<f64>; 3],
    /// World position of the centre of the first voxel, x, y, z.
    pub origin: [f64; 3],
    /// The unit of `spacing` as OME-Zarr spells it, where the file tells it.
    pub unit: Option<String>,
    /// The time from one time point to the next, where the file tells it.
    pub interval: Option<Interval>,
    /// The axes as stored, slowest first, `S` for samples inside a pixel: `TZCYX`.
    pub axes: String,
    /// How the samples are compressed.
    pub compression: String,
    /// What the user should know about how the file was understood.
    pub notes: Vec<String>,
}

/// Which part of a file with several channels, time points or images to read, counted from 0, and what its planes are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Select {
    /// The channel.
    pub channel: u32,
    /// The time point.
    pub time: u32,
    /// The resolution of a multiscale image, 0 the finest.
    pub level: u32,
    /// The image; the first where none is named.
    pub image: Option<u32>,
    /// What the pages are, in place of what the file says.
    pub axes: Option<PageAxes>,
}

/// One of several images in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageSummary {
    /// What the file calls it.
    pub name: Option<String>,
    /// Voxels along x, y, z of one channel at one time.
    pub shape: [u64; 3],
}

impl std::fmt::Display for ImageSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z] = self.shape;
        let name = self.name.as_ref().map_or(String::new(), |name| format!("\"{name}\", "));
        write!(f, "{name}{x} x {y} x {z}")
    }
}

/// One channel at one time of a stack that was opened.
pub trait Stack: VolumeSource {
    /// What the stack is.
    fn info(&self) -> &StackInfo;

    /// The images of the file, where it holds several.
    fn images(&self) -> &[ImageSummary] {
        &[]
    }
}
