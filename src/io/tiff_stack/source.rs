//! Opening: finds out what kind of stack a file or folder is, and where each plane of the wanted channel and time lies.

use std::path::{Path, PathBuf};

use super::decode::{Plane, Scratch};
use super::ifd::{Tags, TiffFile};
use super::layout::{Axis, Description, Dimensions};
use super::page::{Kind, Page, is_side_page};
use super::raw::Contiguous;
use super::{Select, StackInfo, imagej, ome_xml, shaped, slices};
use crate::error::{Error, Result};
use crate::store::SamplesMut;

/// The pixel size above which resolution tags of plain files are a print resolution (1270 dots per inch), in metres.
const PRINT_SIZE: f64 = 20e-6;

/// Where the planes of the wanted channel and time lie.
#[derive(Debug)]
pub(super) enum Source {
    /// One page for each plane: its number, from 1, and offset.
    Pages { file: TiffFile, kind: Kind, sample: u16, places: Vec<(usize, u64)> },
    /// One page, planes one after the other.
    Contiguous { file: TiffFile, stack: Contiguous, sample: u16, order: PlaneOrder },
    /// One file for each plane.
    Slices { files: Vec<PathBuf>, kind: Kind, sample: u16 },
}

/// The planes of the wanted channel and time.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneOrder {
    dimensions: Dimensions,
    channel: u64,
    time: u64,
}

impl PlaneOrder {
    fn plane(&self, z: u64) -> u64 {
        self.dimensions.plane(self.channel, self.time, z)
    }
}

/// A stack that was understood.
#[derive(Debug)]
pub(super) struct Opened {
    pub(super) info: StackInfo,
    pub(super) source: Source,
}

impl Source {
    /// Decodes plane `z`, which is within the stack, into `out` of the right type and length.
    pub(super) fn read_plane(&self, z: u64, scratch: &mut Scratch, out: &mut SamplesMut<'_>) -> Result<()> {
        let z = z as usize;
        match self {
            Self::Pages { file, kind, sample, places } => {
                let (number, offset) = places[z];
                read_page(file, *kind, *sample, number, offset, scratch, out)
            }
            Self::Contiguous { file, stack, sample, order } => {
                let chunks = vec![stack.chunk(order.plane(z as u64))];
                Plane { file, page: stack.page, sample: *sample, chunks }.read(scratch, out)
            }
            Self::Slices { files, kind, sample } => {
                let (file, offset) = slices::open_slice(&files[z])?;
                read_page(&file, *kind, *sample, 1, offset, scratch, out)
            }
        }
    }
}

fn read_page(
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

fn require_kind(tags: &Tags, page: &Page, kind: Kind) -> Result<()> {
    if page.kind == kind {
        return Ok(());
    }
    Err(tags.error(format!("it is {} where the stack is {kind}; all planes of a stack must be alike", page.kind)))
}

/// Opens one TIFF file.
pub(super) fn open_file(path: &Path, select: Select) -> Result<Opened> {
    let file = TiffFile::open(path)?;
    let offsets = file.pages()?;
    let (first, mut description) = describe(&file, &offsets)?;
    let mut places: Vec<(usize, u64)> = offsets.iter().enumerate().map(|(n, &offset)| (n + 1, offset)).collect();
    if description.runs.is_none() {
        drop_side_pages(&file, &mut places, &mut description)?;
    }
    let available = places.len() as u64;
    let dimensions = description.dimensions.unwrap_or(Dimensions::only_z(available));
    let (channel, sample) = choose(&file, &dimensions, first.kind.samples, select)?;
    // A plane takes a directory of its own or at least one byte.
    let Some(total) = dimensions.count().filter(|&n| n <= file.len) else {
        return Err(file.error("the description promises more planes than the file can hold: it is damaged"));
    };
    let order = PlaneOrder { dimensions, channel, time: select.time.into() };
    let info = info(&first, &dimensions, description.clone());
    let source = if description.single_page && available == 1 && total > 1 {
        let tags = Tags::read(&file, places[0].1, places[0].0)?;
        Source::Contiguous { stack: Contiguous::new(&tags, first, total)?, file, sample, order }
    } else {
        refuse_wrong_count(&file, &description, total, available)?;
        let planes: Vec<u64> = (0..dimensions.size(Axis::Z)).map(|z| order.plane(z)).collect();
        let pages = description.pages(&file, &planes, available)?;
        let places: Vec<(usize, u64)> = pages.iter().map(|&page| places[page as usize]).collect();
        refuse_odd_pages(&file, first.kind, &places)?;
        Source::Pages { file, kind: first.kind, sample, places }
    };
    Ok(Opened { info, source })
}

/// Reads the first full page and what the file says about its planes.
pub(super) fn describe(file: &TiffFile, offsets: &[u64]) -> Result<(Page, Description)> {
    let tags = Tags::read(file, offsets[0], 1)?;
    let text = tags.text(270, ome_xml::MAX_TEXT)?.unwrap_or_default();
    let pages = offsets.len() as u64;
    if ome_xml::is_ome(&text) {
        let page = Page::parse(&tags)?;
        let description = ome_xml::parse(&text, &page, pages).map_err(|reason| file.error(reason))?;
        return Ok((page, description));
    }
    // A preview may come first; the stack then begins with the first page that is none.
    let mut full = Tags::read(file, offsets[0], 1)?;
    for (n, &offset) in offsets.iter().enumerate() {
        full = Tags::read(file, offset, n + 1)?;
        if !is_side_page(&full)? {
            break;
        }
    }
    let page = Page::parse(&full)?;
    if imagej::is_imagej(&text) {
        let xy = resolution(&tags)?.map(|r| r.map(f64::recip));
        return Ok((page, imagej::parse(&text, pages, xy)));
    }
    let mut description = shaped::parse(&text, &page).unwrap_or_else(Description::none);
    add_plain_spacing(&full, &mut description)?;
    Ok((page, description))
}

fn resolution(tags: &Tags) -> Result<[Option<f64>; 2]> {
    Ok([tags.positive_rational(282)?, tags.positive_rational(283)?])
}

/// Spacing from the resolution tags of a file without description: only where the unit is a real one and the pixels
/// are finer than any print, since most writers put 72 or 300 dots per inch there without having measured anything.
fn add_plain_spacing(tags: &Tags, description: &mut Description) -> Result<()> {
    let metres = match tags.number(296)? {
        Some(2) => 0.0254,
        Some(3) => 0.01,
        _ => return Ok(()),
    };
    let [Some(x), Some(y)] = resolution(tags)?.map(|r| r.map(|r| metres / r)) else { return Ok(()) };
    if x < PRINT_SIZE && y < PRINT_SIZE {
        description.spacing = [Some(x * 1e6), Some(y * 1e6), None];
        description.unit = Some("micrometer".to_string());
    }
    Ok(())
}

/// Leaves out previews and masks; a file of nothing else is read as it is.
fn drop_side_pages(file: &TiffFile, places: &mut Vec<(usize, u64)>, description: &mut Description) -> Result<()> {
    let mut full = Vec::with_capacity(places.len());
    for &(number, offset) in places.iter() {
        if !is_side_page(&Tags::read(file, offset, number)?)? {
            full.push((number, offset));
        }
    }
    let dropped = places.len() - full.len();
    if dropped > 0 && !full.is_empty() {
        description.notes.push(format!("{dropped} pages are previews or masks and were left out"));
        *places = full;
    }
    Ok(())
}

fn refuse_wrong_count(file: &TiffFile, description: &Description, total: u64, available: u64) -> Result<()> {
    // Pages that OME-XML does not name are no part of the image.
    if total == available || (description.runs.is_some() && total < available) {
        return Ok(());
    }
    let verdict = if total > available { "it is truncated" } else { "it was edited without its description" };
    Err(file.error(format!("the description promises {total} planes but the file holds {available} pages: {verdict}")))
}

fn refuse_odd_pages(file: &TiffFile, kind: Kind, places: &[(usize, u64)]) -> Result<()> {
    places.iter().try_for_each(|&(number, offset)| {
        let tags = Tags::read(file, offset, number)?;
        require_kind(&tags, &Page::parse(&tags)?, kind)
    })
}

/// The channel among the planes, and the sample in the pixel, that hold the wanted channel.
pub(super) fn choose(file: &TiffFile, dimensions: &Dimensions, samples: u16, select: Select) -> Result<(u64, u16)> {
    let channels = dimensions.size(Axis::Channel).saturating_mul(u64::from(samples));
    let times = dimensions.size(Axis::Time);
    let refuse = |what: &str, wanted: u32, held: u64| {
        Err(Error::usage(format!("{what} {wanted} was asked for but there are {held}, counted from 0")).at(&file.path))
    };
    if u64::from(select.channel) >= channels {
        return refuse("channel", select.channel, channels);
    }
    if u64::from(select.time) >= times {
        return refuse("time", select.time, times);
    }
    Ok((u64::from(select.channel) / u64::from(samples), (select.channel % u32::from(samples)) as u16))
}

pub(super) fn info(page: &Page, dimensions: &Dimensions, description: Description) -> StackInfo {
    let mut notes = description.notes;
    let (depth, planes) = (dimensions.size(Axis::Z), dimensions.count().unwrap_or(u64::MAX));
    if depth == 1 && planes > 1 {
        // Many writers put the slices of a stack down as channels or frames when they are not told the axes.
        notes.push(format!(
            "there is 1 plane along z but {planes} planes of other channels or times; is one of them z?"
        ));
    }
    let sample = page.kind.sample;
    let channels = dimensions.size(Axis::Channel).saturating_mul(u64::from(page.kind.samples));
    StackInfo {
        shape: [page.kind.width.into(), page.kind.height.into(), dimensions.size(Axis::Z) as i64],
        channels: u32::try_from(channels).unwrap_or(u32::MAX),
        times: u32::try_from(dimensions.size(Axis::Time)).unwrap_or(u32::MAX),
        file_type: sample.name(),
        element: sample.element(),
        spacing: description.spacing,
        origin: [0.0; 3],
        unit: description.unit,
        axes: dimensions.letters(page),
        compression: page.compression.name(),
        notes,
    }
}
