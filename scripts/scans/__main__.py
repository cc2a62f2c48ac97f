"""scripts/bench_scans: reconstruction of clouds with noise and with holes, beside the bodies that they were taken of."""

import argparse
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from common import page
from scans import shapes

SAMPLES = 60_000
# Points of a surface that stand for it; a foot is looked for on the three triangles nearest to each.
DENSE = 400_000
HEADER = ["body", "noise", "hole", "seconds", "MiB", "off", "99 %", "turned", "Euler", "pieces", "triangles"]


def even_cloud(mesh, number, seed):
    """Points spread evenly: of many at random those that keep away from each other."""
    many = trimesh.sample.sample_surface(mesh, 6 * number, seed=seed)[0]
    apart = 0.75 * np.sqrt(mesh.area / number)
    for _ in range(20):
        kept = keep_apart(many, apart)
        if len(kept) >= number:
            break
        apart *= 0.96
    return many[kept[:number]]


def keep_apart(points, apart):
    """The points that are so far from those kept before them."""
    taken = np.zeros(len(points), bool)
    kept = []
    for n, near in enumerate(cKDTree(points).query_ball_point(points, apart)):
        if not taken[n]:
            kept.append(n)
            taken[near] = True
    return np.array(kept)


def with_hole(points, percent):
    """Without so many of the points around one of them."""
    middle = points[np.random.default_rng(3).integers(len(points))]
    order = np.argsort(np.linalg.norm(points - middle, axis=1))
    return points[order[round(percent / 100 * len(points)) :]]


def ours(points, folder):
    """Mesh and report of this program without a flag, and seconds; its sentence where it refuses."""
    cloud, mesh, report = (folder / name for name in ("cloud.xyz", "ours.ply", "report.json"))
    np.savetxt(cloud, points, fmt="%.7f")
    command = [os.environ["STRANDLINE"], "reconstruct", cloud, "-q", "-o", "none", "--overwrite"]
    command += ["--mesh", mesh, "--report", report]
    started = time.monotonic()
    ran = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    seconds = time.monotonic() - started
    if ran.returncode != 0:
        return None, ran.stderr.strip(), seconds
    return trimesh.load(mesh, process=False), json.loads(report.read_text()), seconds


def distances(source, target):
    """Distances of points spread evenly over one mesh from another, and the angles between their facets."""
    points, facets = trimesh.sample.sample_surface(source, SAMPLES, seed=1)
    dense, of = trimesh.sample.sample_surface(target, DENSE, seed=2)
    near = of[cKDTree(dense).query(points, k=3)[1]]
    corners = target.triangles[near.ravel()]
    feet = trimesh.triangles.closest_point(corners, np.repeat(points, 3, axis=0)).reshape(-1, 3, 3)
    away = np.linalg.norm(feet - points[:, None], axis=2)
    best = away.argmin(1)
    rows = np.arange(len(points))
    cosine = (source.face_normals[facets] * target.face_normals[near[rows, best]]).sum(1)
    return away[rows, best], np.degrees(np.arccos(np.clip(np.abs(cosine), 0, 1)))


def row(name, truth, cloud, noise, hole, folder):
    spacing = cKDTree(cloud).query(cloud, k=2)[0][:, 1].mean()
    points = with_hole(cloud, hole) if hole else cloud
    points = points + np.random.default_rng(1).normal(size=points.shape) * noise * spacing
    mesh, report, seconds = ours(points, folder)
    said = [name, f"{noise:g} s" if noise else None, f"{hole:g} %" if hole else None, f"{seconds:.1f}"]
    if mesh is None:
        return [*said, None, report, *[None] * 5]
    (there, turned), (back, _) = distances(mesh, truth), distances(truth, mesh)
    found = report["result"]
    euler, pieces = shapes.BODIES[name][1:]
    return [
        *said,
        f"{report['peak_rss_bytes'] / 2**20:.0f}",
        f"{(there.mean() + back.mean()) / 2 / spacing:.3f}",
        f"{max(np.quantile(there, 0.99), np.quantile(back, 0.99)) / spacing:.2f}",
        f"{turned.mean():.1f}",
        f"{mesh.euler_number} of {euler}",
        f"{found['components']} of {pieces}",
        f"{found['triangles']:,}",
    ]


def main():
    parser = argparse.ArgumentParser(prog="scripts/bench_scans", description=__doc__)
    parser.add_argument("--points", type=int, default=20_000, help="of each cloud (20000)")
    parser.add_argument("--noise", type=float, nargs="*", default=[0, 0.25, 0.5, 1], help="in spacings of the points")
    parser.add_argument("--hole", type=float, nargs="*", default=[1, 4, 10], help="percent of the points")
    parser.add_argument("--body", nargs="*", default=list(shapes.BODIES), choices=list(shapes.BODIES))
    settings = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in settings.body:
            truth = shapes.mesh_of(name)
            cloud = even_cloud(truth, settings.points, 7)
            for noise, hole in [(noise, 0) for noise in settings.noise] + [(0, hole) for hole in settings.hole]:
                rows.append(row(name, truth, cloud, noise, hole, Path(folder)))
                print("  ".join(map(str, rows[-1])), flush=True)
    version = subprocess.run([os.environ["STRANDLINE"], "--version"], capture_output=True, text=True).stdout.split()[-1]
    text = (
        "## Noise and holes\n\n"
        f"{page.circumstances(version)}\n\n"
        f"Bodies given by functions, {settings.points:,} points spread evenly over each, `strandline reconstruct` without a flag. Lengths are in s, the mean\n"
        "distance of a point of the clean cloud to the nearest other. Noise is normal, in all three directions; a hole is so many of the points, around one\n"
        "of them. Off is the mean distance between the surfaces, both ways; 99 % of both are within the next column; turned is the mean angle\n"
        "between a facet and the true one, degrees. A hole of 4 % or 10 % goes through whole arms, rings and bones of these bodies.\n\n"
        + page.table(HEADER, rows)
    )
    page.write_part(page.ROOT / "docs" / "surfaces.md", "scripts/bench_scans", text)


if __name__ == "__main__":
    main()
