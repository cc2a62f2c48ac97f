//! The header of a PLY file (Turk 1994): which elements follow, how many of each, and what each is made of.

use std::io::BufRead;

use crate::error::{Error, Result};
use crate::io::text::{next_line, quoted};

/// The longest header that is read.
const LONGEST: u64 = 1 << 20;

/// How the numbers after the header are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Encoding {
    Ascii,
    Little,
    Big,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "int64" => Self::I64,
            "uint64" => Self::U64,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of one number.
    pub(crate) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number in exactly [`Scalar::size`] bytes of the given encoding.
    pub(crate) fn decode(self, bytes: &[u8], encoding: Encoding) -> f64 {
        let mut word = [0; 8];
        word[..bytes.len()].copy_from_slice(bytes);
        if encoding == Encoding::Big {
            word[..bytes.len()].reverse();
        }
        let [a, b, c, d, ..] = word;
        match self {
            Self::I8 => f64::from(i8::from_le_bytes([a])),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::I64 => i64::from_le_bytes(word) as f64,
            Self::U64 => u64::from_le_bytes(word) as f64,
            Self::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::F64 => f64::from_le_bytes(word),
        }
    }
}

/// One property of an element: a number, or a list that starts with its length.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Property {
    pub(crate) name: String,
    pub(crate) item: Scalar,
    /// The type of the length, for a list.
    pub(crate) list: Option<Scalar>,
}

/// One kind of element, such as the vertices.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) count: u64,
    pub(crate) properties: Vec<Property>,
}

impl Element {
    /// The fewest bytes that one element takes: lists may be empty, numbers in text are a digit and a blank.
    pub(crate) fn least_bytes(&self, encoding: Encoding) -> u64 {
        let least = |p: &Property| if encoding == Encoding::Ascii { 2 } else { p.list.unwrap_or(p.item).size() };
        self.properties.iter().map(|p| least(p) as u64).sum()
    }

    /// True when every element takes the same number of bytes in a binary file.
    pub(crate) fn has_fixed_size(&self) -> bool {
        self.properties.iter().all(|p| p.list.is_none())
    }
}

/// What a PLY file says about itself.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Header {
    pub(crate) encoding: Encoding,
    pub(crate) elements: Vec<Element>,
    /// Bytes of the header, its last line end included.
    pub(crate) bytes: u64,
    /// Lines of the header.
    pub(crate) lines: u64,
}

impl Header {
    /// Reads up to and with the line `end_header`.
    pub(crate) fn read(reader: &mut impl BufRead) -> Result<Self> {
        let mut header = Self { encoding: Encoding::Ascii, elements: Vec::new(), bytes: 0, lines: 0 };
        let mut encoding = None;
        let mut line = Vec::new();
        loop {
            header.lines += 1;
            if header.bytes > LONGEST || !next_line(reader, &mut line, header.lines)? {
                return Err(Error::input(
                    "is a PLY file whose header has no end_header; the file is cut off or damaged",
                ));
            }
            header.bytes += line.len() as u64;
            let text = String::from_utf8_lossy(&line);
            let words: Vec<&str> = text.split_whitespace().collect();
            match words[..] {
                ["ply"] if header.lines == 1 => {}
                [] | ["comment" | "obj_info", ..] => {}
                ["format", name, _] => encoding = Some(encoding_named(name).ok_or_else(|| bad(header.lines, &text))?),
                ["element", name, count] => header.add_element(name, count, &text)?,
                ["property", ref rest @ ..] => header.add_property(rest, &text)?,
                ["end_header"] => break,
                _ => return Err(bad(header.lines, &text)),
            }
        }
        header.encoding = encoding.ok_or_else(|| Error::input("is a PLY file whose header names no format"))?;
        Ok(header)
    }

    /// An element as a message names it: how many of what.
    pub(crate) fn declared(element: &Element) -> String {
        match element.name.as_str() {
            "vertex" => format!("{} vertices", element.count),
            "face" => format!("{} faces", element.count),
            "tristrips" => format!("{} lists of strips", element.count),
            name => format!("{} elements {}", element.count, quoted(name)),
        }
    }

    fn add_element(&mut self, name: &str, count: &str, text: &str) -> Result<()> {
        let count = count.parse().map_err(|_| bad(self.lines, text))?;
        if self.elements.iter().any(|e| e.name == name) {
            return Err(Error::input(format!("line {} names the element {} again", self.lines, quoted(name))));
        }
        self.elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
        Ok(())
    }

    fn add_property(&mut self, words: &[&str], text: &str) -> Result<()> {
        let property = match *words {
            ["list", length, item, name] => {
                Scalar::named(length).zip(Scalar::named(item)).map(|(length, item)| (item, Some(length), name))
            }
            [item, name] => Scalar::named(item).map(|item| (item, None, name)),
            _ => None,
        };
        let (item, list, name) = property.ok_or_else(|| bad(self.lines, text))?;
        let element = self.elements.last_mut().ok_or_else(|| bad(self.lines, text))?;
        element.properties.push(Property { name: name.to_owned(), item, list });
        Ok(())
    }
}

fn encoding_named(name: &str) -> Option<Encoding> {
    match name {
        "ascii" => Some(Encoding::Ascii),
        "binary_little_endian" => Some(Encoding::Little),
        "binary_big_endian" => Some(Encoding::Big),
        _ => None,
    }
}

fn bad(line: u64, text: &str) -> Error {
    Error::input(format!("line {line} of the PLY header, {}, is not understood; write the file anew", quoted(text)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_with_lists() {
        let text = b"ply\r\nformat binary_big_endian 1.0\r\ncomment x y\r\nelement face 7\r\n\
            property list uchar int vertex_indices\r\nelement vertex 3\r\nproperty double x\r\nend_header\r\n123";
        let mut reader = &text[..];
        let header = Header::read(&mut reader).unwrap();
        assert_eq!(reader, b"123");
        assert_eq!((header.bytes, header.lines), (text.len() as u64 - 3, 8));
        assert_eq!(header.encoding, Encoding::Big);
        assert_eq!((header.elements[0].least_bytes(Encoding::Big), header.elements[0].has_fixed_size()), (1, false));
        assert_eq!((header.elements[1].least_bytes(Encoding::Big), header.elements[1].count), (8, 3));
    }

    #[test]
    fn numbers_of_all_types() {
        let both = |scalar: Scalar, little: &[u8]| {
            let big: Vec<u8> = little.iter().rev().copied().collect();
            let value = scalar.decode(little, Encoding::Little);
            assert_eq!(value, scalar.decode(&big, Encoding::Big));
            assert_eq!(scalar.size(), little.len());
            value
        };
        assert_eq!(both(Scalar::I8, &[0xfe]), -2.0);
        assert_eq!(both(Scalar::U8, &[0xfe]), 254.0);
        assert_eq!(both(Scalar::I16, &(-300_i16).to_le_bytes()), -300.0);
        assert_eq!(both(Scalar::U16, &65_000_u16.to_le_bytes()), 65_000.0);
        assert_eq!(both(Scalar::I32, &(-70_000_i32).to_le_bytes()), -70_000.0);
        assert_eq!(both(Scalar::U32, &u32::MAX.to_le_bytes()), f64::from(u32::MAX));
        assert_eq!(both(Scalar::F32, &1.5_f32.to_le_bytes()), 1.5);
        assert_eq!(both(Scalar::F64, &0.1_f64.to_le_bytes()), 0.1);
    }
}
