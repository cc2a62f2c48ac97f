//! Writes small TIFF files by hand, byte by byte, so that readers meet files no library has touched.

/// A tag with its values: shorts, longs or text.
#[derive(Clone)]
pub(crate) enum Value {
    Short(Vec<u16>),
    Long(Vec<u32>),
    Text(String),
    Rational(u32, u32),
}

/// One page: its tags but for the strip or tile tables, and the bytes of its strips or tiles.
#[derive(Clone)]
pub(crate) struct PageBytes {
    pub(crate) tags: Vec<(u16, Value)>,
    pub(crate) chunks: Vec<Vec<u8>>,
    pub(crate) tiled: bool,
}

/// A gray page in one strip.
pub(crate) fn gray_page(width: u32, height: u32, bits: u16, data: Vec<u8>) -> PageBytes {
    let tags = vec![
        (256, Value::Long(vec![width])),
        (257, Value::Long(vec![height])),
        (258, Value::Short(vec![bits])),
        (259, Value::Short(vec![1])),
        (262, Value::Short(vec![1])),
        (277, Value::Short(vec![1])),
        (278, Value::Long(vec![height])),
    ];
    PageBytes { tags, chunks: vec![data], tiled: false }
}

impl PageBytes {
    /// Sets or replaces a tag.
    pub(crate) fn with(mut self, tag: u16, value: Value) -> Self {
        self.tags.retain(|(t, _)| *t != tag);
        self.tags.push((tag, value));
        self
    }
}

/// The bytes of 16-bit samples.
pub(crate) fn bytes_u16(values: &[u16], big_endian: bool) -> Vec<u8> {
    values.iter().flat_map(|v| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() }).collect()
}

/// Numbers of a file in its byte order.
struct Out {
    bytes: Vec<u8>,
    big_endian: bool,
}

impl Out {
    fn short(&mut self, v: u16) {
        self.bytes.extend(if self.big_endian { v.to_be_bytes() } else { v.to_le_bytes() });
    }

    fn long(&mut self, v: u32) {
        self.bytes.extend(if self.big_endian { v.to_be_bytes() } else { v.to_le_bytes() });
    }

    /// Writes values behind what is there and returns `(field type, count, offset or the value itself)`.
    fn value(&mut self, value: &Value) -> (u16, u32, [u8; 4]) {
        let mut part = Out { bytes: Vec::new(), big_endian: self.big_endian };
        let (kind, count) = match value {
            Value::Short(v) => {
                for &n in v {
                    part.short(n);
                }
                (3, v.len())
            }
            Value::Long(v) => {
                for &n in v {
                    part.long(n);
                }
                (4, v.len())
            }
            Value::Text(text) => {
                part.bytes.extend(text.bytes().chain([0]));
                (2, part.bytes.len())
            }
            Value::Rational(n, d) => {
                part.long(*n);
                part.long(*d);
                (5, 1)
            }
        };
        let mut field = [0; 4];
        if part.bytes.len() <= 4 {
            field[..part.bytes.len()].copy_from_slice(&part.bytes);
        } else {
            let offset = self.bytes.len() as u32;
            self.bytes.extend(&part.bytes);
            field = if self.big_endian { offset.to_be_bytes() } else { offset.to_le_bytes() };
        }
        (kind, count as u32, field)
    }
}

/// A classic TIFF file of these pages.
pub(crate) fn tiff_file(pages: &[PageBytes], big_endian: bool) -> Vec<u8> {
    let mut out = Out { bytes: if big_endian { b"MM".to_vec() } else { b"II".to_vec() }, big_endian };
    out.short(42);
    let mut link = out.bytes.len();
    out.long(0);
    for page in pages {
        let offsets = page.chunks.iter().map(|chunk| {
            let at = out.bytes.len() as u32;
            out.bytes.extend(chunk);
            at
        });
        let offsets: Vec<u32> = offsets.collect();
        let counts = page.chunks.iter().map(|c| c.len() as u32).collect();
        let mut tags = page.tags.clone();
        tags.push((if page.tiled { 324 } else { 273 }, Value::Long(offsets)));
        tags.push((if page.tiled { 325 } else { 279 }, Value::Long(counts)));
        tags.sort_by_key(|(tag, _)| *tag);
        let entries: Vec<_> = tags.iter().map(|(tag, value)| (*tag, out.value(value))).collect();
        let here = out.bytes.len() as u32;
        out.bytes[link..link + 4].copy_from_slice(&if big_endian { here.to_be_bytes() } else { here.to_le_bytes() });
        out.short(entries.len() as u16);
        for (tag, (kind, count, field)) in entries {
            out.short(tag);
            out.short(kind);
            out.long(count);
            out.bytes.extend(field);
        }
        link = out.bytes.len();
        out.long(0);
    }
    out.bytes
}
