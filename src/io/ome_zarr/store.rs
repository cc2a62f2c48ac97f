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
mod tests;
