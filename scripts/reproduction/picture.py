"""A picture of a triangle mesh: one light, no perspective, a buffer of depths; PNG by numpy alone."""

import struct
import zlib
from pathlib import Path

import numpy as np

SIDE = 320
# Points along the edge of a triangle: enough for one of a few pixels.
LATTICE = 12


def read_ply(path):
    """Vertices and triangles of a binary PLY as this program writes it."""
    data = Path(path).read_bytes()
    head, _, body = data.partition(b"end_header\n")
    counts = {
        words[1]: int(words[2])
        for words in (line.split() for line in head.decode().splitlines())
        if words[0] == "element"
    }
    vertices = np.frombuffer(body, "<f4", 3 * counts["vertex"]).reshape(-1, 3)
    tagged = b"property uint label_low" in head
    face = np.dtype([("n", "u1"), ("v", "<u4", 3), *([("labels", "<u4", 2)] if tagged else [])])
    return vertices.astype(float), np.frombuffer(body, face, counts["face"], offset=12 * counts["vertex"])["v"]


def read_tagged(path):
    """Vertices, triangles and the two labels of each, of a PLY that `middle` writes."""
    data = Path(path).read_bytes()
    head, _, body = data.partition(b"end_header\n")
    counts = dict(line.split()[1:] for line in head.decode().splitlines() if line.startswith("element"))
    vertices, faces = int(counts["vertex"]), int(counts["face"])
    face = np.dtype([("n", "u1"), ("v", "<u4", 3), ("labels", "<u4", 2)])
    table = np.frombuffer(body, face, faces, offset=12 * vertices)
    return np.frombuffer(body, "<f4", 3 * vertices).reshape(-1, 3).astype(float), table["v"], table["labels"]


def plane(distance, bright, dark, path):
    """A plane of a distance, grey, with some voxels bright and some dark."""
    grey = 90 + 100 * (distance / distance.max())
    grey[bright] = 255
    grey[dark] = 0
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(png(grey[::-1].astype(np.uint8)))


def draw(mesh, path):
    """Draws a mesh as seen from a little above its front."""
    vertices, triangles = read_ply(mesh)
    if not len(triangles):
        return
    turn, lift = np.radians(35), np.radians(20)
    about = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    tilt = np.array([[1, 0, 0], [0, np.sin(lift), np.cos(lift)], [0, -np.cos(lift), np.sin(lift)]])
    seen = (vertices - (vertices.min(0) + vertices.max(0)) / 2) @ about.T @ tilt.T
    scale = 0.46 * SIDE / np.abs(seen[:, :2]).max()
    corners = seen[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    # What is seen faces the eye, whichever side is called outward.
    normal[normal[:, 2] < 0] *= -1
    shade = 40 + 200 * np.clip(normal @ np.array([0.3, 0.4, 0.866]), 0, 1)
    # Triangles are smaller than pixels or not much larger: each is drawn as the points of a small lattice on it.
    n = LATTICE
    weights = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    points = np.einsum("wc,tcx->twx", weights, corners).reshape(-1, 3)
    shades = np.repeat(shade, len(weights))
    column = (SIDE / 2 + scale * points[:, 0]).astype(int).clip(0, SIDE - 1)
    row = (SIDE / 2 - scale * points[:, 1]).astype(int).clip(0, SIDE - 1)
    order = np.argsort(points[:, 2], kind="stable")
    canvas = np.full((SIDE, SIDE), 255, np.uint8)
    canvas[row[order], column[order]] = shades[order].astype(np.uint8)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(png(canvas))


def png(grey):
    """The bytes of an 8 bit grey PNG."""
    height, width = grey.shape
    raw = b"".join(b"\0" + line.tobytes() for line in grey)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    size = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", size) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b"")
