#!/usr/bin/env python3
"""Dice overlap of a segmentation with a truth volume: 2 |A and B| / (|A| + |B|).

    python scripts/dice.py OUT.zarr truth.tif                            label n of both, for every n of the truth
    python scripts/dice.py OUT.zarr truth.tif --solid 1,2                and labels 1 and 2 together as one solid
    python scripts/dice.py OUT.zarr truth.tif --label-map 2:1,1:2        segmentation 2 is truth 1, and so on
    python scripts/dice.py OUT.zarr mask.tif --components                truth = components of a mask, as mark_nuclei.py numbers them

OUT.zarr's `labels/segmentation/0` is read with zarr-python; a label TIFF will do in its place. With `--components` every
component is compared with the label that overlaps it most; the column `as marked` says whether that is its own number.
`--at-least X` makes the exit code 1 when a row (with `--components`: their mean) is below X.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import tifffile
import zarr
from scipy import ndimage

LEVEL = "labels/segmentation/0"
SLAB = 32  # slices in memory at a time


def open_labels(path):
    """The label volume `[z][y][x]`: a Zarr array, read as it is sliced, or a TIFF's values."""
    if path.is_dir():
        return zarr.open_array(str(path / LEVEL), mode="r")
    return tifffile.imread(path)


def contingency(segmentation, truth):
    """`table[s, t]`: the number of voxels with label s in the segmentation and t in the truth."""
    if tuple(segmentation.shape) != truth.shape:
        sys.exit(f"shapes differ: segmentation {tuple(segmentation.shape)}, truth {truth.shape} (z, y, x)")
    columns = int(truth.max()) + 1
    total = np.zeros((1, columns), dtype=np.int64)
    for z in range(0, truth.shape[0], SLAB):
        pair = np.asarray(segmentation[z : z + SLAB]).astype(np.int64) * columns + truth[z : z + SLAB]
        counts = np.bincount(pair.ravel())
        part = np.pad(counts, (0, -len(counts) % columns)).reshape(-1, columns)
        rows = max(len(part), len(total))
        total = np.pad(total, ((0, rows - len(total)), (0, 0)))
        total[: len(part)] += part
    return total


def row(table, ours, theirs):
    """Voxels of the label set `ours`, of `theirs`, of both, and their Dice."""
    ours = [label for label in ours if label < table.shape[0]]
    theirs = [label for label in theirs if label < table.shape[1]]
    a, b = int(table[ours].sum()), int(table[:, theirs].sum())
    both = int(table[np.ix_(ours, theirs)].sum())
    return a, b, both, 2.0 * both / (a + b) if a + b else float("nan")


def label_rows(table, label_map, solids):
    """(name, figures) per mapped label and per solid."""
    mapping = label_map or {label: label for label in range(1, table.shape[1]) if table[:, label].any()}
    for ours, theirs in sorted(mapping.items(), key=lambda pair: pair[1]):
        yield f"{theirs}" if ours == theirs else f"{theirs} (as {ours})", row(table, [ours], [theirs])
    back = {theirs: ours for ours, theirs in mapping.items()}
    for solid in solids:
        yield "+".join(map(str, solid)), row(table, [back.get(label, label) for label in solid], solid)


def component_rows(table):
    """(name, figures) per component, against the label with the largest overlap (the lower one of equals)."""
    for component in range(1, table.shape[1]):
        overlap = table[1:, component]
        best = 1 + int(overlap.argmax()) if overlap.any() else 0
        note = "as marked" if best == component else "not found" if best == 0 else f"as {best}"
        yield f"{component} ({note})", row(table, [best] if best else [], [component])


def numbers(text):
    return [int(part) for part in text.split(",")]


def pairs(text):
    return {int(ours): int(theirs) for ours, theirs in (pair.split(":") for pair in text.split(","))}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("segmentation", type=Path, help="OUT.zarr, or a label TIFF")
    parser.add_argument("truth", type=Path, help="label or mask TIFF")
    parser.add_argument("--label-map", type=pairs, help="OURS:TRUTH,... (default: equal numbers)")
    parser.add_argument("--solid", type=numbers, action="append", default=[], help="truth labels to join, e.g. 1,2")
    parser.add_argument("--components", action="store_true", help="number the mask's components and match by overlap")
    parser.add_argument("--at-least", type=float, help="exit 1 below this Dice")
    settings = parser.parse_args()
    if settings.components and (settings.label_map or settings.solid):
        parser.error("--components matches by overlap: leave out --label-map and --solid")

    truth = tifffile.imread(settings.truth)
    if settings.components:
        truth, _ = ndimage.label(truth != 0)
    table = contingency(open_labels(settings.segmentation), truth)
    rows = list(component_rows(table) if settings.components else label_rows(table, settings.label_map, settings.solid))
    if not rows:
        sys.exit(f"{settings.truth}: no label above 0")

    print("| label | segmented | truth | both | Dice |\n| --- | ---: | ---: | ---: | ---: |")
    for name, (ours, theirs, both, dice) in rows:
        print(f"| {name} | {ours} | {theirs} | {both} | {dice:.4f} |")
    scores = [figures[3] for _, figures in rows]
    if settings.components:
        scores = [float(np.mean(scores))]
        print(f"| mean | | | | {scores[0]:.4f} |")
    if settings.at_least is not None and not min(scores) >= settings.at_least:
        sys.exit(f"Dice {min(scores):.4f} is below {settings.at_least}")


if __name__ == "__main__":
    main()
