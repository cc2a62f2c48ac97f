"""Touching cells: a Voronoi diagram of seeds that were moved to the middle of their cells a few times (Lloyd)."""

from dataclasses import dataclass

import numpy as np
from scipy import spatial

# Of so many nearest seeds a voxel's walls are looked for.
NEAREST = 8


@dataclass
class Cells:
    """Voronoi cells on voxels. Lengths are physical, triples x, y, z, arrays z, y, x.

    `owner` is the nearest seed of each voxel; `objects[seed]` is the object's number, 0 where the cell is not one.
    `wall` is each voxel's distance to the nearest wall; `shared` to the nearest one between two objects.
    """

    seeds: np.ndarray
    owner: np.ndarray
    objects: np.ndarray
    wall: np.ndarray
    shared: np.ndarray

    @property
    def truth(self):
        return self.objects[self.owner]

    def contacts(self):
        """Area that two objects share: (lower number, higher number) -> area, from the diagram itself."""
        diagram, areas = spatial.Voronoi(self.seeds), {}
        for pair, corners in zip(diagram.ridge_points, diagram.ridge_vertices):
            a, b = sorted(map(int, self.objects[pair]))
            if a > 0 and -1 not in corners:
                areas[a, b] = polygon_area(diagram.vertices[corners])
        return areas


def polygon_area(corners):
    """Area of a convex polygon in space, its corners in any order."""
    away = corners - corners.mean(axis=0)
    across = np.linalg.svd(away)[2]
    flat = away @ across[:2].T
    x, y = flat[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))].T
    return 0.5 * abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def positions(shape, spacing):
    """Centres of voxels (z, y, x, then 3: x, y, z)."""
    axes = [np.arange(count) * step for count, step in zip(shape, spacing[::-1])]
    return np.stack(np.meshgrid(*axes, indexing="ij")[::-1], axis=-1)


def relaxed(count, voxels, rng, rounds):
    """Seeds among voxels (any shape, then 3), each moved to the middle of its cell `rounds` times."""
    flat = voxels.reshape(-1, 3)
    # Some hundred thousand places tell the middles well enough.
    places = flat[rng.choice(len(flat), min(len(flat), 200_000), replace=False)]
    seeds = places[:count]
    for _ in range(rounds):
        owner = spatial.cKDTree(seeds).query(places)[1]
        size = np.maximum(np.bincount(owner, minlength=count), 1)
        seeds = np.column_stack([np.bincount(owner, places[:, a], minlength=count) / size for a in range(3)])
    return seeds


def diagram(seeds, voxels, choose):
    """Cells of the seeds; `choose(owner)` gives the seeds whose cells are the objects 1, 2, ..."""
    flat = voxels.reshape(-1, 3)
    distance, near = spatial.cKDTree(seeds).query(flat, k=NEAREST)
    owner = near[:, 0].reshape(voxels.shape[:3])
    objects = np.zeros(len(seeds), dtype=int)
    for number, seed in enumerate(choose(owner), start=1):
        objects[seed] = number
    # Distance to the plane half way between the nearest seed and each other one.
    apart = np.linalg.norm(seeds[near[:, 1:]] - seeds[near[:, :1]], axis=2)
    walls = (distance[:, 1:] ** 2 - distance[:, :1] ** 2) / (2 * apart)
    both = (objects[near[:, :1]] > 0) & (objects[near[:, 1:]] > 0)
    shared = np.where(both, walls, np.inf).min(axis=1)
    shape = owner.shape
    return Cells(seeds, owner, objects, walls.min(axis=1).reshape(shape), shared.reshape(shape))


def whole(owner, seeds, count):
    """The `count` seeds nearest to the middle whose cells do not touch the border of the box."""
    faces = [owner.take(end, axis=axis) for axis in range(3) for end in (0, -1)]
    cut = np.unique(np.concatenate([face.ravel() for face in faces]))
    inside = np.setdiff1d(np.unique(owner), cut)
    away = np.linalg.norm(seeds[inside] - seeds.mean(axis=0), axis=1)
    return np.sort(inside[np.argsort(away)[:count]])
