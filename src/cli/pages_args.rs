//! What was typed of the pages of TIFF files: which image of a file with several, and what its pages are.

use clap::Args;

use crate::io::page_axes::PageAxes;
use crate::io::stacks::Select;

/// Which pages of a file count, and as what.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct PagesArgs {
    /// What the pages of a TIFF are, slowest first, whatever the file says: zyx if all are slices; tzyx, zcyx or others
    /// for the axes as they are stored, or for the numbers in the names of a folder's files; zc2yx with a size
    #[arg(long, value_name = "ZYX")]
    pub(super) axes: Option<PageAxes>,
    /// Image of a file with several, counted from 0: of OME-XML or a bioformats2raw store, or the pages of one size and
    /// type [default: the first]
    #[arg(long, value_name = "N")]
    pub(super) image_index: Option<u32>,
}

impl PagesArgs {
    /// The files' own pages.
    #[cfg(test)]
    pub(super) const NOTHING: Self = Self { axes: None, image_index: None };

    /// What to read: a channel at a time, at a level of a multiscale image.
    pub(super) fn select(&self, channel: u32, time: u32, level: u32) -> Select {
        Select { channel, time, level, image: self.image_index, axes: self.axes }
    }

    /// Whether anything was said.
    pub(super) fn is_given(&self) -> bool {
        self.axes.is_some() || self.image_index.is_some()
    }
}
