"""The embryo of Kósa's PhD thesis, section 5.2, on its stand-in: how well and how fast, and what settings and marks do."""

import subprocess
import time

import numpy as np
import tifffile
import zarr

from common import page

LEVEL = "labels/segmentation/0"
# Seconds that the thesis prints for the inner and the outer tissue, by threads.
PRINTED = {1: (1017, 1420), 6: (448, 599)}
PAPERS = ["--start", "flood", "--image", "edge", "--smoothing", "heat"]
# What each is multiplied by for the papers' way.
STUDY = (
    ("theta", (0.25, 0.5, 1, 2, 4)),
    ("rho", (0, 0.1, 0.3, 0.6, 1)),
    ("k", (100, 650, 5000)),
    ("sigma", (0.25, 0.5, 1, 2)),
    ("delta", (0, 0.02, 0.05, 0.1, 0.2)),
)
EVERY, MARKS = (1, 2, 3, 6, 12), (40, 20, 10, 5)


def section(setting):
    """All tables as Markdown."""
    folder = setting.data / "embryo-like" if setting.data else None
    title = "## The embryo (Kósa PhD, sec. 5.2)\n\n"
    if not folder or not folder.is_dir():
        return f"{title}No folder `embryo-like` among the data: this part was left out."
    stack = Stack(setting, folder)
    return (
        f"{title}A stand-in for the mouse embryo of the thesis, of its size (512 x 512 x 58): two nested tissues, 40 marks a slice with\n"
        "1.2 pixels of jitter. Dice with the truth: the inner tissue, and both as one body.\n\n"
        f"{methods(stack)}\n\n### Settings of the papers' way\n\n`--start flood --image edge --smoothing heat`; one setting is changed at a "
        f"time, all marks.\n\n{study(stack)}\n\n### How few marks are enough\n\nEvery n-th slice, and so many marks of an outline; with no flag. "
        f"The thesis names two hours of marking for a tissue.\n\n{fewer(stack)}"
    )


class Stack:
    """Stack, truth and marks, and runs on them."""

    def __init__(self, setting, folder):
        self.program, self.scratch = setting.program.path, setting.scratch
        self.image, self.truth = folder / "stack.tif", tifffile.imread(folder / "truth.tif")
        self.header = (folder / "marks.csv").read_text(encoding="ascii").splitlines()[0]
        self.marks = np.loadtxt(folder / "marks.csv", delimiter=",", skiprows=1)

    def run(self, flags=(), every=1, marks=40):
        """Dice of the inner tissue and of both, and seconds of the whole command; or the sentence of a refusal."""
        points, store = self.scratch / "marks.csv", self.scratch / "embryo.zarr"
        np.savetxt(points, self.chosen(every, marks), "%g", delimiter=",", header=self.header, comments="")
        command = [self.program, "segment", str(self.image), "--points", str(points), "-q", "-o", str(store), "--overwrite"]
        started = time.monotonic()
        done = subprocess.run([*command, *flags], capture_output=True, text=True, check=False)
        seconds = time.monotonic() - started
        if done.returncode:
            return done.stderr.strip()
        labels = np.asarray(zarr.open_array(str(store / LEVEL), mode="r")[:])
        return dice(labels == 1, self.truth == 1), dice(labels > 0, self.truth > 0), seconds

    def chosen(self, every, marks):
        """Every n-th slice of each object, and as many marks of each contour, in their order."""
        kept = []
        for number in np.unique(self.marks[:, 0]):
            rows = self.marks[self.marks[:, 0] == number]
            for z in np.unique(rows[:, 4])[every // 2 :: every]:
                contour = rows[rows[:, 4] == z]
                kept.append(contour[np.linspace(0, len(contour), marks, endpoint=False).astype(int)])
        return np.concatenate(kept)


def dice(a, b):
    return 2 * np.count_nonzero(a & b) / (np.count_nonzero(a) + np.count_nonzero(b))


def cells(found):
    """Cells of a table, or dashes and why."""
    if isinstance(found, str):
        return ["-", "-", "refused"]
    return [f"{found[0]:.3f}", f"{found[1]:.3f}", f"{found[2]:.1f}"]


def methods(stack):
    rows = [[f"thesis, threads: {threads}", "", "", " + ".join(map(str, times))] for threads, times in PRINTED.items()]
    for name, flags in (("the papers' way", PAPERS), ("no flag", []), ("the papers' way, --threads 1", [*PAPERS, "--threads", "1"])):
        rows.append([name, *cells(stack.run(flags))])
    return page.table(["", "inner", "both", "seconds"], rows)


def study(stack):
    rows = []
    for name, values in STUDY:
        for value in values:
            rows.append([f"`--{name} {value}`", *cells(stack.run([*PAPERS, f"--{name}", str(value)]))])
    return page.table(["setting", "inner", "both", "seconds"], rows)


def fewer(stack):
    rows = []
    for every in EVERY:
        for marks in MARKS:
            rows.append([every, marks, len(stack.chosen(every, marks)), *cells(stack.run(every=every, marks=marks))])
    return page.table(["every n-th slice", "marks an outline", "marks in all", "inner", "both", "seconds"], rows)
