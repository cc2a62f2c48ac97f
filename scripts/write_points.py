#!/usr/bin/env python3
"""Write random points in the forms of many programs, and what a reader must find in them.

Tables are written by pandas in a random dialect (separator, sign of decimals, quotes, encoding, line ends), ROIs by
roifile. FOLDER/expected.json lists the files, each with its positions in x, y, z, objects, contours and times, and
whether the numbers along each axis are lengths, voxels or slices.
"""

import argparse
import csv
import json
import random
from pathlib import Path

import numpy as np
import pandas as pd
import roifile

LENGTHS = ["physical"] * 3
VOXELS = ["voxels"] * 3
JUNK = ["plain", 'with "quotes"', "a, b", "c; d", "", "tab\there", "\u00b5"]


def numbers(rng, count):
    """Random positions, some of them whole, some of them tiny."""
    scale = 10.0 ** rng.integers(-3, 6)
    values = rng.normal(0.0, scale, (count, 3))
    return np.round(values, int(rng.integers(0, 12)))


def plain(rng, pick, table, xyz):
    """Names of x, y, z that no program has for itself."""
    style, scales = pick.choice(
        [
            ("{}", LENGTHS),
            ("{} (um)", LENGTHS),
            ("{} [nm]", LENGTHS),
            ("Position {}", LENGTHS),
            ("pos_{}", LENGTHS),
            ("Centroid{}", LENGTHS),
            ("{}_coord", LENGTHS),
            ("{} [px]", VOXELS),
            ("{}_voxel", VOXELS),
        ]
    )
    for axis, name in enumerate("XYZ" if "Centroid" in style or pick.random() < 0.5 else "xyz"):
        table[style.format(name)] = xyz[:, axis]
    return scales


def table_of(rng, pick, count):
    """A table, its expected content, and the lines of text around its header."""
    xyz = numbers(rng, count)
    found = {"positions": xyz, "objects": [], "contours": [], "times": [], "scales": LENGTHS}
    table, before, after = {}, [], []
    form = pick.choice(["plain", "plain", "napari", "napari 4-D", "shapes", "trackmate", "imaris", "imagej", "paraview"])
    if form == "plain":
        found["scales"] = plain(rng, pick, table, xyz)
        if pick.random() < 0.5:
            found["objects"] = table["object"] = rng.integers(1, 9, count)
        if pick.random() < 0.5:
            found["contours"] = table["Contour"] = rng.integers(-5, 99, count)
        table["note"] = [pick.choice(JUNK) for _ in range(count)]
    elif form in ("napari", "napari 4-D", "shapes"):
        found["scales"] = VOXELS
        table["index"] = np.arange(count, dtype=float)
        if form == "shapes":
            sizes = [pick.choice([3, 5, 8]) for _ in range(count)]
            count = sum(sizes)
            found["positions"] = xyz = numbers(rng, count)
            found["contours"] = np.repeat(np.arange(len(sizes)), sizes)
            table["index"] = found["contours"].astype(float)
            table["shape-type"] = np.repeat([pick.choice(["polygon", "rectangle"]) for _ in sizes], sizes)
            table["vertex-index"] = np.concatenate([np.arange(size, dtype=float) for size in sizes])
        axes = [xyz[:, 2], xyz[:, 1], xyz[:, 0]]
        if form == "napari 4-D":
            found["times"] = rng.integers(0, 5, count)
            axes.insert(0, found["times"].astype(float))
        for axis, values in enumerate(axes):
            table[f"axis-{axis}"] = values
    elif form == "trackmate":
        table["LABEL"] = [f"ID{n}" for n in range(count)]
        table["TRACK_ID"] = rng.integers(0, 5, count)
        for axis, name in enumerate("XYZ"):
            table[f"POSITION_{name}"] = xyz[:, axis]
        found["times"] = table["FRAME"] = rng.integers(0, 5, count)
        after = [
            ["Label", "Track ID", "X", "Y", "Z", "Frame"],
            ["Label", "Track ID", "X", "Y", "Z", "Frame"],
            ["", "", "(micron)", "(micron)", "(micron)", ""],
        ]
    elif form == "imaris":
        for axis, name in enumerate("XYZ"):
            table[f"Position {name}"] = xyz[:, axis]
        table["Unit"], table["Category"], table["Collection"] = ["um"] * count, ["Spot"] * count, ["Position"] * count
        table["Time"] = rng.integers(1, 6, count)
        found["times"] = table["Time"] - 1
        before = ["", "Position", "===================="]
    elif form == "imagej":
        slices = rng.integers(1, 40, count)
        table[" "] = np.arange(1, count + 1)
        table["Area"] = rng.integers(0, 9, count)
        table["X"], table["Y"], table["Slice"] = xyz[:, 0], xyz[:, 1], slices
        xyz[:, 2] = slices - 1
        found["scales"] = ["physical", "physical", "slices"]
    else:
        for axis in range(3):
            table[f"Points:{axis}"] = xyz[:, axis]
    frame = pd.DataFrame(table)
    if form in ("plain", "napari"):
        frame = frame[pick.sample(list(frame.columns), len(frame.columns))]
        frame.columns = [name if pick.random() < 0.8 else name.upper() for name in frame.columns]
    return frame, found, before, after


def write_table(rng, pick, path, count):
    """Write a table in a random dialect; return what it holds."""
    frame, found, before, after = table_of(rng, pick, count)
    separator = pick.choice([",", ";", "\t"])
    decimal = pick.choice([".", ","])
    quoting = pick.choice([csv.QUOTE_MINIMAL, csv.QUOTE_ALL])
    encoding = pick.choice(["utf-8", "utf-8-sig", "utf-16", "utf-16-le with mark"])
    end = pick.choice(["\n", "\r\n", "\r"])
    buffer = frame.to_csv(
        index=False, sep=separator, decimal=decimal, quoting=quoting, lineterminator="\n", doublequote=True
    )
    lines = buffer.split("\n")
    lines[1:1] = [separator.join(line) for line in after]
    lines[:0] = before
    if not before and pick.random() < 0.3:
        lines.insert(0, f"sep={separator}")
    text = end.join(lines)
    if encoding == "utf-16-le with mark":
        path.write_bytes(b"\xff\xfe" + text.encode("utf-16-le"))
    else:
        path.write_bytes(text.encode(encoding))
    return found


def polygon(pick, rng, z):
    """A ROI of an area or of points, and its outlines in voxels: areas count from the corner of a pixel."""
    count = pick.randint(3, 30)
    place = {"position": z} if pick.random() < 0.5 else {"z": z}
    kind = pick.choice(["float", "whole", "rectangle", "points", "composite"])
    if kind == "float":
        points = rng.uniform(0, 500, (count, 2)).astype(np.float32)
        roi = roifile.ImagejRoi.frompoints(points, **place)
        roi.roitype = pick.choice([roifile.ROI_TYPE.POLYGON, roifile.ROI_TYPE.FREEHAND, roifile.ROI_TYPE.TRACED])
        return roi, [points.astype(float) - 0.5]
    points = rng.integers(0, 500, (count, 2))
    roi = roifile.ImagejRoi.frompoints(points, **place)
    if kind == "whole":
        return roi, [points - 0.5]
    if kind == "points":
        roi.roitype = roifile.ROI_TYPE.POINT
        return roi, [points.astype(float)]
    left, top, width, height = 3, 5, pick.randint(1, 90), pick.randint(1, 90)
    roi = roifile.ImagejRoi(roitype=roifile.ROI_TYPE.RECT, left=left, top=top, right=left + width, bottom=top + height)
    roi.position = z + 1
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]]) + [left, top]
    if kind == "rectangle":
        return roi, [corners - 0.5]
    moved = corners + [width + 7, 0]
    path = []
    for part in (corners, moved):
        path += [0.0, *part[0]] + [v for point in part[1:] for v in (1.0, *point)] + [4.0]
    roi.multi_coordinates = np.array(path, np.float32)
    roi.shape_roi_size = len(path)
    return roi, [corners - 0.5, moved - 0.5]


def write_rois(rng, pick, path, count):
    """Write a ROI or a set of them; return what it holds."""
    single = path.suffix == ".roi"
    groups = [0, 0] if pick.random() < 0.5 else [pick.randint(1, 9), pick.randint(10, 300)]
    found = {"positions": [], "objects": [], "contours": [], "times": [], "scales": VOXELS}
    order, contour = [], 0
    for n in range(1 if single else max(count // 4, 2)):
        roi, outlines = polygon(pick, rng, 2 * n)
        roi.version = 229
        roi.name = f"outline {n}"
        roi.group = groups[n % 2]
        order += [] if roi.group in order else [roi.group]
        roi.tofile(path, name=f"{n:04}")
        for outline in outlines:
            contour += 1
            found["positions"] += [[x, y, 2 * n] for x, y in np.asarray(outline, float)]
            found["contours"] += [contour] * len(outline)
            found["objects"] += [order.index(roi.group) + 1] * len(outline)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("seed", type=int)
    parser.add_argument("count", type=int)
    arguments = parser.parse_args()
    rng, pick = np.random.default_rng(arguments.seed), random.Random(arguments.seed)
    expected = []
    for n in range(arguments.count):
        ending = pick.choice([".csv", ".csv", ".csv", ".roi", ".zip"])
        path = arguments.folder / f"points-{n}{ending}"
        write = write_table if ending == ".csv" else write_rois
        found = write(rng, pick, path, pick.randint(1, 40))
        expected.append({"file": path.name} | {key: np.asarray(value).tolist() for key, value in found.items()})
    (arguments.folder / "expected.json").write_text(json.dumps(expected))


if __name__ == "__main__":
    main()
