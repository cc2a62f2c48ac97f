"""Runs `strandline segment` on a stack and marks, and reads what it wrote."""

import json
import shlex
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import zarr

from reproduction.picture import read_ply

# Exit codes: all objects, nothing solved, some objects refused.
DONE, NOTHING, SOME = 0, 2, 3


@dataclass
class Answer:
    """Labels that a method gave.

    `surfaces[n]` are vertices (x, y, z) and triangles of object n; `claims` counts the objects that hold each voxel
    before labels are dealt out. Either is missing where it cannot be told.
    """

    labels: np.ndarray
    seconds: float
    surfaces: dict = field(default_factory=dict)
    claims: np.ndarray | None = None
    store: Path | None = None
    note: str = ""


def segment(program, volume, folder, flags):
    """One run in `folder`, which holds marks.csv; stack.tif is two folders above."""
    store = folder / "out.zarr"
    spacing = ",".join(f"{step:g}" for step in volume.spacing)
    command = [program.path, "segment", folder.parents[1] / "stack.tif", "--points", folder / "marks.csv", "-o", store]
    command += ["--image-spacing", spacing, "--overwrite", "-q", *shlex.split(flags)]
    started = time.monotonic()
    done = subprocess.run(list(map(str, command)), check=False, capture_output=True, text=True)
    seconds = time.monotonic() - started
    if done.returncode not in (DONE, SOME):
        note = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        return Answer(np.zeros_like(volume.truth, dtype=int), seconds, note=note.removeprefix("strandline: "))
    labels = np.asarray(zarr.open_array(str(store / "labels/segmentation/0"), mode="r")[:])
    return Answer(labels.astype(int), seconds, surfaces(store), claims(store, labels.shape, volume.spacing), store)


def surfaces(store):
    """Meshes of a store by object; a single object has no number in its file's name."""
    found = {}
    for path in sorted((store / "meshes").glob("*.ply")):
        number = path.stem.rpartition("-")[2]
        found[int(number) if number.isdigit() else 1] = read_ply(path)
    return found


def claims(store, shape, spacing):
    """How many level sets hold each voxel (u above 0.5), or None where the store has no level sets."""
    groups = [path.parent for path in sorted((store / "levelset").glob("**/0/zarr.json"))]
    if not groups:
        return None
    count = np.zeros(shape, dtype=int)
    for group in (path.parent for path in groups):
        attributes = json.loads((group / "zarr.json").read_text())["attributes"]["ome"]
        steps = attributes["multiscales"][0]["datasets"][0]["coordinateTransformations"]
        moved = next((step["translation"] for step in steps if step["type"] == "translation"), [0.0] * 3)
        values = np.asarray(zarr.open_array(str(group / "0"), mode="r")[:])
        first = [round(offset / step) for offset, step in zip(moved, spacing[::-1])]
        # A level set's box may reach beyond the image.
        ends = [min(start + extent, size) for start, extent, size in zip(first, values.shape, shape)]
        part = tuple(slice(max(-start, 0), end - start) for start, end in zip(first, ends))
        count[tuple(slice(max(start, 0), end) for start, end in zip(first, ends))] += values[part] > 0.5
    return count
