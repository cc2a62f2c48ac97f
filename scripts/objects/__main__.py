"""scripts/bench_objects: small bumpy balls in one made stack, segmented by two builds of the program that take turns."""

import argparse
import json
import os
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import tifffile

SPACING = np.array((1.0, 1.0, 2.0))
ROOM = 28.0
RADII = (6.0, 9.0)
POINTS = 24


class Body:
    """A ball with a few low bumps."""

    def __init__(self, centre, rng):
        self.centre, self.radius = centre, rng.uniform(*RADII)
        self.waves, self.phases = rng.normal(size=(4, 3)) * 2.0, rng.uniform(0, 2 * np.pi, 4)

    def depth(self, places):
        """Distance from the middle as a share of the way to the surface."""
        away = (places - self.centre) / self.radius
        distance = np.linalg.norm(away, axis=-1)
        towards = away / np.maximum(distance, 1e-9)[..., None]
        return distance / (1 + 0.05 * np.cos(towards @ self.waves.T + self.phases).sum(axis=-1))

    def outline(self, z, rng):
        """Where rays from the axis leave the body at a height, jittered as a hand is; none near the poles."""
        angles = 2 * np.pi * np.arange(POINTS) / POINTS
        rays = np.stack([np.cos(angles), np.sin(angles), np.zeros(POINTS)], axis=1)
        axis = np.array([*self.centre[:2], z])
        if self.depth(axis) > 0.85:
            return None
        low, high = np.zeros(POINTS), np.full(POINTS, 2 * self.radius)
        for _ in range(40):
            middle = (low + high) / 2
            inside = self.depth(axis + rays * middle[:, None]) < 1
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        jitter = rng.normal(0.0, 0.3, POINTS)
        return axis + rays * (low + jitter)[:, None]


def made(count, seed, folder):
    """Stack and marks of so many objects, each in a cube of its own."""
    rng = np.random.default_rng(seed)
    across = int(np.ceil(count ** (1 / 3)))
    cubes = [(x, y, z) for z in range(across) for y in range(across) for x in range(across)][:count]
    bodies = [Body((np.array(cube) + 0.5) * ROOM + rng.uniform(-2, 2, 3), rng) for cube in cubes]
    nx, ny, nz = np.round((np.max(cubes, axis=0) + 1) * ROOM / SPACING).astype(int)
    z, y, x = np.meshgrid(*(np.arange(n) for n in (nz, ny, nx)), indexing="ij")
    places = np.stack([x, y, z], axis=-1) * SPACING
    inside = np.zeros((nz, ny, nx), dtype=bool)
    for body in bodies:
        inside |= body.depth(places) < 1
    image = np.where(inside, 400, 100) + rng.normal(0, 20, inside.shape)
    stack, marks = folder / "stack.tif", folder / "marks.csv"
    metadata = {"axes": "ZYX", "spacing": SPACING[2], "unit": "um"}
    resolution = (1 / SPACING[0], 1 / SPACING[1])
    tifffile.imwrite(stack, image.clip(0).astype(np.uint16), imagej=True, metadata=metadata, resolution=resolution)
    lines = ["object,contour,x,y,z"]
    for number, body in enumerate(bodies, start=1):
        for level in range(0, nz, 2):
            outline = body.outline(level * SPACING[2], rng)
            if outline is not None:
                lines += [f"{number},{level},{px:.4f},{py:.4f},{pz:.4f}" for px, py, pz in outline]
    marks.write_text("\n".join(lines) + "\n")
    return stack, marks


def run(program, stack, marks, threads, folder):
    """Seconds of a run that writes no field, and how many objects it solved."""
    report = folder / "report.json"
    words = [program, "segment", stack, "--points", marks, "--threads", threads, "-q", "-o", "none", "--report", report]
    started = time.monotonic()
    subprocess.run([*map(str, words), "--overwrite"], check=True)
    seconds = time.monotonic() - started
    return seconds, len(json.loads(report.read_text())["result"]["objects"])


def main():
    parser = argparse.ArgumentParser(prog="scripts/bench_objects", description=__doc__)
    parser.add_argument("--beside", type=Path, help="another build of the program [default: the same, which tells the noise]")
    parser.add_argument("--objects", type=int, default=16, help="how many (16)")
    parser.add_argument("--seed", type=int, default=16, help="of shapes, marks and noise (16)")
    parser.add_argument("--rounds", type=int, default=7, help="how often each is run, in turn (7)")
    parser.add_argument("--threads", type=int, default=2, help="(2)")
    settings = parser.parse_args()
    this = Path(os.environ["STRANDLINE"])
    programs = {"this": this, "beside": settings.beside or this}
    seconds = {name: [] for name in programs}
    with tempfile.TemporaryDirectory() as folder:
        stack, marks = made(settings.objects, settings.seed, Path(folder))
        for turn in range(settings.rounds):
            # Who comes first changes, so that neither always finds the machine as the other left it.
            for name in sorted(programs, reverse=turn % 2 == 1):
                found, solved = run(programs[name], stack, marks, settings.threads, Path(folder))
                assert solved == settings.objects, f"{name}: {solved} objects solved of {settings.objects}"
                seconds[name].append(found)
    for name, program in programs.items():
        runs = seconds[name]
        print(f"{name:6}  {statistics.median(runs):.3f} s  ({min(runs):.3f} to {max(runs):.3f})  {program}")
    ratio = statistics.median(a / b for a, b in zip(seconds["this"], seconds["beside"]))
    print(f"this / beside, median of {settings.rounds} rounds: {ratio:.3f}")


if __name__ == "__main__":
    main()
