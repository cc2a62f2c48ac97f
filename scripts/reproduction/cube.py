"""Tables 2 and 3: the Cube experiment, whose sources are grid points on the surface of the unit cube."""

import math
import shutil

import zarr

from common import page, shapes
from common.program import METHODS

from . import paper
from .setting import DEFAULT, SWEEP, TIMES_EXPLAINED, Notes, rows_of_times

# Figures that differ for a reason: (method, place of the grid).
PRINTED_FMM = "all finite neighbours in one quadratic, as Alg. 4 prints, give the paper's figure (part `printed` below)"
KNOWN = {("fmm", 1): PRINTED_FMM}


def table_2(setting):
    """Table 2 as Markdown."""
    grids, _, errors = everything(setting)
    return accuracy(grids, errors)


def table_3(setting):
    """Table 3 as Markdown: a part of its own, which hangs on how busy the machine is."""
    grids, runs, _ = everything(setting)
    return times(grids, runs)


def everything(setting):
    """Grids; runs and errors, each [method][grid] = (sweep, default)."""
    grids = setting.grids([shapes.cube_grid(n) for n in paper.CUBE_SIZES])
    runs = {method: {} for method in METHODS}
    errors = {method: {} for method in METHODS}
    for index, grid in grids:
        cloud = setting.scratch / "cube.ply"
        shapes.write_cloud(cloud, shapes.masked_points(grid, shapes.cube_mask(grid)))
        for method in METHODS:
            found = [measured(setting, method, cloud, grid, flags) for flags in (SWEEP, DEFAULT)]
            runs[method][index] = [run for run, _ in found]
            errors[method][index] = [error for _, error in found]
    return grids, runs, errors


def measured(setting, method, cloud, grid, flags):
    """A run and its mean squared error (None when it failed)."""
    store = setting.scratch / "cube.zarr"

    def error():
        found = mean_squared_error(store, grid)
        shutil.rmtree(store)
        return found

    return setting.run(method, [cloud], grid, ["--init", "grid", *flags], store=store, measure=error)


def mean_squared_error(store, grid):
    """Equation (10), in f64, a layer of chunks at a time."""
    field = zarr.open_array(str(store), path="0", mode="r")
    layer = field.chunks[0]
    total = 0.0
    for z in range(0, field.shape[0], layer):
        end = min(z + layer, field.shape[0])
        difference = field[z:end].astype(float) - shapes.cube_distance(grid, z, end)
        total += float((difference * difference).sum())
    return total / grid.voxels


def truncated(error):
    """As the paper prints: five digits, the others cut off."""
    digits, exponent = f"{error:.16e}".split("e")
    return f"{digits[:6]}e{exponent}"


def accuracy(grids, errors):
    """Table 2, the orders of convergence, and what differs."""
    notes = Notes()
    rows = []
    for index, grid in grids:
        paper_row = [paper.CUBE_MSE[method][index] for method in METHODS]
        rows.append([grid, f"{grid.spacing:.7g}", "paper", *paper_row])
        for which, name in enumerate(("sweep", "default")):
            rows.append([None, None, name, *(cell(errors[method][index][which]) for method in METHODS)])
    header = ["grid points", "h", "", *(m.upper() for m in METHODS)]
    compare(grids, errors, notes)
    for method, found in errors.items():
        absent = [
            f"{name} on {grid}"
            for index, grid in grids
            for name, error in zip(("sweep", "default"), found[index])
            if error is None
        ]
        if absent:
            notes.add(f"{method.upper()}, not run (it would have taken too long): {', '.join(absent)}.")
    eoc = page.table(["grids", *(f"{m.upper()}, sweep" for m in ("fsm", "fmm"))], orders(grids, errors))
    return (
        "## Table 2: mean squared error, Cube experiment\n\n"
        "`sweep` is f64, `default` is f32. VDT and DP give the exact distance: what is left is rounding.\n\n"
        f"{page.table(header, rows)}\n\n{notes.markdown()}\n"
        "Order of convergence of the root of the mean squared error, from one grid to the next:\n\n" + eoc
    )


def cell(error):
    return "-" if error is None else truncated(error)


def orders(grids, errors):
    for (coarse, a), (fine, b) in zip(grids, grids[1:]):
        line = []
        for method in ("fsm", "fmm"):
            before, after = errors[method][coarse][0], errors[method][fine][0]
            line.append(None if before is None or after is None else f"{0.5 * math.log2(before / after):.3f}")
        yield [f"{a} to {b}", *line]


def compare(grids, errors, notes):
    """Says for each method whether all digits are the paper's, and names those that are not."""
    for method in METHODS:
        ours = {index: errors[method][index][0] for index, _ in grids if errors[method][index][0] is not None}
        if not ours:
            notes.add(f"{method.upper()}: not in this version.")
        elif method in ("vdt", "dp"):
            notes.add(f"{method.upper()}: at most {max(ours.values()):.1e} in f64.")
        else:
            compare_digits(method, grids, ours, notes)


def compare_digits(method, grids, ours, notes):
    done = [(index, grid) for index, grid in grids if index in ours]
    other = [(index, grid) for index, grid in done if truncated(ours[index]) != paper.CUBE_MSE[method][index]]
    notes.add(f"{method.upper()}, sweep: {len(done) - len(other)} of {len(done)} figures agree in all five digits.")
    for index, grid in other:
        reason = KNOWN.get((method, index), "no reason known")
        printed, found = paper.CUBE_MSE[method][index], truncated(ours[index])
        notes.add(f"{method.upper()} at {grid}: {printed} in the paper, {found} here; {reason}.")


def times(grids, runs):
    notes = Notes()
    rows = [row for n, grid in grids for row in rows_of_times(runs, n, grid, paper.CUBE_SECONDS[n], notes)]
    header = ["grid points", "h", "", "initial condition", *(m.upper() for m in METHODS)]
    return f"## Table 3: time, Cube experiment\n\n{TIMES_EXPLAINED}\n\n{page.table(header, rows)}\n\n{notes.markdown()}"
