"""scripts/try_batch: 40 items, 34 of them whole, through `strandline batch`.

Five are broken in different ways and one needs more memory than is allowed: the others must have results, the exit
code is 3, and each failure has its reason. Then the same again (nothing is computed, in less than two seconds), with
one setting changed (that item alone), killed in the middle and run again (only what is left), each with what it took;
and two shards at once, whose summaries joined must be that of one run.
The memory of all processes together is sampled while the first run goes on. The time is told against the sum of the
items' times alone with one thread, shared among the threads. Exit code 1 when something is not as it must be; times
are told, and counted only with --strict: on a machine that others use two processes get less of it than one does.
Seconds of processors, which hardly depend on that, are told beside them.
"""

import argparse
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from . import inputs

MIB = 1 << 20
# Broken ones, and the one that is too large.
BROKEN = ("b03", "b08", "b13", "b21", "b27")
LARGE = "large"


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/try_batch", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--memory", type=int, default=600, metavar="MIB", help="of all items together (600)")
    parser.add_argument("--threads", type=int, default=2, help="of all items together (2)")
    parser.add_argument("--strict", action="store_true", help="times that are too long are failures too")
    parser.add_argument("--folder", type=Path, help="where inputs and outputs are made, a GB [default: $TMPDIR]")
    return parser.parse_args()


def resident(process):
    """Bytes that a process and its children have resident, and the children's lines of command."""
    total = 0
    tasks = Path(f"/proc/{process}/task")
    try:
        children = {int(n) for task in tasks.iterdir() for n in (task / "children").read_text().split()}
    except OSError:
        children = set()
    for one in [process, *children]:
        try:
            told = Path(f"/proc/{one}/status").read_text()
        except OSError:
            continue
        found = re.search(r"VmRSS:\s+(\d+)", told)
        total += int(found[1]) * 1024 if found else 0
    return total


class Batch:
    """The program on a list."""

    def __init__(self, program, place, settings):
        self.command = [
            program, "batch", "jobs.toml", "-o", "out", "--log", "json",
            "--memory", f"{settings.memory}MiB", "--threads", str(settings.threads),
        ]  # fmt: skip
        self.place = place

    def run(self, *more, kill_after=None):
        """Runs it; returns exit code, events, seconds, and the most memory; killed when so many items have ended."""
        began, peak, events = time.monotonic(), 0, []
        child = subprocess.Popen(
            [*self.command, *more], cwd=self.place, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )

        def watch():
            nonlocal peak
            while child.poll() is None:
                peak = max(peak, resident(child.pid))
                time.sleep(0.02)

        watcher = threading.Thread(target=watch)
        watcher.start()
        for line in child.stderr:
            if line.startswith("{"):
                events.append(json.loads(line))
            done = [event for event in events if event["event"] == "item" and event["state"] == "done"]
            if kill_after and len(done) >= kill_after:
                child.send_signal(signal.SIGKILL)
                kill_after = None
        code = child.wait()
        watcher.join()
        return code, events, time.monotonic() - began, peak

    def rows(self):
        return json.loads((self.place / "out/summary.json").read_text())["rows"]

    def states(self):
        return {row["item"]: row for row in self.rows()}

    def figures(self):
        """All that is told but times and memory."""
        varying = ("seconds", "peak_memory_bytes")
        return [{name: value for name, value in row.items() if name not in varying} for row in self.rows()]


def ended(events):
    return {event["item"]: event["state"] for event in events if event["event"] == "item"}


def worked():
    """Seconds of processors that ended children have taken, with theirs."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def alone(program, place, names, settings):
    """Seconds of each item as a run of its own, with one thread."""
    seconds = {}
    for name in names:
        command = [
            program, "segment", f"in/{name}.tif", "--points", f"in/{name}.csv", "-o", "alone.zarr", "-q",
            "--threads", "1", "--memory", f"{settings.memory // settings.threads}MiB",
        ]  # fmt: skip
        began = time.monotonic()
        subprocess.run(command, cwd=place, check=True)
        seconds[name] = time.monotonic() - began
        shutil.rmtree(place / "alone.zarr")
    return seconds


class Findings:
    """What was as it must be, and what was not."""

    def __init__(self):
        self.bad = 0

    def told(self, is_good, text):
        self.bad += not is_good
        print(f"{'ok  ' if is_good else 'BAD '} {text}", flush=True)


def main():
    settings = arguments()
    program = str(Path(os.environ["STRANDLINE"]).resolve())
    found = Findings()
    with tempfile.TemporaryDirectory(prefix="strandline-batch-", dir=settings.folder) as folder:
        place = Path(folder)
        (place / "in").mkdir()
        names = [f"a{n:02}" for n in range(10)] + [f"b{n:02}" for n in range(29)]
        for seed, name in enumerate(names):
            inputs.write_ball(place / "in", name, seed)
        inputs.spoil(place / "in", BROKEN)
        shutil.copy(place / "in/a00.csv", place / "marks.csv")
        inputs.write_list(place / "jobs.toml")
        whole = [name for name in names if name not in BROKEN]
        batch = Batch(program, place, settings)
        # Half of the items alone before, half after, so that a machine that others use is as busy for both.
        began = worked()
        single = alone(program, place, whole[::2], settings)
        of_single = worked() - began
        before = worked()
        code, events, seconds, peak = batch.run()
        of_batch = worked() - before
        began = worked()
        single |= alone(program, place, whole[1::2], settings)
        of_single += worked() - began
        check_first(batch, (code, events, peak), whole, settings, found)
        share = seconds / (sum(single.values()) / settings.threads)
        is_quick = share <= 1.1 or not settings.strict
        found.told(
            is_quick,
            f"{seconds:.1f} s; alone with one thread {sum(single.values()):.1f} s in all: "
            f"{share:.3f} of that by {settings.threads}",
        )
        print(f"     {of_batch:.1f} s of processors; alone {of_single:.1f} s", flush=True)
        check_again(batch, place, whole, settings, found)
        check_shards(batch, place, found)
    sys.exit(found.bad > 0)


def check_first(batch, ran, whole, settings, found):
    code, _, peak = ran
    states = batch.states()
    done = [name for name, row in states.items() if row["state"] == "done"]
    found.told(code == 3 and sorted(done) == whole, f"exit {code}, {len(done)} results of {len(states)} items")
    reasons = {name: row["reason"] for name, row in states.items() if row["state"] == "failed"}
    is_whole = sorted(reasons) == sorted([*BROKEN, LARGE]) and all(reasons.values())
    is_whole &= "memory at least" in reasons.get(LARGE, "")
    found.told(is_whole and len(set(reasons.values())) == 6, f"{len(reasons)} failures, each with its reason:")
    for name, reason in reasons.items():
        print(f"       {name}: {reason}")
    limit = settings.memory * MIB
    found.told(peak <= limit, f"at most {peak / MIB:.0f} MiB at a time of {settings.memory} MiB")


def check_again(batch, place, whole, settings, found):
    code, events, seconds, _ = batch.run()
    again = ended(events)
    is_idle = code == 3 and set(again) == {*BROKEN, LARGE} and "done" not in again.values()
    is_quick = seconds < 2 or not settings.strict
    found.told(is_idle and is_quick, f"again: exit {code}, nothing computed, {seconds:.2f} s")
    inputs.write_list(place / "jobs.toml", theta=2)
    code, events, seconds, _ = batch.run()
    ran = [name for name, state in ended(events).items() if state == "done"]
    found.told(code == 3 and ran == ["a01"], f"theta of a01 changed: ran {', '.join(ran)}, {seconds:.1f} s")
    shutil.rmtree(place / "out")
    code, events, _, _ = batch.run(kill_after=10)
    before = {name for name, state in ended(events).items() if state == "done"}
    code, events, seconds, _ = batch.run()
    after = {name for name, state in ended(events).items() if state == "done"}
    is_rest = code == 3 and not before & after and sorted(before | after) == whole
    found.told(is_rest, f"killed after {len(before)} items, run again: {len(after)} more, none twice, {seconds:.1f} s")


def check_shards(batch, place, found):
    one = batch.figures()
    shutil.rmtree(place / "out")
    quiet = {"cwd": place, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    # As two nodes of a cluster would run them, each with the limits of the one run, which the reason of what is too large tells.
    both = [subprocess.Popen([*batch.command, "--shard", f"{n}/2"], **quiet) for n in (1, 2)]
    codes = [child.wait() for child in both]
    joined = subprocess.run([*batch.command[:5], "--summary"], check=False, **quiet).returncode
    joint = batch.figures()
    is_same = joint == one
    found.told(
        is_same and joined == 3, f"two shards at once: exit {codes[0]} and {codes[1]}, joined {joined}, as one run"
    )
    for mine, theirs in zip(one, joint, strict=False):
        if mine != theirs:
            print(f"       {mine}\n       {theirs}", flush=True)


if __name__ == "__main__":
    main()
