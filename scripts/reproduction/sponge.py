"""Tables 7 and 8: fixed voxels of the Sponge & Sphere experiment, and the time of FSM and VDT."""

import numpy as np

from common import page, shapes
from common.grids import around

from . import paper
from .setting import DEFAULT, Notes, seconds


def section(setting):
    """Both tables as Markdown."""
    clouds = [shapes.sponge(), shapes.sphere(-2.0, 0.5)]
    files = [setting.scratch / "sponge.ply", setting.scratch / "sphere.ply"]
    for path, points in zip(files, clouds):
        shapes.write_cloud(path, points)
    grids = setting.grids([around(np.concatenate(clouds), h) for h in paper.SPONGE_SPACINGS])
    notes = Notes()
    tables = [
        one(setting, files, grids, notes, "fsm", "contiguous", paper.SPONGE_CONTIGUOUS, paper.SPONGE_FSM_SECONDS),
        one(setting, files, grids, notes, "vdt", "cell", paper.SPONGE_CELLS, paper.SPONGE_VDT_SECONDS),
    ]
    return (
        "## Tables 7 and 8: fixed voxels, Sponge & Sphere\n\n"
        "FSM from the contiguous start (Table 7), VDT from Alg. 1 (Table 8); each shape is 231 points. The paper's\n"
        "seconds are those of initial condition and original method together, ours those of the default settings.\n\n"
        + "\n\n".join(tables)
        + f"\n\n{notes.markdown()}"
    )


def one(setting, files, grids, notes, method, init, counts, times):
    rows, equal = [], 0
    for n, grid in grids:
        if grid.shape != paper.SPONGE_SHAPES[n]:
            notes.add(f"h = {grid.spacing:g}: the grid is {grid}, the paper's {paper.SPONGE_SHAPES[n]}.")
        run = setting.run(method, files, grid, ["--init", init, *DEFAULT])
        fixed = "-" if isinstance(run, str) else run.result["fixed_voxels"]
        equal += fixed == counts[n]
        time = seconds(run, notes, method)
        rows.append([grid, f"{grid.spacing:.7g}", counts[n], fixed, f"{sum(times[n]):.3f}", time])
    notes.add(f"`--init {init}`: {equal} of {len(grids)} counts are the paper's.")
    header = ["grid points", "h", f"fixed, {init}: paper", "ours", f"{method.upper()} seconds: paper", "ours"]
    return page.table(header, rows)
