//! One page: its size, sample type and the places of its strips or tiles (TIFF 6.0 sections 3, 7, 15).
//!
//! Declared sizes are compared with the length of the file before anything is allocated.

use super::compression::Compression;
use super::ifd::Tags;
use super::samples::SampleKind;
use crate::error::Result;
use crate::io::stack::number::ByteOrder;

/// The most bytes one compressed strip or tile may have, packed or unpacked; both are held in memory once per thread.
pub(crate) const MAX_CHUNK: u64 = 256 << 20;
/// The most strips or tiles of a page; a page of 100 000 x 100 000 in tiles of 64 x 64 has 2.4 million.
const MAX_CHUNKS: u64 = 4 << 20;

/// What all pages of a stack must have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Kind {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) sample: SampleKind,
    /// Samples per pixel.
    pub(crate) samples: u16,
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} x {} {}", self.width, self.height, self.sample.name())?;
        if self.samples > 1 { write!(f, " with {} samples", self.samples) } else { Ok(()) }
    }
}

/// Where one strip or tile lies in the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chunk {
    pub(crate) offset: u64,
    pub(crate) bytes: u64,
}

/// One page.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Page {
    pub(crate) kind: Kind,
    /// Number of the page, counted from 1, for messages.
    pub(crate) number: usize,
    pub(crate) order: ByteOrder,
    /// Samples of a pixel lie in separate planes (`PlanarConfiguration` 2).
    pub(crate) planar: bool,
    pub(crate) compression: Compression,
    /// The Predictor tag: 1 none, 2 horizontal difference, 3 floating point.
    pub(crate) predictor: u16,
    /// `FillOrder` 2: the bits of every byte are stored in reverse.
    pub(crate) reversed_bits: bool,
    pub(crate) tiled: bool,
    /// Width and height of a strip or tile.
    pub(crate) chunk: [u32; 2],
}

/// True for pages that are no part of a stack: previews (`NewSubfileType` bit 0) and masks (bit 2).
pub(crate) fn is_side_page(tags: &Tags) -> Result<bool> {
    Ok(tags.number(254)?.is_some_and(|flags| flags & 5 != 0) || tags.number(255)? == Some(2))
}

impl Page {
    /// Reads the tags that say how the page is stored, and refuses what cannot be read.
    pub(crate) fn parse(tags: &Tags) -> Result<Self> {
        let kind = kind_of(tags)?;
        let height = kind.height;
        let tiled = tags.number(322)?.is_some();
        let chunk = if tiled {
            [tags.require(322, "TileWidth")?, tags.require(323, "TileLength")?]
        } else {
            [u64::from(kind.width), tags.number(278)?.unwrap_or(u64::from(height)).min(u64::from(height))]
        };
        let [Ok(w @ 1..), Ok(h @ 1..)] = chunk.map(u32::try_from) else {
            return Err(tags.error(format!("strips or tiles of {} x {} pixels make no sense", chunk[0], chunk[1])));
        };
        let page = Self {
            kind,
            number: tags.page,
            order: tags.file.order,
            planar: kind.samples > 1 && tags.number(284)? == Some(2),
            compression: Compression::from_tag(tags.number(259)?.unwrap_or(1)),
            predictor: tags.number(317)?.unwrap_or(1) as u16,
            reversed_bits: tags.number(266)? == Some(2),
            tiled,
            chunk: [w, h],
        };
        page.refuse_unreadable(tags)?;
        page.refuse_oversized(tags)?;
        Ok(page)
    }

    fn refuse_unreadable(&self, tags: &Tags) -> Result<()> {
        if let Compression::Other(_) = self.compression {
            return Err(tags.error(format!(
                "{} compression is not supported; save it uncompressed or with LZW, deflate or zstd",
                self.compression.name()
            )));
        }
        if self.compression == Compression::Fax4 && (self.kind.samples > 1 || self.kind.sample.bits() != 1) {
            return Err(tags.error("CCITT fax compression is for one bit per pixel only"));
        }
        if self.compression == Compression::Fax4 && self.chunk.iter().any(|&n| n > u32::from(u16::MAX)) {
            return Err(tags.error("CCITT fax strips of over 65535 rows or columns are not supported"));
        }
        let fits = match self.predictor {
            1 => true,
            // Readers do not agree whether uncompressed values are differences (TIFF 6.0 speaks of LZW alone).
            _ if matches!(self.compression, Compression::None | Compression::Fax4) => false,
            2 => matches!(self.kind.sample.bits(), 8 | 16 | 32 | 64),
            3 => self.kind.sample.is_float(),
            _ => false,
        };
        if !fits {
            let (p, name, method) = (self.predictor, self.kind.sample.name(), self.compression.name());
            return Err(tags.error(format!(
                "predictor {p} is not supported for {name} samples with compression {method}; save it without predictor"
            )));
        }
        if tags.number(32997)?.unwrap_or(1) > 1 || tags.number(32998)?.unwrap_or(1) > 1 {
            return Err(tags.error("tiles with a depth of their own are not supported; save one page per plane"));
        }
        Ok(())
    }

    /// Compares what the page declares with what the file can hold.
    fn refuse_oversized(&self, tags: &Tags) -> Result<()> {
        let bytes = self.plane_bytes().saturating_mul(if self.planar { u64::from(self.kind.samples) } else { 1 });
        let len = tags.file.len;
        if bytes / self.compression.max_expansion() > len {
            return Err(tags.error(format!(
                "{} need {bytes} bytes, more than the whole file ({len} bytes) can hold: it is truncated or damaged",
                self.kind
            )));
        }
        let held = if self.compression == Compression::None {
            self.row_bytes()
        } else {
            self.row_bytes().saturating_mul(u64::from(self.chunk[1]))
        };
        if held > MAX_CHUNK {
            return Err(tags.error(format!(
                "one {} has {held} bytes, over the limit of {} MiB; save it uncompressed or in smaller strips or tiles",
                if self.compression == Compression::None { "row" } else { "compressed strip or tile" },
                MAX_CHUNK >> 20
            )));
        }
        if self.chunks_across().saturating_mul(self.chunks_down()) > MAX_CHUNKS {
            return Err(tags.error(format!("over {MAX_CHUNKS} strips or tiles; save it in larger ones")));
        }
        Ok(())
    }

    /// Samples of a pixel that lie next to each other.
    pub(crate) fn interleaved(&self) -> u16 {
        if self.planar { 1 } else { self.kind.samples }
    }

    /// Bytes of one row of a strip or tile.
    pub(crate) fn row_bytes(&self) -> u64 {
        self.bytes_of_row(self.chunk[0])
    }

    fn bytes_of_row(&self, width: u32) -> u64 {
        let bits = u64::from(self.interleaved()) * u64::from(self.kind.sample.bits());
        (u64::from(width) * bits).div_ceil(8)
    }

    /// Bytes of all rows without tile padding (of one sample when they lie apart).
    pub(crate) fn plane_bytes(&self) -> u64 {
        self.bytes_of_row(self.kind.width).saturating_mul(u64::from(self.kind.height))
    }

    /// Strips or tiles side by side.
    pub(crate) fn chunks_across(&self) -> u64 {
        u64::from(self.kind.width.div_ceil(self.chunk[0]))
    }

    /// Strips or tiles one below the other.
    pub(crate) fn chunks_down(&self) -> u64 {
        u64::from(self.kind.height.div_ceil(self.chunk[1]))
    }

    /// The strips or tiles that hold sample `sample`, row by row.
    pub(crate) fn chunks(&self, tags: &Tags, sample: u16) -> Result<Vec<Chunk>> {
        let per_plane = self.chunks_across() * self.chunks_down();
        let planes = if self.planar { u64::from(self.kind.samples) } else { 1 };
        let most = per_plane * planes;
        let (name, offset_tag, count_tag) = if self.tiled { ("tile", 324, 325) } else { ("strip", 273, 279) };
        let Some(offsets) = tags.list(offset_tag, most.max(1 << 16))? else {
            return Err(tags.error(format!("it has no {name} offsets (tag {offset_tag})")));
        };
        let counts = match tags.list(count_tag, most.max(1 << 16))? {
            Some(counts) => counts,
            // Old writers leave the sizes out of uncompressed pages, where they follow from the geometry.
            None if self.compression == Compression::None => vec![0; offsets.len()],
            None => return Err(tags.error(format!("it has no {name} sizes (tag {count_tag})"))),
        };
        if (offsets.len() as u64) < most || (counts.len() as u64) < most {
            let found = offsets.len().min(counts.len());
            return Err(tags.error(format!("{most} {name}s are needed but only {found} are listed")));
        }
        let first = if self.planar { usize::from(sample) * per_plane as usize } else { 0 };
        let pick = first..first + per_plane as usize;
        Ok(offsets[pick.clone()].iter().zip(&counts[pick]).map(|(&offset, &bytes)| Chunk { offset, bytes }).collect())
    }
}

/// Size and type of the pixels of a page.
pub(crate) fn kind_of(tags: &Tags) -> Result<Kind> {
    let (width, height) = (tags.require(256, "ImageWidth")?, tags.require(257, "ImageLength")?);
    let (Ok(w @ 1..), Ok(h @ 1..)) = (u32::try_from(width), u32::try_from(height)) else {
        return Err(tags.error(format!("a page of {width} x {height} pixels makes no sense")));
    };
    let samples = tags.number(277)?.unwrap_or(1);
    let bits = tags.list(258, 1 << 16)?.unwrap_or_else(|| vec![1]);
    let formats = tags.list(339, 1 << 16)?.unwrap_or_else(|| vec![1]);
    let (Some(&bit), Some(&format), Ok(samples @ 1..)) = (bits.first(), formats.first(), u16::try_from(samples)) else {
        return Err(tags.error("bits, format or number of samples are empty"));
    };
    if bits.iter().any(|b| *b != bit) || formats.iter().any(|f| *f != format) {
        return Err(tags.error("samples of different types in one pixel are not supported"));
    }
    refuse_colour_space(tags)?;
    let sample = SampleKind::new(format, bit).map_err(|reason| tags.error(reason))?;
    Ok(Kind { width: w, height: h, sample, samples })
}

/// Colours that are no plain intensities cannot be handed out as channels. Palette indices and masks can, as stored.
fn refuse_colour_space(tags: &Tags) -> Result<()> {
    let name = match tags.number(262)?.unwrap_or(1) {
        0..=5 => return Ok(()),
        6 => "YCbCr".to_string(),
        8..=10 => "L*a*b*".to_string(),
        32803 => "colour filter array".to_string(),
        32844 | 32845 => "LogLuv".to_string(),
        other => format!("photometric interpretation {other}"),
    };
    Err(tags.error(format!("{name} pixels are not supported; save it as gray values or RGB")))
}
