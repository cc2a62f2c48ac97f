"""scripts/check_live: what readers of a live store see, and what it costs to be seen.

A distance and a segmentation are run with --live, while zarr-python reads the store once a second: nothing that it reads may be an
error, and what it reads that is not the fill value must be what the finished store holds. Then runs with and without --live by
turns: seconds of each, and the ratio. Exit code 1 when something was shown that should not have been.
"""

import argparse
import os
import random
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from interrupting.runs import ball_marks, sphere, stack

from .watching import Watcher


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/check_live", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--size", type=int, default=512, help="voxels along the edge of the distance (512)")
    parser.add_argument("--slices", type=int, default=512, help="slices of 2048 x 1024 of the stack (512: 1 GiB)")
    parser.add_argument("--memory", default="2GiB", help="memory of a run (2GiB)")
    parser.add_argument("--pairs", type=int, default=0, help="pairs of runs that are timed (none)")
    parser.add_argument("--only", action="append", metavar="NAME", help="distance or segment alone; repeatable")
    parser.add_argument("--folder", type=Path, help="where inputs and outputs are made [default: $TMPDIR]")
    return parser.parse_args()


def commands(settings, inputs):
    """The runs by name, their inputs written to a folder."""
    sphere(inputs / "ball.xyz", 20_000, 1)
    stack(inputs / "large.tif", 1024, 2 * settings.slices)
    ball_marks(inputs / "large.csv", (512, 512, settings.slices), 200)
    grid = ["--origin=-2,-2,-2", "--spacing", str(4 / settings.size), "--shape", ",".join([str(settings.size)] * 3)]
    memory = ["--memory", settings.memory, "-q", "--overwrite"]
    segment = [f"{inputs}/large.tif", "--points", f"{inputs}/large.csv", "--image-spacing", "1,1,1"]
    return {
        "distance": ["distance", f"{inputs}/ball.xyz", *grid, "--labels", *memory],
        "segment": ["segment", *segment, *memory],
    }


def watch(program, command, store):
    """Runs a command live and reads its store; returns what was seen and the seconds it took."""
    watcher = Watcher(store, random.Random(1))
    started = time.monotonic()
    child = subprocess.Popen([program, *command, "--live", "-o", store])
    while child.poll() is None:
        time.sleep(1)
        watcher.look(time.monotonic() - started)
    seconds = time.monotonic() - started
    if child.returncode != 0:
        raise SystemExit(f"the run failed ({child.returncode})")
    return watcher, seconds


def timed(program, command, store, *flags):
    started = time.monotonic()
    subprocess.run([program, *command, *flags, "-o", store], check=True)
    seconds = time.monotonic() - started
    shutil.rmtree(store)
    return seconds


def main():
    settings = arguments()
    program = os.environ["STRANDLINE"]
    failed = False
    with tempfile.TemporaryDirectory(dir=settings.folder) as place:
        place = Path(place)
        for name, command in commands(settings, place).items():
            if settings.only and name not in settings.only:
                continue
            # No run waits for what others have written to reach the disk.
            os.sync()
            watcher, seconds = watch(program, command, place / "watched.zarr")
            faults = watcher.faults()
            failed |= bool(faults)
            first = "never" if watcher.first_picture is None else f"at {watcher.first_picture / seconds:.0%}"
            print(f"{name}: {seconds:.1f} s, {watcher.looks} looks, {len(watcher.seen)} boxes with values, {len(faults)} faults;")
            print(f"    the coarsest level first held something {first} of the run; told: {watcher.told}")
            for fault in faults[:10]:
                print(f"    {fault}")
            shutil.rmtree(place / "watched.zarr")
            os.sync()
            pairs = [[timed(program, command, place / "timed.zarr", *flags) for flags in ([], ["--live"])] for _ in range(settings.pairs)]
            if pairs:
                plain, live = (statistics.median(times) for times in zip(*pairs, strict=True))
                print(f"    without {plain:.1f} s, with --live {live:.1f} s: {live / plain:.3f}  {pairs}")
    sys.exit(failed)


if __name__ == "__main__":
    main()
