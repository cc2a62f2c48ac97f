"""scripts/reproduce: runs the experiments and writes docs/reproduction.md."""

import argparse
import os
import signal
import sys
import tempfile
import time
from pathlib import Path

from common import page
from common.program import METHODS, Program

from . import cube, embryo, middle, printed, sponge, surface, teddy
from .setting import Setting

SECTIONS = {
    "cube": cube.table_2,
    "cube-times": cube.table_3,
    "teddy": teddy.section,
    "counts": teddy.counted,
    "sponge": sponge.section,
    "middle": middle.section,
    "printed": printed.section,
    "surface": surface.section,
    "embryo": embryo.section,
}
TITLE = """# Reproduction

B. Kósa, K. Mikula: *Direct simple computation of middle surface between 3D point clouds and/or discrete surfaces by
tracking sources in distance function calculation algorithms*, 2023: the tables of its experiments; B. Kósa's
diploma thesis of 2015 ("Kósa 2015") and his PhD thesis ("Kósa PhD"): surfaces from point clouds and images; and what this program gives. Tables
are numbered as printed; what is misprinted in the papers is in [algorithms.md](algorithms.md). A figure that is not the
paper's has its reason below its table; the part `printed` tries the reasons out.
`scripts/reproduce` runs the experiments and writes this page, part by part.

    scripts/reproduce --data FOLDER            # all grids, up to 893 x 1279 x 482
    scripts/reproduce --finest 340             # those of at most 340 points along an axis
    scripts/reproduce --only middle            # one part
    scripts/reproduce --keep FOLDER            # what was run before is taken from there: for runs that are interrupted
    scripts/reproduce --patience 200           # runs that would take longer than so many seconds are left out
"""


def arguments():
    parser = argparse.ArgumentParser(prog="scripts/reproduce", description=__doc__)
    parser.add_argument(
        "--finest", type=int, default=10**9, metavar="N", help="leave out grids of more than N points along an axis"
    )
    parser.add_argument("--only", choices=SECTIONS, action="append", help="only this experiment; may be repeated (all)")
    data = os.environ.get("STRANDLINE_DATA")
    parser.add_argument(
        "--data",
        type=Path,
        default=data and Path(data),
        help=f"folder that holds {teddy.FILE} and embryo-like ($STRANDLINE_DATA)",
    )
    parser.add_argument(
        "--keep", type=Path, metavar="FOLDER", help="keep what runs gave; those that are there are not run again"
    )
    parser.add_argument(
        "--patience",
        type=float,
        default=float("inf"),
        metavar="SECONDS",
        help="leave out runs that would take longer (none)",
    )
    parser.add_argument("--scratch", type=Path, help="folder for temporary fields (the system's)")
    parser.add_argument(
        "--out", type=Path, default=page.ROOT / "docs" / "reproduction.md", help="page to write (docs/reproduction.md)"
    )
    return parser.parse_args()


def main():
    settings = arguments()
    # So that temporary fields go also when the run is ended from outside.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    program = Program()
    methods = program.methods()
    absent = [method for method in METHODS if method not in methods]
    if absent:
        print(f"not in this version: {', '.join(absent)}", flush=True)
    if not settings.out.exists():
        settings.out.parent.mkdir(exist_ok=True)
        settings.out.write_text(TITLE + "\n", encoding="utf-8")
    whole = time.monotonic()
    with tempfile.TemporaryDirectory(dir=settings.scratch) as scratch:
        setting = Setting(
            program, methods, settings.finest, Path(scratch), settings.data, settings.keep, settings.patience
        )
        for name in settings.only or SECTIONS:
            print(name, flush=True)
            started = time.monotonic()
            text = SECTIONS[name](setting)
            minutes = (time.monotonic() - started) / 60
            busy = setting.busy() if "seconds" in text.lower() else ""
            head = f"{page.circumstances(program.version())} This part took {minutes:.0f} minutes.{busy}"
            page.write_part(settings.out, f"scripts/reproduce --only {name}", f"{text}\n\n{head}")
    print(f"{settings.out} in {(time.monotonic() - whole) / 60:.1f} minutes")


if __name__ == "__main__":
    main()
