//! Stacks with one page whose planes follow the first without pages of their own.
//!
//! ImageJ writes stacks over 4 GB this way, since classic TIFF cannot point past 4 GB; so does `tifffile` on request.

use super::pages::compression::Compression;
use super::pages::ifd::Tags;
use super::pages::page::{Chunk, Page};
use crate::error::Result;

/// The one page, and where the planes begin that follow each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contiguous {
    /// The page with one strip over its whole height.
    pub(crate) page: Page,
    first: u64,
}

impl Contiguous {
    /// Checks that the file really holds `planes` planes one after the other.
    pub(crate) fn new(tags: &Tags, page: Page, planes: u64) -> Result<Self> {
        let file = tags.file;
        if page.compression != Compression::None || page.tiled || page.planar {
            return Err(file.error(format!(
                "the description promises {planes} planes but there is 1 page, and only uncompressed strips can \
                 follow it without pages: the file is truncated or was edited"
            )));
        }
        let strips = page.chunks(tags, 0)?;
        let gap = strips.windows(2).any(|pair| pair[0].offset.saturating_add(pair[0].bytes) != pair[1].offset);
        let Some(first) = strips.first().filter(|_| !gap).map(|strip| strip.offset) else {
            return Err(file.error(format!(
                "the description promises {planes} planes but there is 1 page, and its strips do not follow each other"
            )));
        };
        let plane = page.plane_bytes();
        let end = plane.saturating_mul(planes).saturating_add(first);
        if end > file.len {
            let held = file.len.saturating_sub(first) / plane;
            return Err(file.error(format!(
                "the description promises {planes} planes, up to byte {end}, but the file ends at {}: only {held} \
                 planes are complete and {} bytes are missing",
                file.len,
                end - file.len
            )));
        }
        Ok(Self { page: Page { chunk: [page.kind.width, page.kind.height], ..page }, first })
    }

    /// The place of plane number `plane`, counted from 0.
    pub(crate) fn chunk(&self, plane: u64) -> Chunk {
        let bytes = self.page.plane_bytes();
        Chunk { offset: self.first + plane * bytes, bytes }
    }
}
