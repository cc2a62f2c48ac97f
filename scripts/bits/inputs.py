"""The inputs, made from a seed: clouds, a closed mesh, labels, and a stack of two balls with their marks."""

import numpy as np
import tifffile


def sphere(rng, count, radius=1.0, centre=(0, 0, 0)):
    """Random points on a sphere."""
    directions = rng.normal(size=(count, 3))
    return radius * directions / np.linalg.norm(directions, axis=1, keepdims=True) + centre


def torus(rng, count):
    """Random points on a torus of radii 1 and 0.4."""
    around, across = rng.uniform(0, 2 * np.pi, (2, count))
    ring = 1 + 0.4 * np.cos(across)
    return np.stack([ring * np.cos(around), ring * np.sin(around), 0.4 * np.sin(across)], axis=1)


def ball_mesh(path, steps=24):
    """A closed mesh: a ball of rings and segments."""
    polar = np.pi * np.arange(1, steps // 2) / (steps // 2)
    azimuth = 2 * np.pi * np.arange(steps) / steps
    rings = [[(np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)) for a in azimuth] for p in polar]
    corners = [(0, 0, 1), *(corner for ring in rings for corner in ring), (0, 0, -1)]

    def at(ring, segment):
        return 1 + ring * steps + segment % steps

    faces = [(0, at(0, s), at(0, s + 1)) for s in range(steps)]
    for ring in range(len(rings) - 1):
        for s in range(steps):
            a, b, c, d = at(ring, s), at(ring + 1, s), at(ring + 1, s + 1), at(ring, s + 1)
            faces += [(a, b, c), (a, c, d)]
    faces += [(at(len(rings) - 1, s), len(corners) - 1, at(len(rings) - 1, s + 1)) for s in range(steps)]
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in corners]
    path.write_text("\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces)]) + "\n")


def write_points(path, points, header="x,y,z"):
    """A table of points."""
    np.savetxt(path, points, delimiter=",", header=header, comments="", fmt="%.9g")


def stack(folder, rng):
    """Two bright balls that touch, noise, and outlines of both on every fourth slice."""
    z, y, x = np.mgrid[0:40, 0:96, 0:96].astype(float)
    marks, image = [], np.full(z.shape, 40.0)
    for label, (cx, cy, cz, radius) in enumerate([(34, 46, 20, 15), (63, 46, 20, 14)], 1):
        image[(x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2 < radius**2] = 140
        for at in range(cz - 12, cz + 13, 4):
            across = np.sqrt(radius**2 - (at - cz) ** 2)
            angles = 2 * np.pi * np.arange(14) / 14
            marks += [(label, at, cx + across * np.cos(a), cy + across * np.sin(a), at) for a in angles]
    image += rng.normal(0, 8, image.shape)
    tifffile.imwrite(folder / "stack.tif", np.clip(image, 0, 255).astype(np.uint8))
    write_points(folder / "marks.csv", marks, "object,contour,x,y,z")


def make(folder):
    """Writes all inputs into the folder."""
    rng = np.random.default_rng(22)
    write_points(folder / "cloud-a.csv", sphere(rng, 3000))
    write_points(folder / "cloud-b.csv", sphere(rng, 2000, 0.5, (1.8, 0.2, 0.1)))
    write_points(folder / "cloud-c.csv", rng.uniform(-1, 1, (500, 3)) * (0.2, 1, 1) + (-1.7, 0, 0))
    write_points(folder / "sphere.csv", sphere(rng, 4000))
    write_points(folder / "torus.csv", torus(rng, 6000))
    ball_mesh(folder / "ball.obj")
    labels = np.zeros((30, 40, 50), np.uint8)
    labels[5:20, 5:20, 5:20], labels[8:25, 22:35, 10:45], labels[3:9, 3:30, 30:47] = 1, 2, 7
    tifffile.imwrite(folder / "labels.tif", labels)
    stack(folder, rng)
