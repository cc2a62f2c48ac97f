"""Stacks that are read: nuclei of a mouse embryo, and the stand-in for the papers' embryo. Absent ones are None."""

import numpy as np
import tifffile
from scipy import ndimage

from .volume import Volume, read_outlines


def mouse(folder):
    """Eight nuclei of a mouse embryo (Tokuoka et al. 2020), truth by its authors."""
    stack, truth = folder / "stacks/mouse-8cell-raw.tif", folder / "stacks/mouse-8cell-truth-mask.tif"
    if not (stack.exists() and truth.exists()):
        return None
    labels, _ = ndimage.label(tifffile.imread(truth) != 0)
    return Volume("mouse", tifffile.imread(stack), (1.0, 1.0, 2.18), labels)


def embryo(folder):
    """Two nested tissues; the outer object is ring and inner together. Marks of its own: all, and every sixth slice."""
    folder = folder / "embryo-like"
    if not all((folder / name).exists() for name in ("stack.tif", "marks.csv", "truth.tif")):
        return None
    truth, spacing = tifffile.imread(folder / "truth.tif"), (0.5, 0.5, 1.0)
    marks = read_outlines(folder / "marks.csv")
    slices = np.unique([outline.contour for outline in marks])[::6]
    sixth = [outline for outline in marks if outline.contour in slices]
    return Volume(
        "embryo",
        tifffile.imread(folder / "stack.tif"),
        spacing,
        truth,
        {1: (1,), 2: (1, 2)},
        {"all": marks, "sixth": sixth},
    )
