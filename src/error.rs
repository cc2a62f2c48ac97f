//! The one error type of the crate: what happened, where, and which exit code it deserves.
//!
//! A message is one sentence for the user: what is wrong, where (file, page, line, brick), what to do about it. It tells
//! all there is to tell; what the operating system or another library said is kept beside it, as the error's source.
//! Kernels return no errors; storage, input, output and pipelines do.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// The result of everything in this crate that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// What kind of failure an [`Error`] is; decides the exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The command line or a setting makes no sense, such as too small a budget (exit code 2).
    Usage,
    /// An input cannot be used: unreadable, malformed, empty, hostile (exit code 2).
    Input,
    /// The run failed: disk full, unwritable output (exit code 1).
    Failed,
    /// The surface of an object vanished while it moved (exit code 1).
    Vanished,
    /// Some of several parts of a run failed, and the others are done (exit code 3).
    Partly,
    /// SIGINT, SIGTERM or SIGHUP asked the run to end (exit code 130, 143 or 129).
    Interrupted {
        /// The signal's number: 2 or 15.
        signal: i32,
    },
}

/// What went wrong, in one sentence, with the file it concerns.
#[derive(Debug)]
pub struct Error {
    kind: ErrorKind,
    message: String,
    path: Option<PathBuf>,
    source: Option<Source>,
}

/// The error of another library, or of the operating system, that an [`Error`] came of.
type Source = Box<dyn std::error::Error + Send + Sync>;

impl Error {
    /// A wrong setting or argument.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Usage, message)
    }

    /// An input that cannot be used.
    pub fn input(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Input, message)
    }

    /// A run that cannot go on.
    pub fn failed(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Failed, message)
    }

    /// An object of which nothing is left.
    pub fn vanished(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Vanished, message)
    }

    /// A run some of whose parts failed.
    pub fn partly(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Partly, message)
    }

    /// A run that a signal ended.
    #[must_use]
    pub fn interrupted(signal: i32) -> Self {
        Self::new(ErrorKind::Interrupted { signal }, "interrupted; nothing is left that looks complete and is not")
    }

    /// An input/output failure of the operating system while doing `what`.
    #[must_use]
    pub fn from_io(what: &str, error: &io::Error) -> Self {
        Self::failed(format!("{what}: {error}")).caused_by_io(error)
    }

    /// Keeps the error that this one came of, whose words are part of the message already.
    #[must_use]
    pub fn caused_by(mut self, source: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        self.source.get_or_insert_with(|| source.into());
        self
    }

    /// The same of an error of the operating system that is only lent: what is kept says the same, and has its number.
    #[must_use]
    pub fn caused_by_io(self, error: &io::Error) -> Self {
        self.caused_by(match error.raw_os_error() {
            Some(number) => io::Error::from_raw_os_error(number),
            None => io::Error::new(error.kind(), error.to_string()),
        })
    }

    fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        let mut message = message.into();
        // What files and other libraries say may hold anything; a message is one line and moves no cursor. A run that
        // failed in part lists its reasons, each a message of its own.
        if kind != ErrorKind::Partly {
            message = one_line(message);
        }
        Self { kind, message, path: None, source: None }
    }

    /// Names the file that the error concerns; the first name given stays.
    #[must_use]
    pub fn at(mut self, path: &Path) -> Self {
        // A signal concerns the run, whatever it was doing.
        if matches!(self.kind, ErrorKind::Interrupted { .. }) {
            return self;
        }
        self.path.get_or_insert_with(|| path.to_path_buf());
        self
    }

    /// The error in other words.
    #[must_use]
    pub(crate) fn reworded(mut self, words: impl FnOnce(&str) -> String) -> Self {
        self.message = words(&self.message);
        self
    }

    /// The kind of failure.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// The file the error concerns, where there is one.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// The exit code of the design: 1 the run failed, 2 unusable input or usage, 3 a part of it failed, 130 and 143 interrupted.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self.kind {
            ErrorKind::Usage | ErrorKind::Input => 2,
            ErrorKind::Failed | ErrorKind::Vanished => 1,
            ErrorKind::Partly => 3,
            ErrorKind::Interrupted { signal } => u8::try_from(128 + signal).unwrap_or(130),
        }
    }
}

/// A text from elsewhere, a file's name or what stands in it, as it may be told: on one line, moving no cursor.
#[must_use]
pub fn one_line(text: String) -> String {
    let shown = |c: char| if c.is_control() { c.escape_debug().to_string() } else { c.to_string() };
    if text.contains(char::is_control) { text.chars().map(shown).collect() } else { text }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.path {
            Some(path) => write!(f, "{}: {}", one_line(path.display().to_string()), self.message),
            None => f.write_str(&self.message),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.source.as_ref().map(|source| -> &(dyn std::error::Error + 'static) { source.as_ref() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_an_error_came_of_is_kept() {
        use std::error::Error as _;
        let missing = std::fs::read("/there is no such file").unwrap_err();
        let error = Error::from_io("cannot be read", &missing).at(Path::new("a.tif"));
        let source = error.source().and_then(|source| source.downcast_ref::<io::Error>()).unwrap();
        assert_eq!((source.kind(), source.raw_os_error()), (io::ErrorKind::NotFound, missing.raw_os_error()));
        assert_eq!(error.to_string(), format!("a.tif: cannot be read: {missing}"));
        let made = Error::from_io("cannot be read", &io::Error::new(io::ErrorKind::InvalidData, "no UTF-8"));
        assert_eq!(made.source().unwrap().to_string(), "no UTF-8");
        assert!(Error::input("is empty").source().is_none());
    }

    #[test]
    fn messages_are_one_line_whatever_they_quote() {
        let error = Error::input("expected '>' not '\n', then \u{1b}[2J \u{b5}m").at(Path::new("a\r\n.tif"));
        assert_eq!(error.to_string(), r"a\r\n.tif: expected '>' not '\n', then \u{1b}[2J µm");
    }
}
