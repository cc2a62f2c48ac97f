"""Grids, and the flags that lay them. Triples are x, y, z; arrays are z, y, x."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Grid:
    """`shape` voxels of one `spacing`; `origin` is the centre of the first."""

    shape: tuple
    spacing: float
    origin: tuple

    @property
    def voxels(self):
        nx, ny, nz = self.shape
        return nx * ny * nz

    def flags(self):
        """What lays this grid on the command line; `=` because an origin may start with a minus sign."""
        triples = {"origin": self.origin, "shape": self.shape}
        joined = [f"--{name}={','.join(repr(value) for value in triple)}" for name, triple in triples.items()]
        return [*joined, f"--spacing={self.spacing!r}"]

    def axis(self, a):
        """Positions of the voxel centres along axis `a`."""
        return self.origin[a] + np.arange(self.shape[a]) * self.spacing

    def __str__(self):
        nx, ny, nz = self.shape
        return f"{nx}^3" if nx == ny == nz else f"{nx} x {ny} x {nz}"


def around(points, spacing):
    """The grid of the papers' Sponge & Sphere: on every side a sixth of the largest extent."""
    low, high = points.min(axis=0), points.max(axis=0)
    padding = float((high - low).max()) / 6
    shape = np.floor((high - low + 2 * padding) / spacing).astype(int) + 2
    return Grid(tuple(map(int, shape)), spacing, tuple(map(float, low - padding)))
