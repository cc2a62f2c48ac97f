//! `LevelWriter`: one resolution level, a Zarr array that is written shard by shard from any number of threads.

use std::path::{Path, PathBuf};

use super::files::{write_json, write_whole};
use super::metadata;
use super::pyramid::LevelPlan;
use super::shard::{ChunkCodec, ShardLayout, write_shard};
use crate::error::Result;
use crate::grid::{Box3, Geometry};
use crate::store::{Element, ElementType};

/// Writes one level of an image. Shards may be written in any order and from any thread, each by one caller.
#[derive(Debug)]
pub struct LevelWriter {
    folder: PathBuf,
    store: PathBuf,
    plan: LevelPlan,
    element: ElementType,
    layout: ShardLayout,
    codec: ChunkCodec,
}

impl LevelWriter {
    /// Begins the level in `folder`; errors name `store`, what the whole will be called.
    pub(super) fn create(folder: &Path, store: &Path, plan: LevelPlan, element: ElementType) -> Result<Self> {
        let layout = ShardLayout::new(plan.geometry.shape, element);
        let codec = ChunkCodec::new(element)?;
        write_json(&folder.join("zarr.json"), &metadata::array(plan.geometry.shape, element, layout, &codec))?;
        Ok(Self { folder: folder.to_path_buf(), store: store.to_path_buf(), plan, element, layout, codec })
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

    /// The type of a voxel.
    #[must_use]
    pub fn element(&self) -> ElementType {
        self.element
    }

    /// Voxels of a whole shard, `[x, y, z]`; those at the far ends may be cut short.
    #[must_use]
    pub fn shard_shape(&self) -> [i64; 3] {
        self.layout.shard
    }

    /// Bytes that a call of [`LevelWriter::write_shard_with`] holds beside the caller's own: one chunk as voxels, as
    /// bytes and compressed.
    #[must_use]
    pub fn bytes_per_call(&self) -> u64 {
        3 * Box3::from_shape(self.layout.chunk).volume() * self.element.size() as u64
    }

    /// The boxes to be written, x fastest: whole shards, clipped to the level.
    pub fn shards(&self) -> impl Iterator<Item = Box3> + use<> {
        let domain = self.plan.geometry.domain();
        let shard = self.layout.shard;
        let counts: [i64; 3] = std::array::from_fn(|a| (domain.hi[a] + shard[a] - 1) / shard[a]);
        Box3::from_shape(counts).rows().flat_map(move |(y, z)| {
            (0..counts[0]).map(move |x| {
                let lo = [x * shard[0], y * shard[1], z * shard[2]];
                Box3::from_shape(shard).translate(lo).intersect(&domain)
            })
        })
    }

    /// Writes the voxels of one shard, dense `[z][y][x]`; returns the bytes that went to disk. A shard of zeros, the
    /// fill value, takes none.
    ///
    /// # Errors
    /// When the file cannot be written; nothing of the shard is left then.
    ///
    /// # Panics
    /// When `shard` is none of [`LevelWriter::shards`], `data` does not fit it, or `T` is not the level's type.
    pub fn write_shard<T: Element>(&self, shard: &Box3, data: &[T]) -> Result<u64> {
        assert_eq!(data.len(), shard.len(), "the data does not fit the shard");
        self.write_shard_with(shard, |part, out: &mut [T]| {
            let length = part.shape()[0] as usize;
            for ((y, z), row) in part.rows().zip(out.chunks_exact_mut(length)) {
                row.copy_from_slice(&data[shard.offset_of([part.lo[0], y, z])..][..length]);
            }
            Ok(())
        })
    }

    /// Like [`LevelWriter::write_shard`], but asks for the voxels chunk by chunk, so that no whole shard need be in
    /// memory: `fill` gets boxes inside the shard and writes their voxels, dense `[z][y][x]`.
    ///
    /// # Errors
    /// What `fill` returns, or when the file cannot be written; nothing of the shard is left then.
    ///
    /// # Panics
    /// When `shard` is none of [`LevelWriter::shards`] or `T` is not the level's type.
    pub fn write_shard_with<T: Element>(
        &self,
        shard: &Box3,
        mut fill: impl FnMut(&Box3, &mut [T]) -> Result<()>,
    ) -> Result<u64> {
        assert_eq!(T::TYPE, self.element, "the level holds voxels of another type");
        let path = self.shard_path(shard);
        write_whole(&path, |sink| write_shard(sink, &self.codec, self.layout, shard, &mut fill))
            .map_err(|error| error.at(&self.store))
    }

    fn shard_path(&self, shard: &Box3) -> PathBuf {
        let place: [i64; 3] = std::array::from_fn(|a| shard.lo[a] / self.layout.shard[a]);
        let lo = std::array::from_fn(|a| place[a] * self.layout.shard[a]);
        let whole = Box3::from_shape(self.layout.shard).translate(lo).intersect(&self.plan.geometry.domain());
        assert_eq!(*shard, whole, "only whole shards are written");
        let [x, y, z] = place.map(|v| v.to_string());
        self.folder.join("c").join(z).join(y).join(x)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use zarrs::array::{Array, ElementOwned};
    use zarrs::filesystem::FilesystemStore;

    use super::*;
    use crate::error::Error;

    fn level(folder: &Path, shape: [i64; 3], element: ElementType) -> LevelWriter {
        let geometry = Geometry { shape, spacing: [1.0; 3], origin: [0.0; 3], unit: None };
        LevelWriter::create(&folder.join("0"), folder, LevelPlan { geometry, factors: [1; 3] }, element).unwrap()
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
    fn a_source_that_fails_leaves_no_shard() {
        let folder = tempfile::tempdir().unwrap();
        let level = level(folder.path(), [130, 10, 10], ElementType::U8);
        let shard = level.shards().next().unwrap();
        let mut calls = 0;
        let error = level.write_shard_with(&shard, |part, out: &mut [u8]| {
            assert_eq!(out.len(), part.len());
            out.fill(1);
            calls += 1;
            if calls == 2 { Err(Error::input("page 3 is broken")) } else { Ok(()) }
        });
        let error = error.unwrap_err();
        assert!(error.to_string().ends_with("page 3 is broken"));
        assert_eq!(error.path(), Some(folder.path()));
        assert_eq!(std::fs::read_dir(folder.path().join("0/c/0/0")).unwrap().count(), 0);
    }
}
