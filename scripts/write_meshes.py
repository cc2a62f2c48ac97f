#!/usr/bin/env python3
"""Writes random meshes with trimesh in every form that it knows and strandline reads.

    write_meshes.py FOLDER SEED

FOLDER gets the files and meshes.json: for each file its name, the corners of its triangles in their order, volume and area,
both as positive numbers, and whether the mesh was turned inside out.
"""

import json
import sys
from pathlib import Path

import numpy as np
import trimesh

FORMS = [
    ("ply", {"encoding": "ascii"}),
    ("ply", {"encoding": "binary"}),
    ("ply", {"encoding": "binary", "vertex_normal": True}),
    ("off", {}),
    ("stl", {}),
    ("stl_ascii", {}),
    ("obj", {"include_normals": True}),
    ("obj", {"include_normals": False}),
]


def body(random):
    """A random body in a random place, as sound as trimesh makes it."""
    kind = random.integers(5)
    sizes = random.uniform(0.5, 2.0, 3)
    if kind == 0:
        mesh = trimesh.creation.box(extents=sizes)
    elif kind == 1:
        mesh = trimesh.creation.icosphere(subdivisions=2, radius=sizes[0])
    elif kind == 2:
        mesh = trimesh.creation.cylinder(radius=sizes[0], height=sizes[1], sections=17)
    elif kind == 3:
        mesh = trimesh.creation.annulus(r_min=0.4 * sizes[0], r_max=sizes[0], height=sizes[1], sections=12)
    else:
        mesh = trimesh.creation.torus(sizes[0] + 0.5, 0.3 * sizes[1], major_sections=12, minor_sections=8)
    mesh.apply_transform(trimesh.transformations.random_rotation_matrix(random.random(3)))
    mesh.apply_translation(random.uniform(-3, 3, 3))
    return mesh


def main(folder, seed):
    random = np.random.default_rng(seed)
    written = []
    for n in range(32):
        mesh = body(random)
        form, options = FORMS[n % len(FORMS)]
        inverted = bool(random.integers(2))
        volume, area = float(mesh.volume), float(mesh.area)
        if inverted:
            mesh.invert()
        mesh.vertices = mesh.vertices.astype(np.float32).astype(np.float64)
        name = f"{n}.{form}"
        mesh.export(folder / name, file_type=form, **options)
        corners = mesh.vertices[mesh.faces].tolist()
        written.append({"file": name, "corners": corners, "volume": volume, "area": area, "inverted": inverted})
    (folder / "meshes.json").write_text(json.dumps(written))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
