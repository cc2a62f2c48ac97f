//! Chunks and shards: their sizes, and how one shard is laid out and compressed.
//!
//! A shard (Zarr v3 `sharding_indexed`) is the compressed chunks one after another, then an index: offset and length of
//! each chunk, z slowest, `u64` little-endian, all ones for a chunk that holds only the fill value, and a CRC-32C.

use std::borrow::Cow;
use std::io::Write;
use std::sync::Arc;

use serde_json::{Value, json};
use zarrs::array::codec::{
    BloscCodec, BloscCompressionLevel, BloscCompressor, BloscShuffleMode, Crc32cCodec, ZstdCodec,
};
use zarrs::array::{BytesToBytesCodecTraits, CodecError, CodecOptions};

use super::files::io_error;
use crate::error::{Error, Result};
use crate::grid::Box3;
use crate::store::{Element, ElementType};

/// Voxels along a chunk's edge: what a viewer fetches at once.
const CHUNK_EDGE: i64 = 64;

/// The sizes of chunks and shards of one array, `[x, y, z]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ShardLayout {
    /// Voxels of a chunk.
    pub(super) chunk: [i64; 3],
    /// Voxels of a shard: a multiple of the chunk.
    pub(super) shard: [i64; 3],
}

impl ShardLayout {
    /// Chunks of 64 voxels an edge (or the whole axis where it is shorter) in shards of 256, for wide types 128.
    pub(super) fn new(shape: [i64; 3], element: ElementType) -> Self {
        let longest = if element.size() <= 2 { 256 } else { 128 };
        let chunk = shape.map(|n| n.clamp(1, CHUNK_EDGE));
        let shard = std::array::from_fn(|a| {
            let whole_axis = (shape[a] + chunk[a] - 1) / chunk[a] * chunk[a];
            whole_axis.clamp(chunk[a], longest / chunk[a] * chunk[a])
        });
        Self { chunk, shard }
    }

    /// Places of a shard's chunks from the shard's first voxel on, in the order of the index.
    fn chunks(self) -> impl Iterator<Item = Box3> {
        let counts: [i64; 3] = std::array::from_fn(|a| self.shard[a] / self.chunk[a]);
        let chunk = Box3::from_shape(self.chunk);
        Box3::from_shape(counts)
            .rows()
            .flat_map(move |(y, z)| (0..counts[0]).map(move |x| [x, y, z]))
            .map(move |at| chunk.translate(std::array::from_fn(|a| at[a] * self.chunk[a])))
    }
}

/// Compresses the chunks of one array: plain Zstandard for single bytes, bytes grouped by significance (blosc's
/// shuffle) and Zstandard for wider types. Measured on noisy images, distances and labels, both at their first level:
/// plain packs noisy 8-bit images by 1.43 against blosc's 1.30, shuffled noise of 16 bit by 2.0 against 1.6, distances
/// by 1.34 against 1.15; higher levels cost two to five times the time for a few per cent.
#[derive(Clone, Debug)]
pub(super) struct ChunkCodec {
    compressor: Arc<dyn BytesToBytesCodecTraits>,
    description: Value,
}

/// Compression level of Zstandard.
const LEVEL: u8 = 1;

impl ChunkCodec {
    pub(super) fn new(element: ElementType) -> Result<Self> {
        let size = element.size();
        if size == 1 {
            let description = json!({ "name": "zstd", "configuration": { "level": LEVEL, "checksum": false } });
            return Ok(Self { compressor: Arc::new(ZstdCodec::new(LEVEL.into(), false)), description });
        }
        let level = BloscCompressionLevel::try_from(LEVEL).map_err(|_| Error::failed("blosc has no such level"))?;
        let blosc = BloscCodec::new(BloscCompressor::Zstd, level, None, BloscShuffleMode::Shuffle, Some(size))
            .map_err(|error| Error::failed(format!("the blosc compressor is not available: {error}")))?;
        let description = json!({
            "name": "blosc",
            "configuration": { "cname": "zstd", "clevel": LEVEL, "shuffle": "shuffle", "typesize": size, "blocksize": 0 }
        });
        Ok(Self { compressor: Arc::new(blosc), description })
    }

    /// The `codecs` entry of the array's metadata.
    pub(super) fn metadata(&self, layout: ShardLayout) -> Value {
        let [x, y, z] = layout.chunk;
        let bytes = json!({ "name": "bytes", "configuration": { "endian": "little" } });
        json!([{
            "name": "sharding_indexed",
            "configuration": {
                "chunk_shape": [z, y, x],
                "codecs": [bytes, self.description],
                "index_codecs": [bytes, { "name": "crc32c" }],
                "index_location": "end"
            }
        }])
    }

    fn encode(&self, bytes: &[u8]) -> Result<Vec<u8>> {
        encode_with(self.compressor.as_ref(), bytes)
            .map_err(|error| Error::failed(format!("a chunk cannot be compressed: {error}")))
    }
}

fn encode_with(codec: &dyn BytesToBytesCodecTraits, bytes: &[u8]) -> std::result::Result<Vec<u8>, CodecError> {
    // One thread: the caller already runs one shard per thread.
    let options = CodecOptions::default().with_concurrent_target(1);
    codec.encode(Cow::Borrowed(bytes), &options).map(Cow::into_owned)
}

/// Encodes one shard into `sink`, chunk by chunk; returns the bytes written, 0 when all voxels hold the fill value.
///
/// `part` is the shard's box inside the array; `fill` writes the voxels of a box inside `part`, dense `[z][y][x]`.
/// Nothing is written to `sink` when there is nothing but the fill value.
pub(super) fn write_shard<T: Element>(
    sink: &mut dyn Write,
    codec: &ChunkCodec,
    layout: ShardLayout,
    part: &Box3,
    fill: &mut dyn FnMut(&Box3, &mut [T]) -> Result<()>,
) -> Result<u64> {
    let io = |error: std::io::Error| io_error("a shard cannot be written", &error);
    let mut index = Vec::new();
    let mut offset = 0_u64;
    let chunk_len = Box3::from_shape(layout.chunk).len();
    let mut dense = vec![T::default(); chunk_len];
    let mut bytes = Vec::with_capacity(chunk_len * T::TYPE.size());
    for chunk in layout.chunks() {
        let chunk = chunk.translate(part.lo);
        let valid = chunk.intersect(part);
        let values = &mut dense[..valid.len()];
        let mut encoded = Vec::new();
        if !valid.is_empty() {
            fill(&valid, values)?;
            if values.iter().any(|&value| value != T::default()) {
                padded_bytes(values, &valid, &chunk, &mut bytes);
                encoded = codec.encode(&bytes)?;
            }
        }
        let length = encoded.len() as u64;
        index.extend(if length == 0 { [u64::MAX; 2] } else { [offset, length] });
        sink.write_all(&encoded).map_err(io)?;
        offset += length;
    }
    if offset == 0 {
        return Ok(0);
    }
    let index: Vec<u8> = index.into_iter().flat_map(u64::to_le_bytes).collect();
    let index = encode_with(&Crc32cCodec::new(), &index)
        .map_err(|error| Error::failed(format!("a shard's index cannot be encoded: {error}")))?;
    sink.write_all(&index).map_err(io)?;
    Ok(offset + index.len() as u64)
}

/// The bytes of a whole chunk whose voxels inside the array are `values`; beyond it lies the fill value.
fn padded_bytes<T: Element>(values: &[T], valid: &Box3, chunk: &Box3, bytes: &mut Vec<u8>) {
    bytes.clear();
    let size = T::TYPE.size();
    let [nx, ny, _] = valid.shape().map(|n| n as usize);
    let [chunk_x, chunk_y, chunk_z] = chunk.shape().map(|n| n as usize);
    for plane in values.chunks(nx * ny) {
        let first = bytes.len();
        for row in plane.chunks(nx) {
            let start = bytes.len();
            T::append_bytes(row, bytes);
            bytes.resize(start + chunk_x * size, 0);
        }
        bytes.resize(first + chunk_x * chunk_y * size, 0);
    }
    bytes.resize(chunk_x * chunk_y * chunk_z * size, 0);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_follow_shape_and_type() {
        let layout = |shape, element| {
            let found = ShardLayout::new(shape, element);
            (found.chunk, found.shard)
        };
        assert_eq!(layout([1000, 300, 256], ElementType::U8), ([64; 3], [256; 3]));
        assert_eq!(layout([1000, 300, 100], ElementType::F32), ([64; 3], [128; 3]));
        // A short axis is one chunk; shards never reach further than the last chunk.
        assert_eq!(layout([512, 70, 58], ElementType::U16), ([64, 64, 58], [256, 128, 58]));
        assert_eq!(layout([1, 7, 65], ElementType::F64), ([1, 7, 64], [1, 7, 128]));
    }

    #[test]
    fn bytes_are_little_endian_and_padded() {
        let (valid, chunk) = (Box3::new([4, 0, 0], [6, 2, 1]), Box3::new([4, 0, 0], [7, 3, 2]));
        let mut bytes = Vec::new();
        padded_bytes(&[1_u16, 2, 3, 0x0405], &valid, &chunk, &mut bytes);
        let expected = [[1, 0, 2, 0, 0, 0], [3, 0, 5, 4, 0, 0], [0; 6], [0; 6], [0; 6], [0; 6]];
        assert_eq!(bytes, expected.concat());
        let mut bytes = Vec::new();
        append_bytes(&[-1.5_f64], &mut bytes);
        assert_eq!(bytes, (-1.5_f64).to_le_bytes());
    }

    #[test]
    fn an_empty_shard_writes_nothing() {
        let layout = ShardLayout::new([100, 10, 10], ElementType::F32);
        let codec = ChunkCodec::new(ElementType::F32).unwrap();
        let mut sink = Vec::new();
        let part = Box3::from_shape([100, 10, 10]);
        let mut seen = 0;
        let written = write_shard::<f32>(&mut sink, &codec, layout, &part, &mut |part, out| {
            seen += part.len();
            out.fill(0.0);
            Ok(())
        });
        assert_eq!((written.unwrap(), sink.len(), seen), (0, 0, 10_000));
    }
}
