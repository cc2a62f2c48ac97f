//! A Python with the readers that our stores are checked with.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use super::{is_ci, say_skipped};

/// The interpreter that `STRANDLINE_TEST_PYTHON` names, or one in `target/test-venv` with the packages of
/// `scripts/requirements-test.txt`. None, with the reason printed, when those cannot be installed here; with `CI=true`
/// that is a failure.
pub(crate) fn interpreter() -> Option<&'static Path> {
    static FOUND: OnceLock<Option<PathBuf>> = OnceLock::new();
    let find = || match std::env::var_os("STRANDLINE_TEST_PYTHON") {
        Some(named) => Some(named.into()),
        None => prepare().map_or_else(|reason| unavailable(&reason), Some),
    };
    FOUND.get_or_init(find).as_deref()
}

/// Runs a script of `scripts/` and returns what it printed, as a failure where it failed.
pub(crate) fn run_script(interpreter: &Path, script: &str, arguments: &[&Path]) -> Result<String, String> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts").join(script);
    let output = Command::new(interpreter).arg(script).args(arguments).output().map_err(|error| error.to_string())?;
    let [printed, complaint] = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    if output.status.success() { Ok(printed) } else { Err(printed + &complaint) }
}

fn prepare() -> Result<PathBuf, String> {
    let wanted = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/requirements-test.txt");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("test-venv");
    let (python, installed) = (folder.join("bin/python"), folder.join("installed.txt"));
    let requirements = fs::read_to_string(&wanted).map_err(|error| error.to_string())?;
    if fs::read_to_string(&installed).is_ok_and(|have| have == requirements) {
        return Ok(python);
    }
    run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))?;
    // Bytecode is made of what is imported, which is little of it.
    let install = ["-m", "pip", "install", "--quiet", "--no-compile", "--disable-pip-version-check", "--requirement"];
    run(Command::new(&python).args(install).arg(&wanted))?;
    fs::write(&installed, requirements).map_err(|error| error.to_string())?;
    Ok(python)
}

fn run(command: &mut Command) -> Result<(), String> {
    let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
    let complaint = String::from_utf8_lossy(&output.stderr);
    if output.status.success() { Ok(()) } else { Err(format!("{command:?}: {complaint}")) }
}

fn unavailable(reason: &str) -> Option<PathBuf> {
    assert!(!is_ci(), "the readers cannot be installed: {reason}");
    say_skipped(&format!("the readers cannot be installed: {reason}"));
    None
}
