//! What is wrong with a list of jobs: all of it is told at once, each with its line, before anything runs.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

use crate::cli::terminal::log;
use crate::error::{Error, Result, one_line};

/// Problems by line.
#[derive(Debug, Default)]
pub(crate) struct Problems(BTreeSet<(usize, String)>);

impl Problems {
    pub(crate) fn add(&mut self, line: usize, text: impl Into<String>) {
        self.0.insert((line, one_line(text.into())));
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Tells all of them on stderr.
    ///
    /// # Errors
    /// When there are any.
    pub(crate) fn refuse(&self, path: &Path) -> Result<()> {
        let name = one_line(path.display().to_string());
        for (line, text) in &self.0 {
            if log::is_json() {
                log::event("problem", serde_json::json!({ "file": name, "line": line, "text": text }));
            } else {
                // Nobody is left to tell when stderr is closed.
                let _ = writeln!(std::io::stderr(), "{name}:{line}: {text}");
            }
        }
        match self.0.len() {
            0 => Ok(()),
            1 => Err(Error::usage("1 problem, told above; nothing was run").at(path)),
            many => Err(Error::usage(format!("{many} problems, told above; nothing was run")).at(path)),
        }
    }
}
