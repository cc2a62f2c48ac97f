"""scripts/bench_labels: five labelled clouds on one grid, this program and others that keep the nearest source, in turn."""

import argparse
import json
import os
import statistics
import subprocess
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
from bioimage_cpp import distance as bioimage
from scipy.ndimage import distance_transform_edt

from common import page, shapes

CENTRES = ((0.28, 0.3, 0.3), (0.72, 0.28, 0.35), (0.5, 0.52, 0.6), (0.27, 0.75, 0.7), (0.75, 0.75, 0.65))
AXES = ((0.16, 0.12, 0.14), (0.13, 0.16, 0.12), (0.12, 0.14, 0.15), (0.15, 0.13, 0.12), (0.16, 0.14, 0.13))
POINTS = 20_000


def clouds(n):
    """Five ellipsoids of evenly spread points, in voxels of n^3."""
    at = np.arange(POINTS) + 0.5
    lift, turn = np.arccos(1 - 2 * at / POINTS), np.pi * (1 + 5**0.5) * at
    unit = np.stack([np.cos(turn) * np.sin(lift), np.sin(turn) * np.sin(lift), np.cos(lift)], axis=1)
    return [(unit * axes + centre) * (n - 1) for centre, axes in zip(CENTRES, AXES)]


def ours(command, flags, files, n, folder):
    """Seconds by stage of a run that writes no field."""
    report = folder / "report.json"
    grid = ["--origin", "0,0,0", "--shape", f"{n},{n},{n}", "--spacing", "1", "--threads", "2"]
    words = [os.environ["STRANDLINE"], command, *files, *grid, *flags, "-q", "-o", "none", "--overwrite"]
    subprocess.run(list(map(str, [*words, "--report", report])), check=True)
    return {stage["name"]: stage["seconds"] for stage in json.loads(report.read_text())["stages"]}


def rasterised(sets, n):
    """0 at the voxels of all points: what the others take."""
    mask = np.ones((n, n, n), np.uint8)
    for points in sets:
        x, y, z = np.rint(points).astype(int).T
        mask[z, y, x] = 0
    return mask


def timed(call):
    started = time.monotonic()
    call()
    return time.monotonic() - started


def main():
    parser = argparse.ArgumentParser(prog="scripts/bench_labels", description=__doc__)
    parser.add_argument("--edge", type=int, default=512, help="voxels along each axis (512)")
    parser.add_argument("--rounds", type=int, default=3, help="how often each is run, in turn (3)")
    settings = parser.parse_args()
    n = settings.edge
    sets = clouds(n)
    mask = rasterised(sets, n)
    runs = {}
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"cloud-{k}.ply" for k in range(len(sets))]
        for path, points in zip(files, sets):
            shapes.write_cloud(path, points)
        for _ in range(settings.rounds):
            for method in ("vdt", "fsm"):
                for name, flags in (("distance", []), ("with labels", ["--labels"])):
                    stages = ours("distance", ["--method", method, *flags], files, n, Path(folder))
                    runs.setdefault((method, name), []).append(stages)
            for labels in ("tracked", "exact"):
                stages = ours("middle", ["--labels", labels], files, n, Path(folder))
                runs.setdefault(("middle", labels), []).append(stages)
            call = {"return_indices": True, "number_of_threads": 2}
            seconds = timed(lambda: bioimage.distance_transform(mask, **call))
            runs.setdefault(("bioimage", ""), []).append({"distance": seconds})
        seconds = timed(lambda: distance_transform_edt(mask, return_indices=True))
        runs["scipy", ""] = [{"distance": seconds}]
    median = {
        key: {stage: statistics.median(run.get(stage, 0.0) for run in found) for stage in found[0]}
        for key, found in runs.items()
    }

    def row(name, key, stages, beside):
        parts = [median[key].get(stage, 0.0) for stage in stages]
        other = sum(median[beside].get(stage, 0.0) for stage in stages)
        return [name, *(f"{part:.2f}" if part else "" for part in parts), f"{sum(parts):.2f}", f"{sum(parts) / other:.2f}"]

    solve = ("distance", "read out")
    label = ("distance", "exact labels", "read out")
    costs = [
        row(f"{method} {name}", (method, name), solve, (method, "distance"))
        for method in ("vdt", "fsm")
        for name in ("distance", "with labels")
    ]
    modes = [row(f"--labels {mode}", ("middle", mode), label, ("middle", "tracked")) for mode in ("tracked", "exact")]
    peers = [
        row("strandline, vdt with labels", ("vdt", "with labels"), solve, ("vdt", "with labels")),
        row(f"bioimage-cpp {version('bioimage-cpp')}, exact transform, indices", ("bioimage", ""), solve, ("vdt", "with labels")),
        row(f"scipy {version('scipy')}, distance_transform_edt, indices", ("scipy", ""), solve, ("vdt", "with labels")),
    ]
    program = subprocess.run([os.environ["STRANDLINE"], "--version"], capture_output=True, text=True).stdout.split()[-1]
    text = (
        f"## Labels: five clouds of {POINTS:,} points, {n}^3\n\n"
        f"{page.circumstances(program)}\n\n"
        f"Medians of {settings.rounds} rounds in which all take turns, seconds, two threads (scipy has one, and one round). `read out` looks\n"
        "at every voxel once more: second look, largest distance, voxels of each label. No field is written. The others take\n"
        "the points rounded to voxels, rounding not timed.\n\n"
        + page.table(["", "distance", "read out", "both", "beside the first"], costs[:2])
        + "\n\n"
        + page.table(["", "distance", "read out", "both", "beside the first"], costs[2:])
        + "\n\n"
        + page.table(["middle", "distance", "exact labels", "read out", "all", "beside the first"], modes)
        + "\n\n"
        + page.table(["", "distance", "read out", "both", "beside the first"], peers)
    )
    page.write_part(page.ROOT / "docs" / "performance.md", "scripts/bench_labels", text)
    print(text)


if __name__ == "__main__":
    main()
