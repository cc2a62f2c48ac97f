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

use super::shards::Shards;

/// The type of the values of an array.
#[derive(Clone, Debug)]
pub(super) struct ValueType {
    pub(super) data_type: DataType,
    pub(super) fill: FillValue,
    /// Bytes of a value.
    pub(super) size: usize,
}

/// The codecs of an array, or of the chunks in a shard.
#[derive(Debug)]
pub(super) struct Codecs {
    /// What is done to values, and, where there are no shards, how they become bytes.
    values: CodecChain,
    pub(super) shards: Option<Shards>,
    /// What is done to bytes, in the order of writing.
    packed: Vec<Arc<dyn BytesToBytesCodecTraits>>,
}

/// How codecs run: in the thread that asks for a chunk.
pub(super) fn options() -> CodecOptions {
    CodecOptions::default().with_concurrent_target(1)
}

/// Bytes of an array of that shape; none past 64 bits.
pub(super) fn bytes_of(shape: &[NonZeroU64], size: usize) -> Option<u64> {
    shape.iter().try_fold(size as u64, |product, n| product.checked_mul(n.get()))
}

/// The most bytes that `size` bytes may be packed into or come out of an inner codec as.
pub(super) fn slack(size: u64) -> u64 {
    size.saturating_add(size / 8).saturating_add(1 << 16)
}

impl Codecs {
    pub(super) fn new(chain: &CodecChain) -> Result<Self, String> {
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
    pub(super) fn plain_shards(&self) -> Option<&Shards> {
        let plain = self.packed.is_empty() && self.values.array_to_array_codecs().is_empty();
        self.shards.as_ref().filter(|_| plain)
    }

    /// The values of a chunk, dense, in the machine's byte order, from its bytes as stored.
    pub(super) fn decode(&self, stored: Vec<u8>, shape: &[NonZeroU64], value: &ValueType) -> Result<Vec<u8>, String> {
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
pub(super) fn guarded<T>(run: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|_| Err("the decoder gave up on the damaged data".into()))
}

/// Everything that comes out of a decoder, up to a limit.
fn read_all(decoder: impl Read, limit: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    decoder.take(limit + 1).read_to_end(&mut bytes).map_err(|error| one_line(&error))?;
    if bytes.len() as u64 > limit { Err("it unpacks to more than a chunk holds".into()) } else { Ok(bytes) }
}

/// A foreign message as a part of ours.
pub(super) fn one_line(error: &dyn std::fmt::Display) -> String {
    error.to_string().lines().collect::<Vec<_>>().join(" ")
}
