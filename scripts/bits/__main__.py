"""scripts/compare_bits: two programs over many settings; which bits of their level-0 arrays and meshes differ.

Every run of `STRANDLINE` (or the built program) is made again by the program given with --beside, on the same inputs, made
from a seed. Exit code 1 when anything differs.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import zarr

from . import inputs, settings


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/compare_bits", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--beside", type=Path, required=True, metavar="PROGRAM", help="the program to compare with")
    parser.add_argument("--only", metavar="WORDS", help="settings that hold these words")
    return parser.parse_args()


def run(program, line, made, out):
    """Runs one setting; its exit code and what it said last."""
    out.mkdir()
    words = line.format(made=made, out=out).split()
    done = subprocess.run([program, *words, "--quiet"], capture_output=True, text=True, check=False)
    return done.returncode, done.stderr.strip().splitlines()[-1:] if done.returncode else []


def arrays(out):
    """The finest array of each image below a folder, by its path."""
    found = {}
    for document in sorted(out.rglob("0/zarr.json")):
        folder = document.parent
        found[str(folder.relative_to(out))] = zarr.open_array(folder, mode="r")[...]
    return found


def meshes(out):
    """The bytes of each mesh and table below a folder, by its path."""
    files = (path for path in sorted(out.rglob("*")) if path.suffix in {".ply", ".stl", ".obj", ".csv"})
    return {str(path.relative_to(out)): path.read_bytes() for path in files}


def differences(ours, theirs):
    """A few words for each array or mesh that is not equal to the bit."""
    for name in sorted(ours.keys() | theirs.keys()):
        one, other = ours.get(name), theirs.get(name)
        if one is None or other is None:
            yield f"{name}: only {'ours' if other is None else 'theirs'}"
        elif isinstance(one, bytes):
            if one != other:
                yield f"{name}: {len(one)} and {len(other)} bytes"
        elif one.shape != other.shape or one.dtype != other.dtype:
            yield f"{name}: {one.dtype}{one.shape} and {other.dtype}{other.shape}"
        elif one.tobytes() != other.tobytes():
            differ = ~((one == other) | (np.isnan(one) & np.isnan(other)))
            apart = np.abs(one[differ].astype(float) - other[differ].astype(float))
            yield f"{name}: {differ.sum()} of {one.size} voxels, by {apart.max(initial=0):.3g} at most"


def compare(line, programs, made, place):
    """Runs a setting by both programs; what differs."""
    (ours, said), (theirs, they_said) = (run(program, line, made, place / name) for name, program in programs.items())
    if ours != theirs:
        return [f"exit codes {ours} and {theirs}: {' '.join(said + they_said)}"]
    found = [arrays(place / name) | meshes(place / name) for name in programs]
    return list(differences(*found)) if ours == 0 else [f"both exit {ours}: {said}"]


def main():
    options = arguments()
    programs = {"ours": os.environ["STRANDLINE"], "theirs": str(options.beside.resolve())}
    lines = [line for line in settings.all_settings() if not options.only or options.only in line]
    unequal = 0
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "made"
        made.mkdir()
        inputs.make(made)
        for line in lines:
            with tempfile.TemporaryDirectory(dir=folder) as place:
                found = compare(line, programs, made, Path(place))
            unequal += bool(found)
            print(f"{'DIFFERS' if found else 'equal'}  strandline {line}", *found, sep="\n    ", flush=True)
    print(f"{len(lines)} settings, {len(lines) - unequal} equal to the bit")
    sys.exit(1 if unequal else 0)


main()
