//! VTI, VTK's XML `ImageData`, with one piece and its array appended raw and unpacked: what this crate and vtk write so.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use roxmltree::{Document, Node};

use super::planes::{RawVolume, Stored};
use crate::error::{Error, Result};
use crate::io::stack::number::{ByteOrder, Number};
use crate::io::stack::volume::{Select, Stack, StackInfo};

/// The description stands within the first bytes.
const MOST_BYTES: u64 = 1 << 20;
/// Entries along an axis, and of all axes, that indices still count.
const MOST_ENTRIES: i64 = 1 << 31;
const MOST_VALUES: i64 = 1 << 48;

/// Whether a file that begins so is one of them.
pub(crate) fn is_vti(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    text.trim_start().starts_with('<') && text.contains("<VTKFile") && text.contains("ImageData")
}

/// Opens the first array of the points, or of the cells.
pub(crate) fn open(path: &Path, select: Select) -> Result<Box<dyn Stack>> {
    if select.channel > 0 || select.time > 0 || select.level > 0 {
        return Err(Error::usage("holds one channel of one time and one level, counted from 0").at(path));
    }
    let unreadable = |error: std::io::Error| Error::input(format!("cannot be read: {error}")).caused_by(error).at(path);
    let mut head = Vec::new();
    File::open(path).map_err(unreadable)?.take(MOST_BYTES).read_to_end(&mut head).map_err(unreadable)?;
    let (info, stored) = parse(&head, path).map_err(|reason| Error::input(reason).at(path))?;
    Ok(Box::new(RawVolume::new(path, info, stored)?))
}

fn parse(head: &[u8], path: &Path) -> std::result::Result<(StackInfo, Stored), String> {
    let mark = b"<AppendedData";
    let at = head.windows(mark.len()).position(|bytes| bytes == mark);
    let at = at.ok_or("has no data appended within its first MiB; save it appended, raw and unpacked")?;
    let text = String::from_utf8_lossy(&head[..at]).into_owned() + "</VTKFile>";
    let document = Document::parse(&text).map_err(|error| format!("is no XML that can be read: {error}"))?;
    let tag = String::from_utf8_lossy(&head[at..]);
    let opening = tag.split('>').next().unwrap_or_default();
    let begin = tag.find('>').map(|end| end + 1).and_then(|end| Some(end + tag[end..].find('_')? + 1));
    // The tag itself is ASCII, so that bytes of the text are bytes of the file.
    let begin = begin.filter(|_| opening.contains("raw")).ok_or("has data appended as text; save it raw")?;
    let root = document.root_element();
    let sizes = match root.attribute("header_type") {
        None | Some("UInt32") => 4,
        Some("UInt64") => 8,
        Some(other) => return Err(format!("counts bytes in {other}; UInt32 and UInt64 are read")),
    };
    if root.attribute("compressor").is_some() {
        return Err("is packed; save it without a compressor".into());
    }
    let order = if root.attribute("byte_order") == Some("BigEndian") { ByteOrder::Big } else { ByteOrder::Little };
    let image = child(root, "ImageData").ok_or("holds no ImageData")?;
    let (info, number, offset) = image_info(image)?;
    let start = (at + begin + sizes) as u64 + offset;
    let stored = Stored { file: path.to_path_buf(), start: Some(start), is_gzip: false, number, order, before: 0 };
    Ok((info, stored))
}

fn image_info(image: Node<'_, '_>) -> std::result::Result<(StackInfo, Number, u64), String> {
    let pieces: Vec<Node> = image.children().filter(|node| node.has_tag_name("Piece")).collect();
    let extent: [i64; 6] = numbers(image, "WholeExtent").ok_or("has no WholeExtent of six whole numbers")?;
    let [piece] = pieces.as_slice() else { return Err(format!("has {} pieces; one is read", pieces.len())) };
    if numbers::<i64, 6>(*piece, "Extent") != Some(extent) {
        return Err("has a piece that is not the whole image".into());
    }
    let array = |kind: &str| child(*piece, kind).and_then(|data| child(data, "DataArray"));
    let (array, is_cells) = match (array("PointData"), array("CellData")) {
        (Some(array), _) => (array, false),
        (None, Some(array)) => (array, true),
        (None, None) => return Err("holds no array".into()),
    };
    let lo = [extent[0], extent[2], extent[4]];
    let count = |a: usize| extent[2 * a + 1].checked_sub(lo[a])?.checked_add(i64::from(!is_cells));
    let shape = [count(0), count(1), count(2)].map(|n| n.filter(|n| (1..MOST_ENTRIES).contains(n)).unwrap_or(0));
    let all = shape.iter().try_fold(1_i64, |all, &n| all.checked_mul(n));
    if shape.contains(&0) || all.is_none_or(|all| all > MOST_VALUES) {
        return Err(format!("has the extent {extent:?}, which cannot be worked on"));
    }
    if array.attribute("NumberOfComponents").is_some_and(|n| n != "1") || array.attribute("format") != Some("appended")
    {
        return Err("has an array that is no appended one of single numbers".into());
    }
    let kind = array.attribute("type").unwrap_or_default();
    let number = Number::named(&kind.to_lowercase()).ok_or_else(|| format!("holds voxels of type '{kind}'"))?;
    let offset = array.attribute("offset").and_then(|offset| offset.parse::<u64>().ok()).filter(|&n| n < 1 << 62);
    let offset = offset.ok_or("has an array without an offset")?;
    let spacing: [f64; 3] = numbers(image, "Spacing").unwrap_or([1.0; 3]);
    let origin: [f64; 3] = numbers(image, "Origin").unwrap_or_default();
    let direction: Option<[f64; 9]> = numbers(image, "Direction");
    let is_turned = direction.is_some_and(|d| d != [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let told = "its axes are turned in space, which is left aside: the axes of the file are taken as x, y, z";
    let info = StackInfo {
        shape,
        channels: 1,
        times: 1,
        file_type: number.name().to_owned(),
        element: number.element(),
        spacing: spacing.map(|h| (h.is_finite() && h > 0.0).then_some(h)),
        // The first point of a grid that does not begin at 0; of cells their middles.
        origin: std::array::from_fn(|a| origin[a] + spacing[a] * (lo[a] as f64 + if is_cells { 0.5 } else { 0.0 })),
        unit: unit(image),
        interval: None,
        axes: "ZYX".to_owned(),
        compression: "none".to_owned(),
        notes: if is_turned { vec![told.to_owned()] } else { Vec::new() },
    };
    Ok((info, number, offset))
}

fn child<'a, 'b>(node: Node<'a, 'b>, name: &str) -> Option<Node<'a, 'b>> {
    node.children().find(|node| node.has_tag_name(name))
}

fn numbers<T: std::str::FromStr, const N: usize>(node: Node<'_, '_>, name: &str) -> Option<[T; N]> {
    let found: Option<Vec<T>> = node.attribute(name)?.split_whitespace().map(|text| text.parse().ok()).collect();
    found?.try_into().ok()
}

/// The unit that this crate writes: the codes of its letters.
fn unit(image: Node<'_, '_>) -> Option<String> {
    let array = child(child(image, "FieldData")?, "Array").filter(|a| a.attribute("Name") == Some("LengthUnit"))?;
    let codes: Option<Vec<u8>> = array.text()?.split_whitespace().map(|code| code.parse().ok()).collect();
    String::from_utf8(codes?.into_iter().take_while(|&code| code != 0).collect()).ok().filter(|unit| !unit.is_empty())
}
