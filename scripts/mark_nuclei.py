#!/usr/bin/env python3
"""Border points from a truth mask: what a person would click who knew the answer.

    python scripts/mark_nuclei.py mouse-8cell-truth-mask.tif 1,1,2.18 marks.csv

Objects are the 6-connected components of the mask, numbered as `scipy.ndimage.label` numbers them. On every second slice of
an object (counted from its first; `--every`) its outer contour, half way between inside and outside voxels, gets
12 points (`--points`), evenly spaced by arc length and in contour order, each moved by normal jitter of 0.5 voxel per axis in
the plane (`--jitter`, fixed `--seed`). An object in several pieces on one slice is marked on the largest piece only.

Output: `object,contour,x,y,z`; the contour's number is its slice; coordinates are index times spacing.
"""

import argparse

import numpy as np
import tifffile
from scipy import ndimage
from skimage import measure


def outer_contour(plane):
    """Closed polygon (n x 2, row and column, last point equal to the first) around the largest piece of a mask."""
    padded = np.pad(ndimage.binary_fill_holes(plane), 1).astype(np.float64)
    loops = measure.find_contours(padded, 0.5, fully_connected="low")
    return max(loops, key=enclosed_area) - 1.0


def enclosed_area(loop):
    y, x = loop[:, 0], loop[:, 1]
    return 0.5 * abs(np.sum(y[:-1] * x[1:] - y[1:] * x[:-1]))


def evenly_spaced(loop, count):
    """`count` points on a closed polygon, at equal distances along it."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(loop, axis=0), axis=1))])
    wanted = np.arange(count) * (length[-1] / count)
    return np.stack([np.interp(wanted, length, loop[:, axis]) for axis in range(2)], axis=1)


def mark_object(number, mask, first_slice, settings, rng):
    """The CSV rows of one object; `mask` starts at slice `first_slice` of the stack, rows and columns are the stack's."""
    hx, hy, hz = settings.spacing
    for offset in range(0, mask.shape[0], settings.every):
        if not mask[offset].any():
            continue
        z = first_slice + offset
        points = evenly_spaced(outer_contour(mask[offset]), settings.points)
        points += rng.normal(0.0, settings.jitter, points.shape)
        for y, x in points:
            yield f"{number},{z},{x * hx:.3f},{y * hy:.3f},{z * hz:.3f}\n"


def spacing(text):
    values = tuple(float(part) for part in text.split(","))
    if len(values) != 3 or not all(value > 0 for value in values):
        raise argparse.ArgumentTypeError("three positive numbers HX,HY,HZ are needed")
    return values


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mask", help="truth mask (TIFF, not 0 = inside)")
    parser.add_argument("spacing", type=spacing, help="HX,HY,HZ, as given to --image-spacing")
    parser.add_argument("out", help="the CSV file to write")
    parser.add_argument("--every", type=int, default=2, help="mark every N-th slice of an object (2)")
    parser.add_argument("--points", type=int, default=12, help="points per contour (12)")
    parser.add_argument("--jitter", type=float, default=0.5, help="standard deviation in voxels (0.5)")
    parser.add_argument("--seed", type=int, default=8, help="seed of the jitter (8)")
    settings = parser.parse_args()

    labels, count = ndimage.label(tifffile.imread(settings.mask) != 0)
    rng = np.random.default_rng(settings.seed)
    rows = 0
    with open(settings.out, "w", newline="\n", encoding="ascii") as out:
        out.write("object,contour,x,y,z\n")
        for number, box in enumerate(ndimage.find_objects(labels), start=1):
            mask = labels[box[0]] == number
            for row in mark_object(number, mask, box[0].start, settings, rng):
                out.write(row)
                rows += 1
    print(f"{settings.out}: {rows} points on {count} objects")


if __name__ == "__main__":
    main()
