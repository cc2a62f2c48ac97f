"""`tissue`: a young plant embryo, made: 18 cells in one lobed body, thin bright walls that fade and gap.

Sections lie farther apart than pixels. Grey values are near those of the demo's confocal stack: dark outside, faint
cytoplasm, outer walls brighter than inner ones. A cell ends in the middle of its walls.
"""

import numpy as np
from scipy import ndimage

from . import cells
from .optics import blurred, photons, smooth_noise
from .volume import Volume

SHAPE, SPACING, OBJECTS = (52, 120, 112), (0.35, 0.35, 0.8), 18
# Half the thickness of walls, a length, and their brightness.
INNER, OUTER = (0.35, 95.0), (0.45, 150.0)
CYTOPLASM, OUTSIDE = 12.0, 4.0


def make(_folder=None):
    rng = np.random.default_rng(18)
    voxels = cells.positions(SHAPE, SPACING)
    inside = body(voxels - voxels.reshape(-1, 3).mean(axis=0), rng)
    seeds = cells.relaxed(OBJECTS, voxels[inside], rng, 5)
    # Walls of real cells are not flat.
    bent = voxels + np.stack([0.7 * smooth_noise(SHAPE, (8, 16, 16), rng) for _ in range(3)], axis=-1)
    tissue = cells.diagram(seeds, bent, lambda owner: np.arange(OBJECTS))
    truth = np.where(inside, tissue.truth, 0).astype(np.uint16)
    return Volume("tissue", picture(tissue, inside, rng), SPACING, truth)


def body(away, rng):
    """A ball with lobes that fills most of the box."""
    reach = np.abs(away.reshape(-1, 3)).max(axis=0) - np.array([2.0, 2.0, 3.5])
    local = away / reach
    distance = np.linalg.norm(local, axis=-1)
    towards = local / np.maximum(distance, 1e-9)[..., None]
    waves, phases = rng.normal(size=(4, 3)) * 1.8, rng.uniform(0, 2 * np.pi, 4)
    return distance < 0.92 + 0.035 * np.cos(towards @ waves.T + phases).sum(axis=-1)


def picture(tissue, inside, rng):
    """u8: walls of uneven strength, cytoplasm, blur, dimmer with depth, photons."""
    sampling = SPACING[::-1]
    depth = ndimage.distance_transform_edt(inside, sampling) - ndimage.distance_transform_edt(~inside, sampling)
    outer, inner = np.abs(depth) < OUTER[0], (tissue.wall < INNER[0]) & inside
    strength = np.clip(0.7 + 0.35 * smooth_noise(inside.shape, (4, 9, 9), rng), 0.0, 1.5)
    wall = np.maximum(outer * OUTER[1], inner * INNER[1]) * strength
    grain = 1 + 0.35 * smooth_noise(inside.shape, (1.0, 2.0, 2.0), rng)
    signal = blurred(wall + np.where(inside, CYTOPLASM, OUTSIDE) * np.clip(grain, 0.1, None), (0.8, 1.1, 1.1))
    dimming = np.linspace(1.0, 0.6, len(inside))[:, None, None]
    return np.minimum(photons(signal * dimming, rng, 1.5), 255).astype(np.uint8)
