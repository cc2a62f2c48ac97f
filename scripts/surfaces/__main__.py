"""scripts/bench_surfaces: this program's reconstruction and Open3D's Poisson, both against the true mesh of a scan."""

import argparse
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import open3d as o3d

from common import page

SAMPLES = 200_000


def ours(cloud, folder):
    """Mesh, seconds, and whether it is closed, by this program without a flag."""
    mesh, report = folder / "ours.ply", folder / "report.json"
    command = [os.environ["STRANDLINE"], "reconstruct", cloud, "-q", "-o", "none", "--mesh", mesh, "--report", report]
    started = time.monotonic()
    subprocess.run(list(map(str, command)), check=True)
    seconds = time.monotonic() - started
    return o3d.io.read_triangle_mesh(str(mesh)), seconds, json.loads(report.read_text())["grid"]["spacing_zyx"][0]


def poisson(points, depth):
    """Mesh and seconds by Open3D's screened Poisson; it needs normals, which it estimates and orients itself."""
    started = time.monotonic()
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(20))
    cloud.orient_normals_consistent_tangent_plane(20)
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=depth)
    return mesh, time.monotonic() - started


def distances(source, target):
    """Distances of points spread evenly over `source` from `target`."""
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(target))
    o3d.utility.random.seed(1)
    points = np.asarray(source.sample_points_uniformly(SAMPLES).points, dtype=np.float32)
    return scene.compute_distance(o3d.core.Tensor(points)).numpy().astype(float)


def row(name, mesh, seconds, truth, points, h):
    there, back = distances(mesh, truth), distances(truth, mesh)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    off = scene.compute_distance(o3d.core.Tensor(points.astype(np.float32))).numpy() / h
    pieces = len(np.asarray(mesh.cluster_connected_triangles()[1]))
    return [
        name,
        f"{seconds:.1f}",
        len(mesh.triangles),
        "yes" if not len(mesh.get_non_manifold_edges(allow_boundary_edges=False)) else "no",
        pieces,
        f"{off.mean():.3f}",
        f"{100 * (off <= 1).mean():.1f} %",
        f"{there.mean() / h:.3f}",
        f"{back.mean() / h:.3f}",
        f"{(there.mean() + back.mean()) / 2 / h:.3f}",
        f"{max(np.quantile(there, 0.99), np.quantile(back, 0.99)) / h:.2f}",
    ]


def main():
    parser = argparse.ArgumentParser(prog="scripts/bench_surfaces", description=__doc__)
    parser.add_argument(
        "--data",
        type=Path,
        required=True,
        help="folder with points/whale-cranium-vertices.xyz and meshes/pilot-whale-cranium.ply",
    )
    parser.add_argument("--depth", type=int, nargs="+", default=[8, 9], help="depths of Poisson's octree (8 9)")
    settings = parser.parse_args()
    cloud = settings.data / "points" / "whale-cranium-vertices.xyz"
    points = np.loadtxt(cloud)
    truth = o3d.io.read_triangle_mesh(str(settings.data / "meshes" / "pilot-whale-cranium.ply"))
    with tempfile.TemporaryDirectory() as folder:
        mesh, seconds, h = ours(cloud, Path(folder))
    rows = [row("strandline reconstruct", mesh, seconds, truth, points, h)]
    for depth in settings.depth:
        mesh, seconds = poisson(points, depth)
        rows.append(row(f"Open3D Poisson, depth {depth}, normals estimated", mesh, seconds, truth, points, h))
    header = [
        "program",
        "seconds",
        "triangles",
        "closed",
        "pieces",
        "points off, mean",
        "within h",
        "to the truth",
        "from the truth",
        "both, mean",
        "99 % within",
    ]
    version = subprocess.run([os.environ["STRANDLINE"], "--version"], capture_output=True, text=True).stdout.split()[-1]
    text = (
        "## Surfaces from points: a whale's skull\n\n"
        f"{page.circumstances(version)} Open3D {o3d.__version__}.\n\n"
        "The 50,000 vertices of a scan of a pilot whale's cranium (Smithsonian, CC0), thin bone and openings, and its mesh as the\n"
        f"truth. Lengths in h = {h:.4g}, half the mean spacing of the points, which is the default grid. Symmetric distances are of\n"
        f"{SAMPLES:,} points spread evenly over each surface. Seconds hold all of a run, reading and writing included for ours.\n\n"
        + page.table(header, rows)
    )
    page.write_part(page.ROOT / "docs" / "performance.md", "scripts/bench_surfaces", text)
    print(text)


if __name__ == "__main__":
    main()
