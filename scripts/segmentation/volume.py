"""What a comparison runs on: a stack, its truth, marks that come with it. Triples are x, y, z; arrays z, y, x."""

from dataclasses import dataclass, field

import numpy as np
import tifffile


@dataclass(frozen=True)
class Outline:
    """Marks of one contour of one object: `points` (n x 3, physical) in a plane across axis `across` (0 x, 1 y, 2 z)."""

    object: int
    contour: int
    across: int
    points: np.ndarray


@dataclass
class Volume:
    """A stack whose objects are known.

    `solids[n]` are the labels whose voxels are object n, in `truth` as in a result: nested objects share voxels.
    `given` are marks that belong to the stack, by name; a stack without such is marked by `marks.py`.
    """

    name: str
    image: np.ndarray
    spacing: tuple
    truth: np.ndarray
    solids: dict = field(default_factory=dict)
    given: dict = field(default_factory=dict)
    surface: object = None
    cells: object = None

    def __post_init__(self):
        if not self.solids:
            self.solids = {int(label): (int(label),) for label in np.unique(self.truth) if label}

    def solid(self, number, labels=None):
        """Mask of an object in the truth, or in the label volume of a result."""
        return np.isin(self.truth if labels is None else labels, self.solids[number])

    def write(self, path):
        tifffile.imwrite(path, self.image, imagej=True, metadata={"axes": "ZYX"})


def read_outlines(path):
    """Outlines on slices from a CSV `object,contour,x,y,z`."""
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    outlines = []
    for number, contour in np.unique(rows[:, :2].astype(int), axis=0):
        points = rows[(rows[:, 0] == number) & (rows[:, 1] == contour), 2:]
        outlines.append(Outline(int(number), int(contour), 2, points))
    return outlines


def write_outlines(path, outlines):
    """The CSV `object,contour,x,y,z` that `--points` reads."""
    with open(path, "w", newline="\n", encoding="ascii") as out:
        out.write("object,contour,x,y,z\n")
        for outline in outlines:
            start = f"{outline.object},{outline.contour}"
            out.writelines(f"{start},{x:.3f},{y:.3f},{z:.3f}\n" for x, y, z in outline.points)
