"""Reconstruction (Kósa 2015 and PhD, ch. 5.1): Sponge, clouds like the Sealer, the band, noise, and the Sponge image."""

import json
import subprocess

import numpy as np

from common import page, shapes

from . import band, image, picture, sealer
from .clouds import scan_cloud
from .setting import run

DELTAS = (0.0, 0.025, 0.05, 0.1, 0.15)
PAPERS = (
    "--stop",
    "l2",
    "--tol",
    "1e-4",
    "--epsilon",
    "0.01",
    "--max-steps",
    "1000",
    "--beta",
    "0.25",
    "--method",
    "fsm",
)


def section(setting):
    """All tables as Markdown."""
    return "\n\n".join(
        [sponge(setting), sealer.tables(setting), band.table(setting), noise(setting), image.sponge(setting)]
    )


def figures(report, h):
    """Volume, MeanHD, MaxHD, points farther than a voxel."""
    if isinstance(report, str):
        return ["vanished" if "vanished" in report else "no surface", "-", "-"]
    result = report["result"]
    if not result["hausdorff"]:
        return ["vanished", "-", "-"]
    return [f"{result['volume']:.4g}", f"{result['hausdorff']['mean']:.5f}", f"{result['hausdorff']['max']:.4f}"]


def sponge(setting):
    points = np.unique(np.round(shapes.sponge(), 12), axis=0)
    cloud = setting.scratch / "sponge-places.xyz"
    np.savetxt(cloud, points, fmt="%.12f")
    h, rows = 0.05, []
    for delta in DELTAS:
        command = ["reconstruct", cloud, "--vertices", "level-set"]
        common = ["--spacing", h, "--delta", delta]
        mesh = setting.scratch / f"sponge-{delta}.ply"
        ours = run(setting, command, [*common, "--mesh", mesh])
        printed = run(setting, command, [*common, *PAPERS, "--tau", h / 4])
        rows.append([delta, *figures(printed, h), *figures(ours, h)])
        if not isinstance(ours, str):
            picture.draw(mesh, page.ROOT / "docs" / "pictures" / f"sponge-delta-{delta:g}.png")
    header = ["delta", "papers' rule: volume", "MeanHD", "MaxHD", "default rule: volume", "MeanHD", "MaxHD"]
    pictures = " ".join(f"![delta {d:g}](pictures/sponge-delta-{d:g}.png)" for d in DELTAS)
    return (
        "## The Sponge and curvature (Kósa PhD, Fig. 2.2)\n\n"
        "182 places of the Sponge, h = 0.05. The papers' rule: FSM, beta 0.25, tau = h/4, until a step's L2 norm falls under\n"
        "1e-4; the default rule starts between the points and ends when the surface rests. Under the papers' rule a strong\n"
        "curvature can make the surface vanish. The solid of the formula has the volume 2.14193.\n\n"
        + page.table(header, rows)
        + f"\n\nWith the default rule:\n\n{pictures}"
    )


def noise(setting):
    """T15, Fig. 13, 14: the coordinates of 100 random points changed; and a tenth of the points removed."""
    rng = np.random.default_rng(3)
    points = scan_cloud()
    low, high = points.min(axis=0), points.max(axis=0)
    fewer = points[rng.random(len(points)) > 0.1]
    moved = fewer.copy()
    which = rng.choice(len(moved), 100, replace=False)
    moved[which] = rng.uniform(low, high, size=(100, 3))
    spacing, rows, first = 0.2, [], None
    kept = setting.scratch / "kept.xyz"
    np.savetxt(kept, np.delete(fewer, which, axis=0), fmt="%.7f")
    for name, cloud in (("all points", points), ("a tenth removed", fewer), ("and 100 moved", moved)):
        path, mesh = setting.scratch / "noise.xyz", setting.scratch / f"noise-{len(rows)}.ply"
        np.savetxt(path, cloud, fmt="%.7f")
        report = run(setting, ["reconstruct", path, "--vertices", "level-set"], ["--spacing", spacing, "--mesh", mesh])
        told = subprocess.run(
            [setting.program.path, "measure", mesh, "--points", kept, "--json"], capture_output=True, text=True
        )
        measured = json.loads(told.stdout)
        first = first or measured
        rows.append(
            [
                name,
                len(cloud),
                f"{measured['volume']:.2f}",
                measured["components"],
                f"{measured['hausdorff']['mean'] / spacing:.4f}",
                f"{measured['hausdorff']['max'] / spacing:.3f}",
                "-" if isinstance(report, str) else report["result"]["lost_points"],
            ]
        )
    header = ["cloud", "points", "volume", "pieces", "MeanHD / h", "MaxHD / h", "points lost"]
    return (
        "## Noise and missing points (Kósa 2015, Fig. 13 and 14)\n\n"
        "The same scan, h = 0.2. Distances are those of the points that all three clouds share; lost are points farther than a\n"
        "voxel from the surface, which the moved ones should be.\n\n" + page.table(header, rows)
    )
