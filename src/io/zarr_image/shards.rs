//! Shards: files of many chunks with an index of where each of them lies (Zarr v3, codec `sharding_indexed`).

use std::borrow::Cow;
use std::num::NonZeroU64;
use std::ops::Range;

use zarrs::array::{
    ArrayToBytesCodecTraits, BytesRepresentation, CodecChain, CodecMetadataOptions, FillValue, data_type,
};
use zarrs::metadata::v3::MetadataV3;

use super::codecs::{Codecs, ValueType, bytes_of, one_line, options};

/// The most chunks in a shard; an index entry takes 16 bytes.
const MOST: u64 = 1 << 24;

/// Shards in shards: each of them is held while those in it are put together.
const DEEPEST: usize = 4;
/// A shard may be so many times larger than what is stored in it, and as much is read of it at most: chunks do not overlap.
const LARGER: u64 = 64;

/// How shards are made.
#[derive(Debug)]
pub(super) struct Shards {
    /// The shape of the chunks in a shard.
    pub(super) chunk: Vec<NonZeroU64>,
    pub(super) codecs: Box<Codecs>,
    index: CodecChain,
    index_first: bool,
}

/// Where the index of a shard lies, and what it is an index of.
#[derive(Clone, Debug)]
pub(super) struct IndexPlace {
    /// Chunks along each axis.
    pub(super) counts: Vec<u64>,
    pub(super) bytes: u64,
    pub(super) first: bool,
}

impl Shards {
    pub(super) fn new(codec: &dyn ArrayToBytesCodecTraits) -> Result<Self, String> {
        let configuration =
            codec.configuration_v3(&CodecMetadataOptions::default()).ok_or("its shards tell nothing")?;
        let told = serde_json::to_value(configuration).map_err(|error| one_line(&error))?;
        let chain = |key: &str| {
            let list: Vec<MetadataV3> = serde_json::from_value(told[key].clone()).map_err(|error| one_line(&error))?;
            CodecChain::from_metadata(&list).map_err(|error| one_line(&error))
        };
        let shards = Self {
            chunk: serde_json::from_value(told["chunk_shape"].clone()).map_err(|error| one_line(&error))?,
            codecs: Box::new(Codecs::new(&chain("codecs")?)?),
            index: chain("index_codecs")?,
            index_first: told["index_location"] == "start",
        };
        let depth = std::iter::successors(Some(&shards), |shards| shards.codecs.shards.as_ref()).count();
        if depth <= DEEPEST { Ok(shards) } else { Err(format!("it has shards in shards, {depth} deep")) }
    }

    /// Where the index of a shard of that shape lies.
    pub(super) fn index_place(&self, shard: &[NonZeroU64]) -> Result<IndexPlace, String> {
        let divides =
            shard.len() == self.chunk.len() && shard.iter().zip(&self.chunk).all(|(s, c)| s.get() % c.get() == 0);
        if !divides {
            return Err("its shards are no whole number of chunks along each axis".into());
        }
        let counts: Vec<u64> = shard.iter().zip(&self.chunk).map(|(shard, chunk)| shard.get() / chunk.get()).collect();
        if counts.iter().try_fold(1_u64, |all, n| all.checked_mul(*n)).is_none_or(|all| all > MOST) {
            return Err(format!("its shards have more than {MOST} chunks"));
        }
        let size =
            self.index.encoded_representation(&index_shape(&counts), &data_type::uint64(), &FillValue::from(u64::MAX));
        match size.map_err(|error| one_line(&error))? {
            BytesRepresentation::FixedSize(bytes) => Ok(IndexPlace { counts, bytes, first: self.index_first }),
            _ => Err("its shards have a compressed index, which is not read".into()),
        }
    }

    /// Reads an index: offset and length of each chunk.
    pub(super) fn read_index(&self, place: &IndexPlace, bytes: &[u8]) -> Result<Vec<[u64; 2]>, String> {
        let shape = index_shape(&place.counts);
        let none = FillValue::from(u64::MAX);
        let decoded = self.index.decode(Cow::Borrowed(bytes), &shape, &data_type::uint64(), &none, &options());
        let decoded = decoded.and_then(|values| Ok(values.into_fixed()?)).map_err(|error| one_line(&error))?;
        let words = decoded.as_chunks::<8>().0.as_chunks::<2>().0;
        Ok(words.iter().map(|pair| pair.map(u64::from_ne_bytes)).collect())
    }

    /// A whole shard, dense, from all of its bytes: for shards to which something is done as a whole.
    pub(super) fn assemble(&self, shard: &[u8], shape: &[NonZeroU64], value: &ValueType) -> Result<Vec<u8>, String> {
        let place = self.index_place(shape)?;
        let (bytes, length) = (place.bytes as usize, shard.len());
        let index = length.checked_sub(bytes).ok_or("it is shorter than its index")?;
        let entries = self.read_index(&place, if place.first { &shard[..bytes] } else { &shard[index..] })?;
        let size = bytes_of(shape, value.size).ok_or("a shard is larger than any memory")?;
        let most = LARGER * slack_of(length);
        if size > most {
            return Err("its shards are far larger than what is in them".into());
        }
        let ranges = entries.into_iter().map(|entry| range_of(entry, length as u64)).collect::<Result<Vec<_>, _>>()?;
        if ranges.iter().flatten().map(|range| range.end - range.start).sum::<u64>() > most {
            return Err("the index of its chunks names the same bytes many times: it is damaged".into());
        }
        let mut whole: Vec<u8> = value.fill.as_ne_bytes().iter().copied().cycle().take(size as usize).collect();
        for (number, range) in ranges.into_iter().enumerate() {
            let Some(range) = range else { continue };
            let stored = shard[range.start as usize..range.end as usize].to_vec();
            let chunk = self.codecs.decode(stored, &self.chunk, value)?;
            let mut rest = number as u64;
            let mut corner = vec![0; shape.len()];
            for a in (0..shape.len()).rev() {
                corner[a] = rest % place.counts[a] * self.chunk[a].get();
                rest /= place.counts[a];
            }
            put(&chunk, &self.chunk, &mut whole, shape, &corner, value.size);
        }
        Ok(whole)
    }
}

/// Bytes that a shard's own length speaks for.
fn slack_of(length: usize) -> u64 {
    (length as u64).saturating_add(1 << 20)
}

/// Puts a dense chunk at a corner of a dense array, row by row.
fn put(chunk: &[u8], chunk_shape: &[NonZeroU64], whole: &mut [u8], shape: &[NonZeroU64], corner: &[u64], size: usize) {
    let Some(last) = shape.len().checked_sub(1) else { return whole.copy_from_slice(chunk) };
    let row = chunk_shape[last].get() as usize * size;
    for (number, values) in chunk.chunks_exact(row).enumerate() {
        let (mut rest, mut at, mut stride) = (number as u64, corner[last], shape[last].get());
        for a in (0..last).rev() {
            at += (corner[a] + rest % chunk_shape[a].get()) * stride;
            rest /= chunk_shape[a].get();
            stride *= shape[a].get();
        }
        whole[at as usize * size..][..row].copy_from_slice(values);
    }
}

/// The shape of an index: an offset and a length for each chunk.
fn index_shape(counts: &[u64]) -> Vec<NonZeroU64> {
    counts.iter().chain(&[2]).filter_map(|n| NonZeroU64::new(*n)).collect()
}

/// Where a chunk lies in a file of that length; none where it is not stored.
pub(super) fn range_of([offset, bytes]: [u64; 2], length: u64) -> Result<Option<Range<u64>>, String> {
    if [offset, bytes] == [u64::MAX; 2] {
        return Ok(None);
    }
    match offset.checked_add(bytes).filter(|end| *end <= length) {
        Some(end) => Ok(Some(offset..end)),
        None => Err("the index of its chunks points past its end: it is truncated or damaged".into()),
    }
}
