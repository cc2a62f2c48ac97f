//! `LevelWriter`: one resolution level, a Zarr array that takes chunks from any number of threads, in any order, and
//! writes each shard when its last chunk has come.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde_json::Value;

use super::compression::{Compression, Content};
use super::files::write_whole;
use super::metadata;
use super::pyramid::LevelPlan;
use super::root::Root;
use super::shard::{ChunkCodec, ShardLayout, encode_chunk, write_shard};
use super::sums::{FileSum, Summing};
use super::version::OmeVersion;
use crate::error::Result;
use crate::grid::{Box3, Geometry};
use crate::store::{Element, ElementType};

/// Writes one level of an image. Chunks may come in any order and from any thread; those of a shard are best given one soon
/// after the other, as they wait for the last in memory.
#[derive(Debug)]
pub struct LevelWriter {
    folder: PathBuf,
    store: PathBuf,
    plan: LevelPlan,
    element: ElementType,
    layout: ShardLayout,
    codec: ChunkCodec,
    /// Counts shards that are written, and knows whether the store is still there.
    root: Option<Arc<Root>>,
    /// Shards of which some chunks have come, by their places.
    pending: Mutex<HashMap<[i64; 3], Pending>>,
}

/// A shard of which some chunks have come, compressed.
#[derive(Debug)]
struct Pending {
    chunks: Vec<Option<Vec<u8>>>,
    missing: usize,
}

impl LevelWriter {
    /// The level in `folder`; errors name `store`, what the whole will be called.
    pub(super) fn new(
        folder: &Path,
        store: &Path,
        plan: LevelPlan,
        element: ElementType,
        packed: (Content, Compression),
        layout: ShardLayout,
    ) -> Result<Self> {
        let codec = ChunkCodec::new(element, packed, layout.version)?;
        Ok(Self {
            folder: folder.to_path_buf(),
            store: store.to_path_buf(),
            plan,
            element,
            layout,
            codec,
            root: None,
            pending: Mutex::default(),
        })
    }

    /// Writes what says how it lies in its files.
    pub(super) fn describe(&self) -> Result<()> {
        self.layout.version.write(&self.folder, &self.document())
    }

    /// What says how its voxels lie in its files, as Zarr 3 has it.
    pub(super) fn document(&self) -> Value {
        metadata::array(self.plan.geometry.shape, self.element, self.layout, &self.codec)
    }

    /// Its folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The version of its store.
    pub(super) fn version(&self) -> OmeVersion {
        self.layout.version
    }

    /// Where its shards are counted.
    pub(super) fn root(&self) -> Option<&Arc<Root>> {
        self.root.as_ref()
    }

    /// The same level; its shards are counted there.
    pub(super) fn counted_by(self, root: Arc<Root>) -> Self {
        Self { root: Some(root), ..self }
    }

    /// The level's grid.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.plan.geometry
    }

    /// Voxels of the level before that one voxel covers along each axis, `[x, y, z]`.
    #[must_use]
    pub fn factors(&self) -> [i64; 3] {
        self.plan.factors
    }

    /// Voxels of a whole shard, `[x, y, z]`; those at the far ends may be cut short.
    #[must_use]
    pub fn shard_shape(&self) -> [i64; 3] {
        self.layout.shard
    }

    /// Voxels of a whole chunk, `[x, y, z]`; those at the far ends may be cut short.
    #[must_use]
    pub fn chunk_shape(&self) -> [i64; 3] {
        self.layout.chunk
    }

    /// The boxes of the shards, x fastest, clipped to the level.
    pub fn shards(&self) -> impl Iterator<Item = Box3> + use<> {
        self.plan.geometry.domain().tiles(self.layout.shard)
    }

    /// Takes the voxels of one chunk, dense `[z][y][x]`, and keeps them compressed until all chunks of their shard have
    /// come; the last one writes the shard. Returns the bytes that went to disk. A shard of zeros, the fill value, takes
    /// none.
    ///
    /// # Errors
    /// When the file cannot be written; nothing of the shard is left then.
    ///
    /// # Panics
    /// When `chunk` is not one whole chunk, clipped to the level, or comes twice, `data` does not fit it, or `T` is not the
    /// level's type.
    pub fn write_chunk<T: Element>(&self, chunk: &Box3, data: &[T]) -> Result<u64> {
        assert_eq!(T::TYPE, self.element, "the level holds voxels of another type");
        assert_eq!(data.len(), chunk.len(), "the data does not fit the chunk");
        let whole = Box3::from_shape(self.layout.chunk).translate(chunk.lo).intersect(&self.plan.geometry.domain());
        let is_whole = *chunk == whole && (0..3).all(|a| chunk.lo[a] % self.layout.chunk[a] == 0);
        assert!(is_whole, "only whole chunks are taken");
        let encoded = encode_chunk(&self.codec, self.layout, chunk, data).map_err(|error| error.at(&self.store))?;
        let (shard, place) = self.layout.place_of(chunk.lo);
        let Some(chunks) = self.enter(shard, place, encoded) else { return Ok(0) };
        if let Some(root) = &self.root {
            root.check_place().map_err(|error| error.at(&self.store))?;
        }
        let (path, mut sum) = (self.shard_path(shard), FileSum::default());
        let bytes = write_whole(&path, |sink| {
            let mut sink = Summing::new(sink);
            let bytes = write_shard(&mut sink, chunks, self.layout, &self.codec)?;
            sum = sink.sum;
            Ok(bytes)
        })
        .map_err(|error| error.at(&self.store))?;
        self.root.iter().for_each(|root| root.wrote(&path, sum));
        Ok(bytes)
    }

    /// Writes the voxels of one shard, dense `[z][y][x]`; returns the bytes that went to disk.
    ///
    /// # Errors
    /// As [`LevelWriter::write_chunk`].
    ///
    /// # Panics
    /// When `shard` is none of [`LevelWriter::shards`], `data` does not fit it, or `T` is not the level's type.
    pub fn write_shard<T: Element>(&self, shard: &Box3, data: &[T]) -> Result<u64> {
        assert_eq!(data.len(), shard.len(), "the data does not fit the shard");
        let mut values = Vec::new();
        shard.tiles(self.layout.chunk).try_fold(0, |bytes, chunk| {
            shard.cut(data, &chunk, &mut values);
            Ok(bytes + self.write_chunk(&chunk, &values)?)
        })
    }

    /// Forgets the chunks of shards that are not whole: all will come again.
    pub fn forget(&self) {
        self.pending.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }

    /// Keeps a chunk; returns those of its shard when it was the last of them.
    fn enter(&self, shard: [i64; 3], place: usize, encoded: Option<Vec<u8>>) -> Option<Vec<Option<Vec<u8>>>> {
        let mut pending = self.pending.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = pending.entry(shard).or_insert_with(|| Pending {
            chunks: vec![None; self.layout.chunks_in_shard()],
            missing: self.shard_box(shard).tiles(self.layout.chunk).count(),
        });
        entry.chunks[place] = encoded;
        entry.missing = entry.missing.checked_sub(1).expect("each chunk comes once");
        if entry.missing > 0 {
            return None;
        }
        pending.remove(&shard).map(|shard| shard.chunks)
    }

    fn shard_box(&self, place: [i64; 3]) -> Box3 {
        let lo = std::array::from_fn(|a| place[a] * self.layout.shard[a]);
        Box3::from_shape(self.layout.shard).translate(lo).intersect(&self.plan.geometry.domain())
    }

    fn shard_path(&self, place: [i64; 3]) -> PathBuf {
        let [x, y, z] = place.map(|v| v.to_string());
        let folder = if self.layout.version == OmeVersion::V04 { self.folder.clone() } else { self.folder.join("c") };
        folder.join(z).join(y).join(x)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use zarrs::array::{Array, ElementOwned};
    use zarrs::filesystem::FilesystemStore;

    use super::*;

    fn level(folder: &Path, shape: [i64; 3], element: ElementType) -> LevelWriter {
        packed_level(folder, shape, element, (Content::Grey, Compression::Fast))
    }

    fn packed_level(
        folder: &Path,
        shape: [i64; 3],
        element: ElementType,
        packed: (Content, Compression),
    ) -> LevelWriter {
        let geometry = Geometry { shape, spacing: [1.0; 3], origin: [0.0; 3], unit: None };
        let (plan, layout) =
            (LevelPlan { geometry, factors: [1; 3] }, ShardLayout::new(shape, element, OmeVersion::V05));
        described(&folder.join("0"), plan, element, packed, layout)
    }

    fn described(
        folder: &Path,
        plan: LevelPlan,
        element: ElementType,
        packed: (Content, Compression),
        layout: ShardLayout,
    ) -> LevelWriter {
        let level = LevelWriter::new(folder, folder, plan, element, packed, layout).unwrap();
        level.describe().unwrap();
        level
    }

    /// The array as the `zarrs` crate reads it, which takes no part in laying out or writing shards.
    fn read_back<T: ElementOwned>(folder: &Path) -> Vec<T> {
        let array = Array::open(Arc::new(FilesystemStore::new(folder).unwrap()), "/0").unwrap();
        array.retrieve_array_subset::<Vec<T>>(&array.subset_all()).unwrap()
    }

    fn round_trip<T: Element + ElementOwned>(shape: [i64; 3], value: impl Fn(usize) -> f64) {
        let folder = tempfile::tempdir().unwrap();
        let level = level(folder.path(), shape, T::TYPE);
        let domain = Box3::from_shape(shape);
        let whole: Vec<T> = (0..domain.len()).map(|i| T::from_f64(value(i))).collect();
        for shard in level.shards() {
            let length = shard.shape()[0] as usize;
            let rows = shard.rows().map(|(y, z)| &whole[domain.offset_of([shard.lo[0], y, z])..][..length]);
            level.write_shard(&shard, &rows.flatten().copied().collect::<Vec<T>>()).unwrap();
        }
        assert!(read_back::<T>(folder.path()) == whole, "{shape:?} {}", T::TYPE.name());
    }

    #[test]
    fn zarrs_reads_every_type_and_shape() {
        round_trip::<u8>([300, 20, 70], |i| (i % 251) as f64);
        round_trip::<u16>([1, 1, 1], |_| 65535.0);
        round_trip::<u32>([130, 129, 3], |i| (i * 77_777 % 4_000_000_007) as f64);
        round_trip::<half::f16>([33, 65, 2], |i| (i % 100) as f64 / 8.0);
        round_trip::<f32>([129, 64, 130], |i| (i as f64).sqrt() - 700.0);
        round_trip::<f64>([65, 2, 129], |i| (i as f64).sin());
        // Chunks that hold only zeros are left out of their shard.
        round_trip::<u16>([200, 100, 65], |i| f64::from(u8::from(i % 100_001 == 5)));
    }

    #[test]
    fn zarrs_reads_what_is_packed_in_any_way() {
        let (shape, packed) = ([70, 66, 65], [Content::Grey, Content::Field, Content::Repeated]);
        let whole: Vec<f32> = (0..70 * 66 * 65).map(|i| (i as f32 / 97.0).floor()).collect();
        let mut sizes = Vec::new();
        for compression in [Compression::None, Compression::Fast, Compression::Small] {
            for content in packed {
                let folder = tempfile::tempdir().unwrap();
                let level = packed_level(folder.path(), shape, ElementType::F32, (content, compression));
                let shard = level.shards().next().unwrap();
                sizes.push(level.write_shard(&shard, &whole).unwrap());
                assert_eq!(read_back::<f32>(folder.path()), whole, "{content:?} {compression:?}");
            }
        }
        // Eight chunks of 64^3 numbers as they are, and an index of eight places with its checksum.
        assert_eq!(sizes[..3], [8 * 4 * 64 * 64 * 64 + 8 * 16 + 4; 3]);
        assert!(sizes[3..].iter().all(|&size| size < sizes[0] / 4), "{sizes:?}");
    }

    #[test]
    fn zarrs_reads_chunks_of_the_older_version_that_were_laid_together() {
        let shape = [150, 70, 30];
        let whole: Vec<u16> = (0..150 * 70 * 30).map(|i: u32| (i % 7919) as u16).collect();
        for packed in [(Content::Grey, Compression::Fast), (Content::Repeated, Compression::Small)] {
            let folder = tempfile::tempdir().unwrap();
            let plan = LevelPlan { geometry: Geometry::new(shape, [1.0; 3], [0.0; 3]), factors: [1; 3] };
            let layout = ShardLayout { chunk: [64, 64, 30], shard: [128, 128, 30], version: OmeVersion::V04 };
            let path = folder.path().join("0");
            let level = described(&path, plan, ElementType::U16, packed, layout);
            let mut values = Vec::new();
            for shard in level.shards() {
                Box3::from_shape(shape).cut(&whole, &shard, &mut values);
                level.write_shard(&shard, &values).unwrap();
            }
            assert!(path.join("0/0/1").is_file() && !path.join("0/0/2").exists() && !path.join("0/1").exists());
            assert!(read_back::<u16>(folder.path()) == whole, "{packed:?}");
        }
    }

    #[test]
    fn shards_tile_the_level_once() {
        let folder = tempfile::tempdir().unwrap();
        let level = level(folder.path(), [300, 129, 5], ElementType::F32);
        assert_eq!(level.shard_shape(), [128, 128, 5]);
        let shards: Vec<Box3> = level.shards().collect();
        assert_eq!(shards.len(), 6);
        assert_eq!(shards.iter().map(Box3::volume).sum::<u64>(), 300 * 129 * 5);
        assert_eq!(shards[5], Box3::new([256, 128, 0], [300, 129, 5]));
    }

    #[test]
    fn zeros_take_no_file_and_size_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let level = level(folder.path(), [300, 10, 10], ElementType::U8);
        let shards: Vec<Box3> = level.shards().collect();
        let file = folder.path().join("0/c/0/0/1");
        let bytes = level.write_shard(&shards[1], &vec![7_u8; shards[1].len()]).unwrap();
        assert_eq!(bytes, std::fs::metadata(&file).unwrap().len());
        // Written again, as after a resume, with zeros: the old file goes.
        assert_eq!(level.write_shard(&shards[1], &vec![0_u8; shards[1].len()]).unwrap(), 0);
        assert!(!file.exists());
    }

    #[test]
    fn a_shard_appears_with_its_last_chunk_in_whatever_order_they_come() {
        let folder = tempfile::tempdir().unwrap();
        let level = level(folder.path(), [130, 70, 10], ElementType::U8);
        let chunks: Vec<Box3> = level.geometry().domain().tiles(level.chunk_shape()).collect();
        let file = folder.path().join("0/c/0/0/0");
        for (n, chunk) in chunks.iter().enumerate().rev() {
            assert!(!file.exists());
            let bytes = level.write_chunk(chunk, &vec![n as u8; chunk.len()]).unwrap();
            assert_eq!(bytes > 0, n == 0);
        }
        let back = read_back::<u8>(folder.path());
        for (n, chunk) in chunks.iter().enumerate() {
            assert_eq!(back[level.geometry().domain().offset_of(chunk.lo)], n as u8);
        }
    }
}
