//! Files and folders under hidden names: outputs in the making, and what passes while a run goes on.
//!
//! A run keeps a lock (flock(2)) on each of them. The system lets go of it when the process ends, whatever ends it; so what
//! carries such a name and can be locked is abandoned, and the next run into the same folder removes it. Another machine may
//! work in a folder on a network and not see the lock; so names tell the running system (Linux' boot id), and nobody
//! touches those of another one. Where there is no such id, or no lock, nothing is ever removed.

use std::fs::{self, File, FileType, Permissions, TryLockError};
use std::io;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use tempfile::{Builder, TempDir, TempPath};

use super::Unfinished;

/// How all hidden names begin; the running system and letters follow, then what becomes of it.
const PREFIX: &str = ".strandline-";
/// How those of files end, and those of folders.
const ENDINGS: [&str; 2] = [".part", ".passing"];
/// Digits of the running system's id that names hold.
const ID_DIGITS: usize = 8;
/// How often something new is made where another run takes it for abandoned before it is locked.
const TRIES: usize = 100;

/// A file beside the one that it is to be; dropped without its name it is gone.
#[derive(Debug)]
pub struct HiddenFile {
    path: PathBuf,
    hidden: TempPath,
    /// Says to other runs that somebody works on it.
    claim: File,
    /// Says so to whoever ends the process.
    unfinished: Unfinished,
}

impl HiddenFile {
    /// Makes the file that will stand at `path`, with the permissions of any new file, and what writes to it; `ending` says
    /// what it is (`.ply`). What killed runs left in the same folder is removed.
    ///
    /// # Errors
    /// When no file can be made in that folder.
    pub fn create(path: &Path, ending: &str) -> io::Result<(Self, File)> {
        let folder = folder_of(path);
        remove_abandoned(folder);
        let [part, _] = ENDINGS;
        let make = || {
            let mut builder = Builder::new();
            // Those of a temporary file would be private.
            builder.permissions(Permissions::from_mode(0o666));
            builder.prefix(&prefix()).suffix(&format!("{ending}{part}")).tempfile_in(folder)
        };
        let (file, claim) = claimed(make, |file| file.as_file().try_clone())?;
        let (file, hidden) = file.into_parts();
        let unfinished = Unfinished::new(&hidden);
        Ok((Self { path: path.to_path_buf(), hidden, claim, unfinished }, file))
    }

    /// Hands what was written to the disk, so that a full one shows itself now.
    ///
    /// # Errors
    /// When it does not take it.
    pub fn sync(&self) -> io::Result<()> {
        self.claim.sync_all()
    }

    /// Puts the file under its name, in place of what has it if it may `replace` that.
    ///
    /// # Errors
    /// When it cannot be renamed. When it may not replace what came to lie there meanwhile: `AlreadyExists`.
    pub fn place(self, replace: bool) -> io::Result<()> {
        let Self { path, hidden, claim: _claim, unfinished } = self;
        unfinished.finish(|| {
            if replace {
                return hidden.persist(&path).map_err(|error| error.error);
            }
            let Err(refused) = hidden.persist_noclobber(&path) else { return Ok(()) };
            // Some disks of other systems know no way to rename without replacing.
            if refused.error.kind() == io::ErrorKind::AlreadyExists || path.symlink_metadata().is_ok() {
                let what = "something else came to lie there while this run went on, and stays; only --overwrite lets it be replaced";
                return Err(io::Error::new(io::ErrorKind::AlreadyExists, what));
            }
            refused.path.persist(&path).map_err(|error| error.error)
        })
    }
}

/// A folder for what passes; dropped it is gone, with all that is in it.
#[derive(Debug)]
pub struct HiddenFolder {
    folder: TempDir,
    _claim: File,
    _unfinished: Unfinished,
}

impl HiddenFolder {
    /// Makes one in a folder. What killed runs left there is removed.
    ///
    /// # Errors
    /// When no folder can be made there.
    pub fn create(within: &Path) -> io::Result<Self> {
        remove_abandoned(within);
        let [_, passing] = ENDINGS;
        let make = || Builder::new().prefix(&prefix()).suffix(passing).tempdir_in(within);
        let (folder, claim) = claimed(make, |folder| File::open(folder.path()))?;
        let unfinished = Unfinished::new(folder.path());
        Ok(Self { folder, _claim: claim, _unfinished: unfinished })
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Makes something and locks it. Who looks for what is abandoned may lock and remove it before that: then another is made.
fn claimed<T>(make: impl Fn() -> io::Result<T>, open: impl Fn(&T) -> io::Result<File>) -> io::Result<(T, File)> {
    for _ in 0..TRIES {
        let made = make()?;
        let claim = match open(&made) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            opened => opened?,
        };
        // A disk without locks has none for others either.
        let is_taken = matches!(claim.try_lock(), Err(TryLockError::WouldBlock));
        if !is_taken && claim.metadata()?.nlink() > 0 {
            return Ok((made, claim));
        }
    }
    Err(io::Error::other("other runs remove what is made there"))
}

/// Removes what dead runs of this system left in a folder.
pub(super) fn remove_abandoned(folder: &Path) {
    if system().is_empty() {
        return;
    }
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_hidden = is_hidden(&entry.file_name().to_string_lossy());
        let Some(kind) = is_hidden.then(|| entry.file_type().ok()).flatten() else { continue };
        if kind.is_file() || kind.is_dir() {
            // What cannot be removed is in nobody's way.
            let _ = remove(&entry.path(), kind);
        }
    }
}

fn remove(path: &Path, kind: FileType) -> io::Result<()> {
    let file = File::open(path)?;
    if file.try_lock().is_err() {
        return Ok(());
    }
    if kind.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) }
}

/// Whether a name is one of those made here, on this running system.
fn is_hidden(name: &str) -> bool {
    let Some((letters, rest)) = name.strip_prefix(&prefix()).and_then(|rest| rest.split_once('.')) else {
        return false;
    };
    let is_ending = |ending: &str| rest == &ending[1..] || rest.ends_with(ending);
    letters.bytes().all(|b| b.is_ascii_alphanumeric()) && ENDINGS.iter().any(|ending| is_ending(ending))
}

fn prefix() -> String {
    format!("{PREFIX}{}-", system())
}

/// What tells this running system from others, and from itself before it was started anew; empty where nothing does.
fn system() -> &'static str {
    static SYSTEM: OnceLock<String> = OnceLock::new();
    SYSTEM.get_or_init(|| {
        let id = fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
        id.chars().filter(char::is_ascii_hexdigit).take(ID_DIGITS).collect()
    })
}

/// The folder that a path lies in.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;
    use std::io::Write;

    fn names(folder: &Path) -> Vec<String> {
        let name = |entry: fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
        let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(|entry| name(entry.unwrap())).collect();
        names.sort();
        names
    }

    #[test]
    fn only_what_nobody_works_on_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let ours = |rest: &str| format!("{}{rest}", prefix());
        let (living, mut file) = HiddenFile::create(&at("a.ply"), ".ply").unwrap();
        file.write_all(b"ply").unwrap();
        let passing = HiddenFolder::create(folder.path()).unwrap();
        for dead in ["abcDEF.part", "abcDEG.ply.part"] {
            fs::write(at(&ours(dead)), "half").unwrap();
        }
        fs::create_dir(at(&ours("abcDEF.passing"))).unwrap();
        fs::write(at(&ours("abcDEF.passing")).join("field"), "half").unwrap();
        let others = [
            ".strandline-00zz00zz-abcDEF.part".into(),
            ".strandline-mine.part".into(),
            ours("mine.txt"),
            ours("a-b.part"),
        ];
        for name in &others {
            fs::write(at(name), "whole").unwrap();
        }
        std::os::unix::fs::symlink(at(&others[0]), at(&ours("abcDEH.part"))).unwrap();
        let before = names(folder.path()).len();
        let (second, _) = HiddenFile::create(&at("b.ply"), ".ply").unwrap();
        assert_eq!(names(folder.path()).len(), before - 3 + 1, "{:?}", names(folder.path()));
        assert!(others.iter().all(|name| at(name).exists()) && passing.path().exists());
        living.place(false).unwrap();
        assert_eq!(fs::read(at("a.ply")).unwrap(), b"ply");
        drop((second, passing));
        assert_eq!(names(folder.path()).len(), 1 + others.len() + 1, "{:?}", names(folder.path()));
    }

    #[test]
    fn what_came_meanwhile_is_replaced_only_with_leave() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.ply");
        let make = || {
            let (hidden, mut file) = HiddenFile::create(&path, ".ply").unwrap();
            file.write_all(b"new").unwrap();
            hidden
        };
        let (first, second) = (make(), make());
        fs::write(&path, "another program's").unwrap();
        assert_eq!(first.place(false).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&path).unwrap(), b"another program's");
        second.place(true).unwrap();
        assert_eq!((fs::read(&path).unwrap(), names(folder.path())), (b"new".to_vec(), vec!["m.ply".into()]));
    }
}
