//! Reads boxes of voxels back from a store that this crate wrote, for pictures and for telling what a store holds.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;
use zarrs::array::{Array, ArraySubset, ElementOwned};
use zarrs::filesystem::FilesystemStore;

use super::version::named_type;
use crate::error::{Error, Result};
use crate::grid::{Box3, Geometry};

/// A multiscale image of a store.
#[derive(Clone, Debug)]
pub struct ImageReader {
    folder: PathBuf,
    levels: Vec<StoredLevel>,
    kind: Option<String>,
    times: Option<u64>,
}

/// One resolution level as its metadata tells it.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredLevel {
    /// Its folder's name.
    pub path: String,
    /// Where its voxels lie.
    pub geometry: Geometry,
    /// The type of a voxel as Zarr names it.
    pub element: String,
    /// Voxels of what is one file, `[x, y, z]`: a shard, or a chunk where there are none.
    pub shard: [i64; 3],
    /// What stands before the number of a shard in the path of its file.
    prefix: &'static str,
    /// The time that is read, of an image with an axis of time.
    time: Option<u64>,
}

impl StoredLevel {
    /// The file that holds a voxel, as a path in the image's group.
    #[must_use]
    pub fn file_of(&self, voxel: [i64; 3]) -> String {
        let [x, y, z]: [i64; 3] = std::array::from_fn(|a| voxel[a] / self.shard[a]);
        let time = self.time.map_or(String::new(), |time| format!("{time}/"));
        format!("{}/{}{time}{z}/{y}/{x}", self.path, self.prefix)
    }
}

impl ImageReader {
    /// Opens the multiscale in a group: the store's folder itself, or one below it such as `labels/segmentation`.
    ///
    /// # Errors
    /// When there is none, or not with the axes z, y, x, or t before them; of those the first time is read.
    pub fn open(group: &Path) -> Result<Self> {
        let is_version_2 = group.join(".zattrs").is_file();
        let document = read_json(&group.join(if is_version_2 { ".zattrs" } else { "zarr.json" }))?;
        let ome = if is_version_2 { &document } else { &document["attributes"]["ome"] };
        let multiscale = &ome["multiscales"][0];
        let read = |multiscale: &Value| {
            let axes = axes(multiscale)?;
            let datasets = multiscale["datasets"].as_array()?;
            datasets.iter().map(|dataset| level(group, dataset, &axes)).collect::<Option<Vec<_>>>()
        };
        let levels = read(multiscale)
            .filter(|levels| levels.iter().all(|(_, times)| *times != Some(0) && *times == levels[0].1))
            .filter(|levels| !levels.is_empty())
            .ok_or_else(|| Error::input("holds no OME-Zarr image with the axes z, y, x that can be read").at(group))?;
        let kind = multiscale["type"].as_str().map(ToOwned::to_owned);
        let times = levels[0].1;
        Ok(Self {
            folder: group.to_path_buf(),
            levels: levels.into_iter().map(|(level, _)| level).collect(),
            kind,
            times,
        })
    }

    /// How many times the image has; none where it has no axis of time.
    #[must_use]
    pub fn times(&self) -> Option<u64> {
        self.times
    }

    /// The same image, read at a time of its own, counted from 0.
    ///
    /// # Panics
    /// When it has no such time.
    #[must_use]
    pub fn at(&self, time: u64) -> Self {
        assert!(self.times.is_some_and(|times| time < times), "a time of the image");
        let mut of_time = self.clone();
        of_time.levels.iter_mut().for_each(|level| level.time = Some(time));
        of_time
    }

    /// How coarser levels are made, as the metadata say it: `mean` or `mode` of those that we wrote.
    #[must_use]
    pub fn kind(&self) -> Option<&str> {
        self.kind.as_deref()
    }

    /// The levels, finest first.
    #[must_use]
    pub fn levels(&self) -> &[StoredLevel] {
        &self.levels
    }

    /// The voxels of a part of a level, dense `[z][y][x]`; exact for every type.
    ///
    /// # Errors
    /// When they cannot be read.
    ///
    /// # Panics
    /// When the level does not exist or `part` is not inside it.
    pub fn read_box(&self, level: usize, part: &Box3) -> Result<Vec<f64>> {
        let level = &self.levels[level];
        assert_eq!(part.intersect(&level.geometry.domain()), *part, "a box inside the level");
        match level.element.as_str() {
            "uint8" => self.read::<u8>(level, part),
            "uint16" => self.read::<u16>(level, part),
            "uint32" => self.read::<u32>(level, part),
            "int8" => self.read::<i8>(level, part),
            "int16" => self.read::<i16>(level, part),
            "int32" => self.read::<i32>(level, part),
            "float16" => self.read::<half::f16>(level, part),
            "float32" => self.read::<f32>(level, part),
            "float64" => self.read::<f64>(level, part),
            other => Err(Error::input(format!("holds voxels of type {other}, which are not read")).at(&self.folder)),
        }
    }

    fn read<T: ElementOwned + Into<f64>>(&self, level: &StoredLevel, part: &Box3) -> Result<Vec<f64>> {
        let store = FilesystemStore::new(&self.folder).map_err(|e| self.unreadable(e))?;
        let array = Array::open(Arc::new(store), &format!("/{}", level.path)).map_err(|e| self.unreadable(e))?;
        let space = [2, 1, 0].map(|a| part.lo[a] as u64..part.hi[a] as u64);
        let ranges: Vec<_> = level.time.map(|time| time..time + 1).into_iter().chain(space).collect();
        let subset = ArraySubset::new_with_ranges(&ranges);
        let values = array.retrieve_array_subset::<Vec<T>>(&subset).map_err(|e| self.unreadable(e))?;
        Ok(values.into_iter().map(Into::into).collect())
    }

    fn unreadable(&self, error: impl std::error::Error + Send + Sync + 'static) -> Error {
        Error::input(format!("cannot be read: {error}")).caused_by(error).at(&self.folder)
    }
}

fn read_json(path: &Path) -> Result<Value> {
    let text = std::fs::read(path).map_err(|e| Error::input(format!("cannot be read: {e}")).caused_by(e).at(path))?;
    serde_json::from_slice(&text).map_err(|e| Error::input(format!("is no JSON: {e}")).caused_by(e).at(path))
}

/// The axes of an image.
struct Axes {
    /// The unit of z, y, x, where they have one.
    unit: Option<String>,
    /// Whether t comes before them.
    has_time: bool,
}

/// None when the axes are not z, y, x, nor t, z, y, x.
fn axes(multiscale: &Value) -> Option<Axes> {
    let axes = multiscale["axes"].as_array()?;
    let names: Vec<&str> = axes.iter().filter_map(|axis| axis["name"].as_str()).collect();
    let has_time = names == ["t", "z", "y", "x"];
    let unit = axes.last().and_then(|axis| axis["unit"].as_str().map(ToOwned::to_owned));
    (has_time || names == ["z", "y", "x"]).then_some(Axes { unit, has_time })
}

/// A level, and how many times it has where these are an axis.
fn level(group: &Path, dataset: &Value, axes: &Axes) -> Option<(StoredLevel, Option<u64>)> {
    let path = dataset["path"].as_str()?.to_owned();
    let document = |name: &str| read_json(&group.join(&path).join(name)).ok();
    let (array, prefix) =
        document("zarr.json").map(|array| (array, "c/")).or_else(|| Some((document(".zarray")?, "")))?;
    let has_time = axes.has_time;
    let shard = xyz(&array["chunk_grid"]["configuration"]["chunk_shape"], has_time, Value::as_i64)
        .or_else(|| xyz(&array["chunks"], has_time, Value::as_i64))
        .filter(|shard: &[i64; 3]| shard.iter().all(|&n| n > 0))?;
    let transformations = dataset["coordinateTransformations"].as_array()?;
    let vector = |kind: &str| transformations.iter().find_map(|t| xyz(&t[kind], has_time, Value::as_f64));
    let geometry = Geometry {
        shape: xyz(&array["shape"], has_time, Value::as_i64)?,
        spacing: vector("scale")?,
        origin: vector("translation").unwrap_or([0.0; 3]),
        unit: axes.unit.clone(),
    };
    let element = array["data_type"].as_str().or_else(|| named_type(array["dtype"].as_str()?))?.to_owned();
    let times = if has_time { Some(array["shape"][0].as_u64()?) } else { None };
    Some((StoredLevel { path, geometry, element, shard, prefix, time: has_time.then_some(0) }, times))
}

/// The z, y, x of a list, which may begin with t, as a triple.
fn xyz<T: Copy>(list: &Value, has_time: bool, number: impl Fn(&Value) -> Option<T>) -> Option<[T; 3]> {
    let values: Vec<T> = list.as_array()?.iter().skip(usize::from(has_time)).filter_map(number).collect();
    let [z, y, x] = values.try_into().ok()?;
    Some([x, y, z])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::ome_zarr::{Content, ImageSpec, OmeVersion, StoreWriter};
    use crate::store::ElementType;

    #[test]
    fn what_was_written_comes_back() {
        [OmeVersion::V04, OmeVersion::V05].into_iter().for_each(comes_back);
    }

    fn comes_back(version: OmeVersion) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.zarr");
        let geometry = Geometry {
            shape: [300, 20, 5],
            spacing: [0.5, 0.5, 2.0],
            origin: [1.0, 2.0, 3.0],
            unit: Some("micrometer".into()),
        };
        let store = StoreWriter::create_as(version, &path, false).unwrap();
        let spec = ImageSpec {
            name: "image",
            geometry: &geometry,
            element: ElementType::U16,
            content: Content::Grey,
            window: None,
            extremes: None,
        };
        let image = store.image("", &spec).unwrap();
        for level in image.levels() {
            for shard in level.shards() {
                let voxels = shard.rows().flat_map(|(y, z)| (shard.lo[0]..shard.hi[0]).map(move |x| x + 7 * y + z));
                level.write_shard(&shard, &voxels.map(|v| v as u16).collect::<Vec<u16>>()).unwrap();
            }
        }
        store.finish().unwrap();
        let reader = ImageReader::open(&path).unwrap();
        assert_eq!(reader.levels().len(), image.levels().len());
        assert_eq!((&reader.levels()[0].geometry, reader.levels()[0].element.as_str()), (&geometry, "uint16"));
        let part = Box3::new([126, 3, 1], [130, 5, 3]);
        let expected: Vec<f64> =
            part.rows().flat_map(|(y, z)| (126..130).map(move |x| (x + 7 * y + z) as f64)).collect();
        assert_eq!(reader.read_box(0, &part).unwrap(), expected);
        assert_eq!(ImageReader::open(&path.join("labels")).unwrap_err().exit_code(), 2);
    }
}
