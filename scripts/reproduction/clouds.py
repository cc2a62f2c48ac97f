"""Made clouds in place of the papers' scans, which are not public: points as far apart as the Sealer's, 42,970 of them."""

import numpy as np
from scipy.spatial import cKDTree

SPACING = 0.408695
COUNT = 42_970
# Places on a ball, of which a scanner misses a tenth.
EVERY = 47_700
AXES = np.array([0.58, 1.0, 0.81])


def mean_spacing(points):
    """Mean distance to the nearest other point."""
    return cKDTree(points).query(points, k=2)[0][:, 1].mean()


def scan_cloud():
    """A smooth body with wide bumps and dents."""
    rng = np.random.default_rng(7)
    p = directions()
    bumps = 1 + 0.08 * np.sin(5 * p[:, 0]) * np.cos(4 * p[:, 1] + 1) + 0.06 * np.sin(9 * p[:, 2] + 3 * p[:, 0])
    points = (p * bumps[:, None] * AXES)[rng.random(EVERY) > 0.1][:COUNT]
    return points * (SPACING / mean_spacing(points)) + rng.normal(scale=0.005, size=points.shape)


def relief_cloud(height=0.6, period=6.0, steepness=3.0):
    """An ellipsoid covered with flat fields `height` above and below it, between steep walls, `period` across in the mean."""
    rng = np.random.default_rng(7)
    body = directions() * AXES
    normals = body / AXES**2
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    size = 37.0
    # The walls stretch the spacing, so the size that gives the wanted one is found in steps.
    for _ in range(3):
        points = body * size + normals * (height * np.clip(steepness * waves(body * size, period), -1, 1))[:, None]
        size *= SPACING / mean_spacing(points)
    points = points[rng.random(EVERY) > 0.1][:COUNT]
    return points + rng.normal(scale=0.005, size=points.shape)


def waves(places, period):
    """Waves in space without a common period, zero in the mean."""
    x, y, z = (2 * np.pi / period * places).T
    return (
        np.sin(x + 0.3) * np.sin(y + 0.7)
        + np.sin(0.8 * y + 1) * np.sin(0.9 * z)
        + np.sin(1.1 * z + 2) * np.sin(0.7 * x)
    )


def directions():
    """EVERY places spread evenly over the unit sphere."""
    n = np.arange(EVERY)
    height, turn = 1 - (2 * n + 1) / EVERY, np.pi * (3 - 5**0.5) * n
    ring = np.sqrt(1 - height**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
