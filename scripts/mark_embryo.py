#!/usr/bin/env python3
"""Border points for the demo stack: the embryo's outer border on every third slice.

    python scripts/mark_embryo.py data/arabidopsis-embryo.tif data/arabidopsis-marks.csv

Stands in for a person who clicks along the outer wall of the embryo proper; the suspensor (the stalk that leaves the
stack at the lower right) is left out. The same input gives the same bytes. In this order:

1. Rough shape: Gaussian smoothing (2 voxels), everything brighter than ROUGH_GREY, largest component, holes filled slice
   by slice.
2. Suspensor off: morphological opening with a ball of OPENING voxels radius, wider than the suspensor, narrower than
   the embryo.
3. Border: on each slice rays run from the rough shape's centroid. Coming from outside, the border is where the image
   (smoothed by 1 voxel) first exceeds half of the brightest value on the ray's outer part, that is the outer flank of the wall.
   A circular median and a short Gaussian along the angle take out stray rays.
4. Slices on which the border is shorter than MIN_PERIMETER, or the wall dimmer than MIN_WALL, are dropped.
5. Points: 24 to 40 a contour, evenly spaced by arc length, about 5 voxels apart, in contour order, each moved by
   normal jitter (JITTER voxels per axis in the plane, fixed seed) like a hand's clicks.

Output: `object,contour,x,y,z`; the contour's number is its slice; coordinates are index times spacing (0.35 um).
"""

import argparse

import numpy as np
import tifffile
from scipy import ndimage

SPACING = 0.35  # um, in x, y and z; see data/README.md
EVERY = 3  # slices
ROUGH_GREY = 12.0
OPENING = 24.0  # voxels
RAYS = 180
WALL_DEPTH = 9.0  # voxels inwards from the rough border within which the wall lies
MIN_PERIMETER = 50.0  # voxels
MIN_WALL = 28.0  # grey value, median over the rays
POINT_DISTANCE = 5.0  # voxels
JITTER = 0.5  # voxels, standard deviation
SEED = 20190207


def rough_shape(stack):
    """Mask of the embryo proper, some voxels too large all round."""
    bright = ndimage.gaussian_filter(stack, 2.0) > ROUGH_GREY
    labels, _ = ndimage.label(bright)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    mask = labels == sizes.argmax()
    mask = np.stack([ndimage.binary_fill_holes(plane) for plane in mask])
    core = ndimage.distance_transform_edt(mask) > OPENING
    return ndimage.distance_transform_edt(~core) <= OPENING


def ray_profiles(plane, mask):
    """Centre, angles, start radii and grey profiles (inwards, 0.25 voxel steps) of one slice's rays."""
    centre = np.array(ndimage.center_of_mass(mask))
    angles = np.arange(RAYS) * (2.0 * np.pi / RAYS)
    direction = np.stack([np.sin(angles), np.cos(angles)])
    radii = np.arange(0.0, max(plane.shape), 0.25)
    along = centre[:, None, None] + direction[:, :, None] * radii
    inside = ndimage.map_coordinates(mask.astype(np.float64), along, order=1) >= 0.5
    start = radii[inside.shape[1] - 1 - np.argmax(inside[:, ::-1], axis=1)] + 1.0
    depth = np.arange(0.0, WALL_DEPTH, 0.25)
    at = centre[:, None, None] + direction[:, :, None] * np.maximum(start[:, None] - depth, 0.0)
    return centre, angles, start, ndimage.map_coordinates(plane, at, order=1, mode="nearest")


def border(plane, mask):
    """Closed polygon (RAYS x 2, row and column in voxels) of the outer border, and the wall's median grey value."""
    centre, angles, start, profiles = ray_profiles(plane, mask)
    wall = profiles.max(axis=1)
    radius = start - 0.25 * np.argmax(profiles >= 0.5 * wall[:, None], axis=1)
    radius = ndimage.median_filter(radius, size=15, mode="wrap")
    radius = ndimage.gaussian_filter1d(radius, 2.0, mode="wrap")
    return centre + radius[:, None] * np.stack([np.sin(angles), np.cos(angles)], axis=1), float(np.median(wall))


def perimeter(polygon):
    return float(np.linalg.norm(np.roll(polygon, -1, axis=0) - polygon, axis=1).sum())


def evenly_spaced(polygon, count):
    """`count` points on a closed polygon, at equal distances along it."""
    closed = np.vstack([polygon, polygon[:1]])
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    wanted = np.arange(count) * (length[-1] / count)
    return np.stack([np.interp(wanted, length, closed[:, axis]) for axis in range(2)], axis=1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("image", help="the demo stack (TIFF)")
    parser.add_argument("out", help="the CSV file to write")
    arguments = parser.parse_args()

    stack = tifffile.imread(arguments.image).astype(np.float64)
    mask = rough_shape(stack)
    smooth = ndimage.gaussian_filter(stack, 1.0)
    rng = np.random.default_rng(SEED)
    contours = points_written = 0
    with open(arguments.out, "w", newline="\n", encoding="ascii") as out:
        out.write("object,contour,x,y,z\n")
        for z in range(0, stack.shape[0], EVERY):
            if not mask[z].any():
                continue
            polygon, wall = border(smooth[z], mask[z])
            if perimeter(polygon) < MIN_PERIMETER or wall < MIN_WALL:
                continue
            count = int(np.clip(round(perimeter(polygon) / POINT_DISTANCE), 24, 40))
            points = evenly_spaced(polygon, count) + rng.normal(0.0, JITTER, (count, 2))
            for y, x in points * SPACING:
                out.write(f"1,{z},{x:.3f},{y:.3f},{z * SPACING:.3f}\n")
            contours += 1
            points_written += count
    print(f"{arguments.out}: {points_written} points on {contours} slices")


if __name__ == "__main__":
    main()
