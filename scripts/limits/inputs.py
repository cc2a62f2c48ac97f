"""The inputs of one job, made from a seed: clouds, closed meshes, volumes of labels, stacks with marks; TIFF and OME-Zarr."""

import json
import zlib

import numpy as np
import tifffile


def write_points(path, points, header="x,y,z"):
    """A table of points."""
    np.savetxt(path, points, delimiter=",", header=header, comments="", fmt="%.7g")


def cloud(path, rng, count, centre=(0, 0, 0), shape="ball"):
    """Points on a ball of radius 1, on the lower part of one (a bowl), on a torus, or anywhere."""
    directions = rng.normal(size=(count, 3))
    points = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    if shape == "bowl":
        points = points[points[:, 2] < 0.5]
    elif shape == "torus":
        around, across = rng.uniform(0, 2 * np.pi, (2, count))
        ring = 1 + 0.4 * np.cos(across)
        points = np.stack([ring * np.cos(around), ring * np.sin(around), 0.4 * np.sin(across)], axis=1)
    elif shape == "spread":
        points = rng.uniform(-1, 1, (count, 3))
    write_points(path, points + rng.normal(0, 0.002, points.shape) + centre)


def mesh(path, rng, triangles, centre=(0, 0, 0)):
    """A closed ball of about so many triangles, a little dented."""
    steps = max(6, int(np.sqrt(triangles)))
    rings = max(3, steps // 2)
    polar = np.pi * np.arange(1, rings) / rings
    azimuth = 2 * np.pi * np.arange(steps) / steps
    p, a = np.meshgrid(polar, azimuth, indexing="ij")
    ball = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=2).reshape(-1, 3)
    corners = np.concatenate([[[0, 0, 1]], ball, [[0, 0, -1]]])
    corners = corners * (1 + 0.1 * np.sin(3 * corners[:, :1] + rng.uniform(0, 6))) + centre
    ring, segment = np.meshgrid(np.arange(rings - 2), np.arange(steps), indexing="ij")

    def at(ring, segment):
        return 1 + ring * steps + segment % steps

    a, b = at(ring, segment).ravel(), at(ring + 1, segment).ravel()
    c, d = at(ring + 1, segment + 1).ravel(), at(ring, segment + 1).ravel()
    last, turns = len(corners) - 1, np.arange(steps)
    faces = np.concatenate(
        [
            np.stack([0 * turns, at(0, turns), at(0, turns + 1)], 1),
            np.stack([a, b, c], 1),
            np.stack([a, c, d], 1),
            np.stack([at(rings - 2, turns + 1), at(rings - 2, turns), last + 0 * turns], 1),
        ]
    )
    with path.open("w", encoding="ascii") as file:
        np.savetxt(file, corners, fmt="v %.7g %.7g %.7g")
        np.savetxt(file, faces + 1, fmt="f %d %d %d")


def write_tiff(path, values, packed):
    """A stack of one page for each plane, in strips of any height."""
    tifffile.imwrite(path, values, compression="zlib" if packed else None, rowsperstrip=packed or None)


def write_zarr(path, values, chunk, packed):
    """An OME-Zarr image of version 0.4 with spacing 1."""
    array = path / "0"
    array.mkdir(parents=True)
    names = ["z", "y", "x"]
    axes = [{"name": name, "type": "space", "unit": "micrometer"} for name in names]
    scale = [{"type": "scale", "scale": [1.0, 1.0, 1.0]}]
    levels = [{"path": "0", "coordinateTransformations": scale}]
    (path / ".zgroup").write_text('{"zarr_format": 2}')
    (path / ".zattrs").write_text(json.dumps({"multiscales": [{"version": "0.4", "axes": axes, "datasets": levels}]}))
    meta = {
        "zarr_format": 2,
        "shape": values.shape,
        "chunks": chunk,
        "dtype": values.dtype.newbyteorder("<").str,
        "compressor": {"id": "zlib", "level": 1} if packed else None,
        "fill_value": 0,
        "order": "C",
        "filters": None,
        "dimension_separator": "/",
    }
    (array / ".zarray").write_text(json.dumps(meta))
    for at in np.ndindex(*(-(-n // c) for n, c in zip(values.shape, chunk, strict=True))):
        part = values[tuple(slice(i * c, (i + 1) * c) for i, c in zip(at, chunk, strict=True))]
        whole = np.zeros(chunk, values.dtype)
        whole[tuple(slice(0, n) for n in part.shape)] = part
        file = array.joinpath(*map(str, at))
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(zlib.compress(whole.tobytes(), 1) if packed else whole.tobytes())


def write_volume(path, values, rng):
    """A volume in the form of its name, divided at random."""
    packed = bool(rng.integers(2))
    if path.suffix == ".zarr":
        chunk = [int(min(n, rng.choice([16, 32, 64, 100, 128, 256, 1024]))) for n in values.shape]
        write_zarr(path, values, chunk, packed)
    else:
        write_tiff(path, values, int(rng.choice([1, 16, 64, values.shape[1]])) if packed else 0)


def balls(rng, shape, count):
    """Centres (x, y, z) and radii of balls in a volume of a shape `[z, y, x]` in cells of a row along x, which touch."""
    depth, height, width = shape
    radius = 0.45 * min(width / count, height, depth)
    centres = [((n + 0.5) * width / count, 0.5 * height, 0.5 * depth) for n in range(count)]
    return [(centre, radius * rng.uniform(0.8, 1.1)) for centre in centres]


def stack(folder, name, rng, shape, dtype, objects, wide):
    """A stack of balls and a table of marks: outlines on slices, or with `wide` none, points anywhere on the balls."""
    z, y, x = np.ogrid[: shape[0], : shape[1], : shape[2]]
    image, marks = np.full(shape, 40, np.float32), []
    for label, ((cx, cy, cz), radius) in enumerate(balls(rng, shape, objects), 1):
        image[(x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2 < radius**2] = 140
        if wide is None:
            directions = rng.normal(size=(int(2 * radius**2), 3))
            points = radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)
            marks += [(label, cx + px, cy + py, cz + pz) for px, py, pz in points]
            continue
        for at in np.arange(np.ceil(cz - 0.9 * radius), cz + 0.9 * radius, wide):
            across = np.sqrt(radius**2 - (at - cz) ** 2)
            angles = 2 * np.pi * np.arange(24) / 24
            marks += [(label, int(at), cx + across * np.cos(a), cy + across * np.sin(a), at) for a in angles]
    image += rng.normal(0, 8, shape).astype(np.float32)
    values = np.clip(image, 0, 255)
    write_volume(folder / name, (values * (1 if dtype == "u1" else 100)).astype(dtype), rng)
    write_points(folder / "marks.csv", marks, "object,x,y,z" if wide is None else "object,contour,x,y,z")


def labels(path, rng, shape, count):
    """A volume of labels: Voronoi cells of some points within a ball, 0 beyond it."""
    z, y, x = np.ogrid[: shape[0], : shape[1], : shape[2]]
    centres = rng.uniform(0, 1, (count, 3)) * shape
    nearest, values = np.full(shape, np.inf, np.float32), np.zeros(shape, np.uint16)
    for label, (cz, cy, cx) in enumerate(centres, 1):
        away = ((x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2).astype(np.float32)
        closer = away < nearest
        nearest[closer], values[closer] = away[closer], label
    middle = [0.5 * n for n in shape]
    beyond = ((z - middle[0]) / middle[0]) ** 2 + ((y - middle[1]) / middle[1]) ** 2 + ((x - middle[2]) / middle[2]) ** 2
    values[beyond > 0.8] = 0
    write_volume(path, values, rng)
