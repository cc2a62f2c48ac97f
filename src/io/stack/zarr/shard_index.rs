//! The index of a shard, where each of its chunks lies, and how chunks are put together.

use std::num::NonZeroU64;
use std::ops::Range;

/// The most chunks in a shard; an index entry takes 16 bytes.
pub(crate) const MOST: u64 = 1 << 24;

/// Where the index of a shard lies, and what it is an index of.
#[derive(Clone, Debug)]
pub(crate) struct IndexPlace {
    /// Chunks along each axis.
    pub(crate) counts: Vec<u64>,
    pub(crate) bytes: u64,
    pub(crate) first: bool,
}

/// Puts a dense chunk at a corner of a dense array, row by row.
pub(crate) fn put(
    chunk: &[u8],
    chunk_shape: &[NonZeroU64],
    whole: &mut [u8],
    shape: &[NonZeroU64],
    corner: &[u64],
    size: usize,
) {
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
pub(crate) fn index_shape(counts: &[u64]) -> Vec<NonZeroU64> {
    counts.iter().chain(&[2]).filter_map(|n| NonZeroU64::new(*n)).collect()
}

/// Where a chunk lies in a file of that length; none where it is not stored.
pub(crate) fn range_of([offset, bytes]: [u64; 2], length: u64) -> Result<Option<Range<u64>>, String> {
    if [offset, bytes] == [u64::MAX; 2] {
        return Ok(None);
    }
    match offset.checked_add(bytes).filter(|end| *end <= length) {
        Some(end) => Ok(Some(offset..end)),
        None => Err("the index of its chunks points past its end: it is truncated or damaged".into()),
    }
}
