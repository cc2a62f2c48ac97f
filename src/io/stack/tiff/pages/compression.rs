//! The compression methods of TIFF files: their tag values, names and greatest gains.

/// How strips and tiles are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compression {
    None,
    Fax4,
    Lzw,
    /// The tag's value: 8 or, in old files, 32946.
    Deflate(u16),
    PackBits,
    Zstd,
    /// Any other, refused when the page is read.
    Other(u16),
}

impl Compression {
    /// The method for the value of the Compression tag.
    pub(crate) fn from_tag(value: u64) -> Self {
        match value {
            1 => Self::None,
            4 => Self::Fax4,
            5 => Self::Lzw,
            8 | 32946 => Self::Deflate(value as u16),
            32773 => Self::PackBits,
            50000 => Self::Zstd,
            other => Self::Other(other as u16),
        }
    }

    /// The value of the Compression tag.
    pub(crate) fn tag(self) -> u16 {
        match self {
            Self::None => 1,
            Self::Fax4 => 4,
            Self::Lzw => 5,
            Self::Deflate(tag) | Self::Other(tag) => tag,
            Self::PackBits => 32773,
            Self::Zstd => 50000,
        }
    }

    /// Its usual name.
    pub(crate) fn name(self) -> String {
        let name = match self.tag() {
            1 => "none",
            2 => "CCITT modified Huffman",
            3 => "CCITT fax group 3",
            4 => "CCITT fax group 4",
            5 => "LZW",
            6 | 7 => "JPEG",
            8 | 32946 => "deflate",
            32773 => "PackBits",
            33003 | 33005 | 33007 | 34712 => "JPEG 2000",
            34676 | 34677 => "SGI LogLuv",
            34887 => "LERC",
            34925 => "LZMA",
            50000 => "zstd",
            50001 => "WebP",
            50002 | 52546 => "JPEG XL",
            other => return format!("method {other}"),
        };
        name.to_string()
    }

    /// The largest ratio of unpacked to packed bytes the method can reach, rounded up: no page can honestly claim more.
    pub(crate) fn max_expansion(self) -> u64 {
        match self {
            Self::None => 1,
            Self::PackBits => 64,
            Self::Deflate(_) => 1100,
            Self::Lzw => 4096,
            Self::Zstd | Self::Fax4 | Self::Other(_) => 1 << 16,
        }
    }
}
