"""`foam`: 30 touching cells in a box of more, walls bright; how well results share the walls between cells."""

import csv

import numpy as np

from . import cells
from .optics import blurred, photons
from .volume import Volume

SHAPE, SEEDS, OBJECTS, WALL = (120, 120, 120), 130, 30, 3.0
# Voxels so near to a wall between two objects are the ones that a gap or an overlap would take.
BETWEEN = 3.0


def make(_folder=None):
    """Cells that the box cuts are in the picture, but are no objects."""
    rng = np.random.default_rng(30)
    spacing = (1.0, 1.0, 1.0)
    voxels = cells.positions(SHAPE, spacing)
    seeds = cells.relaxed(SEEDS, voxels, rng, 4)
    foam = cells.diagram(seeds, voxels, lambda owner: cells.whole(owner, seeds, OBJECTS))
    image = photons(blurred(np.where(foam.wall < WALL / 2, 120.0, 20.0), 1.0), rng)
    return Volume("foam", image, spacing, foam.truth.astype(np.uint16), cells=foam)


def between(volume, answer):
    """Shares of the voxels between cells: without a label, with a wrong one, held by two objects (None: unknown)."""
    near = (volume.truth > 0) & (volume.cells.shared <= BETWEEN)
    labels, truth = answer.labels[near], volume.truth[near]
    empty, wrong = np.mean(labels == 0), np.mean((labels > 0) & (labels != truth))
    return empty, wrong, None if answer.claims is None else np.mean(answer.claims[near] > 1)


def contact_error(volume, found):
    """Sum of the differences of areas, and the difference of their sums, by the sum of areas; how many contacts of a
    size were missed; how many made up."""
    true = volume.cells.contacts()
    difference = sum(abs(found.get(pair, 0.0) - area) for pair, area in true.items())
    difference += sum(area for pair, area in found.items() if pair not in true)
    large = np.median(list(true.values())) / 4
    missed = sum(pair not in found for pair, area in true.items() if area > large)
    whole = sum(true.values())
    return difference / whole, sum(found.values()) / whole - 1, missed, sum(pair not in true for pair in found)


def read_contacts(store):
    """Areas by pair of objects, or None: from the store's contacts CSV, two objects first, a column with `area` in its name."""
    paths = sorted(store.rglob("*contact*.csv")) if store else []
    if not paths:
        return None
    with open(paths[0], newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        return {}
    first, second = list(rows[0])[:2]
    area = next(name for name in rows[0] if "area" in name)
    pairs = ((tuple(sorted((int(row[first]), int(row[second])))), float(row[area])) for row in rows)
    # 0 is the outside of the tissue.
    return {pair: size for pair, size in pairs if pair[0] > 0}
