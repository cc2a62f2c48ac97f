"""The sources of the experiments (Kósa & Mikula 2023, sections 3 and 4) and files for them."""

from pathlib import Path

import numpy as np

from .grids import Grid


def cube_grid(n):
    """[-0.4, 1.4]^3 with n grid points along each axis."""
    return Grid((n, n, n), 1.8 / (n - 1), (-0.4, -0.4, -0.4))


def cube_mask(grid):
    """True at the grid points on the surface of the unit cube, `[z, y, x]`."""
    low, high = round(0.4 / grid.spacing), round(1.4 / grid.spacing)
    mask = np.zeros(grid.shape[::-1], dtype=bool)
    mask[low : high + 1, low : high + 1, low : high + 1] = True
    mask[low + 1 : high, low + 1 : high, low + 1 : high] = False
    return mask


def masked_points(grid, mask):
    """Positions of the grid points where `mask` is true (n x 3, x y z)."""
    z, y, x = np.nonzero(mask)
    return np.stack([grid.axis(0)[x], grid.axis(1)[y], grid.axis(2)[z]], axis=1)


def cube_distance(grid, z0, z1):
    """Exact distance to the unit cube's surface in the planes z0 .. z1 of the grid, f64 `[z, y, x]`."""
    beyond = [np.abs(grid.axis(a) - 0.5) - 0.5 for a in range(3)]
    qx, qy, qz = beyond[0][None, None, :], beyond[1][None, :, None], beyond[2][z0:z1, None, None]
    outside = np.sqrt(np.maximum(qx, 0) ** 2 + np.maximum(qy, 0) ** 2 + np.maximum(qz, 0) ** 2)
    inside = np.minimum(np.maximum(np.maximum(qx, qy), qz), 0)
    return outside - inside


def sphere(centre_x, radius):
    """231 points: both angles in steps of pi/10, both ends in, duplicates kept."""
    p, t = _angles()
    return _points(centre_x + radius * np.cos(p) * np.sin(t), radius * np.cos(p) * np.cos(t), radius * np.sin(p))


def sponge():
    """231 points of equation (11), with its printing error mended (`y = cos p cos t`)."""
    p, t = _angles()
    r = 0.207 + 2.003 * np.sin(p) ** 2 - 1.123 * np.sin(p) ** 4
    return _points(r * np.cos(p) * np.sin(t), np.cos(p) * np.cos(t), np.sin(p))


def _angles():
    return np.meshgrid(np.arange(21) * np.pi / 10, np.arange(11) * np.pi / 10, indexing="ij")


def _points(x, y, z):
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1).reshape(-1, 3)


def read_off(path):
    """Vertices (n x 3) and triangles (m x 3) of an OFF file of triangles."""
    lines = [line for line in Path(path).read_text().splitlines() if line.strip() and not line.startswith("#")]
    vertices, triangles, _ = map(int, lines[1].split())
    positions = np.array([line.split() for line in lines[2 : 2 + vertices]], dtype=float)
    corners = np.array([line.split() for line in lines[2 + vertices : 2 + vertices + triangles]], dtype=int)
    return positions, corners[:, 1:4]


def write_cloud(path, points):
    """Binary PLY with f64 coordinates: nothing is rounded."""
    write_mesh(path, points, np.empty((0, 3), dtype=int))


def write_mesh(path, points, triangles):
    """Binary PLY with f64 coordinates; no triangles: a point cloud."""
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz")
    if len(triangles):
        header += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\n"
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    body = np.asarray(points, dtype="<f8").tobytes() + faces.tobytes()
    Path(path).write_bytes((header + "end_header\n").encode("ascii") + body)
