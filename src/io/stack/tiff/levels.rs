//! Smaller copies of the pages of a stack: directories of their own that the page's tag `SubIFDs` names, finest first
//! (TIFF Tech Note 1; OME-TIFF 6.0 "sub-resolutions").

use super::Select;
use super::images::PagePlace;
use super::pages::ifd::{Tags, TiffFile};
use super::pages::page::{Kind, Page, kind_of};
use crate::error::{Error, Result};

/// The tag that holds the places of a page's other directories, and the most of them that are looked at.
const SUB_DIRECTORIES: u16 = 330;
const MOST_LEVELS: u64 = 32;

/// The offsets of the smaller copies of a page; what is as large as the page, or a mask, is none.
fn copies(file: &TiffFile, (number, offset): PagePlace) -> Result<Vec<(u64, Kind)>> {
    let tags = Tags::read(file, offset, number)?;
    let page = kind_of(&tags)?;
    let mut found = Vec::new();
    for offset in tags.list(SUB_DIRECTORIES, MOST_LEVELS)?.unwrap_or_default() {
        let below = Tags::read(file, offset, number)?;
        let kind = kind_of(&below)?;
        let smaller = kind.width <= page.width && kind.height <= page.height && kind != page;
        // A smaller copy is called a preview by most writers; masks (bit 2) are none.
        let is_mask = below.number(254)?.is_some_and(|flags| flags & 4 != 0);
        if smaller && !is_mask && (kind.sample, kind.samples) == (page.sample, page.samples) {
            found.push((offset, kind));
        }
    }
    Ok(found)
}

/// The pages of the level that was asked for, and the first of them; level 0 has the pages themselves. Says in `notes`
/// which levels there are where the pages themselves are read.
pub(crate) fn choose(
    file: &TiffFile,
    select: Select,
    first: Page,
    places: Vec<PagePlace>,
    notes: &mut Vec<String>,
) -> Result<(Page, Vec<PagePlace>)> {
    let level = select.level as usize;
    let there = places.first().map_or(Ok(Vec::new()), |&place| copies(file, place));
    if level == 0 {
        // Whoever reads the pages needs no copies, whatever is wrong with these.
        let sizes: Vec<String> =
            there.iter().flatten().map(|(_, kind)| format!("{} x {}", kind.width, kind.height)).collect();
        if !sizes.is_empty() {
            let (count, sizes) = (sizes.len() + 1, sizes.join(", "));
            notes.push(format!(
                "there are {count} levels, the pages and smaller copies of them ({sizes}); --level N picks one"
            ));
        }
        return Ok((first, places));
    }
    let held = there?.len();
    if level > held {
        return Err(refused(file, level, held + 1));
    }
    let mut chosen = Vec::with_capacity(places.len());
    for &place in &places {
        let copies = copies(file, place)?;
        let (offset, _) = copies.get(level - 1).ok_or_else(|| {
            file.error(format!("page {}: has {} smaller copies where the first has {held}", place.0, copies.len()))
        })?;
        chosen.push((place.0, *offset));
    }
    let page = chosen.first().map_or(Ok(first), |&(number, offset)| Page::parse(&Tags::read(file, offset, number)?))?;
    Ok((page, chosen))
}

/// Refuses a level that is not there.
pub(crate) fn refused(file: &TiffFile, level: usize, held: usize) -> Error {
    Error::usage(format!("level {level} was asked for but there are {held}, counted from 0")).at(&file.path)
}

/// How much larger a voxel of a level is along x, y, z than one of the pages: both cover the same place.
pub(crate) fn factors(page: &Page, level: &Page) -> [f64; 3] {
    let by = |whole: u32, part: u32| f64::from(whole) / f64::from(part);
    [by(page.kind.width, level.kind.width), by(page.kind.height, level.kind.height), 1.0]
}
