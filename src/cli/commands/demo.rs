//! `strandline demo`: the built-in stack, from border points to labels, surface and a picture.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Parser;

use super::segment::{Job, Names};
use crate::cli::args::command_line::{Cli, Command};
use crate::cli::args::common::DemoArgs;
use crate::cli::args::survive::Checkpoint;
use crate::cli::args::values::Output;
use crate::cli::print;
use crate::cli::terminal::signals;
use crate::error::{Error, Result};
use crate::exec::SelfComm;
use crate::store::HiddenFolder;

const STACK: &[u8] = include_bytes!("../../../data/arabidopsis-embryo.tif");
const MARKS: &[u8] = include_bytes!("../../../data/arabidopsis-marks.csv");
const CITATION: &str = "Stack: J. Moukhtar et al., PLoS Computational Biology 15(2): e1006771, 2019, \
                        doi:10.1371/journal.pcbi.1006771, CC BY 4.0";

/// Runs the command.
pub(crate) fn run(args: &DemoArgs, typed: &[String]) -> Result<()> {
    let overwrite = args.output.exists();
    if overwrite && !made_by_demo(&args.output) {
        let what = "exists already and was not made by the demo; name another output with -o";
        return Err(Error::usage(what).at(&args.output));
    }
    // Before there is anything that a signal must not leave behind.
    let cancel = signals::cancel_on_signals()?;
    let folder = HiddenFolder::create(&std::env::temp_dir())
        .map_err(|e| Error::from_io("cannot make a temporary folder", &e).at(&std::env::temp_dir()))?;
    let unpack = |name: &str, bytes: &[u8]| -> Result<PathBuf> {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes)
            .map_err(|e| Error::from_io("the built-in data cannot be unpacked", &e).at(&path))?;
        Ok(path)
    };
    let stack = unpack("arabidopsis-embryo.tif", STACK)?;
    let marks = unpack("arabidopsis-marks.csv", MARKS)?;
    let mut segment = segment_args(&stack, &marks)?;
    segment.resources = args.resources.clone();
    segment.output.output = Output::Store(args.output.clone());
    segment.output.overwrite = overwrite;
    segment.output.quiet = args.quiet;
    segment.output.log = args.log;
    segment.output.survive.checkpoint = Some(Checkpoint::Off);
    let names = Names {
        command: "demo",
        image: "the built-in arabidopsis-embryo.tif".into(),
        points: vec!["the built-in arabidopsis-marks.csv".into()],
    };
    let job = Job::new(names, *segment, typed, (cancel, Arc::new(SelfComm)))?;
    job.run(&job.estimate())?;
    if !args.quiet {
        print(&farewell(&args.output))?;
    }
    Ok(())
}

/// The arguments of `segment` with nothing but its defaults.
fn segment_args(stack: &Path, marks: &Path) -> Result<Box<crate::cli::args::common::SegmentArgs>> {
    let words = ["strandline".as_ref(), "segment".as_ref(), stack.as_os_str()];
    let flags = ["--points".as_ref(), marks.as_os_str(), "-o".as_ref(), "none".as_ref()];
    match Cli::try_parse_from(words.into_iter().chain(flags)).map(|cli| cli.command) {
        Ok(Command::Segment(args)) => Ok(args),
        _ => Err(Error::failed("the demo does not know its own command")),
    }
}

fn made_by_demo(store: &Path) -> bool {
    let report = std::fs::read(store.join("report.json")).unwrap_or_default();
    serde_json::from_slice::<serde_json::Value>(&report).is_ok_and(|report| report["command"] == "demo")
}

fn farewell(output: &Path) -> String {
    let store = output.display();
    format!(
        "\npicture  {store}/picture.png\n\
         mesh     {store}/meshes/surface.ply\n\
         report   {store}/report.html\n\n\
         Look at it:        strandline view {store}\n\
         Or in napari:      pip install \"napari[all]\" napari-ome-zarr; napari --plugin napari-ome-zarr {store}\n\
         Your own stack:    strandline segment STACK.tif --points MARKS.csv -o OUT.zarr\n\n\
         {CITATION}\n"
    )
}
