"""scripts/try_signals: runs of each command, ended by SIGINT or SIGTERM at random moments.

Each run is given a folder and, of the time that it takes when it is left alone, a random moment. Every fourth is sent the
signal twice. It must end within two seconds of the signal with the code of the signal, or be done, and
leave nothing half-written. Exit code 1 when one did not.
"""

import argparse
import os
import random
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

from . import runs


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/try_signals", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--times", type=int, default=40, help="runs of each command (40)")
    parser.add_argument("--seed", type=int, default=1, help="of the moments (1)")
    parser.add_argument("--only", action="append", metavar="NAME", help="this command alone; repeatable")
    parser.add_argument("--folder", type=Path, help="where inputs and outputs are made, a few GB [default: $TMPDIR]")
    return parser.parse_args()


def try_command(program, name, command, place, settings):
    """Ends runs of a command; prints and returns what was found."""
    seconds = runs.whole(program, command, place / "whole")
    shutil.rmtree(place / "whole")
    numbers = random.Random(f"{settings.seed} {name}")
    found = []
    for turn in range(settings.times):
        # The first moments, when signals are not listened to yet or inputs are read, deserve as many.
        moment = numbers.uniform(0, 0.15 if turn % 5 == 0 else seconds)
        sent, twice = ("SIGINT", "SIGTERM")[turn % 2], turn % 4 == 3
        run = runs.ended(program, name, command, place / "run", moment, sent, twice)
        shutil.rmtree(place / "run")
        for fault in run.faults:
            print(f"  {name}, {run.sent} after {moment:.3f} s: {fault}; it said: {run.said[-200:]}", flush=True)
        found.append(run)
    codes = ", ".join(f"{count} with {code}" for code, count in sorted(Counter(run.code for run in found).items()))
    slowest = max(run.after for run in found)
    print(f"{name}: {seconds:.1f} s whole; ended {codes}; at most {slowest:.2f} s after the signal", flush=True)
    return found


def main():
    settings = arguments()
    program = str(Path(os.environ["STRANDLINE"]).resolve())
    root = Path(os.environ["STRANDLINE_ROOT"])
    with tempfile.TemporaryDirectory(prefix="strandline-signals-", dir=settings.folder) as folder:
        place = Path(folder)
        commands = runs.commands(root, place)
        unknown = set(settings.only or ()) - set(commands)
        if unknown:
            sys.exit(f"there is no {', '.join(sorted(unknown))}; give one of {', '.join(commands)}")
        found = []
        for name, command in commands.items():
            if not settings.only or name in settings.only:
                found += try_command(program, name, command, place, settings)
    bad = [run for run in found if run.faults]
    print(f"{len(found)} runs, {len(bad)} of them late, with a wrong code or with something left behind")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
