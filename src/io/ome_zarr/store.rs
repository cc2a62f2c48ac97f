//! `StoreWriter`: one `OUT.zarr`, built under a hidden name beside its final one and moved into place when it is whole, or live.

use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::compression::{Compression, Content};
use super::files::create_parent;
use super::level::LevelWriter;
use super::metadata::{self, ImageSpec, LabelSpec};
use super::place::{Joined, Place, check_target, put_back};
use super::pyramid::{LevelPlan, plan_levels};
use super::root::Root;
use super::shard::ShardLayout;
use super::sums::FileSum;
use super::version::OmeVersion;
use crate::error::{Error, Result};
use crate::store::ElementType;

/// A store in the making. Dropped before [`StoreWriter::finish`], it leaves nothing behind.
#[derive(Debug)]
pub struct StoreWriter {
    path: PathBuf,
    overwrite: bool,
    compression: Compression,
    root: Arc<Root>,
    place: Place,
    /// Names of the label images; also the lock under which group documents are written.
    labels: Mutex<Vec<String>>,
}

/// A store that another process has begun.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SharedStore {
    path: PathBuf,
    folder: PathBuf,
    version: OmeVersion,
    is_live: bool,
}

impl SharedStore {
    /// Where it will lie.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether this process sees what the other one has begun.
    #[must_use]
    pub fn is_there(&self) -> bool {
        self.version.is_group(&self.folder)
    }
}

/// A multiscale image in the making: its levels, finest first.
#[derive(Debug)]
pub struct ImageWriter {
    levels: Vec<LevelWriter>,
}

impl ImageWriter {
    /// The levels to be filled, finest first, as [`plan_levels`] plans them.
    #[must_use]
    pub fn levels(&self) -> &[LevelWriter] {
        &self.levels
    }
}

impl StoreWriter {
    /// Begins the store that is to lie at `path`. With `overwrite` a store that is there already is replaced, at the
    /// end. What killed runs left in the making of the same store is removed; a store that a live one had set aside
    /// before it had anything of its own comes back first.
    ///
    /// # Errors
    /// `Usage` when something is at `path` that may not be replaced, or the folder it is to lie in does not exist;
    /// `Failed` when that folder cannot be written to.
    pub fn create(path: &Path, overwrite: bool) -> Result<Self> {
        Self::create_as(OmeVersion::default(), path, overwrite)
    }

    /// The same in a version of OME-Zarr.
    ///
    /// # Errors
    /// As [`StoreWriter::create`].
    pub fn create_as(version: OmeVersion, path: &Path, overwrite: bool) -> Result<Self> {
        let path = resolve(path)?;
        put_back(&path);
        check_target(&path, overwrite)?;
        let place = Place::hidden(&path)?;
        let root = Arc::new(Root::new(place.folder(), version));
        Self::begin(path, overwrite, root, place)
    }

    /// Begins a live store: it stands at `path` from now on, readable at every moment, and says of itself whether it is complete.
    /// A store that is there is replaced now. Dropped before it is finished it stays as far as it is, and says so; one without
    /// a shard goes, and what it replaced comes back.
    ///
    /// # Errors
    /// As [`StoreWriter::create`].
    pub fn create_live(path: &Path, overwrite: bool) -> Result<Self> {
        Self::create_live_as(OmeVersion::default(), path, overwrite)
    }

    /// The same in a version of OME-Zarr.
    ///
    /// # Errors
    /// As [`StoreWriter::create`].
    pub fn create_live_as(version: OmeVersion, path: &Path, overwrite: bool) -> Result<Self> {
        let path = resolve(path)?;
        put_back(&path);
        check_target(&path, overwrite)?;
        let root = Arc::new(Root::new(&path, version));
        let place = Place::live(&path, root.clone())?;
        Self::begin(path, overwrite, root, place)
    }

    /// Adds shards to a store that another process of the same run has begun with the same settings, in the folder that it
    /// says, and finishes. Images are begun here as there; all that describes them is written there alone.
    #[must_use]
    pub fn shared(joined: &SharedStore) -> Self {
        let SharedStore { path, folder, version, is_live } = joined.clone();
        let root = Arc::new(Root::new(&folder, version));
        let place = Place::Joined(Joined { folder, is_live });
        Self { path, overwrite: true, compression: Compression::default(), root, place, labels: Mutex::default() }
    }

    /// What other processes need to join it.
    #[must_use]
    pub fn share(&self) -> SharedStore {
        SharedStore {
            path: self.path.clone(),
            folder: self.folder().to_path_buf(),
            version: self.version(),
            is_live: self.place.is_live(),
        }
    }

    /// The sums of the shards that were written by this process, by their paths in the store.
    #[must_use]
    pub fn sums(&self) -> Vec<(String, FileSum)> {
        self.root.all_sums()
    }

    /// Takes over the sums of shards that others who joined have written.
    pub fn take_sums(&self, sums: Vec<(String, FileSum)>) {
        self.root.take_sums(sums);
    }

    fn begin(path: PathBuf, overwrite: bool, root: Arc<Root>, place: Place) -> Result<Self> {
        let (compression, labels) = (Compression::default(), Mutex::default());
        let store = Self { path, overwrite, compression, root, place, labels };
        store.ensure_groups(Path::new("")).map_err(|error| error.at(&store.path))?;
        Ok(store)
    }

    /// The same store with chunks packed in another way than fast.
    #[must_use]
    pub fn packed(self, compression: Compression) -> Self {
        Self { compression, ..self }
    }

    /// The folder that holds the store until it is finished.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.place.folder()
    }

    /// Where it will lie.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The version that it is written in.
    pub(super) fn version(&self) -> OmeVersion {
        self.root.version()
    }

    /// A file is there that another run has written, with the sum of its bytes.
    pub(super) fn took_over(&self, file: &Path, sum: FileSum) {
        self.root.wrote(file, sum);
    }

    /// Where to write a further file of the store (`meshes/surface.ply`, `report.json`); its folder exists.
    ///
    /// # Errors
    /// When the folder cannot be created.
    ///
    /// # Panics
    /// When `relative` leads out of the store.
    pub fn file(&self, relative: &str) -> Result<PathBuf> {
        let path = self.inside(relative);
        create_parent(&path).map_err(|error| error.at(&self.path))?;
        Ok(path)
    }

    /// Begins an image in `group`: `""` for the store's root, else a path such as `levelset/object-1`.
    ///
    /// # Errors
    /// When the metadata cannot be written.
    ///
    /// # Panics
    /// When `group` leads out of the store or holds an image already.
    pub fn image(&self, group: &str, spec: &ImageSpec<'_>) -> Result<ImageWriter> {
        let levels = plan_levels(spec.geometry);
        let attributes = metadata::image(spec, &levels);
        self.multiscale(group, attributes, levels, (spec.element, spec.content)).map_err(|error| error.at(&self.path))
    }

    /// Begins an image that this process alone writes, also where others have joined to write the store: it describes it too.
    ///
    /// # Errors
    /// When the metadata cannot be written.
    ///
    /// # Panics
    /// As [`StoreWriter::image`].
    pub fn image_of_one(&self, group: &str, spec: &ImageSpec<'_>) -> Result<ImageWriter> {
        let levels = plan_levels(spec.geometry);
        let attributes = metadata::image(spec, &levels);
        self.begin_image((group, true), attributes, levels, (spec.element, spec.content))
            .map_err(|error| error.at(&self.path))
    }

    /// The edges of the shards and of the chunks of the finest level of an image of such a shape.
    pub(crate) fn finest_edges(&self, shape: [i64; 3], element: ElementType) -> [[i64; 3]; 2] {
        ShardLayout::new(shape, element, self.root.version()).edges()
    }

    /// Describes an image anew, where its values are known only when they have been written: the window that viewers show.
    ///
    /// # Errors
    /// When the metadata cannot be written.
    ///
    /// # Panics
    /// When `group` leads out of the store.
    pub fn describe(&self, group: &str, spec: &ImageSpec<'_>) -> Result<()> {
        let attributes = metadata::image(spec, &plan_levels(spec.geometry));
        self.write_group(group, attributes).map_err(|error| error.at(&self.path))
    }

    /// Begins a label image of the root's image, in the group `labels`.
    ///
    /// # Errors
    /// When the metadata cannot be written.
    ///
    /// # Panics
    /// When the name is taken or no plain folder name, or the type is no unsigned one.
    pub fn labels(&self, spec: &LabelSpec<'_>) -> Result<ImageWriter> {
        self.begin_labels(spec).map_err(|error| error.at(&self.path))
    }

    /// Begins a label image that belongs to no image, at the store's root; labels may be signed.
    ///
    /// # Errors
    /// When the metadata cannot be written.
    pub fn labels_alone(&self, spec: &LabelSpec<'_>) -> Result<ImageWriter> {
        let levels = plan_levels(spec.geometry);
        let attributes = metadata::labels(spec, &levels, false);
        self.multiscale("", attributes, levels, (spec.element, Content::Repeated)).map_err(|error| error.at(&self.path))
    }

    /// Says how far a live store is, from any thread; nothing where it is not live.
    #[must_use]
    pub fn live(&self) -> Option<Arc<Root>> {
        matches!(self.place, Place::Live(_)).then(|| self.root.clone())
    }

    /// Moves the store into place, replacing the one that is there if `overwrite` said so; a live one is there, and says that it
    /// is complete.
    ///
    /// # Errors
    /// When files cannot be written out to the disk or renamed, or something came to lie at the path meanwhile. The
    /// store that was there before stays then.
    pub fn finish(self) -> Result<()> {
        self.place.finish(&self.path, self.overwrite, &self.root)
    }

    /// Makes the groups above an image, and its own.
    pub(super) fn begin_group(&self, group: &str) -> Result<()> {
        self.ensure_groups(Path::new(group))
    }

    /// Says what the image of a group is, all of whose levels are there, and lists it where it is a label image.
    pub(super) fn end_group(&self, group: &str, attributes: Map<String, Value>) -> Result<()> {
        self.write_group(group, attributes)?;
        group.strip_prefix("labels/").map_or(Ok(()), |name| self.list_labels(name))
    }

    /// Lists a label image. Under the lock until it is on disk: the list names what is there, whichever thread comes first.
    fn list_labels(&self, name: &str) -> Result<()> {
        let mut names = self.lock();
        names.push(name.to_owned());
        names.sort();
        names.dedup();
        if self.place.is_joined() {
            return Ok(());
        }
        self.root.version().write(&self.inside("labels"), &metadata::group(Some(metadata::label_list(&names))))
    }

    fn begin_labels(&self, spec: &LabelSpec<'_>) -> Result<ImageWriter> {
        assert!(
            matches!(spec.element, ElementType::U8 | ElementType::U16 | ElementType::U32),
            "labels are unsigned integers"
        );
        assert_eq!(Path::new(spec.name).components().count(), 1, "a label image lies directly in the group of labels");
        let levels = plan_levels(spec.geometry);
        let attributes = metadata::labels(spec, &levels, true);
        let image =
            self.multiscale(&format!("labels/{}", spec.name), attributes, levels, (spec.element, Content::Repeated))?;
        self.list_labels(spec.name)?;
        Ok(image)
    }

    fn multiscale(
        &self,
        group: &str,
        attributes: Map<String, Value>,
        levels: Vec<LevelPlan>,
        of: (ElementType, Content),
    ) -> Result<ImageWriter> {
        self.begin_image((group, !self.place.is_joined()), attributes, levels, of)
    }

    fn begin_image(
        &self,
        (group, describes): (&str, bool),
        attributes: Map<String, Value>,
        levels: Vec<LevelPlan>,
        (element, content): (ElementType, Content),
    ) -> Result<ImageWriter> {
        let folder = self.inside(group);
        if describes {
            assert!(!folder.join("0").exists(), "the store holds an image at {group:?} already");
            self.ensure_groups(Path::new(group))?;
        }
        let packed = (content, self.compression);
        let create = |(level, plan): (usize, LevelPlan)| {
            let halved = if self.place.is_live() { level } else { 0 };
            let layout = ShardLayout::halved(plan.geometry.shape, element, self.root.version(), halved);
            let level = LevelWriter::new(&folder.join(level.to_string()), &self.path, plan, element, packed, layout)?;
            if describes {
                level.describe()?;
            }
            Ok(level.counted_by(self.root.clone()))
        };
        let levels = levels.into_iter().enumerate().map(create).collect::<Result<_>>()?;
        if describes {
            self.describe_group(group, attributes)?;
        }
        Ok(ImageWriter { levels })
    }

    /// Says what the image in a group is, last: who reads that finds the levels that it names.
    fn write_group(&self, group: &str, attributes: Map<String, Value>) -> Result<()> {
        if self.place.is_joined() { Ok(()) } else { self.describe_group(group, attributes) }
    }

    fn describe_group(&self, group: &str, attributes: Map<String, Value>) -> Result<()> {
        match group {
            "" => self.root.describe(attributes),
            _ => self.root.version().write(&self.inside(group), &metadata::group(Some(attributes))),
        }
    }

    /// Makes sure that `group` and all groups above it say that they are groups.
    fn ensure_groups(&self, group: &Path) -> Result<()> {
        let _alone = self.lock();
        for folder in group.ancestors() {
            let (folder, version) = (self.place.folder().join(folder), self.root.version());
            if !version.is_group(&folder) {
                version.write(&folder, &metadata::group(None))?;
            }
        }
        Ok(())
    }

    fn lock(&self) -> MutexGuard<'_, Vec<String>> {
        // A list of names is whole whatever thread was lost while holding it.
        self.labels.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn inside(&self, relative: &str) -> PathBuf {
        let relative = Path::new(relative);
        assert!(relative.components().all(|part| matches!(part, Component::Normal(_))), "a path inside the store");
        self.place.folder().join(relative)
    }
}

/// The path with its folder made absolute and links followed, so that the store itself is replaced and not a link.
fn resolve(path: &Path) -> Result<PathBuf> {
    if let Ok(found) = path.canonicalize() {
        return Ok(found);
    }
    let name = path.file_name().ok_or_else(|| Error::usage("the output needs a name, such as OUT.zarr").at(path))?;
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let missing = |_| Error::usage("the folder for the output does not exist; create it first").at(parent);
    Ok(parent.canonicalize().map_err(missing)?.join(name))
}

#[cfg(test)]
mod tests;
