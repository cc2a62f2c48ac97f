#!/usr/bin/env python3
"""Checks a distance that strandline computed to a mesh with libigl, on voxels taken at random.

    check_mesh_distance.py OUT.zarr MESH [--voxels N] [--seed S]

OUT.zarr is what `strandline distance MESH -o OUT.zarr` wrote; libigl reads the same MESH. Within one voxel of the surface
the distance must be exact (1e-5 of it); elsewhere it must not be below the exact distance, nor above by half a voxel.
Where the report says that distances are signed, they must be negative where libigl's winding number is above 1/2.
"""

import argparse
import json
import sys
from pathlib import Path

import igl
import numpy as np
import zarr

# The share of a voxel that rounding to the stored type and libigl's own may take at the surface itself.
ROUNDING = 1e-6


def sample(store, count, seed):
    """World positions [x, y, z] of random voxels, their values, the smallest and the largest spacing."""
    dataset = json.loads((store / "zarr.json").read_text())["attributes"]["ome"]["multiscales"][0]["datasets"][0]
    scale, translation = (np.array(t[t["type"]])[::-1] for t in dataset["coordinateTransformations"])
    values = zarr.open_array(store / dataset["path"], mode="r")[...]
    chosen = np.random.default_rng(seed).choice(values.size, min(count, values.size), replace=False)
    voxels = np.stack(np.unravel_index(chosen, values.shape)[::-1], axis=1)
    return voxels * scale + translation, values.ravel()[chosen].astype(np.float64), scale.min(), scale.max()


def check(store, mesh, count, seed):
    places, values, h, widest = sample(store, count, seed)
    vertices, triangles = igl.read_triangle_mesh(str(mesh))
    vertices, triangles = np.asarray(vertices, np.float64), np.asarray(triangles, np.int64)
    exact = np.sqrt(igl.point_mesh_squared_distance(places, vertices, triangles)[0])
    excess = np.abs(values) - exact
    band = exact <= h
    inside_band = np.abs(excess[band]) / np.maximum(exact[band], 0.1 * ROUNDING * h / 1e-5)
    wrong = excess > 1e-5 * exact + ROUNDING * h
    print(f"{len(triangles)} triangles, {len(values)} voxels of edge {h:g}, {band.sum()} of them beside the surface")
    print(f"beside the surface: relative error {inside_band.max(initial=0):.1e} at most")
    print(f"elsewhere: {(wrong & ~band).mean():.1e} of the voxels inexact, by {excess[~band].max(initial=0) / widest:.3f} voxels")
    problems = []
    if (inside_band > 1e-5).any():
        problems.append("distances beside the surface are not exact")
    if (excess < -1e-5 * exact - ROUNDING * h).any():
        problems.append("there are distances below the exact one")
    if (excess[~band] >= 0.5 * widest).any():
        problems.append("there are distances above the exact one by half a voxel")
    settings = json.loads((store / "report.json").read_text())["settings"]
    if settings["exact"] and wrong.any():
        problems.append("distances are not exact")
    if settings["signed"]:
        winding = igl.fast_winding_number(vertices, triangles, places)
        clear = (np.abs(winding - 0.5) > 0.05) & (exact > ROUNDING * h)
        flipped = ((winding > 0.5) != (values < 0)) & clear
        print(f"signs: {(values < 0).sum()} inside, {clear.sum()} told clearly, {flipped.sum()} of them wrong")
        if flipped.any() or not (values < 0).any():
            problems.append("signs are wrong")
    return problems


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store", type=Path)
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--voxels", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    problems = check(arguments.store, arguments.mesh, arguments.voxels, arguments.seed)
    if problems:
        sys.exit(f"{arguments.store}: {'; '.join(problems)}")


if __name__ == "__main__":
    main()
