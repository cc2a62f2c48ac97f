//! A stack that is open: where each plane of the wanted channel and time lies, and how it is read.

use std::path::Path;
use std::path::PathBuf;

use super::description::layout::Dimensions;
use super::images::PagePlace;
use super::pages::decode::{Plane, Scratch};
use super::pages::ifd::{Tags, TiffFile};
use super::pages::page::Kind;
use super::pages::page::Page;
use super::raw::Contiguous;
use super::{ImageSummary, StackInfo};
use crate::error::Result;
use crate::store::SamplesMut;

/// Where the planes of the wanted channel and time lie.
#[derive(Debug)]
pub(crate) enum Source {
    /// One page for each plane.
    Pages { file: TiffFile, kind: Kind, places: Vec<Place> },
    /// One page, planes one after the other.
    Contiguous { file: TiffFile, stack: Contiguous, sample: u16, order: PlaneOrder },
    /// One file for each plane.
    Slices { files: Vec<PathBuf>, kind: Kind, sample: u16 },
}

/// Where one plane lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// Number, from 1, and offset.
    pub(crate) page: PagePlace,
    /// The sample of the pixel.
    pub(crate) sample: u16,
}

/// The planes of the wanted channel and time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneOrder {
    pub(crate) dimensions: Dimensions,
    pub(crate) channel: u64,
    pub(crate) time: u64,
}

impl PlaneOrder {
    pub(crate) fn plane(&self, z: u64) -> u64 {
        self.dimensions.plane(self.channel, self.time, z)
    }
}

/// A stack that was understood.
#[derive(Debug)]
pub(crate) struct Opened {
    pub(crate) info: StackInfo,
    pub(crate) images: Vec<ImageSummary>,
    pub(crate) source: Source,
}

impl Source {
    /// Decodes plane `z`, which is within the stack, into `out` of the right type and length.
    pub(crate) fn read_plane(&self, z: u64, scratch: &mut Scratch, out: &mut SamplesMut<'_>) -> Result<()> {
        let z = z as usize;
        match self {
            Self::Pages { file, kind, places } => {
                let Place { page: (number, offset), sample } = places[z];
                read_page(file, *kind, sample, number, offset, scratch, out)
            }
            Self::Contiguous { file, stack, sample, order } => {
                let chunks = vec![stack.chunk(order.plane(z as u64))];
                Plane { file, page: stack.page, sample: *sample, chunks }.read(scratch, out)
            }
            Self::Slices { files, kind, sample } => {
                let (file, offset) = open_slice(&files[z])?;
                read_page(&file, *kind, *sample, 1, offset, scratch, out)
            }
        }
    }
}

impl Source {
    /// The file of plane `z`, where each has its own, and which part of a file it is.
    pub(crate) fn whereabouts(&self, z: u64) -> (Option<&Path>, String) {
        match self {
            Self::Pages { places, .. } => (None, format!("page {}", places[z as usize].page.0)),
            Self::Contiguous { order, .. } => (None, format!("plane {} of its one page", order.plane(z) + 1)),
            Self::Slices { files, .. } => (Some(&files[z as usize]), String::new()),
        }
    }
}

pub(crate) fn read_page(
    file: &TiffFile,
    kind: Kind,
    sample: u16,
    number: usize,
    offset: u64,
    scratch: &mut Scratch,
    out: &mut SamplesMut<'_>,
) -> Result<()> {
    let tags = Tags::read(file, offset, number)?;
    let page = Page::parse(&tags)?;
    // The file may have changed since it was opened.
    require_kind(&tags, &page, kind)?;
    let chunks = page.chunks(&tags, sample)?;
    Plane { file, page, sample, chunks }.read(scratch, out)
}

/// Opens a file that must hold one page.
pub(crate) fn open_slice(path: &Path) -> Result<(TiffFile, u64)> {
    let file = TiffFile::open(path)?;
    let offsets = file.pages()?;
    match offsets[..] {
        [only] => Ok((file, only)),
        _ => Err(file.error(format!(
            "it has {} pages, but in a folder of slices every file is one plane; name the file itself to read it",
            offsets.len()
        ))),
    }
}

pub(crate) fn require_kind(tags: &Tags, page: &Page, kind: Kind) -> Result<()> {
    if page.kind == kind {
        return Ok(());
    }
    Err(tags.error(format!("it is {} where the stack is {kind}; all planes of a stack must be alike", page.kind)))
}
