"""scripts/try_ranks: random jobs on several ranks, and whether their bits are those of one.

Each job is run once on one rank, then on each number of ranks as threads (`--ranks N`) and, where `mpirun` is there and the
program was built with the feature `mpi`, as processes (`mpirun -n N`). All files of the stores must be equal but reports, and of
these the result. Exit code 1 when anything differs, fails or hangs.
"""

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

METHODS = ("vdt", "vdt", "fsm", "fmm", "dp")
REPORTS = {"report.json", "report.html", "checksums.txt"}


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/try_ranks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--jobs", type=int, default=20, help="how many (20)")
    parser.add_argument("--seed", type=int, default=1, help="of the jobs (1)")
    parser.add_argument("--ranks", default="2,3,5,8", help="numbers of ranks (2,3,5,8)")
    parser.add_argument("--how", choices=["both", "threads", "mpi"], default="both", help="what ranks are (both)")
    parser.add_argument("--limit", type=float, default=120, metavar="SECONDS", help="end a run after this long (120)")
    parser.add_argument("--folder", type=Path, metavar="FOLDER", help="where jobs run (a temporary folder)")
    return parser.parse_args()


def cloud(rng, path):
    """Points on a ball, a plane with waves or anywhere, of any density."""
    count = int(10 ** rng.uniform(1, 4))
    points = rng.normal(size=(count, 3))
    kind = rng.integers(3)
    if kind == 0:
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    elif kind == 1:
        points[:, 2] = 0.2 * np.sin(3 * points[:, 0])
    np.savetxt(path, points * rng.uniform(0.3, 1.2) + rng.uniform(-1, 1, 3), fmt="%.9g")


def box(rng, path):
    """A closed box."""
    lo = rng.uniform(-1.5, 0.5, 3)
    hi = lo + rng.uniform(0.2, 1.5, 3)
    corners = [[(lo, hi)[n >> a & 1][a] for a in range(3)] for n in range(8)]
    faces = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in corners] + [f"f {' '.join(map(str, face))}" for face in faces]
    path.write_text("\n".join(lines) + "\n")


def job(pick, folder):
    """The arguments of a random distance or middle surface, whose inputs are made."""
    rng = np.random.default_rng(pick.getrandbits(32))
    sources = []
    for number in range(pick.randint(1, 4)):
        is_box = pick.random() < 0.3
        name = f"{number}.{'obj' if is_box else 'xyz'}"
        (box if is_box else cloud)(rng, folder / name)
        sources.append(name)
    closed = all(name.endswith("obj") for name in sources)
    shape = [pick.randint(1, 200) for _ in range(3)]
    while np.prod(shape) > 4e6:
        shape[pick.randrange(3)] //= 2
    spacing = [4 / max(shape) * pick.uniform(0.6, 1.5) for _ in range(3)]
    words = ["distance", *sources, "--shape", ",".join(map(str, shape)), "--spacing", ",".join(f"{h:.6g}" for h in spacing)]
    words += ["--origin=" + ",".join(f"{-n * h / 2:.6g}" for n, h in zip(shape, spacing))]
    words += ["--method", pick.choice(METHODS), "--schedule", pick.choice(["front", "front", "sweep"])]
    words += ["--brick", str(pick.choice([16, 32, 64])), "--precision", pick.choice(["f16", "f32", "f32", "f64"])]
    for flag, chance in (("--labels", 0.6), ("--closest-point", 0.4), ("--signed", 0.8 if closed else 0)):
        words += [flag] if pick.random() < chance else []
    limited = "front" in words and pick.random() < 0.25
    words += ["--max-distance", f"{pick.uniform(0.3, 2):.3g}"] if limited else []
    words += ["--ome", "0.4"] if pick.random() < 0.2 else []
    return as_middle(pick, words) if pick.random() < 0.4 else words


def as_middle(pick, words):
    """The same sources and grid for the surface between them."""
    kept = [word for word in words if word not in ("--labels", "--signed", "--closest-point")]
    kept[0] = "middle"
    if sum(word.endswith((".xyz", ".obj")) for word in kept) < 2:
        kept.insert(1, kept[1])
    return kept + ["--labels" , pick.choice(["exact", "tracked"])]


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


def launches(ranks, how, program):
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
    with tempfile.TemporaryDirectory(dir=given.folder, prefix="strandline-ranks-") as folder:
        for number in range(given.jobs):
            place = Path(folder) / str(number)
            place.mkdir()
            words = job(random.Random(f"{given.seed} {number}"), place)
            code, expected, result, said = run([program, *words], place, "one.zarr", given.limit)
            if code != 0:
                print(f"job {number} ended with {code} on one rank: {said[-200:]}\n  {' '.join(words)}", flush=True)
            for ranks in map(int, given.ranks.split(",")):
                for name, launch in launches(ranks, given.how, program):
                    started = time.monotonic()
                    again, found, told, said = run(launch(words), place, "many.zarr", given.limit)
                    faults = list(differences(expected, found)) + (["the result"] if told != result else [])
                    compared += 1
                    if (again == 0) != (code == 0) or faults:
                        wrong += 1
                        print(f"job {number} on {name}: exit {again}, {time.monotonic() - started:.1f} s; {faults[:5]}")
                        print(f"  strandline {' '.join(words)}\n  {said[-400:]}", flush=True)
            shutil.rmtree(place)
    print(f"{given.jobs} jobs, {compared} runs on several ranks, {wrong} not as on one")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
