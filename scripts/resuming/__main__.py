"""scripts/try_resume: runs that are ended at random moments and gone on with.

Of each command runs are ended by SIGKILL (kill), by SIGTERM (term), by a disk that is full (disk, needs root), or by
SIGKILL with a bit of a checkpoint flipped or a file of it cut short afterwards (damage), once to three times, and gone on
with by --resume. The result must have the same bits as that of a run that nobody ended, with nothing left behind; after
damage a clear refusal will do. Exit code 1 when one had not.

A full disk has a random share of the room that a run takes which nobody ends, as one of them shows. With ../shared/data
there is one more command, embryo-like.

With --ranks all runs but the one that nobody ends are those of several ranks (mpirun; a build with the feature mpi), and gone on
with on another number of them: SIGKILL and a panic hit one rank, SIGTERM mpirun; all have to end within 10 seconds.
"""

import argparse
import os
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from interrupting import runs

from . import cost, on_ranks, trials

HOWS = ("kill", "term", "disk", "damage")


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/try_resume", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--times", type=int, default=10, help="trials of each command and each way (10)")
    parser.add_argument("--seed", type=int, default=1, help="of the moments (1)")
    parser.add_argument("--only", action="append", metavar="NAME", help="this command alone; repeatable")
    parser.add_argument("--how", action="append", choices=sorted({*HOWS, *on_ranks.HOWS}), help="this way alone; repeatable")
    parser.add_argument("--folder", type=Path, help="where inputs and outputs are made, a few GB [default: $TMPDIR]")
    parser.add_argument("--large", action="store_true", help="a distance of 512^3 voxels instead of 192^3")
    parser.add_argument("--ranks", action="store_true", help="runs on several ranks, by mpirun")
    parser.add_argument(
        "--cost", type=int, metavar="EDGE", help="no trial, but what checkpoints cost a distance of EDGE^3 voxels"
    )
    parser.add_argument("--pairs", type=int, default=3, help="pairs of runs that are timed for that (3)")
    parser.add_argument("--pause-while", type=Path, metavar="FILE", help="no trial begins while there is such a file")
    return parser.parse_args()


def commands(root, place, large):
    """The runs by name."""
    runs.sphere(place / "ball.xyz", 20_000, 1)
    runs.sphere(place / "few.xyz", 3_000, 2)
    shifted = [[float(word) for word in line.split()] for line in (place / "few.xyz").read_text().splitlines()]
    (place / "shifted.xyz").write_text("".join(f"{x / 2 + 1.2} {y / 2} {z / 2}\n" for x, y, z in shifted))
    edge = 512 if large else 192
    grid = ["--origin=-2,-2,-2", "--spacing", str(4 / edge), "--shape", f"{edge},{edge},{edge}"]
    pair = [f"{place}/few.xyz", f"{place}/shifted.xyz"]
    data = root / "data"
    output = ["-o", "out.zarr"]
    sweep = ["--method", "fsm", "--schedule", "sweep"]
    embryo = root.parent / "shared/data/embryo-like"
    like = {"embryo-like": ["segment", f"{embryo}/stack.tif", "--points", f"{embryo}/marks.csv", *output]}
    return {
        **(like if embryo.is_dir() else {}),
        "segment": ["segment", f"{data}/arabidopsis-embryo.tif", "--points", f"{data}/arabidopsis-marks.csv", *output],
        "distance": ["distance", f"{place}/ball.xyz", f"{place}/shifted.xyz", *grid, "--labels", *output],
        "fmm": ["distance", f"{place}/ball.xyz", *grid, "--method", "fmm", *output],
        "sweep": ["distance", f"{place}/ball.xyz", f"{place}/shifted.xyz", *grid, "--labels", *sweep, *output],
        "reconstruct": ["reconstruct", f"{place}/few.xyz", "--mesh", "mesh.ply", *output],
        "middle": ["middle", *pair, "--spacing", "0.02", "--mesh", "mesh.ply", *output],
    }


def wait_while(file):
    """Waits while there is such a file: somebody measures."""
    while file and file.exists():
        time.sleep(2)


def full(kind, program, arguments_, place, numbers, wanted, needed):
    """A run on a disk that is too small by a random share, gone on with when it has grown."""
    trial = kind(program, arguments_, place, 0.0, "disk", numbers)
    size = int(needed * numbers.uniform(0.05, 1.0)) + (1 << 20)
    shutil.rmtree(trial.folder)
    small = trials.full_disk(place, size)
    try:
        trial.folder = small / "run"
        trial.folder.mkdir()
        trial.scratch = small / "scratch"
        trial.scratch.mkdir()
        code = trial.once(False, 0.0, None)
        if code not in (0, 1, 2):
            trial.faults.append(f"a full disk ended it with {code}")
        if code != 0:
            trial.look_at_unfinished(wanted)
            trial.look_at_what_a_full_disk_is_told()
        trials.enlarge(small, 8 * needed + (1 << 30))
        if code != 0:
            code = trial.once(True, 0.0, None)
        if code != 0:
            trial.faults.append(f"the last run ended with {code}")
        else:
            trial.compare(wanted)
    finally:
        trials.unmount(small)
        small.rmdir()
    return trial


def main():
    settings = arguments()
    program = str(Path(os.environ["STRANDLINE"]).resolve())
    root = Path(os.environ["STRANDLINE_ROOT"])
    kind, hows = (on_ranks.RankTrial, on_ranks.HOWS) if settings.ranks else (trials.Trial, HOWS)
    bad = counted = 0
    with tempfile.TemporaryDirectory(prefix="strandline-resume-", dir=settings.folder) as folder:
        place = Path(folder)
        if settings.cost:
            cost.tell(program, place, settings.cost, settings.pairs)
            return
        for name, command in commands(root, place, settings.large).items():
            if settings.only and name not in settings.only:
                continue
            wait_while(settings.pause_while)
            seconds, wanted = trials.whole(program, command, place)
            for how in settings.how or hows:
                numbers = random.Random(f"{settings.seed} {name} {how}")
                needed = trials.needed(program, command, place) if how == "disk" else 0
                found = []
                for _ in range(settings.times):
                    wait_while(settings.pause_while)
                    if how == "disk":
                        trial = full(kind, program, command, place, numbers, wanted, needed)
                    else:
                        trial = kind(program, command, place, seconds, how, numbers).run(wanted)
                    found.append(trial)
                    for fault in trial.faults:
                        print(
                            f"  {name}, {how}, {'; '.join(trial.steps)}: {fault}; it said: {trial.said[-1][-300:]}",
                            flush=True,
                        )
                went_on = sum("goes on from the checkpoint" in " ".join(trial.said) for trial in found)
                told = Counter("refused" if trial.steps[-1].endswith(": 2") else "done" for trial in found)
                faults = sum(bool(trial.faults) for trial in found)
                print(
                    f"{name}, {how}: {seconds:.1f} s whole; {len(found)} trials, {went_on} went on from a checkpoint, "
                    f"{dict(told)}, {faults} at fault",
                    flush=True,
                )
                bad, counted = bad + faults, counted + len(found)
    print(f"{counted} trials, {bad} at fault")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
