"""What a whole run counts (Table 6), by the plain programs."""

import numpy as np

from . import plain
from .plain_start import NEIGHBOURS_6, beside

# A million points take ten seconds.
MOST_VOXELS = 2_000_000


def of_whole_runs(grids, positions, triangles):
    """(VDT, DP as printed, DP that asks fixed neighbours too) for each grid, None where it is too fine; and fixed points."""
    corners = np.ascontiguousarray(positions[triangles])
    found = {}
    for n, grid in grids:
        if grid.voxels > MOST_VOXELS:
            continue
        print(f"  {grid}: plain", flush=True)
        start = beside(grid, [corners])
        counts = [
            plain.vdt(*start.copies(), NEIGHBOURS_6),
            *(plain.dp(*start.copies(), NEIGHBOURS_6, printed) for printed in (True, False)),
        ]
        found[n] = (int(start.fixed.sum()), *counts)
    return found
