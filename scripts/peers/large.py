"""Out of core: Sponge & Sphere on grids larger than the memory, against all memory and the exact distance."""

import shutil

import numpy as np
import zarr

from common import page, shapes
from common.grids import Grid
from common.program import RunFailed

SHAPES = {"large": (1024, 1024, 1024), "huge": (2048, 2048, 1024)}
MEMORY = {"large": "1GiB", "huge": "2GiB"}
HEADER = [
    "grid",
    "method",
    "--memory",
    "seconds",
    "ns/voxel",
    "peak MiB, whole run",
    "loads per brick",
    "bits",
    "excess share",
    "largest excess / h",
]
EXPLAINED = """Sources: the 462 points of Sponge & Sphere. Seconds are those of the field, as above; the peak is that of
the whole run, in which the field is also written. A load is a brick that was not resident. Bits: whether all values
equal those of the run with all memory. Excess: the share of a million random voxels that lie more than rounding above
the exact distance to the nearest point, and the most that one does. FSM and FMM solve the Eikonal equation: their
excess, everywhere, is the error of a first order scheme."""


def measure(program, size, methods, scratch):
    """Rows of one size: each method with little memory and, where the machine could hold it, with all."""
    clouds = [shapes.sponge(), shapes.sphere(-2.0, 0.5)]
    grid = domain(np.concatenate(clouds), SHAPES[size])
    files = [scratch / "sponge.ply", scratch / "sphere.ply"]
    for path, points in zip(files, clouds):
        shapes.write_cloud(path, points)
    sample = voxels_and_distances(grid, np.unique(np.concatenate(clouds), axis=0))
    rows = []
    for method in methods:
        stores = {
            memory: scratch / f"{method}-{memory}.zarr"
            for memory in [MEMORY[size], *(["all"] if size == "large" else [])]
        }
        for memory, store in stores.items():
            rows.append(one(program, files, grid, method, memory, store, scratch, sample))
            print(f"  {rows[-1]}", flush=True)
        if len(stores) == 2 and all(store.exists() for store in stores.values()):
            rows[-2]["bits"] = "equal" if same(*stores.values()) else "different"
        for store in stores.values():
            shutil.rmtree(store, ignore_errors=True)
    return rows


def domain(points, shape):
    """The papers' margin, a sixth of the largest extent, along the longest axis; the points in the middle."""
    low, high = points.min(axis=0), points.max(axis=0)
    spacing = float((high - low).max()) * 4 / 3 / (max(shape) - 1)
    origin = tuple(float(c) for c in (low + high) / 2 - spacing * (np.array(shape) - 1) / 2)
    return Grid(shape, spacing, origin)


def one(program, files, grid, method, memory, store, scratch, sample):
    limit = [] if memory == "all" else ["--memory", memory]
    row = {"grid": str(grid), "method": method, "memory": memory}
    try:
        run = program.distance(
            files, [*grid.flags(), "--method", method, "--scratch", str(scratch), *limit], store=store
        )
    except RunFailed as error:
        return {**row, "failed": str(error)}
    values = {
        "seconds": run.seconds,
        "voxels": grid.voxels,
        "peak": run.report["peak_rss_bytes"],
        "loads": run.loads_per_brick,
    }
    return {**row, **values, **excess(store, grid, sample)}


def voxels_and_distances(grid, points, count=1_000_000):
    """Random voxels, in storage order, and the distance to the nearest point."""
    chosen = np.sort(np.random.default_rng(1).integers(0, grid.voxels, count))
    nx, ny, _ = grid.shape
    x, y, z = chosen % nx, chosen // nx % ny, chosen // (nx * ny)
    places = np.stack([grid.axis(0)[x], grid.axis(1)[y], grid.axis(2)[z]], axis=1)
    exact = np.full(count, np.inf)
    for point in points:
        np.minimum(exact, ((places - point) ** 2).sum(axis=1), out=exact)
    return chosen, np.sqrt(exact)


def excess(store, grid, sample):
    field = zarr.open_array(str(store), path="0", mode="r")
    chosen, exact = sample
    nx, ny, nz = grid.shape
    found = np.empty(len(chosen))
    layer = field.chunks[0]
    for z in range(0, nz, layer):
        start, end = np.searchsorted(chosen, [z * nx * ny, (z + layer) * nx * ny])
        local = chosen[start:end] - z * nx * ny
        found[start:end] = field[z : z + layer].reshape(-1)[local]
    over = found - exact
    far = over > 1e-6 * exact + 1e-7
    return {"excess_share": float(far.mean()), "excess": float(over.max() / grid.spacing)}


def same(a, b):
    """True when all values of two stores have the same bits."""
    first, second = (zarr.open_array(str(path), path="0", mode="r") for path in (a, b))
    layer = first.chunks[0]
    bits = np.dtype(f"u{first.dtype.itemsize}")
    pairs = (
        (first[z : z + layer].view(bits), second[z : z + layer].view(bits)) for z in range(0, first.shape[0], layer)
    )
    return all(np.array_equal(one, other) for one, other in pairs)


def table(rows):
    return page.table(HEADER, [line(row) for row in rows])


def line(row):
    head = [row["grid"], row["method"], row["memory"]]
    if "failed" in row:
        return [*head, row["failed"], *[None] * 6]
    speed = f"{row['seconds'] / row['voxels'] * 1e9:.2f}"
    peak, loads = f"{row['peak'] / 2**20:.0f}", f"{row['loads']:.2f}"
    share = f"{row['excess_share']:.1e}" if row["method"] in ("vdt", "dp") else None
    most = f"{row['excess']:.2g}"
    return [*head, f"{row['seconds']:.1f}", speed, peak, loads, row.get("bits"), share, most]
