"""What checkpoints cost: a large distance with them and without, by turns."""

import shutil
import statistics
import subprocess
import time

from interrupting import runs


def timed(program, command, place):
    """Seconds of a run of its own."""
    store = place / "timed.zarr"
    started = time.monotonic()
    subprocess.run([program, *command, "-o", str(store), "-q"], check=True)
    seconds = time.monotonic() - started
    shutil.rmtree(store)
    return seconds


def tell(program, place, edge, pairs):
    """Prints the seconds of each pair of runs of `edge` voxels along each axis, and the ratio of their medians."""
    runs.sphere(place / "ball.xyz", 20_000, 1)
    grid = ["--origin=-2,-2,-2", "--spacing", str(4 / edge), "--shape", f"{edge},{edge},{edge}"]
    command = ["distance", str(place / "ball.xyz"), *grid, "--labels", "--memory", "4GiB"]
    found = [
        [timed(program, [*command, "--checkpoint", "off"], place), timed(program, command, place)] for _ in range(pairs)
    ]
    without, taken = (statistics.median(times) for times in zip(*found, strict=True))
    told = ", ".join(f"{off:.1f} {on:.1f}" for off, on in found)
    print(f"{edge}^3: without {without:.1f} s, with checkpoints {taken:.1f} s: {taken / without:.3f} ({told})")
