//! What a chunk's bytes go through until they are values: the codecs of an array, run by `zarrs`, with limits of our own.
//!
//! `zarrs` takes the sizes that compressed data and shards tell of themselves at their word. Here a chunk may unpack to
//! what its shape says and little more, so that a damaged or hostile file costs no more memory than a sound one.

use std::borrow::Cow;
use std::io::Read;
use std::num::NonZeroU64;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use zarrs::array::codec::{BloscCodec, BytesCodec, Bz2Codec, GzipCodec, ShardingCodec, ZlibCodec, ZstdCodec};
use zarrs::array::{
    ArrayToArrayCodecTraits, ArrayToBytesCodecTraits, BytesRepresentation, BytesToBytesCodecTraits, CodecChain,
    CodecOptions, DataType, Endianness, FillValue,
};
use zarrs::array::{CodecMetadataOptions, data_type};
use zarrs::metadata::v3::MetadataV3;

use super::shard_index::{IndexPlace, MOST, index_shape, put, range_of};

/// The type of the values of an array.
#[derive(Clone, Debug)]
pub(crate) struct ValueType {
    pub(crate) data_type: DataType,
    pub(crate) fill: FillValue,
    /// Bytes of a value.
    pub(crate) size: usize,
}

/// The codecs of an array, or of the chunks in a shard.
#[derive(Debug)]
pub(crate) struct Codecs {
    /// What is done to values, and, where there are no shards, how they become bytes.
    values: CodecChain,
    pub(crate) shards: Option<Shards>,
    /// What is done to bytes, in the order of writing.
    packed: Vec<Arc<dyn BytesToBytesCodecTraits>>,
}

/// How codecs run: in the thread that asks for a chunk.
pub(crate) fn options() -> CodecOptions {
    CodecOptions::default().with_concurrent_target(1)
}

/// Bytes of an array of that shape; none past 64 bits.
pub(crate) fn bytes_of(shape: &[NonZeroU64], size: usize) -> Option<u64> {
    shape.iter().try_fold(size as u64, |product, n| product.checked_mul(n.get()))
}

/// The most bytes that `size` bytes may be packed into or come out of an inner codec as.
pub(crate) fn slack(size: u64) -> u64 {
    size.saturating_add(size / 8).saturating_add(1 << 16)
}

impl Codecs {
    pub(crate) fn new(chain: &CodecChain) -> Result<Self, String> {
        let packed = chain.bytes_to_bytes_codecs().to_vec();
        let values = chain.array_to_array_codecs().to_vec();
        let last = chain.array_to_bytes_codec();
        if !last.as_any().is::<ShardingCodec>() {
            return Ok(Self { values: CodecChain::new(values, last.clone(), Vec::new()), shards: None, packed });
        }
        let shards = Some(Shards::new(last.as_ref())?);
        let native: Arc<dyn ArrayToBytesCodecTraits> = Arc::new(BytesCodec::new(Some(Endianness::native())));
        Ok(Self { values: CodecChain::new(values, native, Vec::new()), shards, packed })
    }

    /// The shards, where nothing is done to them as a whole, so that the chunks in them can be read by themselves.
    pub(crate) fn plain_shards(&self) -> Option<&Shards> {
        let plain = self.packed.is_empty() && self.values.array_to_array_codecs().is_empty();
        self.shards.as_ref().filter(|_| plain)
    }

    /// The values of a chunk, dense, in the machine's byte order, from its bytes as stored.
    pub(crate) fn decode(&self, stored: Vec<u8>, shape: &[NonZeroU64], value: &ValueType) -> Result<Vec<u8>, String> {
        let size = bytes_of(shape, value.size).ok_or("a chunk is larger than any memory")?;
        let unpacked =
            self.packed.iter().rev().try_fold(stored, |bytes, codec| unpack(codec.as_ref(), bytes, slack(size)))?;
        let unpacked = match &self.shards {
            None => unpacked,
            Some(shards) => shards.assemble(&unpacked, &self.inner_shape(shape)?, value)?,
        };
        let values = guarded(|| {
            let values = self.values.decode(Cow::Owned(unpacked), shape, &value.data_type, &value.fill, &options());
            values.and_then(|values| Ok(values.into_fixed()?.into_owned())).map_err(|error| one_line(&error))
        })?;
        if values.len() as u64 == size {
            Ok(values)
        } else {
            Err(format!("it holds {} bytes where {size} are due", values.len()))
        }
    }

    /// The shape of what is left of a chunk after all that is done to its values.
    fn inner_shape(&self, shape: &[NonZeroU64]) -> Result<Vec<NonZeroU64>, String> {
        self.values
            .array_to_array_codecs()
            .iter()
            .try_fold(shape.to_vec(), |shape, codec: &Arc<dyn ArrayToArrayCodecTraits>| codec.encoded_shape(&shape))
            .map_err(|error| one_line(&error))
    }
}

/// Undoes one codec of bytes.
fn unpack(codec: &dyn BytesToBytesCodecTraits, bytes: Vec<u8>, limit: u64) -> Result<Vec<u8>, String> {
    let kind = codec.as_any();
    if kind.is::<GzipCodec>() {
        return read_all(flate2::read::MultiGzDecoder::new(&bytes[..]), limit);
    }
    if kind.is::<ZlibCodec>() {
        return read_all(flate2::read::ZlibDecoder::new(&bytes[..]), limit);
    }
    if kind.is::<Bz2Codec>() {
        return read_all(bzip2::read::MultiBzDecoder::new(&bytes[..]), limit);
    }
    if kind.is::<ZstdCodec>() {
        let decoder = zstd::stream::read::Decoder::with_buffer(&bytes[..]).map_err(|error| one_line(&error))?;
        return read_all(decoder, limit);
    }
    if kind.is::<BloscCodec>() {
        // The header of Blosc 1: flags in four bytes, then the size of what was packed.
        let told = bytes.get(4..8).and_then(|word| word.try_into().ok()).map(u32::from_le_bytes);
        if told.is_none_or(|told| u64::from(told) > limit) {
            return Err("its Blosc header makes no sense".into());
        }
    }
    guarded(|| {
        let decoded = codec.decode(Cow::Owned(bytes), &BytesRepresentation::UnboundedSize, &options());
        decoded.map(Cow::into_owned).map_err(|error| one_line(&error))
    })
}

/// Runs third-party code on hostile bytes: should it panic, that is one unreadable chunk, not the end of the program. What
/// is handed in is not looked at afterwards.
pub(crate) fn guarded<T>(run: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|_| Err("the decoder gave up on the damaged data".into()))
}

/// Everything that comes out of a decoder, up to a limit.
fn read_all(decoder: impl Read, limit: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    decoder.take(limit + 1).read_to_end(&mut bytes).map_err(|error| one_line(&error))?;
    if bytes.len() as u64 > limit { Err("it unpacks to more than a chunk holds".into()) } else { Ok(bytes) }
}

/// A foreign message as a part of ours.
pub(crate) fn one_line(error: &dyn std::fmt::Display) -> String {
    error.to_string().lines().collect::<Vec<_>>().join(" ")
}

/// Shards in shards: each of them is held while those in it are put together.
pub(crate) const DEEPEST: usize = 4;

/// A shard may be so many times larger than what is stored in it, and as much is read of it at most: chunks do not overlap.
pub(crate) const LARGER: u64 = 64;

/// How shards are made.
#[derive(Debug)]
pub(crate) struct Shards {
    /// The shape of the chunks in a shard.
    pub(crate) chunk: Vec<NonZeroU64>,
    pub(crate) codecs: Box<Codecs>,
    index: CodecChain,
    index_first: bool,
}

impl Shards {
    pub(crate) fn new(codec: &dyn ArrayToBytesCodecTraits) -> Result<Self, String> {
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
    pub(crate) fn index_place(&self, shard: &[NonZeroU64]) -> Result<IndexPlace, String> {
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
    pub(crate) fn read_index(&self, place: &IndexPlace, bytes: &[u8]) -> Result<Vec<[u64; 2]>, String> {
        let shape = index_shape(&place.counts);
        let none = FillValue::from(u64::MAX);
        let decoded = self.index.decode(Cow::Borrowed(bytes), &shape, &data_type::uint64(), &none, &options());
        let decoded = decoded.and_then(|values| Ok(values.into_fixed()?)).map_err(|error| one_line(&error))?;
        let words = decoded.as_chunks::<8>().0.as_chunks::<2>().0;
        Ok(words.iter().map(|pair| pair.map(u64::from_ne_bytes)).collect())
    }

    /// A whole shard, dense, from all of its bytes: for shards to which something is done as a whole.
    pub(crate) fn assemble(&self, shard: &[u8], shape: &[NonZeroU64], value: &ValueType) -> Result<Vec<u8>, String> {
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
pub(crate) fn slack_of(length: usize) -> u64 {
    (length as u64).saturating_add(1 << 20)
}
