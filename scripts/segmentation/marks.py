"""Marks from a truth: outlines as a person would click them who knew the answer, on slices and on planes across them.

A kind of marks is written `WHERE[-pN][-jX]`: N points a contour (12), normal jitter of X voxels on both axes of the
plane (0.5).
WHERE is one of, or several joined by `+`:

    every2, every4, ...   every n-th slice of an object, counted from its first, as scripts/mark_nuclei.py does
    three                 three slices of an object, at 1/6, 1/2 and 5/6 of its extent
    planes                an xz and a yz plane through its centroid
"""

import re
from dataclasses import dataclass

import numpy as np

from mark_nuclei import evenly_spaced, outer_contour

from .volume import Outline

# A smaller section is no outline that a person would mark among three.
SMALLEST_SECTION = 12


@dataclass(frozen=True)
class Kind:
    """A kind of marks, as its name says it."""

    where: tuple
    points: int = 12
    jitter: float = 0.5


def kind(name):
    """The kind of that name; ValueError where there is none."""
    found = re.fullmatch(
        r"((?:every\d+|three|planes)(?:\+(?:every\d+|three|planes))*)(?:-p(\d+))?(?:-j([\d.]+))?", name
    )
    if not found:
        raise ValueError(f"marks {name!r}: every2, three or planes, joined by +, then -p20 or -j1.5, were expected")
    where, points, jitter = found.groups()
    return Kind(tuple(where.split("+")), int(points or 12), float(jitter or 0.5))


def mark(volume, name, seed):
    """Outlines of all objects of a volume."""
    wanted, rng = kind(name), np.random.default_rng(seed)
    outlines = []
    for number in volume.solids:
        mask = volume.solid(number)
        for across, index in planes(mask, wanted.where):
            outlines.append(outline(volume, number, mask, (across, index), wanted, rng))
    return outlines


def planes(mask, where):
    """(axis across, index) of the planes to mark, each once."""
    places = np.nonzero(mask)
    area = np.bincount(places[0], minlength=mask.shape[0])
    slices = np.arange(places[0].min(), places[0].max() + 1)
    found = []
    for part in where:
        if part.startswith("every"):
            found += [(2, z) for z in slices[:: int(part.removeprefix("every"))] if area[z]]
        elif part == "three":
            fit = np.flatnonzero(area >= min(SMALLEST_SECTION, area.max()))
            found += [(2, fit[int(len(fit) * share)]) for share in (1 / 6, 1 / 2, 5 / 6)]
        else:
            found += [(1, round(places[1].mean())), (0, round(places[2].mean()))]
    return list(dict.fromkeys((across, int(index)) for across, index in found))


def outline(volume, number, mask, plane, wanted, rng):
    """One outline. Its number is its slice; planes across slices are numbered on: no two of an object share one."""
    across, index = plane
    axes = [axis for axis in (1, 0, 2) if axis != across] if across == 2 else [2, 1 - across]
    loop = outer_contour(mask.take(index, axis=2 - across)) * [volume.spacing[axis] for axis in axes]
    flat = evenly_spaced(loop, wanted.points)
    flat += rng.normal(0.0, wanted.jitter * volume.spacing[0], flat.shape)
    points = np.full((len(flat), 3), index * volume.spacing[across], dtype=float)
    points[:, axes] = flat
    contour = index if across == 2 else mask.shape[0] + across
    return Outline(number, contour, across, points)
