"""Shapes of the experiments with middle surfaces: meshes of cube and ball, ellipsoids, waves."""

import numpy as np


def cube():
    """The unit cube as 12 triangles."""
    vertices = np.array([(n & 1, n >> 1 & 1, n >> 2) for n in range(8)], dtype=float)
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return vertices, np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])


def ball(times, centre, radius):
    """An icosahedron whose triangles were cut in four so many times, on a sphere."""
    golden = (1 + 5**0.5) / 2
    vertices = np.array([np.roll((0.0, y, z), n) for n in range(3) for y in (-1, 1) for z in (-golden, golden)])
    edges = np.linalg.norm(vertices[:, None] - vertices[None], axis=-1) < 2.1
    triangles = [
        (a, b, c)
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if edges[a, b] and edges[b, c] and edges[a, c]
    ]
    triangles = np.array(triangles)
    outward = np.linalg.det(vertices[triangles]) > 0
    triangles[~outward] = triangles[~outward][:, ::-1]
    vertices /= np.linalg.norm(vertices[0])
    for _ in range(times):
        sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        unique, place = np.unique(sides, axis=0, return_inverse=True)
        middles = vertices[unique].mean(axis=1)
        middles /= np.linalg.norm(middles, axis=1)[:, None]
        ab, bc, ca = place.reshape(3, -1) + len(vertices)
        a, b, c = triangles.T
        vertices = np.concatenate([vertices, middles])
        triangles = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    return centre + radius * vertices, triangles


def ellipsoids():
    """Five clouds of 2,000 points, their centres in z = 0."""
    centres = [(-0.9, -0.6, 0), (0.8, -0.7, 0), (0.05, 0.1, 0), (-0.7, 0.9, 0), (0.9, 0.8, 0)]
    axes = [(0.45, 0.3, 0.35), (0.35, 0.45, 0.3), (0.3, 0.35, 0.4), (0.4, 0.35, 0.3), (0.45, 0.35, 0.4)]
    n = np.arange(2000) + 0.5
    lift, turn = np.arccos(1 - n / 1000), np.pi * (1 + 5**0.5) * n
    unit = np.stack([np.cos(turn) * np.sin(lift), np.sin(turn) * np.sin(lift), np.cos(lift)], axis=1)
    return [unit * size + centre for centre, size in zip(centres, axes)]


def waves():
    """z = 0.2 cos(xy) + 0.5 and - 0.5 on [-5, 5]^2, step 0.05 (equation 12)."""
    x, y = np.meshgrid(np.linspace(-5, 5, 201), np.linspace(-5, 5, 201))
    return [np.stack([x, y, 0.2 * np.cos(x * y) + lift], axis=-1).reshape(-1, 3) for lift in (0.5, -0.5)]
