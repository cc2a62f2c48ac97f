//! OME-XML in the `ImageDescription` of the first page (OME model 2016-06 and before; elements `Pixels`, `TiffData`).

use roxmltree::{Document, Node, ParsingOptions};

use super::layout::{Axis, Description, Dimensions, Run};
use crate::io::stack::interval::Interval;
use crate::io::stack::tiff::pages::page::Page;
use crate::io::stack::units;
use crate::io::stack::volume::ImageSummary;

/// The longest description that is read.
pub(crate) const MAX_TEXT: u64 = 32 << 20;
/// The most nodes of a document: ten for each of 200 000 planes.
const MAX_NODES: u32 = 2_000_000;
/// The longest start tag: the parser compares every attribute of a tag with every other.
const MAX_TAG: usize = 8 << 10;

/// True when the description is an OME-XML document.
pub(crate) fn is_ome(text: &str) -> bool {
    let text = text.trim_start_matches('\u{feff}').trim_start();
    // The root stands within the first lines, after the XML declaration and a comment.
    let head = text.get(..4096).unwrap_or(text);
    text.starts_with('<') && (head.contains("<OME") || head.contains(":OME"))
}

/// Parses the text, within limits.
fn document(text: &str) -> Result<Document<'_>, String> {
    let text = text.trim_start_matches('\u{feff}').trim();
    refuse_long_tags(text)?;
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|e| format!("the OME-XML is malformed: {e}"))
}

/// The spacing alone, for a file that is one slice of a folder and may describe the whole set. Sets of several channels
/// or times are refused where the names of the files do not tell which file is which.
pub(crate) fn spacing_of_slice(text: &str, told: [bool; 2]) -> Result<Description, String> {
    let document = document(text)?;
    let mut description = Description::none();
    let pixels = child(document.root_element(), "Image").and_then(|image| child(image, "Pixels"));
    let Some(pixels) = pixels else { return Ok(description) };
    let times = whole_number(pixels, "SizeT")?.unwrap_or(1);
    let files_per_time = pixels.children().filter(|n| n.tag_name().name() == "Channel").count();
    if (times > 1 && !told[1]) || (files_per_time > 1 && !told[0]) {
        return Err(
            "it is part of an OME set with several channels or times, which the names of the files do not tell; \
                    save that as one OME-TIFF file, or name the files as in z001_c0_t0.tif"
                .to_string(),
        );
    }
    add_spacing(pixels, &mut description);
    Ok(description)
}

/// One image of an OME-TIFF, and what others there are.
#[derive(Debug)]
pub(crate) struct Parsed {
    pub(crate) description: Description,
    /// The page of its first plane.
    pub(crate) page: Page,
    pub(crate) images: Vec<ImageSummary>,
}

/// Reads the description of an image, counted from 0; `page_at` reads a page of the file, counted from 0, of which it
/// has `pages`.
pub(crate) fn parse(
    text: &str,
    page_at: &dyn Fn(u64) -> Result<Page, String>,
    pages: u64,
    image: Option<u32>,
) -> Result<Parsed, String> {
    let document = document(text)?;
    let root = document.root_element();
    if let Some(elsewhere) = child(root, "BinaryOnly") {
        let name = elsewhere.attribute("MetadataFile").unwrap_or("another file");
        return Err(format!("its OME-XML lies in {name}; save the stack as one OME-TIFF file"));
    }
    let images: Vec<Node> = root.children().filter(|n| n.tag_name().name() == "Image").collect();
    let wanted = image.unwrap_or(0);
    let Some(pixels) = images.get(wanted as usize).and_then(|image| child(*image, "Pixels")) else {
        let held = images.len();
        return Err(if held == 0 || held > wanted as usize {
            "the OME-XML describes no image (element Pixels)".to_string()
        } else {
            format!("image {wanted} was asked for with --image-index but there are {held}, counted from 0")
        });
    };
    let begin = pixels.children().find(|n| n.tag_name().name() == "TiffData");
    let begin = begin.map_or(Ok(None), |block| whole_number(block, "IFD"))?.unwrap_or(0);
    let page = page_at(begin)?;
    let dimensions = dimensions(pixels, &page)?;
    let runs = runs(root, pixels, &dimensions, &page, pages)?;
    let mut description = Description { dimensions: Some(dimensions), runs: Some(runs), ..Description::none() };
    add_spacing(pixels, &mut description);
    let images: Vec<ImageSummary> = images.into_iter().map(summary).collect();
    Ok(Parsed { description, page, images })
}

/// Name and size of an image; sizes that are none count as 0 here.
fn summary(image: Node) -> ImageSummary {
    let pixels = child(image, "Pixels");
    let size = |name: &str| pixels.and_then(|pixels| whole_number(pixels, name).ok().flatten()).unwrap_or(0);
    let name = image.attribute("Name").map(str::trim).filter(|name| !name.is_empty());
    ImageSummary {
        name: name.map(|name| name.chars().filter(|c| !c.is_control()).take(40).collect()),
        shape: [size("SizeX"), size("SizeY"), size("SizeZ")],
    }
}

fn refuse_long_tags(text: &str) -> Result<(), String> {
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        let length = rest.find('>').unwrap_or(rest.len());
        // Comments and CDATA have no attributes.
        if length > MAX_TAG && !rest.starts_with("<!") {
            return Err(format!("the OME-XML has a tag of {length} characters; the file is damaged"));
        }
        rest = &rest[length..];
    }
    Ok(())
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|n| n.tag_name().name() == name)
}

fn whole_number(node: Node, name: &str) -> Result<Option<u64>, String> {
    let Some(text) = node.attribute(name) else { return Ok(None) };
    text.trim().parse().map(Some).map_err(|_| format!("the OME-XML gives {name} as \"{text}\", not a whole number"))
}

/// Sizes in the order of the planes; samples of one pixel are no planes of their own.
fn dimensions(pixels: Node, page: &Page) -> Result<Dimensions, String> {
    let size = |name: &str| match whole_number(pixels, name)? {
        Some(0) | None => Err(format!("the OME-XML lacks {name}")),
        Some(n) => Ok(n),
    };
    let (width, height) = (size("SizeX")?, size("SizeY")?);
    if (width, height) != (u64::from(page.kind.width), u64::from(page.kind.height)) {
        return Err(format!(
            "the OME-XML says {width} x {height} pixels but the page has {} x {}",
            page.kind.width, page.kind.height
        ));
    }
    let (channels, samples) = (size("SizeC")?, u64::from(page.kind.samples));
    if channels % samples != 0 {
        return Err(format!("the OME-XML says {channels} channels but every pixel has {samples} samples"));
    }
    let sizes = [(Axis::Channel, channels / samples), (Axis::Z, size("SizeZ")?), (Axis::Time, size("SizeT")?)];
    let order = pixels.attribute("DimensionOrder").unwrap_or("XYZCT");
    let axes: Vec<Axis> = order.strip_prefix("XY").unwrap_or("").chars().filter_map(Axis::from_letter).collect();
    let ordered: Vec<(Axis, u64)> = axes.iter().filter_map(|a| sizes.iter().copied().find(|(b, _)| a == b)).collect();
    let complete = sizes.iter().all(|(axis, _)| axes.contains(axis));
    match <[(Axis, u64); 3]>::try_from(ordered) {
        Ok(ordered) if complete => Ok(Dimensions(ordered)),
        _ => Err(format!("the OME-XML has the DimensionOrder \"{order}\", which is none of the six that exist")),
    }
}

/// The pages of the planes. Defaults as in the OME-TIFF specification: an element without `IFD` and `PlaneCount` stands
/// for all pages, one with `IFD` alone for one plane.
fn runs(root: Node, pixels: Node, dimensions: &Dimensions, page: &Page, pages: u64) -> Result<Vec<Run>, String> {
    let samples = u64::from(page.kind.samples);
    let own = root.attribute("UUID");
    let mut runs = Vec::new();
    for block in pixels.children().filter(|n| n.tag_name().name() == "TiffData") {
        if let Some(other) = other_file(block, own) {
            return Err(format!(
                "some of its planes lie in another file ({other}); save the stack as one OME-TIFF file"
            ));
        }
        let first = |name: &str| Ok::<u64, String>(whole_number(block, name)?.unwrap_or(0));
        let (channel, z, time) = (first("FirstC")? / samples, first("FirstZ")?, first("FirstT")?);
        let outside = channel >= dimensions.size(Axis::Channel)
            || z >= dimensions.size(Axis::Z)
            || time >= dimensions.size(Axis::Time);
        if outside {
            return Err("the OME-XML places a plane (TiffData) outside the sizes it gives".to_string());
        }
        let ifd = whole_number(block, "IFD")?;
        let all = if ifd.is_some() { 1 } else { pages };
        let count = whole_number(block, "PlaneCount")?.unwrap_or(all);
        runs.push(Run { plane: dimensions.plane(channel, time, z), page: ifd.unwrap_or(0), count });
    }
    if runs.is_empty() {
        runs.push(Run { plane: 0, page: 0, count: u64::MAX });
    }
    Ok(runs)
}

/// The name of the file that holds a block, where that is not this one.
fn other_file<'a>(block: Node<'a, '_>, own: Option<&str>) -> Option<&'a str> {
    let uuid = child(block, "UUID")?;
    let own = own?;
    (uuid.text().unwrap_or_default().trim() != own.trim())
        .then(|| uuid.attribute("FileName").unwrap_or("of another name"))
}

/// Physical sizes; the unit of an attribute is the micrometre by default.
fn add_spacing(pixels: Node, description: &mut Description) {
    let mut written = [None; 3];
    for (axis, letter) in ["X", "Y", "Z"].into_iter().enumerate() {
        let Some(text) = pixels.attribute(format!("PhysicalSize{letter}").as_str()) else { continue };
        let unit = pixels.attribute(format!("PhysicalSize{letter}Unit").as_str()).unwrap_or("\u{b5}m");
        match units::size(text) {
            Some(size) => written[axis] = Some((size, unit)),
            None => description.notes.push(format!("the OME-XML gives PhysicalSize{letter} as \"{text}\", no number")),
        }
    }
    let spacing = units::spacing(written);
    (description.spacing, description.unit) = (spacing.sizes, spacing.unit);
    description.notes.extend(spacing.notes);
    let increment = pixels.attribute("TimeIncrement").and_then(|text| text.trim().parse().ok());
    let unit = pixels.attribute("TimeIncrementUnit").unwrap_or("s");
    description.interval = increment.and_then(|step| Interval::told(step, unit));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::stack::number::{ByteOrder, Number};
    use crate::io::stack::tiff::pages::compression::Compression;
    use crate::io::stack::tiff::pages::page::Kind;
    use crate::io::stack::tiff::pages::samples::SampleKind;

    fn page(samples: u16) -> Page {
        Page {
            kind: Kind { width: 4, height: 3, sample: SampleKind::Number(Number::U8), samples },
            number: 1,
            order: ByteOrder::Little,
            planar: false,
            compression: Compression::None,
            predictor: 1,
            reversed_bits: false,
            tiled: false,
            chunk: [4, 3],
        }
    }

    fn document(attributes: &str, inside: &str) -> String {
        format!(
            "<?xml version=\"1.0\"?><!-- note --><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\" UUID=\"urn:uuid:a\">\
             <Image ID=\"Image:0\"><Pixels SizeX=\"4\" SizeY=\"3\" {attributes}>{inside}</Pixels></Image></OME>"
        )
    }

    #[test]
    fn order_runs_and_mixed_units() {
        let text = document(
            "DimensionOrder=\"XYTZC\" SizeC=\"2\" SizeZ=\"3\" SizeT=\"5\" PhysicalSizeX=\"0.5\" PhysicalSizeZ=\"2000\" PhysicalSizeZUnit=\"nm\"",
            "<TiffData IFD=\"7\" FirstC=\"1\" FirstZ=\"2\" FirstT=\"3\"/><TiffData PlaneCount=\"4\"/>",
        );
        assert!(is_ome(&text));
        let d = parse(&text, &|_| Ok(page(1)), 30, None).unwrap().description;
        assert_eq!(d.dimensions, Some(Dimensions([(Axis::Time, 5), (Axis::Z, 3), (Axis::Channel, 2)])));
        // Plane number of (c 1, z 2, t 3) with t fastest: 3 + 5 * (2 + 3 * 1).
        let runs = vec![Run { plane: 28, page: 7, count: 1 }, Run { plane: 0, page: 0, count: 4 }];
        assert_eq!(d.runs, Some(runs));
        assert_eq!(d.spacing[0], Some(0.5));
        assert_eq!(d.spacing[1], None);
        assert!((d.spacing[2].unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(d.unit.as_deref(), Some("micrometer"));
    }

    #[test]
    fn samples_in_a_pixel_are_channels_but_no_planes() {
        let text = document(
            "DimensionOrder=\"XYCZT\" SizeC=\"6\" SizeZ=\"2\" SizeT=\"1\"",
            "<TiffData FirstC=\"3\" IFD=\"1\"/>",
        );
        let d = parse(&text, &|_| Ok(page(3)), 4, None).unwrap().description;
        assert_eq!(d.dimensions.map(|d| d.size(Axis::Channel)), Some(2));
        assert_eq!(d.runs, Some(vec![Run { plane: 1, page: 1, count: 1 }]));
    }

    #[test]
    fn refusals_say_why() {
        let reason = |text: &str| parse(text, &|_| Ok(page(1)), 9, None).unwrap_err();
        let sizes = "DimensionOrder=\"XYCZT\" SizeC=\"1\" SizeZ=\"2\" SizeT=\"1\"";
        let foreign = "<TiffData><UUID FileName=\"b.ome.tif\">urn:uuid:b</UUID></TiffData>";
        assert!(reason(&document(sizes, foreign)).contains("b.ome.tif"));
        assert!(reason(&document(sizes, "<TiffData FirstZ=\"2\"/>")).contains("outside"));
        assert!(reason(&document("SizeC=\"1\" SizeZ=\"0\" SizeT=\"1\"", "")).contains("SizeZ"));
        assert!(reason("<OME><Image>").contains("malformed"));
        let long = format!("<OME {}/>", "a=\"\" ".repeat(4000));
        assert!(reason(&long).contains("tag of"));
        let own = document(sizes, "<TiffData><UUID>urn:uuid:a</UUID></TiffData>");
        assert!(parse(&own, &|_| Ok(page(1)), 9, None).is_ok());
        assert!(parse(&own, &|_| Ok(page(1)), 9, Some(1)).unwrap_err().contains("--image-index but there are 1"));
    }
}
