//! `StoreWriter`: one `OUT.zarr`, built under a hidden name beside its final one and moved into place when it is whole.

use std::fs::{self, File};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempDir;

use super::abandoned::{self, REPLACED};
use super::compression::{Compression, Content};
use super::files::{create_parent, io_error, sync_tree, write_json};
use super::level::LevelWriter;
use super::metadata::{self, ImageSpec, LabelSpec};
use super::pyramid::{LevelPlan, plan_levels};
use crate::error::{Error, Result};
use crate::store::{ElementType, Unfinished};

const METADATA: &str = "zarr.json";

/// A store in the making. Dropped before [`StoreWriter::finish`], it leaves nothing behind.
#[derive(Debug)]
pub struct StoreWriter {
    path: PathBuf,
    overwrite: bool,
    compression: Compression,
    partial: TempDir,
    /// Says so to whoever ends the process.
    unfinished: Unfinished,
    /// Says to other runs that somebody works on `partial`.
    _claim: Option<File>,
    /// Names of the label images; also the lock under which group documents are written.
    labels: Mutex<Vec<String>>,
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
    /// end. What killed runs left in the making of the same store is removed.
    ///
    /// # Errors
    /// `Usage` when something is at `path` that may not be replaced, or the folder it is to lie in does not exist;
    /// `Failed` when that folder cannot be written to.
    pub fn create(path: &Path, overwrite: bool) -> Result<Self> {
        let path = resolve(path)?;
        check_target(&path, overwrite)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let folder = path.parent().unwrap_or(Path::new("."));
        abandoned::remove(folder, &name, METADATA);
        let partial = tempfile::Builder::new()
            .prefix(&format!("{}{}-", abandoned::prefix(&name), std::process::id()))
            .tempdir_in(folder)
            .map_err(|error| io_error("the output cannot be created in its folder", &error).at(&path))?;
        // Locked before anything is in it: see `abandoned`.
        let claim = abandoned::claim(partial.path());
        let unfinished = Unfinished::new(partial.path());
        let store = Self {
            path,
            overwrite,
            compression: Compression::default(),
            partial,
            unfinished,
            _claim: claim,
            labels: Mutex::default(),
        };
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
        self.partial.path()
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
        self.multiscale(group, &metadata::group(Some(attributes)), levels, (spec.element, spec.content))
            .map_err(|error| error.at(&self.path))
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
        write_json(&self.inside(group).join(METADATA), &metadata::group(Some(attributes)))
            .map_err(|error| error.at(&self.path))
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

    /// Moves the store into place, replacing the one that is there if `overwrite` said so.
    ///
    /// # Errors
    /// When files cannot be written out to the disk or renamed, or something came to lie at the path meanwhile. The
    /// store that was there before stays then.
    pub fn finish(self) -> Result<()> {
        sync_tree(self.partial.path()).map_err(|error| error.at(&self.path))?;
        check_target(&self.path, self.overwrite)?;
        let fault = |error: std::io::Error| io_error("the output cannot be put in its place", &error).at(&self.path);
        if exists(&self.path) {
            let mut old = self.partial.path().as_os_str().to_owned();
            old.push(REPLACED);
            let old = PathBuf::from(old);
            self.unfinished.finish(|| {
                fs::rename(&self.path, &old).map_err(fault)?;
                if let Err(error) = fs::rename(self.partial.path(), &self.path) {
                    fs::rename(&old, &self.path).map_err(fault)?;
                    return Err(fault(error));
                }
                Ok(())
            })?;
            let _goes = Unfinished::new(&old);
            let left = |error| io_error("the output is complete, but the one it replaces cannot be removed", &error);
            fs::remove_dir_all(&old).map_err(|error| left(error).at(&old))?;
        } else {
            self.unfinished.finish(|| fs::rename(self.partial.path(), &self.path)).map_err(fault)?;
        }
        // The folder has its final name: nothing is left to clean up.
        let _ = self.partial.keep();
        Ok(())
    }

    fn begin_labels(&self, spec: &LabelSpec<'_>) -> Result<ImageWriter> {
        assert!(
            matches!(spec.element, ElementType::U8 | ElementType::U16 | ElementType::U32),
            "labels are unsigned integers"
        );
        assert_eq!(Path::new(spec.name).components().count(), 1, "a label image lies directly in the group of labels");
        let levels = plan_levels(spec.geometry);
        let attributes = metadata::labels(spec, &levels);
        let image = self.multiscale(
            &format!("labels/{}", spec.name),
            &metadata::group(Some(attributes)),
            levels,
            (spec.element, Content::Repeated),
        )?;
        // Listed last, under the lock until it is on disk: the list names what is there, whichever thread comes first.
        let mut names = self.lock();
        names.push(spec.name.to_owned());
        names.sort();
        write_json(&self.inside("labels").join(METADATA), &metadata::group(Some(metadata::label_list(&names))))?;
        Ok(image)
    }

    fn multiscale(
        &self,
        group: &str,
        document: &serde_json::Value,
        levels: Vec<LevelPlan>,
        (element, content): (ElementType, Content),
    ) -> Result<ImageWriter> {
        let folder = self.inside(group);
        assert!(!folder.join("0").exists(), "the store holds an image at {group:?} already");
        self.ensure_groups(Path::new(group))?;
        let packed = (content, self.compression);
        let create = |(level, plan): (usize, LevelPlan)| {
            LevelWriter::create(&folder.join(level.to_string()), &self.path, plan, element, packed)
        };
        let levels = levels.into_iter().enumerate().map(create).collect::<Result<_>>()?;
        write_json(&folder.join(METADATA), document)?;
        Ok(ImageWriter { levels })
    }

    /// Makes sure that `group` and all groups above it say that they are groups.
    fn ensure_groups(&self, group: &Path) -> Result<()> {
        let _alone = self.lock();
        for folder in group.ancestors() {
            let document = self.partial.path().join(folder).join(METADATA);
            if !document.exists() {
                write_json(&document, &metadata::group(None))?;
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
        self.partial.path().join(relative)
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

fn exists(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// Whether a folder is a Zarr store, of version 2 or 3.
#[must_use]
pub fn is_store(path: &Path) -> bool {
    [METADATA, ".zgroup", ".zattrs", ".zarray"].iter().any(|name| path.join(name).is_file())
}

fn check_target(path: &Path, overwrite: bool) -> Result<()> {
    if !exists(path) {
        return Ok(());
    }
    if !overwrite {
        let what = "the output exists already; choose another name, or give --overwrite to replace it";
        return Err(Error::usage(what).at(path));
    }
    if is_store(path) {
        return Ok(());
    }
    let what = "this is no Zarr store, so --overwrite does not replace it; remove it yourself or choose another name";
    Err(Error::usage(what).at(path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorKind;
    use crate::grid::Geometry;

    fn geometry() -> Geometry {
        Geometry { shape: [5, 4, 3], spacing: [1.0; 3], origin: [0.0; 3], unit: None }
    }

    fn entries(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn write_store(path: &Path, overwrite: bool, value: u8) -> Result<()> {
        let store = StoreWriter::create(path, overwrite)?;
        let spec = ImageSpec {
            name: "image",
            geometry: &geometry(),
            element: ElementType::U8,
            content: Content::Grey,
            window: None,
        };
        let image = store.image("", &spec)?;
        let level = &image.levels()[0];
        for shard in level.shards() {
            level.write_shard(&shard, &vec![value; shard.len()])?;
        }
        store.finish()
    }

    fn json(path: &Path) -> serde_json::Value {
        serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
    }

    #[test]
    fn dropped_stores_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let store = StoreWriter::create(&folder.path().join("out.zarr"), false).unwrap();
        fs::write(store.file("meshes/surface.ply").unwrap(), "ply").unwrap();
        assert_eq!(entries(folder.path()).len(), 1);
        assert!(entries(folder.path())[0].starts_with(".out.zarr.partial-"));
        drop(store);
        assert!(entries(folder.path()).is_empty());
    }

    #[test]
    fn stores_in_the_making_are_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.zarr");
        let first = StoreWriter::create(&path, false).unwrap();
        let dead = folder.path().join(".out.zarr.partial-1-abcdef");
        fs::create_dir(&dead).unwrap();
        fs::write(dead.join(METADATA), "{}").unwrap();
        let second = StoreWriter::create(&path, false).unwrap();
        assert!(first.folder().exists() && second.folder().exists() && !dead.exists());
    }

    #[test]
    fn finished_stores_are_in_place_and_readable_by_others() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.zarr");
        write_store(&path, false, 1).unwrap();
        assert_eq!(entries(folder.path()), ["out.zarr"]);
        assert_eq!(entries(&path), ["0", "zarr.json"]);
        assert!(path.join("0/c/0/0/0").is_file());
        let plain = folder.path().join("plain");
        fs::create_dir(&plain).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions(), fs::metadata(&plain).unwrap().permissions());
    }

    #[test]
    fn stores_are_replaced_only_when_told_and_only_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.zarr");
        write_store(&path, false, 1).unwrap();
        fs::write(path.join("note"), "old").unwrap();
        let error = write_store(&path, false, 2).unwrap_err();
        assert_eq!((error.kind(), error.path()), (ErrorKind::Usage, Some(path.canonicalize().unwrap().as_path())));
        assert!(error.to_string().contains("--overwrite"), "{error}");
        drop(StoreWriter::create(&path, true).unwrap());
        assert!(path.join("note").exists(), "an unfinished store replaces nothing");
        write_store(&path, true, 2).unwrap();
        assert!(!path.join("note").exists());
        assert_eq!(entries(folder.path()), ["out.zarr"]);
    }

    #[test]
    fn links_stay_links() {
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("out.zarr"), folder.path().join("link.zarr"));
        write_store(&path, false, 1).unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write_store(&link, true, 2).unwrap();
        assert_eq!(fs::read_link(&link).unwrap(), path);
        assert_eq!(entries(folder.path()), ["link.zarr", "out.zarr"]);
    }

    #[test]
    fn what_is_no_store_is_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("photos");
        fs::create_dir(&path).unwrap();
        fs::write(path.join("a.jpg"), "irreplaceable").unwrap();
        for target in [path.clone(), path.join("a.jpg")] {
            let error = StoreWriter::create(&target, true).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Usage, "{error}");
        }
        assert_eq!(entries(&path), ["a.jpg"]);
    }

    #[test]
    fn what_came_meanwhile_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.zarr");
        let store = StoreWriter::create(&path, false).unwrap();
        fs::create_dir(&path).unwrap();
        assert_eq!(store.finish().unwrap_err().kind(), ErrorKind::Usage);
        assert_eq!(entries(folder.path()), ["out.zarr"]);
    }

    #[test]
    fn folders_must_exist() {
        let folder = tempfile::tempdir().unwrap();
        let error = StoreWriter::create(&folder.path().join("no/out.zarr"), false).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert_eq!(error.path(), Some(folder.path().join("no").as_path()));
        assert_eq!(StoreWriter::create(Path::new("/"), false).unwrap_err().exit_code(), 2);
    }

    #[test]
    fn groups_on_the_way_say_that_they_are_groups() {
        let folder = tempfile::tempdir().unwrap();
        let store = StoreWriter::create(&folder.path().join("out.zarr"), false).unwrap();
        let geometry = geometry();
        let spec = ImageSpec {
            name: "u",
            geometry: &geometry,
            element: ElementType::F32,
            content: Content::Field,
            window: None,
        };
        store.image("levelset/object-1", &spec).unwrap();
        store.image("levelset/object-2", &spec).unwrap();
        for name in ["segmentation", "border"] {
            let spec = LabelSpec { name, geometry: &geometry, element: ElementType::U8, colors: &[] };
            store.labels(&spec).unwrap();
        }
        for group in ["", "levelset", "levelset/object-2", "labels", "labels/border"] {
            assert_eq!(json(&store.folder().join(group).join(METADATA))["node_type"], "group", "{group}");
        }
        let list = json(&store.folder().join("labels/zarr.json"));
        assert_eq!(list["attributes"]["ome"]["labels"], serde_json::json!(["border", "segmentation"]));
    }
}
