"""scripts/try_cases: every case below a folder, each run in a copy, with what came out and a table at the end.

A case is a folder that holds a file `cmd`: the arguments of `strandline`, one run a line, run in that folder. Lines that begin
with # are left out. Exit code 1 when a run panicked, hung, was ended by a signal, or changed a file of its case.
"""

import argparse
import fnmatch
import os
import sys
import tempfile
from pathlib import Path

from common import page

from . import runs

# Lines of each stream that are shown, half from the start and half from the end, and characters of each.
LINES, WIDTH = 12, 240
# Characters of a run's one line in the table.
SAID = 160


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/try_cases", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="folder of cases, or one case")
    parser.add_argument("--only", action="append", metavar="NAME", help="cases of this name or pattern (0*); repeatable")
    parser.add_argument("--limit", type=float, default=120, metavar="SECONDS", help="end a run after this long (120)")
    parser.add_argument("--full", action="store_true", help="all of what came out, not a few lines")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="leave the copies with all outputs there")
    return parser.parse_args()


def cut(text, full):
    """The text's lines, or the first and last of them."""
    lines = text.rstrip().splitlines()
    if full:
        return lines
    if len(lines) > LINES:
        half = LINES // 2
        lines = [*lines[:half], f"... {len(lines) - 2 * half} lines more (--full)", *lines[-half:]]
    return [line if len(line) <= WIDTH else line[:WIDTH] + " ..." for line in lines]


def code(run):
    return "none" if run.code is None else str(run.code)


def show(run, full):
    print(f"$ strandline {run.line}")
    for name, text in (("out", run.out), ("err", run.err)):
        for line in cut(text, full):
            print(f"  {name} | {line}")
    print(f"  exit {code(run)}, {run.seconds:.2f} s" + "".join(f"  *** {fault} ***" for fault in run.faults), flush=True)


def try_case(program, case, name, place, settings):
    """Runs all lines of a case, one after the other, in one copy of it."""
    runs.copy(case, place)
    inputs = runs.digests(place)
    found = []
    for line in runs.commands(case):
        run = runs.run(program, name, line, place, settings.limit)
        run.changed = runs.changes(inputs, place)
        # A file is told once, by the run that changed it.
        inputs = {path: digest for path, digest in inputs.items() if path not in run.changed}
        show(run, settings.full)
        found.append(run)
    return found


def said(run):
    """What matters most of a run in one line: a fault, the error, its notes, or how its output ends."""
    if run.faults:
        return "; ".join(run.faults)
    lines = [line.strip() for line in run.err.splitlines() if line.strip()]
    if run.code:
        return lines[-1] if lines else ""
    notes = [line for line in lines if line.startswith("note:")]
    return " / ".join(notes) or (run.out.strip().splitlines() or [""])[-1].strip()


def row(run):
    text = said(run)
    text = text if len(text) <= SAID else text[:SAID] + " ..."
    return [run.case, run.line[:60], code(run), f"{run.seconds:.2f}", text.replace("|", "\\|")]


def main():
    settings = arguments()
    if not settings.folder.is_dir():
        sys.exit(f"{settings.folder} is not a folder")
    root = settings.folder.resolve()
    program = str(Path(os.environ["STRANDLINE"]).resolve())
    found = []
    with tempfile.TemporaryDirectory(prefix="strandline-cases-") as scratch:
        place = settings.keep or Path(scratch)
        for case in runs.cases(root):
            name = str(case.relative_to(root)) if case != root else root.name
            if settings.only and not any(fnmatch.fnmatch(name, pattern) for pattern in settings.only):
                continue
            print(f"\n== {name}")
            found += try_case(program, case, name, (place / name).resolve(), settings)
    if not found:
        sys.exit(f"no case below {settings.folder}: a case is a folder with a file named {runs.COMMANDS}")
    print("\n" + page.table(["case", "run", "exit", "seconds", "what it said last, or what went wrong"], map(row, found)))
    bad = [run for run in found if run.faults]
    print(f"\n{len(found)} runs, {len(bad)} of them panicked, hung, were killed or changed an input.")
    for run in bad:
        print(f"  {run.case}: strandline {run.line}: {'; '.join(run.faults)}")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
