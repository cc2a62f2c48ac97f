//! How the chunks of an array are packed: by what they hold, and by what the user would rather save, time or room.
//!
//! Measured on chunks of 64^3, one thread: times the bytes became fewer, and MB/s of packing and of unpacking.
//!
//! | chunks | `fast` | `small` | else |
//! | --- | --- | --- | --- |
//! | distance, f32 | 1.47, 1400, 4000: lz4 | 1.64, 160, 2300: blosc zstd 5 | 1.40, 670, 1600: blosc zstd 1 |
//! | level set, f32 | 1.27, 1700, 4200: lz4 | 1.38, 130, 2300: blosc zstd 5 | 1.29, 510, 1400: blosc zstd 1 |
//! | distance, f64 | 2.4, 2200, 4900: lz4 | 2.6, 230, 2700: blosc zstd 5 | |
//! | noisy image, u16 | 2.21, 650, 1100: blosc zstd 1 | 2.31, 200, 1900: blosc zstd 5 | 1.96, 1700, 2600: lz4 of bits |
//! | noisy image, u8 | 2.10, 240, 570: zstd 1 | 2.18, 40, 620: zstd 9 | 1.65, 860, 1300: lz4 of bits |
//! | labels, u8 | 72, 2300, 4200: zstd 1 | 110, 400, 5500: zstd 9 | 18, 3900, 6900: lz4 |
//! | closest points, f32 | 8.8, 530, 1200: zstd 1 | 11.7, 110, 1500: zstd 9 | 3.1, 310, 760: blosc zstd 1 |
//!
//! Blosc groups bytes by significance (shuffle). That helps where neighbours are near each other, and harms where they are
//! the same: coordinates of closest points are those of a few sources over and over. OME-Zarr 0.4 has what the table gives to
//! zstd alone in Blosc too, which all readers of Zarr 2 unpack.

use std::sync::Arc;

use serde_json::{Value, json};
use zarrs::array::BytesToBytesCodecTraits;
use zarrs::array::codec::{BloscCodec, BloscCompressionLevel, BloscCompressor, BloscShuffleMode, ZstdCodec};

use super::version::OmeVersion;
use crate::error::{Error, Result};
use crate::store::ElementType;

/// What is to be saved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Nothing: chunks are stored as they are.
    None,
    /// Time: what packs about as fast as a disk takes it.
    #[default]
    Fast,
    /// Room.
    Small,
}

/// What the voxels of an image are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Grey values, with the noise of a camera.
    Grey,
    /// A smooth field: a distance, a level set.
    Field,
    /// Few different values over and over: labels, coordinates of sources.
    Repeated,
}

/// Packs chunks.
#[derive(Clone, Debug)]
pub(super) struct Packing {
    /// None where chunks are stored as they are.
    pub(super) codec: Option<Arc<dyn BytesToBytesCodecTraits>>,
    /// Its entry in the metadata.
    pub(super) description: Option<Value>,
}

impl Packing {
    /// How chunks of such voxels are packed.
    pub(super) fn new(
        element: ElementType,
        content: Content,
        compression: Compression,
        version: OmeVersion,
    ) -> Result<Self> {
        let grouped = element.size() > 1 && content != Content::Repeated;
        let mode = if grouped { BloscShuffleMode::Shuffle } else { BloscShuffleMode::NoShuffle };
        match (compression, grouped) {
            (Compression::None, _) => Ok(Self { codec: None, description: None }),
            (Compression::Fast, false) if version == OmeVersion::V05 => Ok(Self::zstd(1)),
            (Compression::Small, false) if version == OmeVersion::V05 => Ok(Self::zstd(9)),
            (Compression::Fast, true) if content == Content::Field => Self::blosc("lz4", 5, element, mode),
            (Compression::Fast, _) => Self::blosc("zstd", 1, element, mode),
            (Compression::Small, _) => Self::blosc("zstd", 5, element, mode),
        }
    }

    fn zstd(level: i32) -> Self {
        let description = json!({ "name": "zstd", "configuration": { "level": level, "checksum": false } });
        Self { codec: Some(Arc::new(ZstdCodec::new(level, false))), description: Some(description) }
    }

    fn blosc(name: &str, level: u8, element: ElementType, mode: BloscShuffleMode) -> Result<Self> {
        let size = element.size();
        let compressor = if name == "lz4" { BloscCompressor::LZ4 } else { BloscCompressor::Zstd };
        let clevel = BloscCompressionLevel::try_from(level).map_err(|_| Error::failed("blosc has no such level"))?;
        let codec = BloscCodec::new(compressor, clevel, None, mode, Some(size)).map_err(|error| {
            Error::failed(format!("the blosc compressor is not available: {error}")).caused_by(error)
        })?;
        let shuffle = if mode == BloscShuffleMode::Shuffle { "shuffle" } else { "noshuffle" };
        let description = json!({
            "name": "blosc",
            "configuration": { "cname": name, "clevel": level, "shuffle": shuffle, "typesize": size, "blocksize": 0 }
        });
        Ok(Self { codec: Some(Arc::new(codec)), description: Some(description) })
    }
}
