"""scripts/try_limits: random jobs of all commands with random tight memory limits.

Each job gets a limit from a bit below what `--dry-run` says is the least to some more. It must be refused before it
starts to work, or finish without ever having more than that resident. Those that went over, died, hung or were refused
late are printed, as are those that were refused with far more than they take. Exit code 1 when one was over, died, hung or
was refused late.
"""

import argparse
import multiprocessing
import os
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from . import jobs, runs

MIB = runs.MIB
# What a run may come to.
GOOD = ("finished", "refused", "unusable")


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/try_limits", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--jobs", type=int, default=100, help="how many (100)")
    parser.add_argument("--seed", type=int, default=1, help="of the jobs (1)")
    parser.add_argument("--first", type=int, default=0, help="number of the first job (0)")
    parser.add_argument("--limit", type=float, default=180, metavar="SECONDS", help="end a run after this long (180)")
    parser.add_argument(
        "--needless", type=float, default=1, metavar="SHARE", help="of refused jobs, run with all memory too (1)"
    )
    parser.add_argument("--only", metavar="COMMAND", help="jobs of this command alone")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="leave the inputs of jobs that failed there")
    parser.add_argument("--folder", type=Path, help="where inputs and outputs are made, a GB [default: $TMPDIR]")
    return parser.parse_args()


def write_inputs(job, seed, folder):
    """Makes the inputs in a process of its own, whose memory does not count for the runs."""
    import numpy

    for number, make in enumerate(job.makes):
        make(folder, numpy.random.default_rng([*seed, number]))


def prepared(job, seed, folder):
    (folder / "scratch").mkdir(parents=True)
    made = multiprocessing.get_context("fork").Process(target=write_inputs, args=(job, seed, folder))
    made.start()
    made.join()
    if made.exitcode != 0:
        sys.exit(f"the inputs of job {seed} could not be made: {job.arguments}")


def limit_for(numbers, least):
    """Below what is the least, a little more, or some more."""
    factor = numbers.choice([numbers.uniform(0.85, 1), numbers.uniform(1, 1.1), numbers.uniform(1, 1.5)])
    return max(int(least * factor), MIB)


def try_job(program, job, numbers, folder, settings):
    """Runs a job with a limit; returns its limit, run, verdict, and for needless refusals what it takes with all memory."""
    seconds = settings.limit
    if not job.is_limited:
        done = runs.run(program, job.arguments, folder, seconds)
        return runs.UNLIMITED, done, runs.verdict(done, runs.UNLIMITED, 0), None
    common = [*job.arguments, "--scratch", "scratch"]
    least, asked = runs.least(program, common, folder, seconds)
    if least is None:
        return runs.UNLIMITED, asked, runs.verdict(asked, runs.UNLIMITED, 0), None
    limit = limit_for(numbers, least)
    done = runs.run(program, [*common, "-v", "--memory", str(limit)], folder, seconds)
    verdict = runs.verdict(done, limit, least)
    peak = None
    if verdict.startswith("refused") and numbers.random() < settings.needless:
        whole = runs.run(program, [*common, "--overwrite"], folder, seconds)
        peak = whole.peak if whole.code in (0, 3) and limit > runs.NEEDLESS * whole.peak else None
    return limit, done, verdict, peak


def show(number, job, limit, done, verdict):
    print(f"{verdict}: job {number}, limit {limit / MIB:.1f} MiB, peak {done.peak / MIB:.1f} MiB, exit {done.code}")
    print(f"  strandline {' '.join(job.arguments)} --memory {limit}")
    print(f"  {done.error[:300]}", flush=True)


def tell(found, needless):
    counts = Counter((command, verdict) for command, verdict, _ in found)
    for (command, verdict), count in sorted(counts.items()):
        shares = [share for c, v, share in found if (c, v) == (command, verdict)]
        print(f"  {command:12} {verdict:24} {count:4}  largest peak/limit {max(shares):.2f}")
    totals = Counter(verdict for _, verdict, _ in found)
    largest = max((share for _, verdict, share in found if verdict in ("finished", "over")), default=0)
    print(f"{len(found)} jobs: {', '.join(f'{count} {verdict}' for verdict, count in totals.most_common())}")
    print(f"largest peak of one that ran: {largest:.3f} of its limit; {needless} refused needlessly")


def main():
    settings = arguments()
    program = str(Path(os.environ["STRANDLINE"]).resolve())
    found, needless, started = [], 0, time.monotonic()
    with tempfile.TemporaryDirectory(prefix="strandline-limits-", dir=settings.folder) as place:
        for number in range(settings.first, settings.first + settings.jobs):
            numbers = random.Random(f"{settings.seed} {number}")
            job, folder = jobs.random_job(numbers), Path(place) / str(number)
            if settings.only and job.arguments[0] != settings.only:
                continue
            prepared(job, (settings.seed, number), folder)
            limit, done, verdict, peak = try_job(program, job, numbers, folder, settings)
            found.append((job.arguments[0], verdict, done.peak / limit))
            if verdict not in GOOD or verdict == "unusable":
                show(number, job, limit, done, verdict)
            if peak:
                needless += 1
                print(f"needless: the next takes {peak / MIB:.1f} MiB when it has all memory", flush=True)
                show(number, job, limit, done, verdict)
            if settings.keep and verdict not in GOOD:
                shutil.copytree(folder, settings.keep / str(number), dirs_exist_ok=True)
            shutil.rmtree(folder)
    tell(found, needless)
    print(f"{time.monotonic() - started:.0f} s")
    sys.exit(any(verdict not in GOOD for _, verdict, _ in found))


if __name__ == "__main__":
    main()
