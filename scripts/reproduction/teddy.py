"""Tables 4 to 6: the teddy bear, as a point cloud and as triangles.

The paper's bear is not at hand. Ours is `teddy-cgal-bear.off` (13,826 vertices, 27,648 triangles) in the folder given
by --data: of the same class, more finely divided, in another pose. It is scaled into the paper's grids.
"""

from common import page, shapes
from common.grids import Grid
from common.program import METHODS

from . import paper, plain_counts
from .setting import DEFAULT, SWEEP, TIMES_EXPLAINED, Notes, rows_of_times

FILE = "teddy-cgal-bear.off"
ABSENT = f"Skipped: `{FILE}`, which is not part of the project, was not at hand."
PADDING = 0.05  # what is left at least between the bear and the grid's border


def find(data):
    """The bear's file in or under the folder `data`, or None."""
    return next((path for path in sorted(data.rglob(FILE))), None) if data else None


def fitted(positions):
    """The bear scaled into the paper's finest grid, centred; and the grids' origin."""
    extent = [(n - 1) * paper.TEDDY_SPACINGS[-1] for n in paper.TEDDY_SHAPES[-1]]
    low, high = positions.min(axis=0), positions.max(axis=0)
    scale = min((e - 2 * PADDING) / (h - lo) for e, lo, h in zip(extent, low, high))
    origin = tuple(float(scale * (lo + h) / 2 - e / 2) for e, lo, h in zip(extent, low, high))
    return scale * positions, origin


def section(setting):
    """Tables 4 and 5 as Markdown, or the line that says why they are missing."""
    bear = sources(setting)
    if bear is None:
        return f"## Tables 4 and 5: teddy bear\n\n{ABSENT}"
    grids, (positions, triangles), (cloud, mesh) = bear
    of_cloud, of_mesh = runs(setting, grids, cloud), runs(setting, grids, mesh)
    return "\n\n".join(
        [
            "## Tables 4 and 5: teddy bear\n\n"
            f"The paper's bear has some 9,550 vertices. Ours has {len(positions):,} and {len(triangles):,} triangles,\n"
            "stands otherwise, and is scaled into the same grids: fixed points are of the same size, not equal. On the finest grid a\n"
            "vertex fixes the eight corners of a cell of its own, as in the paper (76,384 / 8 = 9,548).\n\n"
            + TIMES_EXPLAINED,
            times("### Table 4: time to the point cloud", grids, of_cloud, paper.TEDDY_CLOUD),
            times("### Table 5: time to the triangles", grids, of_mesh, paper.TEDDY_MESH),
        ]
    )


def counted(setting):
    """Table 6 as Markdown: a part of its own, as it holds no seconds."""
    bear = sources(setting)
    if bear is None:
        return f"## Table 6: distances from a triangle to a point\n\n{ABSENT}"
    grids, (positions, triangles), (_, mesh) = bear
    found = {n: setting.run("fsm", [mesh], grid, DEFAULT) for n, grid in grids}
    return counts(grids, found, plain_counts.of_whole_runs(grids, positions, triangles))


def sources(setting):
    """Grids, the bear, and its files as a cloud and as a mesh; None when it is not at hand."""
    path = find(setting.data)
    if path is None:
        print(f"Tables 4 to 6 skipped: no {FILE} in the folder given by --data or STRANDLINE_DATA", flush=True)
        return None
    positions, triangles = shapes.read_off(path)
    positions, origin = fitted(positions)
    cloud, mesh = setting.scratch / "teddy-cloud.ply", setting.scratch / "teddy-mesh.ply"
    shapes.write_cloud(cloud, positions)
    shapes.write_mesh(mesh, positions, triangles)
    grids = setting.grids([Grid(s, h, origin) for s, h in zip(paper.TEDDY_SHAPES, paper.TEDDY_SPACINGS)])
    return grids, (positions, triangles), (cloud, mesh)


def runs(setting, grids, source):
    """runs[method][grid] = (sweep, default)."""
    return {
        method: {n: [setting.run(method, [source], grid, flags) for flags in (SWEEP, DEFAULT)] for n, grid in grids}
        for method in METHODS
    }


def times(title, grids, found, printed):
    notes = Notes()
    rows = [row for n, grid in grids for row in rows_of_times(found, n, grid, printed[n], notes)]
    header = ["grid points", "h", "", "fixed points", "initial condition", *(m.upper() for m in METHODS)]
    return f"{title}\n\n{page.table(header, rows)}\n\n{notes.markdown()}"


def counts(grids, found, whole):
    """Table 6: how often the distance from a triangle was computed."""
    rows = []
    for n, grid in grids:
        printed = paper.TEDDY_MESH[n].fixed
        counted = [paper.TRIANGLE_DISTANCES[method][n] for method in ("vdt", "dp")]
        rows.append([grid, f"{grid.spacing:.7g}", "paper", *shares(grid, printed, *counted), None, None])
        if n in whole:
            fixed, vdt, dp, mended = whole[n]
            rows.append([None, None, "plain", *shares(grid, fixed, vdt, dp), f"{mended / grid.voxels:.4f}", None])
        rows.append([None, None, "ours", *ours(grid, found[n])])
    header = ["grid points", "h", "", "fixed points", "of all", "VDT", "a point", "a point not fixed"]
    header += ["DP", "a point", "a point not fixed", "DP, mended: a point", "initial condition"]
    return (
        "## Table 6: distances from a triangle to a point\n\n"
        "How often the exact distance was computed in a whole run of VDT and of DP. `plain` are Alg. 3, 5 and 6 as printed, on our\n"
        "bear (`plain.py`), on grids of up to 2 million points; loops that slow would take minutes on finer ones. `ours`: fixed points are the\n"
        "program's, which are those of `plain`; it counts the distances of the initial condition alone, one for each grid point and each\n"
        "triangle that cuts a cell beside it, with every method and schedule. `mended`: DP asks fixed neighbours too, as it must to be exact.\n\n"
        + page.table(header, rows)
        + "\n\nDP as printed computes one distance for each pair of neighbours of which the one that leaves the heap first is not fixed:\n"
        "three a point on a fine grid.\n"
    )


def shares(grid, fixed, vdt, dp):
    """Fixed points and counts, each beside the grid's points and those that are not fixed."""
    line = [fixed, f"{fixed / grid.voxels:.4f}"]
    for count in (vdt, dp):
        line += [count, f"{count / grid.voxels:.4f}", f"{count / (grid.voxels - fixed):.4f}"]
    return line


def ours(grid, run):
    """What a run reports, with every method alike; dashes where there is none."""
    if isinstance(run, str):
        return ["-", "-", *[None] * 7, "-"]
    fixed = run.result["fixed_voxels"]
    return [fixed, f"{fixed / grid.voxels:.4f}", *[None] * 7, run.result["triangle_distances"]]
