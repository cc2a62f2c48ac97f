//! Opening: finds out what kind of stack a file or folder is, and where each plane of the wanted channel and time lies.

use std::path::Path;

use super::description::layout::{Axis, Description, Dimensions};
use super::images::{self, Chosen, PagePlace};
use super::opened::{Opened, Place, PlaneOrder, Source};
use super::pages::ifd::{Tags, TiffFile};
use super::pages::page::{Kind, Page};
use super::raw::Contiguous;
use super::{Select, StackInfo, levels};
use crate::error::{Error, Result};
use crate::io::stack::page_axes::PageAxes;

/// Opens one TIFF file.
pub(crate) fn open_file(path: &Path, select: Select) -> Result<Opened> {
    let file = TiffFile::open(path)?;
    let offsets = file.pages()?;
    let Chosen { first, mut description, places, images } = images::choose(&file, &offsets, select.image)?;
    let available = places.len() as u64;
    if let Some(reason) = description.objection.take().filter(|_| select.axes.is_none()) {
        return Err(file.error(reason));
    }
    let mut order = Order { dimensions: description.dimensions.unwrap_or(Dimensions::only_z(available)), pixel: first };
    if let Some(axes) = select.axes {
        order =
            named(&axes, order, &mut description, available, images.len() > 1).map_err(|r| Error::usage(r).at(path))?;
    }
    let Order { dimensions, mut pixel } = order;
    let (channel, sample) = choose(path, &dimensions, pixel.kind.samples, select)?;
    // A plane takes a directory of its own or at least one byte.
    let Some(total) = dimensions.count().filter(|&n| n <= file.len) else {
        return Err(file.error("the description promises more planes than the file can hold: it is damaged"));
    };
    let order = PlaneOrder { dimensions, channel, time: select.time.into() };
    let in_copies = pixel.kind == first.kind && !(description.single_page && available == 1 && total > 1);
    if select.level > 0 && !in_copies {
        return Err(levels::refused(&file, select.level as usize, 1));
    }
    let mut factors = [1.0; 3];
    let source = if pixel.kind != first.kind {
        // Samples were said to be planes.
        let planes = (0..dimensions.size(Axis::Z)).map(|z| order.plane(z) as u16);
        let places = planes.map(|sample| Place { page: places[0], sample }).collect();
        Source::Pages { file, kind: first.kind, places }
    } else if description.single_page && available == 1 && total > 1 {
        let tags = Tags::read(&file, places[0].1, places[0].0)?;
        Source::Contiguous { stack: Contiguous::new(&tags, first, total)?, file, sample, order }
    } else {
        check_count(&file, &mut description, total, available, images.len())?;
        let planes: Vec<u64> = (0..dimensions.size(Axis::Z)).map(|z| order.plane(z)).collect();
        let pages = description.pages(&file, &planes, total, available)?;
        let places: Vec<PagePlace> = pages.iter().map(|&page| places[page as usize]).collect();
        let (level, places) = levels::choose(&file, select, first, places, &mut description.notes)?;
        refuse_odd_pages(&file, level.kind, &places, description.runs.is_none() && select.level == 0)?;
        factors = levels::factors(&first, &level);
        pixel = level;
        Source::Pages {
            file,
            kind: level.kind,
            places: places.into_iter().map(|page| Place { page, sample }).collect(),
        }
    };
    let mut info = info(&pixel, &dimensions, description);
    for (axis, factor) in factors.into_iter().enumerate().filter(|&(_, factor)| factor != 1.0) {
        // Both levels cover the same place, so that the first voxel of the coarser one lies farther in.
        info.origin[axis] = 0.5 * (factor - 1.0) * info.spacing[axis].unwrap_or(0.0);
        info.spacing[axis] = info.spacing[axis].map(|h| h * factor);
    }
    Ok(Opened { info, images, source })
}

/// The axes of the planes, and a page with the samples that are channels.
#[derive(Clone, Copy)]
struct Order {
    dimensions: Dimensions,
    pixel: Page,
}

/// The order that the user names in place of the file's.
fn named(
    axes: &PageAxes,
    stored: Order,
    description: &mut Description,
    available: u64,
    several: bool,
) -> std::result::Result<Order, String> {
    let Order { mut dimensions, mut pixel } = stored;
    let before = dimensions.letters(&pixel);
    let contiguous = description.single_page && available == 1;
    if !contiguous && !several && dimensions.count() != Some(available) {
        // Pages that are there count, not those that the file promises.
        dimensions = Dimensions::only_z(available);
        description.runs = None;
    }
    let mut stored = dimensions.long();
    if stored.is_empty() && pixel.kind.samples > 1 && !axes.is_empty() {
        stored = vec![(Axis::Channel, pixel.kind.samples.into())];
        (pixel.kind.samples, pixel.planar) = (1, false);
    }
    let planes = stored.iter().map(|&(_, n)| n).fold(1, u64::saturating_mul);
    let named = Dimensions(axes.sizes(&stored, planes)?);
    let after = named.letters(&pixel);
    if before != after || dimensions != named {
        description.notes.retain(|note| !note.contains("have no names"));
        description.notes.push(format!("the file's axes are {before}; they are read as {after}, as --axes says"));
    }
    Ok(Order { dimensions: named, pixel })
}

/// Compares the planes that the description promises with the pages that are there.
fn check_count(
    file: &TiffFile,
    description: &mut Description,
    total: u64,
    available: u64,
    images: usize,
) -> Result<()> {
    if total == available {
        return Ok(());
    }
    if description.runs.is_some() {
        // Whether the planes that are wanted have pages shows when these are looked up.
        if total > available || images == 0 {
            let tail = if total < available { ", and the others are left out" } else { "" };
            description.notes.push(format!(
                "the OME-XML names {total} planes but the file holds {available} pages{tail}; --axes says what the pages are"
            ));
        }
        return Ok(());
    }
    let verdict = if total > available { "it is truncated" } else { "it was edited without its description" };
    Err(file.error(format!(
        "the description promises {total} planes but the file holds {available} pages: {verdict}; give --axes zyx to \
         read the pages that are there as slices"
    )))
}

/// Refuses planes of another size or type; `apart` says whether `--image-index` takes pages by these.
fn refuse_odd_pages(file: &TiffFile, kind: Kind, places: &[PagePlace], apart: bool) -> Result<()> {
    for &(number, offset) in places {
        let tags = Tags::read(file, offset, number)?;
        let page = Page::parse(&tags)?;
        if page.kind != kind {
            let last = images::kinds(file, places)?.len() - 1;
            let advice = format!("; give --image-index 0, or up to {last}, to read the pages of one size and type");
            return Err(tags.error(format!(
                "it is {} where the stack is {kind}; all planes of a stack must be alike{}",
                page.kind,
                if apart { advice.as_str() } else { "" }
            )));
        }
    }
    Ok(())
}

/// The channel among the planes, and the sample in the pixel, that hold the wanted channel.
pub(crate) fn choose(path: &Path, dimensions: &Dimensions, samples: u16, select: Select) -> Result<(u64, u16)> {
    let channels = dimensions.size(Axis::Channel).saturating_mul(u64::from(samples));
    let times = dimensions.size(Axis::Time);
    let refuse = |what: &str, wanted: u32, held: u64| {
        Err(Error::usage(format!("{what} {wanted} was asked for but there are {held}, counted from 0")).at(path))
    };
    if u64::from(select.channel) >= channels {
        return refuse("channel", select.channel, channels);
    }
    if u64::from(select.time) >= times {
        return refuse("time", select.time, times);
    }
    Ok((u64::from(select.channel) / u64::from(samples), (select.channel % u32::from(samples)) as u16))
}

/// What is said of channels and times without slices, of which one may be these.
fn one_of_two(dimensions: &Dimensions, page: &Page) -> String {
    let (channels, times) = (dimensions.size(Axis::Channel), dimensions.size(Axis::Time));
    let stored: String = dimensions.letters(page).to_lowercase().chars().filter(|c| "ct".contains(*c)).collect();
    let [of_times, of_channels] = ['t', 'c'].map(|axis| stored.replace(axis, "z"));
    format!(
        "{} planes are stored as {times} times and {channels} channels; if the times are slices, give --axes {of_times}yx, if \
         the channels are, --axes {of_channels}yx, if all are, --axes zyx",
        times.saturating_mul(channels)
    )
}

pub(crate) fn info(page: &Page, dimensions: &Dimensions, description: Description) -> StackInfo {
    let mut notes = description.notes;
    let (depth, planes) = (dimensions.size(Axis::Z), dimensions.count().unwrap_or(u64::MAX));
    let mut sample_planes = u64::from(page.kind.samples);
    if depth == 1 && planes > 1 {
        sample_planes = 1;
    }
    if depth == 1 && planes.saturating_mul(sample_planes) > 1 {
        // Many writers put the slices of a stack down as channels or frames when they are not told the axes.
        let stored = match [Axis::Channel, Axis::Time].map(|axis| dimensions.size(axis) > 1) {
            [true, true] => "channels and times",
            [false, true] => "times",
            [_, false] => "channels",
        };
        let planes = planes.saturating_mul(sample_planes);
        let both = (stored == "channels and times").then(|| one_of_two(dimensions, page));
        notes.push(
            both.unwrap_or_else(|| {
                format!("{planes} planes are stored as {stored}; if they are slices, give --axes zyx")
            }),
        );
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
        interval: description.interval,
        axes: dimensions.letters(page),
        compression: page.compression.name(),
        notes,
    }
}
