"""The band (Kósa 2015, Tables 1 and 2): a plain program on the whole grid and in its band, and this one."""

import subprocess

from common import page

from . import paper


def table(setting):
    """Rows of the thesis, and below them the plain program's in Rust, and this one's."""
    lines = [line.strip("| ").split(" | ") for line in bench(setting).splitlines() if line.startswith("| ")]
    rows = []
    for grid, printed in paper.BANDS:
        rows.append([f"{grid}^3", "bracelet", *printed[0], None])
        rows.append([None, "sealer", *printed[1], None])
        rows += [[None, "plain, here", *line[1:]] for line in lines if line[0] == f"{grid}^3"]
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
        "from the paper (f64, one thread) on a made ellipsoid; the last column is this program's whole run, on two threads,\n"
        "surface and measures included. The paper's beta is the same length on all grids, so its band grows with the number of points; our cloud\n"
        "is as dense as the grid, and its body, 11 voxels from the border, takes more of the finer grids. The thesis ran both on a\n"
        "notebook with 4 GB.\n\n" + page.table(header, rows)
    )


def bench(setting):
    """What the bench prints: a line for each grid."""
    largest = str(max(grid for grid, _ in paper.BANDS))
    print(f"  cargo bench --bench full_and_band -- {largest}", flush=True)
    place = setting.place_of([], ["full_and_band", largest])
    if place and place.exists():
        return place.read_text()
    command = ["cargo", "bench", "--quiet", "--locked", "--bench", "full_and_band"]
    manifest = ["--manifest-path", str(page.ROOT / "Cargo.toml")]
    done = subprocess.run([*command, *manifest, "--", largest], capture_output=True, text=True)
    if place and done.returncode == 0:
        place.write_text(done.stdout)
    return done.stdout
