"""`nuclei`: a second embryo, made: 16 bright, textured nuclei of differing brightness, uneven, noisy background.

Brightness, texture and noise are near those of the mouse embryo that is compared too: background 114 with a deviation of
27, nuclei of 300 to 1200 with a deviation of up to half their mean, bright ones bleeding along z. Truth is the body of each nucleus before blur.
"""

import numpy as np

from .cells import positions
from .marks import SMALLEST_SECTION
from .optics import blurred, photons, smooth_noise
from .volume import Volume

SHAPE, SPACING, NUCLEI = (56, 132, 132), (1.0, 1.0, 2.0), 16
# The camera's: grey values a photon, and without one.
GAIN, OFFSET = 32.0, 92.0
DIMMEST, BRIGHTEST, BACKGROUND = 230.0, 1100.0, 22.0


def make(_folder=None):
    rng = np.random.default_rng(16)
    voxels = positions(SHAPE, SPACING)
    truth, signal = np.zeros(SHAPE, dtype=np.uint16), np.zeros(SHAPE)
    brightness = rng.permutation(np.geomspace(DIMMEST, BRIGHTEST, NUCLEI))
    radii = rng.uniform(7.5, 11.0, NUCLEI)
    for number, (centre, radius) in enumerate(zip(places(radii, rng), radii), start=1):
        depth = body(voxels - centre, radius, rng)
        inside = (depth < 1) & (truth == 0)
        # The mouse's truth has no tips of a few voxels: nobody sees these.
        inside &= (np.count_nonzero(inside, axis=(1, 2)) >= SMALLEST_SECTION)[:, None, None]
        truth[inside] = number
        # Brightest in the middle, as the real ones are.
        texture = (1.4 - 0.8 * depth**2) * np.exp(0.35 * smooth_noise(SHAPE, (1.0, 1.8, 1.8), rng) - 0.06)
        signal[inside] = brightness[number - 1] * texture[inside]
    uneven = BACKGROUND * (1 + 0.25 * smooth_noise(SHAPE, (12, 30, 30), rng))
    # The cells' own haze around the nuclei.
    haze = 0.03 * blurred(signal, (4, 8, 8))
    image = photons(blurred(signal, (1.1, 0.9, 0.9)) + uneven + haze, rng, GAIN, OFFSET)
    return Volume("nuclei", image, SPACING, truth)


def places(radii, rng):
    """Centres in a ball-like embryo, nuclei a few voxels apart at least."""
    middle = np.array([(count - 1) / 2 * step for count, step in zip(SHAPE[::-1], SPACING)])
    found = []
    while len(found) < len(radii):
        towards = rng.normal(size=3)
        centre = middle + towards / np.linalg.norm(towards) * rng.uniform(0.25, 1.0) * (middle - 14.0)
        apart = [np.linalg.norm(centre - other) - radius for other, radius in zip(found, radii)]
        if min(apart, default=np.inf) > radii[len(found)] + 3.0:
            found.append(centre)
    return np.array(found)


def body(away, radius, rng):
    """Distance from the middle of an ellipsoid with a few low bumps, as a share of the way to its surface."""
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    local = away @ axes / (radius * rng.uniform(0.8, 1.2, 3))
    distance = np.linalg.norm(local, axis=-1)
    towards = local / np.maximum(distance, 1e-9)[..., None]
    waves, phases = rng.normal(size=(4, 3)) * 2.0, rng.uniform(0, 2 * np.pi, 4)
    return distance / (1 + 0.05 * np.cos(towards @ waves.T + phases).sum(axis=-1))
