"""Bodies whose surface is known: functions that are negative inside, and their meshes."""

import numpy as np
import trimesh
from skimage.measure import marching_cubes

# Voxels along the longest side of the grid that a body's own mesh is drawn on.
FINE = 220


def ball(p, centre, radius):
    return np.linalg.norm(p - centre, axis=-1) - radius


def capsule(p, a, b, radius):
    a, b = np.array(a, float), np.array(b, float)
    along = np.clip(((p - a) @ (b - a)) / ((b - a) @ (b - a)), 0, 1)
    return np.linalg.norm(p - a - along[..., None] * (b - a), axis=-1) - radius


def box(p, centre, half, rounded):
    q = np.abs(p - centre) - (np.array(half) - rounded)
    return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0) - rounded


def torus(p, centre, radius, tube):
    q = p - centre
    return np.hypot(np.hypot(q[..., 0], q[..., 1]) - radius, q[..., 2]) - tube


def joined(a, b, width):
    """The union of two bodies, its crease rounded over a width."""
    h = np.clip(0.5 + 0.5 * (b - a) / width, 0, 1)
    return b * (1 - h) + a * h - width * h * (1 - h)


def hammer(p):
    head = joined(box(p, (0, 0, 1.0), (0.42, 0.17, 0.17), 0.04), capsule(p, (0.3, 0, 1.0), (0.75, 0, 0.85), 0.06), 0.05)
    return joined(head, capsule(p, (0, 0, -0.9), (0, 0, 0.9), 0.085), 0.03)


def statue(p):
    body = joined(ball(p, (0, 0, 0), 0.5), ball(p, (0, 0.05, 0.62), 0.36), 0.15)
    body = joined(body, ball(p, (0, 0.1, 1.15), 0.22), 0.1)
    for side in (-1, 1):
        body = joined(body, capsule(p, (side * 0.3, 0, 0.75), (side * 0.75, 0.25, 0.4), 0.07), 0.06)
        body = joined(body, capsule(p, (side * 0.75, 0.25, 0.4), (side * 0.55, 0.5, 0.95), 0.055), 0.04)
        body = joined(body, capsule(p, (side * 0.2, 0, -0.3), (side * 0.28, 0, -1.0), 0.13), 0.08)
        body = joined(body, box(p, (side * 0.15, 0.1, 1.42), (0.05, 0.02, 0.12), 0.015), 0.03)
    return joined(body, box(p, (0, 0, -1.05), (0.6, 0.45, 0.08), 0.03), 0.04)


def rings(p):
    """A torus through which another passes, and a ball beside them."""
    second = torus((p - (0.6, 0, 0))[..., [0, 2, 1]], (0, 0, 0), 0.6, 0.2)
    return np.minimum(np.minimum(torus(p, (0, 0, 0), 0.6, 0.2), second), ball(p, (-1.25, 0, 0.3), 0.3))


def foot(p):
    """26 ellipsoids beside each other."""
    found = np.full(p.shape[:-1], np.inf)
    for centre, axes, turn in _bones():
        q = (p - centre) @ turn
        k0, k1 = np.linalg.norm(q / axes, axis=-1), np.linalg.norm(q / axes**2, axis=-1)
        found = np.minimum(found, k0 * (k0 - 1) / np.maximum(k1, 1e-9))
    return found


def _bones():
    random = np.random.default_rng(5)
    for toe in range(5):
        at = np.array([0.28 * (toe - 2), 0.0, 0.0])
        for n in range(4 if toe else 3):
            length = (0.26, 0.12, 0.09, 0.07)[n]
            centre = at + (0.04 * (toe - 2) * n, (0.0, 0.44, 0.71, 0.92)[n], -0.05 * n)
            yield centre, np.array([0.095, length, 0.085]), np.eye(3)
    for n in range(7):
        centre = np.array([0.36 * (n % 3 - 1), -0.48 - 0.37 * (n // 3), 0.06 * (n // 3)])
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        yield centre, np.array([0.14, 0.15, 0.13]), turn


# With the Euler number and the pieces that the surface has.
BODIES = {"hammer": (hammer, 2, 1), "statue": (statue, 0, 1), "rings": (rings, 2, 3), "foot": (foot, 52, 26)}
EXTENT = 1.8


def mesh_of(name):
    """A fine mesh of a body's surface, vertices moved onto it."""
    body = BODIES[name][0]
    step = 2 * EXTENT / FINE
    axis = np.arange(-EXTENT, EXTENT + step, step)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1)
    values = np.stack([body(slab) for slab in grid])
    vertices, faces, *_ = marching_cubes(values, 0.0, spacing=(step,) * 3)
    vertices -= EXTENT
    for _ in range(4):
        vertices -= body(vertices)[:, None] * gradient(body, vertices)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    return mesh if mesh.volume > 0 else trimesh.Trimesh(vertices, faces[:, ::-1], process=False)


def gradient(body, p, step=1e-4):
    slopes = np.stack([body(p + e) - body(p - e) for e in step * np.eye(3)], -1)
    return slopes / np.maximum(np.linalg.norm(slopes, axis=-1, keepdims=True), 1e-12)
