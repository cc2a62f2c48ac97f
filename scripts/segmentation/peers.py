"""Other ways from the same marks to an object: interpolation of outlines, and methods that then look at the image.

A peer gets an image and the outlines of one object in a box around them, and gives a field that is negative inside the
object; None where it cannot do such marks. Objects are then painted the larger first, so that a smaller one keeps what
both hold, as this program deals out labels.
"""

import time
from dataclasses import dataclass
from functools import partial

import itk
import numpy as np
from scipy import interpolate, ndimage
from skimage import measure, segmentation

from .ours import Answer
from .polygons import interpolated, reach, slices

# With several threads ITK's contour interpolation damages memory, which ends the script with an abort.
itk.MultiThreaderBase.SetGlobalDefaultNumberOfThreads(1)
# Voxels around the marks.
MARGIN = 8
# Voxels, and voxels times points, above which random walker and RBF take many minutes or more memory than there may be.
LARGEST_WALK, LARGEST_RBF = 3_000_000, 6_000_000_000


@dataclass(frozen=True)
class Box:
    """A part of the image's grid: `first` and `shape` are z, y, x, `spacing` x, y, z."""

    first: tuple
    shape: tuple
    spacing: tuple

    def axis(self, a):
        """Positions of voxel centres along axis a (0 x)."""
        return (self.first[2 - a] + np.arange(self.shape[2 - a])) * self.spacing[a]

    @property
    def part(self):
        return tuple(slice(start, start + count) for start, count in zip(self.first, self.shape))

    @property
    def sampling(self):
        return self.spacing[::-1]


def around(outlines, volume):
    points = np.concatenate([outline.points for outline in outlines]) / volume.spacing
    low = np.maximum(np.floor(points.min(axis=0)).astype(int)[::-1] - MARGIN, 0)
    high = np.minimum(np.ceil(points.max(axis=0)).astype(int)[::-1] + MARGIN + 1, volume.image.shape)
    return Box(tuple(map(int, low)), tuple(map(int, high - low)), volume.spacing)


def solve(peer, volume, outlines, _folder):
    """An Answer of a peer, or None."""
    started, fields = time.monotonic(), {}
    for number in volume.solids:
        own = [outline for outline in outlines if outline.object == number]
        box = around(own, volume)
        field = peer(volume.image[box.part], own, box)
        if field is None:
            return None
        fields[number] = (box, field)
    labels, claims = np.zeros(volume.truth.shape, dtype=int), np.zeros(volume.truth.shape, dtype=int)
    for number in sorted(fields, key=lambda number: -np.count_nonzero(fields[number][1] < 0)):
        box, field = fields[number]
        labels[box.part][field < 0] = number
        claims[box.part] += field < 0
    seconds = time.monotonic() - started
    return Answer(labels, seconds, {n: mesh(*fields[n]) for n in fields}, claims)


def mesh(box, field):
    """Vertices (x, y, z) and triangles where the field is 0; closed, as outside the box nothing is inside."""
    padded = np.pad(field, 1, constant_values=max(float(field.max()), 1e-3))
    if not (padded < 0).any():
        return np.empty((0, 3)), np.empty((0, 3), dtype=int)
    vertices, triangles, _, _ = measure.marching_cubes(padded, 0.0)
    return (vertices + np.array(box.first) - 1)[:, ::-1] * box.spacing, triangles


def on_slices(outlines):
    return all(outline.across == 2 for outline in outlines)


def sdf(_image, outlines, box):
    """Shape interpolation of signed distances."""
    return interpolated(outlines, box) if on_slices(outlines) else None


def itk_morphological(_image, outlines, box):
    """ITK's morphological contour interpolation of filled outlines."""
    if not on_slices(outlines):
        return None
    known = slices(outlines, box)
    filled = np.zeros(box.shape, dtype=np.uint8)
    for z, distance in known.items():
        filled[z - box.first[0]] = distance < 0
    found = itk.array_from_image(itk.morphological_contour_interpolator(itk.image_from_array(filled), axis=2, label=1))
    # It ends at the last outlines; they are kept as far beyond as the interpolation of distances keeps them.
    beyond = int(reach(list(known)))
    low, high = (z - box.first[0] for z in (min(known), max(known)))
    found[max(low - beyond, 0) : low] = filled[low]
    found[high + 1 : high + 1 + beyond] = filled[high]
    return 0.5 - found.astype(float)


def rbf(_image, outlines, box, smoothing=1.0):
    """Radial basis functions r^3: 0 on the marks, a distance beside them in their outline's plane. Lengths in pixels."""
    points, values = [], []
    for outline in outlines:
        axes = [axis for axis in range(3) if axis != outline.across]
        corners = outline.points / box.spacing[0]
        across, area = normals(corners[:, axes])
        # No farther than a small section's middle.
        step = min(2.0, 0.3 * np.sqrt(area / np.pi))
        for value in (0.0, -step, step):
            moved = corners.copy()
            moved[:, axes] += value * across
            points.append(moved)
            values.append(np.full(len(moved), value))
    points, where = np.unique(np.round(np.concatenate(points), 6), axis=0, return_index=True)
    if len(points) * np.prod(box.shape) > LARGEST_RBF:
        return None
    if np.linalg.matrix_rank(points - points.mean(axis=0), tol=1e-3) < 3:
        # All in one plane: nothing says where the object ends.
        return np.ones(box.shape)
    fitted = interpolate.RBFInterpolator(points, np.concatenate(values)[where], kernel="cubic", smoothing=smoothing)
    axes = [box.axis(axis) / box.spacing[0] for axis in (2, 1, 0)]
    places = np.stack(np.meshgrid(*axes, indexing="ij")[::-1], axis=-1)
    return np.concatenate([fitted(plane.reshape(-1, 3)) for plane in places]).reshape(box.shape)


def normals(corners):
    """Outward unit normals at the corners of a polygon, and its area."""
    along = np.roll(corners, -1, axis=0) - np.roll(corners, 1, axis=0)
    outward = np.column_stack([along[:, 1], -along[:, 0]])
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-12)
    x, y = corners.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    return outward * np.sign(area), abs(area)


def random_walker(image, outlines, box):
    """Random walker between what is a voxel inside the interpolated outlines and what is one outside."""
    start = sdf(image, outlines, box)
    if start is None or image.size > LARGEST_WALK:
        return None
    solid = ndimage.distance_transform_edt(start < 0, box.sampling) - ndimage.distance_transform_edt(
        start >= 0, box.sampling
    )
    width = box.spacing[0]
    seeds = np.where(solid > min(width, 0.5 * solid.max()), 1, np.where(solid < -width, 2, 0))
    if not ((seeds == 1).any() and (seeds == 2).any()):
        return start
    smooth = ndimage.gaussian_filter(image.astype(float), 1.0)
    low, high = np.percentile(smooth, (0.1, 99.9))
    found = segmentation.random_walker(
        np.clip((smooth - low) / (high - low), 0, 1),
        seeds,
        beta=10,
        mode="cg_j",
        spacing=np.array(box.sampling),
        tol=1e-4,
    )
    return found - 1.5


def geodesic(image, outlines, box):
    """ITK's geodesic active contour from the interpolated outlines, drawn to where the smoothed image is steepest.

    Scalings and iterations are the best of some twenty that were tried on the mouse nuclei; with more it leaves dim ones.
    """
    start = sdf(image, outlines, box)
    if start is None:
        return None
    sigma = [2 * box.spacing[0] / step for step in box.sampling]
    steep = ndimage.gaussian_gradient_magnitude(image.astype(float), sigma)
    contrast = np.percentile(steep[np.abs(start) < 3 * box.spacing[0]], 75)
    images = [start, 1 / (1 + (steep / max(contrast, 1e-9)) ** 2)]
    level, feature = (itk.image_from_array(values.astype(np.float32)) for values in images)
    for one in (level, feature):
        one.SetSpacing([float(step) for step in box.spacing])
    solver = itk.GeodesicActiveContourLevelSetImageFilter[type(level), type(feature), itk.F].New()
    solver.SetInput(level)
    solver.SetFeatureImage(feature)
    solver.SetPropagationScaling(0.2)
    solver.SetCurvatureScaling(0.05)
    solver.SetAdvectionScaling(1.0)
    solver.SetNumberOfIterations(10)
    solver.SetMaximumRMSError(0.005)
    solver.Update()
    return itk.array_from_image(solver.GetOutput()).astype(float)


def load(names):
    """Loads what ITK loads at first use, which takes it longer than any of these stacks."""
    for name, part in (
        ("ITK", "MorphologicalContourInterpolator"),
        ("geodesic", "GeodesicActiveContourLevelSetImageFilter"),
    ):
        if name in names:
            getattr(itk, part)


# RBF twice: all but through the marks, and smoothed as does best where they are jittered and the truth is smooth.
PEERS = {
    "SDF": sdf,
    "ITK": itk_morphological,
    "RBF": rbf,
    "RBF smooth": partial(rbf, smoothing=500.0),
    "random walker": random_walker,
    "geodesic": geodesic,
}
