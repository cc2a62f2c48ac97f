//! `strandline verify`: checks a store, a line a check; with `--rerun` the run that wrote it, too.

mod again;
mod settings;

use std::sync::Arc;

use serde_json::json;

use crate::cli::args::common::LogArg;
use crate::cli::args::verify::VerifyArgs;
use crate::cli::print;
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::{log, signals};
use crate::error::{Error, Result, one_line};
use crate::io::ome_zarr::is_store;
use crate::job::resources::Resources;
use crate::pipeline::verify::{Check, Fault, verify};
use again::Again;

/// Runs the command.
pub(crate) fn run(args: &VerifyArgs) -> Result<()> {
    let store = &args.store;
    if !is_store(store) {
        let what = if store.exists() { "is no Zarr store" } else { "there is no such store" };
        return Err(Error::usage(what).at(store));
    }
    if let Some(scratch) = args.scratch.as_ref().filter(|scratch| !scratch.is_dir()) {
        return Err(Error::usage("there is no such folder for the second run; make it first").at(scratch));
    }
    let again = args.rerun.then(|| Again::of(store)).transpose()?;
    let cancel = signals::cancel_on_signals()?;
    let resources = Resources::new(args.memory, args.threads, None, Some(store))?;
    let console = Arc::new(Console::new(Voice::told(args.log, args.quiet, false)));
    let engine = resources.engine(&cancel, console.clone())?;
    let (mut made, mut wrong, mut printed) = (0, 0, Ok(()));
    let mut tell = |check: Check| {
        console.clear();
        made += 1;
        wrong += u32::from(!check.is_ok());
        let told = told(args, &check);
        if printed.is_ok() {
            printed = told;
        }
    };
    let result = verify(&engine, store, &mut tell).and_then(|()| settings::check(store));
    console.clear();
    result?.map(&mut tell);
    if let Some(again) = again {
        let result = again::rerun(again, args, &engine, &cancel, &console);
        console.clear();
        tell(result?);
    }
    printed?;
    if wrong > 0 {
        return Err(Error::failed(format!("{wrong} of {made} checks found something wrong")).at(store));
    }
    Ok(())
}

/// Tells what came of a check.
fn told(args: &VerifyArgs, check: &Check) -> Result<()> {
    if args.log == LogArg::Json {
        let faults: Vec<_> = check.faults.iter().map(as_json).collect();
        let (name, told, ok, more) = (&check.name, &check.told, check.is_ok(), check.more);
        log::event("check", json!({ "check": name, "ok": ok, "told": told, "faults": faults, "more": more }));
        return Ok(());
    }
    if check.is_ok() {
        return if args.quiet { Ok(()) } else { print(&format!("ok     {}: {}\n", check.name, check.told)) };
    }
    let lines = check.faults.iter().map(|fault| format!("wrong  {}: {}\n", check.name, in_words(fault)));
    let more = (check.more > 0).then(|| format!("wrong  {}: {} more\n", check.name, check.more));
    print(&lines.chain(more).collect::<String>())
}

fn as_json(fault: &Fault) -> serde_json::Value {
    json!({ "file": fault.file, "voxel_xyz": fault.voxel, "text": fault.text })
}

fn in_words(fault: &Fault) -> String {
    let file = fault.file.as_ref().map_or(String::new(), |file| format!("{file}: "));
    let voxel = fault.voxel.map_or(String::new(), |[x, y, z]| format!("voxel {x}, {y}, {z} "));
    one_line(format!("{file}{voxel}{}", fault.text))
}
