"""scripts/model_scaling: how a distance with labels scales over ranks of MPI, measured on this machine, and a model of it.

The program is run over cubes on 1, 2, 4 and 8 ranks of one thread each. What runs on one rank and the messages of two tell goes into the
model (scripts/scaling/model.py); what it says of the others is held against them as far as there are cores. Then it is drawn up to 4096
ranks and 10^12 voxels for a cluster that is told by flags. Writes scaling.svg, and prints tables in Markdown.
"""

import argparse
import itertools
import json
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from .model import Machine, Measured, seconds, total

RANKS = (1, 2, 4, 8)


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/model_scaling", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--edges", default="256,384", help="voxels along the edges of the cubes (256,384)")
    parser.add_argument("--measured", type=Path, metavar="FILE", help="figures of an earlier run instead of measuring")
    parser.add_argument("--cores", type=int, default=16, help="of a rank of the cluster (16)")
    parser.add_argument("--ranks-per-node", type=int, default=2, help="ranks of a node (2)")
    parser.add_argument("--latency", type=float, default=2e-6, help="seconds of a message there (2e-6)")
    parser.add_argument("--bandwidth", type=float, default=6e9, help="bytes a second of a rank's messages (6e9)")
    parser.add_argument("--disk", type=float, default=5e10, help="bytes a second of the file system of all (5e10)")
    parser.add_argument("--folder", type=Path, help="where runs write (a temporary folder)")
    parser.add_argument("--picture", type=Path, default=Path("scaling.svg"), help="the picture (scaling.svg)")
    return parser.parse_args()


def run(program, folder, edge, ranks):
    """A run's report."""
    launch = []
    if ranks > 1:
        launch = ["mpirun", "--oversubscribe", "--bind-to", "none", "-n", str(ranks)]
        launch += ["--allow-run-as-root"] if os.geteuid() == 0 else []
    step = 4 / edge
    grid = ["--origin=-2,-2,-2", "--spacing", f"{step}", "--shape", f"{edge},{edge},{edge}"]
    words = ["distance", "cloud.xyz", *grid, "--labels", "--threads", "1", "--memory", "2GiB", "--checkpoint", "off"]
    subprocess.run(
        [*launch, program, *words, "-o", "out.zarr", "--overwrite", "--quiet"],
        cwd=folder,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return json.loads((folder / "out.zarr" / "report.json").read_text())


def figures(report):
    """What is taken from a report."""
    stages = {stage["name"]: stage for stage in report["stages"]}
    told = report.get("rank_reports") or []
    return {
        "solving": stages["distance"]["seconds"],
        "writing": stages["read out"]["seconds"],
        "visits": stages["distance"]["bricks"],
        "rounds": stages["distance"]["iterations"],
        "written": stages["read out"]["bytes_written"],
        "bricks_of_ranks": [rank["bricks"] for rank in told],
        "bytes_sent": [rank["bytes_sent"] for rank in told],
        "messages": [rank["messages"] for rank in told],
        "waiting": [rank["seconds_waiting"] for rank in told],
    }


def measure(given):
    program = os.environ["STRANDLINE"]
    found = {}
    with tempfile.TemporaryDirectory(dir=given.folder, prefix="strandline-scaling-") as folder:
        folder = Path(folder)
        points = np.random.default_rng(1).normal(size=(20_000, 3))
        np.savetxt(folder / "cloud.xyz", points / np.linalg.norm(points, axis=1, keepdims=True), fmt="%.9g")
        for edge in map(int, given.edges.split(",")):
            # What is first run reads the program and the cloud from the disk.
            run(program, folder, edge, 1)
            found[edge] = {ranks: figures(run(program, folder, edge, ranks)) for ranks in RANKS}
    return found


def calibrated(found):
    """The constants of the model, from the largest cube's runs on one and two ranks; how uneven slabs are, from all."""
    edge = max(found, key=int)
    one, two = (found[edge][ranks] for ranks in RANKS[:2])
    brick = 64
    voxels, bricks = int(edge) ** 3, -((-int(edge) // brick) ** 3)
    uneven = {1: 1.0}
    cores = len(os.sched_getaffinity(0))
    for ranks in RANKS[1:]:
        counts = found[edge][ranks]["bricks_of_ranks"]
        uneven[ranks] = max(counts) * len(counts) / sum(counts)
        if ranks <= cores:
            # Rounds in which one rank has more to do than others add up to more than what all of its bricks are.
            run_of = found[edge][ranks]
            took = ranks * (run_of["solving"] + run_of["writing"])
            uneven[ranks] = max(uneven[ranks], took / (took - sum(run_of["waiting"])))
    for fewer, more in itertools.pairwise(RANKS):
        uneven[more] = max(uneven[more], uneven[fewer])
    return Measured(
        brick_edge=brick,
        seconds_per_visit=one["solving"] / one["visits"],
        visits_per_brick=one["visits"] / bricks,
        seconds_per_voxel_written=one["writing"] / voxels,
        bytes_per_voxel_written=one["written"] / voxels,
        rounds_per_edge=one["rounds"] / (int(edge) / brick),
        messages_per_round=max(two["messages"]) / max(1, two["rounds"]),
        bytes_per_face_voxel=max(two["bytes_sent"]) / (2 * int(edge) ** 2),
        unevenness=uneven,
    )


def held_against(found, measured):
    """Measured and predicted seconds on this machine: with more ranks than cores these are shared."""
    cores = len(os.sched_getaffinity(0))
    print("| voxels | ranks | solving and writing, s | model, s | |\n| --- | --- | --- | --- | --- |")
    for edge, runs in found.items():
        for ranks, run in runs.items():
            here = Machine(cores=1, latency=2e-5, bandwidth=2e9, disk=1e12)
            said = total(measured, here, int(edge), int(ranks)) * max(1.0, int(ranks) / cores)
            took = run["solving"] + run["writing"]
            note = f"{said / took:.2f}" + ("" if int(ranks) <= cores else " (more ranks than cores)")
            print(f"| {edge}^3 | {ranks} | {took:.2f} | {said:.2f} | {note} |")


def draw(given, measured):
    """Strong scaling of three grids, weak scaling, and where it ends."""
    import matplotlib

    matplotlib.use("svg")
    from matplotlib import pyplot

    cluster = Machine(given.cores, given.latency, given.bandwidth, given.disk)
    ranks = [2**n for n in range(13)]
    figure, (strong, weak) = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    print("\n| voxels | ranks | seconds | efficiency | node hours |\n| --- | --- | --- | --- | --- |")
    for edge in (1024, 3000, 10_000):
        times = [total(measured, cluster, edge, n) for n in ranks]
        strong.loglog(ranks, times, marker=".", label=f"{edge}³ voxels")
        for n, took in zip(ranks, times):
            if n in (1, 16, 256, 4096):
                hours = max(1, n / given.ranks_per_node) * took / 3600
                print(f"| {edge}^3 | {n} | {took:.1f} | {times[0] / (n * took):.0%} | {hours:.2f} |")
        worth = [n for n, took in zip(ranks, times) if times[0] / (n * took) >= 0.5]
        print(f"| {edge}^3 | at most {max(worth)} | | half | |")
    edges = [int(1000 * n ** (1 / 3)) for n in ranks]
    weak.semilogx(ranks, [total(measured, cluster, edge, n) for edge, n in zip(edges, ranks)], marker=".")
    for axes, title in ((strong, "the same grid"), (weak, "10⁹ voxels a rank")):
        axes.set(title=title, xlabel="ranks", ylabel="seconds")
        axes.grid(alpha=0.3)
    strong.legend(frameon=False)
    weak.set_ylim(bottom=0)
    figure.savefig(given.picture)
    parts = seconds(measured, cluster, 10_000, 4096)
    print("\nOf 10^12 voxels on 4096 ranks: " + ", ".join(f"{name} {took:.1f} s" for name, took in parts.items()))


def main():
    given = arguments()
    found = json.loads(given.measured.read_text()) if given.measured else measure(given)
    found = {edge: {int(ranks): run for ranks, run in runs.items()} for edge, runs in found.items()}
    if not given.measured:
        print(json.dumps(found), "\n")
    measured = calibrated(found)
    print(measured, "\n")
    held_against(found, measured)
    draw(given, measured)


if __name__ == "__main__":
    main()
