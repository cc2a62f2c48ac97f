"""scripts/try_ranks: random jobs on several ranks, and whether their bits are those of one.

Each job is run once on one rank, then on each number of ranks as threads (`--ranks N`) and, where `mpirun` is there and the
program was built with the feature `mpi`, as processes (`mpirun -n N`), or as processes in two network namespaces (`--how namespaces`,
as root), which talk as two machines do. All files of the stores must be equal but reports, and of
these the result. Exit code 1 when anything differs, fails or hangs.
"""

import argparse
import contextlib
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from . import distances, namespaces, reconstructions, segments

REPORTS = {"report.json", "report.html", "checksums.txt"}
KINDS = {"distance": distances.job, "segment": segments.job, "reconstruct": reconstructions.job}


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/try_ranks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--jobs", type=int, default=20, help="how many (20)")
    parser.add_argument("--seed", type=int, default=1, help="of the jobs (1)")
    parser.add_argument("--ranks", default="2,3,5,8", help="numbers of ranks (2,3,5,8)")
    parser.add_argument("--how", choices=["both", "threads", "mpi", "namespaces"], default="both", help="what ranks are: threads and mpi (both)")
    parser.add_argument("--only", choices=sorted(KINDS), help="jobs of one kind alone")
    parser.add_argument("--limit", type=float, default=120, metavar="SECONDS", help="end a run after this long (120)")
    parser.add_argument("--folder", type=Path, metavar="FOLDER", help="where jobs run (a temporary folder)")
    return parser.parse_args()


def files(store):
    return {
        str(path.relative_to(store)): path.read_bytes()
        for path in sorted(store.rglob("*"))
        if path.is_file() and path.name not in REPORTS
    }


def run(words, folder, name, limit):
    """Runs a job into a store; its exit code, files and result, and what it said."""
    out = folder / name
    shutil.rmtree(out, ignore_errors=True)
    # Said last, so that it is the program's and not mpirun's.
    line = [*words, "-o", name, "--quiet", "--memory", "2GiB"]
    try:
        done = subprocess.run(line, cwd=folder, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return "hung", {}, None, ""
    found = files(out) if out.exists() else {}
    report = json.loads((out / "report.json").read_text()) if found else {}
    return done.returncode, found, report.get("result"), done.stderr.strip()


def differences(one, other):
    for name in sorted(one.keys() | other.keys()):
        if one.get(name) != other.get(name):
            yield f"{name}: {'missing' if name not in other else 'other bytes' if name in one else 'only there'}"


def launches(ranks, how, program, apart):
    if apart:
        yield f"{ranks} processes in two namespaces", lambda words: [*apart(ranks), program, *words, "--threads", "1"]
        return
    if how != "mpi":
        yield f"{ranks} threads", lambda words: [program, *words, "--ranks", str(ranks)]
    if how != "threads" and shutil.which("mpirun"):
        launch = ["mpirun", "--oversubscribe", "--bind-to", "none", "-n", str(ranks)]
        launch += ["--allow-run-as-root"] if os.geteuid() == 0 else []
        yield f"{ranks} processes", lambda words: [*launch, program, *words, "--threads", "1"]


def main():
    given = arguments()
    program = os.environ["STRANDLINE"]
    wrong = compared = 0
    if given.how == "namespaces" and not namespaces.can_be_made():
        sys.exit("namespaces need root, ip, unshare and mpirun")
    with contextlib.ExitStack() as held:
        folder = held.enter_context(tempfile.TemporaryDirectory(dir=given.folder, prefix="strandline-ranks-"))
        apart = held.enter_context(namespaces.joined(folder)) if given.how == "namespaces" else None
        for number in range(given.jobs):
            place = Path(folder) / str(number)
            place.mkdir()
            kind = given.only or ("distance", "segment", "distance", "reconstruct")[number % 4]
            words = KINDS[kind](random.Random(f"{given.seed} {number}"), place)
            code, expected, result, said = run([program, *words], place, "one.zarr", given.limit)
            if code not in (0, 3):
                print(f"job {number} ended with {code} on one rank: {said[-200:]}\n  {' '.join(words)}", flush=True)
            for ranks in map(int, given.ranks.split(",")):
                for name, launch in launches(ranks, given.how, program, apart):
                    started = time.monotonic()
                    again, found, told, said = run(launch(words), place, "many.zarr", given.limit)
                    faults = list(differences(expected, found)) + (["the result"] if told != result else [])
                    compared += 1
                    if again != code or faults:
                        wrong += 1
                        print(f"job {number} on {name}: exit {again}, {time.monotonic() - started:.1f} s; {faults[:5]}")
                        print(f"  strandline {' '.join(words)}\n  {said[-400:]}", flush=True)
            shutil.rmtree(place)
    print(f"{given.jobs} jobs, {compared} runs on several ranks, {wrong} not as on one")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
