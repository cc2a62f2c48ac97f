"""Made stacks of one body whose surface is known exactly: a sphere and a lobed body, seen in eight ways.

The surface is a radius by direction. Walls are bright shells 3 voxels thick with the surface in their middle; blobs are
brighter inside than outside. Marks are exact, 20 a contour on every fifth slice; in the `-outside` stacks they lie two voxels outside.
"""

import zlib
from dataclasses import dataclass
from functools import partial

import numpy as np
from skimage import measure

from mark_nuclei import enclosed_area, evenly_spaced

from .optics import blurred, photons, smooth_noise
from .volume import Outline, Volume

RADIUS, SIDE = 25.0, 85
CENTRE = np.array([42.3, 41.8, 42.15])
EVERY, POINTS, WALL = 5, 20, 3.0
VIEWS = (
    "wall",
    "low-snr",
    "wall-gap",
    "wall-outside",
    "inner-walls",
    "textured-blob",
    "gradient-blob",
    "blob-outside",
)


@dataclass(frozen=True)
class Radial:
    """A surface around CENTRE: `lobes` is what a direction adds to the radius, as a share of it."""

    lobes: float

    def radius(self, directions):
        """Radius in unit directions (... x 3)."""
        x, y, z = np.moveaxis(directions, -1, 0)
        harmonics = 1.0 * (3 * x**2 * y - y**3) + 0.5 * (3 * z**2 - 1) / 2 + 0.6 * (5 * z**3 - 3 * z) / 2
        return RADIUS * (1 + self.lobes * harmonics)

    def beyond(self, points):
        """How much farther than the surface points (... x 3) are from the centre."""
        away = points - CENTRE
        distance = np.linalg.norm(away, axis=-1)
        return distance - self.radius(away / np.maximum(distance, 1e-9)[..., None])


SHAPES = {"sphere": Radial(0.0), "lobed": Radial(0.15)}


def names():
    return {f"{shape}-{view}": partial(make, shape, view) for shape in SHAPES for view in VIEWS}


def make(shape, view, _folder=None):
    surface, rng = SHAPES[shape], np.random.default_rng(zlib.crc32(f"{shape}-{view}".encode()))
    axes = np.meshgrid(*[np.arange(SIDE, dtype=float)] * 3, indexing="ij")
    voxels = np.stack(axes[::-1], axis=-1)
    beyond = surface.beyond(voxels)
    # Walls are as thick where the surface is not across its radius.
    distance = beyond / np.maximum(np.linalg.norm(np.gradient(beyond), axis=0), 0.5)
    image = photons(blurred(signal(view, voxels, distance, rng), 1.0), rng)
    marks = outlines(beyond - (2.0 if view.endswith("outside") else 0.0))
    truth = (beyond < 0).astype(np.uint8)
    return Volume(f"{shape}-{view}", image, (1.0, 1.0, 1.0), truth, given={"exact": marks}, surface=surface)


def signal(view, voxels, distance, rng):
    """Mean photons of each voxel before blur."""
    inside = distance < 0
    wall = np.abs(distance) < WALL / 2
    if view == "low-snr":
        return np.where(wall, 36.0, 20.0)
    if view == "wall-gap":
        wall &= ~gaps(voxels, rng)
    if view == "inner-walls":
        away = voxels - CENTRE
        for normal, offset in (((0.9, 0.3, 0.3), 2.0), ((-0.3, 0.8, 0.5), -5.0), ((0.1, -0.6, 0.8), 4.0)):
            normal = np.array(normal) / np.linalg.norm(normal)
            wall |= inside & (np.abs(away @ normal - offset) < WALL / 2)
    if view in ("textured-blob", "blob-outside"):
        texture = 1 + 0.3 * smooth_noise(distance.shape, 2.0, rng)
        return np.where(inside, 100.0 * np.clip(texture, 0.1, None), 20.0)
    if view == "gradient-blob":
        return 10 + 70 * voxels[..., 0] / SIDE + np.where(inside, 45.0, 0.0)
    return np.where(wall, 120.0, 20.0)


def gaps(voxels, rng):
    """True towards 40 % of all directions, in patches."""
    away = voxels - CENTRE
    towards = away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-9)
    waves, phases = 4.0 * rng.normal(size=(6, 3)) / np.sqrt(3), rng.uniform(0, 2 * np.pi, 6)
    sphere = rng.normal(size=(20_000, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)

    def height(directions):
        return np.cos(directions @ waves.T + phases).sum(axis=-1)

    return height(towards) < np.quantile(height(sphere), 0.4)


def outlines(beyond):
    """Exact outlines of where `beyond` is negative, on every fifth slice of it."""
    slices = np.flatnonzero((beyond < 0).any(axis=(1, 2)))[::EVERY]
    found = []
    for z in map(int, slices):
        loop = max(measure.find_contours(beyond[z], 0.0), key=enclosed_area)
        flat = evenly_spaced(loop, POINTS)
        points = np.column_stack([flat[:, 1], flat[:, 0], np.full(len(flat), float(z))])
        found.append(Outline(1, z, 2, points))
    return found
