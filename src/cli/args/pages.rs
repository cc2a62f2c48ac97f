//! What was typed of the volume in a file: channel, time and resolution; of TIFF files which image of several, and what
//! its pages are.

use clap::Args;

use crate::io::stack::page_axes::PageAxes;
use crate::io::stack::volume::Select;

/// Which pages of a file count, and as what.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct PagesArgs {
    /// What the pages of a TIFF are, slowest first, whatever the file says: zyx if all are slices; tzyx, zcyx or others
    /// for the axes as they are stored, or for the numbers in the names of a folder's files; zc2yx with a size
    #[arg(long, value_name = "ZYX")]
    pub(crate) axes: Option<PageAxes>,
    /// Image of a file with several, counted from 0: of OME-XML or a bioformats2raw store, or the pages of one size and
    /// type [default: the first]
    #[arg(long, value_name = "N")]
    pub(crate) image_index: Option<u32>,
}

impl PagesArgs {
    /// Whether anything was said.
    pub(crate) fn is_given(&self) -> bool {
        self.axes.is_some() || self.image_index.is_some()
    }

    /// The first channel and time of what was chosen.
    pub(crate) fn select(&self) -> Select {
        Select { image: self.image_index, axes: self.axes, ..Select::default() }
    }
}

/// Which of the volumes in a file is read, whatever its time.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct VolumesArgs {
    /// Channel of the image, or of label volumes, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) channel: u32,
    /// Resolution of an OME-Zarr image or of a TIFF with smaller copies of its pages, 0 the finest
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) level: u32,
    #[command(flatten)]
    pub(crate) pages: PagesArgs,
}

impl VolumesArgs {
    /// What to read: a channel at a time, at a level of a multiscale image.
    pub(crate) fn select_at(&self, time: u32) -> Select {
        Select { channel: self.channel, time, level: self.level, ..self.pages.select() }
    }
}

/// Which of the volumes in a file is read.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct VolumeArgs {
    #[command(flatten)]
    pub(crate) of_time: VolumesArgs,
    /// Time point of the image, or of label volumes, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) time: u32,
}

impl VolumeArgs {
    /// What to read: a channel at a time, at a level of a multiscale image.
    pub(crate) fn select(&self) -> Select {
        self.of_time.select_at(self.time)
    }
}
