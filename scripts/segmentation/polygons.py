"""Outlines on slices as polygons: exact signed distances in the plane, and their interpolation along z."""

import numpy as np


def signed_distance(points, corners):
    """Distance of points (... x 2) to a closed polygon (n x 2), negative inside (even-odd rule)."""
    nearest = np.full(points.shape[:-1], np.inf)
    inside = np.zeros(points.shape[:-1], dtype=bool)
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        edge, away = b - a, points - a
        along = np.clip(away @ edge / max(edge @ edge, 1e-12), 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(away - along[..., None] * edge, axis=-1))
        crosses = (a[1] > points[..., 1]) != (b[1] > points[..., 1])
        if edge[1]:
            inside ^= crosses & (away[..., 0] < away[..., 1] * edge[0] / edge[1])
    return np.where(inside, -nearest, nearest)


def slices(outlines, grid):
    """Signed distance of each marked slice of an object: index of the slice -> array (y, x)."""
    x, y = np.meshgrid(grid.axis(0), grid.axis(1))
    found = {}
    for outline in outlines:
        z = round(outline.points[0, 2] / grid.spacing[2])
        distance = signed_distance(np.stack([x, y], axis=-1), outline.points[:, :2])
        found[z] = np.minimum(found[z], distance) if z in found else distance
    return dict(sorted(found.items()))


def reach(places):
    """How many slices an object goes on beyond its last outlines: half of those up to where the next would have been."""
    return (float(np.diff(places).mean()) - 1) / 2 if len(places) > 1 else 0.0


def interpolated(outlines, grid):
    """Distances of neighbouring outlines mixed linearly, and the last ones kept as far as `reach` beyond."""
    known = slices(outlines, grid)
    places, planes = np.array(list(known)), np.array(list(known.values()))
    field = np.empty(grid.shape)
    for row in range(grid.shape[0]):
        z = row + grid.first[0]
        at = np.clip(np.interp(z, places, np.arange(len(places))), 0, len(places) - 1)
        low = min(int(at), max(len(places) - 2, 0))
        high = min(low + 1, len(places) - 1)
        field[row] = planes[low] + (at - low) * (planes[high] - planes[low])
        beyond = max(places[0] - z, z - places[-1]) - reach(places)
        if beyond > 0:
            field[row] = np.maximum(field[row], beyond * grid.spacing[2])
    return field
