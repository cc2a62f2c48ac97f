//! Which image of a file is read: an `Image` of OME-XML, a series that `tifffile` wrote after another, or the pages of one
//! size and type where a file mixes several.

use super::description::layout::Description;
use super::description::{imagej, ome_xml, shaped};
use super::pages::ifd::{Tags, TiffFile};
use super::pages::page::{Kind, Page, is_side_page, kind_of};
use crate::error::{Error, Result};
use crate::io::stack::units;
use crate::io::stack::volume::ImageSummary;

/// The pixel size above which resolution tags of plain files are a print resolution (1270 dots per inch), in metres.
const PRINT_SIZE: f64 = 20e-6;

/// Resolutions of screens and prints that programs put down unasked.
const DOTS_PER_INCH: [f64; 8] = [72.0, 96.0, 100.0, 150.0, 200.0, 300.0, 600.0, 1200.0];

/// The most images that a note lists.
const LISTED: usize = 8;

/// The number of a page, from 1, and its offset.
pub(crate) type PagePlace = (usize, u64);

/// The image that is read.
#[derive(Debug)]
pub(crate) struct Chosen {
    /// Its first page.
    pub(crate) first: Page,
    pub(crate) description: Description,
    /// The pages that its planes are counted in: with OME-XML all of the file, else its own.
    pub(crate) places: Vec<PagePlace>,
    /// All images, where there are several.
    pub(crate) images: Vec<ImageSummary>,
}

/// Finds the image that was asked for, counted from 0; the first where none was.
pub(crate) fn choose(file: &TiffFile, offsets: &[u64], image: Option<u32>) -> Result<Chosen> {
    let all: Vec<PagePlace> = offsets.iter().enumerate().map(|(n, &offset)| (n + 1, offset)).collect();
    let tags = Tags::read(file, offsets[0], 1)?;
    let text = tags.text(270, ome_xml::MAX_TEXT)?.unwrap_or_default();
    let mut chosen = if ome_xml::is_ome(&text) {
        of_ome(file, &text, all, image)?
    } else {
        of_pages(file, shaped::is_shaped(&text), &all, image)?
    };
    let held = chosen.images.len();
    if held > 1 {
        let listed = chosen.images.iter().take(LISTED).enumerate().map(|(n, image)| format!("{n}: {image}"));
        let more = if held > LISTED { ", ..." } else { "" };
        chosen.description.notes.push(format!(
            "the file holds {held} images ({}{more}); image {} is read; --image-index N picks another",
            listed.collect::<Vec<_>>().join(", "),
            image.unwrap_or(0)
        ));
    } else {
        chosen.images.clear();
    }
    Ok(chosen)
}

fn of_ome(file: &TiffFile, text: &str, places: Vec<PagePlace>, image: Option<u32>) -> Result<Chosen> {
    let page_at = |n: u64| {
        let place = usize::try_from(n).ok().and_then(|n| places.get(n));
        let &(number, offset) = place.ok_or_else(|| {
            let held = places.len();
            format!("the description places a plane on page {} but the file holds {held} pages: it is truncated or was edited", n.saturating_add(1))
        })?;
        let named = format!("{}: ", file.path.display());
        Tags::read(file, offset, number).and_then(|tags| Page::parse(&tags)).map_err(|error| {
            let text = error.to_string();
            text.strip_prefix(&named).unwrap_or(&text).to_string()
        })
    };
    let pages = places.len() as u64;
    let parsed = ome_xml::parse(text, &page_at, pages, image).map_err(|reason| file.error(reason))?;
    Ok(Chosen { first: parsed.page, description: parsed.description, places, images: parsed.images })
}

fn of_pages(file: &TiffFile, shaped: bool, all: &[PagePlace], image: Option<u32>) -> Result<Chosen> {
    if image.is_none() {
        let (first, mut description) = describe(file, all)?;
        let mut places = all.to_vec();
        drop_side_pages(file, &mut places, &mut description)?;
        let promised = description.dimensions.and_then(|d| d.count());
        if !shaped || promised.is_none_or(|n| n == places.len() as u64) || places.len() == 1 {
            return Ok(Chosen { first, description, places, images: Vec::new() });
        }
    }
    let mut groups = if shaped { series(file, all)? } else { kinds(file, all)? };
    if image.is_none() && groups.len() == all.len() && kinds(file, all)?.len() == 1 {
        return pages_one_by_one(file, all);
    }
    let mut images = Vec::with_capacity(groups.len());
    for group in &groups {
        images.push(summary(file, group)?);
    }
    let (wanted, held) = (image.unwrap_or(0), groups.len());
    if wanted as usize >= held {
        return Err(Error::usage(format!(
            "image {wanted} was asked for with --image-index but there are {held}, counted from 0"
        ))
        .at(&file.path));
    }
    let places = groups.swap_remove(wanted as usize);
    let (first, mut description) = describe(file, &places)?;
    let fits = description.dimensions.and_then(|d| d.count()).is_none_or(|n| n == places.len() as u64);
    if held > 1 && !fits && !(description.single_page && places.len() == 1 && shaped) {
        description.dimensions = None;
    }
    Ok(Chosen { first, description, places, images })
}

/// Pages of one kind that were added one after the other, each described as an array of its own.
fn pages_one_by_one(file: &TiffFile, all: &[PagePlace]) -> Result<Chosen> {
    let (first, mut description) = describe(file, all)?;
    description.dimensions = None;
    description.notes.push(format!(
        "each of the {} pages is called an image of its own; they are read as slices; --image-index N picks one",
        all.len()
    ));
    Ok(Chosen { first, description, places: all.to_vec(), images: Vec::new() })
}

/// The series of `tifffile`, each of which begins at a page with the shape of an array.
fn series(file: &TiffFile, all: &[PagePlace]) -> Result<Vec<Vec<PagePlace>>> {
    let mut groups: Vec<Vec<PagePlace>> = Vec::new();
    for &(number, offset) in all {
        let tags = Tags::read(file, offset, number)?;
        let begins = tags.text(270, ome_xml::MAX_TEXT)?.is_some_and(|text| shaped::is_shaped(&text));
        match groups.last_mut() {
            Some(group) if !begins => group.push((number, offset)),
            _ => groups.push(vec![(number, offset)]),
        }
    }
    Ok(groups)
}

/// The pages of one size and type each, in the order in which these come; previews and masks last.
pub(crate) fn kinds(file: &TiffFile, all: &[PagePlace]) -> Result<Vec<Vec<PagePlace>>> {
    let mut groups: Vec<(bool, Option<Kind>, Vec<PagePlace>)> = Vec::new();
    for &(number, offset) in all {
        let tags = Tags::read(file, offset, number)?;
        // Pages that cannot be read are an image of their own, which says why when it is asked for.
        let (side, kind) = (is_side_page(&tags)?, kind_of(&tags).ok());
        match groups.iter_mut().find(|(s, k, _)| (*s, *k) == (side, kind)) {
            Some((.., group)) => group.push((number, offset)),
            None => groups.push((side, kind, vec![(number, offset)])),
        }
    }
    groups.sort_by_key(|(side, ..)| *side);
    Ok(groups.into_iter().map(|(.., group)| group).collect())
}

fn summary(file: &TiffFile, group: &[PagePlace]) -> Result<ImageSummary> {
    let (number, offset) = group[0];
    let tags = Tags::read(file, offset, number)?;
    let size = |tag: u16| tags.number(tag).ok().flatten().unwrap_or(0);
    Ok(ImageSummary { name: None, shape: [size(256), size(257), group.len() as u64] })
}

/// Reads the first full page of an image without OME-XML and what the file says about its planes.
pub(crate) fn describe(file: &TiffFile, places: &[PagePlace]) -> Result<(Page, Description)> {
    let tags = Tags::read(file, places[0].1, places[0].0)?;
    let text = tags.text(270, ome_xml::MAX_TEXT)?.unwrap_or_default();
    // A preview may come first; the stack then begins with the first page that is none.
    let mut full = Tags::read(file, places[0].1, places[0].0)?;
    for &(number, offset) in places {
        full = Tags::read(file, offset, number)?;
        if !is_side_page(&full)? {
            break;
        }
    }
    let page = Page::parse(&full)?;
    let pages = places.len() as u64;
    if imagej::is_imagej(&text) {
        let tagged = resolution(&tags)?;
        let (sizes, unit) = if tagged.is_print() && !imagej::names_unit(&text) {
            ([None; 2], None)
        } else {
            (tagged.sizes, tagged.unit())
        };
        return Ok((page, imagej::parse(&text, pages, sizes, unit)));
    }
    let tagged = resolution(&full)?;
    // `tifffile` calls pixels per any unit pixels per inch when it is told nothing else.
    let unit = tagged.unit().filter(|_| !tagged.is_print());
    let sizes =
        tagged.sizes.map(|size| size.filter(|s| !(tagged.is_print() && DOTS_PER_INCH.contains(&s.recip().round()))));
    let mut description = shaped::parse(&text, &page, sizes, unit).unwrap_or_else(Description::none);
    if description.spacing == [None; 3] {
        add_plain_spacing(&tagged, &mut description);
    }
    Ok((page, description))
}

/// The pixel size that the resolution tags give.
struct Resolution {
    /// Along x and y.
    sizes: [Option<f64>; 2],
    /// The unit's name and its metres, where the tag names one.
    unit: Option<(&'static str, f64)>,
}

impl Resolution {
    fn unit(&self) -> Option<&'static str> {
        self.unit.map(|(name, _)| name)
    }

    /// Whether pixels are as coarse as those of a print: most writers put 72 or 300 dots per inch there without having
    /// measured anything.
    fn is_print(&self) -> bool {
        self.unit.is_some_and(|(name, metres)| {
            name != "um" && self.sizes.iter().flatten().any(|size| size * metres >= PRINT_SIZE)
        })
    }
}

fn resolution(tags: &Tags) -> Result<Resolution> {
    // The last two are an addition of `tifffile`.
    let unit = match tags.number(296)? {
        Some(2) => Some(("inch", 0.0254)),
        Some(3) => Some(("cm", 0.01)),
        Some(4) => Some(("mm", 1e-3)),
        Some(5) => Some(("um", 1e-6)),
        _ => None,
    };
    let sizes = [tags.positive_rational(282)?, tags.positive_rational(283)?].map(|r| r.map(f64::recip));
    Ok(Resolution { sizes, unit })
}

/// Spacing from the resolution tags of a file without description: only where the unit is a real one and the pixels
/// are finer than any print.
fn add_plain_spacing(tagged: &Resolution, description: &mut Description) {
    let (Some((_, metres)), [Some(x), Some(y)], false) = (tagged.unit, tagged.sizes, tagged.is_print()) else { return };
    let micrometres = |size: f64| size * (metres / units::MICROMETRE);
    description.spacing = [Some(micrometres(x)), Some(micrometres(y)), None];
    description.unit = Some("micrometer".to_string());
}

/// Leaves out previews and masks; a file of nothing else is read as it is.
fn drop_side_pages(file: &TiffFile, places: &mut Vec<PagePlace>, description: &mut Description) -> Result<()> {
    let mut full = Vec::with_capacity(places.len());
    for &(number, offset) in places.iter() {
        if !is_side_page(&Tags::read(file, offset, number)?)? {
            full.push((number, offset));
        }
    }
    let dropped = places.len() - full.len();
    if dropped > 0 && !full.is_empty() {
        description.notes.push(format!(
            "{dropped} pages are previews or masks and were left out; --image-index N picks pages of one size and type"
        ));
        *places = full;
    }
    Ok(())
}
