#!/usr/bin/env python3
"""Writes a large 16-bit test stack: the embryo-like object scaled up, slice by slice, in little memory.

    python scripts/scale_stack.py SOURCE_DIR OUT_DIR                            2048 x 2048 x 512, 4.3 GB
    python scripts/scale_stack.py SOURCE_DIR OUT_DIR --factor-xy 0.5 --depth 64   256 x 256 x 64, 8 MB

SOURCE_DIR holds stack.tif, marks.csv and, for `--truth`, truth.tif; OUT_DIR gets files of the same names.

Physical coordinates stay what they were: voxel centre k of the result lies at k times the new spacing, and is looked up
at that place in the source, between its two nearest slices and pixels, linearly. (Past the last source voxel the
last value goes on.) So spacing = source spacing / factor in the plane, source spacing * slices / depth across it.
Values are multiplied by `--gain`; normal noise with a standard deviation of `--noise` is added, from a generator seeded
with (`--seed`, slice), so that a slice does not depend on the others.

Marks: on every `--every`-th slice of the result that lies between two marked slices of an object, the two contours are
interpolated point by point; they have the same number of points, in the same order.

`--container imagej` (default) writes one IFD and then all slices in one piece, as ImageJ does past 4 GB, whatever the size;
`bigtiff` writes an OME-BigTIFF with an IFD per slice.
"""

import argparse
import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
import tifffile


class Axis:
    """Where the `count` voxels of the result lie among the `source_count` voxels of the source, along one axis."""

    def __init__(self, count, source_count):
        at = np.minimum(np.arange(count) * (source_count / count), source_count - 1)
        self.low = np.minimum(at.astype(np.int64), max(source_count - 2, 0))
        self.high = np.minimum(self.low + 1, source_count - 1)
        self.weight = (at - self.low).astype(np.float32)
        self.nearest = np.where(self.weight < 0.5, self.low, self.high)


class Plan:
    """Shapes and spacings of source and result; `[z, y, x]`."""

    def __init__(self, page_shape, slices, spacing, settings):
        self.source_shape = (slices, *page_shape)
        self.shape = (
            settings.depth,
            round(page_shape[0] * settings.factor_xy),
            round(page_shape[1] * settings.factor_xy),
        )
        self.axes = [Axis(n, s) for n, s in zip(self.shape, self.source_shape)]
        self.source_spacing = spacing
        self.spacing = [h * s / n for h, s, n in zip(spacing, self.source_shape, self.shape)]


def read_spacing(tif):
    """`[hz, hy, hx]` of an ImageJ stack, in its unit."""
    tags = tif.pages[0].tags
    across, down = tags["XResolution"].value, tags["YResolution"].value
    return [float(tif.imagej_metadata["spacing"]), down[1] / down[0], across[1] / across[0]]


def interpolated_slices(source, plan, settings):
    """The slices of the result, one after the other (u16); `source` is read as needed."""
    z, y, x = plan.axes
    wx, wy = x.weight[None, :], y.weight[:, None]
    for k in range(plan.shape[0]):
        w = z.weight[k]
        plane = source[z.low[k]] * (1 - w) + source[z.high[k]] * w
        plane = plane[:, x.low] * (1 - wx) + plane[:, x.high] * wx
        plane = plane[y.low] * (1 - wy) + plane[y.high] * wy
        plane *= np.float32(settings.gain)
        rng = np.random.default_rng([settings.seed, k])
        plane += np.float32(settings.noise) * rng.standard_normal(plane.shape, dtype=np.float32)
        yield np.clip(np.rint(plane), 0, 65535).astype(np.uint16)


def nearest_slices(source, plan):
    """The slices of a label volume, each voxel taking the nearest source voxel's label."""
    z, y, x = plan.axes
    for k in range(plan.shape[0]):
        yield source[z.nearest[k]][np.ix_(y.nearest, x.nearest)]


def write_stack(path, slices, plan, dtype, container):
    hz, hy, hx = plan.spacing
    common = {"shape": plan.shape, "dtype": dtype, "photometric": "minisblack"}
    if container == "imagej":
        metadata = {"axes": "ZYX", "spacing": hz, "unit": "um"}
        tifffile.imwrite(
            path, slices, imagej=True, truncate=True, resolution=(1 / hx, 1 / hy), metadata=metadata, **common
        )
    else:
        units = {f"PhysicalSize{axis}Unit": "µm" for axis in "XYZ"}
        metadata = {"axes": "ZYX", "PhysicalSizeX": hx, "PhysicalSizeY": hy, "PhysicalSizeZ": hz, **units}
        tifffile.imwrite(path, slices, ome=True, bigtiff=True, metadata=metadata, **common)


def read_contours(path):
    """object -> source slice -> contour (n x 2, x and y, physical)."""
    contours = defaultdict(lambda: defaultdict(list))
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            contours[int(row["object"])][int(row["contour"])].append((float(row["x"]), float(row["y"])))
    return {o: {z: np.array(p) for z, p in slices.items()} for o, slices in contours.items()}


def contour_at(slices, z):
    """The contour at source slice `z` (a real number), or None outside the marked range or across a gap."""
    low = int(np.floor(z + 1e-9))
    weight = max(z - low, 0.0)
    if low not in slices or (weight > 1e-9 and low + 1 not in slices):
        return None
    if weight <= 1e-9:
        return slices[low]
    if len(slices[low]) != len(slices[low + 1]):
        raise SystemExit(f"contours {low} and {low + 1} have different numbers of points")
    return (1 - weight) * slices[low] + weight * slices[low + 1]


def write_marks(path, contours, plan, every):
    source_hz, hz = plan.source_spacing[0], plan.spacing[0]
    rows = 0
    with open(path, "w", newline="\n", encoding="ascii") as out:
        out.write("object,contour,x,y,z\n")
        for number, slices in sorted(contours.items()):
            for k in range(0, plan.shape[0], every):
                contour = contour_at(slices, k * hz / source_hz)
                for x, y in [] if contour is None else contour:
                    out.write(f"{number},{k},{x:.3f},{y:.3f},{k * hz:.6f}\n")
                    rows += 1
    return rows


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", type=Path, help="folder with stack.tif, marks.csv, truth.tif")
    parser.add_argument("out", type=Path, help="folder to write into; made if need be")
    parser.add_argument("--factor-xy", type=float, default=4.0, help="pixels per source pixel, along each axis (4)")
    parser.add_argument("--depth", type=int, default=512, help="slices of the result (512)")
    parser.add_argument("--every", type=int, default=4, help="mark every N-th slice (4)")
    parser.add_argument("--gain", type=float, default=200.0, help="grey values per source grey value (200)")
    parser.add_argument("--noise", type=float, default=400.0, help="standard deviation of the added noise (400)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the noise (1)")
    parser.add_argument("--container", choices=["imagej", "bigtiff"], default="imagej")
    parser.add_argument("--truth", action="store_true", help="also write the scaled truth.tif (8 bit)")
    settings = parser.parse_args()
    if settings.depth < 1 or settings.factor_xy <= 0 or settings.every < 1:
        parser.error("--depth and --every must be at least 1, --factor-xy above 0")
    return settings


def main():
    settings = arguments()
    settings.out.mkdir(parents=True, exist_ok=True)
    with tifffile.TiffFile(settings.source / "stack.tif") as tif:
        source = tif.asarray()
        plan = Plan(source.shape[1:], source.shape[0], read_spacing(tif), settings)
    stack = settings.out / "stack.tif"
    write_stack(stack, interpolated_slices(source, plan, settings), plan, np.uint16, settings.container)
    rows = write_marks(settings.out / "marks.csv", read_contours(settings.source / "marks.csv"), plan, settings.every)
    if settings.truth:
        truth = tifffile.imread(settings.source / "truth.tif")
        write_stack(settings.out / "truth.tif", nearest_slices(truth, plan), plan, truth.dtype, settings.container)
    print(f"{stack}: {plan.shape} u16, spacing z,y,x {plan.spacing}, {stack.stat().st_size} bytes; {rows} marks")


if __name__ == "__main__":
    main()
