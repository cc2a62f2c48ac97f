//! One ROI: a header of 64 bytes, coordinates, and a second header with its place in the stack, as ImageJ's `RoiDecoder`
//! reads them.
//!
//! ImageJ counts areas from the corner of the first pixel, points and lines from its centre. Here 0 is the centre, so that
//! half a pixel is taken off areas.

use super::bytes::Bytes;
use super::paths;
use crate::error::{Error, Result};
use crate::io::geometry::read::ellipse::ellipse;

/// What is marked.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Marks {
    /// Nothing that bounds an object.
    None,
    /// Closed curves on the ROI's slice.
    Outlines(Vec<Vec<[f64; 2]>>),
    /// Points, each with its slice where it has one of its own.
    Points(Vec<([f64; 2], Option<i64>)>),
}

/// A ROI; coordinates are in voxels, 0 the centre of the first one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Roi {
    pub(crate) name: String,
    /// Its group, 0 for none.
    pub(crate) group: u16,
    /// Slice and time, counted from 0, where it tells them.
    pub(crate) slice: Option<i64>,
    pub(crate) time: Option<i64>,
    pub(crate) marks: Marks,
    /// Whether the marks are a line whose ends are not joined.
    pub(crate) is_open: bool,
}

/// Places in the first header.
mod at {
    pub(crate) const VERSION: usize = 4;
    pub(crate) const TYPE: usize = 6;
    pub(crate) const TOP: usize = 8;
    pub(crate) const LEFT: usize = 10;
    pub(crate) const BOTTOM: usize = 12;
    pub(crate) const RIGHT: usize = 14;
    pub(crate) const COUNT: usize = 16;
    /// Four floats: ends of a line, or place and size of a box.
    pub(crate) const FLOATS: usize = 18;
    /// The count where it does not fit its place.
    pub(crate) const LARGE_COUNT: usize = 18;
    pub(crate) const SHAPE_SIZE: usize = 36;
    pub(crate) const SUBTYPE: usize = 48;
    pub(crate) const OPTIONS: usize = 50;
    /// Of ellipses their ratio, of turned boxes their width.
    pub(crate) const FLOAT_PARAMETER: usize = 52;
    pub(crate) const POSITION: usize = 56;
    pub(crate) const SECOND_HEADER: usize = 60;
    pub(crate) const COORDINATES: usize = 64;
}

/// Places in the second header.
mod second {
    pub(crate) const Z: usize = 8;
    pub(crate) const T: usize = 12;
    pub(crate) const NAME: usize = 16;
    pub(crate) const NAME_LENGTH: usize = 20;
    pub(crate) const GROUP: usize = 30;
    pub(crate) const COUNTERS: usize = 48;
    pub(crate) const LARGE_GROUP: usize = 52;
    pub(crate) const LENGTH: usize = 52;
}

const SUB_PIXEL: i16 = 128;
const TEXT: i16 = 1;
const ELLIPSE: i16 = 3;
const IMAGE: i16 = 4;
const TURNED_BOX: i16 = 5;

impl Roi {
    /// Decodes a ROI; `file` is its name where it does not tell one.
    pub(crate) fn decode(content: &[u8], file: &str) -> Result<Self> {
        let bytes = Bytes(content);
        if !super::is_roi(content) {
            return Err(Error::input("does not start as a ROI of ImageJ does"));
        }
        let (kind, subtype) = (bytes.u8(at::TYPE)?, bytes.i16(at::SUBTYPE)?);
        let place = Place::read(bytes)?;
        let name = place.name.filter(|name| !name.is_empty()).unwrap_or_else(|| file.to_owned());
        let is_area = matches!(kind, 0..=2 | 7 | 8);
        let marks = match kind {
            _ if matches!(subtype, TEXT | IMAGE) => Marks::None,
            1 if bytes.place(at::SHAPE_SIZE)? > 0 => Marks::Outlines(paths::read(bytes, bytes.place(at::SHAPE_SIZE)?)?),
            1 => Marks::Outlines(vec![bounds(bytes)?.to_vec()]),
            2 => {
                let corners = bounds(bytes)?.map(|[x, y]| [x, y, 0.0]);
                Marks::Outlines(vec![ellipse(corners).into_iter().map(|[x, y, _]| [x, y]).collect()])
            }
            3 => {
                let end = |n: usize| Ok([bytes.f32(at::FLOATS + 8 * n)?, bytes.f32(at::FLOATS + 8 * n + 4)?]);
                Marks::Outlines(vec![vec![end(0)?, end(1)?]])
            }
            7 if coordinate_count(bytes)? == 0 && matches!(subtype, ELLIPSE | TURNED_BOX) => {
                Marks::Outlines(vec![turned(bytes, subtype)?])
            }
            0 | 4 | 5 | 7 | 8 => Marks::Outlines(vec![coordinates(bytes)?]),
            10 => Marks::Points(dots(bytes, place.counters)?),
            9 | 6 => Marks::None,
            other => return Err(Error::input(format!("is a ROI of the type {other}, which is unknown"))),
        };
        let marks = match marks {
            Marks::Outlines(parts) => {
                let shift = if is_area { 0.5 } else { 0.0 };
                let centred = |part: Vec<[f64; 2]>| part.into_iter().map(|p| p.map(|v| v - shift)).collect();
                let parts: Vec<Vec<[f64; 2]>> = parts.into_iter().map(centred).collect();
                if parts.iter().all(Vec::is_empty) { Marks::None } else { Marks::Outlines(parts) }
            }
            other => other,
        };
        let slice = place.slice.or_else(|| slice_of_name(&name));
        Ok(Self { name, group: place.group, slice, time: place.time, marks, is_open: matches!(kind, 3..=5) })
    }
}

/// What a ROI says of its place.
#[derive(Default)]
struct Place {
    slice: Option<i64>,
    time: Option<i64>,
    name: Option<String>,
    group: u16,
    /// Where a number for each point stands.
    counters: usize,
}

impl Place {
    fn read(bytes: Bytes<'_>) -> Result<Self> {
        let counted = |value: i32| (value > 0).then(|| i64::from(value) - 1);
        let mut place = Self { slice: counted(bytes.i32(at::POSITION)?), ..Self::default() };
        let header = bytes.place(at::SECOND_HEADER)?;
        if header == 0 || header + second::LENGTH > bytes.0.len() {
            return Ok(place);
        }
        // In a stack with channels and times the plain position counts planes of all of them.
        place.slice = counted(bytes.i32(header + second::Z)?).or(place.slice);
        place.time = counted(bytes.i32(header + second::T)?);
        place.group = u16::from(bytes.u8(header + second::GROUP)?);
        if place.group == 0 && bytes.i16(at::VERSION)? >= 229 {
            place.group = bytes.u16(header + second::LARGE_GROUP).unwrap_or(0);
        }
        place.counters = bytes.place(header + second::COUNTERS)?;
        let (start, length) = (bytes.place(header + second::NAME)?, bytes.place(header + second::NAME_LENGTH)?);
        let name = length.checked_mul(2).and_then(|length| bytes.0.get(start..start.checked_add(length)?));
        if let Some(name) = name.filter(|_| start > 0) {
            let (pairs, _) = name.as_chunks::<2>();
            let units: Vec<u16> = pairs.iter().map(|&pair| u16::from_be_bytes(pair)).collect();
            place.name = Some(String::from_utf16_lossy(&units));
        }
        Ok(place)
    }
}

fn has_floats(bytes: Bytes<'_>, since: i16) -> Result<bool> {
    Ok(bytes.i16(at::OPTIONS)? & SUB_PIXEL != 0 && bytes.i16(at::VERSION)? >= since)
}

/// The corners of a box, one after the other around it.
fn bounds(bytes: Bytes<'_>) -> Result<[[f64; 2]; 4]> {
    let [left, top, right, bottom] = if has_floats(bytes, 223)? {
        let float = |n: usize| bytes.f32(at::FLOATS + 4 * n);
        let (x, y, width, height) = (float(0)?, float(1)?, float(2)?, float(3)?);
        [x, y, x + width, y + height]
    } else {
        let place = |place: usize| bytes.i16(place).map(f64::from);
        [place(at::LEFT)?, place(at::TOP)?, place(at::RIGHT)?, place(at::BOTTOM)?]
    };
    Ok([[left, top], [right, top], [right, bottom], [left, bottom]])
}

/// An ellipse or a box around the axis between two points.
fn turned(bytes: Bytes<'_>, subtype: i16) -> Result<Vec<[f64; 2]>> {
    let float = |n: usize| bytes.f32(at::FLOATS + 4 * n);
    let ([x1, y1, x2, y2], parameter) = ([float(0)?, float(1)?, float(2)?, float(3)?], bytes.f32(at::FLOAT_PARAMETER)?);
    let length = ((x2 - x1).powi(2) + (y2 - y1).powi(2)).sqrt();
    let width = if subtype == ELLIPSE { parameter * length } else { parameter };
    let across =
        if length > 0.0 { [-(y2 - y1) * 0.5 * width / length, (x2 - x1) * 0.5 * width / length] } else { [0.0; 2] };
    let [u, v] = across;
    let corners = [[x1 - u, y1 - v], [x2 - u, y2 - v], [x2 + u, y2 + v], [x1 + u, y1 + v]];
    if subtype == TURNED_BOX {
        return Ok(corners.to_vec());
    }
    Ok(ellipse(corners.map(|[x, y]| [x, y, 0.0])).into_iter().map(|[x, y, _]| [x, y]).collect())
}

fn coordinate_count(bytes: Bytes<'_>) -> Result<usize> {
    match bytes.u16(at::COUNT)? {
        // Floats of boxes lie where the large count would.
        0 if matches!(bytes.i16(at::SUBTYPE)?, ELLIPSE | TURNED_BOX) => Ok(0),
        0 => bytes.place(at::LARGE_COUNT),
        count => Ok(usize::from(count)),
    }
}

/// The points of a polygon: whole numbers from its corner, and after these the same as floats where it has them.
fn coordinates(bytes: Bytes<'_>) -> Result<Vec<[f64; 2]>> {
    let count = coordinate_count(bytes)?;
    let floats = has_floats(bytes, 222)?;
    let needed = count.checked_mul(if floats { 12 } else { 4 }).and_then(|n| n.checked_add(at::COORDINATES));
    if needed.is_none_or(|needed| needed > bytes.0.len()) {
        return Err(Error::input(format!("is cut off: a ROI of ImageJ with {count} points is longer")));
    }
    let corner = [f64::from(bytes.i16(at::LEFT)?), f64::from(bytes.i16(at::TOP)?)];
    let point = |n: usize| -> Result<[f64; 2]> {
        let mut point = corner;
        for (axis, value) in point.iter_mut().enumerate() {
            if floats {
                *value = bytes.f32(at::COORDINATES + 4 * count + 4 * (axis * count + n))?;
            } else {
                *value += f64::from(bytes.u16(at::COORDINATES + 2 * (axis * count + n))?);
            }
        }
        Ok(point)
    };
    (0..count).map(point).collect()
}

/// Points, each with the slice that its number tells.
fn dots(bytes: Bytes<'_>, counters: usize) -> Result<Vec<([f64; 2], Option<i64>)>> {
    let slice = |n: usize| {
        let told = bytes.i32(counters.checked_add(4 * n)?).ok()?;
        let slice = i64::from(told as u32 >> 8);
        (slice > 0).then_some(slice - 1)
    };
    let points = coordinates(bytes)?.into_iter().enumerate();
    Ok(points.map(|(n, point)| (point, if counters > 0 { slice(n) } else { None })).collect())
}

/// The slice in a name that the ROI Manager made: `0012-0100-0088`, slice, y and x.
fn slice_of_name(name: &str) -> Option<i64> {
    let parts: Vec<&str> = name.split('-').take(4).collect();
    let numbers = |part: &&str| part.len() >= 4 && part.bytes().all(|byte| byte.is_ascii_digit());
    let made = parts.len() >= 3 && parts[..3].iter().all(numbers);
    made.then(|| parts[0].parse().ok()).flatten().filter(|&slice: &i64| slice > 0).map(|slice| slice - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_of_names() {
        assert_eq!(slice_of_name("0012-0100-0088"), Some(11));
        assert_eq!(slice_of_name("0012-0100-0088-1"), Some(11));
        for name in ["0100-0088", "cell 12", "0000-0001-0002", "12-13-14"] {
            assert_eq!(slice_of_name(name), None, "{name}");
        }
    }
}
