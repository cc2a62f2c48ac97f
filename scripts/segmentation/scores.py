"""How far a result is from the truth: overlap of objects, distance of a surface from one that is known exactly."""

import numpy as np


def dice(volume, answer):
    """Dice of each object that has a label in the answer, None for one that has not."""
    present = np.bincount(answer.labels.ravel())
    scores = {}
    for number in volume.solids:
        if number >= len(present) or not present[number]:
            scores[number] = None
            continue
        ours, theirs = volume.solid(number, answer.labels), volume.solid(number)
        scores[number] = 2.0 * np.count_nonzero(ours & theirs) / (np.count_nonzero(ours) + np.count_nonzero(theirs))
    return scores


def radial(surface, mesh):
    """Root mean square and mean of what a mesh lies beyond the true surface along the radius, weighted by area."""
    vertices, triangles = mesh
    corners = vertices[triangles]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    weights = np.bincount(triangles.ravel(), np.repeat(areas, 3), minlength=len(vertices))
    beyond = surface.beyond(vertices)
    return np.sqrt(np.average(beyond**2, weights=weights)), np.average(beyond, weights=weights)
