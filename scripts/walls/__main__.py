"""scripts/bench_walls: walls between labels of volumes whose true surface is known, by this program and vtkSurfaceNets3D."""

import argparse
import json
import os
import statistics
import subprocess
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import tifffile
import vtk
from scipy.spatial import cKDTree
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from common import page

# Half axes and spacing of bodies in their surroundings, in one unit; middles lie off the voxels.
BODIES = (
    ((10, 10, 10), (1, 1, 1)),
    ((20, 20, 20), (1, 1, 1)),
    ((40, 40, 40), (1, 1, 1)),
    ((30, 20, 12), (1, 1, 1)),
    ((20, 20, 20), (0.5, 0.5, 1)),
    ((20, 20, 20), (1, 1, 2)),
    ((20, 20, 20), (1, 1, 3)),
    ((60, 40, 50), (1, 2, 1.5)),
)
OFF = (0.1, 0.23, 0.37)
CELLS, EDGE = 50, 128


def body(axes, spacing):
    """Labels 2 of an ellipsoid and 1 around it, [z, y, x], and its middle."""
    axes, spacing = np.array(axes, float), np.array(spacing, float)
    shape = 2 * np.ceil(axes / spacing).astype(int) + 21
    middle = shape // 2 + np.array(OFF)
    z, y, x = np.ogrid[: shape[2], : shape[1], : shape[0]]
    within = sum(((v - m) * h / a) ** 2 for v, m, h, a in zip((x, y, z), middle, spacing, axes)) < 1
    return np.where(within, 2, 1).astype(np.uint16), middle * spacing


def area_of(axes, steps=1200):
    """The area of an ellipsoid, by quadrature over its two angles."""
    a, b, c = axes
    lift = (np.arange(steps)[:, None] + 0.5) / steps * np.pi
    turn = (np.arange(steps)[None] + 0.5) / steps * 2 * np.pi
    x, y, z = np.sin(lift) * np.cos(turn), np.sin(lift) * np.sin(turn), np.cos(lift)
    element = np.sin(lift) * np.sqrt((b * c * x) ** 2 + (a * c * y) ** 2 + (a * b * z) ** 2)
    return element.sum() * 2 * (np.pi / steps) ** 2


def cells():
    """A volume of cells that touch, those of some middles after three steps towards their centres."""
    random = np.random.default_rng(1)
    middles = random.random((CELLS, 3)) * EDGE
    for _ in range(3):
        places = random.random((40_000, 3)) * EDGE
        nearest = cKDTree(middles).query(places)[1]
        middles = np.array([places[nearest == n].mean(0) for n in range(CELLS)])
    z, y, x = np.indices((EDGE,) * 3).reshape(3, -1)
    nearest = cKDTree(middles).query(np.stack([x, y, z], 1))[1]
    return (nearest.reshape((EDGE,) * 3) + 1).astype(np.uint16), middles


def ours(labels, spacing, folder, flags=()):
    """Corners of the triangles, their labels, seconds, and MiB, by this program."""
    image, mesh, report = (folder / name for name in ("labels.tif", "walls.ply", "report.json"))
    tifffile.imwrite(
        image, labels, imagej=True, resolution=(1 / spacing[0], 1 / spacing[1]), metadata={"axes": "ZYX", "spacing": spacing[2]}
    )
    spaced = ["--image-spacing", ",".join(map(str, spacing))]
    command = [os.environ["STRANDLINE"], "middle", image, *spaced, *flags, "-q", "-o", "none", "--overwrite"]
    command += ["--mesh", mesh, "--report", report]
    started = time.monotonic()
    subprocess.run(list(map(str, command)), check=True)
    seconds = time.monotonic() - started
    found = json.loads(report.read_text())
    return *read_ply(mesh), seconds, found["peak_rss_bytes"] / 2**20


def read_ply(path):
    """Corners of the triangles of a PLY, and the two labels of each."""
    reader = path.read_bytes()
    head, _, body = reader.partition(b"end_header\n")
    lines = head.decode().splitlines()
    count = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    kinds = {"float": "<f4", "double": "<f8", "int": "<i4", "uint": "<u4", "int32": "<i4", "uint32": "<u4"}
    names = [line.split()[1:] for line in lines if line.startswith("property") and "list" not in line]
    place = [kinds[kind] for kind, name in names if name in "xyz"]
    vertices = np.frombuffer(body, np.dtype([(axis, kind) for axis, kind in zip("xyz", place)]), count["vertex"])
    facet = np.dtype([("n", "u1"), ("corners", "<u4", 3), ("low", "<u4"), ("high", "<u4")])
    facets = np.frombuffer(body, facet, count["face"], vertices.nbytes)
    corners = np.stack([vertices[axis] for axis in "xyz"], 1).astype(float)
    return corners[facets["corners"]], np.stack([facets["low"], facets["high"]], 1)


def surface_nets(labels, spacing):
    """The same of vtkSurfaceNets3D as it comes."""
    image = vtk.vtkImageData()
    image.SetDimensions(*labels.shape[::-1])
    image.SetSpacing(*spacing)
    image.GetPointData().SetScalars(numpy_to_vtk(labels.ravel(), deep=True))
    nets = vtk.vtkSurfaceNets3D()
    nets.SetInputData(image)
    nets.SetBackgroundLabel(0)
    for n, label in enumerate(np.unique(labels)):
        nets.SetValue(n, int(label))
    nets.SetOutputMeshTypeToTriangles()
    started = time.monotonic()
    nets.Update()
    seconds = time.monotonic() - started
    found = nets.GetOutput()
    places = vtk_to_numpy(found.GetPoints().GetData()).astype(float)
    corners = places[vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)]
    pairs = np.sort(vtk_to_numpy(found.GetCellData().GetArray("BoundaryLabels")).astype(int), 1)
    return corners, pairs, seconds, None


def measured(corners, normal_at, middle):
    """Area, volume, and how far facets are turned, in degrees: mean over the area and root of the mean square."""
    a, b, c = (corners[:, n] - middle for n in range(3))
    across = np.cross(b - a, c - a)
    twice = np.linalg.norm(across, axis=1)
    known = twice > 0
    cosine = np.abs((across[known] / twice[known, None] * normal_at(((a + b + c) / 3)[known])).sum(1))
    turned = np.degrees(np.arccos(np.clip(cosine, 0, 1)))
    weight = twice[known] / twice.sum()
    mean, square = (turned * weight).sum(), (turned**2 * weight).sum()
    return twice.sum() / 2, abs((a * np.cross(b, c)).sum() / 6), mean, square**0.5


def row_of_body(axes, spacing, name, found, middle):
    corners, pairs, _, _ = found
    own = corners[(pairs == (1, 2)).all(1)]

    def normal_at(places):
        away = places / np.array(axes, float) ** 2
        return away / np.linalg.norm(away, axis=1)[:, None]

    area, volume, mean, square = measured(own, normal_at, middle)
    true_volume = 4 / 3 * np.pi * np.prod(axes)
    shape = " x ".join(map(str, axes)) + (f", spacing {' x '.join(map(str, spacing))}" if set(spacing) != {1} else "")
    return [
        shape,
        name,
        f"{area / area_of(axes):.4f}",
        f"{100 * (volume / true_volume - 1):+.2f}",
        f"{mean:.1f}",
        f"{square:.1f}",
        f"{len(own):,}",
    ]


def row_of_cells(name, runs, middles):
    corners, pairs, _, memory = runs[0]
    inner = (pairs > 0).all(1)
    corners, pairs = corners[inner], pairs[inner]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(across, axis=1)
    low, high = (middles[pairs[:, n] - 1] for n in range(2))
    normal = (high - low) / np.linalg.norm(high - low, axis=1)[:, None]
    known = twice > 0
    cosine = np.abs((across[known] / twice[known, None] * normal[known]).sum(1))
    turned = np.degrees(np.arccos(np.clip(cosine, 0, 1)))
    off = np.abs(((corners.mean(1) - (low + high) / 2) * normal).sum(1))
    weight = twice / twice.sum()
    seconds = statistics.median(run[2] for run in runs)
    return [
        name,
        f"{seconds:.2f}",
        f"{memory:.0f}" if memory else None,
        f"{(turned * weight[known]).sum():.1f}",
        f"{(off * weight).sum():.3f}",
        f"{len(corners):,}",
    ]


def main():
    parser = argparse.ArgumentParser(prog="scripts/bench_walls", description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="how often cells are drawn, in turn (3)")
    settings = parser.parse_args()
    nets = f"vtkSurfaceNets3D {version('vtk')}"
    bodies, drawn = [], {"strandline": [], nets: []}
    with tempfile.TemporaryDirectory() as folder:
        for axes, spacing in BODIES:
            labels, middle = body(axes, spacing)
            bodies.append(row_of_body(axes, spacing, "strandline", ours(labels, spacing, Path(folder)), middle))
            bodies.append(row_of_body(axes, spacing, nets, surface_nets(labels, spacing), middle))
        labels, middles = cells()
        for _ in range(settings.rounds):
            drawn["strandline"].append(ours(labels, (1, 1, 1), Path(folder)))
            drawn[nets].append(surface_nets(labels, (1, 1, 1)))
    program = subprocess.run([os.environ["STRANDLINE"], "--version"], check=True, capture_output=True, text=True).stdout.split()[-1]
    text = (
        "## Walls between labels that touch\n\n"
        f"{page.circumstances(program)}\n\n"
        "Voxel ellipsoids in their surroundings, `strandline middle LABELS.tif`; middles lie off the voxels. Area beside the true one, volume off the\n"
        "true one in %, facets turned from the true normal in degrees, mean over the area and root of the mean square.\n\n"
        + page.table(["half axes", "", "area", "volume", "turned", "rms", "triangles"], bodies)
        + f"\n\n{CELLS} cells that touch, {EDGE}^3 voxels; the walls of such cells are planes. Seconds are those of the whole program (`-o none --mesh`), files read and\n"
        f"written, median of {settings.rounds} rounds in turn; of the other those of its filter, from memory to memory. Off is the mean distance from the plane, voxels.\n\n"
        + page.table(
            ["", "seconds", "MiB", "turned", "off", "triangles"],
            [row_of_cells(name, runs, middles) for name, runs in drawn.items()],
        )
    )
    page.write_part(page.ROOT / "docs" / "surfaces.md", "scripts/bench_walls", text)
    print(text)


if __name__ == "__main__":
    main()
