"""The inputs that all programs get, and the exact distances that all are compared with."""

import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from common import shapes
from common.grids import Grid


@dataclass
class Case:
    """One input in the forms that the programs take."""

    name: str
    title: str
    grid: Grid
    table: str  # of adapters: GRID_PEERS or MESH_PEERS
    stored: Path  # .npz for the peers
    source: Path  # for strandline
    flags: list

    def errors(self, layers, band=None):
        """Mean squared and largest error of a field, given as (first plane, planes); `band`: within so many voxels."""
        raise NotImplementedError


class CubeCase(Case):
    """The grid points on the surface of the unit cube; every voxel is compared."""

    def errors(self, layers, band=None):
        total, largest = 0.0, 0.0
        for z, planes in layers:
            difference = np.abs(planes).astype(float) - shapes.cube_distance(self.grid, z, z + len(planes))
            total += float((difference * difference).sum())
            largest = max(largest, float(np.abs(difference).max()))
        return total / self.grid.voxels, largest


class MeshCase(Case):
    """A triangle mesh; 20,000 random voxels are compared with libigl."""

    def errors(self, layers, band=None):
        chosen, exact = self.truth
        nx, ny, _ = self.grid.shape
        found = np.empty(len(chosen))
        for z, planes in layers:
            here = (chosen >= z * nx * ny) & (chosen < (z + len(planes)) * nx * ny)
            local = chosen[here] - z * nx * ny
            found[here] = np.abs(planes[local // (nx * ny), local // nx % ny, local % nx])
        difference = (found - exact)[exact < band * self.grid.spacing] if band else found - exact
        return float((difference**2).mean()), float(np.abs(difference).max())


def cube(n, scratch):
    """The Cube experiment with n grid points along each axis."""
    grid = shapes.cube_grid(n)
    mask = shapes.cube_mask(grid)
    stored, source = scratch / f"cube-{n}.npz", scratch / f"cube-{n}.ply"
    np.savez(stored, mask=mask, spacing=grid.spacing)
    shapes.write_cloud(source, shapes.masked_points(grid, mask))
    flags = [*grid.flags(), "--init", "grid"]
    return CubeCase(f"cube-{n}", f"Cube experiment, {n}^3", grid, "GRID_PEERS", stored, source, flags)


def mesh(name, path, scratch, python, longest=256):
    """A mesh in the middle of a cube of `longest`^3 voxels, a tenth of its size away from the border."""
    positions, faces = read_mesh(path)
    low, high = positions.min(axis=0), positions.max(axis=0)
    spacing = float((high - low).max()) * 1.2 / (longest - 1)
    origin = tuple(float(c) for c in (low + high) / 2 - spacing * (longest - 1) / 2)
    grid = Grid((longest,) * 3, spacing, origin)
    stored, source = scratch / f"{name}.npz", scratch / f"{name}.ply"
    np.savez(
        stored, vertices=positions, faces=faces, shape=np.array(grid.shape), spacing=spacing, origin=np.array(origin)
    )
    shapes.write_mesh(source, positions, faces)
    case = MeshCase(name, f"{name}, {len(faces):,} triangles, {grid}", grid, "MESH_PEERS", stored, source, grid.flags())
    case.truth = truth(case, scratch / f"{name}-truth.npy", python)
    return case


def truth(case, out, python):
    """Random voxels (their place in the field) and libigl's distance there."""
    chosen = np.random.default_rng(1).integers(0, case.grid.voxels, 20_000)
    nx, ny, _ = case.grid.shape
    x, y, z = chosen % nx, chosen // nx % ny, chosen // (nx * ny)
    places = np.stack([case.grid.axis(0)[x], case.grid.axis(1)[y], case.grid.axis(2)[z]], axis=1)
    np.save(out, places)
    code = (
        "import sys, igl, numpy as np\n"
        "case, places = np.load(sys.argv[1]), np.load(sys.argv[2])\n"
        "squared = igl.point_mesh_squared_distance(places, case['vertices'], case['faces'].astype(np.int64))[0]\n"
        "np.save(sys.argv[2], np.sqrt(squared))\n"
    )
    subprocess.run([str(python), "-c", code, str(case.stored), str(out)], check=True)
    return chosen, np.load(out)


def read_mesh(path):
    """OFF, or the binary PLY of f32 vertices and triangles that the whale is."""
    if path.suffix == ".off":
        return shapes.read_off(path)
    data = path.read_bytes()
    header, _, body = data.partition(b"end_header\n")
    counts = {
        words[1]: int(words[2]) for words in map(str.split, header.decode().splitlines()) if words[0] == "element"
    }
    properties = header.decode().partition("element face")[0].count("property float")
    vertices = np.frombuffer(body, dtype="<f4", count=counts["vertex"] * properties).reshape(-1, properties)
    faces = np.frombuffer(
        body, dtype=[("n", "u1"), ("corners", "<i4", 3)], count=counts["face"], offset=vertices.nbytes
    )
    return vertices[:, :3].astype(float), faces["corners"].astype(np.int64)
