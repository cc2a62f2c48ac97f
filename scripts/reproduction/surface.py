"""Reconstruction (Kósa 2015 and PhD, ch. 5.1): Sponge, a scan-like cloud, noise, and the Sponge image."""

import json
import subprocess

import numpy as np
import tifffile

from common import page, shapes

from . import paper, picture

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
    return "\n\n".join([sponge(setting), scan(setting), band(), noise(setting), image(setting)])


def run(setting, command, flags, *, store=None):
    """A run of the program: its report, or the sentence that says why there is none."""
    report = setting.scratch / "report.json"
    words = [
        setting.program.path,
        *command,
        "-o",
        str(store or "none"),
        "--report",
        str(report),
        "--overwrite",
        "-q",
        *flags,
    ]
    print(f"  {' '.join(map(str, [*command, *flags]))}", flush=True)
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    if done.returncode != 0:
        return (done.stderr.strip().splitlines() or ["failed"])[-1]
    return json.loads(report.read_text())


def figures(report, h):
    """Volume, MeanHD, MaxHD, points farther than a voxel."""
    if isinstance(report, str):
        return [report, "-", "-"]
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
        command = ["reconstruct", cloud]
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


def scan_cloud():
    """A body with bumps and dents as a scanner sees it: 42,970 points, as far apart as the Sealer's (0.4087 in the mean)."""
    rng = np.random.default_rng(7)
    every = 47_700
    n = np.arange(every)
    height, turn = 1 - (2 * n + 1) / every, np.pi * (3 - 5**0.5) * n
    ring = np.sqrt(1 - height**2)
    p = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    bumps = 1 + 0.08 * np.sin(5 * p[:, 0]) * np.cos(4 * p[:, 1] + 1) + 0.06 * np.sin(9 * p[:, 2] + 3 * p[:, 0])
    points = (p * bumps[:, None] * np.array([0.58, 1.0, 0.81]))[rng.random(every) > 0.1][:42_970]
    spacing = mean_spacing(points)
    return points * (0.408695 / spacing) + rng.normal(scale=0.005, size=points.shape)


def mean_spacing(points):
    """Mean distance to the nearest other point, by cells."""
    from scipy.spatial import cKDTree

    return cKDTree(points).query(points, k=2)[0][:, 1].mean()


def scan(setting):
    points = scan_cloud()
    cloud = setting.scratch / "scan.xyz"
    np.savetxt(cloud, points, fmt="%.7f")
    tables = []
    for method, printed, number in (("fsm", paper.SEALER_FSM, "5.1"), ("vdt", paper.SEALER_VDT, "5.2")):
        rows = []
        for h, (means, maxima) in printed.items():
            extent = int((points.max(axis=0) - points.min(axis=0)).max() / h)
            # A band holds far fewer voxels than a grid.
            if extent > 1.5 * setting.finest:
                continue
            ours = [
                run(setting, ["reconstruct", cloud], ["--spacing", h, "--delta", d, "--method", method])
                for d in paper.SEALER_DELTAS
            ]
            off = [None if isinstance(r, str) else r["result"]["hausdorff"] for r in ours]
            rows.append([h, "MeanHD, Sealer", *means])
            rows.append([None, "MeanHD, ours", *(f"{o['mean']:.5f}" if o else "-" for o in off)])
            rows.append([None, "MaxHD, Sealer", *maxima])
            rows.append([None, "MaxHD, ours", *(f"{o['max']:.4f}" if o else "-" for o in off)])
        header = ["h", "", *(f"delta = {d}" for d in paper.SEALER_DELTAS)]
        tables.append(f"### As Table {number}: distance by {method.upper()}\n\n" + page.table(header, rows))
    return (
        "## A scan (Kósa PhD, Tables 5.1 and 5.2)\n\n"
        "The papers' Sealer is not public. Ours is a made body with 42,970 points that are as far apart (0.4087 in the mean),\n"
        "so the columns can be compared in how they fall with h and grow with delta, not digit by digit.\n\n"
        + "\n\n".join(tables)
    )


def band():
    """T15, Tables 1 and 2: the plain program in Rust on the whole grid and in its band, and this one."""
    print("  cargo bench --bench full_and_band", flush=True)
    command = [
        "cargo",
        "bench",
        "--quiet",
        "--locked",
        "--bench",
        "full_and_band",
        "--manifest-path",
        page.ROOT / "Cargo.toml",
    ]
    done = subprocess.run(
        [*map(str, command), "--", str(max(grid for grid, _ in paper.BANDS))], capture_output=True, text=True
    )
    ours = [line.strip("| ").split(" | ") for line in done.stdout.splitlines() if line.startswith("| ")]
    rows = []
    for grid, printed in paper.BANDS:
        rows.append([f"{grid}^3", "bracelet", *printed[0], None])
        rows.append([None, "sealer", *printed[1], None])
        rows += [[None, "plain, here", *line[1:]] for line in ours if line[0] == f"{grid}^3"]
    header = [
        "grid",
        "cloud",
        "points in band",
        "seconds, all points",
        "band",
        "mean squared difference",
        "this program",
    ]
    return (
        "## The band (Kósa 2015, Tables 1 and 2)\n\n"
        "The papers' program solves u on all points of the grid, or in a band of twice beta. `plain, here` is a program written\n"
        "from the paper (f64, one thread) on a made body like the one above; the last column is this program's whole run, on\n"
        "two threads, surface and measures included.\n\n" + page.table(header, rows)
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
        report = run(setting, ["reconstruct", path], ["--spacing", spacing, "--mesh", mesh])
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


def image(setting):
    """Kósa PhD, Fig. 2.3: the Sponge as an image of 255 inside and 0 outside, from a ball, without points."""
    h, half = 0.05, 1.5
    n = int(2 * half / h) + 1
    axis = np.linspace(-half, half, n)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    s2 = np.clip(z, -1, 1) ** 2
    ring = 0.207 + 2.003 * s2 - 1.123 * s2**2
    inside = (np.abs(z) < 1) & ((x / ring) ** 2 + y**2 < 1 - s2)
    path = setting.scratch / "sponge.tif"
    tifffile.imwrite(path, (255 * inside).astype(np.uint8), imagej=True, metadata={"axes": "ZYX"})
    middle = half
    flags = [
        "--seed",
        f"{middle},{middle},{middle},1.35",
        "--image-spacing",
        f"{h},{h},{h}",
        "--edge",
        "plain",
        "--smoothing",
        "heat",
        "--rho",
        1,
    ]
    flags += [
        "--delta",
        0.025,
        "--k",
        10,
        "--sigma",
        h,
        "--tau",
        h / 4,
        "--epsilon",
        0.01,
        "--max-steps",
        4000,
        "--tol",
        0.001,
    ]
    mesh = setting.scratch / "image.ply"
    report = run(setting, ["segment", path], [*flags, "--mesh", mesh])
    if isinstance(report, str):
        text = f"No result: {report}."
    else:
        result = report["result"]
        voxels = int(inside.sum())
        picture.draw(mesh, page.ROOT / "docs" / "pictures" / "sponge-image.png")
        text = (
            f"Volume {result['volume']:.3f} where the image's inside has {voxels * h**3:.3f}; {result['components']} piece, "
            f"{result['time_steps']} steps.\n\n![from the image](pictures/sponge-image.png)"
        )
    return (
        "## The Sponge as an image, without points (Kósa PhD, Fig. 2.3)\n\n"
        "`segment sponge.tif --seed ... --edge plain`: v = -grad g, not normalised, delta = 0.025, K = 10 for grey values on\n"
        "[0, 1] (the thesis gives 255 inside and 0 outside, and no range for K; on 0..255 g would be all but 0 on the whole border); the start is\n"
        f"a ball around the Sponge. {text}"
    )
