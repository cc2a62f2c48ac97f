//! Chunks and shards: their sizes, and how one shard is laid out.
//!
//! Zarr v2 has no shards. There what is called a shard here is one chunk of the array: what comes as chunks is laid side by
//! side and compressed as one. Of large images it is larger than what comes, as it is a file of its own: 64^3 voxels a file
//! make a million of files of a 4096 x 8192 x 8192 image, and 128^3 eight times fewer.
//!
//! A shard (Zarr v3 `sharding_indexed`) is the compressed chunks one after another, then an index: offset and length of
//! each chunk, z slowest, `u64` little-endian, all ones for a chunk that holds only the fill value, and a CRC-32C.

use std::borrow::Cow;
use std::io::Write;

use serde_json::{Value, json};
use zarrs::array::codec::Crc32cCodec;
use zarrs::array::{BytesToBytesCodecTraits, CodecError, CodecOptions};

use super::compression::{Compression, Content, Packing};
use super::files::io_error;
use super::version::OmeVersion;
use crate::error::{Error, Result};
use crate::grid::Box3;
use crate::store::{Element, ElementType};

/// Voxels along a chunk's edge: what a viewer fetches at once.
const CHUNK_EDGE: i64 = 64;
/// Voxels along the edge of a chunk of Zarr v2 of an image that has more voxels than [`MANY_VOXELS`].
const WIDE_EDGE: i64 = 128;
/// 4096 chunks of 64^3.
const MANY_VOXELS: u64 = 1 << 30;

/// The sizes of chunks and shards of one array, `[x, y, z]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ShardLayout {
    /// Voxels of a chunk.
    pub(super) chunk: [i64; 3],
    /// Voxels of a shard: a multiple of the chunk.
    pub(super) shard: [i64; 3],
    /// That of the store: in 0.4 a shard is one chunk of its array.
    pub(super) version: OmeVersion,
}

impl ShardLayout {
    /// Chunks of 64 voxels an edge (or the whole axis where it is shorter) in shards of 256, for wide types 128.
    pub(super) fn new(shape: [i64; 3], element: ElementType, version: OmeVersion) -> Self {
        Self::halved(shape, element, version, 0)
    }

    /// The edges of its shards and of its chunks.
    pub(super) fn edges(&self) -> [[i64; 3]; 2] {
        [self.shard, self.chunk]
    }

    /// The same with shards whose edges are halved so many times, down to one chunk: those of a coarser level then cover as much
    /// of the image as those of the finest, and appear as early.
    pub(super) fn halved(shape: [i64; 3], element: ElementType, version: OmeVersion, times: usize) -> Self {
        let longest = match (version, element.size() <= 2) {
            (OmeVersion::V04, _) if Box3::from_shape(shape).volume() <= MANY_VOXELS => CHUNK_EDGE,
            (OmeVersion::V04, _) | (OmeVersion::V05, false) => WIDE_EDGE,
            (OmeVersion::V05, true) => 256,
        };
        let longest = (longest >> times.min(8)).max(CHUNK_EDGE);
        let chunk = shape.map(|n| n.clamp(1, CHUNK_EDGE));
        let shard = std::array::from_fn(|a| {
            let whole_axis = (shape[a] + chunk[a] - 1) / chunk[a] * chunk[a];
            whole_axis.clamp(chunk[a], longest / chunk[a] * chunk[a])
        });
        Self { chunk, shard, version }
    }

    /// Chunks of a whole shard along each axis.
    fn counts(self) -> [i64; 3] {
        std::array::from_fn(|a| self.shard[a] / self.chunk[a])
    }

    /// Chunks of a whole shard, those beyond the array counted.
    pub(super) fn chunks_in_shard(self) -> usize {
        Box3::from_shape(self.counts()).len()
    }

    /// The shard that holds the chunk which begins at a voxel, as its place among the shards, and the chunk's place in its
    /// index.
    pub(super) fn place_of(self, voxel: [i64; 3]) -> ([i64; 3], usize) {
        let shard: [i64; 3] = std::array::from_fn(|a| voxel[a] / self.shard[a]);
        let chunk = std::array::from_fn(|a| (voxel[a] - shard[a] * self.shard[a]) / self.chunk[a]);
        (shard, Box3::from_shape(self.counts()).offset_of(chunk))
    }
}

/// Bytes of the voxels of one shard of an array, which may wait in memory, compressed, for the last of its chunks.
#[must_use]
pub fn shard_bytes(shape: [i64; 3], element: ElementType) -> u64 {
    Box3::from_shape(ShardLayout::new(shape, element, OmeVersion::V05).shard).volume() * element.size() as u64
}

/// Bytes that a thread holds beside that where the array is one of Zarr v2: a chunk that is laid together, and compressed.
#[must_use]
pub fn joined_bytes(shape: [i64; 3], element: ElementType) -> u64 {
    let layout = ShardLayout::new(shape, element, OmeVersion::V04);
    let [whole, part] = [layout.shard, layout.chunk].map(|edges| Box3::from_shape(edges).volume());
    if whole == part { 0 } else { 2 * whole * element.size() as u64 }
}

/// Encodes the chunks of one array.
#[derive(Clone, Debug)]
pub(super) struct ChunkCodec {
    packing: Packing,
}

impl ChunkCodec {
    pub(super) fn new(
        element: ElementType,
        (content, compression): (Content, Compression),
        version: OmeVersion,
    ) -> Result<Self> {
        Ok(Self { packing: Packing::new(element, content, compression, version)? })
    }

    /// The `codecs` entry of the array's metadata.
    pub(super) fn metadata(&self, layout: ShardLayout) -> Value {
        let [x, y, z] = layout.chunk;
        let bytes = json!({ "name": "bytes", "configuration": { "endian": "little" } });
        let codecs: Vec<Value> = std::iter::once(bytes.clone()).chain(self.packing.description.clone()).collect();
        json!([{
            "name": "sharding_indexed",
            "configuration": {
                "chunk_shape": [z, y, x],
                "codecs": codecs,
                "index_codecs": [bytes, { "name": "crc32c" }],
                "index_location": "end"
            }
        }])
    }

    fn encode(&self, bytes: Vec<u8>) -> Result<Vec<u8>> {
        let Some(codec) = &self.packing.codec else { return Ok(bytes) };
        encode_with(codec.as_ref(), &bytes)
            .map_err(|error| Error::failed(format!("a chunk cannot be compressed: {error}")).caused_by(error))
    }
}

fn encode_with(codec: &dyn BytesToBytesCodecTraits, bytes: &[u8]) -> std::result::Result<Vec<u8>, CodecError> {
    // One thread: the caller already runs one shard per thread.
    let options = CodecOptions::default().with_concurrent_target(1);
    codec.encode(Cow::Borrowed(bytes), &options).map(Cow::into_owned)
}

/// Encodes one chunk, whose voxels inside the array are `values`, dense `[z][y][x]` over `valid`; nothing where all of
/// them hold the fill value. What is to be laid together stays as it is.
pub(super) fn encode_chunk<T: Element>(
    codec: &ChunkCodec,
    layout: ShardLayout,
    valid: &Box3,
    values: &[T],
) -> Result<Option<Vec<u8>>> {
    if values.iter().all(|&value| value == T::default()) {
        return Ok(None);
    }
    let chunk = Box3::from_shape(layout.chunk).translate(valid.lo);
    let mut bytes = Vec::with_capacity(chunk.len() * T::TYPE.size());
    padded_bytes(values, valid, &chunk, &mut bytes);
    if layout.version == OmeVersion::V04 { Ok(Some(bytes)) } else { codec.encode(bytes).map(Some) }
}

/// Writes all chunks of one shard, in the order of its index; returns the bytes written, 0 when all voxels hold the fill
/// value: nothing is written to `sink` then.
pub(super) fn write_shard(
    sink: &mut dyn Write,
    chunks: Vec<Option<Vec<u8>>>,
    layout: ShardLayout,
    codec: &ChunkCodec,
) -> Result<u64> {
    if layout.version == OmeVersion::V05 {
        return write_indexed(sink, &chunks);
    }
    let Some(joined) = joined(chunks, layout) else { return Ok(0) };
    let encoded = codec.encode(joined)?;
    sink.write_all(&encoded).map_err(|error| io_error("a chunk cannot be written", &error))?;
    Ok(encoded.len() as u64)
}

/// The voxels of all chunks of a shard, dense over it; nothing where all of them hold the fill value.
fn joined(mut chunks: Vec<Option<Vec<u8>>>, layout: ShardLayout) -> Option<Vec<u8>> {
    let chunk = Box3::from_shape(layout.chunk);
    let size = chunks.iter().flatten().next()?.len() / chunk.len();
    if let [only] = chunks.as_mut_slice() {
        return only.take();
    }
    let shard = Box3::from_shape(layout.shard);
    let mut joined = vec![0; shard.len() * size];
    let row = layout.chunk[0] as usize * size;
    for (part, bytes) in shard.tiles(layout.chunk).zip(chunks) {
        for ((y, z), bytes) in part.rows().zip(bytes.iter().flat_map(|bytes| bytes.chunks_exact(row))) {
            joined[shard.offset_of([part.lo[0], y, z]) * size..][..row].copy_from_slice(bytes);
        }
    }
    Some(joined)
}

/// Writes encoded chunks one after the other, and their index.
fn write_indexed(sink: &mut dyn Write, chunks: &[Option<Vec<u8>>]) -> Result<u64> {
    let io = |error: std::io::Error| io_error("a shard cannot be written", &error);
    let mut index = Vec::with_capacity(16 * chunks.len());
    let mut offset = 0_u64;
    for chunk in chunks {
        let place = chunk.as_ref().map_or([u64::MAX; 2], |encoded| [offset, encoded.len() as u64]);
        index.extend(place.into_iter().flat_map(u64::to_le_bytes));
        if let Some(encoded) = chunk {
            sink.write_all(encoded).map_err(io)?;
            offset += encoded.len() as u64;
        }
    }
    if offset == 0 {
        return Ok(0);
    }
    let index = encode_with(&Crc32cCodec::new(), &index)
        .map_err(|error| Error::failed(format!("a shard's index cannot be encoded: {error}")).caused_by(error))?;
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
            let found = ShardLayout::new(shape, element, OmeVersion::V05);
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
    }

    #[test]
    fn an_empty_shard_writes_nothing() {
        let valid = Box3::new([64, 0, 0], [100, 10, 10]);
        for version in [OmeVersion::V04, OmeVersion::V05] {
            let layout = ShardLayout::new([100, 10, 10], ElementType::F32, version);
            let codec = ChunkCodec::new(ElementType::F32, (Content::Field, Compression::Fast), version).unwrap();
            assert_eq!(encode_chunk(&codec, layout, &valid, &vec![0.0_f32; valid.len()]).unwrap(), None);
            let mut sink = Vec::new();
            assert_eq!((write_shard(&mut sink, vec![None, None], layout, &codec).unwrap(), sink.len()), (0, 0));
        }
    }

    #[test]
    fn large_images_are_in_fewer_files() {
        let shard = |shape| ShardLayout::new(shape, ElementType::U16, OmeVersion::V04).shard;
        assert_eq!([shard([1024; 3]), shard([1025, 1024, 1024])], [[64; 3], [128; 3]]);
        assert_eq!(
            (joined_bytes([1024; 3], ElementType::U16), joined_bytes([2000; 3], ElementType::U16)),
            (0, 8 << 20)
        );
    }

    #[test]
    fn chunks_are_laid_side_by_side() {
        let layout = ShardLayout { chunk: [2, 1, 1], shard: [4, 2, 1], version: OmeVersion::V04 };
        let chunks = vec![Some(vec![1, 2]), None, Some(vec![3, 4]), Some(vec![5, 6])];
        assert_eq!(joined(chunks, layout), Some(vec![1, 2, 0, 0, 3, 4, 5, 6]));
    }

    #[test]
    fn chunks_know_their_places() {
        let layout = ShardLayout::new([1000, 300, 100], ElementType::F32, OmeVersion::V05);
        assert_eq!((layout.chunks_in_shard(), layout.place_of([0; 3])), (8, ([0; 3], 0)));
        assert_eq!(layout.place_of([192, 128, 64]), ([1, 1, 0], 5));
    }
}
