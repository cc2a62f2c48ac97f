"""Starts of the plain programs: Alg. 1 and 6 of Kósa and Mikula 2023 on one grid, `[i][j][k]`, x first as printed.

A source is a row of `triangles`, 3 x 3; a point is a triangle of three equal corners.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.spatial import cKDTree


@dataclass
class Start:
    """What the methods begin with: distances, sources (-1: none), which are fixed; and the sources themselves."""

    grid: object
    d: np.ndarray
    s: np.ndarray
    fixed: np.ndarray
    triangles: np.ndarray

    def copies(self):
        return self.d.copy(), self.s.copy(), self.fixed, np.array(self.grid.origin), self.grid.spacing, self.triangles


def of_points(points):
    """Points as triangles of three equal corners."""
    return np.repeat(np.asarray(points, dtype=float)[:, None], 3, axis=1)


def at_points_of_grid(grid, mask):
    """The Cube experiment: grid points of `mask` (`[z, y, x]`) at distance 0, each its own source."""
    fixed = np.ascontiguousarray(mask.transpose(2, 1, 0))
    places = np.argwhere(fixed)
    d, s = np.full(grid.shape, np.inf), np.full(grid.shape, -1, dtype=np.int32)
    d[fixed], s[fixed] = 0.0, np.arange(len(places))
    return Start(grid, d, s, fixed, of_points(np.array(grid.origin) + places * grid.spacing))


def beside(grid, clouds_and_meshes, contiguous=False):
    """Alg. 1 for arrays n x 1 x 3 (points), Alg. 6 for n x 3 x 3; with `contiguous` the points' cubes touch (sec. 4.0.1)."""
    d, s = np.full(grid.shape, np.inf), np.full(grid.shape, -1, dtype=np.int32)
    fixed, first = np.zeros(grid.shape, dtype=bool), 0
    sources = [a if a.shape[1] == 3 else of_points(a[:, 0]) for a in clouds_and_meshes]
    triangles = np.concatenate(sources)
    origin, h = np.array(grid.origin), grid.spacing
    for given, rows in zip(clouds_and_meshes, sources):
        reach = 0
        if given.shape[1] == 1 and contiguous:
            reach = int(cKDTree(given[:, 0]).query(given[:, 0], k=2)[0][:, 1].max() / h)
        of_mesh = given.shape[1] == 3
        fix(d, s, fixed, origin, h, triangles, first, first + len(rows), reach, of_mesh)
        first += len(rows)
    return Start(grid, d, s, fixed, triangles)


@njit(cache=True)
def fix(d, s, fixed, origin, h, triangles, begin, end, reach, of_mesh):
    """Fixes the corners of each source's cells, `reach` more on every side."""
    for n in range(begin, end):
        low, high = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
        for a in range(3):
            corners = triangles[n, :, a]
            low[a] = max(int(np.floor((corners.min() - origin[a]) / h + 1e-9)) - reach, 0)
            high[a] = min(int(np.floor((corners.max() - origin[a]) / h + 1e-9)) + 1 + reach, d.shape[a] - 1)
        if not of_mesh:
            lower(d, s, fixed, origin, h, triangles, n, low, high)
            continue
        for i in range(low[0], high[0]):
            for j in range(low[1], high[1]):
                for k in range(low[2], high[2]):
                    cell = np.array([i, j, k])
                    # Cells are half-open: a triangle in a plane of the grid is in the cells above it alone.
                    centre = origin + (cell + 0.5 - 1e-6) * h
                    if cuts(triangles[n] - centre, 0.5 * h):
                        lower(d, s, fixed, origin, h, triangles, n, cell, cell + 1)


@njit(cache=True)
def lower(d, s, fixed, origin, h, triangles, n, low, high):
    for i in range(low[0], high[0] + 1):
        for j in range(low[1], high[1] + 1):
            for k in range(low[2], high[2] + 1):
                new = distance(triangles[n], origin[0] + i * h, origin[1] + j * h, origin[2] + k * h)
                fixed[i, j, k] = True
                if new < d[i, j, k]:
                    d[i, j, k], s[i, j, k] = new, n


@njit(cache=True)
def cuts(t, half):
    """Whether a triangle meets the cube of that half edge around 0 (Akenine-Moeller 2001: 13 axes)."""
    for a in range(3):
        if t[:, a].min() > half or t[:, a].max() < -half:
            return False
    normal = np.cross(t[1] - t[0], t[2] - t[0])
    if abs((normal * t[0]).sum()) > half * np.abs(normal).sum():
        return False
    for side in range(3):
        edge = t[(side + 1) % 3] - t[side]
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            along = t[:, c] * edge[b] - t[:, b] * edge[c]
            reach = half * (abs(edge[b]) + abs(edge[c]))
            if along.min() > reach or along.max() < -reach:
                return False
    return True


@njit(cache=True)
def distance(t, x, y, z):
    """From a point to a triangle (Ericson 2005, 5.1.5)."""
    ax, ay, az = x - t[0, 0], y - t[0, 1], z - t[0, 2]
    ux, uy, uz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    vx, vy, vz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    if uu == 0 and vv == 0:
        return np.sqrt(ax * ax + ay * ay + az * az)
    d1, d2 = ux * ax + uy * ay + uz * az, vx * ax + vy * ay + vz * az
    d3, d4, d5, d6 = d1 - uu, d2 - uv, d1 - uv, d2 - vv
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0 and d2 <= 0:
        p, q = 0.0, 0.0
    elif d3 >= 0 and d4 <= d3:
        p, q = 1.0, 0.0
    elif d6 >= 0 and d5 <= d6:
        p, q = 0.0, 1.0
    elif vc <= 0 and d1 >= 0 and d3 <= 0:
        p, q = d1 / (d1 - d3), 0.0
    elif vb <= 0 and d2 >= 0 and d6 <= 0:
        p, q = 0.0, d2 / (d2 - d6)
    elif va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        q = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        p = 1.0 - q
    else:
        p, q = vb / (va + vb + vc), vc / (va + vb + vc)
    bx, by, bz = ax - p * ux - q * vx, ay - p * uy - q * vy, az - p * uz - q * vz
    return np.sqrt(bx * bx + by * by + bz * bz)


NEIGHBOURS_26 = np.array([o for o in itertools.product((-1, 0, 1), repeat=3) if o != (0, 0, 0)])
# As printed: the set P1.
NEIGHBOURS_6 = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])
